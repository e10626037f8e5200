// Decoders of the files that are open, in one instance of the module.
import { TagridError } from "./errors.js";
import { Wasm } from "./wasm.js";

export class Decoders {
  #module;
  #wasm;
  #headers = new Map();
  #decoders = new Map();

  constructor(module) {
    this.#module = module;
  }

  /**
   * Does a task of a stream: `kind` is "decode", "activity" or "edges", and `more` what the last one takes. The first
   * task of a stream has its header.
   */
  run({ kind, stream, header, brick, bytes, more }) {
    if (header) this.#headers.set(stream, header);
    try {
      this.#wasm ??= new Wasm(this.#module);
      if (!this.#decoders.has(stream)) this.#decoders.set(stream, this.#wasm.decoder(this.#headers.get(stream)));
      return this.#wasm[kind](this.#decoders.get(stream), brick, bytes, more);
    } catch (error) {
      if (error instanceof TagridError && error.code !== "bug") throw error;
      // A trap leaves the instance in any state.
      this.#wasm = undefined;
      this.#decoders.clear();
      if (error instanceof RangeError) throw new TagridError("out-of-memory", `brick ${brick.number}: ${error.message}`);
      throw new TagridError("bug", `brick ${brick.number}: ${error.message}`, { cause: error });
    }
  }
}
