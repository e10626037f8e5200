// The lines of an NRRD header that describe the scan: docs/dev/format.md, 4.2.

const names = new Set(["content", "number", "block size", "min", "max", "old min", "old max", "sample units", "spacings",
  "thicknesses", "axis mins", "axis maxs", "centers", "labels", "units", "kinds", "space", "space dimension", "space units",
  "space origin", "space directions", "measurement frame"]);
const others = new Map([["centerings", "centers"]]);
for (const name of ["block size", "old min", "old max", "sample units", "axis mins", "axis maxs"])
  others.set(name.replace(" ", ""), name);

/** The fields, by their names in small letters, and the pairs. Of equal ones, the last counts. */
export function fieldsOf(metadata) {
  const [fields, pairs] = [new Map(), new Map()];
  for (const line of metadata.split("\n")) {
    if (line.startsWith("#")) continue;
    const [colon, sign] = [line.indexOf(":"), line.indexOf(":=")];
    const name = line.slice(0, Math.max(colon, 0)).toLowerCase();
    const field = others.get(name) ?? name;
    // A key may contain a colon, but not ":=".
    if (colon !== sign && names.has(field)) fields.set(field, line.slice(colon + 1).trim());
    else if (sign >= 0)
      pairs.set(line.slice(0, sign), line.slice(sign + 2).replace(/\\(n|\\)/g, (_, c) => (c === "n" ? "\n" : c)));
  }
  return { fields, pairs };
}
