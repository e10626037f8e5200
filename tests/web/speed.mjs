// How fast bricks are decoded, beside the program in the same run: nanoseconds of processor time a voxel, which other
// load of the machine changes little.
//   TAGRID_PROGRAM=build/release/tagrid TAGRID_DIST=$PWD/web/decoder/dist node tests/web/speed.mjs
import { spawnSync } from "node:child_process";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { content, made } from "./files.mjs";

const { open } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "index.js")));
const dims = [128, 128, 128];
const voxels = dims.reduce((a, b) => a * b);

const best = (times) => Math.min(...times).toFixed(1);

/** Of this process and its workers. */
async function timed(work) {
  const begin = process.cpuUsage();
  await work();
  const { user, system } = process.cpuUsage(begin);
  return ((user + system) * 1e3) / voxels;
}

/** Of the program on one thread, with its start and its output through a pipe. */
function timedProgram(path) {
  const command = `TIMEFORMAT='%U %S'; time "$0" decode "$1" --samples --format raw -q -T 1 -o - | cat >/dev/null`;
  const { stderr } = spawnSync("bash", ["-c", command, process.env.TAGRID_PROGRAM, path], { encoding: "utf8" });
  return (stderr.trim().split(" ").reduce((sum, seconds) => sum + Number(seconds), 0) * 1e9) / voxels;
}

console.log("| file | program | vectors | no vectors |\n|---|---|---|---|");
for (const [name, type, ...options] of [
  ["int16, E = 5", "int16", "--max-error", "5"],
  ["uint8, lossless", "uint8"],
  ["float32, E = 5", "float32", "--max-error", "5"],
  ["int16, 40 dB", "int16", "--psnr", "40"],
  ["int16, E = 5, 1", "int16", "--max-error", "5", "--surface-error", "1"],
]) {
  const path = made(name.replace(/\W/g, ""), dims, type, ...options);
  const blob = new Blob([content(path)]);
  const program = [];
  const modules = { true: [], false: [] };
  for (let repetition = 0; repetition < 3; ++repetition) {
    program.push(timedProgram(path));
    for (const simd of [true, false]) {
      const volume = await open(blob, { workers: 1, simd, brickCache: 0 });
      await volume.read({ box: { low: [0, 0, 0], high: [1, 1, 1] } });
      modules[simd].push(await timed(() => volume.read()));
      volume.close();
    }
  }
  console.log(`| ${name} | ${best(program)} | ${best(modules.true)} | ${best(modules.false)} |`);
}
