// Reads the bricks of a volume and its overviews that a plane meets, and interpolates between their samples.
import { numberOfBrick, rangeOfBrick } from "./tiles.js";

const readsAtOnce = 4;

export class Bricks {
  #volume;
  #onBricks;
  #onError;
  #bricks = new Map(); // by level and numbers: { samples, low, size }
  #bytes = 0;
  #flying = new Map();
  #failed = new Set();
  #wanted = new Set();
  keptBytes = 256 << 20;
  /** Changes with what is there. */
  version = 0;

  /** `onBricks()` is called when bricks have arrived. */
  constructor(volume, onBricks, onError) {
    this.#volume = volume;
    this.#onBricks = onBricks;
    this.#onError = onError;
  }

  close() {
    for (const controller of this.#flying.values()) controller.abort();
    this.#volume = undefined;
    this.#bricks.clear();
  }

  /** What could not be read is wanted again. */
  retry() {
    this.#failed.clear();
  }

  /** The brick in which a sample lies. */
  number(sample) {
    return numberOfBrick(this.#volume, sample);
  }

  boxOf(level, numbers) {
    const { dims } = this.#volume.levels[level];
    const ranges = numbers.map((number, axis) => rangeOfBrick(this.#volume, number, dims[axis]));
    return { low: ranges.map(([begin]) => begin), high: ranges.map(([, end]) => end) };
  }

  /** Reads bricks that are not there: a list of { level, numbers }, the most urgent first. Other reads end. */
  want(list) {
    if (!this.#volume) return;
    this.#wanted = new Set(list.map(keyOf));
    // What is dropped first was wanted longest ago.
    for (const key of this.#wanted) {
      const brick = this.#bricks.get(key);
      if (!brick) continue;
      this.#bricks.delete(key);
      this.#bricks.set(key, brick);
    }
    for (const [key, controller] of this.#flying) if (!this.#wanted.has(key)) controller.abort();
    for (const brick of list) {
      if (this.#flying.size >= readsAtOnce) break;
      const key = keyOf(brick);
      if (!this.#bricks.has(key) && !this.#flying.has(key) && !this.#failed.has(key)) this.#read(brick, key);
    }
  }

  /** True if reading more would change nothing. */
  isSettled(list) {
    return list.every((brick) => this.#bricks.has(keyOf(brick)) || this.#failed.has(keyOf(brick)));
  }

  isFailed = (brick) => this.#failed.has(keyOf(brick));

  async #read(brick, key) {
    const controller = new AbortController();
    this.#flying.set(key, controller);
    const box = this.boxOf(brick.level, brick.numbers);
    try {
      const samples = await this.#volume.read({ level: brick.level, box, signal: controller.signal });
      this.#keep(key, { samples, low: box.low, size: box.high.map((end, axis) => end - box.low[axis]) });
    } catch (error) {
      if (!controller.signal.aborted) {
        this.#failed.add(key);
        this.#onError(error);
      }
    } finally {
      this.#flying.delete(key);
      ++this.version;
      if (this.#volume) this.#onBricks();
    }
  }

  #keep(key, brick) {
    this.#bricks.set(key, brick);
    this.#bytes += brick.samples.byteLength;
    for (const [oldest, { samples }] of this.#bricks) {
      if (this.#bytes <= this.keptBytes) break;
      // Else it would be read again at once.
      if (this.#wanted.has(oldest)) continue;
      this.#bricks.delete(oldest);
      this.#bytes -= samples.byteLength;
    }
  }

  /**
   * Two functions of a place in the volume, as three numbers. `between`: the sample there, linear between the middles of the
   * eight around it; beyond the middles of the outermost samples, it is that of these. `nearest`: the sample that holds it.
   * Undefined where one that is needed is not there.
   */
  sampler(level) {
    const { dims, factor } = this.#volume.levels[level];
    const found = new Map();
    const most = dims.map((n) => n - 1);
    // The brick of the place before: neighbors are mostly in it.
    let last = { low: [0, 0, 0], size: [0, 0, 0] };
    const brickAt = (x, y, z) => {
      const numbers = [this.number(x), this.number(y), this.number(z)];
      const key = keyOf({ level, numbers });
      if (!found.has(key)) found.set(key, this.#bricks.get(key));
      return found.get(key);
    };
    let isWhole;
    const sampleAt = (x, y, z) => {
      let { low, size } = last;
      if (x < low[0] || y < low[1] || z < low[2] || x >= low[0] + size[0] || y >= low[1] + size[1] || z >= low[2] + size[2]) {
        const brick = brickAt(x, y, z);
        if (!brick) {
          isWhole = false;
          return NaN;
        }
        last = brick;
        ({ low, size } = brick);
      }
      return last.samples[((z - low[2]) * size[1] + y - low[1]) * size[0] + x - low[0]];
    };
    // A neighbor that has no share does not count: it may be a NaN.
    const along = (a, b, share) => (share === 0 ? a : a + (b - a) * share);
    const middle = (p, axis) => {
      const n = Math.min(Math.max(p / factor - 0.5, 0), most[axis]);
      // Without the noise of sums.
      const whole = Math.round(n);
      return Math.abs(n - whole) < 1e-7 ? whole : n;
    };
    const between = (px, py, pz) => {
      const [x, y, z] = [middle(px, 0), middle(py, 1), middle(pz, 2)];
      const [i, j, k] = [Math.floor(x), Math.floor(y), Math.floor(z)];
      const [u, v, w] = [x - i, y - j, z - k];
      const { low, size, samples } = last;
      const [a, b, c] = [i - low[0], j - low[1], k - low[2]];
      if (a >= 0 && b >= 0 && c >= 0 && a + 1 < size[0] && b + 1 < size[1] && c + 1 < size[2]) {
        const at = (c * size[1] + b) * size[0] + a;
        const [row, layer] = [size[0], size[0] * size[1]];
        const line = (from) => along(samples[from], samples[from + 1], u);
        const face = (from) => (v === 0 ? line(from) : along(line(from), line(from + row), v));
        return w === 0 ? face(at) : along(face(at), face(at + layer), w);
      }
      const line = (m, n) => (u === 0 ? sampleAt(i, m, n) : along(sampleAt(i, m, n), sampleAt(i + 1, m, n), u));
      const face = (n) => (v === 0 ? line(j, n) : along(line(j, n), line(j + 1, n), v));
      isWhole = true;
      const sample = w === 0 ? face(k) : along(face(k), face(k + 1), w);
      return isWhole ? sample : undefined;
    };
    const nearest = (...place) => {
      isWhole = true;
      const sample = sampleAt(...place.map((p, axis) => Math.min(Math.max(Math.floor(p / factor), 0), most[axis])));
      return isWhole ? sample : undefined;
    };
    return { between, nearest };
  }
}

const keyOf = ({ level, numbers }) => `${level} ${numbers}`;
