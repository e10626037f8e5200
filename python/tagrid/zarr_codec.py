"""A codec for the chunks of Zarr 3 arrays.

    zarr.create_array(..., serializer=TagridCodec(max_error=5), compressors=None)

Each chunk is a .tag file. packaging/zarr-extensions/codecs/tagrid/README.md specifies the codec. It needs the library
zarr from 3.0 on. For arrays of Zarr 2, see tagrid.numcodecs.
"""

from __future__ import annotations

import asyncio
import math
import warnings
from dataclasses import dataclass, field
from typing import Any, Mapping

import numpy as np
import numpy.typing as npt
from zarr.abc.codec import ArrayBytesCodec
from zarr.registry import register_codec

from ._arguments import EFFORTS, finite_bound, flag, one_of, whole_number
from ._arrays import checked_dtype, with_three_axes
from ._errors import ArgumentError, DamagedError
from ._lattice import decode_chunk, encode_chunk, lattice_of, step_of
from ._volume import Volume

__all__ = ["TagridCodec"]

_NAME = "tagrid"


class _Decoded(np.ndarray[Any, Any]):
    """What a chunk holds. Zarr writes part of a chunk into a copy of it, and encodes that again."""


@dataclass(frozen=True)
class TagridCodec(ArrayBytesCodec):
    """Turns the samples of a chunk into a .tag file. Samples have one of the eight types that volumes have, and at most
    three axes of a chunk are longer than one sample. Chunks of 64 x 64 x 64 samples are best.

    max_error: no sample is off by more than this; 0: lossless.
    effort: "fast", "default" or "best": trades time for size. It is not needed for decoding.
    whole_chunks: promises that every chunk is written once and completely. Chunks with a bound then take fewer bytes,
        and partial writes are refused. Without it, the bound holds however chunks are written: samples are rounded to a
        fixed lattice. A chunk that is written in parts is encoded once for each part, with a warning.
    threads: of one chunk; 0: as many as the process may use. It is not stored in the metadata of the array.

    The fill value of the array comes back unchanged, even with a bound, and so do floats that are not finite. With a
    bound and whole_chunks, a fill value must be 0 or not finite.
    """

    is_fixed_size = False

    max_error: float = 0.0
    effort: str = "default"
    whole_chunks: bool = False
    threads: int = field(default=0, compare=False)

    def __init__(self, *, max_error: float = 0, effort: str = "default", whole_chunks: bool = False, threads: int = 0):
        one_of("effort", effort, EFFORTS)
        # The object is frozen, as those of Zarr are.
        for name, value in (("max_error", finite_bound(max_error)), ("effort", effort),
                            ("whole_chunks", flag("whole_chunks", whole_chunks)),
                            ("threads", whole_number("threads", threads))):
            object.__setattr__(self, name, value)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TagridCodec:
        """The codec of the metadata of an array. ArgumentError: it has a setting that this version does not know, which
        may change samples."""
        if data.get("name") != _NAME:
            raise ArgumentError(f"the codec is named {data.get('name')!r}, and not {_NAME!r}")
        settings = dict(data.get("configuration") or {})
        unknown = [name for name in settings if name not in ("max_error", "effort", "whole_chunks")]
        if unknown:
            raise ArgumentError(f"the codec tagrid has no setting {unknown[0]!r}; a newer version of tagrid may know "
                                "it")
        return cls(**settings)

    def to_dict(self) -> dict[str, Any]:
        return {"name": _NAME, "configuration": {"max_error": self.max_error, "effort": self.effort,
                                                 "whole_chunks": self.whole_chunks}}

    def validate(self, *, shape: Any, dtype: Any, chunk_grid: Any) -> None:
        """TypeError: volumes have no samples of this type, or chunks have too many axes."""
        checked_dtype(_numpy_type(dtype))
        chunk = getattr(chunk_grid, "chunk_shape", None)
        if chunk is not None and sum(size > 1 for size in chunk) > 3:
            raise TypeError(f"chunks of the shape {tuple(chunk)} have more than three axes that are longer than 1")

    def evolve_from_array_spec(self, array_spec: Any) -> TagridCodec:
        """The codec itself. ArgumentError: the fill value of the array would not be kept."""
        fill = array_spec.fill_value
        if self.whole_chunks and self.max_error > 0 and fill is not None and math.isfinite(fill) and fill != 0:
            raise ArgumentError(f"the fill value {fill} is not kept within a bound where chunks are written as a whole; "
                                "set it to 0, or leave out whole_chunks")
        return self

    def compute_encoded_size(self, input_byte_length: int, chunk_spec: Any) -> int:
        raise NotImplementedError

    # Later versions of zarr call these two directly.
    def _encode_sync(self, chunk_array: Any, chunk_spec: Any) -> Any:
        given = chunk_array.as_ndarray_like()
        if isinstance(given, _Decoded):
            self._accept_part(given)
        samples = np.ascontiguousarray(given)
        fill = _fill_in(samples.dtype, chunk_spec.fill_value)
        data = encode_chunk(samples, self.max_error, self.whole_chunks, fill, {}, effort=self.effort, grid="derived",
                            threads=self.threads)
        return chunk_spec.prototype.buffer.from_bytes(data)

    def _decode_sync(self, chunk_bytes: Any, chunk_spec: Any) -> Any:
        shape, dtype = tuple(chunk_spec.shape), checked_dtype(_numpy_type(chunk_spec.dtype))
        with Volume(chunk_bytes.to_bytes(), self.threads) as volume:
            samples = self._samples(volume, shape, dtype)
        return chunk_spec.prototype.nd_buffer.from_ndarray_like(samples.reshape(shape).view(_Decoded))

    async def _encode_single(self, chunk_data: Any, chunk_spec: Any) -> Any:
        return await asyncio.to_thread(self._encode_sync, chunk_data, chunk_spec)

    async def _decode_single(self, chunk_data: Any, chunk_spec: Any) -> Any:
        return await asyncio.to_thread(self._decode_sync, chunk_data, chunk_spec)

    def _samples(self, volume: Volume, shape: tuple[int, ...], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
        """DamagedError: the file is not a chunk of this array."""
        step, found = lattice_of(volume)
        expected = with_three_axes(np.broadcast_to(np.uint8(0), shape)).shape
        if (volume.volumes, volume.shape, found) != (1, expected, dtype):
            raise DamagedError(f"the chunk is a volume of the shape {volume.shape} and the type {found.name}, where the "
                               f"array has chunks of the shape {shape} and the type {dtype.name}")
        if volume.max_error > self.max_error or step not in (0, step_of(dtype, self.max_error)):
            raise DamagedError(f"the samples of the chunk are not known to be within {self.max_error:g}, the bound of the "
                               "array")
        return decode_chunk(volume)

    def _accept_part(self, samples: npt.NDArray[Any]) -> None:
        """Warns about a chunk that was decoded, partly written, and is encoded again.

        ArgumentError: its bound would not hold.
        """
        if self.whole_chunks and self.max_error > 0:
            raise ArgumentError(f"a part of a chunk of {samples.size} samples is written, but the codec has whole_chunks: "
                                "the errors of two encodings would add up. Write whole chunks, or make the array without "
                                "whole_chunks")
        warnings.warn(f"a part of a chunk of {samples.size} samples is written, so the chunk is decoded and encoded "
                      "again. This takes time; align what is written with the chunks (dask: "
                      "array.rechunk(target.chunks))", stacklevel=3)


def _numpy_type(dtype: Any) -> np.dtype[Any]:
    """Of a numpy type, as zarr 3.0 has it, or of zarr's own, from 3.1 on."""
    return np.dtype(dtype.to_native_dtype() if hasattr(dtype, "to_native_dtype") else dtype)


def _fill_in(dtype: np.dtype[Any], fill: Any) -> Any:
    """The fill value as a sample in native byte order."""
    return dtype.newbyteorder("=").type(0 if fill is None else fill)


# Entry points do the same once the package is installed.
register_codec(_NAME, TagridCodec)
