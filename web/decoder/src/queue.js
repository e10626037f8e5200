// Work that waits for its turn, and what is kept for the next time.

/** Runs at most `limit` tasks at once, in their order. */
export class Queue {
  #waiting = [];
  #free;

  constructor(limit) {
    this.#free = limit;
  }

  async run(task, signal) {
    signal?.throwIfAborted();
    if (this.#free > 0) --this.#free;
    else await this.#turn(signal);
    try {
      return await task();
    } finally {
      this.#next();
    }
  }

  #turn(signal) {
    return new Promise((resolve, reject) => {
      const entry = {};
      const stop = () => {
        this.#waiting.splice(this.#waiting.indexOf(entry), 1);
        reject(signal.reason);
      };
      entry.begin = () => {
        signal?.removeEventListener("abort", stop);
        resolve();
      };
      signal?.addEventListener("abort", stop, { once: true });
      this.#waiting.push(entry);
    });
  }

  #next() {
    const entry = this.#waiting.shift();
    if (entry) entry.begin();
    else ++this.#free;
  }
}

/** Keeps values up to a number of bytes, and drops those that were not used for longest. */
export class Recent {
  #values = new Map();
  #limit;
  bytes = 0;

  constructor(limit) {
    this.#limit = limit;
  }

  get(key) {
    const entry = this.#values.get(key);
    if (!entry) return undefined;
    this.#values.delete(key);
    this.#values.set(key, entry);
    return entry.value;
  }

  put(key, value, bytes) {
    this.#drop(key);
    if (bytes > this.#limit) return;
    this.#values.set(key, { value, bytes });
    this.bytes += bytes;
    for (const oldest of this.#values.keys()) {
      if (this.bytes <= this.#limit) break;
      this.#drop(oldest);
    }
  }

  clear() {
    this.#values.clear();
    this.bytes = 0;
  }

  #drop(key) {
    this.bytes -= this.#values.get(key)?.bytes ?? 0;
    this.#values.delete(key);
  }
}
