// @tagrid/decoder: .tag files in browsers and Node.js.
//
// Three numbers are always x, y, z. Samples lie x fastest, then y, then z. Boxes are half open.

/** Along x, y and z. */
export type Vector3 = [number, number, number];

/** The samples from `low` up to, but not including, `high`. */
export interface Box {
  /** The first sample. */
  low: Vector3;
  /** One beyond the last sample, along each axis. */
  high: Vector3;
}

/** The eight types of samples. */
export type SampleType = "uint8" | "int8" | "uint16" | "int16" | "uint32" | "int32" | "float32" | "float64";

/** An array of the type of the volume. */
export type Samples =
  Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array | Float32Array | Float64Array;

/**
 * The position of the samples in the world. Sample (x, y, z) is at
 * `origin + x * directions[0] + y * directions[1] + z * directions[2]`. Units are those of the scan, mostly mm. What the
 * source did not give is null.
 */
export interface Geometry {
  /** The distances between neighboring samples. */
  spacing: Vector3 | null;
  /** The position of sample (0, 0, 0). */
  origin: Vector3 | null;
  /** From a sample to the next one along each axis. */
  directions: [Vector3, Vector3, Vector3] | null;
}

/** The volume itself, or an overview of it: a downsampled copy that is in the file. */
export interface Level {
  /** The number of the level: 0 for the volume, then overviews from fine to coarse. */
  level: number;
  /** Samples of the volume along the edge of a sample of this level: 1 for the volume. */
  factor: number;
  /** The numbers of samples. */
  dims: Vector3;
  /** As `Volume.geometry`: samples of overviews lie in the middle of what they stand for. */
  geometry: Geometry;
}

/** The bounds with which the file was encoded, in units of the samples; null if there is none. */
export interface Bounds {
  /** No sample is further than this from the original; 0: all are exact. */
  maxError: number | null;
  /** The tighter bound of the active points. */
  surfaceError: number | null;
  /** No original sample is further than this from the field of the mesh. */
  meshError: number | null;
  /** The largest error that was measured during encoding; Infinity if a NaN or an infinity did not come back. */
  achievedMaxError: number | null;
  /** The root of the mean of squared errors. */
  achievedRmse: number | null;
  /** In dB. */
  achievedPsnr: number | null;
}

/** Of the volume itself: overviews store no grid. */
export interface GridOptions {
  /** In samples, within the dims of the volume. The default is all of it. */
  box?: Box;
  /** Ends the call: it then fails with `signal.reason`. */
  signal?: AbortSignal;
}

/** What to read. */
export interface ReadOptions {
  /** In samples of the level, within its dims. The default is all of it. */
  box?: Box;
  /** One of `Volume.levels`. The default is 0, the volume itself. */
  level?: number;
  /** Ends the read: it then fails with `signal.reason`. */
  signal?: AbortSignal;
}

/** One volume of a file. Any number of reads may run at once. */
export interface Volume {
  /** The numbers of samples. */
  readonly dims: Vector3;
  readonly type: SampleType;
  /** Where the samples are. */
  readonly geometry: Geometry;
  /** This volume and its overviews, from fine to coarse. */
  readonly levels: readonly Level[];
  /** How exact the samples are. */
  readonly bounds: Bounds;
  /** The smallest and the largest finite sample, and the mean, of the original; null if no sample is finite. */
  readonly range: { low: number; high: number; mean: number } | null;
  /** The lines of an NRRD header that describe the scan: space, units, `key:=value` pairs. */
  readonly metadata: string;
  /** The value of the field `name: value` of `metadata`, in lower or upper case; undefined if it has none. */
  field(name: string): string | undefined;
  /** The value of the last pair `key:=value` of `metadata`, unescaped; undefined if it has none. */
  pair(key: string): string | undefined;
  /** The name of the volume, as of a channel or a moment; "" if it has none. */
  readonly name: string;
  /** The edge of a brick, in samples. Boxes whose corners are multiples of it take the least work; see `lead`. */
  readonly brickEdge: number;
  /** True if the bricks of the volume begin at multiples of `brickEdge`; otherwise one sample after them. */
  readonly lead: boolean;
  /** Bytes of the file. */
  readonly fileBytes: number;

  /** The number of volumes in the file, all with the same dims and type. */
  readonly volumes: number;
  /** Opens a volume of the same file, 0 up to `volumes - 1`. It shares caches and workers with this one. */
  volume(number: number, options?: { signal?: AbortSignal }): Promise<Volume>;

  /**
   * The samples of a box, in an array of the type of the volume, x fastest. Every byte is checked before it becomes a
   * sample. Fails with a TagridError.
   */
  read(options?: ReadOptions): Promise<Samples>;

  /** Whether the file has the grid of the volume. Otherwise it follows from the samples, and cannot be read. */
  readonly storesGrid: boolean;
  /** For each sample of a box, x fastest: 1 if it is a vertex of the grid, or 0. The first call loads a second module. */
  activity(options?: GridOptions): Promise<Uint8Array>;
  /**
   * The edges of the grid in a slice across an axis (0, 1, 2): where the faces of its tetrahedra cut the slice, in the
   * bricks that hold samples of the box. The box is one slice across the axis. Four numbers for each edge: where it
   * begins and where it ends, along the two other axes, the lower one first, in samples; a sample lies at its number.
   * They may reach beyond the volume, to the end of the root cubes. Edges between two bricks appear twice.
   * Fails with the code "not-supported" if one lies beyond 2^31 samples.
   */
  edges(options: GridOptions & { axis: 0 | 1 | 2; box: Box }): Promise<Int32Array>;

  /** Ends the workers and all reads of the file, and frees the caches. Nothing of the file can be used after that. */
  close(): void;
}

/** Bytes anywhere. */
export interface Source {
  /** In bytes. */
  size: number;
  /** Gives `length` bytes from `offset` on. Called with ranges within `size`, several times at once. */
  read(offset: number, length: number, signal: AbortSignal): Promise<Uint8Array | ArrayBuffer>;
}

/** How to fetch and decode a file. */
export interface OpenOptions {
  /** Ends the opening: it then fails with `signal.reason`. */
  signal?: AbortSignal;
  /** Workers that decode. The default is one fewer than the cores of the machine; 0: decode on the calling thread. */
  workers?: number;
  /**
   * Ranges that are fetched at once: 1 to 64. The default is 6, because over HTTP/1.1 browsers send at most six requests
   * to a server at a time. More can be faster over HTTP/2 and HTTP/3.
   */
  connections?: number;
  /** How often a request is repeated after a failure that may pass. The default is 3. */
  retries?: number;
  /**
   * A request fails if the server sends nothing of the file for so many milliseconds, neither to this request nor to
   * others of this source. It also fails if the server then sends less than 4096 bytes per second on average over this
   * time. The default is 30000; a longer time lowers the rate.
   */
  timeout?: number;
  /** Bytes of compressed bricks that are kept. The default is 64 MB. */
  blockCache?: number;
  /** Bytes of decoded bricks that are kept. The default is 256 MB. */
  brickCache?: number;

  /** Of URLs: the options of fetch(). */
  headers?: Record<string, string>;
  /** Of URLs: whether cookies are sent, as an option of fetch(). */
  credentials?: RequestCredentials;
  /** Of URLs: in place of the global fetch(). */
  fetch?: typeof fetch;
  /** Of URLs: the size of the file, where a server of another origin does not expose `Content-Range`. */
  size?: number;
  /**
   * Of URLs: whether requests have `If-Match`. The default is true for the page's own origin and outside of browsers.
   * To other origins, a browser sends it only where the server allows it, so the entity tags of answers are compared
   * instead.
   */
  ifMatch?: boolean;

  /**
   * Where the files of this package are, if a bundler does not keep them where index.js expects them: the URL of a
   * folder, with "/" at its end, relative to the page. The README lists the bundlers that need it.
   */
  base?: string | URL;
  /** False: do not use vector instructions, to compare. */
  simd?: boolean;
}

/**
 * Opens a .tag file: two requests, of 320 KiB, or of up to 832 KiB for a large file. The result is volume 0 of the file.
 * A URL begins with http: or https:, and must not contain a user name or a password; see `headers`.
 */
export function open(source: string | URL | Blob | Source, options?: OpenOptions): Promise<Volume>;

/** The kinds of errors. */
export type ErrorCode =
  /** An argument is invalid: a box outside of the volume, an unknown level. */
  | "invalid-argument"
  /** The bytes are damaged, truncated, or not those of a .tag file. */
  | "broken-input"
  /** The file is not damaged, but needs a newer version of this package. */
  | "newer-format"
  /** The server, the network or a `read` of a source failed. */
  | "io-error"
  /** The server ignores ranges. */
  | "no-ranges"
  /** The server does not say how large the file is, or (CORS) does not expose `Content-Range`. */
  | "no-size"
  /** The file changed while it was open. */
  | "changed"
  /** A brick or a box does not fit into memory. */
  | "out-of-memory"
  /** The file was closed. */
  | "closed"
  /** The file stores no grid. */
  | "no-grid"
  /** WebAssembly or a file of this package is missing. */
  | "not-supported"
  /** A bug in this package. */
  | "bug";

/**
 * All errors of this package. Neither messages nor causes have passwords, `headers`, or what follows a "?" in addresses.
 * (An aborted call fails with the reason of its signal, and the cause of a failed `Source.read()` is its own error.)
 */
export class TagridError extends Error {
  /** Its kind, for programs. */
  readonly code: ErrorCode;
  /** The HTTP status, if a server answered with an error. */
  readonly status?: number;
}

/** The version of this package. */
export const version: string;
