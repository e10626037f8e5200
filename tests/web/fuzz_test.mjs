// Damaged files in the decoder for 32 bits: it says that they are damaged, or gives samples, the same with and without
// vectors. Its modules accept every checksum, since nearly no damage would get past them.
//   TAGRID_LONG=1   twenty times as many files
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { bytesOf, content, golden, goldenFiles, random } from "./files.mjs";

const { open, TagridError } = await import(pathToFileURL(join(process.env.TAGRID_FUZZED_DIST, "index.js")));

const rounds = process.env.TAGRID_LONG ? 10_000 : 500;
const expected = new Set(["broken-input", "newer-format", "out-of-memory", "not-supported", "no-grid"]);
const mostSamples = 1 << 16;
// In example_int16.tag, as docs/dev/format.md lists it.
const checksumOfTheFirstBrick = 263;

/** A copy with a few changes: bits, bytes, small and large numbers of four bytes, parts that move or are gone. */
function damaged(bytes, next) {
  let result = Buffer.from(bytes);
  // Parts that move or are gone are mostly found at once, so most files have none.
  const kinds = next(4) > 0 ? 3 : 7;
  for (let change = 1 + next(3); change > 0; --change) {
    const at = next(result.length);
    const length = Math.min(1 + next(64), result.length - at);
    switch (next(kinds)) {
      case 0:
      case 1:
        result[at] ^= 1 << next(8);
        break;
      case 2:
        result[at] = next(256);
        break;
      case 3:
        if (at + 4 <= result.length) result.writeUInt32LE([0, 1, 0x7fffffff, 0x80000000, 0xffffffff][next(5)], at);
        break;
      case 4:
        result.copy(result, next(result.length - length + 1), at, at + length);
        break;
      case 5:
        result = Buffer.concat([result.subarray(0, at), result.subarray(at + length)]);
        break;
      case 6:
        result = result.subarray(0, Math.max(at, 1));
    }
  }
  return result;
}

/** What a call gives: its bytes as text, or the code of its error. */
async function outcome(call) {
  try {
    return bytesOf(await call()).toString("base64");
  } catch (error) {
    assert.ok(error instanceof TagridError, `${error.stack}`);
    assert.ok(expected.has(error.code), `${error.code}: ${error.message}`);
    return error.code;
  }
}

/** A box of the level with few samples. */
function boxOf(dims, next) {
  const low = dims.map((n) => next(n));
  const high = low.map((l, axis) => Math.min(l + 1 + next(24), dims[axis]));
  return { low, high };
}

/** All that a file gives, in the same order for each kind of module. */
async function all(bytes, simd, seed) {
  const next = random(seed);
  let volume;
  const opened = await outcome(async () => {
    volume = await open(new Blob([bytes]), { workers: 0, simd });
    return new TextEncoder().encode(JSON.stringify([volume.dims, volume.levels, volume.metadata, volume.bounds]));
  });
  const found = [opened];
  if (!volume) return found;
  try {
    const samples = volume.dims.reduce((a, b) => a * b);
    found.push(await outcome(() => volume.read(samples <= mostSamples ? {} : { box: boxOf(volume.dims, next) })));
    for (const { level, dims } of volume.levels.slice(1))
      found.push(await outcome(() => volume.read({ level, box: boxOf(dims, next) })));
    const box = boxOf(volume.dims, next);
    found.push(await outcome(() => volume.activity({ box })));
    const axis = next(3);
    box.high[axis] = box.low[axis] + 1;
    found.push(await outcome(() => volume.edges({ axis, box })));
    if (volume.volumes > 1)
      found.push(
        await outcome(async () => {
          const other = await volume.volume(1);
          return other.read({ box: boxOf(other.dims, next) });
        }),
      );
  } finally {
    volume.close();
  }
  return found;
}

test("the modules accept every checksum", async () => {
  const name = "example_int16.tag";
  const samples = async (bytes, simd) => (await open(new Blob([bytes]), { workers: 0, simd })).read();
  const bytes = Buffer.from(content(join(golden, name)));
  const before = await samples(bytes, true);
  bytes[checksumOfTheFirstBrick] ^= 1;
  for (const simd of [true, false]) assert.deepEqual(await samples(bytes, simd), before);
});

test("damaged files are refused or decoded, the same with and without vectors", { timeout: 3_600_000 }, async () => {
  const files = goldenFiles.map((name) => [name, content(join(golden, name))]);
  let read = 0;
  for (let round = 0; round < rounds; ++round) {
    const next = random(round + 1);
    const [name, bytes] = files[next(files.length)];
    const file = damaged(bytes, next);
    const seed = 1 + next(1 << 30);
    const what = `${name}, round ${round}`;
    try {
      const found = await all(file, true, seed);
      if (found.length > 1 && !expected.has(found[1])) ++read;
      assert.deepEqual(await all(file, false, seed), found);
    } catch (error) {
      error.message = `${what}: ${error.message}`;
      throw error;
    }
  }
  console.log(`# ${rounds} damaged files, of which ${read} gave samples`);
  assert.ok(read > rounds / 20, "damage gets past the header and the index");
});
