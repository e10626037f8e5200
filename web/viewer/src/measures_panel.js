// The list of measures: what each says, and buttons that show and remove it.
import { boundSentence, fillList } from "./describe.js";
import { drawHistogram, histogramText } from "./histogram.js";
import { isFinished, meanText, noteOf, resultText } from "./measures.js";
import { measuredText, numberText, sampleText } from "./numbers.js";
import { areaOf, isRegion } from "./regions.js";

const element = (id) => document.getElementById(id);
const arrows = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, -1], ArrowDown: [1, 1] };

export class MeasuresPanel {
  #state;
  #on;
  #rows = new Map(); // by their measures

  /** `state` is what the views share; see viewer.js. `on` has `show(measure)`, `step(measure, i, count)` and `remove(measure)`. */
  constructor(state, on) {
    this.#state = state;
    this.#on = on;
  }

  /** Lists the measures as they are now. Rows that are there stay: one of them may have the focus. */
  update() {
    const { measures, chosenMeasure } = this.#state;
    element("measures-use").hidden = measures.length === 0;
    for (const [measure, row] of this.#rows)
      if (!measures.includes(measure)) {
        if (row.element.contains(document.activeElement)) element("measures").focus();
        row.element.remove();
        this.#rows.delete(measure);
      }
    for (const measure of measures) {
      if (!this.#rows.has(measure)) this.#rows.set(measure, this.#row(measure));
      const row = this.#rows.get(measure);
      const { button, note } = row;
      button.textContent = this.titleOf(measure);
      button.setAttribute("aria-pressed", String(measure === chosenMeasure));
      note.textContent = noteOf(measure, this.#state);
      note.hidden = note.textContent === "";
      if (isRegion(measure)) this.#describe(measure, row);
    }
  }

  /** What a region has, in rows and a histogram. */
  #describe({ statistics, ...region }, row) {
    if (row.statistics === statistics) return;
    row.statistics = statistics;
    row.more.hidden = !statistics;
    if (!statistics) return;
    const { volume, places, scale } = this.#state;
    const { count, missing, mean, deviation, low, high, bins } = statistics;
    const withUnit = (text) => `${text} ${scale.unit}`.trim();
    const { area, unit } = areaOf(region, count + missing, volume, places);
    const areaStep = area / (count + missing);
    const rows = [
      ["samples", String(count + missing)],
      ["area", unit === "voxels" ? `${area} voxels` : `${measuredText(area, areaStep)} ${unit}`],
    ];
    if (missing > 0) rows.push(["of these, no number", String(missing)]);
    if (count > 0)
      rows.push(
        ["mean", withUnit(meanText(mean, statistics, this.#state))],
        ["standard deviation", withUnit(meanText(deviation, statistics, this.#state))],
        ["lowest", withUnit(this.#valueText(low))],
        ["highest", withUnit(this.#valueText(high))],
      );
    fillList(row.list, rows);
    row.histogram.hidden = row.ends.hidden = count === 0;
    row.bound.textContent = boundSentence(volume, scale) + (scale.note && !scale.ofSlice ? ` All are ${scale.note}.` : "");
    if (count === 0) return;
    drawHistogram(row.histogram, bins);
    row.histogram.setAttribute("aria-label", histogramText(bins, (n) => numberText(n, 6)));
    fillList(row.ends, [[this.#valueText(low), this.#valueText(high)]]);
  }

  /** A value that samples have, with all its digits. */
  #valueText(value) {
    const { volume, scale } = this.#state;
    const isSample = !scale.note && scale.slope === 1 && scale.intercept === 0;
    return isSample ? sampleText(value, volume.type) : numberText(value);
  }

  /** What a measure is and says. */
  titleOf(measure) {
    const { number, kind, normal, slice, plane } = measure;
    const place = plane ? "oblique" : `${"xyz"[normal]} = ${slice}`;
    return `${number}: ${kind} ${resultText(measure, this.#state) || "…"} (${place})`;
  }

  #row(measure) {
    const row = element("measures").appendChild(document.createElement("li"));
    const line = row.appendChild(document.createElement("span"));
    const button = line.appendChild(document.createElement("button"));
    Object.assign(button, { type: "button", title: "Show its slice; arrows move it, Delete removes it" });
    const remove = line.appendChild(document.createElement("button"));
    Object.assign(remove, { type: "button", textContent: "×" });
    remove.setAttribute("aria-label", `Remove ${measure.kind} ${measure.number}`);
    const note = row.appendChild(document.createElement("p"));
    note.className = "small";
    button.addEventListener("click", () => this.#on.show(measure));
    remove.addEventListener("click", () => this.#on.remove(measure));
    button.addEventListener("keydown", (event) => {
      const arrow = arrows[event.key];
      if (event.ctrlKey || event.metaKey || event.altKey || (!arrow && event.key !== "Delete")) return;
      event.preventDefault();
      event.stopPropagation();
      if (!arrow) return this.#on.remove(measure);
      if (isFinished(measure)) this.#on.step(measure, arrow[0], arrow[1] * (event.shiftKey ? 10 : 1));
    });
    if (!isRegion(measure)) return { element: row, button, note };
    const more = row.appendChild(document.createElement("div"));
    const list = more.appendChild(document.createElement("dl"));
    const histogram = more.appendChild(document.createElement("canvas"));
    Object.assign(histogram, { width: 280, height: 60, className: "histogram" });
    histogram.setAttribute("role", "img");
    const ends = more.appendChild(document.createElement("dl"));
    ends.className = "ends";
    const bound = more.appendChild(document.createElement("p"));
    bound.className = "small";
    more.hidden = true;
    return { element: row, button, note, more, list, histogram, ends, bound };
  }
}
