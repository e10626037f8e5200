// Errors with codes; index.d.ts lists them.

export class TagridError extends Error {
  constructor(code, message, { status, cause } = {}) {
    super(message, cause === undefined ? undefined : { cause });
    this.name = "TagridError";
    this.code = code;
    if (status !== undefined) this.status = status;
  }
}

export function require(condition, message) {
  if (!condition) throw new TagridError("invalid-argument", message);
}

/** A promise that ends as `promise` does, or fails when the signal says so. */
export function unlessAborted(promise, signal) {
  if (!signal) return promise;
  return new Promise((resolve, reject) => {
    const stop = () => reject(signal.reason);
    if (signal.aborted) return stop();
    signal.addEventListener("abort", stop, { once: true });
    promise.then(resolve, reject).finally(() => signal.removeEventListener("abort", stop));
  });
}
