"""The values of samples, slope * sample + intercept, as `tagrid decode --values` writes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Iterator, NamedTuple, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError, DamagedError
from ._geometry import rescale_of
from ._regions import Region, runs_of

if TYPE_CHECKING:
    from ._volume import Volume

#: Values are computed in float64, this many at a time.
_AT_ONCE = 1 << 20


class _Rule(NamedTuple):
    """How samples become values of a type: with one slope and intercept, or with those of each slice (slices,
    1, 1)."""

    dtype: np.dtype[Any]
    slope: Any
    intercept: Any
    #: The smallest and the largest possible sample of the file.
    low: float
    high: float

    @property
    def is_of_slices(self) -> bool:
        return isinstance(self.slope, np.ndarray)


class Rescaled:
    """The values of a volume, such as HU: an array v[z, y, x] of slope * sample + intercept. Volume.rescaled
    returns it. A slice reads and decodes only the bricks that it intersects.

    Values have the first of these types that holds all of them exactly: int16, uint16, int32, uint32. If the
    slope or the intercept has a fraction, if samples are floats, or if none of these types holds all values,
    values are float32. They are float64 if samples are float64. Without a slope and an intercept, values equal samples.
    """

    ndim = 3

    def __init__(self, volume: Volume):
        self.volume = volume
        self._rule = _rule_of(volume)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Values along z, y and x."""
        return self.volume.shape

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of the values, for any region."""
        return self._rule.dtype

    def __len__(self) -> int:
        return len(self.volume)

    def __repr__(self) -> str:
        return f"<tagrid.Rescaled {self.shape} {self.dtype} of {self.volume!r}>"

    def __getitem__(self, key: Any) -> Any:
        """Returns the values v[z, y, x], with the rules of Volume.__getitem__()."""
        return self._values(self.volume[key], key)

    def __iter__(self) -> Iterator[npt.NDArray[Any]]:
        for z, samples in enumerate(self.volume):
            yield self._values(samples, z)

    def __array__(self, dtype: npt.DTypeLike = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        if copy is False:
            raise ValueError("the values of a volume must be computed, which makes a copy")
        values = self.read()
        return values if dtype is None else values.astype(dtype, copy=False)

    def read(self, region: Optional[Region] = None, step: Union[int, Sequence[int]] = 1, *,
             threads: Optional[int] = None, memory_limit: int = 0,
             progress: Optional[Callable[[int, int], object]] = None) -> npt.NDArray[Any]:
        """Returns the values of a region, with the arguments of Volume.read()."""
        runs = runs_of(region, step, self.shape)
        samples = self.volume.read(region, step, threads=threads, memory_limit=memory_limit, progress=progress)
        values: npt.NDArray[Any] = self._values(samples, tuple(slice(*run) for run in runs))
        return values

    def value_of(self, sample: float) -> Optional[float]:
        """The value of a sample; None if it differs between slices."""
        return None if self._rule.is_of_slices else float(self._rule.slope * sample + self._rule.intercept)

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata of the volume. "applied_slope" and "applied_intercept" record how samples became
        values, as in files that `tagrid decode --values` writes."""
        found = dict(self.volume.metadata)
        slope, intercept = (1.0, 0.0) if self._rule.is_of_slices else (self._rule.slope, self._rule.intercept)
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

    @property
    def max_error(self) -> float:
        """The bound in values: that of the volume times the largest slope."""
        return self.volume.max_error * float(np.max(np.abs(self._rule.slope)))

    @property
    def achieved(self) -> dict[str, float]:
        """The measured errors of values, as Volume.achieved has those of samples. If each slice has its own
        slope, these are upper limits."""
        slope = float(np.max(np.abs(self._rule.slope)))
        return {name: error if name == "psnr" else error * slope for name, error in self.volume.achieved.items()}

    def __dask_tokenize__(self) -> Any:
        return "tagrid.Rescaled", self.volume.__dask_tokenize__()

    def _values(self, samples: Any, key: Any) -> Any:
        """The values of the samples volume[key]."""
        rule = self._rule
        if not rule.is_of_slices and (rule.slope, rule.intercept) == (1, 0):
            return samples
        found = np.asarray(samples)
        if rule.dtype.kind != "f":
            return self._integers(found, key)
        slope, intercept = rule.slope, rule.intercept
        if rule.is_of_slices:
            slope, intercept = (np.broadcast_to(number, self.shape)[key] for number in (slope, intercept))
        if found.ndim == 0:
            return (slope * found.astype(np.float64) + intercept).astype(rule.dtype)[()]
        values = np.empty(found.shape, rule.dtype)
        rows = max(1, _AT_ONCE * len(found) // max(1, found.size))
        for first in range(0, len(found), rows):
            part = slice(first, first + rows)
            factor, offset = (slope[part], intercept[part]) if rule.is_of_slices else (slope, intercept)
            values[part] = factor * found[part].astype(np.float64) + offset
        return values

    def _integers(self, samples: npt.NDArray[Any], key: Any) -> Any:
        """Integers, exactly: intermediate results may overflow, but the value fits the type."""
        rule = self._rule
        if samples.size and not (rule.low <= samples.min() and samples.max() <= rule.high):
            raise DamagedError(f"{self.volume!r}: a sample exceeds the range in the index")
        slope, intercept = (np.asarray(number).astype(np.int64).astype(rule.dtype) for number in (rule.slope, rule.intercept))
        if rule.is_of_slices:
            slope, intercept = (np.broadcast_to(number, self.shape)[key] for number in (slope, intercept))
        values = samples.astype(rule.dtype)
        values *= slope
        values += intercept
        return values if values.ndim else values[()]


def _rule_of(volume: Volume) -> _Rule:
    """ArgumentError: there are slopes for slices, but not one for each slice."""
    dtype, metadata = volume.dtype, volume.metadata
    low, high = _range_of(volume)
    slope: Any
    intercept: Any
    if "slice_slopes" in metadata:
        slope, intercept = (_numbers_of(metadata.get(name, otherwise), volume) for name, otherwise in (
            ("slice_slopes", ""), ("slice_intercepts", "0 " * volume.shape[0])))
    else:
        slope, intercept = rescale_of(metadata)
        if (slope, intercept) == (1, 0):
            return _Rule(dtype, slope, intercept, low, high)
    return _Rule(_type_of_values(dtype, slope, intercept, low, high), slope, intercept, low, high)


def _range_of(volume: Volume) -> tuple[float, float]:
    """The range of finite samples that a decoded volume can have."""
    limits: Any = np.finfo(volume.dtype) if volume.dtype.kind == "f" else np.iinfo(volume.dtype)
    least, most = float(limits.min), float(limits.max)
    low, high = volume.info["low"], volume.info["high"]
    if not low <= high:
        return least, most
    error = volume.achieved["max_error"]
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


def _numbers_of(text: str, volume: Volume) -> npt.NDArray[np.float64]:
    try:
        numbers = np.array(text.split(), dtype=np.float64)
    except ValueError:
        numbers = np.empty(0)
    if len(numbers) != volume.shape[0] or not np.isfinite(numbers).all():
        raise ArgumentError(f"{volume!r}: slices have slopes of their own (slice_slopes), but there is not one number for "
                            f"each of {volume.shape[0]} slices, so their values are not known")
    return numbers.reshape(-1, 1, 1)
