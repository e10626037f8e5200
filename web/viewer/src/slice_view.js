// One slice of the volume on a canvas: the tiles that are there, the coarsest below and the wanted level above, cross
// hair and scale bar.
//
// Places are in samples of the volume, where sample i reaches from i to i + 1. Sample i of a level reaches from i *
// factor to (i + 1) * factor.
import { GridLines } from "./grid_lines.js";
import { planes } from "./tiles.js";

const axisNames = ["x", "y", "z"];
// A level is fine enough if its samples have at most this many pixels of the screen.
const coarsePixels = 1.5;
// Samples along an axis that a view shows at most: more can be wanted only of files without overviews.
const mostSamples = 4096;
// Milliseconds without change, after which the wanted level is read.
const rest = 120;
// Bricks whose grid is drawn at most, each of which takes some hundredths of a second.
const mostGridBricks = 150;

export class SliceView {
  #state;
  #context;
  #layers = new Map();
  #image; // of the tile that was painted last
  #grid;
  #gridPicture = { canvas: document.createElement("canvas") };

  /** `state` is what the views share; see viewer.js. */
  constructor(canvas, name, normal, state, onChange, onError) {
    Object.assign(this, { canvas, name, normal, ...planes[normal] });
    this.#state = state;
    this.#grid = new GridLines(onChange, onError);
    this.#context = canvas.getContext("2d");
    this.center = [0, 0];
    this.changedAt = 0;
    // z points up.
    this.flipped = this.down === 2;
  }

  get isShown() {
    return this.canvas.clientWidth > 0 && this.canvas.clientHeight > 0;
  }

  /** Forgets the volume that it showed. */
  reset() {
    this.#layers.clear();
    this.#grid.want(undefined);
    const { dims } = this.#state.volume;
    this.center = [dims[this.across] / 2, dims[this.down] / 2];
  }

  changed() {
    this.changedAt = performance.now();
  }

  /** Pixels of the page for a unit of the world, with which the slice fits. */
  fittingZoom() {
    const { volume, steps } = this.#state;
    const margin = 24;
    return Math.min(
      Math.max(this.canvas.clientWidth - margin, 10) / (volume.dims[this.across] * steps[this.across]),
      Math.max(this.canvas.clientHeight - margin, 10) / (volume.dims[this.down] * steps[this.down]),
    );
  }

  /** Pixels of the page for a sample along the two axes of the slice. */
  get scale() {
    const { zoom, steps } = this.#state;
    return [zoom * steps[this.across], zoom * steps[this.down]];
  }

  /** The place that is at a point of the canvas, in samples along the two axes. */
  placeAt(x, y) {
    const [sx, sy] = this.scale;
    const up = this.flipped ? -1 : 1;
    return [
      (x - this.canvas.clientWidth / 2) / sx + this.center[0],
      (up * (y - this.canvas.clientHeight / 2)) / sy + this.center[1],
    ];
  }

  pointOf(place) {
    const [sx, sy] = this.scale;
    const up = this.flipped ? -1 : 1;
    return [
      this.canvas.clientWidth / 2 + (place[0] - this.center[0]) * sx,
      this.canvas.clientHeight / 2 + up * (place[1] - this.center[1]) * sy,
    ];
  }

  pan(dx, dy) {
    const [sx, sy] = this.scale;
    const { dims } = this.#state.volume;
    const within = (place, axis) => Math.min(Math.max(place, 0), dims[axis]);
    this.center = [
      within(this.center[0] - dx / sx, this.across),
      within(this.center[1] - ((this.flipped ? -1 : 1) * dy) / sy, this.down),
    ];
    this.changed();
  }

  /** Keeps the place at a point of the canvas where it is while the zoom changes. */
  zoomAround(x, y, change) {
    const before = this.placeAt(x, y);
    change();
    const after = this.placeAt(x, y);
    this.center = this.center.map((c, i) => c + before[i] - after[i]);
    this.pan(0, 0);
  }

  /** The number of the level that is fine enough for the screen. */
  get level() {
    const { volume } = this.#state;
    const pixels = Math.max(...this.scale) * devicePixelRatio;
    for (let level = volume.levels.length - 1; level > 0; --level)
      if (volume.levels[level].factor * pixels <= coarsePixels) return level;
    return 0;
  }

  /** The part of a level that is seen, as Tiles.want() wants it; nothing if none is. */
  region(level, rank) {
    const { volume, tiles, position } = this.#state;
    const { factor, dims } = volume.levels[level];
    const corners = [this.placeAt(0, 0), this.placeAt(this.canvas.clientWidth, this.canvas.clientHeight)];
    const range = (i, axis) => {
      const ends = corners.map((corner) => Math.floor(corner[i] / factor)).sort((a, b) => a - b);
      const [first, last] = [Math.max(ends[0], 0), Math.min(ends[1], dims[axis] - 1)];
      if (first > last) return undefined;
      const [begin, end] = [tiles.number(first), tiles.number(last) + 1];
      const most = Math.floor(mostSamples / volume.brickEdge);
      if (end - begin <= most) return [begin, end];
      const middle = tiles.number(Math.min(Math.max(Math.floor(this.center[i] / factor), first), last));
      const from = Math.min(Math.max(middle - Math.floor(most / 2), begin), end - most);
      return [from, from + most];
    };
    const columns = range(0, this.across);
    const rows = range(1, this.down);
    if (!columns || !rows) return undefined;
    const slice = Math.min(Math.floor(position[this.normal] / factor), dims[this.normal] - 1);
    return { level, normal: this.normal, slice, columns, rows, rank };
  }

  get #coarsest() {
    return this.#state.volume.levels.length - 1;
  }

  /** True if there is something to see, or nothing more to wait for. */
  get hasFirst() {
    const first = this.isShown ? this.region(this.#coarsest, 0) : undefined;
    return !first || this.#state.tiles.isSettled(first);
  }

  /**
   * What it wants to be read: the coarsest overview and, if the views have that, the wanted level. `order` is that of
   * this view among the others.
   */
  regions(order, haveFirst) {
    if (!this.isShown) return [];
    const coarsest = this.#coarsest;
    const wanted = [this.region(coarsest, order)];
    if (haveFirst && this.level !== coarsest && performance.now() - this.changedAt >= rest)
      wanted.push(this.region(this.level, 10 + order));
    return wanted.filter(Boolean);
  }

  /** Milliseconds until it may want more. */
  get waits() {
    return Math.max(rest - (performance.now() - this.changedAt), 0);
  }

  /** True if the wanted level is complete. */
  get isComplete() {
    const region = this.region(this.level, 0);
    return !region || this.#state.tiles.has(region);
  }

  /** The part of the volume whose grid is shown; nothing if there is none, or if it is too large. */
  get #gridRegion() {
    if (!this.isShown || !this.#state.showsGrid || !this.#state.volume.storesGrid || this.level > 0) return undefined;
    const region = this.region(0, 0);
    if (!region) return undefined;
    const [columns, rows] = [region.columns, region.rows].map(([begin, end]) => end - begin);
    return columns * rows <= mostGridBricks ? region : undefined;
  }

  /** Reads the grid, after the samples. */
  wantGrid() {
    const region = this.#gridRegion;
    if (!region || (this.waits === 0 && this.isComplete)) this.#grid.want(region, this.#state.volume, this.#state.tiles);
  }

  /** "none" if it shows no grid, "far" if it must be zoomed in for it, "reading", or "shown". */
  get gridState() {
    const { showsGrid, volume } = this.#state;
    if (!this.isShown || !showsGrid || !volume.storesGrid) return "none";
    if (!this.#gridRegion) return this.region(0, 0) ? "far" : "none";
    return this.#grid.isReading || !this.#grid.path ? "reading" : "shown";
  }

  draw() {
    if (!this.isShown) return;
    const { canvas } = this;
    const context = this.#context;
    const ratio = devicePixelRatio;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    const { levels } = this.#state.volume;
    const { level } = this;
    const coarsest = levels.length - 1;
    this.shown = undefined;
    if (level !== coarsest && !this.isComplete) this.#drawLevel(coarsest, ratio);
    this.#drawLevel(level, ratio);
    if (this.#gridRegion && this.#grid.path) this.#drawGrid(ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.#drawMarks();
  }

  #drawGrid(ratio) {
    const { width, height } = this.canvas;
    const { path } = this.#grid;
    const [sx, sy] = this.scale.map((s) => s * ratio);
    // The middle of the first sample.
    const [x, y] = this.pointOf([0.5, 0.5]).map((p) => p * ratio);
    const key = `${[width, height, sx, sy, x, y]}`;
    const picture = this.#gridPicture;
    // The cross hair moves more often than the picture.
    if (picture.path !== path || picture.key !== key) {
      Object.assign(picture, { path, key });
      [picture.canvas.width, picture.canvas.height] = [width, height];
      const context = picture.canvas.getContext("2d");
      const { dims } = this.#state.volume;
      const up = this.flipped ? -1 : 1;
      // From the first sample to the last one.
      context.rect(x - 1, y - up, (dims[this.across] - 1) * sx + 2, up * ((dims[this.down] - 1) * sy + 2));
      context.clip();
      const scaled = new Path2D();
      scaled.addPath(path, new DOMMatrix([sx, 0, 0, up * sy, x, y]));
      context.strokeStyle = "rgba(94, 200, 255, 0.85)";
      context.lineWidth = ratio * (Math.min(sx, sy) < 4 * ratio ? 0.5 : 1);
      context.stroke(scaled);
    }
    this.#context.setTransform(1, 0, 0, 1, 0, 0);
    this.#context.drawImage(picture.canvas, 0, 0);
  }

  #drawLevel(level, ratio) {
    const region = this.region(level, 0);
    if (!region) return;
    const { tiles, shades, volume } = this.#state;
    const { slice, columns, rows } = region;
    const [left, top] = [tiles.range(level, this.across, columns[0])[0], tiles.range(level, this.down, rows[0])[0]];
    const [right, bottom] = [
      tiles.range(level, this.across, columns[1] - 1)[1],
      tiles.range(level, this.down, rows[1] - 1)[1],
    ];
    const key = `${slice} ${columns} ${rows} ${shades.version}`;
    let layer = this.#layers.get(level);
    if (layer?.key !== key) {
      const picture = layer?.picture ?? document.createElement("canvas");
      [picture.width, picture.height] = [right - left, bottom - top];
      layer = { key, picture, painted: new Set() };
      this.#layers.set(level, layer);
    }
    const context = layer.picture.getContext("2d");
    for (let row = rows[0]; row < rows[1]; ++row)
      for (let column = columns[0]; column < columns[1]; ++column) {
        const name = `${column} ${row}`;
        const samples = layer.painted.has(name) ? undefined : tiles.get(level, this.normal, slice, column, row);
        if (!samples) continue;
        const [x0, x1] = tiles.range(level, this.across, column);
        const [width, height] = [x1 - x0, samples.length / (x1 - x0)];
        if (this.#image?.width !== width || this.#image.height !== height)
          this.#image = context.createImageData(width, height);
        shades.paint(samples, new Uint32Array(this.#image.data.buffer));
        context.putImageData(this.#image, x0 - left, tiles.range(level, this.down, row)[0] - top);
        layer.painted.add(name);
      }
    if (layer.painted.size === 0) return;
    this.shown = level;
    const { factor } = volume.levels[level];
    const [sx, sy] = this.scale.map((s) => s * factor * ratio);
    const [x, y] = this.pointOf([left * factor, top * factor]).map((p) => p * ratio);
    const target = this.#context;
    target.setTransform(sx, 0, 0, this.flipped ? -sy : sy, x, y);
    // Samples of the volume are shown as what they are; those of an overview stand for others.
    target.imageSmoothingEnabled = factor > 1 || Math.max(sx, sy) < 2;
    target.imageSmoothingQuality = "high";
    // The last sample of an overview may reach beyond the volume.
    const limit = (axis, end) => Math.min(end, volume.dims[axis] / factor);
    target.save();
    target.beginPath();
    target.rect(0, 0, limit(this.across, right) - left, limit(this.down, bottom) - top);
    target.clip();
    target.drawImage(layer.picture, 0, 0);
    target.restore();
  }

  #drawMarks() {
    const { position, volume, unit, steps, zoom } = this.#state;
    const context = this.#context;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [x, y] = this.pointOf([position[this.across] + 0.5, position[this.down] + 0.5]);
    context.strokeStyle = "rgba(242, 177, 52, 0.75)";
    context.lineWidth = 1;
    context.beginPath();
    // With a gap, so that the place itself is seen.
    const gap = 8;
    for (const [x0, y0, x1, y1] of [
      [0, y, x - gap, y],
      [x + gap, y, width, y],
      [x, 0, x, y - gap],
      [x, y + gap, x, height],
    ]) {
      context.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
      context.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
    }
    context.stroke();

    const write = (text, tx, ty, align) => {
      context.textAlign = align;
      context.lineWidth = 3;
      context.strokeStyle = "rgba(0, 0, 0, 0.8)";
      context.strokeText(text, tx, ty);
      context.fillText(text, tx, ty);
    };
    context.font = "13px system-ui, sans-serif";
    context.fillStyle = "#f4f4f4";
    const level = this.shown === undefined ? "" : volume.levels[this.shown].factor;
    const coarse = level > 1 ? ` · overview 1:${level}` : "";
    const axis = axisNames[this.normal];
    write(`${this.name}  ${axis} = ${position[this.normal]} of ${volume.dims[this.normal]}${coarse}`, 9, 19, "left");

    // As long as a round number of units allows.
    const most = Math.min(180, width / 3) / zoom;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((n) => n * power).find((n) => n <= most) ?? power;
    const pixels = length * zoom;
    const [right, low] = [width - 12, height - 14];
    context.fillStyle = "rgba(0, 0, 0, 0.8)";
    context.fillRect(right - pixels - 2, low - 4, pixels + 4, 8);
    context.fillStyle = "#f4f4f4";
    context.fillRect(right - pixels, low - 2, pixels, 4);
    write(`${Number(length.toPrecision(3))} ${unit}`, right, low - 9, "right");

    // The axes of samples, in the lower left corner.
    const corner = this.flipped ? [14, height - 14] : [14, height - 40];
    const up = this.flipped ? -1 : 1;
    context.strokeStyle = "#f4f4f4";
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(corner[0] + 22, corner[1]);
    context.lineTo(corner[0], corner[1]);
    context.lineTo(corner[0], corner[1] + up * 22);
    context.stroke();
    write(axisNames[this.across], corner[0] + 27, corner[1] + 4, "left");
    write(axisNames[this.down], corner[0] - 4, corner[1] + (this.flipped ? -28 : 36), "left");
  }
}
