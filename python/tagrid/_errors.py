"""The exceptions of the package."""


class Error(Exception):
    """A call of tagrid failed. The message says what, where, and what helps."""


class ArgumentError(Error, ValueError):
    """An argument is invalid, or cannot be combined with another one; or the volume is closed."""


class DamagedError(Error, ValueError):
    """The file is damaged, truncated, or not a .tag file. Samples of a damaged brick are never returned."""


class InputError(Error, OSError):
    """Bytes cannot be read or written."""


class MemoryLimitError(Error, MemoryError):
    """Memory ran out, or the memory limit cannot be kept. The message gives a limit that can."""
