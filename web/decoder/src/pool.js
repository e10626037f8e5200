// Workers that decode bricks. Without workers, the calling thread does.
import { Decoders } from "./decoders.js";
import { TagridError } from "./errors.js";
import { startWorker, workerNotLoaded } from "./files.js";

export class Pool {
  #module;
  #base;
  #size;
  #inline;
  #workers = new Set();
  #waiting = [];
  #closed = false;

  constructor(module, base, size) {
    this.#module = module;
    this.#base = base;
    this.#size = size;
    if (size === 0) this.#inline = new Decoders(module);
  }

  /** The result of a task for a brick, as bytes; undefined if nobody wants it when it is its turn. */
  async run(task, isWanted) {
    if (this.#closed) throw new TagridError("closed", "the file was closed");
    if (this.#inline) return this.#inline.run(task);
    return new Promise((resolve, reject) => {
      this.#waiting.push({ task, isWanted, resolve, reject });
      this.#work();
    });
  }

  /** Starts a worker, while bytes are fetched. */
  warm() {
    if (!this.#inline && !this.#closed && this.#workers.size === 0) this.#start();
  }

  #work() {
    while (this.#waiting.length > 0) {
      if (!this.#waiting[0].isWanted()) {
        this.#waiting.shift().resolve(undefined);
        continue;
      }
      const free = [...this.#workers].find((worker) => worker.port && !worker.entry);
      if (!free) {
        const starting = [...this.#workers].filter((worker) => !worker.port).length;
        if (this.#workers.size < this.#size && starting < this.#waiting.length) this.#start();
        else return;
        continue;
      }
      const entry = this.#waiting.shift();
      const { header, ...task } = entry.task;
      free.entry = entry;
      // A worker is given the header of a stream once.
      const first = !free.streams.has(task.stream);
      free.streams.add(task.stream);
      free.port.works(true);
      free.port.post({ task: 0, ...task, ...(first && { header }) });
    }
  }

  #start() {
    const worker = { port: undefined, entry: undefined, streams: new Set() };
    this.#workers.add(worker);
    const onMessage = ({ result, code, message }) => {
      const { entry } = worker;
      worker.entry = undefined;
      worker.port.works(false);
      if (result) entry.resolve(result);
      else entry.reject(new TagridError(code, message));
      this.#work();
    };
    const onError = async (cause) => {
      this.#workers.delete(worker);
      worker.port?.end();
      const failed = worker.entry ? [worker.entry] : [];
      // One that never worked is not replaced: the next one would fail, too. So nobody is left for what waits.
      if (!worker.worked && this.#workers.size === 0) failed.push(...this.#waiting.splice(0));
      if (worker.worked) this.#work();
      if (failed.length === 0) return;
      const error = worker.worked
        ? new TagridError("bug", `a worker failed: ${cause.message}`, { cause })
        : await workerNotLoaded(this.#base, cause);
      for (const entry of failed) entry.reject(error);
    };
    const withMark = (message) => {
      worker.worked = true;
      onMessage(message);
    };
    startWorker(this.#base, { onMessage: withMark, onError }).then(
      (port) => {
        if (this.#closed) return port.end();
        worker.port = port;
        port.post({ module: this.#module });
        this.#work();
        if (!worker.entry) port.works(false);
      },
      (cause) => onError(cause),
    );
  }

  close() {
    this.#closed = true;
    const left = [...this.#workers].flatMap((worker) => (worker.entry ? [worker.entry] : []));
    for (const entry of [...left, ...this.#waiting.splice(0)]) entry.reject(new TagridError("closed", "the file was closed"));
    for (const worker of this.#workers) worker.port?.end();
    this.#workers.clear();
  }
}
