// Reads the parts of slices that views want: overviews first, and only what is seen.
//
// A tile is the part of a slice that lies in one brick. It is named by its level, the axis that is normal to the
// slice, the number of the slice, and its column and row. In place of the number, there may be a Slab of several slices.
import { Projection, Slab } from "./slab.js";

const readsAtOnce = 4;
// Rows of tiles of an overview become one read if they have fewer samples along an axis: fewer requests.
const smallSlice = 256;

export const planes = [
  { normal: 0, across: 1, down: 2 },
  { normal: 1, across: 0, down: 2 },
  { normal: 2, across: 0, down: 1 },
];

/** The first sample of a brick along an axis with `count` samples, and its end: bricks begin one later without a lead. */
export function rangeOfBrick({ brickEdge, lead }, number, count) {
  const shift = lead ? 0 : 1;
  const begin = number === 0 ? 0 : number * brickEdge + shift;
  return [begin, Math.min((number + 1) * brickEdge + shift, count)];
}

/** The brick in which a sample lies, along an axis. */
export const numberOfBrick = ({ brickEdge, lead }, sample) => Math.max(Math.floor((sample - (lead ? 0 : 1)) / brickEdge), 0);

const slicesOf = (slice) => (slice instanceof Slab ? [slice.begin, slice.end] : [slice, slice + 1]);

export class Tiles {
  #tiles = new Map();
  #bytes = 0;
  #flying = new Set();
  #failed = new Set();
  // If a row of tiles cannot be read at once, each tile is read alone, so that a damaged brick affects no other one.
  #alone = new Set();
  #wanted = new Set();
  #volume;
  #onTiles;
  #onError;
  #like;
  keptBytes = 128 << 20;

  /** `onTiles()` is called when tiles have arrived. Tiles have the ranges of the bricks of the volume `like`. */
  constructor(volume, onTiles, onError, like = volume) {
    this.#volume = volume;
    this.#like = like;
    this.#onTiles = onTiles;
    this.#onError = onError;
  }

  close() {
    for (const strip of this.#flying) strip.controller.abort();
    this.#volume = undefined;
    this.#tiles.clear();
  }

  /** What could not be read is wanted again. */
  retry() {
    this.#failed.clear();
    this.#alone.clear();
  }

  get reads() {
    return this.#flying.size;
  }

  /** The first sample of a tile along an axis, and its end. */
  range(level, axis, number) {
    return rangeOfBrick(this.#like, number, this.#volume.levels[level].dims[axis]);
  }

  /** The tile in which a sample lies. */
  number(sample) {
    return numberOfBrick(this.#like, sample);
  }

  /** Its samples, if they are there. */
  get(level, normal, slice, column, row) {
    const key = keyOf(level, normal, slice, column, row);
    const tile = this.#tiles.get(key);
    if (!tile) return undefined;
    this.#tiles.delete(key);
    this.#tiles.set(key, tile);
    return tile;
  }

  /** All samples of a level and a slice that are there. */
  ofSlice(level, normal, slice) {
    const begin = `${level} ${normal} ${slice} `;
    return [...this.#tiles].filter(([key]) => key.startsWith(begin)).map(([, samples]) => samples);
  }

  /**
   * Reads what is wanted and not there: a list of { level, normal, slice, columns: [first, end], rows: [first, end],
   * rank }; lower ranks come first. Reads of what is no longer wanted end.
   */
  want(regions) {
    if (!this.#volume) return;
    const wanted = new Set();
    for (const region of regions) for (const key of keysOf(region)) wanted.add(key);
    this.#wanted = wanted;
    const coming = new Set();
    for (const strip of this.#flying) {
      if (strip.keys.some((key) => wanted.has(key))) for (const key of strip.keys) coming.add(key);
      else strip.controller.abort();
    }
    const missing = (key) => !this.#tiles.has(key) && !coming.has(key) && !this.#failed.has(key);
    const strips = regions.flatMap((region) => this.#strips(region, missing)).sort((a, b) => a.rank - b.rank);
    for (const strip of strips) {
      if (this.#flying.size >= readsAtOnce) break;
      this.#read(strip);
    }
  }

  /** True if nothing of a region is missing. */
  has(region) {
    return keysOf(region).every((key) => this.#tiles.has(key));
  }

  /** True if reading more would change nothing. */
  isSettled(region) {
    return keysOf(region).every((key) => this.#tiles.has(key) || this.#failed.has(key));
  }

  /** The tiles of a region that could not be read: [begin, end], in samples of the level, along columns and rows. */
  failedBoxes({ level, normal, slice, columns, rows }) {
    if (this.#failed.size === 0) return [];
    const { across, down } = planes[normal];
    const boxes = [];
    for (let row = rows[0]; row < rows[1]; ++row)
      for (let column = columns[0]; column < columns[1]; ++column) {
        if (!this.#failed.has(keyOf(level, normal, slice, column, row))) continue;
        const [x, y] = [this.range(level, across, column), this.range(level, down, row)];
        boxes.push([
          [x[0], y[0]],
          [x[1], y[1]],
        ]);
      }
    return boxes;
  }

  #strips(region, missing) {
    const { level, columns, rows } = region;
    const height = level > 0 ? Math.max(1, Math.floor(smallSlice / this.#like.brickEdge)) : 1;
    const middle = (rows[0] + rows[1] - height) / 2;
    const strips = [];
    for (let row = rows[0]; row < rows[1]; row += height) {
      const some = { ...region, rows: [row, Math.min(row + height, rows[1])] };
      const absent = [];
      for (let column = columns[0]; column < columns[1]; ++column)
        if (keysOf({ ...some, columns: [column, column + 1] }).some(missing)) absent.push(column);
      if (absent.length === 0) continue;
      // From the middle outward.
      const strip = {
        ...some,
        columns: [absent[0], absent.at(-1) + 1],
        rank: region.rank + Math.abs(row - middle) / 1000,
      };
      if (keysOf(strip).some((key) => this.#alone.has(key))) strips.push(...tilesOf(strip, missing));
      else strips.push(strip);
    }
    return strips;
  }

  /** The samples of a region. */
  boxOf({ level, normal, slice, columns, rows }) {
    const { across, down } = planes[normal];
    const low = [0, 0, 0];
    const high = [0, 0, 0];
    [low[normal], high[normal]] = slicesOf(slice);
    for (const [axis, [begin, end]] of [
      [across, columns],
      [down, rows],
    ])
      [low[axis], high[axis]] = [this.range(level, axis, begin)[0], this.range(level, axis, end - 1)[1]];
    return { low, high };
  }

  /** Samples of the bricks of a region, all of which are decoded for it. */
  samplesOf({ level, normal, slice, columns, rows }) {
    const { across, down } = planes[normal];
    const [first, end] = slicesOf(slice);
    return [
      [normal, [this.number(first), this.number(end - 1) + 1]],
      [across, columns],
      [down, rows],
    ].reduce((product, [axis, [begin, end]]) => {
      return product * (this.range(level, axis, end - 1)[1] - this.range(level, axis, begin)[0]);
    }, 1);
  }

  async #read(strip) {
    const { level, normal, slice, columns, rows } = strip;
    const { across, down } = planes[normal];
    const { low, high } = this.boxOf(strip);
    strip.keys = keysOf(strip);
    strip.controller = new AbortController();
    this.#flying.add(strip);
    try {
      const samples = await this.#samplesIn(level, { low, high }, normal, slice, strip.controller.signal);
      const width = high[across] - low[across];
      for (let row = rows[0]; row < rows[1]; ++row)
        for (let column = columns[0]; column < columns[1]; ++column) {
          const [x0, x1] = this.range(level, across, column);
          const [y0, y1] = this.range(level, down, row);
          const key = keyOf(level, normal, slice, column, row);
          if (strip.keys.length === 1) {
            this.#keep(key, samples);
            continue;
          }
          const tile = new samples.constructor((x1 - x0) * (y1 - y0));
          for (let y = y0; y < y1; ++y) {
            const from = (y - low[down]) * width + x0 - low[across];
            tile.set(samples.subarray(from, from + x1 - x0), (y - y0) * (x1 - x0));
          }
          this.#keep(key, tile);
        }
    } catch (error) {
      if (!strip.controller.signal.aborted) {
        const isServers = error.code === "io-error";
        for (const key of strip.keys) (strip.keys.length > 1 && !isServers ? this.#alone : this.#failed).add(key);
        if (strip.keys.length === 1 || isServers) this.#onError(error);
      }
    } finally {
      this.#flying.delete(strip);
      if (this.#volume) this.#onTiles();
    }
  }

  async #samplesIn(level, box, normal, slice, signal) {
    if (!(slice instanceof Slab)) return this.#volume.read({ level, box, signal });
    // Brick by brick: a thick slab does not fit into memory.
    const projection = new Projection(slice.kind, normal);
    for (let begin = slice.begin; begin < slice.end; ) {
      const end = Math.min(this.range(level, normal, this.number(begin))[1], slice.end);
      const part = { low: [...box.low], high: [...box.high] };
      [part.low[normal], part.high[normal]] = [begin, end];
      projection.add(await this.#volume.read({ level, box: part, signal }), part);
      begin = end;
    }
    return projection.samples;
  }

  #keep(key, tile) {
    const before = this.#tiles.get(key);
    if (before) this.#bytes -= before.byteLength;
    this.#tiles.delete(key);
    this.#tiles.set(key, tile);
    this.#bytes += tile.byteLength;
    for (const [oldest, { byteLength }] of this.#tiles) {
      if (this.#bytes <= this.keptBytes) break;
      // Else it would be read again at once.
      if (this.#wanted.has(oldest)) continue;
      this.#tiles.delete(oldest);
      this.#bytes -= byteLength;
    }
  }
}

function keyOf(level, normal, slice, column, row) {
  return `${level} ${normal} ${slice} ${column} ${row}`;
}

function keysOf({ level, normal, slice, columns, rows }) {
  const keys = [];
  for (let row = rows[0]; row < rows[1]; ++row)
    for (let column = columns[0]; column < columns[1]; ++column) keys.push(keyOf(level, normal, slice, column, row));
  return keys;
}

/** The tiles of a strip that are missing, each as a strip. */
function tilesOf(strip, missing) {
  const strips = [];
  for (let row = strip.rows[0]; row < strip.rows[1]; ++row)
    for (let column = strip.columns[0]; column < strip.columns[1]; ++column) {
      const tile = { ...strip, columns: [column, column + 1], rows: [row, row + 1] };
      if (keysOf(tile).some(missing)) strips.push(tile);
    }
  return strips;
}
