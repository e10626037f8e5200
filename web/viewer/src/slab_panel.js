// The panel of slabs: the kind, and how thick.
import { hasLengths, kindsOfSlabs, mostSlices } from "./slab.js";

const element = (id) => document.getElementById(id);

export class SlabPanel {
  #state;
  #onChange;

  /** `state` is what the views share; see viewer.js. */
  constructor(state, onChange) {
    this.#state = state;
    this.#onChange = onChange;
    element("slab-kind").addEventListener("change", ({ target }) => this.set({ kind: target.value }));
    element("slab-unit").addEventListener("change", ({ target }) => this.set({ isInSlices: target.value === "slices" }));
    element("slab-thickness").addEventListener("input", ({ target }) => {
      if (target.valueAsNumber > 0) this.set({ thickness: target.valueAsNumber });
    });
    element("slab-thickness").addEventListener("blur", () => this.update());
  }

  set(change) {
    Object.assign(this.#state.slab, change);
    this.update();
    this.#onChange();
  }

  /** The next kind. */
  step() {
    const { kind } = this.#state.slab;
    this.set({ kind: kindsOfSlabs[(kindsOfSlabs.indexOf(kind) + 1) % kindsOfSlabs.length] });
  }

  /** Thicker, or thinner (-1), by slices along an axis. */
  thicken(count, normal) {
    const { slab, places } = this.#state;
    const step = slab.isInSlices || !hasLengths(places) ? 1 : places.steps[normal];
    // Without the noise of sums.
    const thickness = Number((slab.thickness + count * step).toPrecision(12));
    this.set({ thickness: Math.min(Math.max(thickness, step), mostSlices * step) });
  }

  /** There may be another volume. */
  update() {
    const { slab, places, scale } = this.#state;
    const isLength = hasLengths(places);
    element("slab-length").textContent = places.unit;
    element("slab-length").hidden = !isLength;
    element("slab-unit").value = slab.isInSlices || !isLength ? "slices" : "length";
    element("slab-kind").value = slab.kind;
    if (document.activeElement !== element("slab-thickness")) element("slab-thickness").value = slab.thickness;
    element("slab-note").textContent =
      slab.kind === "none" ? "" : scale.note ? "Not shown: each slice has its own slope." : this.#limits();
  }

  #limits() {
    const notes = [`At most ${mostSlices} slices.`];
    if (this.#state.volume.levels.length > 1)
      notes.push("Of an overview, it is that of means: zoom in for samples of the volume itself.");
    if (this.#state.measures.length > 0) notes.push("Regions measure the slice, not the slab.");
    return notes.join(" ");
  }
}
