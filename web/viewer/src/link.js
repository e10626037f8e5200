// What is shown, as the part of an address behind "#", and back: a link that shows the same.
//
//   at=30,25,20              the cross hair, in samples
//   window=-160,240          the values of black and white
//   zoom=2.5                 pixels for a unit of length, unless the volume is fitted into the views
//   centers=1,2;3,4;5,6      the middles of the axial, coronal and sagittal view then, in samples
//   view=axial               the view that is shown alone
//   volume=1                 of several in the file
//   slab=mean,5,length       or 5,slices
//   plane=axial,30,0,0,35,30,25            an oblique plane: base, tilt, turn, spin, and a place in it, see plane.js
//   measures=ruler:z20:3.5,4,33.5,24;...   kind, slice, and points along the two axes of the slice; in an oblique plane, kind,
//                            plane, and places
//   space=fog,0.5            the kind of picture in 3D, and its opacity
//   level=300                the value of the surface there
//   map=viridis              the colors there
//   crop=10,20,30,60,50,40   the first sample that is drawn there along x, y and z, and the end along each
//   turn=0.5,0.35,1.15       angles there, around and up, in radians, and the zoom
//   grid=1                   the grid is shown
//   ends=6                   of the colors of a difference
import { kindsOfSlabs } from "./slab.js";
import { isFinished, pointsOf } from "./measures.js";
import { planeIn, planeNumbers } from "./plane.js";
import { spaceIn, spaceParts } from "./space.js";

const views = ["all", "axial", "coronal", "sagittal", "plane", "space"];
const mostMeasures = 1000;
// A thousandth of a sample is less than any screen shows.
const rounded = (number) => String(Math.round(number * 1000) / 1000);
// The same pixels.
const precise = (number) => Number(number.toPrecision(12));

const axesIn = (normal) => [0, 1, 2].filter((axis) => axis !== normal);

function measureText({ kind, normal, slice, plane, points }) {
  if (plane) return `${kind}:${planeNumbers(plane)}:${points.flat().map(rounded)}`;
  const numbers = points.flatMap((point) => axesIn(normal).map((axis) => rounded(point[axis])));
  return `${kind}:${"xyz"[normal]}${slice}:${numbers}`;
}

/** A text without "#". `shown` has what measureText and the list above need. */
export function linkOf({ position, window, zoom, centers, view, volume, slab, plane, space, level, colors, measures, showsGrid, end }) {
  const parts = [["at", position]];
  if (window) parts.push(["window", window]);
  if (zoom !== undefined) {
    parts.push(["zoom", precise(zoom)]);
    parts.push(["centers", centers.map((center) => center.map(precise)).join(";")]);
  }
  if (view !== "all") parts.push(["view", view]);
  if (volume > 0) parts.push(["volume", volume]);
  if (slab.kind !== "none") parts.push(["slab", [slab.kind, slab.thickness, slab.isInSlices ? "slices" : "length"]]);
  if (plane?.isShown) parts.push(["plane", planeNumbers(plane)]);
  if (measures.length > 0) parts.push(["measures", measures.map(measureText).join(";")]);
  if (space) parts.push(...spaceParts(space, level, Boolean(colors?.areOfValues)));
  if (showsGrid) parts.push(["grid", 1]);
  if (end !== undefined) parts.push(["ends", end]);
  return parts.map(([key, value]) => `${key}=${encodeURIComponent(String(value)).replaceAll(/%(2C|3A|3B)/g, decodeURIComponent)}`).join("&");
}

/** As many finite numbers as there are in a text, or nothing. */
function numbersIn(text, count) {
  const numbers = text?.split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
  return numbers?.length === count && numbers.every(Number.isFinite) ? numbers : undefined;
}

/** A measure in an oblique plane. */
function planeMeasureIn(text) {
  const [kind, planeText, points] = text.split(":");
  const plane = planeIn(planeText);
  const numbers = plane && isInPlanes(kind) && numbersIn(points, 3 * pointsOf[kind]);
  return numbers && { kind, plane, points: Array.from({ length: pointsOf[kind] }, (_, i) => numbers.slice(3 * i, 3 * i + 3)) };
}
const isInPlanes = (kind) => kind === "ruler" || kind === "angle";

function measureIn(text) {
  if (/^\w+:(axial|coronal|sagittal),/.test(text)) return planeMeasureIn(text);
  const [, kind, axis, slice, points] = /^(\w+):([xyz])(\d+):([-\d.,e+]+)$/.exec(text) ?? [];
  if (!Object.hasOwn(pointsOf, kind ?? "")) return undefined;
  const numbers = numbersIn(points, 2 * pointsOf[kind]);
  if (!numbers) return undefined;
  const normal = "xyz".indexOf(axis);
  const [u, v] = axesIn(normal);
  const places = Array.from({ length: pointsOf[kind] }, (_, i) => {
    const place = [0, 0, 0];
    [place[u], place[v], place[normal]] = [numbers[2 * i], numbers[2 * i + 1], Number(slice) + 0.5];
    return place;
  });
  return { kind, normal, slice: Number(slice), points: places };
}

/** What a text of linkOf() says; what is missing or wrong in it is undefined. */
export function shownBy(text) {
  const given = new Map(
    text
      .replace(/^#/, "")
      .split("&")
      .map((part) => [part.slice(0, Math.max(part.indexOf("="), 0)), part.slice(part.indexOf("=") + 1)]),
  );
  const get = (key) => {
    try {
      return given.has(key) ? decodeURIComponent(given.get(key)) : undefined;
    } catch {
      return undefined;
    }
  };
  const window = numbersIn(get("window"), 2);
  const [zoom] = numbersIn(get("zoom"), 1) ?? [];
  const centers = get("centers")?.split(";").map((center) => numbersIn(center, 2));
  const [volume] = numbersIn(get("volume"), 1) ?? [];
  const [end] = numbersIn(get("ends"), 1) ?? [];
  const [kind, thickness, unit] = get("slab")?.split(",") ?? [];
  const isSlab = kindsOfSlabs.includes(kind) && Number(thickness) > 0;
  const measures = get("measures")?.split(";").slice(0, mostMeasures).map(measureIn).filter((one) => one && isFinished(one));
  return {
    position: numbersIn(get("at"), 3),
    window: window?.[0] < window?.[1] ? window : undefined,
    zoom: zoom > 0 ? zoom : undefined,
    centers: centers?.length === 3 && centers.every(Boolean) ? centers : undefined,
    view: views.includes(get("view")) ? get("view") : undefined,
    volume: Number.isInteger(volume) && volume >= 0 ? volume : undefined,
    slab: isSlab ? { kind, thickness: Number(thickness), isInSlices: unit === "slices" } : undefined,
    plane: planeIn(get("plane")),
    space: spaceIn(get, (key, count) => numbersIn(get(key), count)),
    level: numbersIn(get("level"), 1)?.[0],
    measures,
    showsGrid: get("grid") === "1",
    end: end > 0 ? end : undefined,
  };
}
