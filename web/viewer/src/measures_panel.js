// The list of measures: what each says, and buttons that show and remove it.
import { isFinished, noteOf, resultText } from "./measures.js";

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
      const { button, note } = this.#rows.get(measure);
      button.textContent = this.#titleOf(measure);
      button.setAttribute("aria-pressed", String(measure === chosenMeasure));
      note.textContent = noteOf(measure, this.#state);
      note.hidden = note.textContent === "";
    }
  }

  #titleOf(measure) {
    const { number, kind, normal, slice } = measure;
    const place = `${"xyz"[normal]} = ${slice}`;
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
    return { element: row, button, note };
  }
}
