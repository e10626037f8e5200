// @tagrid/cornerstone: .tag files in Cornerstone3D.
import type { OpenOptions, Volume } from "@tagrid/decoder";

/** What Cornerstone's `volumeLoader.createLocalVolume()` takes. */
export interface LocalVolume {
  dimensions: [number, number, number];
  /** In millimeters. */
  spacing: [number, number, number];
  /** Of the first sample, in millimeters: x to the left, y to the back, z up, as in DICOM. */
  origin: [number, number, number];
  /** Unit vectors along the three axes of the volume, one after the other. */
  direction: number[];
  /** Values, x fastest. */
  scalarData: Uint8Array | Int16Array | Uint16Array | Float32Array;
  metadata: Record<string, unknown>;
}

/**
 * Lets Cornerstone3D load volumes whose names begin with "tagrid:":
 *
 *     import * as cornerstone from "@cornerstonejs/core";
 *     import { open } from "@tagrid/decoder";
 *     registerTagrid(cornerstone, open);
 *     await cornerstone.volumeLoader.createAndCacheVolume("tagrid:https://example.org/scan.tag#level=1");
 *
 * What follows the "#" is optional: `level`, one of `Volume.levels`, and `volume`, the number of a volume of the file,
 * joined by "&". The default level is the finest one that takes at most 512 MiB. All samples of it are decoded at once.
 *
 * cornerstone: the module `@cornerstonejs/core`. options: those of open().
 */
export function registerTagrid(
  cornerstone: { cache: any; imageLoader: any; metaData: any; volumeLoader: any },
  open: (source: string, options?: OpenOptions) => Promise<Volume>,
  options?: OpenOptions,
): void;

/**
 * A level of a volume as values, such as HU, at its place. Samples keep their type if they are values already, and
 * Cornerstone shows that type. Otherwise, values are 16-bit integers if they all are such numbers, and otherwise
 * float32, to which they are rounded. If slices have slopes of their own, it has stored samples, and a warning says so.
 * Places in an unknown coordinate system stay as they are.
 *
 * Fails with a RangeError if there is no such level, and as `Volume.read()` does.
 */
export function localVolume(volume: Volume, options?: { level?: number; signal?: AbortSignal }): Promise<LocalVolume>;
