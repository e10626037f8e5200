// The decoder gives the samples of the program, and the right code for what it cannot decode.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { setFlagsFromString } from "node:v8";
import { runInNewContext } from "node:vm";
import { edgeText, edgesOf, meshOf } from "./mesh.mjs";
import { bytesOf, content, decoded, folder, golden, goldenFiles, made, part, random, tagrid } from "./files.mjs";

const { open, TagridError } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "index.js")));

const kinds = [
  { name: "vectors", options: { workers: 0 } },
  { name: "no vectors", options: { workers: 0, simd: false } },
  { name: "workers", options: { workers: 2 } },
];

const blobOf = (path) => new Blob([content(path)]);

function boxes(dims, seed, count) {
  const next = random(seed);
  return Array.from({ length: count }, () => {
    const ends = dims.map((n) => [next(n), next(n)].sort((a, b) => a - b));
    return { low: ends.map(([a]) => a), high: ends.map(([, b]) => b + 1) };
  });
}

/** Compares a volume, boxes in it, and its overviews, with what the program says. */
async function same(volume, path, ...options) {
  const all = decoded(path, ...options);
  assert.ok(bytesOf(await volume.read()).equals(all), "all samples");
  const size = all.length / volume.dims.reduce((a, b) => a * b);
  for (const box of boxes(volume.dims, 1, 5))
    assert.ok(bytesOf(await volume.read({ box })).equals(part(all, volume.dims, size, box)), JSON.stringify(box));
  for (const { level, factor, dims } of volume.levels.slice(1)) {
    const overview = decoded(path, "--overview", String(factor), ...options);
    assert.ok(bytesOf(await volume.read({ level })).equals(overview), `overview ${factor}`);
    for (const box of boxes(dims, 2, 2))
      assert.ok(bytesOf(await volume.read({ level, box })).equals(part(overview, dims, size, box)));
  }
}

for (const { name, options } of kinds)
  test(`samples of golden files: ${name}`, async () => {
    for (const file of goldenFiles) {
      const path = join(golden, file);
      const volume = await open(blobOf(path), options);
      try {
        if (volume.volumes === 1) await same(volume, path);
        else
          for (let i = 0; i < volume.volumes; ++i) await same(await volume.volume(i), path, "--volume", String(i));
      } catch (error) {
        throw new Error(`${file}: ${error.message}`, { cause: error });
      } finally {
        volume.close();
      }
    }
  });

const encodings = [];
for (const type of ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"])
  for (const bound of [[], ["--max-error", "3"]]) encodings.push({ type, options: bound });
for (const type of ["uint8", "int16"])
  for (const options of [
    ["--effort", "fast", "--max-error", "2"],
    ["--effort", "best", "--max-error", "2"],
    ["--effort", "best"],
    ["--psnr", "40"],
    ["--grid-only"],
    ["--grid", "derived", "--max-error", "1"],
    ["--max-error", "4", "--surface-error", "1"],
    ["--lead", "0", "--overviews", "4,16"],
    ["--cube", "8", "--brick", "3", "--parity", "5%"],
  ])
    encodings.push({ type, options });

test("samples of files of every type and option", async () => {
  for (const [i, { type, options }] of encodings.entries()) {
    const path = made(`made-${i}`, [75, 70, 67], type, ...options);
    const volume = await open(blobOf(path), kinds[i % 2].options);
    try {
      assert.equal(volume.type, type);
      await same(volume, path);
    } catch (error) {
      throw new Error(`${type} ${options.join(" ")}: ${error.message}`, { cause: error });
    } finally {
      volume.close();
    }
  }
});

test("many bricks, in several pages of the index, and overviews", async () => {
  const path = made("pages", [300, 200, 190], "uint8", "--cube", "4", "--brick", "3", "--overviews", "4,16");
  const volume = await open(blobOf(path), { workers: 2, brickCache: 1 << 20, blockCache: 1 << 20 });
  await same(volume, path);
  volume.close();
});

test("descriptions", async () => {
  const source = join(folder, "described.nrrd");
  const samples = Buffer.alloc(600 * 4 * 3 * 2, 7);
  const head = ["NRRD0004", "type: int16", "dimension: 3", "sizes: 600 4 3", "encoding: raw", "endian: little",
    "space: left-posterior-superior", "space directions: (0.5,0,0) (0,0.5,0.1) (0,-0.2,2)", "space origin: (-1.5,2,3e2)",
    "patient:=nobody\\nat all", "volume_name:=thorax", "volume_name:=second", "Space Units:\"um\" \"um\" \"um\"", "Patient:=other",
    "rescale_intercept:=5", "rescale_intercept:=6",
    "a: b:=c"];
  writeFileSync(source, Buffer.concat([Buffer.from(`${head.join("\n")}\n\n`), samples]));
  const path = join(folder, "described.tag");
  tagrid("encode", source, "-q", "-o", path, "--max-error", "2", "--overviews", "4");
  const volume = await open(blobOf(path), { workers: 0 });
  assert.deepEqual(volume.dims, [600, 4, 3]);
  assert.equal(volume.type, "int16");
  assert.deepEqual(volume.geometry, {
    spacing: [0.5, Math.sqrt(0.5 * 0.5 + 0.1 * 0.1), Math.sqrt(0.2 * 0.2 + 4)],
    origin: [-1.5, 2, 300],
    directions: [[0.5, 0, 0], [0, 0.5, 0.1], [0, -0.2, 2]],
  });
  assert.equal(volume.bounds.maxError, 2);
  assert.equal(volume.bounds.surfaceError, null);
  assert.deepEqual(volume.range, { low: 0x0707, high: 0x0707, mean: 0x0707 });
  assert.equal(volume.name, "second");
  assert.equal(volume.field("space units"), '"um" "um" "um"');
  assert.equal(volume.field("SPACE"), "left-posterior-superior");
  assert.deepEqual(["patient", "Patient", "a: b", "PATIENT"].map((key) => volume.pair(key)), ["nobody\nat all", "other", "c", undefined]);
  // What the page of the viewer says of it.
  const { scaleOf } = await import("../../web/viewer/src/describe.js");
  const { placesOf } = await import("../../web/viewer/src/places.js");
  assert.deepEqual([scaleOf(volume).intercept, placesOf(volume).unit], [6, "µm"]);
  assert.match(volume.metadata, /^patient:=nobody\\nat all$/m);
  assert.equal(volume.fileBytes, content(path).length);
  assert.deepEqual([volume.brickEdge, volume.lead, volume.volumes], [64, true, 1]);
  assert.deepEqual(volume.levels.map(({ factor, dims }) => [factor, dims]), [[1, [600, 4, 3]], [4, [150, 1, 1]]]);
  // What the file itself says of the overview.
  const described = tagrid("decode", path, "--overview", "4", "--format", "nrrd", "-q", "-o", "-").toString("latin1");
  const numbers = (key) => new RegExp(`^${key}: (.*)$`, "m").exec(described)[1].match(/-?[\d.]+(e[+-]?\d+)?/g).map(Number);
  const close = (a, b) => a.forEach((n, i) => assert.ok(Math.abs(n - b[i]) < 1e-9, `${a} is not ${b}`));
  close(volume.levels[1].geometry.origin, numbers("space origin"));
  close(volume.levels[1].geometry.directions.flat(), numbers("space directions"));
  volume.close();

  const plain = await open(blobOf(join(golden, "voxels_lossless_float32.tag")), { workers: 0 });
  assert.equal(plain.bounds.maxError, 0);
  plain.close();
});

test("a number of many digits", async () => {
  const source = join(folder, "digits.nrrd");
  const spacing = `1.5${"0".repeat(300000)}`;
  const head = `NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\nspacings: ${spacing} 1 1\n\n`;
  writeFileSync(source, Buffer.concat([Buffer.from(head), Buffer.alloc(64, 3)]));
  const path = join(folder, "digits.tag");
  tagrid("encode", source, "-q", "-o", path);
  const volume = await open(blobOf(path), { workers: 1 });
  assert.deepEqual(volume.geometry.spacing, [1.5, 1, 1]);
  assert.ok(bytesOf(await volume.read()).equals(Buffer.alloc(64, 3)));
  volume.close();
});

test("the grid in slices, and its vertices", async () => {
  for (const [i, options] of [
    ["--max-error", "2"],
    ["--max-error", "9", "--surface-error", "1", "--lead", "0"],
    ["--grid-only", "--cube", "8", "--brick", "3"],
    ["--grid-only", "--max-level", "8"],
  ].entries()) {
    const path = made(`grid-${i}`, [75, 70, 67], i % 2 ? "float32" : "uint8", ...options);
    const mesh = meshOf(path);
    const volume = await open(blobOf(path), kinds[i % 3].options);
    assert.ok(volume.storesGrid);
    for (const [axis, slice] of [[0, 0], [1, 64], [2, 33], [2, 66]]) {
      const box = { low: [0, 0, 0], high: [...volume.dims] };
      [box.low[axis], box.high[axis]] = [slice, slice + 1];
      const edges = await volume.edges({ axis, box });
      const texts = new Set();
      for (let e = 0; e < edges.length; e += 4) texts.add(edgeText(edges.subarray(e, e + 4)));
      assert.deepEqual([...texts].sort(), edgesOf(mesh, axis, slice), `${options.join(" ")}: slice ${slice} across ${axis}`);
      assert.ok(texts.size > 20);
    }
    const used = new Set(mesh.tetrahedra.flat());
    const vertices = new Set([...used].map((tag) => mesh.points.get(tag).join()));
    const box = { low: [20, 3, 0], high: [75, 70, 66] };
    const activity = await volume.activity({ box });
    const [nx, ny, nz] = box.high.map((high, axis) => high - box.low[axis]);
    for (let z = 0, at = 0; z < nz; ++z)
      for (let y = 0; y < ny; ++y)
        for (let x = 0; x < nx; ++x, ++at)
          if (activity[at] !== Number(vertices.has(`${x + 20},${y + 3},${z}`))) assert.fail(`${[x + 20, y + 3, z]}`);
    volume.close();
  }
  const derived = await open(blobOf(join(golden, "voxels_derived_grid_int16.tag")), { workers: 0 });
  assert.ok(!derived.storesGrid);
  assert.equal(await code(derived.activity()), "no-grid");
  derived.close();
});

const code = async (promise) => {
  try {
    await promise;
  } catch (error) {
    assert.ok(error instanceof TagridError, String(error.stack));
    assert.ok(error.message.length > 5);
    return error.code;
  }
  return "none";
};

test("edges that 32 bits cannot hold are refused", async () => {
  const { int32Of } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "wasm.js")));
  const words = (...numbers) => new Int32Array(new BigInt64Array(numbers).buffer);
  const most = 2n ** 31n;
  assert.deepEqual([...int32Of(words(0n, -1n, most - 1n, -most, 7n))], [0, -1, 2 ** 31 - 1, -(2 ** 31), 7]);
  for (const far of [most, -most - 1n, 2n ** 32n, 2n ** 32n + 5n, -(2n ** 40n)])
    assert.throws(() => int32Of(words(1n, far)), (error) => error instanceof TagridError && error.code === "not-supported");
});

test("a newer file has a code of its own", async () => {
  const forge = `import sys; sys.path.insert(0, "${join(golden, "../../format")}"); from forged import of_version_6
sys.stdout.buffer.write(of_version_6(open("${join(golden, "example_int16.tag")}", "rb").read()))`;
  const bytes = execFileSync("python3", ["-B", "-c", forge]);
  assert.equal(await code(open(new Blob([bytes]), { workers: 0 })), "newer-format");
});

test("what is not a whole .tag file is broken input", async () => {
  const whole = content(join(golden, "lead_voxels_overviews_int16.tag"));
  const volume = await open(new Blob([whole]), { workers: 0 });
  const samples = bytesOf(await volume.read());
  volume.close();
  for (const bytes of ["", "x", "NRRD0004\n", "II*\0", "<!DOCTYPE html>".repeat(1000), Buffer.alloc(1 << 19)])
    assert.equal(await code(open(new Blob([bytes]), { workers: 0 })), "broken-input");
  const next = random(3);
  for (let i = 0; i < 120; ++i) {
    let bytes = Buffer.from(whole);
    const at = next(whole.length);
    if (i % 3 === 0) bytes = bytes.subarray(0, at);
    else bytes[at] ^= 1 << next(8);
    const opened = await open(new Blob([bytes]), { workers: 0 }).catch((error) => error);
    if (opened instanceof Error) {
      assert.equal(opened.code, "broken-input");
      continue;
    }
    // Damage elsewhere, as in an overview, costs no sample.
    try {
      assert.ok(bytesOf(await opened.read()).equals(samples));
    } catch (error) {
      assert.equal(error.code, "broken-input", String(error.stack));
    }
    opened.close();
  }
});

test("mistakes of a caller", async () => {
  const volume = await open(blobOf(join(golden, "voxels_bounded_int16.tag")), { workers: 1 });
  const [nx, ny, nz] = volume.dims;
  for (const box of [
    { low: [0, 0, 0], high: [nx + 1, ny, nz] },
    { low: [0, 0, -1], high: [nx, ny, nz] },
    { low: [0, 0, 1], high: [nx, ny, 1] },
    { low: [0, 0, 0.5], high: [nx, ny, nz] },
    { low: [0, 0], high: [nx, ny] },
    null,
    {},
  ])
    assert.equal(await code(volume.read({ box })), "invalid-argument");
  assert.equal(await code(volume.read({ level: 1 })), "invalid-argument");
  assert.equal(await code(volume.volume(1)), "invalid-argument");
  assert.equal(await code(open({ size: 3 })), "invalid-argument");
  for (const given of ["a.tag", "http://", "http://a:b:c/"]) assert.equal(await code(open(given)), "invalid-argument");
  for (const size of [NaN, -5, 1.5, "7"]) assert.equal(await code(open("http://127.0.0.1:9/a.tag", { size })), "invalid-argument");
  assert.equal(await code(open(new Blob([]), { connections: 0 })), "invalid-argument");
  assert.equal(await code(open(new Blob([]), { base: pathToFileURL(`${folder}/`) })), "not-supported");
  const reading = code(volume.read());
  volume.close();
  assert.equal(await reading, "closed");
  assert.equal(await code(volume.read()), "closed");
});

test("without the code of the workers, all reads fail, also those that wait for a worker", async () => {
  const base = join(folder, "no-worker");
  mkdirSync(base);
  for (const name of ["tagrid_simd.wasm", "tagrid_scalar.wasm"])
    copyFileSync(join(process.env.TAGRID_DIST, name), join(base, name));
  const file = blobOf(join(golden, "pages_lossless_uint8.tag"));
  const volume = await open(file, { workers: 1, base: pathToFileURL(`${base}/`) });
  const { brickEdge } = volume;
  const read = (i) => code(volume.read({ box: { low: [i * brickEdge + 1, 0, 0], high: [i * brickEdge + 2, 1, 1] } }));
  assert.deepEqual(await Promise.all([read(0), read(1), read(2)]), Array(3).fill("not-supported"));
  assert.equal(await read(3), "not-supported");
  volume.close();
});

test("an aborted read leaves no failure that nobody hears of", async () => {
  const path = made("pages-of-8", [300, 200, 60], "uint8", "--cube", "4", "--brick", "2");
  const bytes = content(path);
  const unheard = [];
  const hear = (error) => unheard.push(error);
  process.on("unhandledRejection", hear);
  const later = () => new Promise((resolve) => setTimeout(resolve, 5));
  try {
    // The read needs two pages of the index. It is aborted a little after the first one came; the second one fails.
    for (let steps = 0; steps < 40; ++steps) {
      let give;
      let kind = "open";
      const source = {
        size: bytes.length,
        read(offset, length) {
          const part = new Uint8Array(bytes.subarray(offset, offset + length));
          if (kind === "open") return part;
          return new Promise((resolve, reject) => {
            if (kind === "fail") setTimeout(() => reject(new Error("gone")), 1);
            else give = () => resolve(part);
          });
        },
      };
      const volume = await open(source, { workers: 0 });
      kind = "wait";
      const controller = new AbortController();
      const reading = volume.read({ box: { low: [0, 42, 34], high: [300, 120, 35] }, signal: controller.signal });
      await later();
      kind = "fail";
      give();
      for (let i = 0; i < steps; ++i) await null;
      controller.abort();
      await assert.rejects(reading, { name: "AbortError" });
      await later();
      volume.close();
    }
    await later();
    assert.deepEqual(unheard, []);
  } finally {
    process.off("unhandledRejection", hear);
  }
});

test("any source, and reads that share what they fetch", async () => {
  const path = made("shared", [200, 130, 70], "int16", "--max-error", "2", "--overviews", "4");
  const bytes = content(path);
  const asked = [];
  const source = {
    size: bytes.length,
    async read(offset, length) {
      asked.push([offset, length]);
      await new Promise((resolve) => setTimeout(resolve, 5));
      return new Uint8Array(bytes.subarray(offset, offset + length));
    },
  };
  const volume = await open(source, { workers: 2 });
  const box = { low: [0, 0, 5], high: [200, 130, 6] };
  const both = await Promise.all([volume.read({ box }), volume.read({ box }), volume.read({ box })]);
  const expected = part(decoded(path), volume.dims, 2, box);
  for (const samples of both) assert.ok(bytesOf(samples).equals(expected));
  const ranges = asked.map(String);
  assert.equal(new Set(ranges).size, ranges.length, "no range is fetched twice");
  const before = asked.length;
  // More slices of the same bricks: their blocks were kept.
  const more = { low: [3, 4, 5], high: [190, 120, 40] };
  assert.ok(bytesOf(await volume.read({ box: more })).equals(part(decoded(path), volume.dims, 2, more)));
  assert.equal(asked.length, before);
  volume.close();

  const failing = { size: bytes.length, read: async () => { throw new Error("no"); } };
  assert.equal(await code(open(failing)), "io-error");
  const silent = { size: bytes.length, read: () => Promise.reject(undefined) };
  assert.equal(await code(open(silent)), "io-error");
  const short = { size: bytes.length, read: async (offset, length) => new Uint8Array(length - 1) };
  assert.equal(await code(open(short)), "io-error");
});

test("aborted reads", async () => {
  const path = made("shared", [200, 130, 70], "int16", "--max-error", "2", "--overviews", "4");
  const bytes = content(path);
  let signals = [];
  const source = {
    size: bytes.length,
    async read(offset, length, signal) {
      signals.push(signal);
      await new Promise((resolve) => setTimeout(resolve, 30));
      return new Uint8Array(bytes.subarray(offset, offset + length));
    },
  };
  const volume = await open(source, { workers: 1, blockCache: 0, brickCache: 0 });
  // The page of the index.
  await volume.read({ box: { low: [0, 0, 0], high: [1, 1, 1] } });
  signals = [];
  const one = new AbortController();
  const box = { low: [0, 0, 0], high: [200, 130, 70] };
  const [alone, other] = [volume.read({ box, signal: one.signal }), new AbortController()];
  await new Promise((resolve) => setTimeout(resolve, 10));
  one.abort(new Error("enough"));
  await assert.rejects(alone, /enough/);
  assert.ok(signals.length > 0 && signals.at(-1).aborted, "nobody waits for the range");
  // Of two reads of the same bricks, one is aborted.
  signals = [];
  const [stopped, stays] = [volume.read({ box, signal: other.signal }), volume.read({ box })];
  await new Promise((resolve) => setTimeout(resolve, 10));
  other.abort();
  await assert.rejects(stopped, { name: "AbortError" });
  assert.ok(bytesOf(await stays).equals(decoded(path)));
  await assert.rejects(volume.read({ signal: AbortSignal.abort() }), { name: "AbortError" });
  await assert.rejects(open(source, { signal: AbortSignal.abort() }), { name: "AbortError" });
  volume.close();
});

test("memory stays the same however often a file is read", async () => {
  setFlagsFromString("--expose-gc");
  const collect = runInNewContext("gc");
  const used = async () => {
    for (let i = 0; i < 3; ++i) {
      collect();
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    const { heapUsed, arrayBuffers } = process.memoryUsage();
    return heapUsed + arrayBuffers + memories.reduce((sum, { buffer }) => sum + buffer.byteLength, 0);
  };
  const memories = [];
  const { Instance } = WebAssembly;
  WebAssembly.Instance = class extends Instance {
    constructor(...more) {
      super(...more);
      memories.push(this.exports.memory);
    }
  };
  // Older browsers have no such function.
  const { any } = AbortSignal;
  AbortSignal.any = undefined;
  try {
    const path = made("shared", [200, 130, 70], "int16", "--max-error", "2", "--overviews", "4");
    const all = decoded(path);
    // The caches are smaller than what is read.
    const volume = await open(blobOf(path), { workers: 0, blockCache: 100 << 10, brickCache: 2 << 20 });
    const { signal } = new AbortController();
    const look = async (reads) => {
      for (let i = 0; i < reads; ++i) {
        const z = i % 7 === 0 ? Math.floor(i / 7) % 70 : 3;
        const box = { low: [0, 0, z], high: [i % 50 === 0 ? 200 : 3, 2, z + 1] };
        assert.ok(bytesOf(await volume.read({ box, signal })).equals(part(all, volume.dims, 2, box)));
      }
    };
    await look(1000);
    const before = await used();
    await look(4000);
    const after = await used();
    volume.close();
    assert.equal(memories.length, 2);
    assert.ok(after < 1.03 * before, `${before} bytes, and ${after} after 4000 more reads`);
  } finally {
    AbortSignal.any = any;
    WebAssembly.Instance = Instance;
  }
});
