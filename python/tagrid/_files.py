"""Files that appear under their name only when they are complete."""

from __future__ import annotations

import errno
import os
import secrets
from typing import IO, Optional

from ._errors import ArgumentError


class NewFile:
    """A file that is written beside its name, and gets the name once it is complete and on the disk. A file that had
    the name before is replaced in one step; a symbolic link stays, and its target is replaced."""

    def __init__(self, path: str | bytes | os.PathLike[str] | os.PathLike[bytes]):
        self._path = os.path.realpath(os.fsdecode(path))
        if os.path.isdir(self._path):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), self._path)
        if os.path.exists(self._path) and not os.path.isfile(self._path):
            # Devices and pipes must not become files.
            raise ArgumentError(f"{self._path!r} is not a file; open it, and give what open() returned")
        folder, name = os.path.split(self._path)
        while True:
            self._temporary = os.path.join(folder, f".{name[:200]}.new-{secrets.token_hex(6)}")
            try:
                # The process's umask applies, as to any file.
                descriptor = os.open(self._temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
                break
            except FileExistsError:
                continue
            except OSError as error:
                # The name that was given says more than that of the temporary file.
                raise OSError(error.errno, error.strerror, os.fsdecode(path)) from None
        self._file: Optional[IO[bytes]] = os.fdopen(descriptor, "wb")

    def write(self, data: bytes) -> None:
        assert self._file is not None
        self._file.write(data)

    def commit(self) -> None:
        """Gives the file its name. If this fails, nothing is left and everything is as it was before."""
        assert self._file is not None
        try:
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            os.replace(self._temporary, self._path)
        except BaseException:
            self.discard()
            raise
        self._file = None
        self._sync_folder()

    def discard(self) -> None:
        """Removes the file, unless it has its name."""
        if self._file is None:
            return
        file, self._file = self._file, None
        try:
            file.close()
        except OSError:
            # The disk may be full: what cannot be written is not wanted either.
            pass
        finally:
            os.unlink(self._temporary)

    def _sync_folder(self) -> None:
        folder = os.open(os.path.dirname(self._path), os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(folder)
        except OSError:
            # Some file systems cannot; the file itself is on the disk.
            pass
        finally:
            os.close(folder)
