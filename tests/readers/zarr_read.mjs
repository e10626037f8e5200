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
console.log(JSON.stringify({ attributes: group.attrs, type: array.dtype, shape, chunks: array.chunks, names: array.dimensionNames ?? null }));
