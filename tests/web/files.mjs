// Files to decode, and what the program says of them.
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

export const golden = join(dirname(fileURLToPath(import.meta.url)), "..", "golden", "1.0");
export const goldenFiles = readdirSync(golden).filter((name) => name.endsWith(".tag"));

export const folder = mkdtempSync(join(tmpdir(), "tagrid-web-"));
process.on("exit", () => {
  // Processes of a browser that was told to end may still write files, so a directory that was emptied is not empty:
  // rmSync's own retries do not look into it again.
  for (let tries = 100; ; --tries) {
    try {
      return rmSync(folder, { recursive: true, force: true });
    } catch (error) {
      if (tries === 0) throw error;
      Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, 100);
    }
  }
});

const program = process.env.TAGRID_PROGRAM;

export function tagrid(...args) {
  return execFileSync(program, args, { maxBuffer: 1 << 30, stdio: ["ignore", "pipe", "pipe"] });
}

/** The samples that the program decodes, as bytes. */
export function decoded(path, ...options) {
  return tagrid("decode", path, "--samples", "--format", "raw", "-q", "-T", "1", "-o", "-", ...options);
}

/** A .tag file of a phantom. */
export function made(name, dims, type, ...options) {
  const path = join(folder, `${name}.tag`);
  if (existsSync(path)) return path;
  const source = join(folder, `${type}-${dims.join("-")}.nrrd`);
  if (!existsSync(source)) tagrid("phantom", "--dims", dims.join(","), "--type", type, "-q", "-o", source);
  tagrid("encode", source, "-q", "-o", path, ...options);
  return path;
}

export const bytesOf = (samples) => Buffer.from(samples.buffer, samples.byteOffset, samples.byteLength);

/** A generator of numbers below a limit. */
export function random(seed) {
  return (below) => {
    seed = (Math.imul(seed, 1103515245) + 12345) >>> 0;
    return Math.floor((seed / 2 ** 32) * below);
  };
}

/** A part of a volume, as bytes. */
export function part(all, dims, size, { low, high }) {
  const rows = [];
  for (let z = low[2]; z < high[2]; ++z)
    for (let y = low[1]; y < high[1]; ++y) {
      const row = (z * dims[1] + y) * dims[0];
      rows.push(all.subarray((row + low[0]) * size, (row + high[0]) * size));
    }
  return Buffer.concat(rows);
}

export const content = (path) => readFileSync(path);
