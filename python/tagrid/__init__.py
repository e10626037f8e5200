"""Reads and writes CT volumes in .tag files, region by region, with meshes and surfaces.

>>> import numpy as np, tagrid
>>> scan = np.add.outer(np.arange(40), np.add.outer(np.arange(50), np.arange(60))).astype(np.int16)
>>> volume = tagrid.open(tagrid.encode(scan, max_error=2, spacing=(2.5, 0.5, 0.5)))
>>> volume
<tagrid.Volume 'bytes' (40, 50, 60) int16, max_error 2>
>>> volume.shape, volume.dtype, volume.spacing
((40, 50, 60), dtype('int16'), (2.5, 0.5, 0.5))
>>> part = volume[10:20, ::2, 5]
>>> part.shape, bool(abs(part - scan[10:20, ::2, 5]).max() <= 2)
((10, 25), True)

Axes are z, y, x, as in numpy. World coordinates are x, y, z. Lengths are in the units of the scan, usually
mm.
"""

import importlib as _importlib
from typing import Any

from ._errors import ArgumentError, DamagedError, Error, InputError, MemoryLimitError, NewerFormatError
from ._meshes import MaterialMesh, Mesh, Surface
from ._tagrid import library_version
from ._volume import Rescaled, Volume
from ._writing import Writer, encode, verify

__version__ = library_version().replace("-rc.", "rc")  # as PEP 440 spells it
_MODULES = ("hdf5", "napari", "numcodecs", "paraview", "references", "xarray", "zarr", "zarr_codec")
__all__ = ["ArgumentError", "DamagedError", "Error", "InputError", "MaterialMesh", "MemoryLimitError", "Mesh", "NewerFormatError",
           "Rescaled", "Surface", "Volume", "Writer", "encode", "open", "verify"]

# Errors and help() show tagrid.DamagedError, not the private module that defines it.
for _thing in (ArgumentError, DamagedError, Error, InputError, MaterialMesh, MemoryLimitError, Mesh, NewerFormatError, Rescaled,
               Surface, Volume, Writer, encode, verify):
    _thing.__module__ = __name__


def __getattr__(name: str) -> Any:
    """Imports modules for other libraries on first use: tagrid.hdf5.Filter() needs no further import."""
    if name in _MODULES:
        try:
            return _importlib.import_module(f"{__name__}.{name}")
        except ModuleNotFoundError as error:
            # help() and hasattr() continue if the other library is not installed.
            raise AttributeError(f"{__name__}.{name} cannot be used: {error}") from error
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_MODULES, "__version__"])


def open(source: Any, threads: int = 0) -> Volume:  # noqa: A001: as gzip.open()
    """Opens a .tag file. Reads its header and index now, and its samples on demand.

    source: a path; a seekable binary file object, whose reads are guarded by a lock; bytes, bytearray or
        memoryview; or any object with read_at(offset, size) and size, such as a file on a server. read_at()
        returns bytes and must allow concurrent calls. size is a number or a method.
    threads: the default for each call; 0: all processors that the process may use.

    >>> import numpy, tagrid
    >>> with tagrid.open(tagrid.encode(numpy.zeros((3, 4, 5), numpy.uint8))) as volume:
    ...     int(volume[0, 0, 0])
    0

    DamagedError: the file is damaged, or not a .tag file. OSError: it cannot be read. Exceptions from
    read_at() propagate.
    """
    return Volume(source, threads)
