// Slabs: several slices that views show as one, by the mean, the highest or the lowest sample.
import { measuredText } from "./numbers.js";

export const kindsOfSlabs = ["none", "mean", "maximum", "minimum"];
/** Slices of a slab, at most. */
export const mostSlices = 512;

/** Slices of a level, from `begin` up to, but not including, `end`. Its text is a key. */
export class Slab {
  constructor(begin, end, kind) {
    Object.assign(this, { begin, end, kind });
  }

  toString() {
    return `${this.begin}-${this.end}-${this.kind}`;
  }
}

/** True if the thickness may be a length: the file has a spacing. */
export const hasLengths = ({ unit }) => unit !== "samples";

/** The slab around the position, along an axis, in slices of the volume; undefined if a single slice is shown. */
export function slabAt({ slab, position, volume, places, scale }, normal) {
  const { kind, thickness, isInSlices } = slab;
  // Samples of slices with different slopes have no mean, and none is the highest.
  if (kind === "none" || scale.note) return undefined;
  const exact = isInSlices || !hasLengths(places) ? thickness : thickness / places.steps[normal];
  const count = Math.min(Math.max(Math.round(exact), 1), mostSlices);
  const begin = position[normal] - Math.floor((count - 1) / 2);
  const [first, end] = [Math.max(begin, 0), Math.min(begin + count, volume.dims[normal])];
  return end - first > 1 ? new Slab(first, end, kind) : undefined;
}

/** What a slab is, in words. */
export function slabText({ begin, end, kind }, normal, { steps, unit, isUneven }) {
  const count = end - begin;
  const length =
    unit === "samples" || (isUneven && normal === 2) ? "" : `, ${measuredText(count * steps[normal], steps[normal])} ${unit}`;
  return `${kind} of ${count} slices (${begin + 1} to ${end}${length})`;
}

/** Makes one slice of boxes of samples that are added one after the other. Samples that are no number (NaN) do not count. */
export class Projection {
  #kind;
  #normal;
  #sums;
  #counts;
  #Samples;

  constructor(kind, normal) {
    this.#kind = kind;
    this.#normal = normal;
  }

  /** The samples of a box, x fastest; boxes differ along the normal axis only. */
  add(samples, { low, high }) {
    const size = high.map((end, axis) => end - low[axis]);
    const plane = samples.length / size[this.#normal];
    this.#Samples ??= samples.constructor;
    const start = { mean: 0, maximum: -Infinity, minimum: Infinity }[this.#kind];
    this.#sums ??= new Float64Array(plane).fill(start);
    this.#counts ??= new Uint32Array(plane);
    const [sums, counts] = [this.#sums, this.#counts];
    // How far apart the samples of neighbors in the plane are, for z, y and x.
    const strides = [1, size[0], size[0] * size[1]];
    const [u, v] = [0, 1, 2].filter((axis) => axis !== this.#normal);
    for (let k = 0; k < size[this.#normal]; ++k)
      for (let j = 0, i = 0; j < size[v]; ++j)
        for (let n = 0, from = k * strides[this.#normal] + j * strides[v]; n < size[u]; ++n, ++i, from += strides[u]) {
          const sample = samples[from];
          if (Number.isNaN(sample)) continue;
          ++counts[i];
          if (this.#kind === "mean") sums[i] += sample;
          else if (this.#kind === "maximum" ? sample > sums[i] : sample < sums[i]) sums[i] = sample;
        }
  }

  /** An array of the type of the samples; of means, of doubles. */
  get samples() {
    const [sums, counts] = [this.#sums, this.#counts];
    const found = this.#kind === "mean" ? sums : new this.#Samples(sums);
    for (let i = 0; i < counts.length; ++i) {
      if (counts[i] === 0) found[i] = NaN;
      else if (this.#kind === "mean") found[i] = sums[i] / counts[i];
    }
    return found;
  }
}
