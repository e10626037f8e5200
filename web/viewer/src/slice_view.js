// One slice of the volume on a canvas: the tiles that are there, the coarsest below and the wanted level above, the colors
// of materials over them, and marks.
//
// Places are in samples of the volume, where sample i reaches from i to i + 1: first along the axis that runs across
// the canvas, then along the one that runs down it. Sample i of a level reaches from i * factor to (i + 1) * factor.
// Tiles have axes of their own, which may be the other way round.
import { GridLines } from "./grid_lines.js";
import { drawMarks, drawUnreadable } from "./marks.js";
import { layoutsOf } from "./sides.js";
import { Slab, slabAt } from "./slab.js";
import { planes } from "./tiles.js";

// A level is fine enough if its samples have at most this many pixels of the screen.
const coarsePixels = 1.5;
// Samples along an axis that a view shows at most: more can be wanted only of files without overviews.
const mostSamples = 4096;
// Milliseconds without change, after which the wanted level is read.
const rest = 120;
// Of the bricks of a slab that is shown at most, if there is a coarser level.
const mostSlabSamples = 256e6;
// Bricks whose grid is drawn at most, each of which takes some hundredths of a second.
const mostGridBricks = 150;

export class SliceView {
  #state;
  #context;
  #layers = new Map();
  #image; // of the tile that was painted last
  #grid;
  #gridPicture = { canvas: document.createElement("canvas") };
  // Of the bricks whose labels are shown, at most. Only labels of the volume itself are labels: those of an overview are
  // means.
  mostLabelSamples = 64e6;

  /** `state` is what the views share; see viewer.js. */
  constructor(canvas, name, state, onChange, onError) {
    Object.assign(this, { canvas, name });
    this.#state = state;
    this.#grid = new GridLines(onChange, onError);
    this.#context = canvas.getContext("2d");
    this.center = [0, 0];
    this.changedAt = 0;
    this.#layOut(undefined);
    // The graphics card may lose what was painted.
    canvas.addEventListener("contextrestored", () => {
      this.#layers.clear();
      this.#gridPicture = { canvas: document.createElement("canvas") };
      onChange();
    });
  }

  /** Along which axes of the samples it lies, and which way they run: see layoutsOf(). */
  #layOut(axes) {
    const layout = layoutsOf(axes)[["axial", "coronal", "sagittal"].indexOf(this.name)];
    Object.assign(this, layout, { isTurned: layout.across > layout.down });
  }

  get isShown() {
    return this.canvas.clientWidth > 0 && this.canvas.clientHeight > 0;
  }

  /** Forgets the volume that it showed. */
  reset() {
    this.#layers.clear();
    this.#grid.want(undefined);
    const {
      volume: { dims },
      places,
    } = this.#state;
    this.#layOut(places.axes);
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
    return [
      (this.signs[0] * (x - this.canvas.clientWidth / 2)) / sx + this.center[0],
      (this.signs[1] * (y - this.canvas.clientHeight / 2)) / sy + this.center[1],
    ];
  }

  pointOf(place) {
    const [sx, sy] = this.scale;
    return [
      this.canvas.clientWidth / 2 + this.signs[0] * (place[0] - this.center[0]) * sx,
      this.canvas.clientHeight / 2 + this.signs[1] * (place[1] - this.center[1]) * sy,
    ];
  }

  /** The place in the volume that is at a point of the canvas, or nearest to it in the volume. */
  spaceAt(x, y) {
    const { dims } = this.#state.volume;
    const place = this.cross;
    const [a, b] = this.placeAt(x, y);
    [place[this.across], place[this.down]] = [a, b];
    return place.map((n, axis) => Math.min(Math.max(n, 0), dims[axis]));
  }

  /** Where a place of the volume is on the canvas, or its foot on the slice. */
  pointIn(place) {
    return this.pointOf([place[this.across], place[this.down]]);
  }

  /** The cross hair: the middle of a sample. */
  get cross() {
    return this.#state.position.map((p) => p + 0.5);
  }

  /** True if a measure is in the slice that is shown. */
  holds({ normal, slice }) {
    return normal === this.normal && slice === this.#state.position[normal];
  }

  /** What a measure that begins now has of its slice. */
  get placed() {
    return { normal: this.normal, slice: this.#state.position[this.normal] };
  }

  pan(dx, dy) {
    const [sx, sy] = this.scale;
    const { dims } = this.#state.volume;
    const within = (place, axis) => Math.min(Math.max(place, 0), dims[axis]);
    this.center = [
      within(this.center[0] - (this.signs[0] * dx) / sx, this.across),
      within(this.center[1] - (this.signs[1] * dy) / sy, this.down),
    ];
    this.changed();
  }

  /** Numbers along the axes across and down, as those along the columns and rows of tiles, and the other way. */
  #turned([a, b]) {
    return this.isTurned ? [b, a] : [a, b];
  }

  /** From places along columns and rows, which begin at `start` and have `factor` samples, to pixels of the screen. */
  #matrix(start, factor, ratio) {
    const [x, y] = this.pointOf(this.#turned(start)).map((p) => p * ratio);
    const [sx, sy] = this.scale.map((s, i) => s * factor * ratio * this.signs[i]);
    return this.isTurned ? [0, sy, sx, 0, x, y] : [sx, 0, 0, sy, x, y];
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
    const coarsest = volume.levels.length - 1;
    let level = coarsest;
    while (level > 0 && volume.levels[level].factor * pixels > coarsePixels) --level;
    while (level < coarsest && this.slab && this.#samplesOf(level) > mostSlabSamples) ++level;
    return level;
  }

  #samplesOf(level) {
    const region = this.region(level, 0);
    return region ? this.#state.tiles.samplesOf(region) : 0;
  }

  /** The slices of the volume that are shown as one; undefined if a single one is shown. */
  get slab() {
    return slabAt(this.#state, this.normal);
  }

  /** The number of the slice of a level that is shown, or the Slab of several. */
  sliceAt(level, slab = this.slab) {
    const { volume, position } = this.#state;
    const { factor, dims } = volume.levels[level];
    const at = (slice) => Math.min(Math.floor(slice / factor), dims[this.normal] - 1);
    if (!slab) return at(position[this.normal]);
    const [begin, end] = [at(slab.begin), at(slab.end - 1) + 1];
    return new Slab(begin, end, slab.kind);
  }

  /**
   * The part of a level that is seen, as Tiles.want() wants it; nothing if none is. Of the volume that is shown, or of
   * another one of the same size, and of a slab, or of one slice.
   */
  region(level, rank, { volume, tiles } = this.#state, slab = this.slab) {
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
    const [columns, rows] = this.#turned([range(0, this.across), range(1, this.down)]);
    if (!columns || !rows) return undefined;
    return { level, normal: this.normal, slice: this.sliceAt(level, slab), columns, rows, rank };
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

  /** True if reading more would change nothing: what is missing could not be read. */
  get isSettled() {
    const region = this.region(this.level, 0);
    return !region || this.#state.tiles.isSettled(region);
  }

  /** The part of the volume whose grid is shown; nothing if there is none, or if it is too large. */
  get #gridRegion() {
    if (!this.isShown || !this.#state.showsGrid || !this.#state.volume.storesGrid || this.level > 0) return undefined;
    const region = this.region(0, 0, this.#state, null);
    if (!region) return undefined;
    const [columns, rows] = [region.columns, region.rows].map(([begin, end]) => end - begin);
    return columns * rows <= mostGridBricks ? region : undefined;
  }

  /** Reads the grid, after the samples. */
  wantGrid() {
    const region = this.#gridRegion;
    if (!region || (this.waits === 0 && this.isComplete))
      this.#grid.want(region, this.#state.volume, this.#state.tiles);
  }

  /** "none" if it shows no grid, "far" if it must be zoomed in for it, "reading", or "shown". */
  get gridState() {
    const { showsGrid, volume } = this.#state;
    if (!this.isShown || !showsGrid || !volume.storesGrid) return "none";
    if (!this.#gridRegion) return this.region(0, 0) ? "far" : "none";
    return this.#grid.isReading || !this.#grid.path ? "reading" : "shown";
  }

  /** The part of the volume whose labels are shown; nothing if there is none, or if it is too large. */
  #labelRegion(order = 0) {
    const { labels, showsColors } = this.#state;
    // Labels of several slices have no mean.
    if (!this.isShown || !showsColors || !labels || this.slab) return undefined;
    const region = this.region(0, 20 + order, labels);
    return region && labels.tiles.samplesOf(region) <= this.mostLabelSamples ? region : undefined;
  }

  /** The labels that it wants to be read, after the samples. */
  labelRegions(order) {
    const region = this.waits === 0 && this.isSettled && this.#labelRegion(order);
    return region ? [region] : [];
  }

  /** "none" if it shows no labels, "far" if it must be zoomed in for them, "reading", or "shown". */
  get labelState() {
    const { labels, showsColors } = this.#state;
    if (!this.isShown || !showsColors || !labels || this.slab) return "none";
    const region = this.#labelRegion();
    if (!region) return this.region(0, 0, labels) ? "far" : "none";
    return labels.tiles.isSettled(region) ? "shown" : "reading";
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
    this.#drawLabels(ratio);
    if (this.#gridRegion && this.#grid.path) this.#drawGrid(ratio);
    const unreadable = [
      ...this.#unreadable(this.level, this.region(this.level, 0), this.#state),
      ...this.#unreadable(0, this.#labelRegion(), this.#state.labels),
    ];
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawUnreadable(context, unreadable);
    drawMarks(context, this, this.#state);
  }

  /** The boxes of the canvas in which a region of a level could not be read: [x, y, width, height]. */
  #unreadable(level, region, from) {
    if (!region) return [];
    const { tiles, volume } = from;
    const { factor } = volume.levels[level];
    return tiles.failedBoxes(region).map(([begin, end]) => {
      const corners = [begin, end].map((corner) => this.pointOf(this.#turned(corner.map((p) => p * factor))));
      const [x, y] = [0, 1].map((i) => Math.min(corners[0][i], corners[1][i]));
      return [x, y, Math.abs(corners[1][0] - corners[0][0]), Math.abs(corners[1][1] - corners[0][1])];
    });
  }

  #drawGrid(ratio) {
    const { width, height } = this.canvas;
    const { path } = this.#grid;
    // The middle of the first sample.
    const matrix = this.#matrix([0.5, 0.5], 1, ratio);
    const key = `${[width, height, matrix]}`;
    const picture = this.#gridPicture;
    // The cross hair moves more often than the picture.
    if (picture.path !== path || picture.key !== key) {
      Object.assign(picture, { path, key });
      [picture.canvas.width, picture.canvas.height] = [width, height];
      const context = picture.canvas.getContext("2d");
      const { dims } = this.#state.volume;
      // From the first sample to the last one.
      const [first, last] = [
        [0.5, 0.5],
        [dims[this.across] - 0.5, dims[this.down] - 0.5],
      ].map((place) => this.pointOf(place).map((p) => p * ratio));
      const [low, high] = [Math.min, Math.max].map((pick) => [0, 1].map((i) => pick(first[i], last[i])));
      context.rect(low[0] - 1, low[1] - 1, high[0] - low[0] + 2, high[1] - low[1] + 2);
      context.clip();
      const scaled = new Path2D();
      scaled.addPath(path, new DOMMatrix(matrix));
      context.strokeStyle = "rgba(94, 200, 255, 0.85)";
      context.lineWidth = ratio * (Math.min(...this.scale) < 4 ? 0.5 : 1);
      context.stroke(scaled);
    }
    this.#context.setTransform(1, 0, 0, 1, 0, 0);
    this.#context.drawImage(picture.canvas, 0, 0);
  }

  #drawLevel(level, ratio) {
    const region = this.region(level, 0);
    if (!region) return;
    const { tiles, shades, volume, colors, showsColors } = this.#state;
    const { factor } = volume.levels[level];
    const painted = this.#paint(`grey ${level}`, region, tiles, shades.ofLevel?.(level) ?? shades);
    if (!painted) return;
    this.shown = level;
    // Samples of the volume are shown as what they are; those of an overview stand for others.
    const isSmooth = factor > 1 || Math.max(...this.scale) * factor * ratio < 2;
    this.#place(painted, volume, factor, ratio, isSmooth, 1);
    if (showsColors && colors?.areOfValues) this.#drawColors(`colors ${level}`, region, this.#state, factor, ratio);
  }

  #drawLabels(ratio) {
    const region = this.#labelRegion();
    if (region) this.#drawColors("labels", region, this.#state.labels, 1, ratio);
  }

  /** The nearest sample of each pixel: a mix of two colors would be that of another material. */
  #drawColors(name, region, { volume, tiles }, factor, ratio) {
    const { colors, opacity } = this.#state;
    const painted = this.#paint(name, region, tiles, colors);
    if (painted) this.#place(painted, volume, factor, ratio, false, opacity);
  }

  /** A picture of the tiles of a region that are there, a pixel for each sample; nothing if there are none. */
  #paint(name, { level, slice, columns, rows }, tiles, painter) {
    const { across, down } = planes[this.normal];
    const [left, top] = [tiles.range(level, across, columns[0])[0], tiles.range(level, down, rows[0])[0]];
    const [right, bottom] = [tiles.range(level, across, columns[1] - 1)[1], tiles.range(level, down, rows[1] - 1)[1]];
    const key = `${slice} ${columns} ${rows} ${painter.version}`;
    let layer = this.#layers.get(name);
    if (layer?.key !== key || layer.painter !== painter) {
      const picture = layer?.picture ?? document.createElement("canvas");
      [picture.width, picture.height] = [right - left, bottom - top];
      layer = { key, painter, picture, painted: new Set(), left, top, right, bottom };
      this.#layers.set(name, layer);
    }
    const context = layer.picture.getContext("2d");
    for (let row = rows[0]; row < rows[1]; ++row)
      for (let column = columns[0]; column < columns[1]; ++column) {
        const tile = `${column} ${row}`;
        const samples = layer.painted.has(tile) ? undefined : tiles.get(level, this.normal, slice, column, row);
        if (!samples) continue;
        const [x0, x1] = tiles.range(level, across, column);
        const [width, height] = [x1 - x0, samples.length / (x1 - x0)];
        if (this.#image?.width !== width || this.#image.height !== height)
          this.#image = context.createImageData(width, height);
        painter.paint(samples, new Uint32Array(this.#image.data.buffer));
        context.putImageData(this.#image, x0 - left, tiles.range(level, down, row)[0] - top);
        layer.painted.add(tile);
      }
    return layer.painted.size > 0 ? layer : undefined;
  }

  /** Draws a picture of #paint(), whose samples are `factor` samples of the volume. */
  #place({ picture, left, top, right, bottom }, { dims }, factor, ratio, isSmooth, opacity) {
    const { across, down } = planes[this.normal];
    const target = this.#context;
    target.setTransform(...this.#matrix([left * factor, top * factor], factor, ratio));
    // The last sample of an overview may reach beyond the volume.
    const limit = (axis, end) => Math.min(end, dims[axis] / factor);
    target.save();
    target.imageSmoothingEnabled = isSmooth;
    target.imageSmoothingQuality = "high";
    target.globalAlpha = opacity;
    target.beginPath();
    target.rect(0, 0, limit(across, right) - left, limit(down, bottom) - top);
    target.clip();
    target.drawImage(picture, 0, 0);
    target.restore();
  }
}
