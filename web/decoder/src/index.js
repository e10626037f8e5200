// @tagrid/decoder: .tag files in browsers and Node.js. index.d.ts describes what is exported.
import { Bricks } from "./bricks.js";
import { TagridError, require, unlessAborted } from "./errors.js";
import { fieldsOf } from "./fields.js";
import { baseOf, compile } from "./files.js";
import { cores } from "./platform.js";
import { Pool } from "./pool.js";
import { Queue, Recent } from "./queue.js";
import { openSource, within } from "./source.js";
import { Wasm, boxBytes, types } from "./wasm.js";

export { TagridError };
export const version = "1.0.0-rc.3";

const megabyte = 1 << 20;
// Parts of the index that are kept, of at most 256 KiB.
const partsOfIndex = 16;
const activityCache = 64 * megabyte;

export async function open(given, options = {}) {
  const { signal, workers, connections = 6, retries, simd = true } = options;
  require(workers === undefined || (Number.isInteger(workers) && workers >= 0 && workers <= 256), "workers must be 0 to 256");
  require(Number.isInteger(connections) && connections >= 1 && connections <= 64, "connections must be 1 to 64");
  require(retries === undefined || (Number.isInteger(retries) && retries >= 0), "retries must be 0 or more");
  require(options.size === undefined || (Number.isSafeInteger(options.size) && options.size >= 0),
    "size must be a whole number of bytes");
  signal?.throwIfAborted();
  const base = baseOf(options.base);
  const [source, module, count] = await unlessAborted(
    Promise.all([openSource(given, options), compile("tagrid", base, simd), workers ?? cores().then((n) => Math.max(n - 1, 1))]),
    signal,
  );
  const gridPool = async () => new Pool(await compile("tagrid_grid", base, simd), base, count);
  const file = new File(source, module, new Pool(module, base, count), gridPool, connections, options);
  try {
    const blocks = file.wasm.create(source.size);
    await file.call(blocks, () => file.wasm.open(blocks), signal);
    return new Volume(file, file.stream(blocks), 0);
  } catch (error) {
    file.close();
    throw error;
  }
}

/** What the volumes of a file share. */
class File {
  #source;
  #queue;
  #connections;
  #blocks;
  #gridPool;
  #grids = new Map();
  #streams = 0;
  #fetching = new Map();
  #index = [];
  #ended = new AbortController();
  #running = new Set();
  volumes = new Map();

  constructor(source, module, pool, gridPool, connections, { blockCache = 64 * megabyte, brickCache = 256 * megabyte }) {
    this.#source = source;
    this.#queue = new Queue(connections);
    this.#connections = connections;
    this.#blocks = new Recent(blockCache);
    this.#gridPool = gridPool;
    this.bytes = source.size;
    this.wasm = new Wasm(module);
    this.pool = pool;
    this.bricks = new Bricks(this, pool, connections, "decode", this.#blocks, brickCache);
  }

  /** What decodes the grid, which few need: a pool of its own, and the activity of bricks. */
  grid(signal) {
    return this.run(signal, (until) =>
      shared(this.#grids, "grid", until, async () => {
        const pool = await this.#gridPool();
        const activity = new Bricks(this, pool, this.#connections, "activity", this.#blocks, activityCache);
        this.#ended.signal.addEventListener("abort", () => {
          pool.close();
          activity.clear();
        });
        this.requireOpen();
        return { pool, activity };
      }),
    );
  }

  close() {
    const reason = new TagridError("closed", "the file was closed");
    this.#ended.abort(reason);
    for (const controller of this.#running) controller.abort(reason);
    this.pool.close();
    this.bricks.clear();
    this.wasm = undefined;
  }

  requireOpen() {
    this.#ended.signal.throwIfAborted();
  }

  /**
   * Calls `work(until)`, where the signal `until` is that of the caller, or the end of the file. Nothing of it stays:
   * AbortSignal.any() would leave something at the file for each call, in some engines until the file is closed.
   */
  async run(signal, work) {
    this.requireOpen();
    signal?.throwIfAborted();
    const controller = new AbortController();
    const stop = () => controller.abort(signal.reason);
    signal?.addEventListener("abort", stop, { once: true });
    this.#running.add(controller);
    try {
      return await work(controller.signal);
    } finally {
      this.#running.delete(controller);
      signal?.removeEventListener("abort", stop);
    }
  }

  /** Bytes of the file, and what is done with them while they count as one of the ranges that are fetched at once. */
  fetch(offset, length, signal, use) {
    return this.run(signal, (until) =>
      this.#queue.run(async () => use(await this.#source.read(offset, length, until)), until),
    );
  }

  /** A part of the index. Calls that need it at the same time share it, and the last parts are kept. */
  #fetchOnce({ offset, length }) {
    const kept = within(this.#index, offset, length);
    if (kept) return { offset, bytes: kept };
    const key = `${offset} ${length}`;
    let fetched = this.#fetching.get(key);
    if (!fetched) {
      fetched = this.fetch(offset, length, undefined, (bytes) => {
        this.#index = [{ offset, bytes }, ...this.#index].slice(0, partsOfIndex);
        return { offset, bytes };
      });
      this.#fetching.set(key, fetched);
      fetched.catch(() => {}).finally(() => this.#fetching.delete(key));
    }
    return fetched;
  }

  /** Repeats a call that may lack bytes, with these bytes, until it does not. */
  async call(blocks, work, signal) {
    const given = [];
    for (let round = 0; round < 1000; ++round) {
      this.requireOpen();
      for (const { offset, bytes } of given) this.wasm.give(blocks, offset, bytes);
      const result = work();
      if (result !== undefined) return result;
      const needed = () => Promise.all(this.wasm.needs(blocks).map((range) => this.#fetchOnce(range)));
      // A call that has ended asks for nothing: nobody would hear that it failed.
      given.push(...(await this.run(signal, (until) => unlessAborted(needed(), until))));
    }
    throw new TagridError("bug", "the same bytes are needed again and again");
  }

  /** The description of an open file, overview or volume. */
  stream(blocks) {
    return { id: this.#streams++, blocks, ...this.wasm.info(blocks) };
  }
}

class Volume {
  #file;
  #stream;
  #overviews = new Map();
  #lines;

  constructor(file, stream, number) {
    this.#file = file;
    this.#stream = stream;
    if (number === 0) file.volumes.set(0, Promise.resolve(this));
    this.dims = stream.dims;
    this.type = types[stream.type][0];
    this.geometry = stream.geometry;
    this.levels = [1, ...stream.factors].map((factor, level) => ({
      level,
      factor,
      dims: stream.dims.map((n) => Math.floor((n - 1) / factor) + 1),
      geometry: geometryOf(stream.geometry, factor),
    }));
    this.storesGrid = stream.storesGrid;
    this.bounds = stream.bounds;
    this.range = stream.range;
    this.metadata = stream.metadata;
    this.#lines = fieldsOf(stream.metadata);
    this.name = this.pair("volume_name") ?? "";
    this.brickEdge = stream.brickEdge;
    this.lead = stream.lead;
    this.fileBytes = file.bytes;
    this.volumes = number === 0 ? stream.volumes : undefined;
  }

  field(name) {
    return this.#lines.fields.get(name.toLowerCase());
  }

  pair(key) {
    return this.#lines.pairs.get(key);
  }

  async volume(number, { signal } = {}) {
    const file = this.#file;
    file.requireOpen();
    const first = await file.volumes.get(0);
    require(Number.isInteger(number) && number >= 0 && number < first.volumes,
      `there is no volume ${number}; the volumes are 0 to ${first.volumes - 1}`);
    return file.run(signal, (until) =>
      shared(file.volumes, number, until, async () => {
        const outer = first.#stream.blocks;
        const blocks = await file.call(outer, () => file.wasm.volume(outer, number));
        const volume = new Volume(file, file.stream(blocks), number);
        volume.volumes = first.volumes;
        return volume;
      }),
    );
  }

  async read({ box, level = 0, signal } = {}) {
    const file = this.#file;
    file.requireOpen();
    signal?.throwIfAborted();
    require(Number.isInteger(level) && level >= 0 && level < this.levels.length,
      `there is no level ${level}; the levels are 0 to ${this.levels.length - 1}`);
    const { dims, factor } = this.levels[level];
    const wanted = boxWithin(box, dims);
    file.pool.warm();
    const stream = level === 0 ? this.#stream : await this.#overview(factor, signal);
    const shape = wanted.high.map((high, axis) => high - wanted.low[axis]);
    const [, Samples] = types[stream.type];
    const samples = allocated(Samples, shape);
    const bricks = await this.#plan(stream, wanted, signal);
    const use = (brick, bytes) =>
      copy(new Samples(bytes.buffer, bytes.byteOffset, bytes.byteLength / Samples.BYTES_PER_ELEMENT), brick, samples, wanted, shape);
    await file.run(signal, (until) => file.bricks.read(stream, bricks, until, use));
    return samples;
  }

  async activity({ box, signal } = {}) {
    const wanted = boxWithin(box, this.dims);
    const { activity } = await this.#grid(signal);
    const shape = wanted.high.map((high, axis) => high - wanted.low[axis]);
    const points = allocated(Uint8Array, shape);
    const bricks = await this.#plan(this.#stream, wanted, signal);
    const use = (brick, bytes) => copyBits(bytes, brick, points, wanted, shape);
    await this.#file.run(signal, (until) => activity.read(this.#stream, bricks, until, use));
    return points;
  }

  async edges({ axis, box, signal } = {}) {
    require([0, 1, 2].includes(axis), "an axis is 0, 1 or 2");
    const wanted = boxWithin(box, this.dims);
    const slice = wanted.low[axis];
    require(wanted.high[axis] === slice + 1, "the box is one slice across the axis");
    const { activity, pool } = await this.#grid(signal);
    const { id: stream, header } = this.#stream;
    const bricks = await this.#plan(this.#stream, wanted, signal);
    const parts = await this.#file.run(signal, async (until) => {
      const tasks = [];
      await activity.read(this.#stream, bricks, until, (brick, bytes) => {
        const task = { kind: "edges", stream, header, brick, bytes, more: { axis, slice } };
        const edges = pool.run(task, () => !until.aborted);
        edges.catch(() => {});
        tasks.push(edges);
      });
      return unlessAborted(Promise.all(tasks), until);
    });
    const all = new Int32Array(parts.reduce((sum, { length }) => sum + length, 0) / 4);
    let at = 0;
    for (const { buffer, length } of parts) {
      all.set(new Int32Array(buffer), at);
      at += length / 4;
    }
    return all;
  }

  close() {
    this.#file.close();
  }

  #grid(signal) {
    this.#file.requireOpen();
    signal?.throwIfAborted();
    if (!this.storesGrid) throw new TagridError("no-grid", "the file stores no grid; it follows from its samples");
    return this.#file.grid(signal);
  }

  #overview(factor, signal) {
    return this.#file.run(signal, (until) =>
      shared(this.#overviews, factor, until, async () => {
        const { wasm } = this.#file;
        const outer = this.#stream.blocks;
        return this.#file.stream(await this.#file.call(outer, () => wasm.overview(outer, factor)));
      }),
    );
  }

  /** The bricks of a box. */
  async #plan({ blocks }, box, signal) {
    const all = [];
    for (;;) {
      const some = await this.#file.call(blocks, () => this.#file.wasm.plan(blocks, box, all.length), signal);
      all.push(...some);
      if (Wasm.planIsComplete(some)) return all;
    }
  }
}

/** What several calls wait for, one of which makes it. A failure is not kept. */
function shared(made, key, until, make) {
  let promise = made.get(key);
  if (!promise) {
    promise = make();
    made.set(key, promise);
    promise.catch(() => made.delete(key));
  }
  return unlessAborted(promise, until);
}

function boxWithin(box, dims) {
  if (box === undefined) return { low: [0, 0, 0], high: [...dims] };
  require(Array.isArray(box?.low) && Array.isArray(box.high), "a box has low and high, three whole numbers each");
  const { low, high } = { low: [...box.low], high: [...box.high] };
  require(low.length === 3 && high.length === 3 && [...low, ...high].every(Number.isInteger), "a box has whole numbers");
  for (let axis = 0; axis < 3; ++axis)
    require(low[axis] >= 0 && low[axis] < high[axis] && high[axis] <= dims[axis],
      `the box is empty, or not within ${dims.join(" x ")} samples`);
  return { low, high };
}

function allocated(Samples, [x, y, z]) {
  try {
    return new Samples(x * y * z);
  } catch (cause) {
    throw new TagridError("out-of-memory", `${x} x ${y} x ${z} samples do not fit into memory`, { cause });
  }
}

/** Copies the samples of a brick that lie in a box. */
function copy(from, { low, high }, to, box, [nx, ny]) {
  const first = low.map((l, axis) => Math.max(l, box.low[axis]));
  const end = high.map((h, axis) => Math.min(h, box.high[axis]));
  const [bx, by] = [high[0] - low[0], high[1] - low[1]];
  const count = end[0] - first[0];
  for (let z = first[2]; z < end[2]; ++z)
    for (let y = first[1]; y < end[1]; ++y) {
      const at = ((z - low[2]) * by + y - low[1]) * bx + first[0] - low[0];
      to.set(from.subarray(at, at + count), ((z - box.low[2]) * ny + y - box.low[1]) * nx + first[0] - box.low[0]);
    }
}

/** Copies the bits of the points of a brick that are samples of a box, from an activity (see Wasm). */
function copyBits(activity, { low, high }, to, box, [nx, ny]) {
  const [x0, y0, z0, x1, y1] = new Float64Array(activity.buffer, activity.byteOffset, 5);
  const row = 8 * Math.ceil((x1 - x0) / 64);
  for (let z = Math.max(low[2], box.low[2]); z < Math.min(high[2], box.high[2]); ++z)
    for (let y = Math.max(low[1], box.low[1]); y < Math.min(high[1], box.high[1]); ++y) {
      const from = boxBytes + ((z - z0) * (y1 - y0) + y - y0) * row;
      const at = ((z - box.low[2]) * ny + y - box.low[1]) * nx - box.low[0];
      for (let x = Math.max(low[0], box.low[0]); x < Math.min(high[0], box.high[0]); ++x)
        to[at + x] = (activity[from + ((x - x0) >> 3)] >> ((x - x0) & 7)) & 1;
    }
}

/** Samples of an overview lie in the middle of blocks of `factor` samples along each axis. */
function geometryOf({ spacing, origin, directions }, factor) {
  const steps = directions ?? [0, 1, 2].map((axis) => [0, 1, 2].map((a) => (a === axis ? spacing?.[axis] || 1 : 0)));
  return {
    spacing: spacing && spacing.map((s) => s * factor),
    origin: origin && origin.map((o, a) => o + ((factor - 1) / 2) * (steps[0][a] + steps[1][a] + steps[2][a])),
    directions: directions && directions.map((direction) => direction.map((d) => d * factor)),
  };
}
