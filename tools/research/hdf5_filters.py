#!/usr/bin/python3
"""Compares HDF5 filters on volumes, at the same largest error.

    export HDF5_PLUGIN_PATH=build/release/hdf5_plugins:/usr/lib/x86_64-linux-gnu/hdf5/serial/plugins
    tools/research/hdf5_filters.py VOLUME.nhdr [...] [--errors 0,2,10]

Prints a table in Markdown. Every filter gets the same chunks of 64 x 64 x 64 samples, of a file in memory; the seconds
are CPU seconds of the process, the least of some runs. zfp and SZ3 are for floats: they get float32 samples and
E + 0.49, the loosest bound that still rounds to within E. gzip (after shuffle) takes part at E = 0. Every file is read
back, and its largest error is checked.

Needs h5py (python3-h5py). The filters of zfp (hdf5-filter-plugin-zfp-serial) and SZ3 take part where HDF5 finds them.
"""

import argparse
import io
import struct
import time

import h5py
import numpy

import nrrd
from markdown import print_table
from running import main, numbers

TAGRID, ZFP, SZ3 = 33184, 32013, 32024


def halves_of(error):
    """The bits of a double as two numbers."""
    return struct.unpack("<2I", struct.pack("<d", error))


def numbers_of_sz3(error):
    """SZ3's configuration: an absolute bound for its default algorithm. The filter fills in type and size."""
    return struct.unpack("<8I", struct.pack("<3BQ2Bd2B2IB", 40, 0, 0, 0, 1, 0, error, 0b10100000, 0, 65536, 0, 0))


def filters(error):
    """Names, options of create_dataset, and whether samples must be floats, of the filters that are installed."""
    # Each chunk is written once and completely.
    yield "tagrid", {"compression": TAGRID, "compression_opts": (*halves_of(error), 0, 1)}, False
    if error == 0:
        yield "shuffle + gzip", {"compression": "gzip", "shuffle": True}, False
        return
    # zfp's fixed-accuracy mode is 3.
    for name, number, given in (("zfp", ZFP, (3, 0, *halves_of(error + 0.49))), ("SZ3", SZ3, numbers_of_sz3(error + 0.49))):
        if h5py.h5z.filter_avail(number):
            yield name, {"compression": number, "compression_opts": given}, True


def measure(data, options, as_floats, repetitions):
    """Bytes, CPU seconds to write and to read, and the samples that come back."""
    given = data.astype("f4") if as_floats else data
    writes, reads = [], []
    for _ in range(repetitions):
        memory = io.BytesIO()
        start = time.process_time()
        with h5py.File(memory, "w") as file:
            file.create_dataset("a", data=given, chunks=tuple(min(64, n) for n in data.shape), **options)
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


def rows(options):
    for volume in map(nrrd.read, options.volumes):
        data = numpy.array(volume.samples())
        for error in options.errors:
            for name, settings, as_floats in filters(error):
                stored, write, read, found = measure(data, settings, as_floats, options.repetitions)
                off = numpy.abs(found.astype("i4") - data.astype("i4")).max()
                kept = "" if off <= error else f" (off by {off}!)"
                yield (volume.name, error, name + kept, f"{8 * stored / data.size:.3f}", f"{1e9 * write / data.size:.1f}",
                       f"{1e9 * read / data.size:.1f}")


def run():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("volumes", nargs="+")
    parser.add_argument("--errors", type=numbers, default=[0, 2, 10])
    parser.add_argument("--repetitions", type=int, default=3)
    print_table(["volume", "E", "filter", "bits per voxel", "write, ns per voxel", "read, ns per voxel"],
                rows(parser.parse_args()))


main("hdf5_filters.py", run)
