// What a volume means, in words and numbers.
import { numberText, valueText } from "./numbers.js";
import { lettersOf } from "./sides.js";

/**
 * Values are `slope * sample + intercept`. With slopes of single slices, pictures and windows are of samples, and
 * `ofSlice(z)` is what a sample of the volume itself means.
 */
export function scaleOf(volume) {
  const [slopes, intercepts] = ["slice_slopes", "slice_intercepts"].map((key) =>
    volume
      .pair(key)
      ?.split(/[\s;,]+/)
      .map(Number),
  );
  if (slopes !== undefined) {
    const ofSlice = (z) => ({ slope: slopes[z], intercept: intercepts?.[z] ?? 0 });
    const isWhole =
      slopes.length === volume.dims[2] && slopes.every(Number.isFinite) && (intercepts ?? []).every(Number.isFinite);
    const note = "stored samples: each slice has its own slope, so equal grays are not equal values";
    const largestSlope = isWhole ? Math.max(...slopes.map(Math.abs)) : undefined;
    return { slope: 1, intercept: 0, unit: "", note, largestSlope, ofSlice: isWhole ? ofSlice : undefined };
  }
  const slope = Number(volume.pair("rescale_slope") ?? 1);
  const intercept = Number(volume.pair("rescale_intercept") ?? 0);
  if (!Number.isFinite(slope) || slope === 0 || !Number.isFinite(intercept))
    return { slope: 1, intercept: 0, unit: "" };
  return { slope, intercept, unit: volume.pair("rescale_units") ?? "" };
}

export function bytesText(bytes) {
  const units = ["bytes", "kB", "MB", "GB", "TB"];
  const power = Math.min(Math.floor(Math.log10(Math.max(bytes, 1)) / 3), 4);
  return `${numberText(bytes / 1000 ** power, 3)} ${units[power]}`;
}

/**
 * An error of samples, in values. With slopes of single slices, it differs by slice: then it is in stored samples, with the
 * largest one in values, as the program says it.
 */
function errorText(samples, { slope, unit, note, largestSlope }, digits) {
  if (!note) return `${numberText(samples * Math.abs(slope), digits)} ${unit}`.trim();
  const inValues = largestSlope === undefined ? "" : ` (at most ${numberText(samples * largestSlope, 6)} in values)`;
  return `${numberText(samples, digits)} in stored samples${samples > 0 ? inValues : ""}`;
}

/** Rows of [name, text]. */
export function boundRows({ bounds }, scale) {
  const rows = [];
  const add = (name, samples, digits) => {
    if (samples !== null) rows.push([name, errorText(samples, scale, digits)]);
  };
  if (bounds.maxError === 0) rows.push(["every voxel", "exact"]);
  else add("largest error allowed", bounds.maxError);
  if (bounds.maxError === null) rows.push(["every voxel", "no bound"]);
  add("… of the grid's points", bounds.surfaceError);
  add("… of the mesh", bounds.meshError);
  if (bounds.maxError !== 0) {
    add("largest error found", bounds.achievedMaxError);
    add("root mean square error", bounds.achievedRmse, 4);
    if (Number.isFinite(bounds.achievedPsnr)) rows.push(["PSNR", `${numberText(bounds.achievedPsnr, 4)} dB`]);
  }
  return rows;
}

/** The bound of the samples that are shown, in few words; "" if they are exact. */
export function lossText({ bounds }, scale) {
  if (bounds.maxError === 0) return "";
  if (bounds.maxError === null) return "lossy: errors have no bound";
  return `lossy: errors up to ${errorText(bounds.maxError, scale)}`;
}

/** What errors mean for statistics of samples, in a sentence. */
export function boundSentence({ bounds }, scale) {
  if (bounds.maxError === 0) return "The samples are exact.";
  if (bounds.maxError === null) return "The file is lossy, and its errors have no bound.";
  return (
    `The file is lossy, with errors up to ${errorText(bounds.maxError, scale)}: so far may the mean, the deviation, ` +
    "the lowest and the highest value be from those of the original."
  );
}

export function factRows(volume, scale, { unit, hasUnit, steps, axes, notes }) {
  const { dims, type, geometry, levels, range, name, fileBytes, brickEdge, volumes } = volume;
  const product = dims[0] * dims[1] * dims[2];
  const size = Number(/\d+/.exec(type)[0]) / 8;
  const rows = [
    ["size", `${dims.join(" × ")}`],
    ["type", type],
  ];
  if (name) rows.unshift(["name", name]);
  if (geometry.spacing)
    rows.push(["spacing", `${steps.map((s) => numberText(s)).join(" × ")} ${hasUnit ? unit : "(no unit given)"}`]);
  const space = volume.field("space");
  if (space) rows.push(["space of positions", space]);
  if (axes) rows.push(["x, y, z run toward", axes.map(lettersOf).join(", ")]);
  for (const note of notes) rows.push(["note", note]);
  if (volume.pair("dicom_PhotometricInterpretation")?.trim() === "MONOCHROME1")
    rows.push(["note", "low values mean white in the source (MONOCHROME1), but are drawn black"]);
  if (geometry.origin) rows.push(["origin", geometry.origin.map((o) => numberText(o)).join(", ")]);
  if (range) {
    const ends = [range.low, range.high].sort((a, b) => scale.slope * (a - b));
    rows.push([scale.note ? "stored samples" : "values", `${ends.map((sample) => valueText(sample, type, scale)).join(" to ")} ${scale.unit}`]);
    rows.push([scale.note ? "mean of stored samples" : "mean", `${numberText(scale.slope * range.mean + scale.intercept, 9)} ${scale.unit}`]);
  }
  if (scale.note) rows.push(["pictures show", scale.note]);
  else if (scale.slope !== 1 || scale.intercept !== 0)
    rows.push([
      "value of a sample",
      `${numberText(scale.slope)} · sample ${scale.intercept < 0 ? "−" : "+"} ${numberText(Math.abs(scale.intercept))}`,
    ]);
  rows.push(["file", bytesText(fileBytes)]);
  if (volumes === 1) rows.push(["of uncompressed", `1 : ${numberText((product * size) / fileBytes, 3)}`]);
  if (levels.length > 1)
    rows.push([
      "overviews",
      levels
        .slice(1)
        .map(({ factor }) => `1:${factor}`)
        .join(", "),
    ]);
  rows.push(["brick", `${brickEdge} × ${brickEdge} × ${brickEdge}`]);
  return rows;
}

/** Shows rows of [name, text]. It changes the elements that are there: new ones for each move would be much garbage. */
export function fillList(list, rows) {
  const texts = rows.flat();
  while (list.childElementCount > texts.length) list.lastElementChild.remove();
  for (const [i, text] of texts.entries()) {
    const element = list.children[i] ?? list.appendChild(document.createElement(i % 2 === 0 ? "dt" : "dd"));
    if (element.firstChild) element.firstChild.data = text;
    else element.textContent = text;
  }
}
