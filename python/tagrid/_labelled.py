"""What arrays of other libraries store besides their samples: the position and attributes of an xarray
DataArray, and numbers that mark missing samples. A warning names what cannot be kept."""

from __future__ import annotations

import math
from typing import Any, Mapping, NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError, warn_caller
from ._geometry import FIELDS, PLACES, Metadata, distances_of, header_of, is_key, slice_positions_of
from ._volume import Volume

#: Attributes of the backend tagrid.xarray that are not copied. A new file has its own, or coordinates give
#: them.
_OF_THE_FILE = ("affine", "achieved_max_error", "slice_positions", "space", "space units", "space origin")
#: Names in a .tag file for attributes of the CF conventions.
_NAMES = {"units": "sample units", "scale_factor": "rescale_slope", "add_offset": "rescale_intercept",
          "max_error": "source_max_error"}
#: Attributes with the number that marks missing samples.
MISSING = ("_FillValue", "missing_value")


class Label(NamedTuple):
    """What encode() keeps of an array, as its arguments."""

    spacing: Optional[list[float]] = None
    affine: Optional[npt.NDArray[np.float64]] = None
    metadata: Optional[Metadata] = None


def check_missing(data: Any, max_error: Optional[float]) -> None:
    """ArgumentError: a number marks missing samples, and a bound would change it."""
    attributes = data.metadata if isinstance(data, Volume) else getattr(data, "attrs", None)
    if max_error == 0 or not isinstance(attributes, Mapping):
        return
    for name in MISSING:
        found = missing_of(attributes, name)
        if found is not None and math.isfinite(found):
            raise ArgumentError(f"the attribute {name} says that {found:g} stands for missing samples, and a bound makes other numbers "
                                "of it. Encode with max_error=0; or give floats with NaN for missing samples, which come back as they "
                                f"are; or remove the attribute if it does not matter (del array.attrs[{name!r}])")


def missing_of(attributes: Mapping[str, Any], name: str) -> Optional[float]:
    """The number that marks missing samples; None if there is none."""
    try:
        return float(np.asarray(attributes[name]).ravel()[0])
    except (KeyError, IndexError, TypeError, ValueError):
        return None


def label_of(data: Any, takes_place: bool, metadata: Optional[Metadata]) -> Label:
    """The position of a DataArray with the axes z, y, x, unless takes_place is False, and its attributes,
    unless metadata is given. For other arrays, only this metadata."""
    if getattr(data, "dims", None) != ("z", "y", "x") or not hasattr(data, "coords"):
        return Label(metadata=metadata)
    if isinstance(metadata, str):
        # Header lines are kept unchanged.
        spacing, affine, _ = label_of(data, takes_place, {})
        return Label(spacing, affine, metadata)
    pairs = _attributes(data) if metadata is None else dict(metadata)
    if not takes_place:
        return Label(metadata=pairs or None)
    axes = [_Axis(data, name) for name in "zyx"]
    if not any(axis.is_placed for axis in axes):
        if "space" in data.attrs:
            _warn("the distances of samples are unknown, and the coordinate system is not kept (space)")
        return Label(metadata=pairs or None)
    pairs = {**_units(axes), **pairs}
    if not all(axis.is_placed and not axis.is_distance for axis in axes):
        return _turned(data, axes, pairs)
    _keep_space(data, pairs)
    steps = [axis.step for axis in axes]
    if axes[0].is_uneven:
        y, x = (axis.places[0] for axis in axes[1:])
        _keep_positions(np.array([(x, y, z) for z in axes[0].places]), pairs)
    origin = [axis.places[0] for axis in axes]
    unknown = [axis for axis in axes if math.isnan(axis.step)]
    if unknown and all(axis.step > 0 for axis in axes if axis not in unknown):
        # An affine matrix cannot express an unknown spacing.
        lines = header_of(steps, None, pairs)
        dimension = "" if "space" in pairs else "space dimension: 3\n"
        return Label(metadata=f"{dimension}{lines}space origin: ({','.join(map(repr, origin[::-1]))})\n")
    for axis in unknown:
        _warn(f"the distance of samples along {axis.name} is unknown, and is taken as 1")
    affine = np.diag([*(1.0 if math.isnan(step) else step for step in steps[::-1]), 1.0])
    affine[:3, 3] = origin[::-1]
    return Label(None, affine, pairs or None)


def _turned(data: Any, axes: list[_Axis], pairs: dict[str, str]) -> Label:
    """The position of a DataArray whose coordinates are distances along axes that are not world axes, such as
    those of an oblique scan. The backend's attributes "affine" and "slice_positions" give the position of its
    file."""
    matrix = _matrix_of(data.attrs.get("affine"))
    slices = _positions_at(data.attrs.get("slice_positions"), axes[0]) if axes[0].is_distance else None
    is_known = all(axis.is_distance and (len(axis.places) == 1 or not math.isnan(axis.step)) for axis in axes)
    if matrix is None or not is_known or (axes[0].is_uneven and slices is None):
        if axes[0].is_uneven:
            _warn("the coordinates along z are left out: they are not at equal distances")
        _warn("only the distances of samples are kept; position, directions and coordinate system (affine, space) are not. Give "
              "affine= to say where samples are")
        return Label([math.nan if axis.is_uneven else abs(axis.step) for axis in axes], None, pairs or None)
    affine = matrix.copy()
    for column, axis in enumerate(axes[::-1]):
        along, length = matrix[:3, column], float(np.linalg.norm(matrix[:3, column]))
        if axis is axes[0] and slices is not None:
            affine[:3, 3] += slices[0] - matrix[:3, 3]
        else:
            affine[:3, 3] += along * _whole(axis.places[0] / length)
        if not math.isnan(axis.step):
            affine[:3, column] = along * _whole(axis.step / length)
    if slices is not None and axes[0].is_uneven:
        _keep_positions(slices - slices[0] + affine[:3, 3], pairs)
    _keep_space(data, pairs)
    return Label(None, affine, pairs or None)


def _matrix_of(value: Any) -> Optional[npt.NDArray[np.float64]]:
    """The 4 x 4 matrix of an attribute; None if it is not invertible."""
    try:
        matrix = np.asarray(value, dtype=float).reshape(4, 4)
    except (TypeError, ValueError):
        return None
    return matrix if np.isfinite(matrix).all() and np.linalg.det(matrix) != 0 else None


def _positions_at(text: Any, axis: _Axis) -> Optional[npt.NDArray[np.float64]]:
    """The positions of first samples in their file, from the distances of these slices; None if unknown."""
    if not isinstance(text, str) or not axis.places:
        return None
    slices = slice_positions_of({"slice_positions": text}, text.count(";") + 1)
    if slices is None:
        return None
    distances = distances_of(slices)
    if min(axis.places) < 0 or max(axis.places) > distances[-1]:
        return None
    return np.stack([np.interp(axis.places, distances, slices[:, i]) for i in range(3)], axis=1)


def _whole(number: float) -> float:
    """Removes the rounding of a division: skipped samples are integer numbers of steps."""
    return float(round(number)) if abs(number - round(number)) < 1e-6 else number


def _keep_space(data: Any, pairs: dict[str, str]) -> None:
    if isinstance(data.attrs.get("space"), str):
        pairs.setdefault("space", data.attrs["space"])


def _keep_positions(slices: npt.NDArray[np.float64], pairs: dict[str, str]) -> None:
    pairs["slice_positions"] = "; ".join(" ".join(repr(float(number)) for number in place) for place in slices)
    _warn("slices lie at unequal distances; the position of each slice is kept, but meshes are built with equal distances")


class _Axis:
    """The coordinates along an axis. step: NaN if unknown."""

    def __init__(self, data: Any, name: str):
        self.name, self.step, self.is_uneven = name, math.nan, False
        self.places: list[float] = []
        coordinate = data.coords[name] if name in data.coords else None
        attributes: Mapping[str, Any] = {} if coordinate is None else coordinate.attrs
        meaning = str(attributes.get("long_name", ""))
        self.units = str(attributes.get("units", "mm"))
        # The backend marks files with unknown spacing in this way.
        self.is_placed = coordinate is not None and not (meaning == "sample" and self.units == "1")
        self.is_distance = meaning.split()[:1] == ["distance"]
        if coordinate is None or not self.is_placed:
            return
        found = np.asarray(coordinate)
        if found.dtype.kind not in "iuf" or not np.isfinite(found).all():
            self.is_placed = False
            _warn(f"the coordinates along {name} are left out: they are not finite numbers")
            return
        self.places = [float(place) for place in found]
        steps = np.diff(self.places)
        if not len(steps):
            return
        mean = (self.places[-1] - self.places[0]) / len(steps)
        if mean != 0 and np.allclose(steps, mean, rtol=1e-4, atol=0):
            self.step = mean
        elif name == "z" and (np.all(steps > 0) or np.all(steps < 0)):
            # As in readers of scans: a typical step, and the position of each slice.
            self.step, self.is_uneven = float(np.median(steps)), True
        else:
            _warn(f"the coordinates along {name} are left out: they are not at equal distances")


def _units(axes: list[_Axis]) -> dict[str, str]:
    """The units of positions; none if all are mm, the default."""
    units = [axis.units for axis in axes[::-1]]
    if set(units) == {"mm"} or any(set(unit) & set('"\\\n\r') or not unit for unit in units):
        return {}
    return {"space units": " ".join(f'"{unit}"' for unit in units)}


def _attributes(data: Any) -> dict[str, str]:
    """Attributes, and coordinates that all samples share, as metadata."""
    found: dict[str, str] = {}
    left_out = [str(name) for name, coordinate in data.coords.items() if name not in ("z", "y", "x")
                and coordinate.ndim > 0]
    common = {name: coordinate.values[()] for name, coordinate in data.coords.items() if coordinate.ndim == 0}
    for name, value in {**common, **data.attrs}.items():
        if name in _OF_THE_FILE or name == "max_error" and value == 0:
            continue
        text, key = _text_of(value), _NAMES.get(name, name)
        if text is None or not is_key(key) or str(key).lower() in PLACES or str(key).startswith("slice_") or (
                "\n" in text and str(key).lower() in FIELDS):
            left_out.append(str(name))
        else:
            found.setdefault(str(key), text)
    if left_out:
        _warn(f"not taken from a DataArray: {', '.join(left_out)}; metadata= says what to keep instead")
    return found


def _text_of(value: Any) -> Optional[str]:
    """A number or a string, or several of them as one line; None for others."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, int, float, np.generic)):
        return None if isinstance(value, np.void) else str(value)
    if not isinstance(value, (list, tuple, np.ndarray)) or np.ndim(value) != 1 or len(value) > 1000:
        return None
    parts = [_text_of(each) for each in value]
    return None if None in parts else " ".join(map(str, parts))


def _warn(message: str) -> None:
    warn_caller(f"tagrid.encode: {message}")
