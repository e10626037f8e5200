"""What Volume.mesh() is asked for, if it is a mesh of materials."""

from __future__ import annotations

import math
import tempfile
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np

from ._arguments import number, one_of, whole_number
from ._errors import ArgumentError
from ._meshes import MaterialMesh

#: Names of materials, and the values from the first up to the second one, None for no limit.
Materials = Mapping[str, Sequence[Optional[float]]]
#: The names of labels; True: all labels but 0.
Labels = Union[Mapping[int, str], bool]
Size = Union[None, float, tuple[float, float]]


def requested(materials: Optional[Materials], labels: Optional[Labels], size: Size, smooth: Optional[float],
              parts: Union[None, str, float], angles: int, order: int
              ) -> tuple[dict[str, Any], list[tuple[str, float, float, int]]]:
    """The options and the materials for the extension. TypeError, ArgumentError: as the arguments are."""
    if (materials is None) == (labels is None or labels is False):
        raise ArgumentError("a mesh is of materials or of labels: give one of them")
    if smooth is not None and materials is not None:
        raise ArgumentError("smooth applies only to labels")
    if angles not in (9, 15):
        raise ArgumentError(f"angles must be 9 or 15, not {angles!r}")
    fine, coarse = _size(size)
    options: dict[str, Any] = {
        "labels": materials is None, "smooth": 1.0 if smooth is None else number("smooth", smooth), "fine": fine,
        "coarse": coarse, "best_angles": angles == 15, "order": whole_number("order", order),
        "largest": parts == "largest", "least_volume": 0.0, "folder": tempfile.gettempdir()}
    if isinstance(parts, str):
        one_of("parts", parts, ["largest"])
    elif parts is not None:
        options["least_volume"] = number("parts", parts)
        if not options["least_volume"] > 0:
            raise ArgumentError(f"parts must be \"largest\" or a volume greater than 0, not {parts!r}")
    for name, given in (("materials", materials), ("labels", None if labels is True else labels)):
        if given is not None and not isinstance(given, Mapping):
            raise TypeError(f"{name} must be a dictionary, not {given!r}")
    if materials is not None:
        return options, [(str(name), *_range(name, values), 0) for name, values in materials.items()]
    named = {} if labels is True or labels is None else dict(labels)  # type: ignore[arg-type]
    return options, [(str(name), 0.0, 0.0, whole_number("a label", label)) for label, name in named.items()]


def _size(size: Size) -> tuple[float, float]:
    if size is None:
        return 0.0, 0.0
    lengths = list(size) if isinstance(size, (tuple, list)) else [size]
    if len(lengths) not in (1, 2):
        raise ArgumentError(f"size must be a length or a pair (fine, coarse), not {size!r}")
    found = [number("size", length) for length in lengths]
    if not all(0 < length < math.inf for length in found):
        raise ArgumentError(f"size must be greater than 0, not {size!r}")
    return found[0], found[1] if len(found) > 1 else 0.0


def _range(name: str, values: Sequence[Optional[float]]) -> tuple[float, float]:
    try:
        low, high = values
    except (TypeError, ValueError):
        raise TypeError(f"materials[{name!r}] must be a pair (low, high), not {values!r}") from None
    return (-math.inf if low is None else number(name, low)), (math.inf if high is None else number(name, high))


def made(points: Any, materials: list[tuple[str, int, Any]], surfaces: list[tuple[str, Any]], order: int) -> MaterialMesh:
    """The mesh that the extension returned."""
    groups, first = {}, 0
    for name, _, cells in materials:
        groups[name] = slice(first, first + len(cells))
        first += len(cells)
    nothing = np.empty((0, 10 if order == 2 else 4), np.int64)
    return MaterialMesh(points, np.concatenate([nothing, *(cells for _, _, cells in materials)]),
                        np.concatenate([np.empty(0, np.int64), *(np.full(len(cells), label, np.int64)
                                                                  for _, label, cells in materials)]),
                        groups, dict(surfaces))
