"""A volume as programs give it back from as many bytes, and where it is homogeneous."""

import subprocess

import numpy


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def at_psnr(psnr, programs, volume, samples, folder):
    """The size of a file of tagrid, and what it decodes to."""
    tag, out = folder / "a.tag", folder / "a.raw"
    run(programs / "tagrid", "encode", volume, "--psnr", psnr, "--grid", "derived", "-q", "-f", "-o", tag)
    run(programs / "tagrid", "decode", tag, "--samples", "-q", "-f", "-o", out)
    return tag.stat().st_size, numpy.fromfile(out, samples.dtype).reshape(samples.shape)


def by_tagrid(programs, volume, samples, size, folder):
    """The highest PSNR that takes no more than this size."""
    low, high = 30.0, 94.0
    while high - low > 0.1:
        middle = (low + high) / 2
        low, high = (middle, high) if at_psnr(middle, programs, volume, samples, folder)[0] <= size else (low, middle)
    return at_psnr(low, programs, volume, samples, folder)


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


def homogeneous(samples):
    """The cube of 16 samples that varies least and is not air: its mean is above the middle of the usual values."""
    best, least = None, numpy.percentile(samples, (1, 99)).mean()
    for corner in numpy.ndindex(*((n - 16) // 8 + 1 for n in samples.shape)):
        at = tuple(slice(8 * c, 8 * c + 16) for c in corner)
        cube = samples[at].astype(float)
        if cube.mean() > least and (best is None or cube.std() < best[0]):
            best = cube.std(), at
    return best[1]
