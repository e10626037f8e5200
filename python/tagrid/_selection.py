"""numpy indexing for samples that have to be decoded."""

from __future__ import annotations

import operator
from typing import Any, NamedTuple, Sequence

import numpy as np

SUPPORTED = ("integers, slices, Ellipsis, None, and one array of integers, or of one bool for each position, along "
             "one axis; for everything else decode first: numpy.asarray(volume)[...]")


class Run(NamedTuple):
    """Positions along an axis: start, start + step, ..., below stop. At least one, in ascending order."""

    start: int
    stop: int
    step: int

    @property
    def length(self) -> int:
        return len(range(self.start, self.stop, self.step))


class Selection(NamedTuple):
    """The samples to read, and the key to select among them."""

    runs: tuple[list[Run], list[Run], list[Run]]  #: along z, y and x: blocks that are read in turn
    shape: tuple[int, int, int]  #: of the samples that are read
    key: tuple[Any, ...]  #: of the result among these samples


def select(key: Any, shape: Sequence[int], brick: int, first: int) -> Selection:
    """The selection v[key] of a volume of this shape, with bricks of this many samples along each axis, except
    that the first ones have `first`."""
    entries = _with_ellipsis(key if isinstance(key, tuple) else (key,))
    runs: list[list[Run]] = []
    rest: list[Any] = []
    arrays = 0
    for entry in entries:
        if entry is None or entry is Ellipsis:
            rest.append(entry)
            continue
        axis = len(runs)
        found, later = _along_axis(entry, axis, shape[axis], brick, first)
        arrays += isinstance(later, np.ndarray)
        if arrays > 1:
            raise IndexError(f"a volume is indexed with arrays along one axis only; supported are {SUPPORTED}")
        runs.append(found)
        rest.append(later)
    z, y, x = (sum(run.length for run in along) for along in runs)
    return Selection((runs[0], runs[1], runs[2]), (z, y, x), tuple(rest))


def _with_ellipsis(key: tuple[Any, ...]) -> list[Any]:
    """The key with three entries, besides None and Ellipsis. Ellipsis then stands for no axis."""
    ellipses = [i for i, entry in enumerate(key) if entry is Ellipsis]
    if len(ellipses) > 1:
        raise IndexError("an index can only have a single ellipsis ('...')")
    given = sum(entry is not None and entry is not Ellipsis for entry in key)
    if given > 3:
        raise IndexError(f"too many indices: a volume has 3 axes, but {given} were indexed")
    at = ellipses[0] if ellipses else len(key)
    return list(key[:at + 1]) + [slice(None)] * (3 - given) + list(key[at + 1:])


def _along_axis(entry: Any, axis: int, size: int, brick: int, first: int) -> tuple[list[Run], Any]:
    """The samples to read along an axis, and the index among them that gives the result."""
    if isinstance(entry, slice):
        positions = range(*entry.indices(size))
        if positions.step > 0 or len(positions) == 0:
            return _run_of(positions), slice(None)
        return _run_of(positions[::-1]), slice(None, None, -1)
    if isinstance(entry, (bool, np.bool_)):
        raise IndexError(f"a volume is not indexed with a single bool; supported are {SUPPORTED}")
    try:
        position = operator.index(entry)
    except TypeError:
        return _along_array(_positions(entry, axis, size), brick, first)
    position = _checked(position, axis, size)
    return [Run(position, position + 1, 1)], 0


def _positions(entry: Any, axis: int, size: int) -> np.ndarray[Any, Any]:
    """The positions in an array or a list, from 0 up to the size of the axis."""
    if not isinstance(entry, (list, np.ndarray)) and not hasattr(entry, "__array__"):
        raise IndexError(f"a volume is not indexed with {type(entry).__name__!r}; supported are {SUPPORTED}")
    array = np.asarray(entry)
    if array.size == 0 and array.dtype.kind == "f":
        array = array.astype(np.intp)
    if array.dtype.kind == "b":
        if array.ndim != 1:
            raise IndexError(f"a bool array must have one axis; supported are {SUPPORTED}")
        if len(array) != size:
            raise IndexError(f"a bool array of {len(array)} does not fit axis {axis} with size {size}")
        array = np.flatnonzero(array)
    if array.dtype.kind not in "iu":
        raise IndexError(f"a volume is not indexed with arrays of {array.dtype}; supported are {SUPPORTED}")
    if array.size:
        for position in (int(array.min()), int(array.max())):
            _checked(position, axis, size)
    array = array.astype(np.intp)
    return np.where(array < 0, array + size, array)


def _checked(position: int, axis: int, size: int) -> int:
    if not -size <= position < size:
        raise IndexError(f"index {position} is out of bounds for axis {axis} with size {size}")
    return position + size if position < 0 else position


def _run_of(positions: range) -> list[Run]:
    # The step of a single position may be any number.
    step = positions.step if len(positions) > 1 else 1
    return [Run(positions[0], positions[-1] + 1, step)] if len(positions) else []


def _along_array(array: np.ndarray[Any, Any], brick: int, first: int) -> tuple[list[Run], np.ndarray[Any, Any]]:
    """One run for each brick, so that a brick is decoded once. Runs may have more positions than the array,
    but never leave a brick."""
    positions = np.unique(array)
    runs: list[Run] = []
    numbers = np.maximum(positions - first + brick, 0) // brick
    for group in np.split(positions, np.flatnonzero(np.diff(numbers)) + 1):
        if len(group):
            step = int(np.gcd.reduce(np.diff(group))) if len(group) > 1 else 1
            runs.append(Run(int(group[0]), int(group[-1]) + 1, step))
    read = np.concatenate([np.arange(*run) for run in runs]) if runs else positions
    return runs, np.searchsorted(read, array)
