// @tagrid/niivue: .tag files in NiiVue.
import type { Vector3, Volume } from "@tagrid/decoder";

/** What NiiVue's `loadChunkedVolume()` takes: samples of any part of any level. */
export interface ChunkedVolumeSource {
  /** NIfTI's number of the type of the samples. */
  readonly datatypeCode: number;
  /** The volume and its overviews, from fine to coarse; spacing in millimeters. */
  readonly levels: { level: number; shape: Vector3; spacing: Vector3 }[];
  /** Samples of a box of a level, little endian, x fastest; zeros outside the level. Fails as `Volume.read()` does. */
  fetchChunk(request: {
    levelIndex: number;
    texOrigin: Vector3;
    texDims: Vector3;
    signal?: AbortSignal;
  }): Promise<Uint8Array>;
}

/**
 * A volume that NiiVue reads part by part: `nv.loadChunkedVolume(chunkedSource(volume), { calMin, calMax })`.
 * NiiVue gets stored samples and spacings: its interface has no slope, no position and no directions.
 */
export function chunkedSource(volume: Volume): ChunkedVolumeSource;

/**
 * A level as a NIfTI file in memory, with position, directions, slope and intercept: `nv.loadVolumes([{ url: file }])`,
 * or `nv.loadFromFile(file)` before NiiVue 1.0. Places in an unknown coordinate system count as right, anterior,
 * superior. If slices have slopes of their own, it has stored samples, and a warning says so.
 *
 * level: one of `volume.levels`. The default is the coarsest one. Fails with a RangeError if there is no such level, or
 * if an axis has more than 32767 samples, and as `Volume.read()` does.
 */
export function niftiFile(
  volume: Volume,
  options?: { level?: number; name?: string; signal?: AbortSignal },
): Promise<File>;
