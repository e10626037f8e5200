#!/usr/bin/python3
"""python3 tools/research/bench/video.py TAGRID DATA psnr|lossless [VOLUME ...]

psnr: files of `tagrid encode --psnr` next to whole stacks that video codecs coded with z as time and one group of pictures,
at equal PSNR. lossless: lossless files next to x265 and JPEG XL. DATA has NRRD headers. Needs ffmpeg with libx265 and libsvtav1,
and cjxl.

Samples are mapped to 0 .. 2^bits - 1: 10 bits for samples of 8 bits and for SVT-AV1, else 12 bits. The PSNR is that of
samples, with the range of the data as peak. Between two qualities on both sides of the PSNR, bits are interpolated on a
logarithmic scale. JPEG XL codes slices, with the effort of 3 to 9 that is best for every eighth slice.
"""

import math
import pathlib
import subprocess
import sys
import tempfile

import numpy

from low_rates import header_of

PSNRS = (37, 42, 47, 52)
TYPES = {"uint8": "u1", "int16": "<i2", "uint16": "<u2"}


def samples_of(volume):
    sizes, kind = header_of(volume)
    return numpy.fromfile(volume.with_suffix(".raw"), TYPES[kind]).reshape(sizes[::-1])


def run(*command, **options):
    return subprocess.run([*map(str, command)], check=True, capture_output=True, **options).stdout


class VideoCodec:
    """A codec of ffmpeg, for one volume."""

    def __init__(self, name, bits, qualities, options):
        self.name, self.bits, self.qualities, self.options = name, bits, qualities, options
        self.points = {}  # bytes and PSNR by quality

    def has_color(self):
        return "svt" in self.name

    def coded(self, samples, options, folder):
        """Bytes, and the decoded samples."""
        low, span = int(samples.min()), int(samples.max()) - int(samples.min())
        top = (1 << self.bits) - 1
        scale = top / span
        levels = numpy.rint((samples.astype("i8") - low) * scale).astype("<u2")
        depth, height, width = levels.shape
        even = numpy.pad(levels, ((0, 0), (0, height % 2), (0, width % 2)), mode="edge")
        form = f"gray{self.bits}le"
        file = folder / "coded.mkv"
        run("ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", form, "-s",
            f"{even.shape[2]}x{even.shape[1]}", "-r", "25", "-i", "-", "-c:v", self.name, "-pix_fmt",
            "yuv420p10le" if self.has_color() else form, *options, file, input=even.tobytes())
        back = run("ffmpeg", "-loglevel", "error", "-i", file, "-f", "rawvideo", "-pix_fmt", form, "-")
        decoded = numpy.frombuffer(back, "<u2").reshape(even.shape)[:, :height, :width]
        # The stream alone: a container is not the codec's.
        size = sum(map(int, run("ffprobe", "-loglevel", "error", "-show_entries", "packet=size", "-of", "csv=p=0",
                                file).decode().replace(",", " ").split()))
        return size, decoded / scale + low

    def at(self, samples, quality, folder):
        size, decoded = self.coded(samples, [part.format(quality) for part in self.options], folder)
        return size, psnr_of(samples, decoded)

    def bits_at(self, samples, wanted, folder):
        """Bits per voxel at a PSNR; None if it is not reached."""
        low, high = self.qualities  # from many bits to few

        def measured(quality):
            if quality not in self.points:
                self.points[quality] = self.at(samples, quality, folder)
            return self.points[quality]

        if measured(low)[1] < wanted:
            return None
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if measured(middle)[1] >= wanted else (low, middle)
        (more, above), (fewer, below) = measured(low), measured(high)
        if above == below:
            return 8 * more / samples.size
        share = (wanted - below) / (above - below)
        return 8 * math.exp(math.log(fewer) + share * (math.log(more) - math.log(fewer))) / samples.size


def psnr_of(samples, decoded):
    off = samples.astype("f8") - numpy.rint(decoded)
    rmse = math.sqrt((off * off).mean())
    return math.inf if rmse == 0 else 20 * math.log10((float(samples.max()) - float(samples.min())) / rmse)


def x265(bits):
    return VideoCodec("libx265", bits, (0, 51), ["-preset", "slow", "-x265-params", "crf={}:keyint=-1:log-level=none"])


def svt_av1():
    return VideoCodec("libsvtav1", 10, (1, 63), ["-preset", "4", "-crf", "{}", "-g", "999999"])


def lossless_x265(samples, folder):
    """Bits per voxel, or None if there are more values than it has."""
    span = int(samples.max()) - int(samples.min())
    bits = next((bits for bits in (8, 10, 12) if span < 1 << bits), None)
    if bits is None:
        return None
    low = int(samples.min())
    levels = (samples.astype("i8") - low).astype("u1" if bits == 8 else "<u2")
    form, file = "gray" if bits == 8 else f"gray{bits}le", folder / "coded.mkv"
    run("ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", form, "-s",
        f"{levels.shape[2]}x{levels.shape[1]}", "-r", "25", "-i", "-", "-c:v", "libx265", "-pix_fmt", form, "-preset",
        "slow", "-x265-params", "lossless=1:keyint=-1:log-level=none", file, input=levels.tobytes())
    back = run("ffmpeg", "-loglevel", "error", "-i", file, "-f", "rawvideo", "-pix_fmt", form, "-")
    assert back == levels.tobytes(), "x265 did not keep every sample"
    return 8 * file.stat().st_size / samples.size


def jpeg_xl(samples, folder):
    """Bits per voxel, and the effort."""
    levels = (samples.astype("i8") - int(samples.min())).astype(">u2")
    top = 255 if int(levels.max()) < 256 else 65535
    header = f"P5\n{levels.shape[2]} {levels.shape[1]}\n{top}\n".encode()

    def bytes_of(slices, effort):
        total = 0
        for slice_ in slices:
            (folder / "a.pgm").write_bytes(header + (slice_.astype("u1") if top == 255 else slice_).tobytes())
            run("cjxl", folder / "a.pgm", folder / "a.jxl", "-d", "0", "-e", effort)
            total += (folder / "a.jxl").stat().st_size
        return total

    best = min(range(3, 10), key=lambda effort: bytes_of(levels[::8], effort))
    return 8 * bytes_of(levels, best) / samples.size, best


def tagrid_bits(program, volume, samples, folder, *options):
    run(program, "encode", volume, *options, "-q", "-f", "-o", folder / "a.tag")
    return 8 * (folder / "a.tag").stat().st_size / samples.size


def cell(bits):
    return "–" if bits is None else f"{bits:.4f}"


def print_rows_at_psnrs(program, volume, samples, folder):
    codecs = x265(10 if samples.itemsize == 1 else 12), svt_av1()
    for psnr in PSNRS:
        own = tagrid_bits(program, volume, samples, folder, "--psnr", psnr)
        others = [codec.bits_at(samples, psnr, folder) for codec in codecs]
        print(f"| {volume.stem} | {psnr} | {cell(own)} | {' | '.join(map(cell, others))} |", flush=True)


def print_lossless_row(program, volume, samples, folder):
    own = [tagrid_bits(program, volume, samples, folder, "--effort", effort) for effort in ("default", "best")]
    xl, effort = jpeg_xl(samples, folder)
    print(f"| {volume.stem} | {' | '.join(map(cell, [*own, lossless_x265(samples, folder)]))} | {cell(xl)} ({effort}) |",
          flush=True)


def main():
    program, data, table = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    volumes = [data / f"{name}.nhdr" for name in sys.argv[4:]] or sorted(data.glob("*.nhdr"))
    head, print_rows = {
        "psnr": ("| volume | dB | tagrid | x265, slow | SVT-AV1, preset 4 |", print_rows_at_psnrs),
        "lossless": ("| volume | tagrid | tagrid, best | x265, slow | JPEG XL (effort) |", print_lossless_row)}[table]
    print(head + "\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        for volume in volumes:
            print_rows(program, volume, samples_of(volume), pathlib.Path(name))


if __name__ == "__main__":
    main()
