"""Sources of .tag files: a path, a file object, memory, or any object that reads at an offset."""

from __future__ import annotations

import errno
import io
import os
import re
import stat
from typing import Any, Callable

import numpy as np

from ._errors import InputError
from ._tagrid import Reader
from ._turns import Turn


def describe(source: Any) -> str:
    """A short name of a source, for messages and repr()."""
    if isinstance(source, (str, bytes, os.PathLike)) and not is_memory(source):
        return shown_address(os.fsdecode(source))
    name = getattr(source, "name", None)
    return shown_address(name) if isinstance(name, str) else type(source).__name__


def shown_address(name: str) -> str:
    """An address without its secrets: without a user name and a password, and without what follows a question mark,
    which is often a signature. Other names stay as they are."""
    address = re.match(r"(\w[\w+.-]*://)(.*)", name, re.DOTALL)
    if not address:
        return name
    scheme, rest = address.groups()
    host = re.split(r"[/?#]", rest, maxsplit=1)[0]
    # A password that contains one of these characters seems to end there, but the rest must not be shown either.
    ends = re.search(r"(^[^:]*|:\d*|\])$", host.rpartition("@")[2]) or "@" in host
    if ends:
        rest = host.rpartition("@")[2] + rest[len(host):]
    else:
        rest = rest.rpartition("@")[2]
    return scheme + re.split(r"[?#]", rest, maxsplit=1)[0]


class OverviewOf:
    """An overview in a source."""

    def __init__(self, source: Any, factor: int):
        self.source, self.factor = source, factor
        self.name = f"{describe(source)}: overview {factor}"


class VolumeOf:
    """One of several volumes in a source."""

    def __init__(self, source: Any, number: int):
        self.source, self.number = source, number
        self.name = f"{describe(source)}: volume {number}"


def open_reader(source: Any) -> Reader:
    """Opens a source: see open() of the package."""
    if isinstance(source, OverviewOf):
        return open_reader(source.source).overview(source.factor)
    if isinstance(source, VolumeOf):
        return open_reader(source.source).volume(source.number)
    if isinstance(source, (str, os.PathLike)):
        return _open_path(os.fspath(source))
    if is_memory(source):
        if isinstance(source, bytes) and _names_a_file(source):
            raise TypeError(f"{source!r} is taken as the bytes of a .tag file, but is the name of one; a path is a text: "
                            f"{__package__}.open(os.fsdecode(path))")
        # A memoryview of anything but bytes is cast: an array's buffer is its bytes.
        memory = np.ascontiguousarray(source) if isinstance(source, np.ndarray) else source
        return Reader.of_buffer(memoryview(memory).cast("B"), describe(source))
    if hasattr(source, "read_at") and hasattr(source, "size"):
        size = source.size() if callable(source.size) else source.size
        return Reader.of_object(source.read_at, _checked_size(size), describe(source))
    if isinstance(source, io.TextIOBase):
        raise TypeError(f"cannot open {type(source).__name__!r}: the file must be opened in binary mode: open(path, \"rb\")")
    if hasattr(source, "read") and hasattr(source, "seek"):
        file: _DiskFile | _FileObject = _DiskFile(source) if _is_on_disk(source) else _FileObject(source)
        return Reader.of_object(file.read_at, file.size, describe(source))
    advice = "give a path, bytes, a binary file that can seek, or an object with read_at(offset, size) and size"
    if isinstance(source, np.ndarray):
        advice = "an array is encoded by tagrid.encode(array), and needs no opening"
    elif callable(getattr(source, "open", None)):
        advice = "give the file that its open() returns"
    raise TypeError(f"cannot open {type(source).__name__!r}: {advice}")


def _names_a_file(data: bytes) -> bool:
    """Whether bytes are a path, as from os.listdir(b"."). No .tag file is that short."""
    try:
        return 0 < len(data) < 128 and os.path.exists(data)
    except ValueError:
        return False


def is_path(source: Any) -> bool:
    return isinstance(source, (str, os.PathLike))


def is_tied(source: Any) -> bool:
    """Whether a source belongs to this process, so that another process cannot use it."""
    if isinstance(source, (OverviewOf, VolumeOf)):
        return is_tied(source.source)
    return isinstance(source, (memoryview, io.BufferedReader, io.BufferedRandom, io.FileIO))


def is_memory(source: Any) -> bool:
    """Whether a source is the bytes of a file."""
    # An array of bytes, as from numpy.fromfile(path, numpy.uint8).
    return isinstance(source, (bytes, bytearray, memoryview)) or (
        isinstance(source, np.ndarray) and source.dtype == np.uint8 and source.ndim == 1)


def _checked_size(size: Any) -> int:
    if not isinstance(size, int) or size < 0:
        raise TypeError(f"size must be the number of bytes, not {size!r}")
    return size


def _open_path(path: str | bytes) -> Reader:
    name = os.fsencode(path)
    if b"\0" in name:
        raise ValueError("embedded null byte")
    try:
        return Reader.of_path(name)
    except InputError as error:
        unreadable = error
    # Not above: a traceback would show both exceptions.
    _raise_what_python_knows(path)
    raise unreadable


def _raise_what_python_knows(path: str | bytes) -> None:
    """Python's own exceptions distinguish a missing file from an unreadable one."""
    try:
        # Opening a pipe would wait for its writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    except FileNotFoundError:
        if not re.match(r"\w[\w+.-]+://", os.fsdecode(path)):
            raise
        advice = (f"{__package__}.open() takes files of this machine; for a URL give fsspec.open(URL).open(), or an object "
                  "with read_at(offset, size) and size")
        raise FileNotFoundError(errno.ENOENT, advice, shown_address(os.fsdecode(path))) from None
    try:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fsdecode(path))
    finally:
        os.close(descriptor)


def _is_on_disk(source: Any) -> bool:
    """Whether a Python file returns the bytes of its descriptor directly. Windows does not read at offsets."""
    if not hasattr(os, "pread"):
        return False
    raw = getattr(source, "raw", source) if isinstance(source, (io.BufferedReader, io.BufferedRandom)) else source
    return type(raw) is io.FileIO and raw.readable() and stat.S_ISREG(os.fstat(raw.fileno()).st_mode)


def _gathered(read: Callable[[int], Any], size: int) -> Any:
    """Calls read() until it has returned `size` bytes, or the file ends. A raw file may return less than it has."""
    parts: list[Any] = []
    while size > 0:
        data = read(size)
        if isinstance(data, str):
            raise TypeError("the file must be opened in binary mode")
        if not data:
            break
        parts.append(data)
        size -= len(data)
    return parts[0] if len(parts) == 1 else b"".join(parts)


class _DiskFile:
    """A file on disk, read at offsets. Its position stays, and is not needed. Forked processes share it."""

    def __init__(self, file: Any):
        self._file = file
        if isinstance(file, io.BufferedRandom):
            file.flush()
        self.size = os.fstat(file.fileno()).st_size

    def read_at(self, offset: int, size: int) -> bytes:
        end = offset + size
        # Get the descriptor each time: if the file was closed, another one may have the number.
        data: bytes = _gathered(lambda missing: os.pread(self._file.fileno(), missing, end - missing), size)
        return data


class _FileObject:
    """A file whose position all threads share: one thread seeks and reads at a time."""

    def __init__(self, file: Any):
        self._file = file
        self._turn = Turn()
        with self._turn:
            end = file.seek(0, os.SEEK_END)
            self.size = _checked_size(file.tell() if end is None else end)

    def read_at(self, offset: int, size: int) -> bytes:
        with self._turn:
            self._file.seek(offset)
            data: bytes = _gathered(self._file.read, size)
        return data
