// @tagrid/niivue: chunks and NIfTI files have the samples and the places that the program writes. With NiiVue in the
// directory of TAGRID_NODE_MODULES, it opens such a file in headless Chromium.
import assert from "node:assert/strict";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { startChromium } from "./chromium.mjs";
import { decoded, folder, golden, goldenFiles, made, part, tagrid } from "./files.mjs";
import { serve } from "./server.mjs";

const { open } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "index.js")));
const niivue = join(dirname(fileURLToPath(import.meta.url)), "..", "..", "web", "niivue");
const { chunkedSource, niftiFile } = await import(pathToFileURL(join(niivue, "index.js")));

const opened = (path) => open(new Blob([readFileSync(path)]), { workers: 1 });
const sizes = { uint8: 1, int8: 1, uint16: 2, int16: 2, uint32: 4, int32: 4, float32: 4, float64: 8 };

/** A phantom with these lines in its header. */
function withHeader(name, lines, ...options) {
  const path = join(folder, `${name}.tag`);
  tagrid("phantom", "--dims", "40,30,20", "-q", "-o", join(folder, "samples.raw"), "-f");
  const head = ["NRRD0004", "type: int16", "dimension: 3", "sizes: 40 30 20", "encoding: raw", "endian: little", ...lines];
  writeFileSync(join(folder, `${name}.nhdr`), `${[...head, "data file: samples.raw"].join("\n")}\n`);
  tagrid("encode", join(folder, `${name}.nhdr`), "-q", "-f", "-o", path, ...options);
  return path;
}

test("chunks of all levels, also beyond their borders", async () => {
  const path = made("chunks", [150, 140, 130], "int16", "--overviews", "4,16");
  const volume = await opened(path);
  const source = chunkedSource(volume);
  assert.equal(source.datatypeCode, 4);
  assert.deepEqual(source.levels.map(({ level, shape, spacing }) => [level, shape, spacing]),
    [[0, [150, 140, 130], [1, 1, 1]], [1, [38, 35, 33], [4, 4, 4]], [2, [10, 9, 9], [16, 16, 16]]]);
  for (const [levelIndex, options] of [[0, []], [1, ["--overview", "4"]], [2, ["--overview", "16"]]]) {
    const { shape } = source.levels[levelIndex];
    const all = decoded(path, ...options);
    for (const [low, size] of [[[0, 0, 0], shape], [[3, 2, 1], [5, 4, 3]], [[-1, -1, -1], shape.map((n) => n + 2)],
      [shape.map((n) => n - 2), [9, 8, 7]], [shape, [2, 2, 2]], [[-9, 0, 0], [3, 3, 3]]]) {
      const bytes = await source.fetchChunk({ levelIndex, texOrigin: low, texDims: size, bytesPerVoxel: 2 });
      const expected = Buffer.alloc(size[0] * size[1] * size[2] * 2);
      for (let z = 0; z < size[2]; ++z)
        for (let y = 0; y < size[1]; ++y)
          for (let x = 0; x < size[0]; ++x) {
            const at = [x, y, z].map((n, axis) => n + low[axis]);
            if (at.some((n, axis) => n < 0 || n >= shape[axis])) continue;
            all.copy(expected, ((z * size[1] + y) * size[0] + x) * 2, ((at[2] * shape[1] + at[1]) * shape[0] + at[0]) * 2,
              ((at[2] * shape[1] + at[1]) * shape[0] + at[0]) * 2 + 2);
          }
      assert.ok(Buffer.from(bytes).equals(expected), `${levelIndex} ${low} ${size}`);
    }
  }
  const ended = AbortSignal.abort();
  await assert.rejects(source.fetchChunk({ levelIndex: 0, texOrigin: [0, 0, 0], texDims: [1, 1, 1], signal: ended }), { name: "AbortError" });
  volume.close();
});

test("chunks of every golden file", async () => {
  for (const file of goldenFiles) {
    const volume = await opened(join(golden, file));
    const size = sizes[volume.type];
    const options = volume.volumes > 1 ? ["--volume", "0"] : [];
    const bytes = await chunkedSource(volume).fetchChunk({ levelIndex: 0, texOrigin: [0, 0, 0], texDims: volume.dims, bytesPerVoxel: size });
    assert.ok(Buffer.from(bytes).equals(decoded(join(golden, file), ...options)), file);
    volume.close();
  }
});

test("NIfTI with the places and values that the program writes", async () => {
  const turned = ["space directions: (0,0.5,0) (-0.25,0,0.1) (0,0,2)", "space origin: (1,-2,3)"];
  const cases = [["plain", []], ["spaced", ["spacings: 0.5 0.25 2"]], ["unknown", ["spacings: 0.5 nan 2"]],
    ["micrometers", ["spacings: 0.5 0.25 2", 'units: "um" "um" "um"']],
    ...["left-posterior-superior", "right-anterior-superior", "left-anterior-superior"].map((space) => [space, [`space: ${space}`, ...turned]]),
    ["hu", ["space: LPS", ...turned, "rescale_slope:=2", "rescale_intercept:=-100"]]];
  for (const [name, lines] of cases) {
    const path = withHeader(name, lines, "--overviews", "4");
    const volume = await opened(path);
    for (const [level, options] of [[0, []], [1, ["--overview", "4"]]]) {
      const nifti = join(folder, "expected.nii");
      tagrid("decode", path, "--samples", "-q", "-f", "-o", nifti, ...options);
      const expected = readFileSync(nifti);
      const file = await niftiFile(volume, { level, name: "x.nii" });
      const bytes = Buffer.from(await file.arrayBuffer());
      assert.equal(file.name, "x.nii");
      assert.ok(bytes.subarray(352).equals(expected.subarray(expected.readFloatLE(108))), name);
      for (const at of [40, 42, 44, 46, 70, 72]) assert.equal(bytes.readInt16LE(at), expected.readInt16LE(at), `${name} ${at}`);
      // The program keeps the unit of the file; 3 is micrometers.
      const scale = (expected[123] & 7) === 3 ? 1e-3 : 1;
      // Where a spacing is not known, samples of the volume are 1 apart here; the program writes 1 for overviews, too.
      const isUnknown = (axis) => level === 1 && (name === "plain" || (name === "unknown" && axis === 1));
      for (const axis of [0, 1, 2].filter(isUnknown)) {
        expected.writeFloatLE(4, 280 + 20 * axis);
        expected.writeFloatLE(1.5, 280 + 16 * axis + 12);
        expected.writeFloatLE(4, 80 + 4 * axis);
      }
      for (let i = 0; i < 12; ++i)
        assert.ok(Math.abs(bytes.readFloatLE(280 + 4 * i) - scale * expected.readFloatLE(280 + 4 * i)) < 1e-5, `${name} ${level}: matrix ${i}`);
      for (const i of [1, 2, 3])
        assert.ok(Math.abs(bytes.readFloatLE(76 + 4 * i) - scale * expected.readFloatLE(76 + 4 * i)) < 1e-5, `${name}: step ${i}`);
      const slope = (of) => [of.readFloatLE(112) || 1, of.readFloatLE(116)];
      assert.deepEqual(slope(bytes), slope(expected), name);
    }
    await assert.rejects(niftiFile(volume, { level: 2 }), RangeError);
    volume.close();
  }
});

test("slopes of slices count, and not that of the volume", async () => {
  const ones = (number) => Array(20).fill(number).join(" ");
  const path = withHeader("slices", [`slice_slopes:=${ones(2)}`, `slice_intercepts:=${ones(0)}`, "rescale_slope:=3",
    "rescale_intercept:=5"]);
  const volume = await opened(path);
  const { warn } = console;
  const said = [];
  console.warn = (text) => said.push(text);
  try {
    const file = new DataView(await (await niftiFile(volume)).arrayBuffer());
    assert.deepEqual([file.getFloat32(112, true), file.getFloat32(116, true)], [1, 0]);
    assert.match(String(said), /slope of its own/);
  } finally {
    console.warn = warn;
  }
  volume.close();
});

test("spellings of fields and units, and overviews without spacing", async () => {
  const step = (file) => [1, 2, 3].map((i) => file.getFloat32(76 + 4 * i, true));
  const place = (file) => [0, 1, 2].map((row) => file.getFloat32(280 + 16 * row + 12, true));
  const close = (a, b, what) => a.forEach((n, i) => assert.ok(Math.abs(n - b[i]) <= 1e-6 * Math.abs(b[i]), `${what}: ${a} is not ${b}`));
  const warn = console.warn;
  const said = [];
  console.warn = (text) => said.push(text);
  try {
    for (const [i, [unit, length]] of [["um", 1e-3], ["MM", 1], ["inches", 25.4], ["feet", 304.8], ["\u00c5", 1e-7], ["Micrometres", 1e-3],
      ["parsec", 1], ["constructor", 1]].entries()) {
      const path = withHeader(`unit-${i}`, ["SPACE:LPS", "Space Directions:(1,0,0) (0,2,0) (0,0,3)", "space origin:(1,2,3)",
        `Space Units:"${unit}" "${unit}" "${unit}"`]);
      const volume = await opened(path);
      const file = new DataView(await (await niftiFile(volume)).arrayBuffer());
      close(step(file), [1, 2, 3].map((n) => n * length), unit);
      close(place(file), [-1, -2, 3].map((n) => n * length), unit);
      volume.close();
    }
  } finally {
    console.warn = warn;
  }
  for (const unit of ["parsec", "constructor"]) assert.ok(said.some((text) => text.includes(unit)), unit);
  assert.ok(!said.some((text) => /inches|feet/.test(text)), String(said));
  const volume = await opened(withHeader("bare", [], "--overviews", "4"));
  const file = new DataView(await (await niftiFile(volume, { level: 1 })).arrayBuffer());
  assert.deepEqual([step(file), place(file)], [[4, 4, 4], [1.5, 1.5, 1.5]]);
  assert.deepEqual(chunkedSource(volume).levels.map(({ spacing }) => spacing), [[1, 1, 1], [4, 4, 4]]);
  volume.close();
});

const modules = process.env.TAGRID_NODE_MODULES ?? "/nonexistent";
const library = join(modules, "@niivue", "niivue", "dist", "index.js");
const why = existsSync(library) ? false : "there is no NiiVue before 1.0 in the directory of TAGRID_NODE_MODULES";
test("NiiVue shows a level", { skip: process.env.TAGRID_CHROMIUM ? why : "there is no chromium" }, async () => {
  const path = withHeader("shown", ["space: left-posterior-superior", "space directions: (0.5,0,0) (0,0.5,0) (0,0,2)", "space origin: (10,20,30)",
    "rescale_slope:=2", "rescale_intercept:=-100"], "--overviews", "4");
  const page = join(folder, "niivue.html");
  writeFileSync(page, `<!DOCTYPE html><canvas id="gl" width="400" height="300"></canvas><script type="module">
    import { open } from "/dist/index.js";
    import { niftiFile } from "/niivue/index.js";
    import { Niivue } from "/library/index.js";
    try {
      const nv = new Niivue();
      await nv.attachTo("gl");
      const volume = await open("/made/shown.tag");
      await nv.loadFromFile(await niftiFile(volume, { level: 0, name: "shown.nii" }));
      const [shown] = nv.volumes;
      globalThis.tagridViewer = { dims: shown.dims.slice(1, 4), at: shown.vox2mm([3, 4, 5], shown.matRAS), value: shown.getValue(3, 4, 5),
        name: shown.name };
    } catch (error) {
      globalThis.tagridViewer = { error: String(error.stack ?? error) };
    }
  </script>`);
  const server = await serve({ dist: process.env.TAGRID_DIST, made: folder, niivue, library: dirname(library) });
  const browser = await startChromium();
  try {
    const tab = await browser.newPage(500, 400);
    await tab.goTo(server.url("made/niivue.html"));
    await tab.until("true");
    const { error, dims, at, value } = await tab.evaluate("tagridViewer");
    assert.equal(error, undefined);
    assert.deepEqual(dims, [40, 30, 20]);
    const all = decoded(path);
    // NiiVue's first voxel is the one that is most left, posterior, inferior.
    const values = [];
    for (const x of [3, 36]) for (const y of [4, 25]) values.push(2 * all.readInt16LE(((5 * 30 + y) * 40 + x) * 2) - 100);
    assert.ok(values.includes(value), `${value} of ${values}`);
    assert.ok(Math.abs(at[2] - 40) < 1e-3, String(at));
  } finally {
    await browser.close();
    server.close();
  }
});
