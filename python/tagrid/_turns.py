"""Locks that a forked process finds free: the thread that had one of them is not in that process."""

from __future__ import annotations

import os
import threading
import weakref


class Turn:
    """A lock, for `with`. `losses` counts how often the process was forked while it was taken: what it guards may be
    half done then."""

    def __init__(self) -> None:
        self.losses = 0
        self._lock = threading.Lock()
        self._held = self._lock
        _turns.add(self)

    def __enter__(self) -> Turn:
        lock = self._lock
        lock.acquire()
        self._held = lock
        return self

    def __exit__(self, *_: object) -> None:
        # Not the new lock, if the process forked while this thread had the old one.
        self._held.release()


_turns: weakref.WeakSet[Turn] = weakref.WeakSet()


def _after_fork() -> None:
    for turn in list(_turns):
        if turn._lock.locked():
            turn.losses += 1
            turn._lock = threading.Lock()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_after_fork)
