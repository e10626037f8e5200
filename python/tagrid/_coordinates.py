"""Coordinates along the axes of a volume, as xarray, OME-Zarr and napari have them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ._geometry import distances_of, units_of
from ._volume import Volume


class Coordinate(NamedTuple):
    """One number for each sample along an axis, and its attributes "units" and "long_name"."""

    places: npt.NDArray[Any]
    attributes: dict[str, str]


def is_along_world(volume: Volume) -> bool:
    """Whether the axes of the scan are world axes."""
    directions = volume.affine[:3, :3]
    return bool(np.count_nonzero(directions) == 3 and np.all(np.diag(directions) != 0))


def coordinate_of(volume: Volume, axis: int) -> Coordinate:
    """The coordinates along axis 0 (z), 1 (y) or 2 (x). They are world positions if the axes of the scan are
    world axes, and otherwise distances from the first sample. If the spacing is unknown, they are sample
    numbers."""
    spacing, numbers = volume.spacing[axis], np.arange(volume.shape[axis])
    if np.isnan(spacing):
        return Coordinate(numbers, {"units": "1", "long_name": "sample"})
    slices = volume.slice_positions if axis == 0 else None
    if is_along_world(volume):
        step, origin = volume.affine[2 - axis, 2 - axis], volume.affine[2 - axis, 3]
        places = origin + numbers * step if slices is None else slices[:, 2]
        meaning = "position in the world"
    else:
        places = numbers * spacing if slices is None else distances_of(slices)
        meaning = "distance from the first sample"
    units = units_of(volume.metadata)
    return Coordinate(places, {"units": "mm" if units is None else units[axis], "long_name": meaning})


#: OME-Zarr's names of units in files.
_UNITS = {"m": "meter", "cm": "centimeter", "mm": "millimeter", "um": "micrometer", "\u00b5m": "micrometer",
          "\u03bcm": "micrometer", "micron": "micrometer", "nm": "nanometer", "A": "angstrom", "in": "inch"}


def ome_units(volume: Volume) -> list[dict[str, str]]:
    """The unit of each axis; none if the spacing is unknown, or the unit has no name in OME-Zarr."""
    units = units_of(volume.metadata) or ["mm"] * 3
    names = [unit if unit in _UNITS.values() else _UNITS.get(unit) for unit in units]
    return [{} if name is None or math.isnan(step) else {"unit": name} for name, step in zip(names, volume.spacing)]


def scale_and_translation(volume: Volume) -> tuple[list[float], list[float]]:
    """The scale and the translation along z, y and x."""
    if is_along_world(volume):
        steps, places = np.diag(volume.affine)[2::-1], volume.affine[2::-1, 3]
        return [float(step) for step in steps], [float(place) for place in places]
    return [1.0 if math.isnan(step) else step for step in volume.spacing], [0.0, 0.0, 0.0]
