// Fetches and decodes bricks: single ones are shared by all reads that wait for them, and kept for the next ones.
import { unlessAborted } from "./errors.js";
import { Recent } from "./queue.js";
import { types } from "./wasm.js";

// Ranges of the file with a smaller gap between them are one request.
const smallGap = 64 << 10;
// A request is not made longer than this, so that others run beside it.
const leastLongest = 256 << 10;
const mostLongest = 4 << 20;

export class Bricks {
  #file;
  #pool;
  #connections;
  #kind;
  #blocks;
  #results;
  #flying = new Map();

  /** `kind` is what is decoded: see Decoders.run(). `blocks` are those that are kept, and `bytes` how much of results. */
  constructor(file, pool, connections, kind, blocks, bytes) {
    this.#file = file;
    this.#pool = pool;
    this.#connections = connections;
    this.#kind = kind;
    this.#blocks = blocks;
    this.#results = new Recent(bytes);
  }

  clear() {
    this.#blocks.clear();
    this.#results.clear();
  }

  /** Calls `use(brick, bytes)` with what each brick is decoded to, in any order. */
  async read(stream, bricks, signal, use) {
    signal.throwIfAborted();
    const waits = [];
    const joined = [];
    const missing = [];
    for (const brick of bricks) {
      const key = `${stream.id}:${brick.number}`;
      const kept = this.#results.get(key);
      if (kept && kept.slices >= brick.slices) {
        use(brick, kept.bytes);
        continue;
      }
      let flight = this.#flying.get(key);
      if (!flight || flight.brick.slices < brick.slices) {
        flight = { key, stream, brick, waiting: 0, request: undefined };
        flight.done = new Promise((resolve, reject) => Object.assign(flight, { resolve, reject }));
        // Nobody may be left who waits for it.
        flight.done.catch(() => {});
        this.#flying.set(key, flight);
        missing.push(flight);
      }
      ++flight.waiting;
      joined.push(flight);
      waits.push(flight.done.then((bytes) => use(brick, bytes)));
    }
    this.#start(missing);
    try {
      await unlessAborted(Promise.all(waits), signal);
    } catch (error) {
      // Several may have failed.
      for (const wait of waits) wait.catch(() => {});
      throw error;
    } finally {
      for (const flight of joined) this.#leave(flight);
    }
  }

  #leave(flight) {
    if (--flight.waiting > 0 || flight.landed) return;
    this.#land(flight);
    if (--flight.request.live === 0) flight.request.controller.abort(new DOMException("nobody waits", "AbortError"));
  }

  #land(flight) {
    flight.landed = true;
    if (this.#flying.get(flight.key) === flight) this.#flying.delete(flight.key);
  }

  #start(flights) {
    const toFetch = [];
    for (const flight of flights) {
      const bytes = this.#blocks.get(flight.key);
      if (!bytes) {
        toFetch.push(flight);
        continue;
      }
      flight.request = { live: 1, controller: new AbortController() };
      this.#decode(flight, bytes);
    }
    for (const group of this.#merged(toFetch)) this.#fetch(group);
  }

  /** Flights whose blocks are fetched by one request each. */
  #merged(flights) {
    flights.sort((a, b) => a.brick.offset - b.brick.offset);
    const total = flights.reduce((sum, { brick }) => sum + brick.length, 0);
    const longest = Math.min(Math.max(total / this.#connections, leastLongest), mostLongest);
    const groups = [];
    let end = 0;
    let begin = 0;
    for (const flight of flights) {
      const { offset, length } = flight.brick;
      if (groups.length === 0 || offset - end > smallGap || offset + length - begin > longest) {
        groups.push([]);
        begin = offset;
        end = offset;
      }
      groups.at(-1).push(flight);
      end = Math.max(end, offset + length);
    }
    return groups;
  }

  async #fetch(group) {
    const request = { live: group.length, controller: new AbortController() };
    for (const flight of group) flight.request = request;
    const offset = group[0].brick.offset;
    const length = Math.max(...group.map(({ brick }) => brick.offset + brick.length)) - offset;
    try {
      // The next range is fetched when these bricks are decoded, so what waits for workers is bounded.
      await this.#file.fetch(offset, length, request.controller.signal, (bytes) =>
        Promise.all(
          group.map((flight) => {
            const at = flight.brick.offset - offset;
            const block = bytes.slice(at, at + flight.brick.length);
            this.#blocks.put(flight.key, block, block.length);
            return flight.landed ? undefined : this.#decode(flight, block);
          }),
        ),
      );
    } catch (error) {
      for (const flight of group) this.#fail(flight, error);
    }
  }

  async #decode(flight, bytes) {
    const { stream, brick, key } = flight;
    try {
      const task = { kind: this.#kind, stream: stream.id, header: stream.header, brick, bytes };
      const result = await this.#pool.run(task, () => !flight.landed);
      if (!result) return;
      const slice = (brick.high[0] - brick.low[0]) * (brick.high[1] - brick.low[1]) * types[stream.type][1].BYTES_PER_ELEMENT;
      // An activity is always that of all slices.
      const slices = this.#kind === "decode" ? result.length / slice : Infinity;
      this.#results.put(key, { bytes: result, slices }, result.length);
      this.#land(flight);
      flight.resolve(result);
    } catch (error) {
      this.#fail(flight, error);
    }
  }

  #fail(flight, error) {
    this.#land(flight);
    flight.reject(error);
  }
}
