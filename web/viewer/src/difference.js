// The difference of two volumes of the same size, as if it were a volume: its tiles and its colors.

const valueOf = ({ slope, intercept }, sample) => slope * sample + intercept;

/** The bound of the errors of values; null if there is none. */
export const boundOf = ({ bounds }, { slope }) => (bounds.maxError === null ? null : bounds.maxError * Math.abs(slope));

/**
 * The tiles of `second` minus those of `first`, in values: both are { volume, tiles, scale }, and tiles of both have the same
 * ranges. It has what views need of Tiles.
 */
export class DifferenceTiles {
  #first;
  #second;
  #limit;
  #made = new Map(); // by what is the key of a tile: { a, b, samples, beyond, largest }
  #bytes = 0;
  keptBytes = 128 << 20;
  /** Those that both volumes have, with the number of each in either. */
  levels;

  /** Samples beyond `limit` are counted, unless it is undefined. */
  constructor(first, second, limit) {
    this.#first = first;
    this.#second = second;
    this.#limit = limit;
    const other = ({ factor }) => second.volume.levels.find((level) => level.factor === factor);
    this.levels = first.volume.levels
      .filter((level) => other(level))
      .map((level, number) => ({ ...level, level: number, ofFirst: level.level, ofSecond: other(level).level }));
  }

  /** A region of the difference, as regions of both volumes. */
  regionsOf(region) {
    const { ofFirst, ofSecond } = this.levels[region.level];
    return [
      { ...region, level: ofFirst },
      { ...region, level: ofSecond },
    ];
  }

  #both(region) {
    const regions = this.regionsOf(region);
    return [this.#first, this.#second].map(({ tiles }, i) => [tiles, regions[i]]);
  }

  get(level, normal, slice, column, row) {
    return this.#make(level, normal, slice, column, row)?.samples;
  }

  #make(level, normal, slice, column, row) {
    const { ofFirst, ofSecond } = this.levels[level];
    const a = this.#first.tiles.get(ofFirst, normal, slice, column, row);
    const b = this.#second.tiles.get(ofSecond, normal, slice, column, row);
    if (!a || !b) return undefined;
    const key = `${level} ${normal} ${slice} ${column} ${row}`;
    const before = this.#made.get(key);
    this.#made.delete(key);
    if (before?.a === a && before.b === b) {
      this.#made.set(key, before);
      return before;
    }
    this.#bytes -= before?.samples.byteLength ?? 0;
    const samples = new Float64Array(a.length);
    let [beyond, largest] = [0, 0];
    for (let i = 0; i < a.length; ++i) {
      samples[i] = differenceOf(valueOf(this.#first.scale, a[i]), valueOf(this.#second.scale, b[i]));
      const size = Math.abs(samples[i]);
      if (size > largest && size < Infinity) largest = size;
      if (isBeyond(samples[i], this.#limit)) ++beyond;
    }
    const made = { a, b, samples, beyond, largest };
    this.#made.set(key, made);
    this.#bytes += samples.byteLength;
    for (const [oldest, { samples: old }] of this.#made) {
      if (this.#bytes <= this.keptBytes) break;
      this.#made.delete(oldest);
      this.#bytes -= old.byteLength;
    }
    return made;
  }

  /** How many samples of the tiles of a region are beyond the limit, of how many, and the largest difference. */
  summaryOf({ level, normal, slice, columns, rows }) {
    const sum = { beyond: 0, samples: 0, largest: 0 };
    for (let row = rows[0]; row < rows[1]; ++row)
      for (let column = columns[0]; column < columns[1]; ++column) {
        const made = this.#make(level, normal, slice, column, row);
        if (!made) continue;
        sum.beyond += made.beyond;
        sum.samples += made.samples.length;
        sum.largest = Math.max(sum.largest, made.largest);
      }
    return sum;
  }

  has = (region) => this.#both(region).every(([tiles, own]) => tiles.has(own));
  // What one of them cannot read is never there.
  isSettled = (region) => this.#both(region).every(([tiles, own]) => tiles.isSettled(own));
  failedBoxes = (region) => this.#both(region).flatMap(([tiles, own]) => tiles.failedBoxes(own));
  number = (sample) => this.#first.tiles.number(sample);
  range = (level, axis, number) => this.#first.tiles.range(this.levels[level].ofFirst, axis, number);
  samplesOf = (region) => this.#first.tiles.samplesOf(this.regionsOf(region)[0]);
}

/** NaN if both are no number, and infinite if one of them is none. */
function differenceOf(from, to) {
  if (to === from) return 0;
  if (Number.isNaN(from) !== Number.isNaN(to)) return Infinity;
  return to - from;
}

const isBeyond = (difference, limit) => limit !== undefined && Math.abs(difference) > limit;

/** The difference that the bounds allow, with the rounding of the values of both; undefined if one has no bound. */
export function allowedOf(volumes, scales) {
  const limits = volumes.map((volume, i) => boundOf(volume, scales[i]));
  if (limits.includes(null)) return undefined;
  const largest = volumes.map(({ range }, i) => {
    const samples = range ? Math.max(Math.abs(range.low), Math.abs(range.high)) : 0;
    return samples * Math.abs(scales[i].slope) + Math.abs(scales[i].intercept) + limits[i];
  });
  return limits[0] + limits[1] + 1e-14 * (largest[0] + largest[1]);
}

// Blue below, dark in the middle, orange above: people with color blindness tell them apart. Yellow is beyond the bounds.
const middle = [32, 32, 32];
const lowest = [72, 160, 255];
const highest = [255, 124, 60];
const beyondBounds = [255, 255, 0];
const noValue = [110, 0, 140];
const pixelOf = ([red, green, blue]) => (0xff000000 | (blue << 16) | (green << 8) | red) >>> 0;
const half = 255;

/** From -1 to 1. */
function colorAt(share) {
  const end = share < 0 ? lowest : highest;
  const part = Math.min(Math.abs(share), 1);
  return middle.map((m, i) => Math.round(m + part * (end[i] - m)));
}

const colors = Uint32Array.from({ length: 2 * half + 1 }, (_, i) => pixelOf(colorAt((i - half) / half)));

/** Paints differences, as Shades paints samples. */
export class DifferenceShades {
  version = 0;
  /** The difference that has the color of the end. */
  end = 1;
  #limit;

  /** Differences beyond the limit are marked in the volume itself: in overviews, there are means. */
  constructor(limit) {
    this.#limit = limit;
  }

  setEnd(end) {
    this.end = end;
    ++this.version;
  }

  /** What paints samples of a level. */
  ofLevel = (level) => this.#painters[level === 0 ? 0 : 1];
  #painters = [true, false].map((isMarked) => {
    const shades = this;
    return {
      get version() {
        return shades.version;
      },
      paint: (samples, pixels) => shades.#paint(samples, pixels, isMarked),
    };
  });

  #paint(samples, pixels, isMarked) {
    const [marked, missing] = [beyondBounds, noValue].map(pixelOf);
    for (let i = 0; i < samples.length; ++i) {
      const difference = samples[i];
      if (isMarked && isBeyond(difference, this.#limit)) pixels[i] = marked;
      else if (Number.isNaN(difference)) pixels[i] = missing;
      else pixels[i] = colors[Math.round(Math.max(-1, Math.min(1, difference / this.end)) * half) + half];
    }
  }
}
