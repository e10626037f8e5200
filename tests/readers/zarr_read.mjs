// Reads an array of a Zarr store with zarrita.js, and what ome-zarr.js makes of the group around it:
//   node zarr_read.mjs STORE ARRAY SAMPLES
// Writes the samples, in C order, into the file SAMPLES, and what else is known to the standard output, as JSON.
import * as fs from "node:fs";
import * as path from "node:path";
import * as zarr from "zarrita";
import FileSystemStore from "@zarrita/storage/fs";
import ZipFileStore from "@zarrita/storage/zip";

const [, , place, name, out] = process.argv;
const store = place.startsWith("http://")
  ? new zarr.FetchStore(place)
  : fs.statSync(place).isDirectory()
  ? new FileSystemStore(path.resolve(place))
  : ZipFileStore.fromBlob(new Blob([fs.readFileSync(place)]));
const group = await zarr.open.v3(zarr.root(store), { kind: "group" });
const array = await zarr.open.v3(zarr.root(store).resolve(name), { kind: "array" });
const { data, shape } = await zarr.get(array);
fs.writeFileSync(out, new Uint8Array(data.buffer, data.byteOffset, data.byteLength));

/** What ome-zarr.js shows, which reads with a zarrita of its own: the first slice of the first chunk, in grey. */
async function shown() {
  const omezarr = await import("ome-zarr.js").catch(() => undefined);
  if (!omezarr || !/^\/\d$/.test(name)) return null;
  const number = Number(name.slice(1));
  const { arr, scales, multiscale, zarr_version } = await omezarr.getMultiscaleWithArray(store, number);
  const { data: chunk, shape: box } = await arr.getChunk(arr.shape.map(() => 0));
  const plane = { data: chunk.slice(0, box[1] * box[2]), shape: box.slice(1), stride: [box[2], 1] };
  const ends = omezarr.getMinMaxValues(plane);
  const pixels = omezarr.renderTo8bitArray([plane], [ends], [[255, 255, 255]], undefined, undefined, false);
  return { version: zarr_version, axes: multiscale.axes.map((axis) => axis.name), shape: arr.shape, scale: scales[number],
    width: box[2], height: box[1], ends, grey: [...pixels].filter((_, i) => i % 4 === 0) };
}

console.log(JSON.stringify({ shown: await shown(), attributes: group.attrs, type: array.dtype, shape, chunks: array.chunks, names: array.dimensionNames ?? null }));
