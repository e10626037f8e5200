#!/usr/bin/python3
"""Compares HDF5 filters on volumes, at the same largest error.

    export HDF5_PLUGIN_PATH=build/release/hdf5_plugins:/usr/lib/x86_64-linux-gnu/hdf5/serial/plugins
    tools/research/hdf5_filters.py VOLUME.nhdr [...] [--errors 0,2,10]

Prints a table in Markdown. Every filter gets the same chunks of 64 x 64 x 64 samples, of a file in memory; the seconds are
CPU seconds of the process, the least of some runs. zfp and SZ3 are for floats: they get float32 samples, and E + 0.49, the
loosest bound that still rounds to within E. gzip (after shuffle) takes part at E = 0. Every file is read back, and its
largest error is checked.

Needs h5py (python3-h5py). The filters of zfp (hdf5-filter-plugin-zfp-serial) and SZ3 take part where HDF5 finds them.
"""

import argparse
import io
import pathlib
import struct
import time

import h5py
import numpy

TAGRID, ZFP, SZ3 = 33184, 32013, 32024
TYPES = {"uchar": "u1", "uint8": "u1", "unsigned char": "u1", "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2", "unsigned short": "u2"}


def volume_of(header):
    """The samples of a detached raw NRRD volume, z first."""
    lines = header.read_text(errors="replace").split("\n\n")[0].splitlines()
    fields = dict(line.split(": ", 1) for line in lines if ": " in line and not line.startswith("#"))
    type = numpy.dtype(TYPES[fields["type"]]).newbyteorder(">" if fields.get("endian") == "big" else "<")
    dims = [int(n) for n in fields["sizes"].split()]
    data = numpy.fromfile(header.parent / fields["data file"].strip(), type, offset=int(fields.get("byte skip", 0)))
    return data.reshape(dims[::-1]).astype(type.newbyteorder("<"))


def sz3(error):
    """SZ3's configuration as numbers: an absolute bound for its default algorithm. The filter fills in type and size."""
    packed = struct.pack("<3BQ2Bd2B2IB", 40, 0, 0, 0, 1, 0, error, 0b10100000, 0, 65536, 0, 0)
    return {"compression": SZ3, "compression_opts": struct.unpack("<8I", packed)}


def zfp(error):
    """zfp's numbers: its fixed-accuracy mode."""
    return {"compression": ZFP, "compression_opts": (3, 0) + struct.unpack("<2I", struct.pack("<d", error))}


def filters(error):
    """Names, options of create_dataset, and whether samples must be floats, of the filters that are installed."""
    # Each chunk is written once, as a whole.
    bound = struct.unpack("<2I", struct.pack("<d", error))
    yield "tagrid", {"compression": TAGRID, "compression_opts": bound + (0, 1)}, False
    if error == 0:
        yield "shuffle + gzip", {"compression": "gzip", "shuffle": True}, False
        return
    for name, number, options in [("zfp", ZFP, zfp), ("SZ3", SZ3, sz3)]:
        if h5py.h5z.filter_avail(number):
            yield name, options(error + 0.49), True


def measure(data, options, as_floats, repetitions):
    """Bytes, CPU seconds to write and to read, and the samples that come back."""
    given = data.astype("f4") if as_floats else data
    writes, reads = [], []
    for _ in range(repetitions):
        memory = io.BytesIO()
        start = time.process_time()
        with h5py.File(memory, "w") as file:
            size = [min(64, n) for n in data.shape]
            file.create_dataset("a", data=given, chunks=tuple(size), **options)
        writes.append(time.process_time() - start)
        with h5py.File(memory) as file:
            stored = file["a"].id.get_storage_size()
            start = time.process_time()
            found = file["a"][...]
            reads.append(time.process_time() - start)
    if as_floats:
        limits = numpy.iinfo(data.dtype)
        found = numpy.clip(numpy.rint(found), limits.min, limits.max).astype(data.dtype)
    return stored, min(writes), min(reads), found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("volumes", nargs="+", type=pathlib.Path)
    parser.add_argument("--errors", default="0,2,10")
    parser.add_argument("--repetitions", type=int, default=3)
    arguments = parser.parse_args()
    print("| volume | E | filter | bits per voxel | write, ns per voxel | read, ns per voxel |\n| --- | --- | --- | --- | --- | --- |")
    for path in arguments.volumes:
        data = volume_of(path)
        for error in map(int, arguments.errors.split(",")):
            for name, options, as_floats in filters(error):
                stored, write, read, found = measure(data, options, as_floats, arguments.repetitions)
                off = numpy.abs(found.astype("i4") - data.astype("i4")).max()
                kept = "" if off <= error else f" (off by {off}!)"
                per_voxel = 1e9 / data.size
                print(f"| {path.stem} | {error} | {name}{kept} | {8 * stored / data.size:.3f} | {write * per_voxel:.1f} | {read * per_voxel:.1f} |", flush=True)


main()
