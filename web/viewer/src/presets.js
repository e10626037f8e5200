// Windows that are chosen by name: those of radiology, if values are HU, and shares of the samples.
import { percentiles } from "./shades.js";

const element = (id) => document.getElementById(id);

// Level and width, in HU, as textbooks of radiology have them.
const ofHounsfield = [
  ["brain", 40, 80],
  ["lung", -600, 1500],
  ["bone", 400, 1800],
  ["soft tissue", 40, 400],
];
// The share that is left out at each end.
const ofShares = [
  ["1–99 %", 0.01],
  ["0.1–99.9 %", 0.001],
];

/** True if a file says that its values are HU: by their unit, or as a CT of DICOM with an intercept. */
export function areHounsfield(volume, { unit, note }) {
  if (note) return false;
  if (/^(hu|hounsfield( units?)?)$/i.test(unit.trim())) return true;
  const modality = (volume.pair("dicom_Modality") ?? "").trim();
  return unit.trim() === "" && modality === "CT" && Number(volume.pair("rescale_intercept") ?? 0) < 0;
}

/** The names of the presets of a volume. */
export function presetsOf(volume, scale) {
  const names = areHounsfield(volume, scale) ? ofHounsfield.map(([name]) => name) : [];
  if (volume.range) names.push("full range");
  return [...names, ...ofShares.map(([name]) => name)];
}

/** The window of a preset: [low, high], in values; `slices` are the samples that shares are of. Undefined without any. */
export function windowOf(name, volume, scale, slices) {
  const [, level, width] = ofHounsfield.find(([other]) => other === name) ?? [];
  if (width) return [level - width / 2, level + width / 2];
  const [, share] = ofShares.find(([other]) => other === name) ?? [];
  const ends = share ? percentiles(slices, share) : volume.range && [volume.range.low, volume.range.high];
  if (!ends) return undefined;
  const [low, high] = ends.map((sample) => scale.slope * sample + scale.intercept).sort((a, b) => a - b);
  return [low, low === high ? high + 1 : high];
}

/** The menu of presets. */
export class Presets {
  #state;
  #slices;
  #setWindow;
  #names = [];
  #chosen; // { name, low, high }

  /** `state` is what the views share; see viewer.js. `slices()` returns samples; `setWindow(low, high)` shows them so. */
  constructor(state, slices, setWindow) {
    this.#state = state;
    this.#slices = slices;
    this.#setWindow = setWindow;
    element("preset").addEventListener("change", ({ target }) => this.choose(target.value));
  }

  /** There is another volume. */
  reset() {
    const { volume, scale } = this.#state;
    this.#names = presetsOf(volume, scale);
    this.#chosen = undefined;
    const textOf = (name) => (ofHounsfield.some(([other]) => other === name) ? `${name} (HU)` : name);
    element("preset").replaceChildren(
      Object.assign(new Option("Presets", ""), { hidden: true }),
      ...this.#names.map((name) => new Option(textOf(name), name)),
    );
  }

  choose(name) {
    const { volume, scale, shades } = this.#state;
    const found = volume && windowOf(name, volume, scale, this.#slices());
    if (!found) return;
    this.#setWindow(...found);
    this.#chosen = { name, low: shades.low, high: shades.high };
    element("preset").value = name;
  }

  /** The preset after the one that is shown, or before it (-1). */
  step(count) {
    const at = this.#names.indexOf(this.#chosen?.name);
    const next = at < 0 && count < 0 ? -1 : at + count;
    this.choose(this.#names.at(next % this.#names.length));
  }

  /** The window may be another one now. */
  update() {
    const { low, high } = this.#state.shades;
    if (this.#chosen && this.#chosen.low === low && this.#chosen.high === high) return;
    this.#chosen = undefined;
    element("preset").value = "";
  }
}
