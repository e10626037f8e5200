"""Caches recently decoded samples, for consecutive slices.

A slice intersects entire bricks, so v[0], v[1], v[2] ... would decode each brick 64 times.
"""

from __future__ import annotations

import os
import threading
import weakref
from typing import Any, Callable, Optional

import numpy as np
import numpy.typing as npt

#: For all volumes of the process together.
MOST_BYTES = 1 << 28

#: Samples [low, high) along z, y and x.
Box = tuple[tuple[int, int], ...]


class KeptBox:
    """A cached box of complete bricks of one volume. It is cached when two consecutive reads need the same
    bricks. A single slice therefore takes no more memory than its samples."""

    def __init__(self) -> None:
        self._kept: Optional[tuple[Box, npt.NDArray[Any]]] = None
        self._met_last: Optional[Box] = None
        self._loading = threading.Lock()

    def read(self, box: Box, part: Box, out: npt.NDArray[Any], load: Callable[[Box], npt.NDArray[Any]]) -> bool:
        """Copies the samples of `part` to `out`. Returns False if they are not cached, and were not loaded
        either. `box`: the complete bricks around `part`."""
        kept = self._kept
        if kept is not None and not all(low <= a and b <= high for (a, b), (low, high) in zip(box, kept[0])):
            kept = None  # frees its memory for the other box
        if kept is None:
            kept = self._loaded(box, out.dtype.itemsize, load)
        if kept is None:
            return False
        begins, samples = [low for low, _ in kept[0]], kept[1]
        out[...] = samples[tuple(slice(a - begin, b - begin) for (a, b), begin in zip(part, begins))]
        _touch(self)
        return True

    def forget(self) -> None:
        self._kept = None
        with _turn:
            _sizes.pop(self, None)

    def _loaded(self, box: Box, sample_bytes: int, load: Callable[[Box], npt.NDArray[Any]]) -> Any:
        size = int(np.prod([high - low for low, high in box], dtype=np.int64)) * sample_bytes
        again, self._met_last = box == self._met_last, box
        # If another thread is loading, this one does not cache, so only one such box exists at a time.
        if not again or size > MOST_BYTES or not self._loading.acquire(blocking=False):
            return None
        try:
            self.forget()
            _make_room(self, size)
            self._kept = box, load(box)
            return self._kept
        except BaseException:
            self.forget()
            raise
        finally:
            self._loading.release()


#: The bytes of each box, in order of use.
_sizes: weakref.WeakKeyDictionary[KeptBox, int] = weakref.WeakKeyDictionary()
_turn = threading.Lock()


def _touch(box: KeptBox) -> None:
    with _turn:
        size = _sizes.pop(box, None)
        if size is not None:
            _sizes[box] = size


def _make_room(box: KeptBox, size: int) -> None:
    """Counts a box, and drops the least recently used ones."""
    with _turn:
        others = list(_sizes.items())
        free = MOST_BYTES - size - sum(bytes_of for _, bytes_of in others)
        for other, bytes_of in others:
            if free >= 0:
                break
            other._kept = None
            del _sizes[other]
            free += bytes_of
        _sizes[box] = size


def _after_fork() -> None:
    global _turn
    _turn = threading.Lock()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    # Another thread may have held the lock at that moment.
    os.register_at_fork(after_in_child=_after_fork)
