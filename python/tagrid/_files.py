"""Files that appear under their name only when they are complete."""

from __future__ import annotations

import errno
import os
import secrets
import weakref

from ._errors import ArgumentError
from ._sources import shown_address


class NewFile:
    """A file that gets its final name once it is complete and on disk. It replaces an existing file in one
    step. A symbolic link stays, and its target is replaced. An incomplete file is removed, even at process
    exit. A forked process does not touch it."""

    def __init__(self, path: str | bytes | os.PathLike[str] | os.PathLike[bytes]):
        name = os.fsdecode(path)
        self._path = os.path.realpath(name)
        if not name:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), name)
        try:
            os.lstat(self._path)
        except FileNotFoundError:
            pass
        except OSError as error:
            # For example, a name that is too long: fail now, not when the file is complete.
            raise OSError(error.errno, error.strerror, shown_address(name)) from None
        if os.path.isdir(self._path):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), self._path)
        if os.path.exists(self._path) and not os.path.isfile(self._path):
            # Devices and pipes must not become files.
            raise ArgumentError(f"{self._path!r} is not a file; open it, and give what open() returned")
        folder, name = os.path.split(self._path)
        # Names are limited in bytes, not in characters.
        start = os.fsdecode(os.fsencode(name)[:200])
        while True:
            self._temporary = os.path.join(folder, f".{start}.new-{secrets.token_hex(6)}")
            try:
                # The umask of the process applies, as to any file.
                descriptor = os.open(self._temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
                break
            except FileExistsError:
                continue
            except OSError as error:
                # The caller knows the given name, not that of the temporary file.
                raise OSError(error.errno, error.strerror, shown_address(os.fsdecode(path))) from None
        # No buffer, because a forked process would write it a second time.
        self._file = os.fdopen(descriptor, "wb", buffering=0)
        self._remove = weakref.finalize(self, _remove_own, self._temporary, os.getpid())

    def write(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest):]

    def commit(self) -> None:
        """Gives the file its name. If this fails, no file remains and an existing one is unchanged."""
        try:
            os.fsync(self._file.fileno())
            self._file.close()
            os.replace(self._temporary, self._path)
        except BaseException:
            self.discard()
            raise
        self._remove.detach()
        self._sync_folder()

    def discard(self) -> None:
        """Removes the file, unless it has its final name."""
        try:
            self._file.close()
        except OSError:
            # The disk may be full, but the data is discarded anyway.
            pass
        self._remove()

    def _sync_folder(self) -> None:
        folder = os.open(os.path.dirname(self._path), os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(folder)
        except OSError:
            # Some file systems cannot; the file itself is on disk.
            pass
        finally:
            os.close(folder)


def _remove_own(path: str, process: int) -> None:
    """Removes a file that this process created, if it still exists."""
    if os.getpid() != process:
        return
    try:
        os.unlink(path)
    except FileNotFoundError:
        pass
