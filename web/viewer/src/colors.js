// From samples to colored pixels: which material each belongs to. As Shades, both classes have `paint()`, and a
// `version` that changes with what it paints.
//
// A material has a `name`, a `color`, and `isVisible`; and the values from `low` up to `high`, or its `label`.
import { largestLabel, nameWithout, palette } from "./materials.js";

/** The color of the material with a number, as CSS writes it, and as a pixel: RGBA in one number. */
function colorOf(number) {
  const color = palette[number % palette.length];
  const [red, green, blue] = [1, 3, 5].map((i) => Number.parseInt(color.slice(i, i + 2), 16));
  return { color, pixel: (0xff000000 | (blue << 16) | (green << 8) | red) >>> 0 };
}
const transparent = 0;

/** Materials by values. */
export class ValueColors {
  version = 0;
  areOfValues = true;
  /** As the text has them. */
  materials;
  #scale;
  #rounds;
  #table;

  constructor(ranges, scale, type) {
    this.materials = ranges.map((range, i) => ({ ...range, ...colorOf(i), isVisible: true }));
    this.#scale = scale;
    // Values as the program decodes them: float32, unless they are whole numbers.
    this.#rounds = type !== "float64" && !(Number.isInteger(scale.slope) && Number.isInteger(scale.intercept));
  }

  setVisible(material, isVisible) {
    material.isVisible = isVisible;
    this.#table = undefined;
    ++this.version;
  }

  /** Undefined if it belongs to none. */
  materialOf(sample) {
    const { slope, intercept } = this.#scale;
    const exact = slope * sample + intercept;
    const value = this.#rounds ? Math.fround(exact) : exact;
    return this.materials.find(({ low, high }) => value >= low && (value < high || high === Infinity));
  }

  #pixelOf(sample) {
    const material = this.materialOf(sample);
    return material?.isVisible ? material.pixel : transparent;
  }

  paint(samples, pixels) {
    if (samples.BYTES_PER_ELEMENT <= 2) {
      const table = (this.#table ??= this.#tableOf(samples));
      const mask = table.length - 1;
      for (let i = 0; i < samples.length; ++i) pixels[i] = table[samples[i] & mask];
      return;
    }
    for (let i = 0; i < samples.length; ++i) pixels[i] = this.#pixelOf(samples[i]);
  }

  #tableOf(samples) {
    const sample = new samples.constructor(1);
    return Uint32Array.from({ length: 1 << (8 * samples.BYTES_PER_ELEMENT) }, (_, i) => {
      sample[0] = i;
      return this.#pixelOf(sample[0]);
    });
  }
}

/** Labels: samples of a volume that was checked by requireLabels(). */
export class LabelColors {
  version = 0;
  areOfValues = false;
  /** Those that have a name; without names, those that were painted, from low labels to high ones. */
  materials = [];
  /** Is called with each material that `materials` gets later. */
  onNew = () => {};
  #byLabel = new Map();
  #hasNames;
  #isKnown = new Uint8Array(largestLabel + 1);
  #pixels = new Uint32Array(largestLabel + 1);

  /** `names`: a Map, see namesOf(). */
  constructor(names) {
    this.#hasNames = names.size > 0;
    for (const label of [...names.keys()].sort((a, b) => a - b)) this.#add(label, names.get(label));
  }

  #add(label, name) {
    const material = { name, label, ...colorOf(label + palette.length - 1), isVisible: true };
    // From the end, as it is mostly the last one.
    const before = this.materials.findLastIndex((other) => other.label < label);
    this.materials.splice(before + 1, 0, material);
    this.#byLabel.set(label, material);
    this.#isKnown[label] = 1;
    this.#pixels[label] = material.pixel;
    return material;
  }

  #meet(label) {
    if (!(label >= 0 && label <= largestLabel)) return;
    this.#isKnown[label] = 1;
    // Without names, all labels but 0 are materials.
    if (this.#hasNames || label === 0) return;
    this.onNew(this.#add(label, nameWithout(label)));
  }

  setVisible(material, isVisible) {
    material.isVisible = isVisible;
    this.#pixels[material.label] = isVisible ? material.pixel : transparent;
    ++this.version;
  }

  /** Undefined if it belongs to none. */
  materialOf(label) {
    return this.#byLabel.get(label);
  }

  paint(samples, pixels) {
    for (let i = 0; i < samples.length; ++i) {
      const label = samples[i];
      if (this.#isKnown[label] !== 1) this.#meet(label);
      pixels[i] = this.#pixels[label];
    }
  }
}
