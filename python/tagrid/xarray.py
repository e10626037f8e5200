"""xarray.open_dataset("scan.tag", engine="tagrid") opens .tag files lazily, with coordinates.

xarray finds the engine once the package is installed. Before that, pass engine=tagrid.xarray.TagridBackend.

tagrid.encode(dataset.volume, "part.tag") writes a DataArray with its position, units and attributes. A warning names
what is not kept:

- Evenly spaced coordinates along z, y and x become the affine matrix. Unevenly spaced slices keep their positions.
  Other coordinates along an axis are dropped.
- Of an oblique scan, coordinates are distances, and the attribute "affine" has the position and the directions. Most
  calculations remove attributes, unless xarray.set_options(keep_attrs=True) is set.
- Numbers, strings and short lists of them become metadata, as do coordinates that all samples share. "units" becomes
  "sample units", and scale_factor and add_offset become rescale_slope and rescale_intercept.
- An array with a number for missing samples (_FillValue, missing_value) can only be encoded without loss, because a
  bound would change that number. Floats with NaN, which xarray makes by default (mask_and_scale), have no such limit.
"""

from __future__ import annotations

import os
from typing import Any, Iterable, Union

import numpy as np
import xarray
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.core import indexing

from ._coordinates import coordinate_of
from ._geometry import units_of
from ._labelled import MISSING, missing_of
from ._volume import Rescaled, Volume


class VolumeArray(BackendArray):
    """The samples or values of a volume, decoded on demand."""

    def __init__(self, volume: Union[Volume, Rescaled]):
        self.volume = volume
        self.shape = volume.shape
        self.dtype = volume.dtype

    def __getitem__(self, key: Any) -> Any:
        # Does not use explicit_indexing_adapter(), which misinterprets slices with steps below -1.
        axes = [_along_axis(entry, size) for entry, size in zip(key.tuple, self.shape)]
        read = [positions for positions, _ in axes]
        # A volume accepts one array, here along the axis with the sparsest positions. Other axes read all
        # samples between positions.
        arrays = [axis for axis in range(3) if isinstance(read[axis], np.ndarray)]
        for axis in sorted(arrays, key=lambda axis: float(np.ptp(read[axis])) / len(read[axis]))[:-1]:
            first, last = int(read[axis][0]), int(read[axis][-1])
            axes[axis] = slice(first, last + 1), read[axis][axes[axis][1]] - first
            read[axis] = axes[axis][0]
        samples = self.volume[tuple(read)]
        later = [taken for _, taken in axes]
        if isinstance(key, indexing.VectorizedIndexer):
            adapter = indexing.NumpyIndexingAdapter(samples)
            # Such an index is an attribute since xarray 2024.6.
            return getattr(adapter, "vindex", adapter)[indexing.VectorizedIndexer(tuple(later))]
        for axis in reversed(range(3)):
            samples = samples[(slice(None),) * axis + (later[axis],)]
        return samples


def _along_axis(entry: Any, size: int) -> tuple[Any, Any]:
    """The samples to read along an axis, as a slice or ascending positions, and the index among them."""
    if isinstance(entry, slice):
        positions = range(*entry.indices(size))
        upward = positions if positions.step > 0 else positions[::-1]
        read = slice(upward.start, upward.stop, upward.step) if len(upward) else slice(0, 0)
        return read, slice(None) if positions.step > 0 else slice(None, None, -1)
    array = np.asarray(entry)
    if array.size == 0:
        return slice(0, 0), array.astype(np.intp)
    if array.min() < -size or array.max() >= size:
        raise IndexError(f"positions from {array.min()} to {array.max()} are out of bounds for an axis with size {size}")
    found, index = np.unique(np.where(array < 0, array + size, array), return_inverse=True)
    return (found, index.reshape(array.shape)) if array.ndim else (slice(int(found[0]), int(found[0]) + 1), 0)


class TagridBackend(BackendEntrypoint):
    """engine="tagrid": a dataset with the variable "volume" (z, y, x), and coordinates in the units of the
    scan, usually mm. They are world coordinates if the axes of the scan are world axes, and otherwise
    distances from the first sample. Attributes hold the affine matrix, the bound and the measured errors.

    rescaled: the array has values, as in Volume.rescaled, instead of stored samples.
    """

    description = "CT volumes in .tag files"
    url = "docs/python.md"
    open_dataset_parameters = ("filename_or_obj", "drop_variables", "threads", "rescaled")

    def open_dataset(self, filename_or_obj: Any, drop_variables: Union[str, Iterable[str], None] = None,
                     threads: int = 0, rescaled: bool = False) -> xarray.Dataset:
        volume = Volume(filename_or_obj, threads)
        array: Union[Volume, Rescaled] = volume.rescaled if rescaled else volume
        attributes = {"max_error": array.max_error, "achieved_max_error": array.achieved["max_error"],
                      "affine": volume.affine.ravel().tolist(), **_attributes_of(array)}
        data = xarray.Variable(("z", "y", "x"), indexing.LazilyIndexedArray(VolumeArray(array)), attributes,
                               {"preferred_chunks": dict(zip("zyx", volume.aligned_chunks()))})
        variables = {"volume": data}
        for axis, name in enumerate("zyx"):
            places, meaning = coordinate_of(volume, axis)
            variables[name] = xarray.Variable((name,), places, meaning)
        dropped = {drop_variables} if isinstance(drop_variables, str) else set(drop_variables or ())
        kept = {name: variable for name, variable in variables.items() if name not in dropped}
        dataset = xarray.Dataset({name: kept[name] for name in kept if name == "volume"},
                                 {name: kept[name] for name in kept if name != "volume"})
        dataset.set_close(volume.close)
        return dataset

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        return isinstance(filename_or_obj, (str, os.PathLike)) and os.fspath(filename_or_obj).endswith(".tag")


def _attributes_of(array: Union[Volume, Rescaled]) -> dict[str, Any]:
    """The metadata. As in xarray, "units" are the units of samples or values; coordinates have the units of
    positions. Attributes that mark missing samples are numbers."""
    found: dict[str, Any] = dict(array.metadata)
    for name in MISSING:
        number = missing_of(found, name)
        if isinstance(array, Rescaled):
            # The file stores it as a sample.
            found.pop(name, None)
            number = None if number is None else array.value_of(number)
        if number is not None and _fits(number, array.dtype):
            found[name] = array.dtype.type(number)
    if len(units_of({"units": found.get("units", "")}) or ()) == 3:
        del found["units"]
    if "sample units" in found:
        found["units"] = found.pop("sample units")
    if isinstance(array, Rescaled) and "rescale_units" in found:
        found["units"] = found.pop("rescale_units")
    return found


def _fits(number: float, dtype: np.dtype[Any]) -> bool:
    """Whether a sample of this type can have this value; floats may lose digits."""
    if dtype.kind == "f":
        return True
    return number.is_integer() and bool(np.iinfo(dtype).min <= number <= np.iinfo(dtype).max)
