// The panel of the second file: which one, how it is shown, and the bounds of both.
import { requireEqualSizes, showDifference, showFile } from "./comparison.js";
import { fillList, lossText, scaleOf } from "./describe.js";
import { lieElsewhere } from "./materials.js";
import { numberText } from "./numbers.js";

const element = (id) => document.getElementById(id);

export class ComparisonPanel {
  #state;
  #second;
  #views;
  #open;
  #tilesOf;
  #onChange;
  #draw;
  #file; // { name, volume, tiles }; without a volume while it is opened, or with an `error`
  // The ends of the colors are chosen once, or given by the user.
  #isEndChosen = false;
  #isEndGiven = false;
  #given;

  /**
   * `state` is what the views share, `second` what `views` show; see comparison.js. `open(source)` opens a file,
   * `tilesOf(volume, like)` makes its tiles with the ranges of those of another volume, and `onChange()` is called when the
   * second views appear, change or disappear, and `draw()` when they have other colors.
   */
  constructor(state, second, views, open, tilesOf, onChange, draw) {
    this.#state = state;
    this.#second = second;
    this.#views = views;
    this.#open = open;
    this.#tilesOf = tilesOf;
    this.#onChange = onChange;
    this.#draw = draw;
    element("second-file").addEventListener("change", ({ target }) => {
      const [file] = target.files;
      target.value = "";
      if (file) this.open(() => file, file.name);
    });
    element("compare-by").addEventListener("change", () => this.apply());
    element("compare-end").addEventListener("input", ({ target }) => {
      if (target.valueAsNumber > 0 && second.isDifference) this.setEnd(target.valueAsNumber);
    });
    element("compare-close").addEventListener("click", () => this.close());
  }

  /** "" if there is no second file, or how it is shown: "beside" or "difference". */
  get kind() {
    return this.#second.volume ? element("compare-by").value : "";
  }

  /** The file whose samples are compared, if it can be. */
  get file() {
    return this.#second.volume && this.#file;
  }

  /** What an address has of it: { address, kind }; nothing if it is on this machine. */
  get link() {
    return this.#file?.address === undefined ? undefined : { address: this.#file.address, kind: element("compare-by").value };
  }

  /** The ends of the colors, if the user has changed them. */
  get end() {
    return this.#second.isDifference && this.#isEndGiven ? this.#second.shades.end : undefined;
  }

  /** Of differences, now or as soon as they are shown. */
  setEnd(end) {
    this.#isEndGiven = this.#isEndChosen = true;
    this.#given = end;
    if (!this.#second.isDifference) return;
    this.#second.shades.setEnd(end);
    if (document.activeElement !== element("compare-end")) element("compare-end").value = numberText(end, 9);
    this.#draw();
  }

  /**
   * Opens a second file, at what `source()` returns, which may have an `address`; of several, the one that was chosen last is
   * shown.
   */
  async open(source, name, kind = element("compare-by").value, address = undefined) {
    this.#closeFile();
    const file = { name, address };
    this.#file = file;
    element("compare-by").value = kind;
    this.apply();
    try {
      const volume = await this.#open(source());
      if (this.#file !== file) return volume.close();
      Object.assign(file, { volume });
    } catch (error) {
      file.error = new Error(`${name}: ${error.message}`);
    }
    if (this.#file === file) this.apply();
  }

  close() {
    this.#closeFile();
    this.apply();
  }

  #closeFile() {
    this.#isEndGiven = false;
    this.#file?.tiles?.close();
    this.#file?.volume?.close();
    this.#file = undefined;
  }

  /** The other way to show it. */
  toggle() {
    if (!this.#second.volume) return;
    element("compare-by").value = this.kind === "beside" ? "difference" : "beside";
    this.apply();
  }

  /** Shows the second file beside the volume that is shown now. */
  apply() {
    const second = this.#second;
    const file = this.#file;
    Object.assign(second, { volume: undefined, tiles: undefined, isDifference: false });
    this.#isEndChosen = false;
    this.#say("");
    try {
      if (this.#state.volume && file) this.#make(file);
    } catch (error) {
      this.#say(error.message, true);
    }
    if (second.isDifference && this.#isEndGiven) this.setEnd(this.#given);
    element("compare-use").hidden = !file;
    element("compare-difference").hidden = !second.isDifference;
    this.#onChange();
    this.update();
  }

  #make(file) {
    if (file.error) throw file.error;
    if (!file.volume) return this.#say(`Opening ${file.name} …`);
    const { volume, name } = this.#state;
    requireEqualSizes(file.volume, file.name, volume, name);
    if (file.like !== volume) {
      file.tiles?.close();
      Object.assign(file, { tiles: this.#tilesOf(file.volume, volume), like: volume });
    }
    (element("compare-by").value === "difference" ? showDifference : showFile)(this.#second, file);
    const notes = [];
    if (lieElsewhere(file.volume, volume)) notes.push(`${file.name} lies elsewhere than ${name}: samples of the same numbers are compared.`);
    const [unit, other] = [this.#state.scale.unit, scaleOf(file.volume).unit];
    if (unit !== other) notes.push(`Units differ: ${unit || "none"} and ${other || "none"}.`);
    this.#say(notes.join(" "), notes.length > 0);
  }

  #say(text, isError = false) {
    element("compare-note").textContent = text;
    element("compare-note").classList.toggle("error", isError);
  }

  /** The window of the first file has changed. */
  windowChanged() {
    const { volume, isDifference, shades } = this.#second;
    if (volume && !isDifference) shades.set(this.#state.shades.low, this.#state.shades.high);
  }

  /** After views were drawn: bounds, and what of the difference is seen. */
  update() {
    const second = this.#second;
    const file = this.file;
    if (!file) return fillList(element("compare-bounds"), []);
    const { volume, scale, name } = this.#state;
    const rows = [
      [name, lossText(volume, scale) || "exact"],
      [file.name, lossText(file.volume, scaleOf(file.volume)) || "exact"],
    ];
    if (second.isDifference) rows.push(...this.#differenceRows());
    fillList(element("compare-bounds"), rows);
  }

  #differenceRows() {
    const { limit, scale, tiles, shades } = this.#second;
    const withUnit = (number) => `${numberText(number)} ${scale.unit}`.trim();
    const rows = [["sum of the bounds", limit === undefined ? "none: nothing is marked" : withUnit(limit)]];
    const shown = this.#views.filter((view) => view.isShown && view.level === 0 && view.isSettled);
    const regions = shown.map((view) => view.region(0, 0)).filter(Boolean);
    const sums = regions.map((region) => tiles.summaryOf(region));
    const total = (key) => sums.reduce((sum, one) => sum + one[key], 0);
    const largest = Math.max(0, ...sums.map((one) => one.largest));
    this.#chooseEnd(largest, regions.length > 0);
    element("compare-low").textContent = withUnit(-shades.end);
    element("compare-high").textContent = withUnit(shades.end);
    element("compare-beyond").hidden = limit === undefined;
    if (this.#views.some((view) => view.isShown && view.level > 0))
      return [...rows, ["", "Overviews show differences of means: zoom in for samples and marks."]];
    if (regions.length === 0) return rows;
    rows.push(["largest in the bricks shown", withUnit(largest)]);
    if (limit !== undefined) rows.push(["beyond the sum there", `${total("beyond")} of ${total("samples")} samples`]);
    return rows;
  }

  /** The ends of the colors, once: the sum of the bounds, or the largest difference if that is 0 or unknown. */
  #chooseEnd(largest, isKnown) {
    const { limit, shades } = this.#second;
    if (this.#isEndChosen || (!(limit > 0) && !isKnown)) return;
    this.#isEndChosen = true;
    shades.setEnd(limit > 0 ? limit : largest || 1);
    element("compare-end").value = numberText(shades.end, 6);
    this.#draw();
  }
}
