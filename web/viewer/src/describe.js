// What a volume means, in words and numbers.

/** Values are `slope * sample + intercept`. With slopes of single slices, samples are all that is shown. */
export function scaleOf(volume) {
  if (volume.pair("slice_slopes") !== undefined)
    return { slope: 1, intercept: 0, unit: "", note: "samples: each slice has a slope of its own" };
  const slope = Number(volume.pair("rescale_slope") ?? 1);
  const intercept = Number(volume.pair("rescale_intercept") ?? 0);
  if (!Number.isFinite(slope) || slope === 0 || !Number.isFinite(intercept))
    return { slope: 1, intercept: 0, unit: "" };
  return { slope, intercept, unit: volume.pair("rescale_units") ?? "" };
}

/** The unit of lengths: that of the scan, or samples if it has no spacing. */
export function unitOf(volume) {
  if (!volume.geometry.spacing) return "samples";
  const given = /"([^"]+)"/.exec(volume.field(volume.geometry.directions ? "space units" : "units") ?? "");
  if (given) return given[1] === "um" ? "µm" : given[1];
  // Spaces of patients are in mm.
  return /left|right|LPS|RAS|LAS|scanner/i.test(volume.field("space") ?? "") ? "mm" : "units";
}

export function numberText(number, digits = 6) {
  return Number.isFinite(number) ? String(Number(number.toPrecision(digits))) : String(number);
}

export function bytesText(bytes) {
  const units = ["bytes", "kB", "MB", "GB", "TB"];
  const power = Math.min(Math.floor(Math.log10(Math.max(bytes, 1)) / 3), 4);
  return `${numberText(bytes / 1000 ** power, 3)} ${units[power]}`;
}

/** Rows of [name, text]. Bounds are in units of samples; here they are in those of values. */
export function boundRows({ bounds }, { slope, unit }) {
  const rows = [];
  const add = (name, samples) => {
    if (samples !== null) rows.push([name, `${numberText(samples * Math.abs(slope), 4)} ${unit}`]);
  };
  if (bounds.maxError === 0) rows.push(["every voxel", "exact"]);
  else add("largest error allowed", bounds.maxError);
  if (bounds.maxError === null) rows.push(["every voxel", "no bound"]);
  add("… of the grid's points", bounds.surfaceError);
  add("… of the mesh", bounds.meshError);
  if (bounds.maxError !== 0) {
    add("largest error found", bounds.achievedMaxError);
    add("root mean square error", bounds.achievedRmse);
    if (Number.isFinite(bounds.achievedPsnr)) rows.push(["PSNR", `${numberText(bounds.achievedPsnr, 4)} dB`]);
  }
  return rows;
}

export function factRows({ dims, type, geometry, levels, range, name, fileBytes, brickEdge, volumes }, scale, unit) {
  const product = dims[0] * dims[1] * dims[2];
  const size = Number(/\d+/.exec(type)[0]) / 8;
  const rows = [
    ["size", `${dims.join(" × ")}`],
    ["type", type],
  ];
  if (name) rows.unshift(["name", name]);
  if (geometry.spacing) rows.push(["spacing", `${geometry.spacing.map((s) => numberText(s, 4)).join(" × ")} ${unit}`]);
  if (geometry.origin) rows.push(["origin", geometry.origin.map((o) => numberText(o, 5)).join(", ")]);
  if (range) {
    const ends = [range.low, range.high].map((s) => scale.slope * s + scale.intercept).sort((a, b) => a - b);
    rows.push(["values", `${ends.map((v) => numberText(v, 5)).join(" to ")} ${scale.unit}`]);
    rows.push(["mean", `${numberText(scale.slope * range.mean + scale.intercept, 5)} ${scale.unit}`]);
  }
  if (scale.note) rows.push(["values", scale.note]);
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
