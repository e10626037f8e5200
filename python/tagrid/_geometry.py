"""World positions of samples, and the NRRD header lines in which a .tag file stores them."""

from __future__ import annotations

import math
import re
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._arguments import numbers
from ._errors import ArgumentError

Metadata = Union[str, Mapping[str, str]]

#: Fields with the positions of samples; Volume.spacing and Volume.affine hold their content.
PLACES = ("spacings", "space directions", "space origin", "space dimension")
#: Other fields of an NRRD header that a .tag file keeps. All other names are keys of the source.
FIELDS = ("space", "space units", "content", "units", "labels", "kinds", "centers", "centerings", "thicknesses",
           "sample units", "measurement frame", "axis mins", "axis maxs")


def affine_of(info: Mapping[str, Any]) -> npt.NDArray[np.float64]:
    """The 4 x 4 matrix from voxels (x, y, z, 1) to the world. Unknown steps are 1, and unknown origins 0."""
    affine = np.eye(4)
    affine[:3, :3] = np.array(info["directions"], dtype=float).T
    affine[:3, 3] = info["origin"] if info["has_origin"] else 0
    return affine


def slice_positions_of(metadata: Mapping[str, str], slices: int) -> Optional[npt.NDArray[np.float64]]:
    """The world position of the first sample of each slice, if the file has it: (slices, 3)."""
    try:
        places = np.array([place.split() for place in metadata.get("slice_positions", "").split(";")], dtype=float)
    except ValueError:
        return None
    return places if places.shape == (slices, 3) and np.isfinite(places).all() else None


def distances_of(slices: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The distance of each slice from the first one, summed along the slices between them."""
    return np.cumsum([0, *np.linalg.norm(np.diff(slices, axis=0), axis=1)])


def metadata_of(header: str) -> dict[str, str]:
    """The lines of an NRRD header as a dictionary, without the positions of samples."""
    found: dict[str, str] = {}
    for line in header.split("\n"):
        if line.startswith("#"):
            continue
        name, _, value = line.partition(":")
        field = name.lower()
        # A key may contain a colon, but not ":=".
        if ":=" not in line or (field in (*PLACES, *FIELDS) and not value.startswith("=")):
            if field not in PLACES and ":" in line:
                found.setdefault(field, value.strip())
        else:
            key, _, text = line.partition(":=")
            found[key] = text.replace("\\\\", "\0").replace("\\n", "\n").replace("\0", "\\")
    return found


def units_of(metadata: Mapping[str, str]) -> Optional[list[str]]:
    """The units of length along z, y and x in the file, such as "mm". None if it has none."""
    for name in ("space units", "units"):
        text = metadata.get(name, "")
        units = re.findall(r'"([^"]*)"', text) if '"' in text else text.split()
        if len(units) == 3 and all(units):
            return units[::-1]
    return None


def rescale_of(metadata: Mapping[str, str]) -> tuple[float, float]:
    """Slope and intercept of the values; 1 and 0 if the file has none. ArgumentError: each slice has its
    own."""
    if "slice_slopes" in metadata:
        raise ArgumentError("each slice has a slope of its own (slice_slopes)")
    try:
        slope, intercept = float(metadata.get("rescale_slope", 1)), float(metadata.get("rescale_intercept", 0))
    except ValueError:
        return 1, 0
    return (slope, intercept) if math.isfinite(slope) and slope != 0 and math.isfinite(intercept) else (1, 0)


def header_of(spacing: Optional[Sequence[float]], affine: Optional[npt.ArrayLike],
              metadata: Optional[Metadata]) -> str:
    """The header lines for a spacing (z, y, x), an affine matrix of voxels x, y, z, and metadata. Metadata is
    a dictionary, or header lines as in Volume.header."""
    steps = _checked_spacing(spacing)
    if isinstance(metadata, str):
        return _places(steps, affine, "space:" in metadata.lower()) + metadata
    if metadata is not None and not isinstance(metadata, Mapping):
        raise TypeError(f"metadata is a dictionary of names and texts, or lines of an NRRD header, not {metadata!r}")
    pairs = {str(key): str(value) for key, value in (metadata or {}).items()}
    space = next((pairs.pop(key) for key in list(pairs) if key.lower() == "space"), None)
    lines = "" if space is None else _field("space", space)
    return lines + _places(steps, affine, space is not None) + "".join(map(_line, pairs.items()))


def header_bytes(header: str) -> bytes:
    """The bytes of header lines. Bytes that are not UTF-8 stay as they were in the file of Volume.header."""
    if "\0" in header:
        raise ArgumentError("metadata: the character NUL cannot be kept")
    return header.encode("utf-8", "surrogateescape")


def _checked_spacing(spacing: Optional[Sequence[float]]) -> Optional[list[float]]:
    if spacing is None:
        return None
    steps = numbers("spacing", spacing, "three numbers (z, y, x)")
    if all(math.isnan(step) for step in steps):
        return None
    if any(step <= 0 or math.isinf(step) for step in steps):
        raise ArgumentError(f"spacing must be three numbers above 0 (z, y, x), not {tuple(steps)}; an affine says which way an axis "
                            "runs")
    return steps[::-1]


def _checked_affine(affine: npt.ArrayLike, steps: Optional[list[float]]) -> npt.NDArray[np.float64]:
    try:
        matrix = np.asarray(affine, dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise ArgumentError("affine must be a 4 x 4 matrix of finite numbers with the last row 0, 0, 0, 1")
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if steps is not None and not np.allclose(lengths, steps, rtol=1e-5):
        raise ArgumentError(f"spacing {steps[::-1]} contradicts affine, whose steps along z, y and x are "
                            f"{lengths[::-1].tolist()}; give one of them")
    return matrix


def _vector(numbers: Any) -> str:
    return "(" + ",".join(repr(float(number)) for number in numbers) + ")"


def _places(steps: Optional[list[float]], affine: Optional[npt.ArrayLike], has_space: bool) -> str:
    dimension = "" if has_space else "space dimension: 3\n"
    if affine is not None:
        matrix = _checked_affine(affine, steps)
        directions = " ".join(_vector(matrix[:3, axis]) for axis in range(3))
        return f"{dimension}space directions: {directions}\nspace origin: {_vector(matrix[:3, 3])}\n"
    if steps is None:
        return ""
    if has_space and not any(math.isnan(step) for step in steps):
        return "space directions: " + " ".join(_vector(row) for row in np.diag(steps)) + "\n"
    return "spacings: " + " ".join(repr(step) for step in steps) + "\n"


def _field(name: str, value: str) -> str:
    if "\n" in value or "\r" in value:
        raise ArgumentError(f"metadata: {name!r} must be one line")
    return f"{name}: {value}\n"


def is_key(key: Any) -> bool:
    """Whether a pair of a header may have this name."""
    return isinstance(key, str) and key != "" and not key.startswith("#") and not any(part in key for part in (":", "\n", "\r"))


def _line(pair: tuple[str, str]) -> str:
    key, value = pair
    if key.lower() in PLACES:
        raise ArgumentError(f"metadata: {key!r} is given by spacing and affine")
    if key.lower() in FIELDS:
        return _field(key, value)
    if not is_key(key):
        raise ArgumentError(f"metadata: {key!r} cannot be a key")
    text = value.replace("\\", "\\\\").replace("\n", "\\n").replace("\r", " ")
    return f"{key}:={text}\n"
