"""How samples become values, slope * sample + intercept, as `tagrid decode --values` computes them."""

from __future__ import annotations

from typing import Any, Mapping, NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError, DamagedError
from ._geometry import rescale_of

#: Values are computed in float64, this many at a time.
_AT_ONCE = 1 << 20


class Rescaling(NamedTuple):
    """How the samples of a volume become values of a type: with one slope and intercept, or with those of each
    slice (slices, 1, 1)."""

    #: The volume, as errors name it.
    name: str
    shape: tuple[int, int, int]
    dtype: np.dtype[Any]
    slope: Any
    intercept: Any
    #: The smallest and the largest possible sample of the file.
    low: float
    high: float

    @property
    def is_of_slices(self) -> bool:
        return isinstance(self.slope, np.ndarray)

    @property
    def largest_slope(self) -> float:
        return float(np.max(np.abs(self.slope)))

    def value_of(self, sample: float) -> Optional[float]:
        """The value of a sample; None if it differs between slices."""
        return None if self.is_of_slices else float(self.slope * sample + self.intercept)

    def values_of(self, samples: Any, key: Any) -> Any:
        """The values of the samples volume[key]."""
        if not self.is_of_slices and (self.slope, self.intercept) == (1, 0):
            return samples
        found = np.asarray(samples)
        if self.dtype.kind != "f":
            return self._integers(found, key)
        slope, intercept = self.slope, self.intercept
        if self.is_of_slices:
            slope, intercept = (np.broadcast_to(number, self.shape)[key] for number in (slope, intercept))
        if found.ndim == 0:
            return (slope * found.astype(np.float64) + intercept).astype(self.dtype)[()]
        values = np.empty(found.shape, self.dtype)
        rows = max(1, _AT_ONCE * len(found) // max(1, found.size))
        for first in range(0, len(found), rows):
            part = slice(first, first + rows)
            factor, offset = (slope[part], intercept[part]) if self.is_of_slices else (slope, intercept)
            values[part] = factor * found[part].astype(np.float64) + offset
        return values

    def _integers(self, samples: npt.NDArray[Any], key: Any) -> Any:
        """Integers, exactly: intermediate results may overflow, but the value fits the type."""
        if samples.size and not (self.low <= samples.min() and samples.max() <= self.high):
            raise DamagedError(f"{self.name}: a sample exceeds the range in the index")
        slope, intercept = (np.asarray(number).astype(np.int64).astype(self.dtype) for number in (self.slope, self.intercept))
        if self.is_of_slices:
            slope, intercept = (np.broadcast_to(number, self.shape)[key] for number in (slope, intercept))
        values = samples.astype(self.dtype)
        values *= slope
        values += intercept
        return values if values.ndim else values[()]

    def applied_to(self, metadata: Mapping[str, str]) -> dict[str, str]:
        """The metadata of the values: "applied_slope" and "applied_intercept" instead of what is to be applied."""
        found = dict(metadata)
        slope, intercept = (1.0, 0.0) if self.is_of_slices else (self.slope, self.intercept)
        # Samples may already be values of other samples.
        pairs = {"applied_slope": slope * _number_in(found.pop("applied_slope", "1"), 1),
                 "applied_intercept": slope * _number_in(found.pop("applied_intercept", "0"), 0) + intercept}
        if pairs["applied_slope"] != 1 or pairs["applied_intercept"] != 0:
            found.update((name, repr(float(number)).removesuffix(".0")) for name, number in pairs.items()
                         if name != "applied_slope" or number != 1)
        for name in ("rescale_slope", "rescale_intercept"):
            found.pop(name, None)
        for name in ("slopes", "intercepts"):
            if f"slice_{name}" in found:
                found[f"slice_applied_{name}"] = found.pop(f"slice_{name}")
        return found


def rescaling_of(name: str, shape: tuple[int, int, int], info: Mapping[str, Any], metadata: Mapping[str, str]) -> Rescaling:
    """How the samples of a volume become values, by what Volume.info and Volume.metadata say.

    ArgumentError: there are slopes for slices, but not one for each slice.
    """
    dtype: np.dtype[Any] = info["dtype"]
    low, high = _range_of(dtype, info)
    slope: Any
    intercept: Any
    if "slice_slopes" in metadata:
        slope, intercept = (_numbers_of(metadata.get(key, otherwise), name, shape[0]) for key, otherwise in (
            ("slice_slopes", ""), ("slice_intercepts", "0 " * shape[0])))
    else:
        slope, intercept = rescale_of(metadata)
        if (slope, intercept) == (1, 0):
            return Rescaling(name, shape, dtype, slope, intercept, low, high)
    return Rescaling(name, shape, _type_of_values(dtype, slope, intercept, low, high), slope, intercept, low, high)


def _range_of(dtype: np.dtype[Any], info: Mapping[str, Any]) -> tuple[float, float]:
    """The range of finite samples that a decoded volume can have."""
    limits: Any = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    least, most = float(limits.min), float(limits.max)
    low, high = info["low"], info["high"]
    if not low <= high:
        return least, most
    error = info["achieved_max_error"]
    error = error if error > 0 else 0.0
    return max(low - error, least), min(high + error, most)


def _number_in(text: str, otherwise: float) -> float:
    try:
        return float(text)
    except ValueError:
        return otherwise


def _are_whole(numbers: Any) -> bool:
    return bool(np.all((np.floor(numbers) == numbers) & (np.abs(numbers) < 2**53)))


def _type_of_values(dtype: np.dtype[Any], slope: Any, intercept: Any, low: float, high: float) -> np.dtype[Any]:
    """The first type of integers that holds all values exactly; otherwise a float."""
    with np.errstate(over="ignore"):
        products = np.array([slope * low, slope * high])
        ends = products + intercept
    is_exact = bool(np.all((np.asarray(slope) == 1) | (np.abs(products).max(axis=0) < 2**53)))
    if dtype.kind != "f" and _are_whole(slope) and _are_whole(intercept) and is_exact:
        for name in ("int16", "uint16", "int32", "uint32"):
            limits = np.iinfo(name)
            if limits.min <= ends.min() and ends.max() <= limits.max:
                return np.dtype(name)
    is_wide = dtype == np.float64 or not np.abs(ends).max() <= np.finfo(np.float32).max
    return np.dtype(np.float64 if is_wide else np.float32)


def _numbers_of(text: str, name: str, slices: int) -> npt.NDArray[np.float64]:
    try:
        numbers = np.array(text.split(), dtype=np.float64)
    except ValueError:
        numbers = np.empty(0)
    if len(numbers) != slices or not np.isfinite(numbers).all():
        raise ArgumentError(f"{name}: slices have slopes of their own (slice_slopes), but there is not one number for "
                            f"each of {slices} slices, so their values are not known")
    return numbers.reshape(-1, 1, 1)
