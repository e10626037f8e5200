// The panel of the plane in any direction: whether it is shown, and its angles.
import { within180 } from "./plane.js";
import { layoutsOf } from "./sides.js";

const element = (id) => document.getElementById(id);
const angles = ["tilt", "turn", "spin"];

export class PlanePanel {
  #state;
  #onChange;

  /** `state` is what the views share; see viewer.js. `onChange(isToggled)` is called when the plane has changed. */
  constructor(state, onChange) {
    this.#state = state;
    this.#onChange = onChange;
    element("plane-show").addEventListener("click", () => this.toggle());
    element("plane-base").addEventListener("change", ({ target }) => this.set({ base: target.value, tilt: 0, turn: 0, spin: 0, isShown: true }));
    element("plane-reset").addEventListener("click", () => this.set({ tilt: 0, turn: 0, spin: 0, isShown: true }));
    for (const name of angles) {
      const field = element(`plane-${name}`);
      field.addEventListener("input", () => {
        if (Number.isFinite(field.valueAsNumber)) this.set({ [name]: within180(field.valueAsNumber), isShown: true });
      });
      field.addEventListener("blur", () => this.update());
      field.addEventListener("wheel", (event) => event.preventDefault(), { passive: false });
    }
  }

  toggle() {
    if (this.#state.volume) this.set({ isShown: !this.#state.plane.isShown });
  }

  set(change) {
    const before = this.#state.plane;
    this.#state.plane = { ...before, ...change };
    this.update();
    if (this.#state.volume) this.#onChange(before.isShown !== this.#state.plane.isShown);
  }

  /** By degrees of one angle. */
  turn(name, degrees) {
    this.set({ [name]: within180(Math.round((this.#state.plane[name] + degrees) * 100) / 100), isShown: true });
  }

  /** Fields that are not being edited have the numbers of the plane. */
  update() {
    const { plane, places } = this.#state;
    element("plane-show").setAttribute("aria-pressed", String(plane.isShown));
    if (places)
      for (const [i, { label }] of layoutsOf(places.axes).entries())
        element("plane-base").options[i].textContent = label;
    element("plane-base").value = plane.base;
    for (const name of angles)
      if (document.activeElement !== element(`plane-${name}`)) element(`plane-${name}`).value = plane[name];
  }
}
