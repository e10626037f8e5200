// The tools of the viewer to diagnose and measure with, in headless Chromium: presets of windows, rulers, angles, regions and
// slabs. What they say is compared with what follows from the samples.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { decoded, folder } from "./files.mjs";
import { open, picture, pixelOf, pointOf, write } from "./viewer_pages.mjs";

const isDone = "tagridViewer.sliceViews.every((view) => !view.isShown || view.isSettled)";
const textOf = (page, id) => page.evaluate(`document.getElementById("${id}").innerText`);
const windowOf = (page) => page.evaluate(`["low", "high"].map((end) => tagridViewer.state.shades[end])`);
const choose = (page, id, value) =>
  page.evaluate(`{ const field = document.getElementById("${id}"); field.value = ${JSON.stringify(value)};
    field.dispatchEvent(new Event("input")); field.dispatchEvent(new Event("change")); }`);
const optionsOf = (page) =>
  page.evaluate(`[...document.getElementById("preset").options].filter((o) => !o.hidden).map((o) => o.textContent)`);
/** Samples of a file of made/, as the program decodes them. */
const samplesOf = (file, Samples) => {
  const bytes = decoded(join(folder, file.slice(5)));
  return new Samples(bytes.buffer, bytes.byteOffset, bytes.length / Samples.BYTES_PER_ELEMENT);
};

test("presets of HU by menu and keys, with the greys that follow", async () => {
  const dims = [40, 36, 32];
  // Samples are (HU + 1024) / 2.
  const valueOf = (x, y, z) => 2 * (20 * x + 5 * y + z) - 1024;
  const file = write("hounsfield", dims, Int16Array, (...p) => (valueOf(...p) + 1024) / 2, [
    "rescale_slope:=2",
    "rescale_intercept:=-1024",
    "rescale_units:=HU",
  ]);
  const page = await open(file);
  assert.deepEqual(await optionsOf(page), [
    "brain (HU)", "lung (HU)", "bone (HU)", "soft tissue (HU)", "full range", "1–99 %", "0.1–99.9 %",
  ]);
  const windows = { brain: [0, 80], lung: [-1350, 150], bone: [-500, 1300], "soft tissue": [-160, 240] };
  const grey = (value, [low, high]) => Math.max(0, Math.min(255, Math.round(((value - low) * 255) / (high - low))));
  const check = async (name) => {
    assert.deepEqual(await windowOf(page), windows[name], name);
    await page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
    let between = 0;
    for (const place of [[5, 6, 16], [26, 4, 16], [27, 30, 16], [35, 31, 16]]) {
      const expected = grey(valueOf(...place), windows[name]);
      assert.deepEqual((await pixelOf(page, 0, place)).slice(0, 3), [expected, expected, expected], `${name} ${place}`);
      between += expected > 0 && expected < 255;
    }
    return between;
  };
  let between = 0;
  for (const name of Object.keys(windows)) {
    await choose(page, "preset", name);
    between += await check(name);
  }
  assert.ok(between > 4);
  await picture(page, "presets");
  // Keys, from what is chosen on, around the end, and back.
  const chosen = () => page.evaluate(`document.getElementById("preset").value`);
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  await page.key("w");
  assert.equal(await chosen(), "full range");
  // The range of the whole volume, not of the slices shown.
  assert.deepEqual(await windowOf(page), [valueOf(0, 0, 0), valueOf(39, 35, 31)]);
  for (let i = 0; i < 3; ++i) await page.key("w");
  assert.equal(await chosen(), "brain");
  await check("brain");
  await page.key("W", 8);
  assert.equal(await chosen(), "0.1–99.9 %");
  // Another window is no preset.
  await page.key("]");
  assert.equal(await chosen(), "");
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("without HU, presets are shares of the slices shown", async () => {
  const dims = [100, 100, 100];
  const sampleOf = (x, y, z) => (x * 7919 + y * 104729 + z * 1299709) % 5000;
  const page = await open(write("shares", dims, Int16Array, sampleOf));
  assert.deepEqual(await optionsOf(page), ["full range", "1–99 %", "0.1–99.9 %"]);
  const middle = 50;
  const shown = [];
  for (let a = 0; a < 100; ++a)
    for (let b = 0; b < 100; ++b) shown.push(sampleOf(a, b, middle), sampleOf(a, middle, b), sampleOf(middle, a, b));
  shown.sort((a, b) => a - b);
  for (const [name, share] of [["1–99 %", 0.01], ["0.1–99.9 %", 0.001]]) {
    await choose(page, "preset", name);
    const [low, high] = await windowOf(page);
    // Of so many that share that is lower, and higher.
    const below = shown.filter((sample) => sample < low).length / shown.length;
    const above = shown.filter((sample) => sample > high).length / shown.length;
    assert.ok(Math.abs(below - share) < 0.0005 && Math.abs(above - share) < 0.0005, `${name}: ${below} ${above}`);
  }
  await page.close();
  // CT of DICOM is in HU, also without a unit; what has another unit, or slopes of its own for each slice, is not.
  for (const [lines, isHounsfield] of [
    [["dicom_Modality:=CT", "rescale_slope:=1", "rescale_intercept:=-1024"], true],
    [["dicom_Modality:=MR", "rescale_slope:=1", "rescale_intercept:=-1024"], false],
    [["dicom_Modality:=CT", "rescale_slope:=1", "rescale_intercept:=-1024", "rescale_units:=mgHA/ccm"], false],
    [["dicom_Modality:=CT"], false],
    [["rescale_units:=HU", "slice_slopes:=1 2 3", "slice_intercepts:=0 0 0"], false],
  ]) {
    const other = await open(write("modality", [12, 12, 3], Int16Array, (x) => x, lines));
    assert.equal((await optionsOf(other))[0] === "brain (HU)", isHounsfield, `${lines}`);
    assert.deepEqual(other.errors, []);
    await other.close();
  }
});
