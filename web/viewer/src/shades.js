// From samples to grey pixels.

/** What a window makes of samples. Values are `slope * sample + intercept`. */
export class Shades {
  #table;
  #slope;
  #intercept;

  constructor({ slope, intercept }) {
    this.#slope = slope;
    this.#intercept = intercept;
    this.version = 0;
    this.set(0, 1);
  }

  /** `low` is black and `high` is white, in values. */
  set(low, high) {
    this.low = low;
    this.high = Math.max(high, low + 1e-30 + Math.abs(low) * 1e-12);
    this.#table = undefined;
    ++this.version;
  }

  /** Writes a pixel (RGBA in one number) for each sample. */
  paint(samples, pixels) {
    if (samples.BYTES_PER_ELEMENT <= 2) {
      const table = (this.#table ??= this.#tableOf(samples));
      const mask = table.length - 1;
      for (let i = 0; i < samples.length; ++i) pixels[i] = table[samples[i] & mask];
      return;
    }
    const factor = (this.#slope * 255) / (this.high - this.low);
    const start = ((this.#intercept - this.low) * 255) / (this.high - this.low);
    for (let i = 0; i < samples.length; ++i) pixels[i] = greyPixel(samples[i] * factor + start);
  }

  #tableOf(samples) {
    const table = new Uint32Array(1 << (8 * samples.BYTES_PER_ELEMENT));
    const sample = new samples.constructor(1);
    for (let i = 0; i < table.length; ++i) {
      sample[0] = i;
      table[i] = greyPixel(((this.#slope * sample[0] + this.#intercept - this.low) * 255) / (this.high - this.low));
    }
    return table;
  }
}

// NaN must not be mistaken for air: violet, red 110, green 0, blue 140.
const noValue = 0xff8c006e;

function greyPixel(grey) {
  if (Number.isNaN(grey)) return noValue;
  const level = grey >= 255 ? 255 : grey > 0 ? Math.round(grey) : 0;
  return (0xff000000 | (level * 0x010101)) >>> 0;
}

/** The samples that leave out `share` of the finite ones at each end: [low, high]; nothing if none is finite. */
export function percentiles(arrays, share) {
  const picked = [];
  const total = arrays.reduce((sum, { length }) => sum + length, 0);
  const step = Math.max(1, Math.floor(total / 100000));
  for (const samples of arrays)
    for (let i = 0; i < samples.length; i += step) if (Number.isFinite(samples[i])) picked.push(samples[i]);
  if (picked.length === 0) return undefined;
  picked.sort((a, b) => a - b);
  const at = Math.floor(share * (picked.length - 1));
  return [picked[at], picked[picked.length - 1 - at]];
}
