"""Regions of volumes, and the caller's arrays for their samples."""

from __future__ import annotations

import operator
from typing import Any, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._errors import ArgumentError
from ._selection import Run

#: ((z0, z1), (y0, y1), (x0, x1)): samples from z0 up to, but not including, z1. None stands for the end of the volume.
Region = Sequence[Sequence[Optional[int]]]


def runs_of(region: Optional[Region], step: Union[int, Sequence[int]],
            shape: tuple[int, int, int]) -> tuple[Run, Run, Run]:
    """The positions along z, y and x."""
    runs = []
    for name, (first, last), size, every in zip("zyx", _pairs_of(region), shape, _steps_of(step)):
        low, high = 0 if first is None else first, size if last is None else last
        if not 0 <= low < high <= size:
            raise ArgumentError(f"the region has {low}:{high} along {name}, where the volume has 0:{size}; a region "
                                "must be within the volume, and not empty")
        runs.append(Run(low, high, min(every, size)))
    return runs[0], runs[1], runs[2]


def _pairs_of(region: Optional[Region]) -> list[list[Optional[int]]]:
    if region is None:
        return [[None, None]] * 3
    try:
        pairs = [[None if end is None else operator.index(end) for end in pair] for pair in region]
    except TypeError:
        pairs = []
    if len(pairs) != 3 or any(len(pair) != 2 for pair in pairs):
        raise ArgumentError(f"a region is ((z0, z1), (y0, y1), (x0, x1)), whole numbers or None, not {region!r}; "
                            "slices are for volume[z0:z1, y0:y1, x0:x1]")
    return pairs


def _steps_of(step: Union[int, Sequence[int]]) -> tuple[int, ...]:
    try:
        steps = tuple(map(operator.index, step)) if isinstance(step, (Sequence, np.ndarray)) else (operator.index(step),) * 3
    except TypeError:
        steps = ()
    if len(steps) != 3 or min(steps) < 1:
        raise ArgumentError(f"a step is a whole number of at least 1, or three (z, y, x), not {step!r}")
    return steps


def checked_out(out: Any, shape: tuple[int, ...], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """Checks that the caller's array fits samples of this shape and type."""
    try:
        target = np.asarray(out if isinstance(out, np.ndarray) else memoryview(out))
    except TypeError:
        raise TypeError(f"out must be an array that can be filled, not {type(out).__name__!r}") from None
    if target.dtype != dtype or not target.dtype.isnative:
        raise TypeError(f"out has the type {target.dtype.str!r}, and the volume {dtype.str!r}")
    if target.shape != shape:
        raise ArgumentError(f"out has the shape {target.shape}, and the region {shape}")
    if not target.flags.writeable:
        raise ArgumentError("out is read-only")
    return target
