// @tagrid/cornerstone: volumes have the values and the places that the program writes. With @cornerstonejs/core and
// esbuild in the directory of TAGRID_NODE_MODULES, Cornerstone3D draws one in headless Chromium.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, cpSync, existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { startChromium } from "./chromium.mjs";
import { bytesOf, decoded, folder, golden, goldenFiles, tagrid } from "./files.mjs";
import { serve } from "./server.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..", "..", "web");

/** A project with the packages as npm installs them. */
const project = join(folder, "cornerstone");
for (const name of ["niivue", "cornerstone", "decoder"]) {
  const at = join(project, "node_modules", "@tagrid", name);
  mkdirSync(at, { recursive: true });
  copyFileSync(join(web, name, "package.json"), join(at, "package.json"));
  if (name === "decoder") cpSync(process.env.TAGRID_DIST, join(at, "dist"), { recursive: true });
  else for (const file of JSON.parse(readFileSync(join(at, "package.json"), "utf8")).files) copyFileSync(join(web, name, file), join(at, file));
}
const { open } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "index.js")));
const { localVolume, registerTagrid } = await import(pathToFileURL(join(project, "node_modules", "@tagrid", "cornerstone", "index.js")));

const opened = (path) => open(new Blob([readFileSync(path)]), { workers: 1 });

/** A phantom with these lines in its header. */
function withHeader(name, lines, { type = "int16" } = {}, ...options) {
  const path = join(folder, `${name}.tag`);
  tagrid("phantom", "--dims", "40,30,20", "--type", type, "-q", "-o", join(folder, "samples.raw"), "-f");
  const head = ["NRRD0004", `type: ${{ float32: "float", float64: "double" }[type] ?? type}`, "dimension: 3", "sizes: 40 30 20", "encoding: raw", "endian: little", ...lines];
  writeFileSync(join(folder, `${name}.nhdr`), `${[...head, "data file: samples.raw"].join("\n")}\n`);
  tagrid("encode", join(folder, `${name}.nhdr`), "-q", "-f", "-o", path, ...options);
  return path;
}

test("places are those of the program, turned to left, back and up", async () => {
  const turned = ["space directions: (0,0.5,0) (-0.25,0,0.1) (0,0,2)", "space origin: (1,-2,3)"];
  const cases = [["plain", []], ["spaced", ["spacings: 0.5 0.25 2"]], ["micrometers", ["spacings: 500 250 2000", 'units: "um" "um" "um"']],
    ...["left-posterior-superior", "right-anterior-superior", "LAS"].map((space) => [space, [`space: ${space}`, ...turned]])];
  for (const [name, lines] of cases) {
    const path = withHeader(name, lines, {}, "--overviews", "4");
    const volume = await opened(path);
    const isKnown = name.length === 3 || name.includes("-");
    for (const [level, options] of [[0, []], [1, ["--overview", "4"]]]) {
      const made = await localVolume(volume, { level });
      // NIfTI: right, front, up. Lengths of the program are in the unit of the file.
      const nifti = join(folder, "expected.nii");
      tagrid("decode", path, "--samples", "-q", "-f", "-o", nifti, ...options);
      const expected = readFileSync(nifti);
      const length = (expected[123] & 7) === 3 ? 1e-3 : 1;
      assert.deepEqual(made.dimensions, [0, 1, 2].map((axis) => expected.readInt16LE(42 + 2 * axis)));
      if (name === "plain" && level === 1) {
        assert.deepEqual([made.spacing, made.origin], [[4, 4, 4], [1.5, 1.5, 1.5]]);
        continue;
      }
      for (const row of [0, 1, 2]) {
        const sign = isKnown && row < 2 ? -1 : 1;
        const numbers = [0, 1, 2].map((axis) => made.direction[3 * axis + row] * made.spacing[axis]).concat(made.origin[row]);
        numbers.forEach((number, column) => {
          const wanted = sign * length * expected.readFloatLE(280 + 16 * row + 4 * column);
          assert.ok(Math.abs(number - wanted) < 1e-5, `${name} ${level} ${row} ${column}: ${number} ${wanted}`);
        });
      }
    }
    await assert.rejects(localVolume(volume, { level: 2 }), RangeError);
    volume.close();
  }
});

test("values have a type that Cornerstone knows, and are exact where it can hold them", async () => {
  for (const [type, scale, Wanted] of [["int16", [], Int16Array], ["uint8", [], Uint8Array], ["uint16", [], Uint16Array], ["float32", [], Float32Array],
    ["int8", [], Int16Array], ["int32", [], Int16Array], ["float64", [], Float32Array], ["int16", [1, -1024], Int16Array],
    ["int16", [100, 0], Float32Array], ["uint8", [100, 5], Int16Array], ["uint8", [-1, 0], Int16Array], ["uint8", [200, 0], Uint16Array],
    ["int16", [0.5, 3], Float32Array]]) {
    const lines = scale.length ? [`rescale_slope:=${scale[0]}`, `rescale_intercept:=${scale[1]}`, "rescale_units:=HU"] : [];
    const path = withHeader("typed", lines, { type });
    const volume = await opened(path);
    const { scalarData, metadata } = await localVolume(volume);
    const samples = await volume.read();
    assert.ok(scalarData instanceof Wanted, `${type} ${scale}: ${scalarData.constructor.name}`);
    const [slope, intercept] = scale.length ? scale : [1, 0];
    for (let i = 0; i < samples.length; ++i) {
      const value = slope * samples[i] + intercept;
      assert.equal(scalarData[i], Wanted === Float32Array ? Math.fround(value) : value);
    }
    assert.equal(metadata.Modality, scale.length ? "CT" : "OT");
    assert.equal(metadata.BitsAllocated, 8 * scalarData.BYTES_PER_ELEMENT);
    const [{ windowWidth, windowCenter }] = metadata.voiLut;
    const ends = [volume.range.low, volume.range.high].map((end) => slope * end + intercept).sort((a, b) => a - b);
    assert.deepEqual([windowCenter - windowWidth / 2, windowCenter + windowWidth / 2], ends);
    volume.close();
  }
});

test("the loader opens addresses, levels and volumes, and can be stopped", async () => {
  const registered = {};
  const images = new Proxy({}, { get: (all, id) => (id.endsWith("_slice_0") ? (all[id] ??= { id }) : undefined) });
  registerTagrid({ cache: { getImage: (id) => images[id] },
    imageLoader: { registerImageLoader: (scheme, function_) => (registered[`images ${scheme}`] = function_) },
    metaData: { addProvider: (function_) => (registered.provider = function_) },
    volumeLoader: { registerVolumeLoader: (scheme, function_) => (registered[`volumes ${scheme}`] = function_),
      createLocalVolume: (id, options) => ({ id, ...options, imageIds: [`${id}_slice_0`], invalidate() {} }) } }, open, { workers: 1 });
  const loader = registered["volumes tagrid"];
  const server = await serve({ golden });
  try {
    for (const file of goldenFiles.filter((name) => /overviews|volumes|special/.test(name))) {
      const address = server.url(`golden/${file}`);
      const whole = await loader(`tagrid:${address}`).promise;
      assert.deepEqual([whole.id, whole.preventCache, whole.metadata.FrameOfReferenceUID], [`tagrid:${address}`, true, `tagrid:${address}`]);
      const plane = registered.provider("imagePlaneModule", `tagrid:${address}_slice_3`);
      assert.deepEqual(plane.imagePositionPatient, whole.origin.map((at, row) => at + 3 * whole.spacing[2] * whole.direction[6 + row]));
      assert.deepEqual([plane.columns, plane.rows], whole.dimensions.slice(0, 2));
      assert.deepEqual(registered.provider("generalSeriesModule", `tagrid:${address}_slice_3`), { modality: "OT" });
      assert.equal(images[`tagrid:${address}_slice_0`].windowWidth, whole.metadata.voiLut[0].windowWidth);
      for (const other of [["imagePlaneModule", `tagrid:${address}`], ["voiLutModule", `tagrid:${address}_slice_3`], ["imagePlaneModule", 5]])
        assert.equal(registered.provider(...other), undefined);
      const volume = await opened(join(golden, file));
      assert.deepEqual(whole.dimensions, volume.dims);
      if (volume.type === "int16") {
        const options = volume.volumes > 1 ? ["--volume", "0"] : [];
        assert.ok(bytesOf(whole.scalarData).equals(decoded(join(golden, file), ...options)), file);
      }
      if (volume.volumes > 1) {
        const second = await loader(`tagrid:${address}#volume=1&level=0`).promise;
        assert.ok(bytesOf(second.scalarData).equals(decoded(join(golden, file), "--volume", "1")), file);
      }
      if (volume.levels.length > 1) {
        const coarse = await loader(`tagrid:${address}#level=1`).promise;
        assert.ok(bytesOf(coarse.scalarData).equals(decoded(join(golden, file), "--overview", "4", "--volume", "0")), file);
        await assert.rejects(loader(`tagrid:${address}#level=9`).promise, RangeError);
        await assert.rejects(loader(`tagrid:${address}#level=a`).promise, RangeError);
      }
      volume.close();
    }
    assert.deepEqual(await registered["images tagrid"]("tagrid:a_slice_0").promise, { id: "tagrid:a_slice_0" });
    await assert.rejects(registered["images tagrid"]("tagrid:a_slice_1").promise, /no slice/);
    const { promise, cancelFn } = loader(`tagrid:${server.url(`golden/${goldenFiles[0]}?hang=1`)}`);
    cancelFn();
    await assert.rejects(promise, { name: "AbortError" });
  } finally {
    server.close();
  }
});

test("slopes of slices are said", async () => {
  const ones = (number) => Array(20).fill(number).join(" ");
  const volume = await opened(withHeader("sliced", [`slice_slopes:=${ones(2)}`, `slice_intercepts:=${ones(0)}`, "rescale_slope:=3"]));
  const { warn } = console;
  const said = [];
  console.warn = (text) => said.push(text);
  try {
    const { scalarData } = await localVolume(volume);
    assert.deepEqual(scalarData, await volume.read());
    assert.match(String(said), /slope of its own/);
  } finally {
    console.warn = warn;
  }
  volume.close();
});

const modules = process.env.TAGRID_NODE_MODULES ?? "/nonexistent";
const gone = ["@cornerstonejs/core", "esbuild"].filter((name) => !existsSync(join(modules, name)));
const why = gone.length ? `TAGRID_NODE_MODULES has no ${gone.join(", ")}` : !process.env.TAGRID_CHROMIUM && "there is no chromium";
test("Cornerstone3D shows a volume", { skip: why }, async () => {
  const path = withHeader("shown", ["space: left-posterior-superior", "space directions: (0.5,0,0) (0,0.5,0) (0,0,2)", "space origin: (10,20,30)",
    "rescale_slope:=2", "rescale_intercept:=-100"], {}, "--overviews", "4");
  writeFileSync(join(project, "page.js"), `
    import * as cornerstone from "@cornerstonejs/core";
    import { registerTagrid } from "@tagrid/cornerstone";
    const { open } = await import("/dist/index.js");
    const { Enums, RenderingEngine, init, metaData, volumeLoader, setVolumesForViewports } = cornerstone;
    async function shown() {
      await init();
      registerTagrid(cornerstone, open);
      const id = "tagrid:" + new URL("/made/shown.tag", document.baseURI) + "#level=0";
      const volume = await volumeLoader.createAndCacheVolume(id);
      const engine = new RenderingEngine("engine");
      engine.enableElement({ viewportId: "slice", element: document.getElementById("slice"), type: Enums.ViewportType.ORTHOGRAPHIC,
        defaultOptions: { orientation: Enums.OrientationAxis.AXIAL } });
      const viewport = engine.getViewport("slice");
      await setVolumesForViewports(engine, [{ volumeId: id }], ["slice"]);
      const drawn = new Promise((resolve) => viewport.element.addEventListener(Enums.Events.IMAGE_RENDERED, resolve, { once: true }));
      engine.renderViewports(["slice"]);
      await drawn;
      engine.enableElement({ viewportId: "stack", element: document.getElementById("stack"), type: Enums.ViewportType.STACK });
      const stack = engine.getViewport("stack");
      await stack.setStack(volume.imageIds, 10);
      stack.render();
      await new Promise((resolve) => setTimeout(resolve, 500));
      const greysOf = ({ canvas }) => {
        const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
        return new Set(pixels.filter((_, i) => i % 4 === 0)).size;
      };
      return { dims: volume.dimensions, at: volume.imageData.indexToWorld([3, 4, 5]), value: volume.voxelManager.getAtIJK(3, 4, 5),
        other: volume.voxelManager.getAtIJK(20, 15, 10), greys: greysOf(viewport), ofStack: greysOf(stack), range: viewport.getProperties().voiRange,
        plane: metaData.get("imagePlaneModule", volume.imageIds[4]).imagePositionPatient };
    }
    try {
      globalThis.tagridViewer = await shown();
    } catch (error) {
      globalThis.tagridViewer = { error: String(error.stack ?? error) };
    }`);
  // vtk.js, on which Cornerstone stands, has parts that want these modules of Node, but not for volumes.
  writeFileSync(join(project, "none.js"), "export class EventEmitter {}");
  const bundle = ["page.js", "--bundle", "--alias:events=./none.js", "--alias:url=./none.js", "--format=esm", "--target=esnext", "--external:/dist/*", "--outfile=bundle.js", "--log-level=error"];
  execFileSync(join(modules, ".bin", "esbuild"), bundle, { cwd: project, env: { ...process.env, NODE_PATH: modules } });
  writeFileSync(join(project, "page.html"),
    '<!DOCTYPE html><style>div { width: 300px; height: 300px }</style><div id="slice"></div><div id="stack"></div><script type="module" src="/project/bundle.js"></script>');
  const server = await serve({ dist: process.env.TAGRID_DIST, made: folder, project });
  const browser = await startChromium();
  try {
    const tab = await browser.newPage(400, 700);
    await tab.goTo(server.url("project/page.html"));
    await tab.until("true");
    if (process.env.TAGRID_PICTURE) await tab.picture(process.env.TAGRID_PICTURE);
    const { error, dims, at, value, other, greys, ofStack, range, plane } = await tab.evaluate("tagridViewer");
    assert.equal(error, undefined);
    assert.deepEqual(dims, [40, 30, 20]);
    [11.5, 22, 40].forEach((wanted, axis) => assert.ok(Math.abs(at[axis] - wanted) < 1e-4, String(at)));
    assert.deepEqual(plane, [10, 20, 38]);
    const all = decoded(path);
    const expected = (x, y, z) => 2 * all.readInt16LE(((z * 30 + y) * 40 + x) * 2) - 100;
    assert.deepEqual([value, other], [expected(3, 4, 5), expected(20, 15, 10)]);
    assert.ok(greys > 10 && ofStack > 10, `${greys} and ${ofStack} shades`);
    assert.ok(range.upper > range.lower, JSON.stringify(range));
  } finally {
    await browser.close();
    server.close();
    // Processes of the browser that end later write to its folder, which is removed at the end.
    await new Promise((resolve) => setTimeout(resolve, 1000));
  }
});
