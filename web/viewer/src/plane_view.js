// The picture of a plane in any direction: samples that are interpolated, and marks.
//
// It has what pointers, measures and zooming need of a SliceView. Its center is a place of the volume, of which the foot on
// the plane is in the middle of the canvas.
import { Bricks } from "./bricks.js";
import { bases, changeOf, distanceTo, dot, frameOf, planeText, stepsIn, vectorOf, withinVolume } from "./plane.js";
import { drawPlaneMarks } from "./plane_marks.js";
import { layoutsOf, lettersOf, towardPatient } from "./sides.js";

// A level is fine enough if its samples have at most this many pixels of the screen.
const coarsePixels = 1.5;
// Milliseconds without change, after which the wanted level is read.
const rest = 120;
// Of the bricks that a picture needs, at most.
const mostSamples = 64e6;
// Pixels of the screen for one that is computed, while the plane moves.
const roughPixels = 3;

const minus = (a, b) => a.map((n, i) => n - b[i]);
const plus = (a, b) => a.map((n, i) => n + b[i]);

export class PlaneView {
  #state;
  #context;
  #onChange;
  #onError;
  #bricks;
  #steps;
  #picture = document.createElement("canvas");
  #key;
  name = "plane";
  isPlane = true;
  changedAt = -rest;

  /** `state` is what the views share; see viewer.js. */
  constructor(canvas, state, onChange, onError) {
    Object.assign(this, { canvas });
    this.#state = state;
    this.#onChange = onChange;
    this.#onError = onError;
    this.#context = canvas.getContext("2d");
    this.center = [0, 0, 0];
    canvas.addEventListener("contextrestored", () => {
      this.#key = undefined;
      onChange();
    });
  }

  get isShown() {
    return this.canvas.clientWidth > 0 && this.canvas.clientHeight > 0;
  }

  /** There is another volume. */
  reset() {
    const { volume, places } = this.#state;
    this.#bricks?.close();
    this.#bricks = new Bricks(volume, this.#onChange, this.#onError);
    this.#steps = stepsIn(volume, places);
    this.#key = undefined;
    this.center = volume.dims.map((n) => n / 2);
  }

  retry() {
    this.#bricks?.retry();
  }

  changed() {
    this.changedAt = performance.now();
  }

  /** Milliseconds until it may want more. */
  get waits() {
    return this.isShown ? Math.max(rest - (performance.now() - this.changedAt), 0) : 0;
  }

  // ---- Places ------------------------------------------------------------------------------------------------------

  get steps() {
    return this.#steps;
  }

  /** Vectors of length 1: to the right, down, and across the plane. */
  get frame() {
    return frameOf(this.#state.plane, this.#steps, this.#state.places.axes);
  }

  get #finest() {
    return Math.min(...this.#state.places.steps);
  }

  #baseLayout() {
    return layoutsOf(this.#state.places.axes)[bases.indexOf(this.#state.plane.base)];
  }

  get title() {
    return `oblique: ${planeText(this.#state.plane, this.#baseLayout().label.toLowerCase())}`;
  }

  /** Letters of the patient's sides at the edges; undefined if the file does not say how it lies. */
  get sides() {
    const toward = towardPatient(this.#state.volume);
    if (!this.#state.places.axes || !toward) return undefined;
    const letters = (vector, way) => lettersOf(vector.map((n, i) => n * toward[i] * way));
    const [right, down] = this.frame;
    return { left: letters(right, -1), right: letters(right, 1), top: letters(down, -1), bottom: letters(down, 1) };
  }

  /** The vector from the middle of the canvas to a point of it. */
  #vectorAt(x, y) {
    const { zoom } = this.#state;
    const [right, down] = this.frame;
    const [a, b] = [(x - this.canvas.clientWidth / 2) / zoom, (y - this.canvas.clientHeight / 2) / zoom];
    return right.map((n, i) => n * a + down[i] * b);
  }

  /** The place of the plane that is in the middle of the canvas. */
  get #middle() {
    const { plane } = this.#state;
    const [, , normal] = this.frame;
    const off = distanceTo(plane, normal, this.#steps, this.center);
    return minus(this.center, changeOf(this.#steps, normal.map((n) => n * off)));
  }

  /** The place in the plane at a point of the canvas, which may be outside of the volume. */
  placeAt(x, y) {
    return plus(this.#middle, changeOf(this.#steps, this.#vectorAt(x, y)));
  }

  /** The place in the plane and in the volume that is nearest to a point of the canvas, on a line from the cross hair. */
  spaceAt(x, y) {
    return withinVolume(this.cross, this.placeAt(x, y), this.#state.volume.dims);
  }

  /** Where a place is on the canvas, or its foot on the plane. */
  pointIn(place) {
    const { zoom } = this.#state;
    const [right, down] = this.frame;
    const vector = vectorOf(this.#steps, minus(place, this.#middle));
    return [this.canvas.clientWidth / 2 + dot(right, vector) * zoom, this.canvas.clientHeight / 2 + dot(down, vector) * zoom];
  }

  /** The cross hair. */
  get cross() {
    return this.#state.plane.through;
  }

  /** The place some of the finest steps from the cross hair: to the right (0), down (1), or across the plane (2). */
  along(way, count) {
    return withinVolume(this.cross, plus(this.cross, this.changeAlong(way, count)), this.#state.volume.dims);
  }

  changeAlong(way, count) {
    return changeOf(this.#steps, this.frame[way].map((n) => n * count * this.#finest));
  }

  /** True if a measure is in this plane. */
  holds({ plane, points }) {
    const [, , normal] = this.frame;
    const far = (place) => Math.abs(distanceTo(this.#state.plane, normal, this.#steps, place));
    return plane !== undefined && points.every((place) => far(place) < this.#finest / 2);
  }

  /** What a measure that begins now has of its slice. */
  get placed() {
    return { plane: { ...this.#state.plane } };
  }

  pan(dx, dy) {
    const [x, y] = [this.canvas.clientWidth / 2 - dx, this.canvas.clientHeight / 2 - dy];
    const { dims } = this.#state.volume;
    this.center = this.placeAt(x, y).map((n, axis) => Math.min(Math.max(n, 0), dims[axis]));
    this.changed();
  }

  zoomAround(x, y, change) {
    const before = this.placeAt(x, y);
    change();
    this.center = plus(this.#middle, minus(before, this.placeAt(x, y)));
    this.pan(0, 0);
  }

  /** Pixels of the page for a unit of the world, with which the slice that it begins with fits. */
  fittingZoom() {
    const { volume, steps } = this.#state;
    const { across, down } = this.#baseLayout();
    const [wide, high] = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => Math.max(n - 24, 10));
    return Math.min(wide / (volume.dims[across] * steps[across]), high / (volume.dims[down] * steps[down]));
  }

  /** How far the plane can go along its normal from the place that is 0 everywhere: [lowest, highest, now]. */
  get reach() {
    const { dims } = this.#state.volume;
    const [, , normal] = this.frame;
    const ends = dims.map((n, axis) => n * dot(this.#steps.axes[axis], normal));
    const at = dot(vectorOf(this.#steps, this.cross), normal);
    const sum = (pick) => ends.reduce((total, end) => total + pick(end, 0), 0);
    return [sum(Math.min), sum(Math.max), at];
  }

  // ---- Reading -----------------------------------------------------------------------------------------------------

  /** The bricks of a level that the picture needs, those in the middle first. */
  #bricksOf(level) {
    const { volume, zoom } = this.#state;
    const { factor, dims } = volume.levels[level];
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const middle = this.#middle;
    const frame = this.frame;
    const limits = [width / 2 / zoom, height / 2 / zoom, 0];
    const corners = [[0, 0], [width, 0], [0, height], [width, height]].map(([x, y]) => this.placeAt(x, y));
    const ranges = [0, 1, 2].map((axis) => {
      const along = corners.map((corner) => corner[axis] / factor);
      const [low, high] = [Math.floor(Math.min(...along)) - 1, Math.floor(Math.max(...along)) + 1];
      const within = [Math.max(low, 0), Math.min(high, dims[axis] - 1)];
      return within[0] > within[1] ? undefined : within.map((n) => this.#bricks.number(n));
    });
    if (ranges.includes(undefined)) return [];
    const found = [];
    const [[x0, x1], [y0, y1], [z0, z1]] = ranges;
    for (let z = z0; z <= z1; ++z)
      for (let y = y0; y <= y1; ++y)
        for (let x = x0; x <= x1; ++x) {
          const { low, high } = this.#bricks.boxOf(level, [x, y, z]);
          // With the neighbors of its samples, between which there are values.
          const half = low.map((n, axis) => (high[axis] - n) / 2 + 1);
          const offset = vectorOf(this.#steps, low.map((n, axis) => ((n + high[axis]) / 2) * factor - middle[axis]));
          const isMet = frame.every((vector, i) => {
            const extent = half.reduce((sum, n, axis) => sum + n * factor * Math.abs(dot(vector, this.#steps.axes[axis])), 0);
            return Math.abs(dot(vector, offset)) <= limits[i] + extent;
          });
          if (isMet) found.push({ level, numbers: [x, y, z], distance: Math.hypot(...offset) });
        }
    return found.sort((a, b) => a.distance - b.distance);
  }

  get #coarsest() {
    return this.#state.volume.levels.length - 1;
  }

  /** The number of the level that is fine enough for the screen, and not too much to read. */
  get level() {
    const { volume, zoom, places } = this.#state;
    const pixels = Math.max(...places.steps) * zoom * devicePixelRatio;
    let level = this.#coarsest;
    while (level > 0 && volume.levels[level].factor * pixels > coarsePixels) --level;
    // A plane that is much smaller than its bricks needs few of them.
    while (level < this.#coarsest && this.#bricksOf(level).length * volume.brickEdge ** 3 > mostSamples) ++level;
    return level;
  }

  /** What the picture needs of a level; of a volume without overviews, no more than fits. */
  #needs(level) {
    return this.#bricksOf(level).slice(0, Math.max(Math.ceil(mostSamples / this.#state.volume.brickEdge ** 3), 8));
  }

  /** Reads what it wants: the coarsest overview, and then the wanted level, unless the plane moves. */
  read() {
    if (!this.#bricks) return;
    const level = this.isShown ? this.level : undefined;
    const wanted = this.isShown ? this.#needs(this.#coarsest) : [];
    if (level !== undefined && level !== this.#coarsest && this.waits === 0) wanted.push(...this.#needs(level));
    this.#bricks.want(wanted);
  }

  /** True if reading more would change nothing. */
  get isSettled() {
    return !this.isShown || (this.waits === 0 && this.#bricks.isSettled(this.#needs(this.level)));
  }

  /** The sample at a place: { between, nearest, factor }; nothing if it is not there yet. */
  sampleAt(place) {
    for (const { level, factor } of this.#state.volume.levels) {
      const sampler = this.#bricks.sampler(level);
      const between = sampler.between(...place);
      if (between !== undefined) return { between, nearest: sampler.nearest(...place), factor };
    }
    return undefined;
  }

  // ---- Drawing -----------------------------------------------------------------------------------------------------

  draw() {
    if (!this.isShown || !this.#bricks) return;
    const { canvas } = this;
    const context = this.#context;
    const ratio = devicePixelRatio;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const isRough = this.waits > 0;
    this.#paint(width, height, isRough ? roughPixels : 1);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    const pixels = isRough ? roughPixels : 1;
    context.imageSmoothingEnabled = isRough;
    context.drawImage(this.#picture, 0, 0, this.#picture.width * pixels, this.#picture.height * pixels);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawPlaneMarks(context, this, this.#state);
  }

  /** Paints the samples of the plane, one for each square of pixels. */
  #paint(width, height, pixels) {
    const { volume, shades, zoom } = this.#state;
    const { level } = this;
    const [columns, rows] = [Math.ceil(width / pixels), Math.ceil(height / pixels)];
    // The cross hair may move in the plane.
    const place = [...this.#middle, ...this.frame.flat()].map((n) => n.toFixed(7));
    const key = [columns, rows, pixels, level, zoom, place, shades.version, this.#bricks.version].join();
    if (key === this.#key) return;
    this.#key = key;
    const levels = level === this.#coarsest ? [level] : [level, this.#coarsest];
    const samplers = levels.map((one) => this.#bricks.sampler(one));
    const { dims } = volume;
    const ratio = devicePixelRatio;
    const at = (i, j) => this.placeAt(((i + 0.5) * pixels) / ratio, ((j + 0.5) * pixels) / ratio);
    const start = at(0, 0);
    const [toRight, down] = [minus(at(1, 0), start), minus(at(0, 1), start)];
    const samples = new Float64Array(columns * rows);
    const isThere = new Uint8Array(columns * rows);
    let isFine = true;
    let isAny = false;
    for (let j = 0, n = 0; j < rows; ++j)
      for (let i = 0; i < columns; ++i, ++n) {
        const x = start[0] + i * toRight[0] + j * down[0];
        const y = start[1] + i * toRight[1] + j * down[1];
        const z = start[2] + i * toRight[2] + j * down[2];
        if (x < 0 || y < 0 || z < 0 || x >= dims[0] || y >= dims[1] || z >= dims[2]) continue;
        let sample = samplers[0].between(x, y, z);
        if (sample === undefined) {
          isFine = false;
          sample = samplers[1]?.between(x, y, z);
        }
        if (sample === undefined) continue;
        samples[n] = sample;
        isThere[n] = 1;
        isAny = true;
      }
    this.shown = isAny ? (isFine ? level : levels.at(-1)) : undefined;
    this.isWhole = isFine;
    const image = new ImageData(columns, rows);
    const painted = new Uint32Array(image.data.buffer);
    shades.paint(samples, painted);
    for (let n = 0; n < painted.length; ++n) if (isThere[n] === 0) painted[n] = 0;
    [this.#picture.width, this.#picture.height] = [columns, rows];
    this.#picture.getContext("2d").putImageData(image, 0, 0);
  }
}
