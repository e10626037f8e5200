"""A codec for the chunks of Zarr 2 arrays: zarr.array(samples, compressor=tagrid.numcodecs.Tagrid(max_error=5)); with the
library zarr 3 also zarr_format=2.

Zarr finds the codec by its name, "tagrid", once the package is installed. Before that, import this module to read
arrays.
"""

from __future__ import annotations

import warnings
from typing import Any, Optional

import numpy as np
from numcodecs.abc import Codec
from numcodecs.compat import ndarray_copy
from numcodecs.registry import register_codec

from ._arguments import EFFORTS, GRIDS, finite_bound, flag, number, one_of, whole_number
from ._errors import ArgumentError
from ._lattice import decode_chunk, encode_chunk
from ._volume import Volume

#: Marks arrays whose samples do not have native byte order.
_ORDER = "zarr_byte_order"


class _Decoded(np.ndarray[Any, Any]):
    """What decode() returned. Zarr writes part of a chunk into it, or into a copy (Zarr 3), and encodes that again."""


class Tagrid(Codec):
    """Each chunk becomes a .tag file. Chunks have one of the eight types of samples, and at most three axes
    longer than one sample. Edges of 64 samples or more are best.

    max_error: no sample is off by more than this; 0: lossless. Do not combine a bound with Zarr filters
    (Delta and others): they add up the errors, or produce numbers without a known bound.
    whole_chunks: promises that every chunk is written once and completely. Chunks with a bound then take
    fewer bytes, and partial writes are refused. Without it, the bound holds however chunks are written. A
    chunk that is written in parts is encoded once for each part, with a warning.
    fill_value: a sample that marks missing data, such as _FillValue. It comes back unchanged, even with a
    bound. Do not combine it with whole_chunks. Non-finite floats always come back unchanged.
    effort, grid, threads: as for tagrid.encode().

    Without whole_chunks, samples are rounded to a fixed lattice, as tagrid.hdf5.Filter does.
    """

    codec_id = "tagrid"

    def __init__(self, max_error: float = 0, effort: str = "default", grid: str = "derived", threads: int = 0,
                 whole_chunks: bool = False, fill_value: float = 0):
        # The configuration becomes JSON, which does not support numpy numbers.
        self.max_error = finite_bound(max_error)
        one_of("effort", effort, EFFORTS)
        one_of("grid", grid, GRIDS)
        self.effort = effort
        self.grid = grid
        self.threads = whole_number("threads", threads)
        self.whole_chunks = flag("whole_chunks", whole_chunks)
        self.fill_value = number("fill_value", fill_value)
        if self.whole_chunks and self.max_error > 0 and self.fill_value != 0:
            raise ArgumentError("a fill_value is not kept within a bound where chunks are written as a whole; give one of both")

    def get_config(self) -> dict[str, Any]:
        return {"id": self.codec_id, "max_error": self.max_error, "effort": self.effort, "grid": self.grid,
                "whole_chunks": self.whole_chunks, "fill_value": self.fill_value}

    def encode(self, buf: Any) -> bytes:
        if isinstance(buf, _Decoded):
            self._accept_part(buf)
        samples = np.asarray(buf)
        # Zarr passes chunks in C or Fortran order, and expects their bytes in memory order.
        if not samples.flags.c_contiguous and samples.flags.f_contiguous:
            samples = samples.T
        order = {} if samples.dtype.isnative else {_ORDER: samples.dtype.byteorder}
        return encode_chunk(samples, self.max_error, self.whole_chunks, self._fill_in(samples.dtype), order,
                            effort=self.effort, grid=self.grid, threads=self.threads)

    def decode(self, buf: Any, out: Optional[Any] = None) -> Any:
        with Volume(memoryview(buf), self.threads) as volume:
            samples = decode_chunk(volume)
            order = volume.metadata.get(_ORDER)
        if order:
            samples = samples.astype(samples.dtype.newbyteorder(">" if order == ">" else "<"))
        if out is not None:
            return ndarray_copy(samples.ravel(), out)
        return samples.ravel().view(_Decoded)

    def _fill_in(self, dtype: np.dtype[Any]) -> Any:
        """The fill value in the type of the samples. ArgumentError: it does not fit."""
        if dtype.kind == "f":
            return dtype.type(self.fill_value)
        if dtype.kind in "iu" and not (self.fill_value.is_integer()
                                       and np.iinfo(dtype).min <= self.fill_value <= np.iinfo(dtype).max):
            raise ArgumentError(f"the samples are {dtype.name}, and cannot be the fill_value {self.fill_value:g}")
        return self.fill_value

    def _accept_part(self, samples: np.ndarray[Any, Any]) -> None:
        """Warns about a chunk that was decoded, partly written, and is encoded again.

        ArgumentError: its bound would not hold.
        """
        if self.whole_chunks and self.max_error > 0:
            raise ArgumentError(f"a part of a chunk of {samples.size} samples is written, but the codec has whole_chunks=True: the "
                                "errors of two encodings would add up. Write whole chunks, or make the array without whole_chunks")
        warnings.warn(f"a part of a chunk of {samples.size} samples is written, so the chunk is decoded and encoded again. This "
                      "takes time; align what is written with the chunks (dask: array.rechunk(target.chunks))",
                      stacklevel=3)


# Entry points do the same once the package is installed.
register_codec(Tagrid)
