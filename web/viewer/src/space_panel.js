// The panel of the picture in 3D: colors, opacity, and the box of the samples that are drawn.
import { colorIn, mapNames } from "./color_maps.js";
import { lettersOf } from "./sides.js";
import { cropOf } from "./space.js";

const element = (id) => document.getElementById(id);

export class SpacePanel {
  #state;
  #onChange;
  #ends = []; // of the box: { axis, isHigh, number, slider }

  /** `state` is what the views share; see viewer.js. `onChange()` is called when the picture is another one. */
  constructor(state, onChange) {
    this.#state = state;
    this.#onChange = onChange;
    element("space-map").replaceChildren(...mapNames.map((name) => new Option(name, name)));
    element("space-map").addEventListener("change", ({ target }) => this.#set({ map: target.value }));
    element("space-opacity").addEventListener("input", ({ target }) => {
      const { space } = state;
      this.#set({ opacity: { ...space.opacity, [space.kind]: target.valueAsNumber / 100 } });
    });
    element("space-whole").addEventListener("click", () => this.#set({ crop: undefined }));
    for (const axis of [0, 1, 2]) this.#addAxis(axis);
  }

  #addAxis(axis) {
    const row = element("space-crop").appendChild(document.createElement("div"));
    row.className = "crop";
    row.setAttribute("role", "group");
    const name = row.appendChild(document.createElement("span"));
    for (const isHigh of [false, true]) {
      const label = `${isHigh ? "Last" : "First"} sample along ${"xyz"[axis]}`;
      const [number, slider] = ["number", "range"].map((type) => {
        const field = row.appendChild(document.createElement("input"));
        Object.assign(field, { type, min: 0, step: 1, ariaLabel: `${label}${type === "range" ? ", slider" : ""}` });
        field.addEventListener("input", () => Number.isFinite(field.valueAsNumber) && this.#crop(axis, isHigh, field.valueAsNumber));
        return field;
      });
      number.addEventListener("blur", () => this.update());
      number.addEventListener("wheel", (event) => event.preventDefault(), { passive: false });
      this.#ends.push({ axis, isHigh, number, slider, name, row });
    }
  }

  /** One end of the box; the other one makes room. */
  #crop(axis, isHigh, sample) {
    const { volume, space } = this.#state;
    if (!volume) return;
    const { low, high } = cropOf(space, volume.dims);
    const at = Math.min(Math.max(Math.round(sample), 0), volume.dims[axis] - 1);
    if (isHigh) [low[axis], high[axis]] = [Math.min(low[axis], at), at + 1];
    else [low[axis], high[axis]] = [at, Math.max(high[axis], at + 1)];
    const isWhole = low.every((n) => n === 0) && high.every((n, i) => n === volume.dims[i]);
    this.#set({ crop: isWhole ? undefined : { low, high } });
  }

  #set(change) {
    Object.assign(this.#state.space, change);
    this.update();
    if (this.#state.volume) this.#onChange();
  }

  /** Fields have what is shown; one that is being edited stays. */
  update() {
    const { space, volume, places } = this.#state;
    element("space-map").value = space.map;
    const colors = Array.from({ length: 17 }, (_, i) => `rgb(${colorIn(space.map, i / 16).map(Math.round)})`);
    element("space-bar").style.background = `linear-gradient(to right, ${colors})`;
    const opacity = space.opacity[space.kind];
    // That of materials is with their legend.
    element("space-opacity-choice").hidden = opacity === undefined;
    if (opacity !== undefined) element("space-opacity").value = Math.round(opacity * 100);
    element("space-whole").disabled = !space.crop;
    if (!volume) return;
    const { low, high } = cropOf(space, volume.dims);
    for (const { axis, isHigh, number, slider, name, row } of this.#ends) {
      const toward = places.axes && [lettersOf(places.axes[axis].map((n) => -n)), lettersOf(places.axes[axis])].join("–");
      name.textContent = toward ? `${"xyz"[axis]} (${toward})` : "xyz"[axis];
      row.setAttribute("aria-label", `Samples along ${name.textContent}`);
      const value = isHigh ? high[axis] - 1 : low[axis];
      for (const field of [number, slider]) {
        field.max = volume.dims[axis] - 1;
        if (field === slider || document.activeElement !== number) field.value = value;
      }
    }
  }
}
