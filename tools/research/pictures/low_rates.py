#!/usr/bin/python3
"""Draws a slice of a volume at a low rate, as tagrid, SPERR and JPEG-LS give it in the same size.

    tools/research/pictures/low_rates.py PROGRAMS VOLUME.nhdr RATIO Z OUT.png [X,Y,WIDTH,HEIGHT]

PROGRAMS is the directory of tagrid and of bench/bench_jpegls, such as build/release. sperr3d must be on the PATH. It is
given the size; tagrid the PSNR that has this size; JPEG-LS the smallest NEAR that does not exceed it. Columns: the volume,
tagrid, SPERR, JPEG-LS. Rows: the part of slice Z, its error (gray is 0, black and white are four times the rmse of
tagrid), and the magnitude of its gradient. It prints bits, PSNR and largest error of each, the standard deviation in the
most homogeneous cube of 16 samples, and the rmse in the layers at the faces of tagrid's bricks, divided by that in layers
4 to 12 samples away.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))
import nrrd

SCALE = 3
BRICK = 128


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def by_tagrid(programs, volume, samples, size, folder):
    """The highest PSNR that takes no more than this size."""
    tag, out, low, high = folder / "a.tag", folder / "a.raw", 30.0, 62.0
    while high - low > 0.1:
        middle = (low + high) / 2
        run(programs / "tagrid", "encode", volume, "--psnr", middle, "--grid", "derived", "-q", "-f", "-o", tag)
        low, high = (middle, high) if tag.stat().st_size <= size else (low, middle)
    run(programs / "tagrid", "encode", volume, "--psnr", low, "--grid", "derived", "-q", "-f", "-o", tag)
    run(programs / "tagrid", "decode", tag, "--samples", "-q", "-f", "-o", out)
    return tag.stat().st_size, numpy.fromfile(out, samples.dtype).reshape(samples.shape)


def by_sperr(samples, size, folder):
    floats, packed, out = folder / "a.f32", folder / "a.sperr", folder / "a.out"
    samples.astype("<f4").tofile(floats)
    dims = samples.shape[::-1]
    rate = 8 * size / samples.size
    run("sperr3d", "-c", "--ftype", 32, "--dims", *dims, "--bpp", rate, "--bitstream", packed, floats)
    run("sperr3d", "-d", "--decomp_f", out, packed)
    decoded = numpy.rint(numpy.fromfile(out, "<f4")).reshape(samples.shape)
    limits = numpy.iinfo(samples.dtype)
    return packed.stat().st_size, numpy.clip(decoded, limits.min, limits.max)


def by_jpegls(programs, samples, size, folder):
    raw, packed, out = folder / "b.raw", folder / "b.jls", folder / "b.out"
    lowest = int(samples.min())
    shifted = (samples.astype(numpy.int64) - lowest).astype("u1" if samples.dtype.itemsize == 1 else "<u2")
    shifted.tofile(raw)
    bits = max(int(shifted.max()).bit_length(), 2)
    height, width = samples.shape[1:]
    low, high = 0, (1 << bits) // 2 - 1
    while low < high:
        near = (low + high) // 2
        run(programs / "bench/bench_jpegls", "encode", width, height, bits, min(near, 255), raw, packed)
        low, high = (low, near) if packed.stat().st_size <= size or near >= 255 else (near + 1, high)
    run(programs / "bench/bench_jpegls", "encode", width, height, bits, min(low, 255), raw, packed)
    run(programs / "bench/bench_jpegls", "decode", packed, out)
    return packed.stat().st_size, numpy.fromfile(out, shifted.dtype).reshape(samples.shape).astype(int) + lowest


def seams(error):
    squares, on, off = error**2, [], []
    for axis, length in enumerate(error.shape):
        for face in range(BRICK, length - 12, BRICK):
            on.append(squares.take([face - 1, face], axis).mean())
            off.append(squares.take([*range(face - 12, face - 4), *range(face + 4, face + 12)], axis).mean())
    return numpy.sqrt(sum(on) / sum(off)) if on else float("nan")


def homogeneous(samples):
    """The cube of 16 samples that varies least, of those above the median."""
    best = None
    for corner in numpy.ndindex(*(max((n - 16) // 8, 1) for n in samples.shape)):
        at = tuple(slice(8 * c, 8 * c + 16) for c in corner)
        cube = samples[at].astype(float)
        if cube.mean() > numpy.median(samples) + 1 and (best is None or cube.std() < best[0]):
            best = cube.std(), at
    return best[1] if best else tuple(slice(0, 16) for _ in range(3))


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
