// The WebAssembly module: glue.cpp says what its functions take.
import { TagridError } from "./errors.js";

export const OK = 0;
export const NEEDS_BYTES = 8;

// As tagrid_status has them.
const codes = ["", "invalid-argument", "broken-input", "io-error", "out-of-memory", "out-of-memory", "io-error", "bug", "",
  "newer-format"];

export const types = [
  null,
  ["uint8", Uint8Array],
  ["int8", Int8Array],
  ["uint16", Uint16Array],
  ["int16", Int16Array],
  ["uint32", Uint32Array],
  ["int32", Int32Array],
  ["float32", Float32Array],
  ["float64", Float64Array],
];

const numbersOfInfo = 35 + 64;
const numbersOfBlock = 12;
const blocksAtOnce = 64;
export const boxBytes = 48;

/** Numbers of 64 bits, each given as two words, the lower one first, in 32 bits. Throws if one does not fit. */
export function int32Of(words) {
  const result = new Int32Array(words.length / 2);
  for (let i = 0; i < result.length; ++i) {
    result[i] = words[2 * i];
    if (words[2 * i + 1] !== result[i] >> 31)
      throw new TagridError("not-supported", "the edges lie further than 2^31 samples from the beginning of the volume");
  }
  return result;
}

/** An instance of the module. After an error of the machine, such as a trap, it cannot be used again. */
export class Wasm {
  #exports;
  #scratch;

  constructor(module) {
    const imports = {};
    for (const { module: from, name, kind } of WebAssembly.Module.imports(module)) {
      if (kind !== "function") throw new TagridError("not-supported", `the module needs ${from}.${name}`);
      imports[from] ??= {};
      // Nothing is written anywhere; an end of the program is an error of the call.
      imports[from][name] =
        {
          proc_exit: (code) => {
            throw new TagridError("bug", `the module ended with ${code}`);
          },
          number: (pointer, length) =>
            Number(new TextDecoder().decode(new Uint8Array(this.#exports.memory.buffer, pointer >>> 0, length))),
        }[name] ?? (() => 0);
    }
    this.#exports = new WebAssembly.Instance(module, { ...imports }).exports;
    this.#exports._initialize?.();
    this.#scratch = this.#allocated(8 * (numbersOfInfo + 6 + blocksAtOnce * numbersOfBlock));
  }

  #allocated(bytes) {
    const pointer = this.#exports.malloc(bytes) >>> 0;
    if (pointer === 0) throw new TagridError("out-of-memory", "there is no memory for the bytes of a file");
    return pointer;
  }

  /** Calls `use` with bytes that are in the memory of the module for the time of the call. */
  #with(bytes, use) {
    const pointer = this.#allocated(Math.max(bytes.length, 1));
    try {
      new Uint8Array(this.#exports.memory.buffer, pointer, bytes.length).set(bytes);
      return use(pointer);
    } finally {
      this.#exports.free(pointer);
    }
  }

  #numbers(count) {
    return new Float64Array(this.#exports.memory.buffer, this.#scratch, count);
  }

  #words(count) {
    return new Uint32Array(this.#exports.memory.buffer, this.#scratch, count);
  }

  #text(pointer) {
    const bytes = new Uint8Array(this.#exports.memory.buffer, pointer >>> 0);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  #check(status, message) {
    if (status !== OK) throw new TagridError(codes[status] ?? "bug", this.#text(message()) || "out of memory");
  }

  // ---------------------------------------------------------------------------------------------- where bytes are

  create(bytes) {
    const blocks = this.#exports.web_create(bytes) >>> 0;
    if (blocks === 0) throw new TagridError("out-of-memory", "out of memory");
    return blocks;
  }

  /** The ranges that the last call lacked. */
  needs(blocks) {
    return Array.from({ length: this.#exports.web_needs(blocks) }, (_, i) => {
      this.#exports.web_need(blocks, i, this.#scratch);
      const [offset, length] = this.#numbers(2);
      return { offset, length };
    });
  }

  give(blocks, offset, bytes) {
    this.#with(bytes, (pointer) =>
      this.#check(this.#exports.web_give(blocks, offset, pointer, bytes.length), () => this.#exports.web_message(blocks)),
    );
  }

  #unlessNeeded(blocks, status, result) {
    if (status === NEEDS_BYTES) return undefined;
    this.#check(status, () => this.#exports.web_message(blocks));
    return result();
  }

  /** These return undefined if they need bytes. */
  open(blocks) {
    return this.#unlessNeeded(blocks, this.#exports.web_open(blocks), () => blocks);
  }

  overview(blocks, factor) {
    return this.#unlessNeeded(blocks, this.#exports.web_overview(blocks, factor, this.#scratch), () => this.#words(1)[0]);
  }

  volume(blocks, number) {
    return this.#unlessNeeded(blocks, this.#exports.web_volume(blocks, number, this.#scratch), () => this.#words(1)[0]);
  }

  /** At most 64 bricks of a box, from the one numbered `first` among them on. */
  plan(blocks, box, first) {
    this.#numbers(6).set([...box.low, ...box.high]);
    const count = this.#exports.web_plan(blocks, first, this.#scratch, blocksAtOnce);
    return this.#unlessNeeded(blocks, count < 0 ? -count : OK, () => {
      const numbers = this.#numbers(6 + count * numbersOfBlock).subarray(6);
      return Array.from({ length: count }, (_, i) => {
        const n = [...numbers.subarray(i * numbersOfBlock, (i + 1) * numbersOfBlock)];
        return {
          number: n[0],
          low: n.slice(1, 4),
          high: n.slice(4, 7),
          offset: n[7],
          length: n[8],
          activityBytes: n[9],
          slices: n[10],
        };
      });
    });
  }

  static planIsComplete(blocks) {
    return blocks.length < blocksAtOnce;
  }

  info(blocks) {
    this.#check(this.#exports.web_info(blocks, this.#scratch), () => this.#exports.web_message(blocks));
    const numbers = [...this.#numbers(numbersOfInfo)];
    const take = (count) => numbers.splice(0, count);
    const one = () => take(1)[0];
    const known = () => ((number) => (Number.isNaN(number) ? null : number))(one());
    const info = { dims: take(3), type: one() };
    const [spacing, origin] = [take(3), take(3)];
    const directions = [take(3), take(3), take(3)];
    const [hasSpacing, hasOrigin, hasDirections] = take(3);
    info.geometry = {
      spacing: hasSpacing ? spacing : null,
      origin: hasOrigin ? origin : null,
      directions: hasDirections ? directions : null,
    };
    info.bounds = {
      maxError: known(),
      surfaceError: known(),
      meshError: known(),
      achievedMaxError: known(),
      achievedRmse: known(),
      achievedPsnr: known(),
    };
    const [low, high, mean] = take(3);
    info.range = low <= high ? { low, high, mean } : null;
    [info.brickEdge, info.lead, info.storesGrid, info.volumes] = [one(), one() === 1, one() === 1, one()];
    info.factors = numbers.slice(0, numbers.indexOf(0));
    info.metadata = this.#text(this.#exports.web_metadata(blocks));
    const header = this.#exports.web_header(blocks, this.#scratch) >>> 0;
    info.header = new Uint8Array(this.#exports.memory.buffer, header, this.#words(1)[0]).slice();
    return info;
  }

  // ---------------------------------------------------------------------------------------------------- decoding

  /** A decoder for a file with this header. */
  decoder(header) {
    return this.#with(header, (pointer) => {
      const status = this.#exports.web_decoder_open(pointer, header.length, this.#scratch);
      const decoder = this.#words(1)[0];
      try {
        this.#check(status, () => this.#exports.web_decoder_message(decoder));
      } catch (error) {
        this.#exports.web_decoder_close(decoder);
        throw error;
      }
      return decoder;
    });
  }

  #requireMemory(memory, number) {
    // The module addresses 4 GiB, and has some of it.
    if (memory > 0xf0000000) throw new TagridError("out-of-memory", `brick ${number} takes ${memory} bytes to decode`);
  }

  /** The samples of a brick, as bytes: at least `slices` of it, x fastest. */
  decode(decoder, { number, activityBytes, slices }, bytes) {
    this.#requireMemory(this.#exports.web_decoder_memory(decoder, number, bytes.length), number);
    return this.#with(bytes, (pointer) => {
      const status = this.#exports.web_decode(decoder, number, activityBytes, slices, pointer, bytes.length, this.#scratch);
      this.#check(status, () => this.#exports.web_decoder_message(decoder));
      const [samples, count] = this.#words(2);
      return new Uint8Array(this.#exports.memory.buffer, samples, count).slice();
    });
  }

  /** The activity of a brick, as bytes: its box as six doubles, and then a bit for each point. */
  activity(decoder, { number, activityBytes }, bytes) {
    this.#requireMemory(this.#exports.web_activity_memory(decoder, number, bytes.length), number);
    return this.#with(bytes, (pointer) => {
      const box = this.#scratch + 8;
      const status = this.#exports.web_activity(decoder, number, activityBytes, pointer, bytes.length, box, this.#scratch);
      this.#check(status, () => this.#exports.web_decoder_message(decoder));
      const [words, count] = this.#words(2);
      const result = new Uint8Array(boxBytes + 8 * count);
      const { buffer } = this.#exports.memory;
      result.set(new Uint8Array(buffer, box, boxBytes));
      result.set(new Uint8Array(buffer, words, 8 * count), boxBytes);
      return result;
    });
  }

  /** The edges of the grid of a brick in a slice, from its activity: four numbers each, as bytes of an Int32Array. */
  edges(decoder, { number }, activity, { axis, slice }) {
    return this.#with(activity.subarray(boxBytes), (pointer) => {
      const count = (activity.length - boxBytes) / 8;
      const status = this.#exports.web_edges(decoder, number, pointer, count, axis, slice, this.#scratch);
      this.#check(status, () => this.#exports.web_decoder_message(decoder));
      const [edges, edgeCount] = this.#words(2);
      return new Uint8Array(int32Of(new Int32Array(this.#exports.memory.buffer, edges, 8 * edgeCount)).buffer);
    });
  }
}
