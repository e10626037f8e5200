// The display window: the values from black to white. It is chosen once for a file; after that, only the user changes
// it.
import { numberText, placeText } from "./numbers.js";
import { percentiles } from "./shades.js";

const element = (id) => document.getElementById(id);
const fields = ["window-level", "window-width"];

export class DisplayWindow {
  #state;
  #onChange;
  #isChosen = false;
  // The texts of the fields, and the numbers behind them, which may have more digits.
  #shown = {};

  /** `state` is what the views share; see viewer.js. */
  constructor(state, onChange) {
    this.#state = state;
    this.#onChange = onChange;
    for (const id of fields) {
      // A number that is no window is not left there, and a wheel that passes over a field changes nothing.
      element(id).addEventListener("blur", () => this.#state.volume && this.#show());
      element(id).addEventListener("wheel", (event) => event.preventDefault(), { passive: false });
      element(id).addEventListener("input", () => {
        const [level, width] = fields.map((other) => this.#numberIn(other));
        if (this.#state.volume && width > 0) this.set(level - width / 2, level + width / 2);
      });
    }
  }

  /**
   * For the volume that is shown now: the window of its header, or one that holds all samples until chooseOnce() has
   * looked at slices. Another volume of the same file keeps the window `before`, so that equal grays are equal values.
   */
  start(before) {
    const { volume, scale } = this.#state;
    const valueOf = (sample) => scale.slope * sample + scale.intercept;
    const ends = volume.range && [valueOf(volume.range.low), valueOf(volume.range.high)].sort((a, b) => a - b);
    // DICOM may list several windows; the first one is meant for all.
    const [center, width] = ["Center", "Width"].map((end) =>
      Number.parseFloat(volume.pair(`window_${end.toLowerCase()}`) ?? volume.pair(`dicom_Window${end}`)),
    );
    const isSeen = before && ends && ends[0] <= before.high && ends[1] >= before.low;
    this.#isChosen = true;
    if (isSeen) this.#put(before.low, before.high);
    else if (Number.isFinite(center) && width > 0) this.#put(center - width / 2, center + width / 2);
    else {
      this.#isChosen = false;
      if (ends) this.#put(...ends);
    }
  }

  /** False as long as it is only there until slices have been read. */
  get isChosen() {
    return this.#isChosen;
  }

  /** Chooses from these slices, unless there is a window already. */
  chooseOnce(slices) {
    if (!this.#isChosen) this.choose(slices);
  }

  /** All but the lowest and highest 0.5 % of some arrays of samples; if these are all alike, all of the volume. */
  choose(slices) {
    let found = percentiles(slices, 0.005);
    if (!found) return;
    const { volume, scale } = this.#state;
    if (found[0] === found[1] && volume.range) found = [volume.range.low, volume.range.high];
    const ends = found.map((sample) => scale.slope * sample + scale.intercept).sort((a, b) => a - b);
    if (ends[0] === ends[1]) ends[1] += 1;
    this.set(...ends);
  }

  set(low, high) {
    if (!Number.isFinite(low) || !Number.isFinite(high)) return;
    this.#isChosen = true;
    this.#put(low, high);
  }

  #put(low, high) {
    this.#state.shades.set(low, high);
    this.#show();
    this.#onChange();
  }

  /** Writes the window into the fields. */
  #show() {
    const { low, high } = this.#state.shades;
    const width = high - low;
    for (const [id, number] of [
      ["window-level", (low + high) / 2],
      ["window-width", width],
    ]) {
      // A field that is being edited stays, unless it has been left as it was.
      const isEdited = document.activeElement === element(id) && element(id).value !== this.#shown[id]?.text;
      const text = width > 0 ? placeText(number, width * 1e3) : numberText(number);
      if (!isEdited) element(id).value = text;
      this.#shown[id] = { text: element(id).value, number };
    }
    const { unit } = this.#state.scale;
    for (const [id, number] of [["window-low", low], ["window-high", high]])
      element(id).textContent = `${numberText(number, 6)} ${unit}`.trim();
  }

  #numberIn(id) {
    const { value, valueAsNumber } = element(id);
    return value === this.#shown[id]?.text ? this.#shown[id].number : valueAsNumber;
  }
}
