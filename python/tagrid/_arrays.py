"""Splits arrays of any library into slabs of slices for the encoder."""

from __future__ import annotations

import bisect
import operator
from itertools import accumulate, pairwise
from typing import Any, Iterator

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError
from ._volume import Volume

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")
#: Slabs that have to be copied or loaded are about this large, and at least one slice.
_SLAB_BYTES = 1 << 22
#: The usual edge of a brick: the encoder takes this many slices at a time anyway.
_SLAB_SLICES = 64


def checked_dtype(dtype: npt.DTypeLike) -> np.dtype[Any]:
    """The type in native byte order. TypeError: a volume cannot have such samples."""
    native = np.dtype(dtype).newbyteorder("=")
    if native.name not in TYPES:
        near = {"bool": "uint8", "int64": "int32", "uint64": "uint32", "float16": "float32"}.get(native.name)
        advice = f"convert them, for example by array.astype(numpy.{near or 'float64'})"
        if native.kind == "c":
            advice = "encode array.real and array.imag, each for itself"
        elif native.kind in "mM":
            advice = "a volume has numbers, and no dates or durations"
        elif native.kind not in "biuf":
            advice = "a volume has one number for each voxel"
        raise TypeError(f"samples of the type {native.name} cannot be encoded; the types are {', '.join(TYPES)}; {advice}")
    return native


def checked_shape(shape: Any) -> tuple[int, int, int]:
    try:
        sizes = tuple(operator.index(size) for size in shape)
    except TypeError:
        raise ArgumentError(f"a shape is three whole numbers (z, y, x), not {shape!r}") from None
    if len(sizes) != 3:
        advice = {2: "; one slice is a volume of one slice: array[numpy.newaxis]",
                  4: "; encode one volume at a time, such as array[0]"}.get(len(sizes), "")
        raise ArgumentError(f"a volume has three axes z, y, x, but the shape is {sizes}{advice}")
    if max(sizes) > 2**31:
        raise ArgumentError(f"a volume has at most 2^31 samples along each axis, but the shape is {sizes}")
    if min(sizes) < 1:
        raise ArgumentError(f"a volume has at least one sample along each axis, but the shape is {sizes}")
    return sizes[0], sizes[1], sizes[2]


def as_volume(data: Any) -> Any:
    """Returns an array, or an object with shape, dtype and slices that is loaded slab by slab (h5py, zarr,
    dask, Volume)."""
    if isinstance(data, np.ma.MaskedArray):
        raise TypeError("a masked array cannot be encoded; fill it first: array.filled(value)")
    is_lazy = all(hasattr(data, name) for name in ("shape", "dtype", "__getitem__"))
    if not is_lazy and not isinstance(data, (list, tuple)) and not hasattr(data, "__array__"):
        raise TypeError(f"cannot encode {type(data).__name__!r}: give an array with the axes z, y, x (of numpy, h5py, zarr, "
                        "dask ...), a Volume, or the path of a .tag file; slices that come one by one are for tagrid.Writer")
    array = data if is_lazy else np.asarray(data)
    checked_dtype(array.dtype)
    checked_shape(array.shape)
    dims = getattr(array, "dims", None)
    if isinstance(dims, tuple) and dims != ("z", "y", "x") and set(dims) == {"z", "y", "x"}:
        raise ArgumentError(f"the axes of the array are {', '.join(dims)}, and those of a volume z, y, x; give "
                            "array.transpose('z', 'y', 'x')")
    return array


def with_three_axes(chunk: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Reshapes a chunk to three axes: those longer than 1, after axes of 1."""
    long = [size for size in chunk.shape if size != 1]
    if len(long) > 3:
        raise TypeError(f"a chunk of the shape {chunk.shape} has more than three axes that are longer than 1")
    return chunk.reshape([1] * (3 - len(long)) + long)


def slabs_of(volume: Any) -> Iterator[npt.NDArray[Any]]:
    """Yields the slices in order. Arrays in native byte order are not copied."""
    dtype = checked_dtype(volume.dtype)
    for first, last in pairwise(_borders(volume, dtype)):
        yield _slab(volume, dtype, first, last)


class AnySamples:
    """Reads the samples of a volume in any order, and caches the last slab."""

    def __init__(self, volume: Any):
        self._volume, self._dtype = volume, checked_dtype(volume.dtype)
        self._borders = _borders(volume, self._dtype)
        self._first, self._last, self._slab = 0, 0, np.empty(0, self._dtype)

    def read(self, first: int, count: int) -> npt.NDArray[Any]:
        """Returns samples first .. first + count - 1, x fastest."""
        found = np.empty(count, self._dtype)
        of_slice, done = self._volume.shape[1] * self._volume.shape[2], 0
        while done < count:
            self._load((first + done) // of_slice)
            begin = first + done - self._first * of_slice
            part = self._slab[begin:begin + count - done]
            found[done:done + len(part)] = part
            done += len(part)
        return found

    def _load(self, z: int) -> None:
        if self._first <= z < self._last:
            return
        after = bisect.bisect_right(self._borders, z)
        self._first, self._last = self._borders[after - 1], self._borders[after]
        self._slab = _slab(self._volume, self._dtype, self._first, self._last).reshape(-1)


def _slab(volume: Any, dtype: np.dtype[Any], first: int, last: int) -> npt.NDArray[Any]:
    loaded = volume[first:last]
    if hasattr(loaded, "compute"):
        # numpy would drop the masks of dask chunks.
        loaded = loaded.compute()
    if isinstance(loaded, np.ma.MaskedArray) and np.any(loaded.mask):
        raise TypeError(f"slices {first} to {last - 1} are masked in part; fill them first")
    slab = np.asarray(loaded)
    if slab.dtype.newbyteorder("=") != dtype:
        # A conversion here could wrap around or lose fractions.
        raise TypeError(f"slices {first} to {last - 1} are {slab.dtype.name}, where the array says {dtype.name}; convert it "
                        f"first, for example by array.astype({slab.dtype.name!r})")
    return slab if slab.dtype == dtype and slab.dtype.isnative else slab.astype(dtype)


def _borders(volume: Any, dtype: np.dtype[Any]) -> list[int]:
    """The borders of slabs. Each chunk of another library is loaded once."""
    size = int(volume.shape[0])
    if isinstance(volume, Volume):
        return [0, *accumulate(volume.aligned_chunks(1)[0])]
    chunks = getattr(volume, "chunks", None)
    if chunks and not isinstance(chunks[0], (int, np.integer)):
        return [0, *accumulate(map(int, chunks[0]))]
    if isinstance(volume, np.ndarray) and volume.dtype.isnative:
        thickness = _SLAB_SLICES
    elif chunks:
        thickness = int(chunks[0])
    else:
        thickness = min(_SLAB_SLICES, _SLAB_BYTES // (volume.shape[1] * volume.shape[2] * dtype.itemsize))
    return [*range(0, size, max(1, thickness)), size]
