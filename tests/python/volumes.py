"""What the tests of the Python package share: volumes, a source in memory, a directory, threads, libraries."""

import importlib
import pathlib
import tempfile
import threading
import unittest

import numpy as np

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")


def blobs(shape, dtype="int16", seed=1):
    """Smooth values with some noise, (z, y, x), that use some of the range of the type."""
    random = np.random.default_rng(seed)
    z, y, x = np.meshgrid(*(np.linspace(0, 3, n) for n in shape), indexing="ij")
    field = np.sin(2 * x + 1) * np.cos(3 * y) + np.sin(z * y) + random.normal(0, 0.01, shape)
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        return (100 * field).astype(dtype)
    high = min(np.iinfo(dtype).max, 2000)
    low = max(np.iinfo(dtype).min, -1000)
    return (low + (field + 2.2) / 4.4 * (high - low)).astype(dtype)


class Source:
    """A file in memory that counts its reads, and the bytes that are read."""

    def __init__(self, data):
        self.data, self.size, self.reads, self.bytes = data, len(data), 0, 0

    def read_at(self, offset, size):
        self.reads += 1
        self.bytes += size
        return self.data[offset:offset + size]


def module(name):
    """A module that a test needs; without it, the test is skipped."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise unittest.SkipTest(f"there is no {name.split('.')[0]}") from None


def temporary_folder(test):
    """A directory that is removed at the end of the test, or of the class of tests."""
    folder = tempfile.TemporaryDirectory()
    (test.addClassCleanup if isinstance(test, type) else test.addCleanup)(folder.cleanup)
    return pathlib.Path(folder.name)


def in_threads(work, seeds):
    """Calls work(seed) for all of them at once, and waits for their ends."""
    threads = [threading.Thread(target=work, args=(seed,)) for seed in seeds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
