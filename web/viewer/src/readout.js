// The sample under the pointer, or under the cross hair.
import { positionTexts } from "./places.js";
import { numberText, sampleText, valueText } from "./numbers.js";
import { planes } from "./tiles.js";

/** Rows of [name, text] for a place, in samples, in the slices that `view` shows. */
export function readoutRows(state, place, view) {
  const { volume, tiles, scale, places } = state;
  const { normal, slab } = view;
  if (place.some((p, axis) => p < 0 || p >= volume.dims[axis])) return [["sample", "outside"]];
  const rows = [["sample", place.join(", ")]];
  const position = positionTexts(volume, places, place);
  if (position) rows.push([`position (${places.unit})`, position.join(", ")]);
  const found = sampleAt(tiles, place, normal, volume.levels, (level) => view.sliceAt(level));
  const name = slab ? `${slab.kind} of ${slab.end - slab.begin} slices` : "value";
  if (!found) {
    const missing = missingText(tiles, place, normal, view.sliceAt(0));
    return [...rows, [name, missing], ...(slab ? [] : labelRows(state, place, normal))];
  }
  // A mean of slices with different slopes has no value.
  const meaning = !scale.note ? scale : found.factor === 1 ? scale.ofSlice?.(place[2]) : undefined;
  if (meaning) {
    // Without the noise of sums and differences of doubles.
    const value = slab?.kind === "mean" || state.isDifference
      ? numberText(meaning.slope * found.sample + meaning.intercept, 12)
      : valueText(found.sample, volume.type, meaning);
    rows.push([name, `${value} ${scale.unit}`]);
  }
  if (!slab && (scale.note || scale.slope !== 1 || scale.intercept !== 0))
    rows.push(["stored sample", sampleText(found.sample, volume.type)]);
  if (state.showsColors && state.colors?.areOfValues)
    rows.push(["material", state.colors.materialOf(found.sample)?.name ?? "none"]);
  if (found.factor > 1) rows.push(["", `${slab ? "of means" : "mean"} in overview 1:${found.factor}`]);
  return slab ? rows : [...rows, ...labelRows(state, place, normal)];
}

/** Rows for a place of a plane, in which sample i reaches from i to i + 1; `view` is a PlaneView. */
export function planeRows({ volume, scale, places }, place, view) {
  if (place.some((p, axis) => p < 0 || p > volume.dims[axis])) return [["place (samples)", "outside"]];
  // As positions of samples are counted: the first one is at 0.
  const at = place.map((p) => p - 0.5);
  const rows = [["place (samples)", at.map((p) => numberText(Math.round(p * 100) / 100 + 0)).join(", ")]];
  // To a hundredth of a step.
  const position = positionTexts(volume, places, at, Math.min(...places.steps) * 1e5);
  if (position) rows.push([`position (${places.unit})`, position.join(", ")]);
  const found = view.sampleAt(place);
  if (!found) return [...rows, ["value", "…"]];
  // Between slices with slopes of their own, there is no value.
  if (!scale.note) rows.push(["value", `${numberText(scale.slope * found.between + scale.intercept, 6)} ${scale.unit}`]);
  if (found.factor > 1) return [...rows, ["", `mean in overview 1:${found.factor}`]];
  const nearest = place.map((p, axis) => Math.min(Math.floor(p), volume.dims[axis] - 1));
  const meaning = scale.note ? scale.ofSlice?.(nearest[2]) : scale;
  rows.push(["nearest sample", nearest.join(", ")]);
  if (meaning) rows.push(["its value", `${valueText(found.nearest, volume.type, meaning)} ${scale.unit}`]);
  return rows;
}

/** The label there: means in overviews are none. */
function labelRows({ labels, colors, showsColors }, place, normal) {
  if (!showsColors || !labels) return [];
  const { volume, tiles } = labels;
  const found = sampleAt(tiles, place, normal, volume.levels.slice(0, 1), () => place[normal]);
  if (!found) return [["label", missingText(tiles, place, normal, place[normal])]];
  return [
    ["label", String(found.sample)],
    ["material", colors.materialOf(found.sample)?.name ?? "none"],
  ];
}

/** The sample of the first of some levels that is there; `sliceAt(level)` is its slice. */
function sampleAt(tiles, place, normal, levels, sliceAt) {
  const { across, down } = planes[normal];
  for (const { level, factor } of levels) {
    const [i, j] = [place[across], place[down]].map((p) => Math.floor(p / factor));
    const slice = sliceAt(level);
    const [column, row] = [tiles.number(i), tiles.number(j)];
    const samples = tiles.get(level, normal, slice, column, row);
    if (!samples) continue;
    const [x0, x1] = tiles.range(level, across, column);
    return { sample: samples[(j - tiles.range(level, down, row)[0]) * (x1 - x0) + i - x0], factor };
  }
  return undefined;
}

function missingText(tiles, place, normal, slice) {
  const [columns, rows] = [planes[normal].across, planes[normal].down].map((axis) => [
    tiles.number(place[axis]),
    tiles.number(place[axis]) + 1,
  ]);
  const isUnreadable = tiles.failedBoxes({ level: 0, normal, slice, columns, rows }).length > 0;
  return isUnreadable ? "cannot be read" : "…";
}
