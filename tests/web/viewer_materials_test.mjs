// Materials and labels in the page of the viewer, in headless Chromium: their colors over slices, the legend, and errors.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { decoded, folder } from "./files.mjs";
import { browser, open, picture, pixelOf, pointOf, readout, server, write } from "./viewer_pages.mjs";
import { palette } from "../../web/viewer/src/materials.js";

const isDone = "tagridViewer.sliceViews.every((view) => !view.isShown || (view.isSettled && view.labelState !== 'reading'))";
const frame = (page) =>
  page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
const textOf = (page, id) => page.evaluate(`document.getElementById("${id}").innerText`);
const rgbOf = (color) => [1, 3, 5].map((i) => Number.parseInt(color.slice(i, i + 2), 16));
/** A color, or none, over a grey. */
const mixed = (color, grey, opacity) =>
  color ? rgbOf(color).map((c) => opacity * c + (1 - opacity) * grey) : [grey, grey, grey];
const assertNear = (found, expected, what) =>
  assert.ok(found.slice(0, 3).every((c, i) => Math.abs(c - expected[i]) <= 2), `${what}: ${found}, not ${expected}`);
const set = (page, id, value) =>
  page.evaluate(`{ const field = document.getElementById("${id}"); field.value = ${JSON.stringify(value)};
    field.dispatchEvent(new Event("input")); field.dispatchEvent(new Event("change")); }`);
/** The rows of the legend: [name, what, color, isVisible]. */
const legend = (page) =>
  page.evaluate(`[...document.querySelectorAll("#legend li")].map((row) => [row.querySelector("label").textContent,
    row.lastElementChild.textContent, getComputedStyle(row.querySelector(".swatch")).backgroundColor,
    row.querySelector("input").checked])`);
const cssOf = (color) => `rgb(${rgbOf(color).join(", ")})`;

const dims = [70, 60, 50];
/** A ball of values around 500 in values around 0, in air: a function of the place. */
const valueOf = (x, y, z) => {
  const r = Math.hypot(x - 35, y - 30, z - 25);
  return Math.round(r < 12 ? 700 - 10 * r : r < 24 ? 90 - r : -1000 + r);
};
const space = ["space: LPS", "space directions: (1,0,0) (0,1,0) (0,0,1)"];
/** Samples are half of the values, with a loss. */
const ball = () =>
  write("ball", dims, Int16Array, (...p) => Math.round(valueOf(...p) / 2), [...space, "rescale_slope:=2", "rescale_intercept:=-6"],
    "--max-error", "2");
const samplesOf = (file, Samples) => {
  const bytes = decoded(join(folder, file.slice(5)));
  return new Samples(bytes.buffer, bytes.byteOffset, bytes.length / Samples.BYTES_PER_ELEMENT);
};
const at = (samples, [x, y, z]) => samples[(z * dims[1] + y) * dims[0] + x];
// In air, in soft values and in bone.
const places = [
  [56, 44, 46],
  [24, 16, 15],
  [34, 26, 25],
  [46, 38, 37],
  [37, 33, 27],
];

const text = "air=:-200,soft=-200:300,bone=300:";

const materialOf = (value) => (value < -200 ? 0 : value < 300 ? 1 : 2);

test("slices have the colors of the materials of the values that the program decodes", async () => {
  const file = ball();
  const samples = samplesOf(file, Int16Array);
  const page = await open(`${file}&materials=${encodeURIComponent(text)}`);
  await page.evaluate("tagridViewer.actions.window(-1000, 1000); tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 1.2)");
  const seen = new Set();
  const check = async (opacity, hidden) => {
    for (const place of places) {
      const value = 2 * at(samples, place) - 6;
      const grey = Math.max(0, Math.min(255, Math.round(((value + 1000) * 255) / 2000)));
      const number = materialOf(value);
      // The cross hair lies elsewhere in each view.
      for (const [view, axis] of [2, 1, 0].entries()) {
        const position = place.map((p, i) => (i === axis ? p : p > 30 ? p - 20 : p + 12));
        await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
        await page.until(isDone);
        const color = number === hidden ? undefined : palette[number];
        assertNear(await pixelOf(page, view, place), mixed(color, grey, opacity), `view ${view} at ${place}`);
        seen.add(`${number} ${view}`);
      }
    }
  };
  await check(0.4);
  assert.equal(seen.size, 9);
  await picture(page, "materials");
  await set(page, "opacity", 100);
  await check(1);
  await set(page, "opacity", 50);
  await page.evaluate(`document.querySelectorAll("#legend input")[1].click()`);
  await check(0.5, 1);
  // Hidden, not forgotten.
  await page.evaluate("tagridViewer.actions.moveTo([20, 30, 25])");
  await page.until(isDone);
  assert.equal((await readout(page)).material, "soft");
  await page.key("l");
  await check(0);
  assert.equal(await page.evaluate(`document.getElementById("show-colors").getAttribute("aria-pressed")`), "false");
  assert.equal((await readout(page)).material, undefined);
  await page.key("L");
  await check(0.5, 1);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("the legend, and the name of the material under the pointer", async () => {
  const file = ball();
  const samples = samplesOf(file, Int16Array);
  const page = await open(`${file}&materials=air=:-200,bone=300:900.5`);
  assert.deepEqual(await legend(page), [
    ["air", "below -200", cssOf(palette[0]), true],
    ["bone", "300 to 900.5", cssOf(palette[1]), true],
  ]);
  const position = await page.evaluate("tagridViewer.state.position");
  const names = new Set();
  for (const x of [1, 14, 25, 33, 36]) {
    const place = [x, 28, position[2]];
    await page.move(...(await pointOf(page, 0, place)));
    const value = 2 * at(samples, place) - 6;
    const { material, value: shown } = await readout(page);
    assert.equal(shown.trim(), String(value));
    assert.equal(material, value < -200 ? "air" : value >= 300 ? "bone" : "none");
    names.add(material);
  }
  assert.equal(names.size, 3);
  // With keys alone: Tab leads to the boxes, and Space presses them.
  await page.evaluate(`document.querySelectorAll("#legend input")[0].focus()`);
  await page.key(" ");
  assert.deepEqual((await legend(page)).map(([, , , isVisible]) => isVisible), [false, true]);
  assert.equal(await page.evaluate(`document.activeElement.type`), "checkbox");
  // Another limit leaves hidden what is hidden.
  await set(page, "materials", "air=:-100,soft=-100:300");
  assert.deepEqual((await legend(page)).map(([name, what, , isVisible]) => [name, what, isVisible]), [
    ["air", "below -100", false],
    ["soft", "-100 to 300", true],
  ]);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("a text is typed, and one with a mistake is refused without colors", async () => {
  const page = await open(ball());
  assert.deepEqual(await legend(page), []);
  assert.equal(await page.evaluate(`document.getElementById("colors-use").hidden`), true);
  await page.evaluate(`{ const choice = document.getElementById("color-by"); choice.value = "values";
    choice.dispatchEvent(new Event("change")); }`);
  assert.equal(await page.evaluate("document.activeElement.id"), "materials");
  for (const key of "bone=300:") await page.key(key);
  await page.evaluate("document.activeElement.blur()");
  assert.deepEqual((await legend(page)).map(([name]) => name), ["bone"]);
  for (const [wrong, message] of [
    ["bone=300", "'bone=300' is not NAME=LOW:HIGH, such as bone=300: or soft=-200:300"],
    ["a=1:3,b=2:", "b begins at 2, but another one ends at 3"],
    ["a=1:x", "a=1:x: 'x' is not a number"],
  ]) {
    await set(page, "materials", wrong);
    assert.equal(await textOf(page, "colors-note"), message);
    assert.equal(await page.evaluate("tagridViewer.state.colors"), undefined);
    assert.deepEqual(await legend(page), []);
  }
  await set(page, "materials", text);
  assert.equal(await textOf(page, "colors-note"), "");
  assert.equal((await legend(page)).length, 3);
  assert.deepEqual(page.errors, []);
  await page.close();
});

const labelOf = (...p) => {
  const value = valueOf(...p);
  return value < -200 ? 0 : value < 300 ? 3 : p[0] < 35 ? 4 : 12;
};
/** Labels in bricks of another size. */
const segmentation = (...options) =>
  write("labels", dims, Uint8Array, labelOf, space, "--overviews", "none", "--brick", "1", ...options);

test("each value of the volume is a label", async () => {
  const page = await open(`${segmentation()}&labels=all`);
  await page.evaluate("tagridViewer.actions.window(0, 20)");
  await page.until(isDone);
  await page.until(`document.querySelectorAll("#legend li").length === 3`);
  // The same color as in any other volume: of the label, not of its rank.
  assert.deepEqual(await legend(page), [
    ["label_3", "", cssOf(palette[2]), true],
    ["label_4", "", cssOf(palette[3]), true],
    ["label_12", "", cssOf(palette[4]), true],
  ]);
  for (const place of [
    [33, 32, 25],
    [38, 32, 25],
    [15, 30, 25],
    [2, 2, 25],
  ]) {
    const label = labelOf(...place);
    const color = label === 0 ? undefined : palette[(label - 1) % 7];
    if (place[1] !== 30) assertNear(await pixelOf(page, 0, place), mixed(color, Math.round((label * 255) / 20), 0.4), `${place}`);
    await page.move(...(await pointOf(page, 0, place)));
    const shown = await readout(page);
    assert.deepEqual([shown.label, shown.material], [String(label), label === 0 ? "none" : `label_${label}`]);
  }
  assert.deepEqual(page.errors, []);
  await page.close();
  // Names in the address, and then from a file.
  const named = await open(`made/labels.tag&labels=${encodeURIComponent("12=left half,3=soft")}`);
  const rows = async () => (await legend(named)).map(([name, what]) => [name, what]);
  assert.deepEqual(await rows(), [
    ["soft", "label 3"],
    ["left half", "label 12"],
  ]);
  writeFileSync(join(folder, "names.csv"), "label,name\n4,right half\n");
  await named.choose("#names-file", [join(folder, "names.csv")]);
  await named.until(`document.querySelectorAll("#legend li").length === 1`);
  assert.deepEqual(await rows(), [["right half", "label 4"]]);
  writeFileSync(join(folder, "names.csv"), "4,a\n4,b\n");
  await named.choose("#names-file", [join(folder, "names.csv")]);
  await named.until(`/two names/.test(document.getElementById("colors-note").textContent)`);
  assert.deepEqual(named.errors, []);
  await named.close();
  // Of a file on a server.
  writeFileSync(join(folder, "names.txt"), '3 0 0 0 1 1 1 "soft tissue"\n');
  const far = await open("made/labels.tag&labels=/made/names.txt");
  await far.until(`document.querySelectorAll("#legend li").length === 1`);
  assert.deepEqual((await legend(far))[0].slice(0, 2), ["soft tissue", "label 3"]);
  await far.close();
});

test("a file of labels colors the slices of another volume", async () => {
  const file = ball();
  const samples = samplesOf(file, Int16Array);
  const labels = samplesOf(segmentation(), Uint8Array);
  const page = await open(`${file}&label-volume=/made/labels.tag&labels=3=soft,4=bone`);
  await page.until("tagridViewer.state.labels?.volume");
  await page.evaluate("tagridViewer.actions.window(-1000, 1000)");
  const seen = new Set();
  for (const place of places)
    for (const [view, axis] of [2, 1, 0].entries()) {
      const position = place.map((p, i) => (i === axis ? p : p > 30 ? p - 20 : p + 12));
      await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
      await page.until(isDone);
      const value = 2 * at(samples, place) - 6;
      const grey = Math.max(0, Math.min(255, Math.round(((value + 1000) * 255) / 2000)));
      const label = at(labels, place);
      const color = label === 3 || label === 4 ? palette[label - 1] : undefined;
      assertNear(await pixelOf(page, view, place), mixed(color, grey, 0.4), `view ${view} at ${place}`);
      await page.move(...(await pointOf(page, view, place)));
      const shown = await readout(page);
      assert.deepEqual([shown.value.trim(), shown.label], [String(value), String(label)]);
      assert.equal(shown.material, { 3: "soft", 4: "bone" }[label] ?? "none");
      seen.add(label);
    }
  assert.deepEqual([...seen].sort((a, b) => a - b), [0, 3, 4, 12]);
  await picture(page, "labels");
  // There are no labels in 3D.
  await page.until("tagridViewer.spaceView.texture");
  assert.equal(await page.evaluate(`document.querySelector(".over select").value`), "surface");
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("labels are read even if the wait for them ends while the page asks what to read", async () => {
  const file = ball();
  segmentation();
  const page = await open(`${file}&label-volume=/made/labels.tag&labels=all`);
  await page.until("tagridViewer.state.labels?.volume");
  await page.until(isDone);
  await page.evaluate("globalThis.clock = () => globalThis.time; performance.now = () => globalThis.clock()");
  for (let before = 1; before <= 8; ++before) {
    await page.evaluate(`globalThis.time = ${before} * 1e6; clock = () => globalThis.time;
      tagridViewer.actions.moveTo([${before}, ${before + 1}, ${before + 2}])`);
    await page.until("tagridViewer.sliceViews.every((view) => view.isSettled)");
    // The wait ends after this many looks at the clock.
    await page.evaluate(`{ let looks = 0; clock = () => globalThis.time + (++looks > ${before} ? 1000 : 0); }`);
    await page.until(isDone, 10);
  }
  await page.close();
});

test("labels that do not fit are refused, with both sizes", async () => {
  write("other", [70, 60, 49], Uint8Array, () => 1);
  write("lossy", dims, Uint8Array, (x) => x, [], "--max-error", "3");
  const page = await open(`${ball()}&label-volume=/made/other.tag`);
  const note = (part) => page.until(`document.getElementById("colors-note").textContent.includes(${JSON.stringify(part)})`);
  await note("other.tag: has 70 x 60 x 49 labels, but ball.tag has 70 x 60 x 50 samples");
  assert.equal(await page.evaluate("tagridViewer.state.colors"), undefined);
  segmentation();
  await page.choose("#label-file", [join(folder, "labels.tag")]);
  await page.until(`${isDone} && document.querySelectorAll("#legend li").length === 3`);
  assert.equal(await textOf(page, "colors-note"), "");
  await page.choose("#label-file", [join(folder, "lossy.tag")]);
  await note("lossy.tag: its samples may be wrong by 3, so they cannot be labels; encode it without a loss");
  await page.choose("#label-file", [join(folder, "other.nrrd")]);
  await note("other.nrrd: ");
  // The samples of the volume themselves.
  await page.evaluate(`{ const choice = document.getElementById("color-by"); choice.value = "labels";
    choice.dispatchEvent(new Event("change")); }`);
  await note("ball.tag: labels must be from 0 to 65535");
  await page.close();
  for (const [query, message] of [
    ["label-volume=/made/none.tag", "none.tag: "],
    ["label-volume=javascript:alert(1)", "an address begins with http:// or https://"],
    ["labels=/made/none.csv", "names of labels: /made/none.csv: the server answers with 404"],
    ["labels=1=a,1=b", "names of labels: label 1 has two names"],
    ["materials=a=1:2&labels=all", "materials: cannot be combined with labels"],
    ["materials=a", "'a' is not NAME=LOW:HIGH"],
  ]) {
    const other = await open(`made/labels.tag&${query}`);
    await other.until(`document.getElementById("colors-note").textContent.includes(${JSON.stringify(message)})`);
    assert.equal(await other.evaluate("tagridViewer.state.colors"), undefined, query);
    await other.close();
  }
});

test("over overviews, labels are still those of single samples, or not shown", async () => {
  const large = [1500, 1480, 6];
  // Without a period, which pixels could have, too.
  const name = (x, y) => 1 + ((((x * 7919) ^ (y * 104729)) >> 3) & 1);
  write("wide", large, Int16Array, (x, y, z) => x + y + z, [], "--overviews", "4,16");
  write("wide_labels", large, Uint8Array, name, [], "--overviews", "4,16");
  const page = await open("made/wide.tag&label-volume=/made/wide_labels.tag");
  await page.until("tagridViewer.state.labels?.volume");
  await page.until(isDone);
  const states = () => page.evaluate("tagridViewer.sliceViews.map(({ shown, labelState }) => [shown > 0, labelState])");
  // As if the volume were larger: the slice across z has 13 million samples.
  const most = (samples) =>
    page.evaluate(`for (const view of tagridViewer.sliceViews) view.mostLabelSamples = ${samples};
      tagridViewer.actions.window(0, 3000)`);
  await most(13e6);
  await page.until(`/Zoom in to see the labels/.test(document.getElementById("status").textContent)`);
  assert.deepEqual(await states(), [[true, "far"], [true, "shown"], [true, "shown"]]);
  await most(14e6);
  await page.evaluate("tagridViewer.actions.step(2, 1)");
  await page.until(`tagridViewer.sliceViews[0].waits === 0 && ${isDone}`);
  assert.deepEqual(await states(), [[true, "shown"], [true, "shown"], [true, "shown"]]);
  await frame(page);
  await picture(page, "labels-over-overview");
  const position = await page.evaluate("tagridViewer.state.position");
  const labels = new Set();
  for (const dx of [-300, -296, -201, 202, 299, 303]) {
    const place = [position[0] + dx, position[1] + 200, position[2]];
    await page.move(...(await pointOf(page, 0, place)));
    const shown = await readout(page);
    // Of the sample that lies there, which is one of several in a pixel.
    const [x, y] = shown.sample.split(", ").map(Number);
    assert.equal(shown.label, String(name(x, y)));
    assert.match(shown[""], /mean in overview/);
    labels.add(shown.label);
  }
  assert.equal(labels.size, 2);
  // No mix of the colors: a sample of each pixel.
  await set(page, "opacity", 100);
  const found = await page.evaluate(`(() => { const view = tagridViewer.sliceViews[0]; view.draw();
    const { data } = view.canvas.getContext("2d").getImageData(260, 220, 60, 60);
    return [...new Set(Array.from({ length: 3600 }, (_, i) => data.slice(4 * i, 4 * i + 3).join(" ")))]; })()`);
  assert.deepEqual(found.sort(), [palette[0], palette[1]].map((color) => rgbOf(color).join(" ")).sort());
  assert.deepEqual(page.errors, []);
  await page.close();
  // Values of overviews are means, and have the materials of these.
  const values = await open("made/wide.tag&materials=low=:1500,high=1500:");
  await values.until(isDone);
  const { shown, x, y } = await values.evaluate(`(() => { const view = tagridViewer.sliceViews[0];
    const [x, y] = tagridViewer.state.position; return { shown: view.shown, x, y }; })()`);
  assert.ok(shown > 0);
  for (const [dx, name] of [[-300, "low"], [300, "high"]]) {
    const place = [x + dx, y - 60, 3];
    await values.move(...(await pointOf(values, 0, place)));
    const row = await readout(values);
    assert.equal(row.material, name);
    assert.match(row[""], /mean in overview/);
    const [r, , b] = await pixelOf(values, 0, place);
    assert.ok(name === "low" ? b > r + 20 : r > b + 20, `${name}: ${r} ${b}`);
  }
  await values.close();
});

/** The pixel in the middle, and one 20 samples from it, where the light comes from. */
const lookAt3d = async (page) => {
  await frame(page);
  await frame(page);
  return page.evaluate(`new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
    const { canvas } = tagridViewer.spaceView, copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const colorOf = (x) => [...context.getImageData(Math.round(x), canvas.height / 2, 1, 1).data].slice(0, 3);
    // 20 samples from the middle.
    const { volume } = tagridViewer.state;
    const shift = (20 / Math.hypot(...volume.dims)) * 1.15 * Math.min(canvas.width, canvas.height);
    done([canvas.width / 2, canvas.width / 2 - shift].map(colorOf));
  })))`);
};
const isLike = ([r, g, b], color) => {
  // Light adds the same to all.
  const [x, y, z] = rgbOf(color);
  return r + g + b > 60 && [[r - g, x - y], [g - b, y - z]].every(([found, expected]) => Math.abs(expected) < 40 || found * expected > 0);
};

test("in 3D, the visible materials have surfaces in their colors", async () => {
  const page = await open(`${ball()}&materials=${encodeURIComponent(text)}`);
  await page.until("tagridViewer.spaceView.texture");
  assert.equal(await page.evaluate(`document.querySelector(".over select").value`), "materials");
  await picture(page, "materials-3d");
  let [middle, edge] = await lookAt3d(page);
  assert.ok(isLike(edge, palette[1]), `soft: ${edge}`);
  // Bone is seen through what is around it; air, which has no lower limit, is not drawn.
  assert.notDeepEqual(middle, edge);
  await page.evaluate(`document.querySelectorAll("#legend input")[1].click()`);
  [middle, edge] = await lookAt3d(page);
  assert.ok(isLike(middle, palette[2]), `bone: ${middle}`);
  assert.deepEqual(edge, [0, 0, 0]);
  await page.evaluate(`document.querySelectorAll("#legend input")[2].click()`);
  assert.deepEqual(await lookAt3d(page), [[0, 0, 0], [0, 0, 0]]);
  // Without colors, it is the surface of one value again.
  await page.evaluate(`{ const choice = document.getElementById("color-by"); choice.value = "none";
    choice.dispatchEvent(new Event("change")); }`);
  assert.equal(await page.evaluate(`document.querySelector(".over select").value`), "surface");
  [middle] = await lookAt3d(page);
  assert.ok(Math.max(...middle) > 40, `${middle}`);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("in 3D, a sample that is equal to the lower end of a material belongs to it", async () => {
  const value = (x, y, z) => {
    const r = Math.hypot(x - 35, y - 30, z - 25);
    return r < 5 ? 3 : r < 12 ? 2 : r < 24 ? 1 : 0;
  };
  const file = write("few", dims, Uint8Array, value, space);
  const page = await open(`${file}&materials=${encodeURIComponent("a=1:2,b=2:3,c=3:")}`);
  await page.until("tagridViewer.spaceView.texture");
  const [middle, edge] = await lookAt3d(page);
  assert.ok(isLike(edge, palette[0]), `a: ${edge}`);
  assert.notDeepEqual(middle, edge);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("labels that lie elsewhere are colored, with a note", async () => {
  const file = write("here", dims, Uint8Array, () => 5, space);
  const mirrored = ["space: LPS", "space directions: (-1,0,0) (0,1,0) (0,0,1)"];
  for (const [lines, note] of [[space, /^$/], [mirrored, /lie elsewhere than the samples/]]) {
    const labels = write("places", dims, Uint8Array, () => 1, lines, "--overviews", "none");
    const page = await open(`${file}&label-volume=/${labels}`);
    await page.until("tagridViewer.state.colors");
    assert.match(await textOf(page, "colors-note"), note);
    await page.close();
  }
});

test("another volume of the file keeps the colors, and another file gets them", async () => {
  const page = await open("golden/volumes_bounded_int16.tag&materials=low=:0,high=0:");
  assert.equal((await legend(page)).length, 2);
  await page.evaluate(`document.querySelectorAll("#legend input")[0].click()`);
  await page.evaluate(`globalThis.before = tagridViewer.state.volume; { const choice = document.getElementById("volume");
    choice.value = "1"; choice.dispatchEvent(new Event("change")); }`);
  await page.until(`tagridViewer.state.volume !== before && ${isDone}`);
  assert.deepEqual((await legend(page)).map(([name, , , isVisible]) => [name, isVisible]), [["low", false], ["high", true]]);
  ball();
  await page.choose("#file", [join(folder, "ball.tag")]);
  await page.until(`tagridViewer.state.volume.dims[0] === 70 && ${isDone}`);
  assert.equal((await legend(page)).length, 2);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("where slices have slopes of their own, values are not colored, and the page says why", async () => {
  const file = write("slopes", [20, 20, 3], Int16Array, (x) => x, ["slice_slopes:=1 0.5 0.1", "slice_intercepts:=0 -3 1"]);
  const page = await open(`${file}&materials=a=1:`);
  await page.until(`/each slice has its own slope/.test(document.getElementById("colors-note").textContent)`);
  await page.close();
});

test("on a phone, the panel fits", async () => {
  ball();
  const page = await browser.newPage(360, 740, true);
  await page.goTo(server.url(`viewer/index.html?src=/made/ball.tag&materials=${encodeURIComponent(text)}`));
  await page.until("tagridViewer.times.complete");
  await page.evaluate(`document.getElementById("legend").scrollIntoView()`);
  await picture(page, "materials-phone");
  assert.equal(await page.evaluate("document.documentElement.scrollWidth"), 360);
  assert.deepEqual(
    await page.evaluate(`[...document.querySelectorAll("button, input, select")].filter((e) =>
    !(e.textContent.trim() || e.labels?.length || e.getAttribute("aria-label"))).map((e) => e.outerHTML)`),
    [],
  );
  await page.close();
});
