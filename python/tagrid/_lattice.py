"""Chunks of arrays of other libraries as .tag files that can be encoded repeatedly.

HDF5 and Zarr decode and encode a chunk whenever part of it is written. If every encoding added an error of its own, no
bound would hold. A sample is therefore rounded to a lattice that depends only on its type and the bound, not on other
samples. The number of its lattice point is stored losslessly. A rounded sample is a lattice point, so
encoding it again changes nothing. The HDF5 filter does the same (plugins/hdf5/lattice.h).
"""

from __future__ import annotations

import math
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._arrays import checked_dtype, with_three_axes
from ._errors import DamagedError
from ._volume import Volume
from ._writing import encode

_MOST_OTHERS = 8


def step_of(dtype: np.dtype[Any], max_error: float) -> float:
    """The distance between lattice points; 0 if only the sample itself is within the bound. For integers, it is
    2 E + 1, where E is the integer part of the bound. For floats, it is the largest m * 2^n, with m below 32, that is at
    most twice the bound. Its products with small numbers are exact."""
    if dtype.kind != "f":
        whole = math.floor(min(max_error, 2.0**30))
        return 2.0 * whole + 1 if whole >= 1 else 0.0
    twice = 2 * min(max_error, float(np.finfo(np.float64).max) / 4)
    if not twice > 0:
        return 0.0
    # No sample is finer than the smallest number of its type.
    unit = max(math.frexp(twice)[1] - 5, -149 if dtype.itemsize == 4 else -1074)
    return math.ldexp(math.floor(math.ldexp(twice, -unit)), unit)


def encode_chunk(samples: npt.NDArray[Any], max_error: float, whole_chunks: bool, fill: Any, metadata: dict[str, str],
                 **settings: Any) -> bytes:
    """The .tag file of a chunk of any number of axes, at most three of which are longer than 1.

    fill: a sample that marks missing data, and is not rounded.
    whole_chunks: the chunk is written once and completely, and may be encoded without the lattice.
    """
    chunk = with_three_axes(samples)
    dtype = checked_dtype(chunk.dtype)
    if whole_chunks:
        return _encoded(chunk, max_error=max_error, metadata=metadata, **settings)
    step = step_of(dtype, max_error)
    anchor = _anchor(dtype, step, fill)
    found = _numbers(chunk.astype(dtype, copy=False), max_error, step, anchor, fill) if step > 0 else None
    if found is None:
        return _encoded(chunk, metadata=metadata, **settings)
    numbers, others = found
    lattice = {"rescale_slope": repr(step).removesuffix(".0"), "rescale_intercept": str(anchor),
               "lattice": " ".join([dtype.name, *others])}
    return _encoded(numbers, metadata={**lattice, **metadata}, **settings)


def _encoded(chunk: npt.NDArray[Any], **settings: Any) -> bytes:
    # A chunk is read as a whole.
    data: bytes = encode(chunk, overviews="none", **settings)
    return data


def decode_chunk(volume: Volume) -> npt.NDArray[Any]:
    """The samples of a chunk's file, whoever created it. DamagedError: its lattice is invalid."""
    step, dtype = lattice_of(volume)
    samples = volume.read()
    if step == 0:
        return samples
    try:
        anchor = int(volume.metadata.get("rescale_intercept", 0))
    except ValueError:
        raise DamagedError("the chunk's lattice is not understood") from None
    limits: Any = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    with np.errstate(over="ignore"):
        exact = np.clip(anchor + samples.astype(np.float64) * step, limits.min, limits.max)
        places: npt.NDArray[Any] = exact.astype(dtype)
    try:
        for other in volume.metadata["lattice"].split()[1:]:
            number, bits = other.split(":")
            places[samples == int(number)] = np.array(int(bits, 16), f"u{dtype.itemsize}").view(dtype)
    except (ValueError, OverflowError):
        raise DamagedError("the chunk's lattice is not understood") from None
    return places


def lattice_of(volume: Volume) -> tuple[float, np.dtype[Any]]:
    """The step of a chunk's file, 0 if it has unrounded samples, and the type of the samples."""
    metadata = volume.metadata
    if "lattice" not in metadata:
        return 0.0, volume.dtype
    try:
        step, dtype = float(metadata["rescale_slope"]), checked_dtype(metadata["lattice"].split()[0])
        numbers = np.dtype(np.int32) if dtype.kind == "f" else dtype
        if 0 < step < math.inf and volume.dtype == numbers:
            return step, dtype
    except (KeyError, ValueError, IndexError, TypeError):
        pass
    raise DamagedError("the chunk's lattice is not understood")


def _anchor(dtype: np.dtype[Any], step: float, fill: Any) -> int:
    """An integer lattice point, at most half a step from 0, that makes the fill value a lattice point."""
    if dtype.kind == "f" or step == 0:
        return 0
    whole = int(step)
    return (int(fill) + whole // 2) % whole - whole // 2


def _numbers(samples: npt.NDArray[Any], max_error: float, step: float, anchor: int, fill: Any) -> Optional[tuple[npt.NDArray[Any], list[str]]]:
    """The number of each sample's lattice point, and the unrounded samples as "number:bits": NaN, infinities,
    samples too far from 0, the fill value. None if too many different samples are unrounded."""
    if samples.dtype.kind != "f":
        whole = int(step)
        return ((samples.astype(np.int64) + (whole // 2 - anchor)) // whole).astype(samples.dtype), []
    # So that number * step is exact: the step has 5 bits.
    most = 2.0**19 if samples.dtype.itemsize == 4 else 2.0**30
    wide = samples.astype(np.float64)
    with np.errstate(all="ignore"):
        numbers = np.rint(wide / step)
        # The quotient is rounded, so a sample in the middle may have the further lattice point. The
        # difference is exact.
        off = wide - np.clip(numbers * step, np.finfo(samples.dtype).min, np.finfo(samples.dtype).max)
        numbers += np.where(np.abs(off) > max_error, np.sign(off), 0)
        rounded = np.abs(numbers) <= most
        # Where it is a place, it needs no number of its own.
        if math.isfinite(fill) and float(np.rint(float(fill) / step)) * step != float(fill):
            rounded &= samples != samples.dtype.type(fill)
    low = int(numbers[rounded].min()) if rounded.any() else 0
    found = np.where(rounded, numbers, 0).astype(np.int32)
    if rounded.all():
        return found, []
    bits = samples[~rounded].view(f"u{samples.dtype.itemsize}")
    different, first, which = np.unique(bits, return_index=True, return_inverse=True)
    if len(different) > _MOST_OTHERS:
        return None
    # In order of occurrence. Numbers next to those in use keep the range of numbers small.
    order = np.argsort(first)
    places = np.empty(len(different), np.int32)
    places[order] = low - 1 - np.arange(len(different))
    found[~rounded] = places[which]
    return found, [f"{places[i]}:{int(different[i]):x}" for i in order]
