// The page: opens a file, and links the views.
import { open } from "@tagrid/decoder";
import { secondState } from "./comparison.js";
import { addressOf, nameIn, nameOf } from "./addresses.js";
import { ComparisonPanel } from "./comparison_panel.js";
import { Announcer } from "./announcer.js";
import { boundRows, factRows, fillList, scaleOf } from "./describe.js";
import { DisplayWindow } from "./display_window.js";
import { handleKeys, handlePointers } from "./input.js";
import { linkOf, shownBy } from "./link.js";
import { MaterialsPanel } from "./materials_panel.js";
import { MeasuresPanel } from "./measures_panel.js";
import { Measuring } from "./measuring.js";
import { measuredText, numberText } from "./numbers.js";
import { captionOf, composed, save } from "./picture_file.js";
import { placesOf } from "./places.js";
import { frameOf, turnedAbout } from "./plane.js";
import { turnedByDrag } from "./plane_line.js";
import { PlanePanel } from "./plane_panel.js";
import { PlaneView } from "./plane_view.js";
import { Presets } from "./presets.js";
import { planeRows, readoutRows } from "./readout.js";
import { RegionReader } from "./region_reader.js";
import { Shades } from "./shades.js";
import { newSpace } from "./space.js";
import { SpacePanel } from "./space_panel.js";
import { SlabPanel } from "./slab_panel.js";
import { SliceView } from "./slice_view.js";
import { Tiles } from "./tiles.js";
import { SpaceView } from "./space_view.js";

const decoderBase = new URL("decoder/", import.meta.url);
const element = (id) => document.getElementById(id);
const sections = Object.fromEntries([...document.querySelectorAll("#views section")].map((s) => [s.dataset.view, s]));

// What the views share. Positions are samples of the volume; the zoom is pixels of the page for a unit of length.
const state = {
  volume: undefined,
  name: "", // of the file
  tiles: undefined,
  shades: undefined,
  scale: undefined,
  places: undefined,
  steps: [1, 1, 1],
  position: [0, 0, 0],
  zoom: 1,
  tool: "move",
  isFitted: true,
  showsGrid: false,
  // Of materials, see colors.js; and the volume and tiles of their labels, if samples are labels.
  colors: undefined,
  labels: undefined,
  showsColors: true,
  opacity: 0.4,
  // See measures.js.
  measures: [],
  chosenMeasure: undefined,
  // See slab.js; the thickness is a length, or a number of slices.
  slab: { kind: "none", thickness: 5, isInSlices: false },
  // See space.js.
  space: newSpace(),
  // See plane.js; it passes through the cross hair.
  plane: { isShown: false, base: "axial", tilt: 30, turn: 0, spin: 0, through: [0, 0, 0] },
};

/** A view of slices in a section of the page, of the file that a state has. */
function makeView(name, section, ofState) {
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  const slider = document.createElement("input");
  Object.assign(slider, { type: "range", min: 0, className: "slices", ariaLabel: `number of the ${name} slice` });
  slider.addEventListener("input", () => {
    const position = [...state.position];
    position[view.normal] = slider.valueAsNumber;
    actions.moveTo(position);
  });
  section.append(canvas, slider);
  const onError = (error) => {
    failure = error.message;
    draw();
  };
  const view = new SliceView(canvas, name, ofState, () => draw(), onError);
  return Object.assign(view, { slider, section });
}
/** The view of the plane in any direction. Its slider moves the plane along its normal. */
function makePlaneView(section) {
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  const slider = document.createElement("input");
  Object.assign(slider, { type: "range", className: "slices", ariaLabel: "distance of the oblique plane" });
  slider.addEventListener("input", () => {
    const [low, , at] = view.reach;
    actions.go(view, 2, (low + slider.valueAsNumber - at) / Math.min(...state.steps));
  });
  section.append(canvas, slider);
  const view = new PlaneView(canvas, state, () => update(), (error) => {
    failure = error.message;
    if (error.code === "io-error") retryLater(state.volume);
    draw();
  });
  return Object.assign(view, { slider, section });
}
const planeNames = ["axial", "coronal", "sagittal"];
const sliceViews = planeNames.map((name) => makeView(name, sections[name], state));
// Of a second file, or of its difference from the first: at the same places.
const second = secondState(state);
const secondViews = sliceViews.map((first) => {
  const section = element("views").appendChild(document.createElement("section"));
  section.hidden = true;
  const view = makeView(first.name, section, second);
  return Object.defineProperty(view, "center", {
    get: () => first.center,
    set: (center) => (first.center = center),
  });
});
/** All views of slices that may be shown now. */
const allViews = () => (second.volume ? [...sliceViews, ...secondViews] : sliceViews);
const planeView = makePlaneView(sections.plane);
const spaceView = new SpaceView(sections.space, state, () => spaceChanged());
const spacePanel = new SpacePanel(state, () => spaceChanged());
function spaceChanged() {
  spacePanel.update();
  spaceView.draw();
  keepLink();
}
const displayWindow = new DisplayWindow(state, () => {
  presets.update();
  comparisonPanel.windowChanged();
  keepLink();
  spaceView.windowChanged();
  draw();
});
const presets = new Presets(state, coarsestSlices, (low, high) => displayWindow.set(low, high));
const materialsPanel = new MaterialsPanel(
  state,
  (source) => open(source, { base: decoderBase }),
  (volume) => tilesOf(volume, () => state.labels?.volume === volume, volume),
  () => {
    spaceView.colorsChanged();
    update();
  },
);
const comparisonPanel = new ComparisonPanel(
  state,
  second,
  secondViews,
  (source) => open(source, { base: decoderBase }),
  (volume, like) => tilesOf(volume, () => comparisonPanel.file?.volume === volume, like),
  () => {
    if (second.volume) for (const view of secondViews) resetView(view);
    showTab(shownTab);
  },
  () => draw(),
);
const measuring = new Measuring(state, () => {
  regionReader.update();
  measuresPanel.update();
  draw();
  keepLink();
  announceMeasure();
});
const regionReader = new RegionReader(state, (region) => measuring.isDone(region), () => {
  measuresPanel.update();
  draw();
});
const measuresPanel = new MeasuresPanel(state, {
  show(measure) {
    state.chosenMeasure = measure;
    const position = measure.points.reduce((sum, place) => sum.map((n, axis) => n + place[axis] / measure.points.length), [0, 0, 0]);
    if (measure.plane) planePanel.set(measure.plane);
    actions.moveTo(position, measure.plane && position);
    measuresPanel.update();
  },
  step(measure, i, count) {
    if (measure.plane) return measuring.step(measure, planeView.changeAlong(i, count));
    const view = sliceViews.find(({ normal }) => normal === measure.normal);
    const axis = i === 0 ? view.across : view.down;
    measuring.step(measure, [0, 1, 2].map((other) => (other === axis ? count * view.signs[i] : 0)));
  },
  remove: (measure) => measuring.remove(measure),
});
const slabPanel = new SlabPanel(state, () => {
  for (const view of allViews()) view.changed();
  update();
});
const planePanel = new PlanePanel(state, (isToggled) => {
  planeView.changed();
  if (isToggled) showTab(state.plane.isShown || shownTab !== "plane" ? shownTab : "all");
  else update();
  if (state.plane.isShown) announcePlane();
});
const announcer = new Announcer(element("announcement"));
let file;
// Milliseconds.
const retryAfter = 3000;
let retryTimer;

// For tests, and for whoever looks into the page: milliseconds since the page was opened.
const times = {};

function say(text, isError = false) {
  element("status").textContent = text;
  element("status").classList.toggle("error", isError);
}

let isDrawingPlanned = false;
function draw() {
  if (isDrawingPlanned) return;
  isDrawingPlanned = true;
  requestAnimationFrame(() => {
    isDrawingPlanned = false;
    if (!state.volume) return;
    if (haveFirst()) displayWindow.chooseOnce(coarsestSlices());
    for (const view of allViews()) view.draw();
    planeView.draw();
    materialsPanel.update();
    comparisonPanel.update();
    noteTimes();
    if (!isFirstDrawn && haveFirst()) {
      isFirstDrawn = true;
      read();
    }
    const isComplete = [...allViews(), planeView].every((view) => !view.isShown || view.isSettled);
    showProgress(isComplete);
    // After the slices, which come first.
    if (isComplete) spaceView.update();
  });
}

function noteTimes() {
  const shown = sliceViews.filter((view) => view.isShown);
  if (shown.some((view) => view.shown !== undefined)) times.first ??= performance.now();
  if (shown.every((view) => view.shown !== undefined)) times.all ??= performance.now();
  if (shown.every((view) => view.isSettled)) times.complete ??= performance.now();
}

let failure;
function showProgress(isComplete) {
  if (failure) return say(failure, true);
  say(isComplete ? gridNote() || labelNote() : "Reading …");
}

function gridNote() {
  if (!state.showsGrid) return "";
  if (!state.volume.storesGrid) return "The file stores no grid: it follows from the samples. tagrid mesh computes it.";
  const states = sliceViews.map((view) => view.gridState);
  if (states.includes("reading")) return "Reading the grid …";
  return states.includes("far") ? "Zoom in to see the grid: it is drawn over samples of the volume itself." : "";
}

function labelNote() {
  const states = sliceViews.map((view) => view.labelState);
  if (states.includes("reading")) return "Reading labels …";
  if (state.labels && state.showsColors && sliceViews.some((view) => view.isShown && view.slab))
    return "Labels are not drawn over slabs.";
  return states.includes("far") ? "Zoom in to see the labels: those of overviews would be means." : "";
}

const haveFirst = () => sliceViews.every((view) => view.hasFirst);
// Finer samples are read when the first pictures are on the screen, which must not wait for them.
let isFirstDrawn = false;
let timer;
/** Reads what the views want. */
function read() {
  clearTimeout(timer);
  if (!state.volume) return;
  if (!haveFirst()) isFirstDrawn = false;
  // Looked at before the views look: a wait that ends between would be a read that nobody plans.
  const waits = Math.max(...[...allViews(), planeView].map((view) => view.waits));
  const regions = sliceViews.flatMap((view, order) => view.regions(order, isFirstDrawn));
  const ofLabels = sliceViews.flatMap((view, order) => view.labelRegions(order));
  const isOneVolume = state.labels?.tiles === state.tiles;
  if (isOneVolume) regions.push(...ofLabels);
  regions.push(...readSecond());
  state.tiles.want(regions);
  if (!isOneVolume) state.labels?.tiles.want(ofLabels);
  for (const view of sliceViews) view.wantGrid();
  // After the slices, which come first.
  if (isFirstDrawn) planeView.read();
  if (waits > 0)
    timer = setTimeout(() => {
      read();
      // It is drawn roughly while it moves.
      if (planeView.isShown) draw();
    }, waits + 1);
}

/** Reads what the second views want, after what the others want; returns what they want of the first file. */
function readSecond() {
  if (!second.volume) return [];
  const regions = secondViews.flatMap((view, order) => view.regions(order + 3, isFirstDrawn));
  const { tiles } = comparisonPanel.file;
  if (!second.isDifference) {
    tiles.want(regions);
    return [];
  }
  const ofBoth = regions.map((region) => second.tiles.regionsOf(region));
  tiles.want(ofBoth.map(([, ofSecond]) => ofSecond));
  return ofBoth.map(([ofFirst]) => ofFirst);
}

/** After any change of what is shown. */
function update() {
  if (!state.volume) return;
  if (state.isFitted) fit();
  for (const { slider, normal } of [...sliceViews, ...secondViews]) {
    slider.max = state.volume.dims[normal] - 1;
    slider.value = state.position[normal];
    slider.setAttribute("aria-valuetext", `slice ${state.position[normal] + 1} of ${state.volume.dims[normal]}`);
  }
  if (planeView.isShown) placePlaneSlider();
  draw();
  read();
  showReadout();
  keepLink();
}

function placePlaneSlider() {
  const { slider } = planeView;
  const [low, high, at] = planeView.reach;
  Object.assign(slider, { min: 0, max: high - low, step: (high - low) / 1000 });
  slider.value = at - low;
  slider.setAttribute("aria-valuetext", `${measuredText(at - low, Math.min(...state.steps))} ${state.places.unit} of ${measuredText(high - low, 1)}`);
  planeView.canvas.setAttribute("aria-label", planeView.title);
}

function fit() {
  const shown = (shownTab === "plane" ? [planeView] : sliceViews).filter((view) => view.isShown);
  if (shown.length === 0) return;
  state.isFitted = true;
  state.zoom = Math.min(...shown.map((view) => view.fittingZoom()));
  for (const view of sliceViews) {
    const { dims } = state.volume;
    view.center = [dims[view.across] / 2, dims[view.down] / 2];
  }
  planeView.center = state.volume.dims.map((n) => n / 2);
}

// ---- What the input does -------------------------------------------------------------------------------------------

// Degrees by which a pixel of a drag in its own picture turns the oblique plane.
const dragDegrees = 0.3;
const actions = {
  /** The cross hair at a sample, or the sample at a place; in an oblique plane, `through` is the place itself. */
  moveTo(position, through) {
    const { dims } = state.volume;
    const within = position.map((p, axis) => Math.min(Math.max(Math.floor(p), 0), dims[axis] - 1));
    for (const view of allViews()) if (within[view.normal] !== state.position[view.normal]) view.changed();
    const isMoved = within.some((p, axis) => p !== state.position[axis]);
    state.position = within;
    if (through) state.plane = { ...state.plane, through };
    else if (isMoved) {
      state.plane = { ...state.plane, through: within.map((p) => p + 0.5) };
      planeView.changed();
    }
    measuring.follow([...sliceViews, planeView]);
    announcePlace();
    // Follows the cross hair where it leaves the canvas.
    for (const view of sliceViews) {
      if (!view.isShown || state.isFitted) continue;
      const [x, y] = view.pointOf([within[view.across] + 0.5, within[view.down] + 0.5]);
      const { clientWidth: width, clientHeight: height } = view.canvas;
      const out = (p, size) => (p < 0 ? -p : p > size ? size - p : 0);
      if (out(x, width) || out(y, height)) view.pan(out(x, width), out(y, height));
    }
    update();
  },
  /** The cross hair at a point of a view. */
  moveIn(view, point) {
    const place = view.spaceAt(...point);
    actions.moveTo(place, view.isPlane && place);
  },
  /** The cross hair some samples to the right (0), down (1), or across the slice or plane (2). */
  go(view, way, count) {
    if (!view.isPlane) return actions.step([view.across, view.down, view.normal][way], [...view.signs, 1][way] * count);
    const place = view.along(way, count);
    if (way === 2) view.changed();
    actions.moveTo(place, place);
  },
  step(axis, count) {
    const position = [...state.position];
    position[axis] += count;
    actions.moveTo(position);
  },
  zoom(view, factor, x = view.canvas.clientWidth / 2, y = view.canvas.clientHeight / 2) {
    state.isFitted = false;
    const { dims } = state.volume;
    const least = view.fittingZoom() / 8;
    const most = 100 / Math.min(...state.steps);
    const cross = (other) => other.pointIn(other.cross);
    const others = [...sliceViews, planeView].filter((other) => other.name !== view.name).map((other) => [other, cross(other)]);
    view.zoomAround(x, y, () => {
      state.zoom = Math.min(Math.max(state.zoom * factor, Math.min(least, most)), most);
    });
    // In the others, the cross hair stays where it is.
    for (const [other, before] of others) {
      const after = cross(other);
      other.pan(before[0] - after[0], before[1] - after[1]);
    }
    update();
  },
  pan(view, dx, dy) {
    state.isFitted = false;
    view.pan(dx, dy);
    update();
  },
  window: (low, high) => displayWindow.set(low, high),
  /** The level by a share of the width, and the width by a factor. */
  changeWindow(levelShare, widthFactor) {
    const { low, high } = state.shades;
    const width = high - low;
    const level = (low + high) / 2 + levelShare * width;
    actions.window(level - (width * widthFactor) / 2, level + (width * widthFactor) / 2);
  },
  autoWindow() {
    displayWindow.choose(coarsestSlices());
    update();
  },
  preset(count) {
    presets.step(count);
    const { low, high } = state.shades;
    announcer.say(() => `window ${element("preset").value}: ${numberText(low, 6)} to ${numberText(high, 6)} ${state.scale.unit}`.trim());
  },
  compare: () => comparisonPanel.toggle(),
  slab() {
    slabPanel.step();
    announcePlace();
  },
  thicken(view, count) {
    slabPanel.thicken(count, view.normal);
    announcePlace();
  },
  /** What a drag changes, and a way back: the first finger of a pinch may have moved. */
  remember: () => ({
    position: state.position,
    zoom: state.zoom,
    isFitted: state.isFitted,
    plane: state.plane,
    planeCenter: planeView.center,
    centers: sliceViews.map(({ center }) => center),
    low: state.shades.low,
    high: state.shades.high,
  }),
  restore({ low, high, centers, planeCenter, ...shown }) {
    Object.assign(state, shown);
    planeView.center = planeCenter;
    planePanel.update();
    planeView.changed();
    for (const [i, view] of sliceViews.entries()) {
      view.center = centers[i];
      view.changed();
    }
    if (low !== state.shades.low || high !== state.shades.high) displayWindow.set(low, high);
    update();
  },
  fit() {
    state.isFitted = true;
    for (const view of [...allViews(), planeView]) view.changed();
    update();
  },
  /** Shows the oblique plane, or hides it. */
  plane: () => planePanel.toggle(),
  /** Turns it by degrees of one of its angles. */
  turn: (name, degrees) => planePanel.turn(name, degrees),
  /** A drag in a view turns the plane that was `before`: its line, or in its own picture, the picture as a whole. */
  tilt(view, before, from, to) {
    if (!view.isPlane) return planePanel.set({ ...turnedByDrag(view, state, before, from, to), through: state.plane.through, isShown: true });
    const [right, down] = frameOf(before, planeView.steps, state.places.axes);
    const [dx, dy] = to.map((n, i) => n - from[i]);
    // About the line in the picture that lies across the drag.
    const length = Math.hypot(dx, dy) || 1;
    const axis = right.map((n, i) => (-dy * n + dx * down[i]) / length);
    planePanel.set(turnedAbout(before, axis, length * dragDegrees, planeView.steps, state.places.axes));
  },
  colors: () => materialsPanel.toggle(),
  grid() {
    state.showsGrid = !state.showsGrid;
    element("grid").setAttribute("aria-pressed", String(state.showsGrid));
    update();
  },
  /** Saves a picture of the view that has the focus, and of what it is compared with. */
  async picture() {
    try {
      if (shownTab === "space") {
        const { kind, map, crop } = state.space;
        const box = crop && `samples from ${crop.low.join(", ")} to ${crop.high.map((n) => n - 1).join(", ")}`;
        const colors = map !== "grey" && `colors: ${map}`;
        const lines = [
          state.name,
          "in 3D, with a precision of 11 bits: not for measuring",
          [kind === "surface" && `surface of ${numberText(spaceView.level, 6)} ${state.scale.unit}`.trim(), colors, box].filter(Boolean).join(" · "),
        ];
        return await save(composed([{ canvas: spaceView.canvas, lines }]), `${state.name}-3D`);
      }
      const { name } = activeView();
      const views = [...allViews(), planeView].filter((view) => view.name === name);
      for (const view of views) view.draw();
      const pictures = views.map((view, i) => ({ canvas: view.canvas, lines: captionOf(view, i === 0 ? state : second) }));
      const which = views[0].isPlane ? views[0].title : `${views[0].label}-${state.position[views[0].normal] + 1}`;
      await save(composed(pictures), `${state.name}-${which}`);
    } catch (error) {
      say(`The picture could not be saved: ${error.message}`, true);
    }
  },
  measuring,
  tool(name) {
    if (name !== state.tool) measuring.leave();
    state.tool = name;
    if (name === "tilt" && state.volume && !state.plane.isShown) planePanel.toggle();
    for (const button of document.querySelectorAll("[data-tool]"))
      button.setAttribute("aria-pressed", String(button.dataset.tool === name));
  },
  one(name) {
    showTab(shownTab === name ? "all" : name);
  },
  point(view, x, y) {
    pointed = view && { view, x, y };
    showReadout();
  },
};

/** The samples of the slices of the coarsest overview that are there. */
function coarsestSlices() {
  const level = state.volume.levels.length - 1;
  return sliceViews.flatMap((view) => state.tiles.ofSlice(level, view.normal, view.sliceAt(level)));
}

// ---- Readout -------------------------------------------------------------------------------------------------------

let pointed;
function showReadout() {
  if (!state.volume) return;
  if (pointed?.view.isPlane || (!pointed && shownTab === "plane"))
    return fillList(element("readout"), planeRows(state, pointed ? planeView.placeAt(pointed.x, pointed.y) : planeView.cross, planeView));
  const place = [...state.position];
  if (pointed) {
    const { view } = pointed;
    const [across, down] = view.placeAt(pointed.x, pointed.y).map(Math.floor);
    [place[view.across], place[view.down]] = [across, down];
  }
  const view = pointed?.view ?? sliceViews.find((one) => one.isShown) ?? sliceViews[0];
  const alike = (views) => views.find(({ name }) => name === view.name);
  fillList(element("readout"), [...readoutRows(state, place, alike(sliceViews)), ...secondRows(place, alike(secondViews))]);
}

/** Tells screen readers the slice and the values at the cross hair. */
function announcePlace() {
  announcer.say(() => {
    const { name, normal, title, isPlane } = activeView();
    if (isPlane) {
      const rows = planeRows(state, planeView.cross, planeView);
      return rows.some(([, text]) => text === "…") ? undefined : `${title}: ${inWords(rows)}`;
    }
    const views = allViews().filter((view) => view.name === name);
    const rows = [...readoutRows(state, state.position, views[0]), ...(views[1] ? secondRows(state.position, views[1]) : [])];
    if (rows.some(([, text]) => text === "…")) return undefined;
    return `${title} slice ${state.position[normal] + 1} of ${state.volume.dims[normal]}: ${inWords(rows)}`;
  });
}

/** Rows of the readout, the values first. */
function inWords(rows) {
  const isPlace = ([row]) => row === "sample" || row.startsWith("position") || row.startsWith("place");
  return [...rows.filter((row) => !isPlace(row)), ...rows.filter(isPlace)].map((row) => row.join(" ").trim()).join("; ");
}

/** Tells them how the oblique plane lies now, and the value at the cross hair. */
function announcePlane() {
  announcer.say(() => {
    const rows = planeView.isShown ? planeRows(state, planeView.cross, planeView) : [];
    return rows.some(([, text]) => text === "…") ? undefined : [planeView.title, inWords(rows)].filter(Boolean).join(": ");
  });
}

/** Tells them what the measure that was made or moved says. */
function announceMeasure() {
  const measure = state.chosenMeasure;
  if (!measure || !measuring.isDone(measure)) return;
  announcer.say(() => {
    const title = measuresPanel.titleOf(measure);
    return title.includes("…") ? undefined : title;
  });
}

/** What the second views show there. */
function secondRows(place, view) {
  if (!second.volume) return [];
  return readoutRows(second, place, view)
    .filter(([name]) => !/^(sample|position)/.test(name))
    .map(([name, text]) => (second.isDifference && name === "value" ? ["difference", text] : [name && `second: ${name}`, text]));
}

// ---- Files ---------------------------------------------------------------------------------------------------------

// What was opened: an address as it was given, or nothing for a file of this machine.
let address;
let opening;
let shownVolume; // its number, as the list of volumes has it
async function openFile(source, name, from, shown = {}) {
  opening?.abort();
  const controller = new AbortController();
  opening = controller;
  times.start = performance.now();
  for (const key of ["open", "first", "all", "complete"]) delete times[key];
  element("failure").textContent = "";
  say(`Opening ${name} …`);
  try {
    const opened = await open(source, {
      base: decoderBase,
      signal: controller.signal,
    });
    if (controller.signal.aborted) return opened.close();
    // A link may be to another volume than the first one.
    const number = shown.volume < opened.volumes ? shown.volume : 0;
    const volume = number === 0 ? opened : await opened.volume(number);
    if (controller.signal.aborted) return opened.close();
    file?.close();
    file = opened;
    address = from;
    times.open = performance.now();
    element("welcome").hidden = true;
    element("name").textContent = name;
    element("name").title = name;
    document.title = `${name} – tagrid viewer`;
    element("volume-choice").hidden = file.volumes === 1;
    element("volume").replaceChildren(
      ...Array.from(
        { length: file.volumes },
        (_, i) => new Option(`${i + 1} of ${file.volumes} (number ${i})`, String(i)),
      ),
    );
    shownVolume = element("volume").value = String(number);
    state.name = name;
    show(volume);
    showLink(shown);
  } catch (error) {
    if (controller.signal.aborted) return;
    const text = `${name}: ${error.message}`;
    element("failure").textContent = text;
    say(text, true);
  }
}

/** Servers and networks that fail may answer again. */
function retryLater(volume) {
  clearTimeout(retryTimer);
  retryTimer = setTimeout(() => {
    if (state.volume !== volume) return;
    failure = undefined;
    state.tiles.retry();
    state.labels?.tiles.retry();
    planeView.retry();
    comparisonPanel.file?.tiles.retry();
    update();
  }, retryAfter);
}

/** The tiles of a volume, whose errors are told while it is shown. */
function tilesOf(volume, isShown, like = volume) {
  return new Tiles(
    volume,
    () => update(),
    (error) => {
      if (!isShown()) return;
      failure = error.message;
      if (error.code === "io-error") retryLater(state.volume);
    },
    like,
  );
}

/** Another volume is shown in a view. */
function resetView(view) {
  const { center } = view;
  view.reset();
  // A second view has the place of the first.
  const isSecond = secondViews.includes(view);
  if (isSecond) view.center = center;
  const of = isSecond ? `, ${second.name}` : "";
  view.canvas.setAttribute("aria-label", `${view.title} slice${of}`);
  view.slider.setAttribute("aria-label", `number of the ${view.title} slice${of}`);
}

/** Shows a volume. One of the same file as the one before keeps its place, and the window `before`. */
function show(volume, before) {
  state.tiles?.close();
  // Until it is known whether it can be compared with this one.
  second.volume = undefined;
  failure = undefined;
  state.volume = volume;
  state.tiles = tilesOf(volume, () => state.volume === volume);
  state.scale = scaleOf(volume);
  state.places = placesOf(volume);
  state.steps = state.places.steps;
  state.shades = new Shades(state.scale);
  if (!before) {
    state.position = volume.dims.map((n) => Math.floor(n / 2));
    state.plane = { ...state.plane, through: state.position.map((p) => p + 0.5) };
  }
  state.isFitted = true;
  presets.reset();
  displayWindow.start(before);
  for (const view of sliceViews) {
    resetView(view);
    document.querySelector(`[data-tab=${view.name}]`).textContent = view.label;
  }
  fillList(element("bounds"), boundRows(volume, state.scale));
  fillList(element("facts"), factRows(volume, state.scale, state.places));
  element("metadata").textContent = volume.metadata;
  planeView.reset();
  planePanel.update();
  if (!before) state.space.crop = undefined;
  spacePanel.update();
  spaceView.reset();
  // Volumes of a file lie at one place.
  slabPanel.update();
  regionReader.reset();
  if (!before) measuring.reset();
  regionReader.update();
  measuresPanel.update();
  materialsPanel.apply();
  comparisonPanel.apply();
}

element("volume").addEventListener("change", async ({ target }) => {
  const [of, chosen] = [file, target.value];
  // Another one may have been chosen since, or another file.
  const isStillChosen = () => file === of && target.value === chosen;
  try {
    const volume = await of.volume(Number(chosen));
    if (!isStillChosen()) return;
    shownVolume = chosen;
    show(volume, state.shades);
  } catch (error) {
    if (!isStillChosen()) return;
    target.value = shownVolume;
    failure = error.message;
    draw();
  }
});
element("file").addEventListener("change", ({ target }) => {
  if (target.files[0]) openFile(target.files[0], target.files[0].name);
});
element("address").addEventListener("submit", (event) => {
  event.preventDefault();
  openAddress(new FormData(event.target).get("src"));
});
addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dropping");
});
addEventListener("dragleave", () => document.body.classList.remove("dropping"));
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  const dropped = event.dataTransfer.files[0];
  if (dropped) openFile(dropped, dropped.name);
});

function openAddress(text, shown) {
  try {
    const url = addressOf(text);
    openFile(url, nameIn(url), text, shown);
  } catch (error) {
    element("failure").textContent = error.message;
  }
}

// ---- Links ---------------------------------------------------------------------------------------------------------

/** Shows what a link says of the file that is open; see link.js. */
function showLink(shown) {
  const { position, window, zoom, centers, view, slab, plane, space, level, measures, showsGrid, end } = shown;
  const { dims } = state.volume;
  const isIn = (place) => place.every((p, axis) => p >= 0 && p <= dims[axis]);
  const isPlane = plane && isIn(plane.through);
  if (isPlane) state.plane = plane;
  planePanel.update();
  if (view || isPlane) showTab(view ?? shownTab);
  if (slab) slabPanel.set(slab);
  if (space) Object.assign(state.space, space);
  if (space || level !== undefined) spaceView.show(level);
  if (showsGrid && !state.showsGrid) actions.grid();
  if (end) comparisonPanel.setEnd(end);
  if (measures) {
    const isWithin = ({ normal, slice, plane: other, points }) => (other ? isIn(other.through) : slice < dims[normal]) && points.every(isIn);
    measuring.reset();
    measuring.add(measures.filter(isWithin));
  }
  if (position) actions.moveTo(position, isPlane && plane.through);
  if (zoom && centers) {
    state.isFitted = false;
    state.zoom = zoom;
    for (const [i, one] of sliceViews.entries()) {
      one.center = centers[i];
      one.pan(0, 0);
    }
  }
  if (window) displayWindow.set(...window);
  update();
}

// Milliseconds: browsers allow an address to change some times a second.
const linkPause = 300;
let linkTimer;
/** Keeps the address of the page a link to what is shown. */
function keepLink() {
  clearTimeout(linkTimer);
  linkTimer = setTimeout(() => {
    if (!state.volume) return;
    const url = new URL(location.href);
    if (address === undefined) {
      // No link leads to a file of this machine.
      history.replaceState(null, "", url.pathname);
      return;
    }
    const put = (key, value) => (value === undefined ? url.searchParams.delete(key) : url.searchParams.set(key, value));
    put("src", address);
    const { materials: values, hasLabels } = materialsPanel.link;
    put("materials", values);
    if (!hasLabels) for (const key of ["labels", "label-volume"]) put(key, undefined);
    put("compare", comparisonPanel.link?.address);
    put("compare-by", comparisonPanel.link?.kind === "difference" ? "difference" : undefined);
    url.hash = linkOf({
      ...state,
      level: spaceView.isLevelChosen ? spaceView.level : undefined,
      window: displayWindow.isChosen ? [state.shades.low, state.shades.high] : undefined,
      zoom: state.isFitted ? undefined : state.zoom,
      centers: sliceViews.map(({ center }) => center),
      view: shownTab,
      volume: Number(shownVolume),
      measures: state.measures.filter((measure) => measuring.isDone(measure)),
      end: comparisonPanel.end,
    });
    if (url.href !== location.href) history.replaceState(null, "", url);
  }, linkPause);
}
addEventListener("hashchange", () => state.volume && showLink(shownBy(location.hash)));

// ---- Controls ------------------------------------------------------------------------------------------------------

let shownTab;
const isSmall = matchMedia("(max-width: 720px), (max-height: 480px)");
function showTab(name) {
  if (name === "plane" && !state.plane.isShown) {
    state.plane = { ...state.plane, isShown: true };
    planePanel.update();
  }
  shownTab = name;
  const isCompared = Boolean(second.volume) && name !== "space" && name !== "plane";
  element("views").classList.toggle("single", name !== "all");
  element("views").classList.toggle("compared", isCompared);
  for (const [view, section] of Object.entries(sections)) section.hidden = name !== "all" && name !== view;
  // Where all are shown, there is room for one of these; next to a second file, for none.
  if (name === "all") sections[state.plane.isShown ? "space" : "plane"].hidden = true;
  if (isCompared) sections.space.hidden = sections.plane.hidden = true;
  element("space-use").hidden = sections.space.hidden;
  for (const view of [...sliceViews, ...secondViews]) view.isCompared = isCompared;
  for (const view of secondViews) view.section.hidden = !isCompared || (name !== "all" && name !== view.name);
  for (const button of document.querySelectorAll("[data-tab]"))
    button.setAttribute("aria-pressed", String(button.dataset.tab === name));
  for (const view of [...allViews(), planeView]) view.changed();
  update();
}
for (const button of document.querySelectorAll("[data-tab]"))
  button.addEventListener("click", () => showTab(button.dataset.tab));
for (const button of document.querySelectorAll("[data-tool]"))
  button.addEventListener("click", () => actions.tool(button.dataset.tool));
const activeView = () =>
  [...allViews(), planeView].find((view) => view.canvas === document.activeElement) ??
  [...sliceViews, planeView].find((view) => view.isShown) ??
  sliceViews[0];
element("auto").addEventListener("click", () => state.volume && actions.autoWindow());
element("grid").addEventListener("click", () => state.volume && actions.grid());
element("picture").addEventListener("click", () => state.volume && actions.picture());
element("fit").addEventListener("click", () => state.volume && actions.fit());
element("zoom-in").addEventListener("click", () => state.volume && actions.zoom(activeView(), 1.5));
element("zoom-out").addEventListener("click", () => state.volume && actions.zoom(activeView(), 1 / 1.5));
for (const view of [...sliceViews, ...secondViews, planeView]) handlePointers(view, state, actions);
handleKeys(state, actions, activeView);
new ResizeObserver(() => {
  for (const view of [...allViews(), planeView]) view.changed();
  update();
}).observe(element("views"));

globalThis.tagridViewer = {
  state, second, sliceViews, secondViews, planeView, spaceView, materialsPanel, comparisonPanel, regionReader, actions, times,
};
showTab(isSmall.matches ? "axial" : "all");
const given = new URLSearchParams(location.search);
const [source, materials, labels, labelVolume, compared, compareBy] = [
  "src", "materials", "labels", "label-volume", "compare", "compare-by",
].map((key) => given.get(key));
if (source) {
  element("welcome").hidden = false;
  openAddress(source, shownBy(location.hash));
}
materialsPanel.start({ materials, labels, labelVolume });
if (compared !== null)
  comparisonPanel.open(() => addressOf(compared), nameOf(compared), compareBy === "difference" ? "difference" : "beside", compared);
