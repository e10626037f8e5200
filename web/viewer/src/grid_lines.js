// The edges of the grid in the slice of one view, as a path in samples.

export class GridLines {
  #key;
  #slice;
  #controller;
  #onChange;
  #onError;
  /** A Path2D, in which a sample lies at its number; undefined if there is none. */
  path;

  constructor(onChange, onError) {
    this.#onChange = onChange;
    this.#onError = onError;
  }

  get isReading() {
    return this.#controller !== undefined;
  }

  /** Reads the edges in a region (see Tiles.want()) unless they are there; without a region, drops what there is. */
  want(region, volume, tiles) {
    const slice = region && `${region.normal} ${region.slice}`;
    const key = region && `${slice} ${region.columns} ${region.rows}`;
    if (key === this.#key) return;
    this.#controller?.abort();
    this.#controller = undefined;
    this.#key = key;
    // Where only the picture moved, those that are there can stay until the others come.
    if (slice !== this.#slice) this.path = undefined;
    this.#slice = slice;
    if (region) this.#read(region.normal, tiles.boxOf(region), volume);
  }

  async #read(axis, box, volume) {
    const controller = new AbortController();
    this.#controller = controller;
    try {
      const edges = await volume.edges({ axis, box, signal: controller.signal });
      const path = new Path2D();
      for (let i = 0; i < edges.length; i += 4) {
        path.moveTo(edges[i], edges[i + 1]);
        path.lineTo(edges[i + 2], edges[i + 3]);
      }
      this.path = path;
      this.#controller = undefined;
      this.#onChange();
    } catch (error) {
      if (controller.signal.aborted) return;
      this.#controller = undefined;
      this.#onError(error);
    }
  }
}
