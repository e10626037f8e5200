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

const measures = (page) => page.evaluate("tagridViewer.state.measures");
/** The texts of the list of measurements. */
const listed = (page) =>
  page.evaluate(`[...document.querySelectorAll("#measures li button:first-child")].map((e) => e.textContent)`);
const tool = (page, name) => page.evaluate(`tagridViewer.actions.tool("${name}")`);
const numberIn = (text, pattern = /: \w+ ([\d.]+)/) => Number(pattern.exec(text)[1]);
const frame = (page) =>
  page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
/** The angle at b, in degrees. */
const degreesAt = (a, b, c) => {
  const [u, v] = [a, c].map((end) => end.map((n, i) => n - b[i]));
  return (Math.acos(u.reduce((sum, n, i) => sum + n * v[i], 0) / (Math.hypot(...u) * Math.hypot(...v))) * 180) / Math.PI;
};

test("rulers and angles are those of the positions in the file, also where axes are not perpendicular", async () => {
  const dims = [60, 50, 40];
  // A tilted gantry: slices move toward the back.
  const file = write("tilted", dims, Int16Array, (x, y, z) => x + y + z, [
    "space: left-posterior-superior",
    "space directions: (0.5,0,0) (0,0.5,0) (0,0.4,0.8)",
    'space units: "mm" "mm" "mm"',
  ]);
  const positionOf = ([x, y, z]) => [0.5 * x, 0.5 * y + 0.4 * z, 0.8 * z];
  const distance = (a, b) => Math.hypot(...positionOf(a).map((n, i) => n - positionOf(b)[i]));
  const page = await open(file);
  await tool(page, "ruler");
  const drag = async (view, from, to) => page.drag(await pointOf(page, view, from), await pointOf(page, view, to));
  const middle = [30, 25, 20];
  const pairs = [
    [0, [10, 12, 20], [43, 31, 20]],
    [2, [30, 8, 6], [30, 40, 33]],
    [1, [8, 25, 30], [50, 25, 30]],
  ];
  for (const [view, from, to] of pairs) await drag(view, from, to);
  let texts = await listed(page);
  assert.equal(texts.length, 3);
  for (const [i, [view, from, to]] of pairs.entries()) {
    // A pixel of the screen is less than a fifth of a sample here.
    assert.ok(Math.abs(numberIn(texts[i]) - distance(from, to)) < 0.3, `${texts[i]}: ${distance(from, to)}`);
    assert.match(texts[i], new RegExp(`^${i + 1}: ruler [\\d.]+ mm \\(${"zyx"[view]} = ${middle[2 - view]}\\)$`));
  }
  // A tenth of a millimeter is the last digit; not perpendicular, 27 samples down are longer than 27 times the spacing.
  assert.match(texts[1], / \d+\.\d mm/);
  const perpendicular = Math.hypot(0.5 * 32, Math.hypot(0.4, 0.8) * 27);
  assert.ok(Math.abs(numberIn(texts[1]) - perpendicular) > 3);
  // The number is written over the picture, too.
  const written = await page.evaluate(`(() => { const view = tagridViewer.sliceViews[0], texts = [];
    const context = view.canvas.getContext("2d");
    context.fillText = (text) => texts.push(text);
    view.draw();
    delete context.fillText;
    return texts; })()`);
  assert.ok(written.includes(texts[0].replace(/^1: ruler (.*) \(.*/, "1: $1")), `${written}`);
  await frame(page);
  await picture(page, "rulers");
  // The end of a ruler moves alone, a line with both ends.
  await drag(0, [43, 31, 20], [43, 45, 20]);
  assert.ok(Math.abs(numberIn((await listed(page))[0]) - distance([10, 12, 20], [43, 45, 20])) < 0.3);
  const before = (await measures(page))[2].points;
  await drag(1, [29, 25, 30], [24, 25, 14]);
  const after = (await measures(page))[2].points;
  for (const i of [0, 1])
    for (const [axis, change] of [-5, 0, -16].entries())
      assert.ok(Math.abs(after[i][axis] - before[i][axis] - change) < 0.3, `${before} ${after}`);
  assert.equal((await measures(page)).length, 3);
  // Elsewhere, it is not drawn, and no drag meets it.
  await page.evaluate("tagridViewer.actions.moveTo([30, 25, 21])");
  await drag(0, [43, 45, 21], [20, 45, 21]);
  assert.equal((await measures(page)).length, 4);
  await page.key("Delete");
  assert.equal((await measures(page)).length, 3);
  // An angle, with a drag for the first side and the corner, and one for the other end.
  await page.key("5");
  const corners = [[12, 8, 21], [12, 40, 21], [50, 28, 21]];
  await drag(0, corners[0], corners[1]);
  assert.deepEqual((await listed(page))[3].slice(0, 10), "5: angle …");
  await drag(0, [30, 30, 21], corners[2]);
  texts = await listed(page);
  assert.equal(texts.length, 4);
  assert.ok(Math.abs(numberIn(texts[3]) - degreesAt(...corners.map(positionOf))) < 1, texts[3]);
  assert.match(texts[3], /^5: angle \d+\.\d° \(z = 21\)$/);
  // In a sagittal slice, it is that of the positions, not of the picture.
  const slanted = [[30, 10, 5], [30, 10, 35], [30, 40, 35]];
  await drag(2, slanted[0], slanted[1]);
  await drag(2, [30, 20, 20], slanted[2]);
  assert.ok(Math.abs(numberIn((await listed(page))[4]) - degreesAt(...slanted.map(positionOf))) < 1);
  assert.ok(Math.abs(numberIn((await listed(page))[4]) - 90) > 20);
  await frame(page);
  await picture(page, "angles");
  // A side without the other end is dropped with its tool.
  await drag(0, [40, 10, 21], [50, 20, 21]);
  assert.equal((await measures(page)).length, 6);
  await page.key("1");
  assert.equal((await measures(page)).length, 5);
  // A press that hardly moves is no ruler.
  await tool(page, "ruler");
  const [x, y] = await pointOf(page, 0, [45, 12, 21]);
  await page.drag([x, y], [x + 1, y + 1]);
  assert.equal((await measures(page)).length, 5);
  // The list shows the slice, moves by samples, and removes.
  await page.evaluate(`document.querySelector("#measures button").focus()`);
  await page.evaluate(`document.activeElement.click()`);
  assert.equal(await page.evaluate("tagridViewer.state.position[2]"), 20);
  const [first] = await measures(page);
  await page.key("ArrowRight", 8);
  await page.key("ArrowUp");
  const [moved] = await measures(page);
  const expected = first.points.map(([a, b, c]) => [Math.min(a + 10, 60), b - 1, c]);
  for (const i of [0, 1]) for (const axis of [0, 1, 2]) assert.ok(Math.abs(moved.points[i][axis] - expected[i][axis]) < 1e-9);
  await page.key("Delete");
  assert.equal((await measures(page)).length, 4);
  await page.evaluate(`document.querySelector("#measures li button:last-child").click()`);
  assert.equal((await measures(page)).length, 3);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("rulers and angles across slices of uneven distances are those of the positions of the slices", async () => {
  const dims = [40, 36, 12];
  // Gaps from 1.1 to 7 mm, and a gantry that shifts slices to the back.
  const gaps = [1.1, 1.1, 2.5, 7, 7, 4, 4, 1.1, 3.2, 7, 2.5];
  const heights = gaps.reduce((all, gap) => [...all, all.at(-1) + gap], [-20]);
  const origins = heights.map((height, z) => [-10, 5 + 0.3 * (height + 20) + (z === 6 ? 0.25 : 0), height]);
  const lines = [
    "space: left-posterior-superior",
    'space units: "mm" "mm" "mm"',
    `slice_positions:=${origins.map((position) => position.join(" ")).join("; ")}`,
  ];
  /** Millimeters of a place, in which samples are at their numbers; linear between two slices, and as far beyond the last one. */
  const positionOf = ([x, y, z]) => {
    const below = Math.min(Math.max(Math.floor(z), 0), dims[2] - 2);
    const [a, b] = [origins[below], origins[below + 1]];
    return a.map((n, row) => n + (z - below) * (b[row] - n) + [0.5 * x, 0.6 * y, 0][row]);
  };
  const distance = (a, b) => Math.hypot(...positionOf(a).map((n, i) => n - positionOf(b)[i]));
  const page = await open(write("uneven", dims, Int16Array, (x, y, z) => x + y + 9 * z, [...lines, "space directions: (0.5,0,0) (0,0.6,0) (0,0.75,2.5)"]));
  assert.match(await textOf(page, "facts"), /unevenly spaced/);
  // With keys: at the middles of samples.
  const put = async (view, tool, ...places) => {
    await page.evaluate(`tagridViewer.actions.tool("${tool}")`);
    for (const place of places)
      await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(place)}); tagridViewer.actions.measuring.putPoint(tagridViewer.sliceViews[${view}])`);
  };
  const pairs = [[2, [20, 6, 0], [20, 30, 11]], [2, [20, 10, 2], [20, 10, 4]], [1, [3, 18, 7], [33, 18, 5]], [0, [4, 5, 9], [30, 25, 9]], [2, [20, 8, 3], [20, 9, 4]]];
  for (const [view, from, to] of pairs) await put(view, "ruler", from, to);
  for (const [i, text] of (await listed(page)).entries())
    assert.equal(text.split(" (")[0], `${i + 1}: ruler ${distance(...pairs[i].slice(1)).toFixed(1)} mm`);
  // As if slices were even, they would differ.
  const even = ([, y, z]) => [0.6 * y + 0.75 * z, 2.5 * z];
  const asEven = Math.hypot(...even(pairs[1][1]).map((n, i) => n - even(pairs[1][2])[i]));
  assert.ok(Math.abs(asEven - distance(...pairs[1].slice(1))) > 4);
  const corners = [[20, 6, 1], [20, 6, 9], [20, 30, 9]];
  await put(2, "angle", ...corners);
  assert.ok(Math.abs(numberIn((await listed(page)).at(-1)) - degreesAt(...corners.map(positionOf))) < 0.06);
  // Between slices, before the first one and after the last one, and in an oblique plane.
  const plane = { isShown: true, base: "axial", tilt: 20, turn: 10, spin: 0, through: [20, 18, 6] };
  const between = [
    { kind: "ruler", normal: 0, slice: 20, points: [[20.5, 3.25, 3.75], [20.5, 30, 4.25]] },
    { kind: "ruler", normal: 1, slice: 18, points: [[3, 18.5, 0], [3, 18.5, 12]] },
    { kind: "ruler", plane, points: [[3, 5, 2.3], [35.5, 30, 9.8]] },
  ];
  await page.evaluate(`tagridViewer.actions.measuring.add(${JSON.stringify(between)})`);
  const texts = (await listed(page)).slice(-3);
  for (const [i, { points }] of between.entries()) {
    const [from, to] = points.map((place) => place.map((n) => n - 0.5));
    assert.ok(Math.abs(numberIn(texts[i]) - distance(from, to)) < 0.051, `${texts[i]}: ${distance(from, to)}`);
  }
  assert.ok(distance([2.5, 18, -0.5], [2.5, 18, 11.5]) > heights.at(-1) + 20);
  await picture(page, "uneven");
  assert.deepEqual(page.errors, []);
  await page.close();
  // The positions are enough where the file does not say one distance of slices.
  const unknown = await open(write("uneven-unknown", dims, Int16Array, (x) => x, [...lines.slice(1), "spacings: 0.5 0.6 nan", "space dimension: 3"].filter((line) => !/^space/.test(line))));
  await unknown.evaluate(`tagridViewer.actions.measuring.add([{ kind: "ruler", normal: 0, slice: 20, points: [[20.5, 10.5, 2.5], [20.5, 10.5, 9.5]] }])`);
  const [text] = await listed(unknown);
  const length = Math.hypot(...origins[2].map((n, row) => n - origins[9][row]));
  assert.equal(text.split(" (")[0], `1: ruler ${length.toFixed(1)} units`);
  assert.equal(await unknown.evaluate("document.querySelector('#measures p').textContent"), "");
  assert.deepEqual(unknown.errors, []);
  await unknown.close();
});

test("with keys alone, points are at samples, exactly; fingers measure, and pinches do not", async () => {
  const page = await open(write("keys", [40, 36, 32], Int16Array, (x, y) => x + y, ["spacings: 0.2 0.3 2"]), 390, 844, true);
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  const at = async (position) => {
    await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
    await page.key("Enter");
  };
  await page.key("4");
  await at([3, 4, 16]);
  await at([33, 24, 16]);
  await page.key("5");
  await at([10, 10, 16]);
  await at([20, 10, 16]);
  await at([20, 30, 16]);
  // The number of digits follows from the spacing: 0.2.
  assert.deepEqual(await listed(page), [
    `1: ruler ${Math.hypot(30 * 0.2, 20 * 0.3).toFixed(2)} units (z = 16)`,
    "2: angle 90.0° (z = 16)",
  ]);
  await page.key("Escape");
  await page.key("4");
  const [from, to] = [await pointOf(page, 0, [8, 30, 16]), await pointOf(page, 0, [30, 33, 16])];
  await page.touch("touchStart", [from]);
  for (let i = 1; i <= 5; ++i) await page.touch("touchMove", [from.map((a, axis) => a + ((to[axis] - a) * i) / 5)]);
  await page.touch("touchEnd", []);
  assert.equal((await measures(page)).length, 3);
  assert.ok(Math.abs(numberIn((await listed(page))[2]) - Math.hypot(22 * 0.2, 3 * 0.3)) < 0.2);
  await frame(page);
  await picture(page, "phone-ruler");
  // The first finger of a pinch leaves no ruler.
  const [x, y] = await pointOf(page, 0, [25, 8, 16]);
  await page.touch("touchStart", [[x, y]]);
  await page.touch("touchMove", [[x - 12, y - 3]]);
  await page.touch("touchStart", [[x - 12, y], [x + 40, y + 20]]);
  await page.touch("touchMove", [[x - 30, y], [x + 60, y + 20]]);
  await page.touch("touchEnd", []);
  assert.equal((await measures(page)).length, 3);
  assert.deepEqual(page.errors, []);
  await page.close();
  // Without spacing, lengths are in voxels; another file has none of the measures.
  const bare = await open(write("bare", [40, 36, 32], Int16Array, (x, y) => x + y));
  await bare.evaluate(`tagridViewer.actions.tool("ruler")`);
  await bare.evaluate("tagridViewer.actions.moveTo([3, 4, 16]); tagridViewer.actions.measuring.putPoint(tagridViewer.sliceViews[0])");
  await bare.evaluate("tagridViewer.actions.moveTo([6, 8, 16]); tagridViewer.actions.measuring.putPoint(tagridViewer.sliceViews[0])");
  assert.deepEqual(await listed(bare), ["1: ruler 5.0 voxels (z = 16)"]);
  assert.match(await textOf(bare, "measures"), /spacing unknown/);
  await bare.choose("#file", [join(folder, "keys.tag")]);
  await bare.until(`tagridViewer.state.name === "keys.tag"`);
  assert.deepEqual(await listed(bare), []);
  assert.deepEqual(bare.errors, []);
  await bare.close();
});

/** Rows of the list of a region: { name: text }. */
const rowsOf = (page, i) =>
  page.evaluate(`Object.fromEntries([...document.querySelectorAll("#measures li")[${i}].querySelectorAll("dl:not(.ends) dt")]
    .map((e) => [e.textContent, e.nextSibling.textContent]))`);
const isRead = (i) => `(tagridViewer.state.measures[${i}]?.statistics || tagridViewer.state.measures[${i}]?.message)`;

/** Statistics of a region, from all samples of the slice: a sample counts if its middle is in the region. */
function expectedOf({ kind, normal, slice, points: [a, b] }, dims, valueAt) {
  const [u, v] = [0, 1, 2].filter((axis) => axis !== normal);
  const values = [];
  for (let j = 0; j < dims[v]; ++j)
    for (let i = 0; i < dims[u]; ++i) {
      const place = [];
      [place[u], place[v], place[normal]] = [i, j, slice];
      const [s, t] = [u, v].map((axis) => (2 * (place[axis] + 0.5) - a[axis] - b[axis]) / Math.abs(a[axis] - b[axis]));
      if (kind === "ellipse" ? s * s + t * t <= 1 : Math.abs(s) <= 1 && Math.abs(t) <= 1) values.push(valueAt(place));
    }
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  const deviation = Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / values.length - mean * mean);
  return { values, mean, deviation, low: Math.min(...values), high: Math.max(...values) };
}

test("regions have the statistics of the samples of the volume itself", async () => {
  // With an overview, which is what is shown: the slice has more samples than the view has pixels.
  const dims = [900, 800, 9];
  const file = write(
    "regions",
    dims,
    Int16Array,
    (x, y, z) => Math.round(300 * Math.sin(x / 9) * Math.cos(y / 7) + ((x * 31 + y * 17 + z * 7) % 41) + z),
    [
      "space: left-posterior-superior",
      "space directions: (0.5,0,0) (0,0.4,0) (0,0,3)",
      'space units: "mm" "mm" "mm"',
      "rescale_slope:=2",
      "rescale_intercept:=-100",
      "rescale_units:=HU",
    ],
    "--max-error",
    "3",
    "--overviews",
    "4",
  );
  const samples = samplesOf(file, Int16Array);
  const valueAt = ([x, y, z]) => 2 * samples[(z * dims[1] + y) * dims[0] + x] - 100;
  const page = await open(file, 800, 560);
  assert.ok((await page.evaluate("tagridViewer.sliceViews[0].level")) > 0);
  await page.key("6");
  await page.drag(await pointOf(page, 0, [200, 150, 4]), await pointOf(page, 0, [420, 390, 4]));
  await page.key("7");
  await page.drag(await pointOf(page, 0, [700, 600, 4]), await pointOf(page, 0, [560, 500, 4]));
  await page.until(`${isRead(0)} && ${isRead(1)}`);
  const check = async (i) => {
    const measure = (await measures(page))[i];
    const { values, mean, deviation, low, high } = expectedOf(measure, dims, valueAt);
    const { statistics } = measure;
    assert.ok(values.length > 5000);
    assert.equal(statistics.count, values.length);
    assert.ok(Math.abs(statistics.mean - mean) < 1e-9 * Math.abs(low - high), `${statistics.mean} ${mean}`);
    assert.ok(Math.abs(statistics.deviation - deviation) < 1e-6);
    assert.deepEqual([statistics.low, statistics.high], [low, high]);
    // All samples are in the histogram, in the bins of their values, which have as many possible values each.
    const { begin, width, counts } = statistics.bins;
    assert.equal(width % 2, 0);
    assert.deepEqual(
      counts,
      counts.map((_, bin) => values.filter((v) => v >= begin + bin * width && v < begin + (bin + 1) * width).length),
    );
    // What is written: no more digits than the bound of 2 HU allows.
    assert.deepEqual(await rowsOf(page, i), {
      samples: String(values.length),
      area: `${(values.length * 0.2).toFixed(2)} mm²`,
      mean: `${mean.toFixed(1)} HU`,
      "standard deviation": `${deviation.toFixed(1)} HU`,
      lowest: `${low} HU`,
      highest: `${high} HU`,
    });
    return measure;
  };
  const ellipse = await check(0);
  await check(1);
  assert.match(await textOf(page, "measures"), /lossy, with errors up to 2 HU/);
  await picture(page, "regions");
  // A corner, and the whole, move; the statistics follow.
  await page.evaluate("tagridViewer.actions.moveTo([450, 400, 4])");
  const corner = ellipse.points[0].map(Math.round);
  await page.drag(await pointOf(page, 0, corner), await pointOf(page, 0, [corner[0] + 40, corner[1] - 30, 4]));
  await page.until(`tagridViewer.state.measures[0].statistics && !(${JSON.stringify(ellipse.statistics.count)} === tagridViewer.state.measures[0].statistics.count)`);
  await check(0);
  assert.equal((await measures(page)).length, 2);
  // Too large: it says how large, and reads nothing.
  await page.evaluate("tagridViewer.regionReader.mostSamples = 1000");
  await page.evaluate(`document.querySelector("#measures button").focus()`);
  await page.key("ArrowRight");
  await page.until(isRead(0));
  assert.match(await textOf(page, "measures"), /too large: its box has \d+ samples, and at most 1000 are read/);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("a region counts what is no number apart, and keys put whole samples into it", async () => {
  const dims = [24, 22, 20];
  const sampleOf = (x, y, z) => (x === 5 && y === 6 ? NaN : x === 6 && y === 6 ? Infinity : Math.fround(0.1 * x + y + z / 7));
  const page = await open(write("holes", dims, Float32Array, sampleOf));
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  await page.key("7");
  for (const position of [[3, 4, 10], [8, 9, 10]]) {
    await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
    await page.key("Enter");
  }
  await page.until(isRead(0));
  const values = [];
  for (let y = 4; y <= 9; ++y) for (let x = 3; x <= 8; ++x) values.push(sampleOf(x, y, 10));
  const finite = values.filter(Number.isFinite);
  const { statistics } = (await measures(page))[0];
  const mean = finite.reduce((sum, value) => sum + value, 0) / finite.length;
  assert.equal(statistics.count, 34);
  assert.equal(statistics.missing, 2);
  assert.ok(Math.abs(statistics.mean - mean) < 1e-9);
  const rows = await rowsOf(page, 0);
  assert.equal(rows.samples, "36");
  assert.equal(rows["of these, no number"], "2");
  assert.equal(rows.area, "36 voxels");
  // As the samples are written elsewhere.
  assert.equal(rows.lowest, String(Number(Math.min(...finite).toPrecision(8))));
  assert.match(await textOf(page, "measures"), /The samples are exact/);
  // One sample of a region has no deviation; one without a middle has no sample.
  await page.evaluate(`document.querySelector("#measures li button:last-child").click()`);
  await page.evaluate("tagridViewer.actions.measuring.add([{ kind: 'ellipse', normal: 2, slice: 10, points: [[3.1, 4.1, 10.5], [3.4, 4.4, 10.5]] }])");
  await page.until(isRead(0));
  assert.match(await textOf(page, "measures"), /has no sample/);
  assert.deepEqual(page.errors, []);
  await page.close();
  // Slopes of single slices: values in a slice, and across them.
  const slopes = [1, 0.5, 0.25, 2];
  const other = await open(
    write("sloped", [12, 10, 4], Int16Array, (x, y, z) => x + y + z, [`slice_slopes:=${slopes.join(" ")}`, "slice_intercepts:=0 1 2 3"]),
  );
  const valueAt = ([x, y, z]) => slopes[z] * (x + y + z) + z;
  await other.evaluate(`tagridViewer.actions.measuring.add([
    { kind: "rectangle", normal: 2, slice: 1, points: [[2, 2, 1.5], [7, 9, 1.5]] },
    { kind: "rectangle", normal: 1, slice: 4, points: [[2, 4.5, 0], [7, 4.5, 4]] }])`);
  await other.until(`${isRead(0)} && ${isRead(1)}`);
  for (const measure of await measures(other)) {
    const expected = expectedOf(measure, [12, 10, 4], valueAt);
    assert.ok(Math.abs(measure.statistics.mean - expected.mean) < 1e-9);
    assert.deepEqual([measure.statistics.low, measure.statistics.high], [expected.low, expected.high]);
  }
  assert.deepEqual(other.errors, []);
  await other.close();
});

const readoutOf = (page) =>
  page.evaluate(`Object.fromEntries([...document.querySelectorAll("#readout dt")].map((e) => [e.textContent, e.nextSibling.textContent]))`);
/** The notes below the title of a view. */
const notesOf = (page, view) =>
  page.evaluate(`(() => { const view = tagridViewer.sliceViews[${view}], context = view.canvas.getContext("2d"), texts = [];
    context.fillText = (text) => texts.push(text);
    view.draw();
    delete context.fillText;
    return texts; })()`);

test("slabs are the mean, the maximum and the minimum of the slices within their thickness", async () => {
  const dims = [80, 74, 70];
  const sampleOf = (x, y, z) => ((x * 7919 + y * 104729 + z * 1299709) % 1000) - 300;
  const steps = [0.5, 0.5, 2];
  const file = write("slab", dims, Int16Array, sampleOf, [
    `spacings: ${steps.join(" ")}`,
    'units: "mm" "mm" "mm"',
    "rescale_slope:=2",
    "rescale_intercept:=10",
    "rescale_units:=HU",
  ]);
  const page = await open(file);
  await page.evaluate("tagridViewer.actions.window(-600, 1400)");
  const position = [66, 37, 33];
  const reduce = {
    mean: (values) => values.reduce((sum, value) => sum + value, 0) / values.length,
    maximum: (values) => Math.max(...values),
    minimum: (values) => Math.min(...values),
  };
  /** The values along an axis through a place that a slab of so many slices has. */
  const valuesOf = (place, axis, count, at = position[axis]) => {
    const begin = at - Math.floor((count - 1) / 2);
    const values = [];
    for (let i = Math.max(begin, 0); i < Math.min(begin + count, dims[axis]); ++i)
      values.push(2 * sampleOf(...place.map((p, other) => (other === axis ? i : p))) + 10);
    return values;
  };
  await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 1.6)");
  await choose(page, "slab-thickness", "10");
  const check = async (kind, counts) => {
    await page.until(isDone);
    await frame(page);
    for (const [view, axis] of [2, 1, 0].entries())
      for (const [a, b] of [[62, 30], [63, 65], [70, 44], [58, 66]]) {
        const place = [a, b];
        place.splice(axis, 0, position[axis]);
        if (place.some((p, i) => p >= dims[i] || (i !== axis && Math.abs(p - position[i]) < 3))) continue;
        const point = await pointOf(page, view, place);
        const isVisible = await page.evaluate(`tagridViewer.sliceViews[${view}].canvas === document.elementFromPoint(${point})`);
        if (!isVisible) continue;
        const expected = reduce[kind](valuesOf(place, axis, counts[axis]));
        const [grey] = await pixelOf(page, view, place);
        assert.equal(grey, Math.max(0, Math.min(255, Math.round(((expected + 600) * 255) / 2000))), `${kind} ${view} ${place}`);
        await page.move(...point);
        const shown = await readoutOf(page);
        const [value, unit] = shown[`${kind} of ${counts[axis]} slices`].split(" ");
        assert.ok(Math.abs(Number(value) - expected) < 1e-6 && unit === "HU", `${JSON.stringify(shown)} ${expected}`);
        assert.equal(shown.value, undefined);
        ++checked;
      }
  };
  let checked = 0;
  for (const kind of ["mean", "maximum", "minimum"]) {
    await page.key("s");
    // 10 mm are 5 slices of 2 mm, and 20 of 0.5 mm; across two bricks along x and y.
    await check(kind, [20, 20, 5]);
  }
  assert.ok(checked > 20, `${checked}`);
  assert.ok((await notesOf(page, 0)).some((text) => text.startsWith("minimum of 5 slices (32 to 36, 10.0 mm)")), `${await notesOf(page, 0)}`);
  await picture(page, "slab");
  // By slices, and thicker by keys: of the view with the focus, here axial.
  await choose(page, "slab-unit", "slices");
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  await page.key(".");
  await page.key(".");
  await page.key(",");
  await check("minimum", [11, 11, 11]);
  // At the end of the volume, there are fewer.
  await page.evaluate("tagridViewer.actions.moveTo([66, 37, 68])");
  await page.until(isDone);
  assert.ok((await notesOf(page, 0)).some((text) => text.startsWith("minimum of 7 slices (64 to 70, 14.0 mm)")));
  await page.move(...(await pointOf(page, 0, [60, 30, 68])));
  assert.equal((await readoutOf(page))["minimum of 7 slices"], `${Math.min(...valuesOf([60, 30, 68], 2, 11, 68))} HU`);
  // Regions still measure the slice, and the window of Auto is of the slab.
  await page.evaluate("tagridViewer.actions.measuring.add([{ kind: 'rectangle', normal: 2, slice: 68, points: [[2, 2, 68.5], [9, 9, 68.5]] }])");
  await page.until(isRead(0));
  const { statistics } = (await measures(page))[0];
  const { mean } = expectedOf((await measures(page))[0], dims, (place) => 2 * sampleOf(...place) + 10);
  assert.ok(Math.abs(statistics.mean - mean) < 1e-9);
  await page.key("s");
  await page.until(isDone);
  await page.move(...(await pointOf(page, 0, [60, 30, 68])));
  assert.equal((await readoutOf(page)).value, `${2 * sampleOf(60, 30, 68) + 10} HU`);
  assert.deepEqual(page.errors, []);
  await page.close();
  // What is no number does not count; where slices have slopes of their own, there is no slab.
  const holes = await open(write("slab-holes", [16, 14, 12], Float32Array, (x, y, z) => (z === 5 || x === 3 ? NaN : z)));
  await choose(holes, "slab-kind", "mean");
  await choose(holes, "slab-thickness", "4");
  await holes.evaluate("tagridViewer.actions.moveTo([10, 7, 5])");
  await holes.until(isDone);
  await holes.move(...(await pointOf(holes, 0, [8, 6, 5])));
  assert.equal((await readoutOf(holes))["mean of 4 slices"].trim(), String(Number(((4 + 6 + 7) / 3).toPrecision(12))));
  await holes.move(...(await pointOf(holes, 0, [3, 6, 5])));
  assert.equal((await readoutOf(holes))["mean of 4 slices"].trim(), "NaN");
  assert.equal(await holes.evaluate(`document.getElementById("slab-length").hidden`), true);
  write("steep", [12, 10, 4], Int16Array, (x) => x, ["slice_slopes:=1 2 3 4", "slice_intercepts:=0 0 0 0"]);
  await holes.choose("#file", [join(folder, "steep.tag")]);
  await holes.until(`tagridViewer.state.name === "steep.tag" && ${isDone}`);
  assert.match(await textOf(holes, "slab-note"), /each slice has its own slope/);
  assert.ok(!(await notesOf(holes, 0)).some((text) => /mean of/.test(text)));
  assert.deepEqual(holes.errors, []);
  await holes.close();
});
