// How measures are made, moved and removed: with pointers, or with points at the cross hair.
import { measureAt } from "./measure_marks.js";
import { isFinished, isMeasuring } from "./measures.js";
import { isRegion, withCorner } from "./regions.js";

// Pixels: less is no measure, but a hand that trembled.
const shortest = 3;

export class Measuring {
  #state;
  #onChange;
  #drag; // { measure, handle, before, isNew }
  #unfinished; // the measure that needs more points
  #follows = false; // whether its last point is the cross hair
  #numbers = 0;

  /** `state` is what the views share; see viewer.js. `onChange()` is called when measures have changed. */
  constructor(state, onChange) {
    this.#state = state;
    this.#onChange = onChange;
  }

  /** There is another file. */
  reset() {
    this.#state.measures = [];
    this.#state.chosenMeasure = this.#drag = this.#unfinished = undefined;
    this.#numbers = 0;
    this.#onChange();
  }

  /** Measures of an address. */
  add(measures) {
    for (const measure of measures) this.#state.measures.push({ ...measure, number: ++this.#numbers });
    this.#onChange();
  }

  #begin(view, place) {
    const { tool, measures } = this.#state;
    const measure = { kind: tool, number: ++this.#numbers, ...view.placed, points: [place, [...place]] };
    measures.push(measure);
    this.#state.chosenMeasure = this.#unfinished = measure;
    this.#follows = false;
    return measure;
  }

  /** True if the unfinished measure is in the slice of a view. */
  #continues(view) {
    const measure = this.#unfinished;
    return measure?.kind === this.#state.tool && view.holds(measure);
  }

  /** A drag begins: of what is there, of the next point of an unfinished measure, or of a new one. */
  start(view, point, pointerType) {
    if (this.#continues(view)) {
      const measure = this.#unfinished;
      const place = view.spaceAt(...point);
      const before = this.#follows ? measure.points.slice(0, -1) : measure.points;
      this.#follows = false;
      measure.points = [...before, place];
      this.#drag = { measure, handle: isRegion(measure) ? 2 : before.length, before, isNew: true };
      return this.#onChange();
    }
    this.#dropUnfinished();
    if (isRefused(this.#state.tool, view)) return;
    const found = measureAt(view, this.#state, point, pointerType);
    if (found) {
      const { measure, handle } = found;
      this.#state.chosenMeasure = measure;
      this.#drag = { measure, handle, before: measure.points, from: view.spaceAt(...point) };
      return this.#onChange();
    }
    const measure = this.#begin(view, view.spaceAt(...point));
    this.#drag = { measure, handle: isRegion(measure) ? 2 : 1, before: [], isNew: true };
    this.#onChange();
  }

  drag(view, point) {
    if (!this.#drag) return;
    const { measure, handle, before, from } = this.#drag;
    const place = view.spaceAt(...point);
    if (handle === undefined) this.#shift(measure, before, place.map((p, axis) => p - from[axis]));
    else if (isRegion(measure)) {
      measure.points = withCorner(measure, handle, place);
      this.#drag.handle = 0;
    } else measure.points = moved(measure, handle, place);
    this.#onChange();
  }

  #shift(measure, points, change) {
    const { dims } = this.#state.volume;
    let allowed = change.map((c, axis) => {
      if (axis === measure.normal) return 0;
      const along = points.map((p) => p[axis]);
      return Math.min(Math.max(c, -Math.min(...along)), dims[axis] - Math.max(...along));
    });
    // In a plane that lies across the axes, it stays in the plane.
    if (measure.plane) {
      const share = Math.min(...change.map((c, axis) => (c === 0 ? 1 : allowed[axis] / c)));
      allowed = change.map((c) => c * share);
    }
    measure.points = points.map((p) => p.map((n, axis) => n + allowed[axis]));
  }

  end(view) {
    const drag = this.#drag;
    this.#drag = undefined;
    if (!drag) return;
    const { measure, isNew } = drag;
    if (isNew && measure.points.length === 2) {
      const [a, b] = measure.points.map((place) => view.pointIn(place));
      if (Math.hypot(a[0] - b[0], a[1] - b[1]) < shortest) this.remove(measure);
    }
    if (isFinished(measure)) this.#unfinished = undefined;
    this.#onChange();
  }

  /** As if the drag had not begun. */
  cancel() {
    const drag = this.#drag;
    this.#drag = undefined;
    if (!drag) return;
    if (drag.before.length === 0) return this.remove(drag.measure);
    drag.measure.points = drag.before;
    this.#onChange();
  }

  /** Chooses what is at a point, or nothing. */
  choose(view, point, pointerType) {
    this.#state.chosenMeasure = measureAt(view, this.#state, point, pointerType)?.measure;
    this.#onChange();
  }

  /** Puts a point at the cross hair: the first one of a new measure, or the next one. */
  putPoint(view) {
    const { tool } = this.#state;
    if (!isMeasuring(tool) || isRefused(tool, view)) return;
    const place = [...view.cross];
    if (!this.#continues(view)) {
      this.#dropUnfinished();
      this.#begin(view, place);
      this.#follows = true;
      return this.#onChange();
    }
    const measure = this.#unfinished;
    const before = this.#follows ? measure.points.slice(0, -1) : measure.points;
    if (before.at(-1).every((p, axis) => p === place[axis])) return;
    measure.points = [...before, place];
    if (isRegion(measure)) measure.points = aroundSamples(measure);
    this.#follows = !isFinished(measure);
    if (this.#follows) measure.points = [...measure.points, [...place]];
    else this.#unfinished = undefined;
    this.#onChange();
  }

  /** The cross hair has moved in a view that shows the slice or plane of a measure that is not finished. */
  follow(views) {
    const measure = this.#unfinished;
    if (!measure || !this.#follows || this.#drag) return;
    const view = views.find((one) => one.holds(measure));
    if (!view) return;
    measure.points = [...measure.points.slice(0, -1), [...view.cross]];
    this.#onChange();
  }

  /** Moves a measure by samples along each axis. */
  step(measure, change) {
    this.#shift(measure, measure.points, change);
    this.#onChange();
  }

  remove(measure = this.#state.chosenMeasure) {
    const { measures } = this.#state;
    const at = measures.indexOf(measure);
    if (at < 0) return;
    measures.splice(at, 1);
    if (this.#unfinished === measure) this.#unfinished = undefined;
    if (this.#drag?.measure === measure) this.#drag = undefined;
    if (this.#state.chosenMeasure === measure) this.#state.chosenMeasure = undefined;
    if (measures.length === 0) this.#numbers = 0;
    this.#onChange();
  }

  /** What is unfinished goes, and nothing is chosen. */
  leave() {
    this.#dropUnfinished();
    this.#state.chosenMeasure = undefined;
    this.#onChange();
  }

  #dropUnfinished() {
    if (this.#unfinished) this.remove(this.#unfinished);
  }

  /** True if nothing of it is still to be placed. */
  isDone(measure) {
    return measure !== this.#unfinished && isFinished(measure);
  }
}

/** Regions have samples of a slice, and there is none in a plane across the axes. */
const isRefused = (tool, { isPlane }) => Boolean(isPlane) && isRegion({ kind: tool });

/** The points of a measure whose handle is at another place. */
function moved({ points }, handle, place) {
  return points.map((point, i) => (i === handle ? place : point));
}

/** Corners at the middles of samples, moved out so that the samples are in the region as a whole. */
function aroundSamples({ normal, points: [a, b] }) {
  const outward = (n, from, axis, isFirst) => {
    if (axis === normal) return n;
    const isLower = n < from || (n === from && isFirst);
    return n + (isLower ? -0.5 : 0.5);
  };
  return [a.map((n, axis) => outward(n, b[axis], axis, true)), b.map((n, axis) => outward(n, a[axis], axis, false))];
}
