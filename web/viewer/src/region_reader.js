// Reads the samples of regions, all of them and of the volume itself, and keeps what they are like.
import { boxOf, isRegion, statisticsOf } from "./regions.js";

// Milliseconds that a region rests before it is read.
const rest = 150;

export class RegionReader {
  #state;
  #isDone;
  #onChange;
  #reads = new Map(); // by regions: { points, controller, timer }
  /** Samples of the box of a region, at most. */
  mostSamples = 1 << 22;

  /**
   * `state` is what the views share; see viewer.js. `isDone(region)` is false while it is being made. `onChange()` is called
   * when a region has got `statistics`, or a `message` why it has none.
   */
  constructor(state, isDone, onChange) {
    this.#state = state;
    this.#isDone = isDone;
    this.#onChange = onChange;
  }

  /** There is another volume. */
  reset() {
    for (const region of this.#reads.keys()) this.#drop(region);
  }

  #drop(region) {
    const read = this.#reads.get(region);
    clearTimeout(read?.timer);
    read?.controller.abort();
    this.#reads.delete(region);
    region.statistics = region.message = undefined;
  }

  /** Reads the regions that have changed. */
  update() {
    const { measures } = this.#state;
    for (const region of this.#reads.keys()) if (!measures.includes(region)) this.#drop(region);
    for (const region of measures) {
      if (!isRegion(region) || !this.#isDone(region) || this.#reads.get(region)?.points === region.points) continue;
      this.#drop(region);
      const controller = new AbortController();
      const timer = setTimeout(() => this.#read(region, controller.signal), rest);
      this.#reads.set(region, { points: region.points, controller, timer });
    }
  }

  async #read(region, signal) {
    const { volume, scale } = this.#state;
    const box = boxOf(region, volume.dims);
    const size = box && box.high.reduce((product, end, axis) => product * (end - box.low[axis]), 1);
    const say = (message) => {
      region.message = message;
      this.#onChange();
    };
    if (!box) return say("has no sample: the middle of none is in it");
    if (size > this.mostSamples)
      return say(`too large: its box has ${size} samples, and at most ${this.mostSamples} are read; draw a smaller one`);
    try {
      const samples = await volume.read({ box, signal });
      if (signal.aborted) return;
      region.statistics = statisticsOf(region, box, samples, scale, !volume.type.startsWith("float"));
      if (!region.statistics) return say("has no sample: the middle of none is in it");
      this.#onChange();
    } catch (error) {
      if (!signal.aborted) say(error.message);
    }
  }
}
