#!/usr/bin/python3
"""python3 tools/research/bench/low_rates.py TAGRID DATA [VOLUME ...]

Bits per voxel that `encode --psnr` takes for real volumes: of the file, and of the values alone. DATA has NRRD headers
of volumes; see docs/dev/decisions/0049-transform.md, whose table this makes. If sperr3d is installed, its bits are beside
them. Also the time of decoding per voxel, with one thread, start and output included.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import numpy

PSNRS = (37, 42, 47, 52)


def header_of(path):
    """Sizes and the type of an NRRD header."""
    text = path.read_text()
    sizes = re.search(r"^sizes: (.*)$", text, re.MULTILINE)[1].split()
    return [int(n) for n in sizes], re.search(r"^type: (.*)$", text, re.MULTILINE)[1]


def seconds(command):
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def measured(program, volume, psnr, folder):
    """A row of the table."""
    tag, raw = folder / "a.tag", folder / "a.nrrd"
    subprocess.run([program, "encode", volume, "--psnr", str(psnr), "--grid", "derived", "-q", "-f", "-o", tag],
                   check=True)
    info = json.loads(subprocess.run([program, "info", tag, "--json"], check=True, stdout=subprocess.PIPE).stdout)
    sizes, _ = header_of(volume)
    voxels = sizes[0] * sizes[1] * sizes[2]
    decoding = seconds([program, "decode", tag, "-q", "-f", "--threads", "1", "-o", raw])
    return {"psnr": info["achieved"]["psnr"], "max_error": info["achieved"]["max_error"],
            "file": 8 * tag.stat().st_size / voxels, "values": 8 * info["bytes"]["values"] / voxels,
            "decode ns": 1e9 * decoding / voxels}


def sperr_bits(volume, psnr, folder):
    """Those of SPERR, or None if it is not installed. It reads floats."""
    if shutil.which("sperr3d") is None:
        return None
    sizes, kind = header_of(volume)
    samples = numpy.fromfile(volume.with_suffix(".raw"), {"uint8": "u1", "int16": "<i2", "uint16": "<u2"}[kind])
    floats, packed = folder / "a.f32", folder / "a.sperr"
    samples.astype("<f4").tofile(floats)
    subprocess.run(["sperr3d", "-c", "--ftype", "32", "--dims", *map(str, sizes), "--chunks", "256", "256", "256",
                    "--psnr", str(psnr), "--bitstream", packed, floats], check=True, stdout=subprocess.DEVNULL)
    return 8 * packed.stat().st_size / samples.size


def main():
    program, data = sys.argv[1], pathlib.Path(sys.argv[2])
    volumes = [data / f"{name}.nhdr" for name in sys.argv[3:]] or sorted(data.glob("*.nhdr"))
    print("| volume | dB | reached | largest error | bits of the file | of the values | SPERR | decode, ns a voxel |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for volume in volumes:
            for psnr in PSNRS:
                row = measured(program, volume, psnr, pathlib.Path(folder))
                sperr = sperr_bits(volume, psnr, pathlib.Path(folder))
                cells = (volume.stem, psnr, f"{row['psnr']:.2f}", f"{row['max_error']:g}", f"{row['file']:.4f}",
                         f"{row['values']:.4f}", "–" if sperr is None else f"{sperr:.4f}", f"{row['decode ns']:.0f}")
                print("| " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
