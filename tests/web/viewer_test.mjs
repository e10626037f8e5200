// The page of the viewer in headless Chromium: what it shows is what the program decodes, and it reads little.
// With TAGRID_PICTURES=FOLDER, it leaves pictures of the page there.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { copyFileSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { startChromium } from "./chromium.mjs";
import { decoded, folder, made, tagrid } from "./files.mjs";
import { edgesOf, meshOf } from "./mesh.mjs";
import { serve } from "./server.mjs";
import { browser, litPart, open, picture, pixelOf, pointOf, readout, server, viewer } from "./viewer_pages.mjs";

const dims = [150, 140, 130];
let scanned;
/** A phantom with values in HU, spacing and overviews: /made/scan.tag. */
const scan = () => (scanned ??= makeScan());
function makeScan() {
  const path = join(folder, "scan.tag");
  const head = [
    "NRRD0004",
    "type: int16",
    "dimension: 3",
    `sizes: ${dims.join(" ")}`,
    "encoding: raw",
    "endian: little",
    "space: left-posterior-superior",
    "space directions: (0.5,0,0) (0,0.5,0) (0,0,0.8)",
    "space origin: (-30,-40,100)",
    "rescale_slope:=2",
    "rescale_intercept:=-100",
    "rescale_units:=HU",
  ];
  tagrid("phantom", "--dims", dims.join(","), "-q", "-o", join(folder, "scan.raw"));
  writeFileSync(join(folder, "scan.nhdr"), `${[...head, "data file: scan.raw"].join("\n")}\n`);
  tagrid("encode", join(folder, "scan.nhdr"), "--max-error", "4", "--overviews", "4", "-q", "-o", path);
  const bytes = decoded(path);
  const samples = new Int16Array(bytes.buffer, bytes.byteOffset, bytes.length / 2);
  return { path, value: ([x, y, z]) => 2 * samples[(z * dims[1] + y) * dims[0] + x] - 100 };
}

before(scan);

test("values under the pointer and greys are those of the program", async () => {
  const { value } = scan();
  const page = await open("made/scan.tag");
  await page.evaluate(`document.getElementById("window-width").value = 1500;
    document.getElementById("window-level").value = -200;
    document.getElementById("window-level").dispatchEvent(new Event("input"))`);
  // Samples of two pixels or more are drawn as they are.
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 1.3)");
  let bright = 0;
  for (const position of [
    [75, 70, 65],
    [40, 75, 3],
    [99, 20, 129],
    [64, 63, 127],
  ]) {
    await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
    await page.until("tagridViewer.sliceViews.every((view) => view.isComplete)");
    for (const [view, axis] of [2, 1, 0].entries())
      for (const [a, b] of [
        [31, 42],
        [63, 64],
        [65, 65],
        [100, 90],
        [20, 95],
      ]) {
        const place = [a, b];
        place.splice(axis, 0, position[axis]);
        await page.move(...(await pointOf(page, view, place)));
        const shown = await readout(page);
        assert.equal(shown.sample, place.join(", "));
        assert.equal(shown.value, `${value(place)} HU`, `${place}`);
        if (place.some((p, i) => i !== axis && Math.abs(p - position[i]) < 4)) continue;
        const grey = Math.max(0, Math.min(255, Math.round(((value(place) + 950) * 255) / 1500)));
        const found = await pixelOf(page, view, place);
        assert.deepEqual(found, [grey, grey, grey, 255], `view ${view} at ${place}`);
        bright += grey > 20;
      }
  }
  assert.ok(bright > 10);
  await page.move(...(await pointOf(page, 0, [10, 20, 64])));
  assert.equal((await readout(page))["position (units)"], "-25, -30, 201.6");
  assert.match(await page.evaluate(`document.getElementById("bounds").innerText`), /largest error allowed\s+4 HU/);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("an overview first, and then only the bricks that are seen", async () => {
  const path = made("large", [700, 640, 130], "int16", "--max-error", "5", "--overviews", "4,16");
  const page = await open("made/large.tag?delay=30");
  const first = await page.evaluate("tagridViewer.times");
  assert.ok(first.first < first.complete);
  const { bytes } = server.seen("/made/large.tag");
  const { size } = await (await import("node:fs/promises")).stat(path);
  assert.ok(bytes < size, `${bytes} of ${size}`);
  // Far in, only a few bricks of the volume itself.
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 40)");
  await page.until("tagridViewer.sliceViews.every((view) => view.isComplete && view.shown === 0)");
  await picture(page, "zoomed");
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("the grid over a slice", async () => {
  const path = made("grid", [75, 70, 67], "uint8", "--max-error", "2");
  const page = await open("made/grid.tag");
  const [x, y, z] = [37, 35, 33];
  assert.deepEqual(await page.evaluate("tagridViewer.state.position"), [x, y, z]);
  await page.evaluate(`tagridViewer.actions.one("axial")`);
  await page.key("g");
  await page.until(`tagridViewer.sliceViews[0].gridState === "shown"`);
  await page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
  assert.equal(await page.evaluate(`document.getElementById("grid").getAttribute("aria-pressed")`), "true");
  await picture(page, "grid");
  /** The share of a sample of some edges at whose middles the picture is blue, moved by some pixels. */
  const blue = (places) =>
    page.evaluate(`(() => { const view = tagridViewer.sliceViews[0];
      view.draw();
      const context = view.canvas.getContext("2d"), places = ${JSON.stringify(places)};
      let found = 0;
      for (const [u, v] of places) {
        const [x, y] = view.pointOf([u + 0.5, v + 0.5]);
        const { data } = context.getImageData(Math.round(x) - 1, Math.round(y) - 1, 3, 3);
        let most = 0;
        for (let i = 0; i < data.length; i += 4) most = Math.max(most, data[i + 2] - data[i]);
        found += most > 40;
      }
      return found / places.length; })()`);
  // Away from the cross hair, the names and the bars.
  const seen = ([u, v]) => Math.abs(u - x) > 2 && Math.abs(v - y) > 2 && u > 20 && u < 60 && v > 20 && v < 60;
  const edges = edgesOf(meshOf(path), 2, z).map((text) => text.split(" ").map(Number));
  const middles = edges.map(([a, b, c, d]) => [(a + c) / 2, (b + d) / 2]).filter(seen);
  assert.ok(middles.length > 200, `${middles.length}`);
  assert.ok((await blue(middles)) > 0.98, `${await blue(middles)}`);
  // Places that no edge is near.
  const distance = ([u, v], [a, b, c, d]) => {
    const share = ((u - a) * (c - a) + (v - b) * (d - b)) / ((c - a) ** 2 + (d - b) ** 2);
    const t = Math.min(Math.max(share, 0), 1);
    return Math.hypot(u - a - t * (c - a), v - b - t * (d - b));
  };
  const free = [];
  for (let v = 20.5; v < 60; ++v)
    for (let u = 20.25; u < 60; u += 0.5)
      if (seen([u, v]) && edges.every((edge) => distance([u, v], edge) > 0.35)) free.push([u, v]);
  assert.ok(free.length > 50, `${free.length}`);
  assert.ok((await blue(free)) < 0.02, `${await blue(free)}`);
  await page.evaluate(`document.getElementById("grid").click()`);
  assert.equal(await blue(middles), 0);
  assert.deepEqual(page.errors, []);
  // Of a file that stores no grid, it says so; and over an overview, that one must zoom in.
  await page.close();
  for (const [file, text] of [
    ["golden/voxels_derived_grid_int16.tag", /stores no grid/],
    ["made/large.tag", /Zoom in/],
  ]) {
    made("large", [700, 640, 130], "int16", "--max-error", "5", "--overviews", "4,16");
    const other = await open(file);
    await other.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 0.3)");
    await other.key("g");
    await other.until(`/grid/.test(document.getElementById("status").textContent)`);
    assert.match(await other.evaluate(`document.getElementById("status").textContent`), text);
    assert.deepEqual(other.errors, []);
    await other.close();
  }
});

test("mouse and keys", async () => {
  const page = await open("made/scan.tag");
  const state = (what) => page.evaluate(`tagridViewer.state.${what}`);
  const [x, y] = await pointOf(page, 0, [75, 70, 65]);
  await page.drag(await pointOf(page, 0, [60, 50, 65]), await pointOf(page, 0, [30, 100, 65]));
  assert.deepEqual(await state("position"), [30, 100, 65]);
  await page.wheel(x, y, 120);
  await page.until("tagridViewer.state.position[2] === 66");
  const { low, high } = await state("shades");
  await page.drag([x, y], [x + 60, y - 40], "right");
  const after = await state("shades");
  assert.ok(after.high - after.low > 1.2 * (high - low));
  assert.ok(after.low + after.high < low + high);
  const zoom = await state("zoom");
  await page.wheel(x, y, -200, 2);
  await page.until(`tagridViewer.state.zoom > ${zoom}`);
  const center = await page.evaluate("tagridViewer.sliceViews[0].center");
  await page.drag([x, y], [x + 30, y], "middle");
  assert.ok((await page.evaluate("tagridViewer.sliceViews[0].center"))[0] < center[0]);
  await page.key("0");
  assert.ok(Math.abs((await state("zoom")) - zoom) < 1e-9);
  await page.key("ArrowRight");
  await page.key("ArrowDown");
  await page.key("PageUp");
  await page.key("ArrowLeft", 8);
  assert.deepEqual(await state("position"), [21, 101, 67]);
  await page.key("2");
  assert.equal(await state("tool"), "window");
  await page.key("m");
  assert.equal(
    await page.evaluate(`[...document.querySelectorAll("#views section")].filter((e) => !e.hidden).length`),
    1,
  );
  await page.key("m");
  // Every control has a name, and can be reached.
  assert.deepEqual(
    await page.evaluate(`[...document.querySelectorAll("button, input, select")].filter((e) =>
    !(e.textContent.trim() || e.labels?.length || e.getAttribute("aria-label"))).map((e) => e.outerHTML)`),
    [],
  );
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("a picture in space", async () => {
  const page = await open("made/scan.tag");
  await page.until("tagridViewer.spaceView.texture");
  const lit = () => litPart(page);
  const surface = await lit();
  assert.ok(surface > 0.01 && surface < 0.6, `${surface}`);
  await picture(page, "desktop");
  // A surface around air is the whole box.
  await page.evaluate(
    `{ const slider = document.querySelector(".over input[type=range]");
    slider.value = 0; slider.dispatchEvent(new Event("input")); }`,
  );
  assert.ok((await lit()) > surface);
  await page.evaluate(
    `{ const kind = document.querySelector(".over select");
    kind.value = "fog"; kind.dispatchEvent(new Event("change")); }`,
  );
  assert.ok((await lit()) > 0.01);
  await picture(page, "fog");
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("on a phone", async () => {
  scan();
  const page = await open("made/scan.tag", 360, 740, true);
  await picture(page, "phone");
  assert.equal(await page.evaluate("document.documentElement.scrollWidth"), 360);
  // Rows of buttons scroll: all of them can be brought into the page.
  assert.deepEqual(
    await page.evaluate(`[...document.querySelectorAll("header button, header label, header input, nav button")]
    .filter((e) => e.id !== "file" && e.offsetParent).filter((e) => {
      e.scrollIntoView();
      const { left, right } = e.getBoundingClientRect();
      return left < 0 || right > 360;
    }).map((e) => e.outerHTML)`),
    [],
  );
  await page.evaluate(`document.querySelector("[data-tab=coronal]").click()`);
  await page.until("tagridViewer.sliceViews[1].isShown && tagridViewer.sliceViews[1].isComplete");
  await page.close();
});

test("a file of this machine, and what is no such file", async () => {
  const page = await browser.newPage(1000, 700);
  await page.goTo(server.url("viewer/index.html"));
  await page.until("document.readyState === 'complete'");
  await picture(page, "welcome");
  await page.choose("#file", [join(folder, "scan.nhdr")]);
  await page.until(`document.getElementById("failure").textContent`);
  await page.choose("#file", [join(folder, "scan.tag")]);
  await page.until("tagridViewer.times.complete");
  assert.equal(await page.evaluate(`document.getElementById("welcome").hidden`), true);
  for (const [source, message] of [
    ["javascript:alert(1)", /http/],
    ["/made/none.tag", /404/],
    ["/made/scan.nhdr", /scan\.nhdr/],
  ]) {
    await page.goTo(server.url(`viewer/index.html?src=${encodeURIComponent(source)}`));
    await page.until(`document.getElementById("failure").textContent`);
    assert.match(await page.evaluate(`document.getElementById("failure").textContent`), message);
  }
  await page.close();
});

test("files of every type, and of several volumes", async () => {
  for (const file of [
    "voxels_lossless_float32.tag",
    "voxels_bounded_int16.tag",
    "volumes_bounded_int16.tag",
    "pages_lossless_uint8.tag",
  ]) {
    const page = await open(`golden/${file}`);
    assert.equal(await page.evaluate(`document.getElementById("volume-choice").hidden`), !file.startsWith("volumes"));
    if (file.startsWith("volumes")) {
      await page.evaluate(
        `{ const choice = document.getElementById("volume");
        choice.value = "1"; choice.dispatchEvent(new Event("change")); }`,
      );
      await page.until("tagridViewer.sliceViews.every((view) => view.isComplete)");
    }
    assert.deepEqual(page.errors, []);
    await page.close();
  }
});

test("the volume that is shown is the one that is chosen last", async () => {
  const page = await open("golden/volumes_bounded_int16.tag");
  await page.evaluate(`{
    globalThis.first = tagridViewer.state.volume;
    const volume = first.volume.bind(first);
    first.volume = async (number) => {
      const found = await volume(number);
      await new Promise((resolve) => setTimeout(resolve, number === 1 ? 400 : 0));
      if (globalThis.isDamaged) throw new Error("volume 1 is damaged");
      return found;
    };
    globalThis.choose = (value) => {
      const choice = document.getElementById("volume");
      choice.value = value;
      choice.dispatchEvent(new Event("change"));
    };
  }`);
  const pause = () => page.evaluate("new Promise((done) => setTimeout(done, 800))");
  const isFirst = () => page.evaluate("tagridViewer.state.volume === first");
  await page.evaluate(`choose("1"); choose("0")`);
  await pause();
  assert.ok(await isFirst());
  // One that cannot be opened is not what the list names.
  await page.evaluate(`globalThis.isDamaged = true; choose("1")`);
  await pause();
  assert.ok(await isFirst());
  assert.equal(await page.evaluate(`document.getElementById("volume").value`), "0");
  await page.evaluate("tagridViewer.actions.step(2, 1)");
  await pause();
  assert.match(await page.evaluate(`document.getElementById("status").textContent`), /volume 1 is damaged/);
  await page.evaluate(`globalThis.isDamaged = false; choose("1")`);
  await pause();
  assert.ok(!(await isFirst()));
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("what a server did not give is asked for again", async () => {
  const page = await open("made/scan.tag");
  await page.evaluate(`{
    const { volume } = tagridViewer.state;
    const read = volume.read.bind(volume);
    globalThis.isDown = true;
    volume.read = async (wanted) => {
      if (isDown) throw Object.assign(new Error("no answer"), { code: "io-error" });
      return read(wanted);
    };
    tagridViewer.actions.moveTo([20, 30, 40]);
  }`);
  await page.until(`document.getElementById("status").textContent === "no answer"`);
  await page.evaluate("isDown = false");
  await page.until("tagridViewer.sliceViews.every((view) => view.isComplete)");
  await page.until(`document.getElementById("status").textContent === ""`);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("a file whose name is no UTF-8", async () => {
  copyFileSync(scan().path, join(folder, "caf%E9.tag"));
  const page = await open("made/caf%25E9.tag");
  assert.equal(await page.evaluate(`document.getElementById("name").textContent`), "caf%E9.tag");
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("served by `tagrid view`", async (t) => {
  const process_ = spawn(process.env.TAGRID_PROGRAM, ["view", join(folder, "scan.tag"), "--no-browser"], {
    stdio: ["ignore", "pipe", "ignore"],
  });
  t.after(() => process_.kill());
  const [line] = await once(process_.stdout, "data", { signal: AbortSignal.timeout(60000) });
  const page = await browser.newPage(1000, 700);
  await page.goTo(line.toString().trim());
  await page.until("tagridViewer.times.complete && tagridViewer.spaceView.texture");
  assert.equal(await page.evaluate("document.title"), "scan.tag – tagrid viewer");
  assert.deepEqual(page.errors, []);
  await page.close();
  process_.kill("SIGINT");
  const [code] = await once(process_, "exit");
  assert.equal(code, 0);
});

/** A volume of a terabyte behind 50 ms; `asked` has the time and the bytes of each request for it. */
async function farTerabyte() {
  const path = join(folder, "part.tag");
  tagrid("phantom", "--dims", "256,256,256", "-q", "-f", "-o", join(folder, "part.nrrd"));
  tagrid("encode", join(folder, "part.nrrd"), "--max-error", "5", "--overviews", "4", "-q", "-f", "-o", path);
  const process_ = spawn(process.env.TAGRID_TERABYTE_SERVER, [path], { stdio: ["pipe", "pipe", "inherit"] });
  const [line] = await once(process_.stdout, "data", { signal: AbortSignal.timeout(60000) });
  const [port, size] = line.toString().split(" ").map(Number);
  assert.ok(size > 1e11, `${size}`);
  const count = { requests: 0, bytes: 0 };
  const asked = [];
  const far = await serve(
    { viewer },
    {
      "/scan.tag": async (request, response) => {
        ++count.requests;
        const entry = { at: Date.now(), bytes: 0 };
        asked.push(entry);
        await new Promise((resolve) => setTimeout(resolve, 50));
        const answer = await fetch(`http://127.0.0.1:${port}/scan.tag`, { headers: { range: request.headers.range } });
        const bytes = Buffer.from(await answer.arrayBuffer());
        count.bytes += bytes.length;
        entry.bytes = bytes.length;
        response
          .writeHead(answer.status, {
            "Content-Range": answer.headers.get("content-range"),
            "Content-Length": bytes.length,
          })
          .end(bytes);
      },
    },
  );
  const close = () => {
    far.close();
    process_.stdin.end();
  };
  return { far, size, count, asked, close };
}

test("of a terabyte, a first picture from 2 MB and a few requests", async (t) => {
  const { far, size, count, asked, close } = await farTerabyte();
  t.after(close);
  const page = await browser.newPage(1280, 860);
  await page.goTo(far.url("viewer/index.html?src=/scan.tag"));
  await page.until("tagridViewer.times.all");
  const { start, first, all, origin, page: ofPage } = await page.evaluate(`({ ...tagridViewer.times,
    origin: performance.timeOrigin,
    page: performance.getEntriesByType("resource").filter((e) => !e.name.endsWith("scan.tag")).length + 1 })`);
  const before = asked.filter(({ at }) => at < origin + all);
  const seen = { requests: before.length, bytes: before.reduce((sum, { bytes }) => sum + bytes, 0) };
  await picture(page, "terabyte");
  console.log(
    `# ${(size / 1e9).toFixed(0)} GB: three slices after ${seen.requests} requests and ${seen.bytes} bytes, ` +
      `the first after ${Math.round(first - start)} ms, all after ${Math.round(all - start)} ms ` +
      `(${Math.round(all)} ms after the page was asked for, which is ${ofPage} requests)`,
  );
  // Two requests and 0.9 MB, and what is asked for next before a slow page has drawn.
  assert.ok(seen.requests <= 20, `${seen.requests} requests`);
  assert.ok(seen.bytes <= 2e6, `${seen.bytes} bytes`);
  assert.ok(ofPage <= 5, `${ofPage} requests for the page`);
  await page.until("tagridViewer.times.complete");
  console.log(`# as fine as the screen after ${count.requests} requests and ${count.bytes} bytes`);
  assert.ok(count.bytes < 2e7, `${count.bytes} bytes`);
  // Far in, bricks of the volume itself.
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 30)");
  await page.until("tagridViewer.sliceViews.every((view) => view.isComplete && view.shown === 0)");
  await picture(page, "terabyte-zoomed");
  console.log(`# and with a part of it at full resolution after ${count.requests} requests and ${count.bytes} bytes`);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("memory stays the same over hundreds of slices", async () => {
  const page = await open("made/scan.tag", 400, 300);
  // Less than the slices have, so that tiles are dropped and read again.
  await page.evaluate(`tagridViewer.state.tiles.keptBytes = 2e6;
    tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 4)`);
  const look = (steps) =>
    page.evaluate(`(async () => {
      for (let step = 0; step < ${steps}; ++step) {
        const place = tagridViewer.state.volume.dims.map((n) => Math.abs(((7 * step) % (2 * n)) - n));
        tagridViewer.actions.moveTo(place);
        await new Promise(requestAnimationFrame);
        while (step % 10 === 0 && !tagridViewer.sliceViews.every((view) => !view.isShown || view.isComplete))
          await new Promise((resolve) => setTimeout(resolve, 5));
      }
    })()`);
  // All places at which it waits, twice: after that, all that the caches take is there, unless the machine is too busy.
  // A leak grows in every round.
  const seen = [];
  do {
    await look(520);
    await page.until("tagridViewer.sliceViews.every((view) => !view.isShown || view.isComplete)", 120);
    seen.push(await page.memory());
  } while (seen.length < 5 && !(seen.at(-1) < 1.05 * seen.at(-2)));
  console.log(`# bytes after each 520 slices: ${seen.join(", ")}`);
  assert.ok(seen.at(-1) < 1.05 * seen.at(-2), seen.join(", "));
  assert.deepEqual(page.errors, []);
  await page.close();
});

/** Bytes of memory of a process and its children. */
function memoryOf(pid) {
  // Pages that are there, and those of files among them.
  const [, resident, shared] = readFileSync(`/proc/${pid}/statm`, "utf8").split(" ").map(Number);
  const own = 4096 * (resident - shared);
  const children = readFileSync(`/proc/${pid}/task/${pid}/children`, "utf8").trim().split(" ").filter(Boolean);
  return children.reduce((sum, child) => sum + memoryOf(child), own);
}

// TAGRID_LONG=MINUTES: an hour of looking at slices, faster.
test("memory does not grow with the slices that were seen", { skip: !process.env.TAGRID_LONG, timeout: 4e6 }, async () => {
  const { far, count, close } = await farTerabyte();
  const alone = await startChromium();
  const page = await alone.newPage(1280, 860);
  await page.goTo(far.url("viewer/index.html?src=/scan.tag"));
  await page.until("tagridViewer.times.all");
  // Bricks of the volume itself.
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 30)");
  const begin = Date.now();
  const length = Number(process.env.TAGRID_LONG) * 60000;
  const seen = [];
  let steps = 0;
  while (Date.now() - begin < length) {
    for (const axis of [2, 1, 0]) await page.evaluate(`tagridViewer.actions.step(${axis}, ${steps % 700 < 350 ? 10 : -10})`);
    if (++steps % 5 === 0) await page.until("tagridViewer.sliceViews.every((view) => view.isComplete)", 120);
    if (steps % 20 === 0) {
      const { JSHeapUsedSize } = await page.metrics();
      seen.push({ at: Date.now() - begin, all: memoryOf(alone.pid), heap: JSHeapUsedSize });
    }
  }
  const most = (from, to, key) =>
    Math.max(...seen.filter(({ at }) => at >= from * length && at < to * length).map((entry) => entry[key]));
  const table = [0, 1, 2, 3, 4].map((i) => `${(most(i / 5, (i + 1) / 5, "all") / 1e6).toFixed(0)}`);
  console.log(`# ${3 * steps} slices, ${count.requests} requests, ${(count.bytes / 1e6).toFixed(0)} MB; ` +
    `most memory in each fifth of the time: ${table.join(", ")} MB; heap ${(most(0.8, 1, "heap") / 1e6).toFixed(0)} MB`);
  assert.ok(most(0.6, 1, "all") < 1.15 * most(0.2, 0.6, "all"), JSON.stringify(seen));
  assert.deepEqual(page.errors, []);
  await alone.close();
  close();
});
