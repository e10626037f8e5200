"""A codec for the chunks of Zarr 2 arrays: zarr.array(samples, compressor=tagrid.numcodecs.Tagrid(max_error=5))."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np
from numcodecs.abc import Codec
from numcodecs.compat import ndarray_copy
from numcodecs.registry import register_codec

from ._arguments import EFFORTS, GRIDS, number, one_of, whole_number
from ._arrays import with_three_axes
from ._errors import ArgumentError
from ._volume import Volume
from ._writing import encode

#: Tells arrays whose samples have the byte order of other machines.
_ORDER = "zarr_byte_order"


class Tagrid(Codec):
    """Each chunk becomes a .tag file. Chunks have one of the eight types of samples, and at most three axes that are
    longer than one sample; 64 along each edge or more are best.

    max_error: no sample is further than this from what the codec is given; 0: lossless. With a bound, use no filters of Zarr
    (Delta and others): they add up the errors, or make numbers of which no bound is known. The other arguments are those of
    tagrid.encode().
    """

    codec_id = "tagrid"

    def __init__(self, max_error: float = 0, effort: str = "default", grid: str = "derived", threads: int = 0):
        # The configuration becomes JSON, which knows no numbers of numpy.
        self.max_error = number("max_error", max_error)
        if not 0 <= self.max_error < float("inf"):
            raise ArgumentError(f"max_error is a finite number of at least 0, not {max_error}")
        one_of("effort", effort, EFFORTS)
        one_of("grid", grid, GRIDS)
        self.effort = effort
        self.grid = grid
        self.threads = whole_number("threads", threads)

    def get_config(self) -> dict[str, Any]:
        return {"id": self.codec_id, "max_error": self.max_error, "effort": self.effort, "grid": self.grid}

    def encode(self, buf: Any) -> bytes:
        samples = np.asarray(buf)
        # Zarr gives chunks in C or in Fortran order, and wants their bytes back as they lie in memory.
        if not samples.flags.c_contiguous and samples.flags.f_contiguous:
            samples = samples.T
        order = {} if samples.dtype.isnative else {_ORDER: samples.dtype.byteorder}
        return encode(with_three_axes(samples), max_error=self.max_error, effort=self.effort,
                      grid=self.grid, threads=self.threads, metadata=order)

    def decode(self, buf: Any, out: Optional[Any] = None) -> Any:
        with Volume(memoryview(buf), self.threads) as volume:
            samples = np.asarray(volume)
            order = volume.metadata.get(_ORDER)
        if order:
            samples = samples.astype(samples.dtype.newbyteorder(">" if order == ">" else "<"))
        return ndarray_copy(samples.ravel(), out) if out is not None else samples.ravel()


# Entry points do the same once the package is installed.
register_codec(Tagrid)
