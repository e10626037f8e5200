#!/usr/bin/python3
"""Draws a slice of a volume at a low rate, as tagrid, SPERR and JPEG-LS give it in the same size.

    tools/research/pictures/low_rates.py PROGRAMS VOLUME.nhdr RATIO Z OUT.png [X,Y,WIDTH,HEIGHT]

PROGRAMS is the directory of tagrid and of bench/bench_jpegls, such as build/release. sperr3d must be on the PATH. It
is given the size; tagrid the PSNR that has this size; JPEG-LS the smallest NEAR that does not exceed it. Columns: the
volume, tagrid, SPERR, JPEG-LS. Rows: the part of slice Z, its error (gray is 0, black and white are four times the
rmse of tagrid), and the magnitude of its gradient. It prints bits, PSNR and largest error of each, the standard
deviation in the most homogeneous cube of 16 samples that is not air, and the rmse in the layers at the faces of
tagrid's bricks, divided by that in layers 4 to 12 samples away.
"""

import sys
import tempfile
from pathlib import Path

import numpy
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))
import nrrd
from same_size import by_jpegls, by_sperr, by_tagrid, homogeneous

SCALE = 3
BRICK = 128


def seams(error):
    squares, on, off = error**2, [], []
    for axis, length in enumerate(error.shape):
        for face in range(BRICK, length - 12, BRICK):
            on.append(squares.take([face - 1, face], axis).mean())
            off.append(squares.take([*range(face - 12, face - 4), *range(face + 4, face + 12)], axis).mean())
    return numpy.sqrt(sum(on) / sum(off)) if on else float("nan")


def main():
    programs, volume, out = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[5]
    ratio, z = float(sys.argv[3]), int(sys.argv[4])
    samples = numpy.array(nrrd.read(str(volume)).samples())
    size = samples.nbytes / ratio
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        results = {"original": (samples.nbytes, samples), "tagrid": by_tagrid(programs, volume, samples, size, folder),
                   "SPERR": by_sperr(samples, size, folder), "JPEG-LS": by_jpegls(programs, samples, size, folder)}
    box = [int(n) for n in sys.argv[6].split(",")] if len(sys.argv) > 6 else [0, 0, *samples.shape[:0:-1]]
    part = (slice(box[1], box[1] + box[3]), slice(box[0], box[0] + box[2]))
    cube = homogeneous(samples)
    errors = {name: decoded.astype(float) - samples for name, (_, decoded) in results.items()}
    rmse = {name: float(numpy.sqrt((e**2).mean())) for name, e in errors.items()}
    low, high = numpy.percentile(samples[z][part], (0.5, 99.5))
    rows = [[], [], []]
    for name, (taken, decoded) in results.items():
        shown = decoded[z][part].astype(float)
        gradient = numpy.hypot(*numpy.gradient(shown))
        rows[0].append((shown - low) / (high - low))
        rows[1].append(0.5 + errors[name][z][part] / (8 * rmse["tagrid"]))
        rows[2].append(gradient / ((high - low) / 3))
        if name != "original":
            peak = float(samples.max()) - float(samples.min())
            psnr = 20 * numpy.log10(peak / rmse[name])
            print(f"{name}: {8 * taken / samples.size:.4f} bits a voxel, {psnr:.2f} dB, "
                  f"largest error {abs(errors[name]).max():g}, homogeneous {decoded[cube].std():.2f}, "
                  f"seams {seams(errors[name]):.3f}")
        else:
            print(f"original: homogeneous {samples[cube].std():.2f}")
    page = numpy.concatenate([numpy.concatenate(row, axis=1) for row in rows])
    image = Image.fromarray((numpy.clip(page, 0, 1) * 255).astype(numpy.uint8))
    image = image.resize((image.width * SCALE, image.height * SCALE), Image.NEAREST)
    image.quantize(64).save(out, optimize=True)


if __name__ == "__main__":
    main()
