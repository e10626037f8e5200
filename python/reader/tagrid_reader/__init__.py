"""Reads CT volumes in .tag files, region by region: as the package tagrid does, without what writes them.

>>> import tagrid_reader
>>> with tagrid_reader.open("scan.tag") as scan:             # doctest: +SKIP
...     print(scan.shape, scan.dtype, scan.spacing, scan[40:60, ::2, 5].mean())

Axes are z, y, x, as in numpy. World coordinates are x, y, z. Lengths are in the units of the scan, usually
mm.
"""

from typing import Any

from ._errors import ArgumentError, DamagedError, Error, InputError, MemoryLimitError, NewerFormatError
from ._reading import Rescaled, Volume
from ._version import VERSION as _VERSION

__version__ = _VERSION.replace("-rc.", "rc")  # as PEP 440 spells it
__all__ = ["ArgumentError", "DamagedError", "Error", "InputError", "MemoryLimitError", "NewerFormatError", "Rescaled",
           "Volume", "open"]

# Errors and help() show tagrid_reader.DamagedError, not the private module that defines it.
for _thing in (ArgumentError, DamagedError, Error, InputError, MemoryLimitError, NewerFormatError, Rescaled, Volume):
    _thing.__module__ = __name__


def open(source: Any, threads: int = 0) -> Volume:  # noqa: A001: as gzip.open()
    """Opens a .tag file. Reads its header and index now, and its samples on demand.

    source: a path; a seekable binary file object, whose reads are guarded by a lock; bytes, bytearray or
        memoryview; or any object with read_at(offset, size) and size. read_at() returns bytes and must allow
        concurrent calls. size is a number or a method.
    threads: the default for each call; 0: all processors that the process may use.

    DamagedError: the file is damaged, or not a .tag file. OSError: it cannot be read. Exceptions from
    read_at() propagate.
    """
    return Volume(source, threads)
