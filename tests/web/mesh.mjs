// The mesh that the program writes, and where a plane cuts it.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { folder, tagrid } from "./files.mjs";

/** The complete root cubes of a file as { points, tetrahedra }: arrays of [x, y, z], and of four numbers of points. */
export function meshOf(path) {
  const mesh = join(folder, "mesh.msh");
  tagrid("mesh", path, "--padded", "-q", "-f", "-o", mesh);
  const bytes = readFileSync(mesh);
  let at = 0;
  const find = (name) => (at = bytes.indexOf(name, at) + name.length);
  const int = () => bytes.readInt32LE((at += 4) - 4);
  const size = () => Number(bytes.readBigUInt64LE((at += 8) - 8));
  const count = () => [size(), size(), size(), size(), int(), int(), int(), size()].at(-1);
  find("$Nodes\n");
  const tags = Array.from({ length: count() }, size);
  const points = new Map(tags.map((tag) => [tag, [0, 1, 2].map(() => bytes.readDoubleLE((at += 8) - 8))]));
  find("$Elements\n");
  const tetrahedra = Array.from({ length: count() }, () => [size(), size(), size(), size(), size()].slice(1));
  return { points, tetrahedra };
}

/** The edges where faces of the tetrahedra meet a plane, as sorted texts "u v u v". */
export function edgesOf({ points, tetrahedra }, axis, at) {
  const found = new Set();
  const others = [0, 1, 2].filter((a) => a !== axis);
  for (const tetrahedron of tetrahedra) {
    const sides = new Set(tetrahedron.map((tag) => Math.sign(points.get(tag)[axis] - at)));
    if (sides.size === 1) continue;
    for (const without of tetrahedron) {
      const [a, b, c] = tetrahedron.filter((tag) => tag !== without).map((tag) => points.get(tag));
      const met = [a, b, c].filter((p) => p[axis] === at);
      for (const [p, q] of [[a, b], [b, c], [c, a]])
        if ((p[axis] - at) * (q[axis] - at) < 0)
          met.push(p.map((x, i) => x + ((at - p[axis]) / (q[axis] - p[axis])) * (q[i] - x)));
      if (met.length === 2) found.add(edgeText(met.flatMap((p) => others.map((other) => p[other]))));
    }
  }
  return [...found].sort();
}

/** The same whichever end comes first. */
export function edgeText([a, b, c, d]) {
  return a < c || (a === c && b < d) ? `${a} ${b} ${c} ${d}` : `${c} ${d} ${a} ${b}`;
}
