"""The exceptions of the package, and its warnings."""

import sys
import warnings


class Error(Exception):
    """A tagrid call failed. The message says what, where, and how to fix it."""


class ArgumentError(Error, ValueError):
    """An argument is invalid or conflicts with another one, or the volume is closed."""


class DamagedError(Error, ValueError):
    """The file is damaged, truncated, or not a .tag file. Samples of a damaged brick are never returned."""


class NewerFormatError(Error, ValueError):
    """The file is not damaged, but needs a newer version of tagrid."""


class InputError(Error, OSError):
    """Bytes cannot be read or written."""


class MemoryLimitError(Error, MemoryError):
    """Memory ran out, or the memory limit is too small. The message gives a sufficient limit."""


def warn_caller(message: str) -> None:
    """Warns at the line that called this package."""
    depth, frame = 1, sys._getframe(0)
    while frame.f_back is not None and str(frame.f_globals.get("__name__", "")).startswith("tagrid"):
        depth, frame = depth + 1, frame.f_back
    warnings.warn(message, stacklevel=depth)
