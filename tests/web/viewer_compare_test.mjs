// Two files in the page of the viewer, in headless Chromium: side by side, and their difference with the bounds of both.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { join } from "node:path";
import { test } from "node:test";
import { decoded, folder } from "./files.mjs";
import { browser, open, picture, pixelOf, pointOf, write } from "./viewer_pages.mjs";

const isDone = `tagridViewer.second.volume && [...tagridViewer.sliceViews, ...tagridViewer.secondViews].every((view) =>
  !view.isShown || view.isSettled)`;
const textOf = (page, id) => page.evaluate(`document.getElementById("${id}").innerText`);
const set = (page, id, value) =>
  page.evaluate(`{ const field = document.getElementById("${id}"); field.value = ${JSON.stringify(value)};
    field.dispatchEvent(new Event("input")); field.dispatchEvent(new Event("change")); }`);
const frame = (page) =>
  page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
const readout = (page) =>
  page.evaluate(`Object.fromEntries([...document.querySelectorAll("#readout dt")].map((e) => [e.textContent, e.nextSibling.textContent]))`);
const rowsOf = (page) =>
  page.evaluate(`Object.fromEntries([...document.querySelectorAll("#compare-bounds dt")].map((e) => [e.textContent, e.nextSibling.textContent]))`);
const samplesOf = (file, Samples) => {
  const bytes = decoded(join(folder, file.slice(5)));
  return new Samples(bytes.buffer, bytes.byteOffset, bytes.length / Samples.BYTES_PER_ELEMENT);
};
/** The pixel of a second view. */
const secondPixel = (page, view, place) =>
  page.evaluate(`(() => { const view = tagridViewer.secondViews[${view}], place = ${JSON.stringify(place)};
    view.draw();
    const [x, y] = view.pointOf([place[view.across] + 0.5, place[view.down] + 0.5]);
    return [...view.canvas.getContext("2d").getImageData(Math.floor(x), Math.floor(y), 1, 1).data].slice(0, 3); })()`);

const dims = [80, 70, 66];
const space = ["space: LPS", "space directions: (1,0,0) (0,1,0) (0,0,1)", "rescale_units:=HU"];
const original = (x, y, z) => Math.round(200 * Math.sin(x / 7) + 150 * Math.cos(y / 5) + 3 * z + ((x * 31 + y * 17 + z * 7) % 23));
// A ball in which the second file has other values.
const isOther = (x, y, z) => Math.hypot(x - 30, y - 40, z - 33) < 9;
const first = () => write("one", dims, Int16Array, original, space, "--max-error", "4");
/** Another slope, another type and another bound. */
const second = () =>
  write(
    "two",
    dims,
    Int32Array,
    (...p) => 2 * (original(...p) + (isOther(...p) ? 60 : 0)) + 200,
    [...space, "rescale_slope:=0.5", "rescale_intercept:=-100"],
    "--max-error",
    "2",
    "--brick",
    "2",
  );

test("side by side: one place, one zoom, one window, and the values of both", async () => {
  const [a, b] = [samplesOf(first(), Int16Array), samplesOf(second(), Int32Array)];
  const at = (samples, [x, y, z]) => samples[(z * dims[1] + y) * dims[0] + x];
  const page = await open(`made/one.tag&compare=/made/two.tag`);
  await page.until(isDone);
  await page.evaluate("tagridViewer.actions.window(-300, 700)");
  await page.evaluate("tagridViewer.actions.moveTo([30, 40, 33])");
  await page.until(isDone);
  await frame(page);
  await picture(page, "beside");
  const grey = (value) => Math.max(0, Math.min(255, Math.round(((value + 300) * 255) / 1000)));
  for (const [view, axis] of [2, 1, 0].entries())
    for (const place of [[20, 30, 20], [34, 44, 37], [70, 12, 60], [64, 64, 64]]) {
      place[axis] = [30, 40, 33][axis];
      if (place.some((p, i) => i !== axis && Math.abs(p - [30, 40, 33][i]) < 4)) continue;
      const values = [at(a, place), 0.5 * at(b, place) - 100];
      assert.deepEqual((await pixelOf(page, view, place)).slice(0, 3), new Array(3).fill(grey(values[0])));
      assert.deepEqual(await secondPixel(page, view, place), new Array(3).fill(grey(values[1])));
      await page.move(...(await pointOf(page, view, place)));
      const shown = await readout(page);
      assert.deepEqual([shown.value, shown["second: value"]], values.map((value) => `${value} HU`));
    }
  // A drag of the cross hair in a second view, and a wheel with Ctrl there, move both.
  const [x, y] = await page.evaluate(`(() => { const view = tagridViewer.secondViews[0], box = view.canvas.getBoundingClientRect();
    return view.pointOf([20.5, 25.5]).map((p, i) => Math.round(p + [box.left, box.top][i])); })()`);
  await page.drag([x + 30, y], [x, y]);
  assert.deepEqual(await page.evaluate("tagridViewer.state.position"), [20, 25, 33]);
  const zoom = await page.evaluate("tagridViewer.state.zoom");
  const under = () => page.evaluate(`(() => { const view = tagridViewer.secondViews[0], box = view.canvas.getBoundingClientRect();
    return view.placeAt(${x} - box.left, ${y} - box.top); })()`);
  const held = await under();
  await page.wheel(x, y, -200, 2);
  await page.until(`tagridViewer.state.zoom > ${zoom}`);
  const now = await under();
  assert.ok(Math.hypot(now[0] - held[0], now[1] - held[1]) < 0.02, `${held} ${now}`);
  assert.deepEqual(...(await page.evaluate("[tagridViewer.sliceViews[0].center, tagridViewer.secondViews[0].center]")));
  assert.deepEqual(await rowsOf(page), { "one.tag": "lossy: errors up to 4 HU", "two.tag": "lossy: errors up to 2 HU" });
  // One plane alone has two views; closing the second file leaves the four views.
  const shown = () => page.evaluate(`[...document.querySelectorAll("#views section")].filter((e) => !e.hidden).length`);
  assert.equal(await shown(), 6);
  await page.key("m");
  assert.equal(await shown(), 2);
  await page.key("m");
  await page.evaluate(`document.getElementById("compare-close").click()`);
  assert.equal(await shown(), 4);
  assert.equal((await readout(page))["second: value"], undefined);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("the difference has its colors, and marks exactly the samples beyond the sum of the bounds", async () => {
  const [a, b] = [samplesOf(first(), Int16Array), samplesOf(second(), Int32Array)];
  const difference = ([x, y, z]) => {
    const i = (z * dims[1] + y) * dims[0] + x;
    return 0.5 * b[i] - 100 - a[i];
  };
  const page = await open(`made/one.tag&compare=/made/two.tag&compare-by=difference`);
  await page.until(isDone);
  const position = [30, 40, 33];
  await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
  await page.until(isDone);
  await frame(page);
  await frame(page);
  await picture(page, "difference");
  // The sum of the bounds, 6 HU, is the end of the colors.
  assert.equal(await page.evaluate(`document.getElementById("compare-end").value`), "6");
  const colorOf = (value, end, limit) => {
    if (Math.abs(value) > limit) return [255, 255, 0];
    const share = Math.round((value / end) * 255) / 255;
    const to = share < 0 ? [72, 160, 255] : [255, 124, 60];
    return to.map((c) => Math.round(32 + Math.min(Math.abs(share), 1) * (c - 32)));
  };
  let [marked, plain, checked] = [0, 0, 0];
  const check = async (end) => {
    for (const [view, axis] of [2, 1, 0].entries())
      for (let i = 0; i < 12; ++i) {
        const place = [[23, 34, 26], [36, 46, 39], [10, 20, 12], [64, 60, 50], [25, 45, 30], [40, 30, 58]][i % 6].map((p) => p + Math.floor(i / 6));
        place[axis] = position[axis];
        if (place.some((p, k) => k !== axis && Math.abs(p - position[k]) < 3)) continue;
        const value = difference(place);
        assert.deepEqual(await secondPixel(page, view, place), colorOf(value, end, 6), `${place}: ${value}`);
        ++checked;
        if (Math.abs(value) > 6) ++marked;
        else ++plain;
      }
  };
  await check(6);
  assert.ok(marked > 5 && plain > 5, `${marked} ${plain}`);
  await set(page, "compare-end", "3");
  await frame(page);
  await check(3);
  // The number of marks, in the three slices that are wholly shown, is that of the samples.
  let [beyond, largest, samples] = [0, 0, 0];
  const count = (place) => {
    ++samples;
    beyond += Math.abs(difference(place)) > 6;
    largest = Math.max(largest, Math.abs(difference(place)));
  };
  for (let y = 0; y < dims[1]; ++y) for (let x = 0; x < dims[0]; ++x) count([x, y, 33]);
  for (let z = 0; z < dims[2]; ++z) for (let x = 0; x < dims[0]; ++x) count([x, 40, z]);
  for (let z = 0; z < dims[2]; ++z) for (let y = 0; y < dims[1]; ++y) count([30, y, z]);
  assert.ok(beyond > 400);
  const rows = await rowsOf(page);
  assert.equal(rows["sum of the bounds"], "6 HU");
  assert.equal(rows["beyond the sum there"], `${beyond} of ${samples} samples`);
  assert.equal(rows["largest in the bricks shown"], `${largest} HU`);
  await page.move(...(await pointOf(page, 0, [64, 60, 33])));
  assert.equal((await readout(page)).difference, `${difference([64, 60, 33])} HU`);
  // By the key, side by side and back.
  await page.key("d");
  assert.equal(await page.evaluate("tagridViewer.second.isDifference"), false);
  await page.key("d");
  assert.equal(await page.evaluate("tagridViewer.second.isDifference"), true);
  // Another size is refused, with both.
  write("smaller", [80, 70, 65], Int16Array, original, space);
  await page.choose("#second-file", [join(folder, "smaller.tag")]);
  await page.until(`document.getElementById("compare-note").textContent.includes("cannot")`);
  assert.equal(await textOf(page, "compare-note"), "smaller.tag has 80 × 70 × 65 samples, but one.tag has 80 × 70 × 66: they cannot be compared");
  assert.equal(await page.evaluate("tagridViewer.second.volume"), undefined);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("exact files differ where one sample differs; without a bound, nothing is marked", async () => {
  const size = [20, 18, 16];
  const floats = (x, y, z) => Math.fround(0.1 * x + y / 3 + z);
  write("exact-a", size, Float32Array, (x, y, z) => (x === 3 && y === 4 ? NaN : floats(x, y, z)));
  write("exact-b", size, Float32Array, (x, y, z) =>
    (x === 3 || x === 12) && y === 4 ? NaN : x === 5 && y === 6 ? floats(x, y, z) + 0.5 : floats(x, y, z),
  );
  const page = await open("made/exact-a.tag&compare=/made/exact-b.tag&compare-by=difference");
  await page.until(isDone);
  await frame(page);
  await frame(page);
  const yellow = [255, 255, 0];
  const z = await page.evaluate("tagridViewer.state.position[2]");
  assert.deepEqual(await secondPixel(page, 0, [5, 6, z]), yellow);
  // A number against none differs; none against none is none.
  assert.deepEqual(await secondPixel(page, 0, [12, 4, z]), yellow);
  assert.deepEqual(await secondPixel(page, 0, [3, 4, z]), [110, 0, 140]);
  assert.deepEqual(await secondPixel(page, 0, [15, 13, z]), [32, 32, 32]);
  assert.match((await rowsOf(page))["beyond the sum there"], /^2 of \d+ samples$/);
  assert.equal((await rowsOf(page))["largest in the bricks shown"], "0.5");
  assert.deepEqual(page.errors, []);
  await page.close();
  const unbound = "golden/grid_exact_uint8.tag";
  const other = await open(`${unbound}&compare=/${unbound}&compare-by=difference`);
  await other.until(isDone);
  await frame(other);
  const rows = await rowsOf(other);
  assert.equal(rows["grid_exact_uint8.tag"], "lossy: errors have no bound");
  assert.equal(rows["sum of the bounds"], "none: nothing is marked");
  assert.equal(rows["beyond the sum there"], undefined);
  assert.deepEqual(other.errors, []);
  await other.close();
});

test("`tagrid view` with two files shows both", async (t) => {
  const [a, b] = [first(), second()].map((file) => join(folder, file.slice(5)));
  const process_ = spawn(process.env.TAGRID_PROGRAM, ["view", a, b, "--no-browser"], { stdio: ["ignore", "pipe", "ignore"] });
  t.after(() => process_.kill());
  const [line] = await once(process_.stdout, "data", { signal: AbortSignal.timeout(60000) });
  const page = await browser.newPage(1280, 860);
  await page.goTo(line.toString().trim());
  await page.until(`tagridViewer.times.complete && ${isDone}`);
  const place = [30, 40, 33];
  await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(place)})`);
  await page.until(isDone);
  const [one, two] = [samplesOf("made/one.tag", Int16Array), samplesOf("made/two.tag", Int32Array)].map((samples) =>
    samples[(place[2] * dims[1] + place[1]) * dims[0] + place[0]]);
  const shown = await readout(page);
  assert.deepEqual([shown.value, shown["second: value"]], [`${one} HU`, `${0.5 * two - 100} HU`]);
  // The difference, by the key and by the address that follows.
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  await page.key("d");
  await page.until(`tagridViewer.second.isDifference && ${isDone} && /compare-by=difference/.test(location.search)`);
  assert.equal((await readout(page)).difference, `${0.5 * two - 100 - one} HU`);
  assert.deepEqual(page.errors, []);
  await page.close();
});
