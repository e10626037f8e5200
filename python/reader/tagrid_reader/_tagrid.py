"""Reads .tag files through the C interface of the library: what the extension of the package tagrid is to its modules.

The library asks for bytes of the file, and decodes bricks from theirs. Files, threads and arrays are Python's.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import stat
import threading
import weakref
from ctypes import byref, c_int64, c_size_t, c_void_p
from typing import Any, Callable, Iterator, Optional, Sequence

import numpy as np
import numpy.typing as npt

from . import _library
from ._errors import ArgumentError, DamagedError, Error, InputError, MemoryLimitError, NewerFormatError
from ._library import OK, TYPES, Block, Box, C, Info, Range
from ._turns import Turn

Progress = Optional[Callable[[int, int], object]]
#: Reads bytes of a file: from an offset on, so many.
ReadAt = Callable[[int, int], Any]

_CLASSES: dict[int, type[Error]] = {
    _library.INVALID_ARGUMENT: ArgumentError, _library.BROKEN_INPUT: DamagedError,
    _library.NEWER_FORMAT: NewerFormatError, _library.IO_ERROR: InputError,
    _library.MEMORY_LIMIT: MemoryLimitError, _library.OUT_OF_MEMORY: MemoryLimitError}
#: Bricks that are planned at once.
_AT_ONCE = 64


def _raise(status: int, message: bytes, name: str) -> None:
    """Raises the exception of a status. The library does not know the name of the file."""
    text = (message or C.tagrid_status_text(status)).decode("utf-8", "backslashreplace")
    raise _CLASSES.get(status, Error)(f"{name}: {text.removeprefix('the file: ')}")


class _Source:
    """The bytes of a file. The overviews and volumes in it share it, and one thread at a time may ask for them."""

    def __init__(self, read_at: ReadAt, size: int, name: str):
        self.read_at, self.size, self.name, self.turn = read_at, size, name, Turn()

    def bytes_at(self, offset: int, size: int) -> npt.NDArray[np.uint8]:
        """InputError: there are fewer. What read_at() raises is passed on."""
        if offset + size > self.size:
            raise DamagedError(f"{self.name}: the bytes {offset} to {offset + size} are beyond its {self.size} bytes")
        found = np.frombuffer(self.read_at(offset, size) if size else b"", np.uint8)
        if found.size != size:
            raise InputError(f"{self.name}: read_at({offset}, {size}) returned {found.size} bytes")
        return found


def _close(handle: Optional[int], turn: Turn, losses: int) -> None:
    """Closes a handle, unless the process was forked while another thread used it: it may be half changed."""
    if turn.losses == losses:
        C.tagrid_blocks_close(handle)


class _Blocks:
    """A file that the library has opened, or an overview or a volume in an `outer` one, by a function of the library
    and its number. Its handle is closed with the last reference."""

    def __init__(self, source: _Source, name: str, outer: Optional[_Blocks] = None, function: Any = None,
                 number: int = 0):
        self.source, self.name = source, name
        self._outer, self._function, self._number = outer, function, number
        self.info, count = Info(), c_size_t()
        C.tagrid_info_init_sized(byref(self.info), ctypes.sizeof(Info))
        with source.turn:
            self._open()
            self.feed(C.tagrid_blocks_info, byref(self.info))
            header = C.tagrid_blocks_header(self._handle, byref(count))
            #: What a decoder needs of the file.
            self.header: bytes = ctypes.string_at(header, count.value)
            self.metadata: bytes = C.tagrid_blocks_metadata(self._handle)

    def _open(self) -> None:
        self._handle = c_void_p()
        self._losses = losses = self.source.turn.losses
        try:
            if self._outer is not None:
                self._outer.feed(self._function, self._number, byref(self._handle))
            else:
                self._check(C.tagrid_blocks_create(self.source.size, byref(self._handle)))
                self.feed(C.tagrid_blocks_open)
        except BaseException:
            self._losses = -1
            raise
        finally:
            # Not when the process ends: other threads may still be in a call.
            weakref.finalize(self, _close, self._handle.value, self.source.turn, losses).atexit = False

    def ask(self, function: Any, *arguments: Any) -> None:
        """Calls a function of the library, with the bytes that it lacks. Other threads wait."""
        with self.source.turn:
            self.feed(function, *arguments)

    def feed(self, function: Any, *arguments: Any) -> None:
        """The same. REQUIRES: it is the turn of this thread."""
        if self._losses != self.source.turn.losses:
            # The process was forked while a thread asked: all handles of the source may be half changed.
            self._open()
        given: list[tuple[int, int]] = []
        while True:
            status = function(self._handle, *arguments)
            if status != _library.NEEDS_BYTES:
                break
            ranges = ctypes.POINTER(Range)()
            count = C.tagrid_blocks_needs(self._handle, byref(ranges))
            wanted = [(ranges[i].offset, ranges[i].bytes) for i in range(count)]
            if not wanted or wanted == given:
                raise Error(f"{self.name}: the library does not say which bytes it lacks; please report this")
            for offset, size in wanted:
                data = self.source.bytes_at(offset, size)
                self._check(C.tagrid_blocks_give(self._handle, offset, data.ctypes.data, size))
            given = wanted
        self._check(status)

    def _check(self, status: int) -> None:
        if status != OK:
            _raise(status, C.tagrid_blocks_message(self._handle), self.name)


class Reader:
    """An open file, or an overview or a volume in it."""

    def __init__(self, blocks: _Blocks):
        self._blocks: Optional[_Blocks] = blocks

    @staticmethod
    def of_path(path: bytes) -> Reader:
        """InputError: there is no such file, or it cannot be read."""
        name = os.fsdecode(path)
        file = _PathFile(name)
        return Reader.of_object(file.read_at, file.size, name)

    @staticmethod
    def of_buffer(buffer: memoryview, name: str) -> Reader:
        return Reader.of_object(lambda offset, size: buffer[offset:offset + size], len(buffer), name)

    @staticmethod
    def of_object(read_at: ReadAt, size: int, name: str) -> Reader:
        return Reader(_Blocks(_Source(read_at, size, name), name))

    @property
    def closed(self) -> bool:
        return self._blocks is None

    def close(self) -> None:
        self._blocks = None

    def _opened(self) -> _Blocks:
        blocks = self._blocks
        if blocks is None:
            raise ArgumentError("the volume is closed")
        return blocks

    def info(self) -> dict[str, Any]:
        info = self._opened().info
        others = ("struct_size", "type", "geometry", "threshold_count", "samples_at_least", "samples_moved")
        found = {name: getattr(info, name) for name, _ in Info._fields_ if name not in others}
        found.update((name, getattr(info.geometry, name)) for name in ("spacing", "origin"))
        for name in ("dims", "bricks", "range", "spacing", "origin"):
            found[name] = tuple(found[name])
        found["directions"] = tuple(tuple(direction) for direction in info.geometry.directions)
        for name in ("has_spacing", "has_origin", "has_directions"):
            found[name] = bool(getattr(info.geometry, name))
        for name in ("grid_only", "grid_derived"):
            found[name] = bool(found[name])
        found["thresholds"] = [
            {"value": info.thresholds[i], "at_least": info.samples_at_least[i], "moved": info.samples_moved[i]}
            for i in range(info.threshold_count)]
        found["dtype"] = _dtype_of(info)
        return found

    def metadata(self) -> bytes:
        return self._opened().metadata

    def brick(self, number: int) -> dict[str, Any]:
        blocks = self._opened()
        block, = _planned(blocks, Box((0, 0, 0), blocks.info.dims), number, 1)
        return {"low_corner": tuple(block.box.low), "high_corner": tuple(block.box.high),
                # The block without the checksum before it.
                "offset": block.range.offset + 8, "bytes": block.range.bytes - 8}

    def overviews(self) -> tuple[int, ...]:
        factors = (c_int64 * _library.MOST_OVERVIEWS)()
        self._opened().ask(C.tagrid_blocks_overviews, factors)
        return tuple(factor for factor in factors if factor != 0)

    def overview(self, factor: int) -> Reader:
        return self._nested(C.tagrid_blocks_overview, "overview", factor)

    def volumes(self) -> int:
        count = c_int64()
        self._opened().ask(C.tagrid_blocks_volumes, byref(count))
        return count.value

    def volume(self, number: int) -> Reader:
        return self._nested(C.tagrid_blocks_volume, "volume", number)

    def _nested(self, function: Any, what: str, number: int) -> Reader:
        blocks = self._opened()
        return Reader(_Blocks(blocks.source, f"{blocks.name}: {what} {number}", blocks, function, number))

    def read(self, low: Sequence[int], high: Sequence[int], step: Sequence[int], out: npt.NDArray[Any], threads: int,
             memory_limit: int, progress: Progress) -> None:
        """Fills `out`, (z, y, x), with the samples of a box (x, y, z)."""
        if threads < 0:
            raise ArgumentError("threads must be 0, for all processors, or more")
        blocks = self._opened()
        for axis in range(3):
            if not 0 <= low[axis] < high[axis] <= blocks.info.dims[axis] or step[axis] < 1:
                raise ArgumentError("the box is empty or not within the volume, or a step is below 1")
        shape = tuple(len(range(low[axis], high[axis], step[axis])) for axis in (2, 1, 0))
        if out.shape != shape or out.dtype != _dtype_of(blocks.info) or not out.flags.writeable:
            raise ArgumentError("the array for samples has another shape or type than the box, or is read-only")
        _Read(blocks, low, high, step, out, memory_limit, progress).run(threads or _processors())


def _dtype_of(info: Info) -> np.dtype[Any]:
    if info.type not in TYPES:
        raise TypeError("the file has samples of a type that this version does not know")
    return np.dtype(TYPES[info.type])


def _processors() -> int:
    """Those that the process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _planned(blocks: _Blocks, box: Box, first: int, room: int) -> list[Block]:
    """Bricks of a box, from the one numbered `first` among them on; fewer than `room` if these are the last."""
    found, count = (Block * room)(), c_size_t()
    blocks.ask(C.tagrid_blocks_plan, byref(box), first, found, room, byref(count))
    return [Block.from_buffer_copy(found[i]) for i in range(count.value)]


class _Read:
    """One call of Reader.read(): threads take bricks in turn, and the first one that fails ends it."""

    def __init__(self, blocks: _Blocks, low: Sequence[int], high: Sequence[int], step: Sequence[int],
                 out: npt.NDArray[Any], memory_limit: int, progress: Progress):
        self._blocks, self._out, self._progress = blocks, out, progress
        #: Along x, y and z.
        self._runs = [range(*run) for run in zip(low, high, step)]
        self._box = Box(tuple(low), tuple(high))
        self._next = self._bricks()
        self._turn = threading.Lock()  # for the next brick
        self._telling = threading.Lock()  # for progress
        self._done = 0
        self._memory = _Memory(blocks.name, memory_limit)
        self._error: Optional[BaseException] = None
        self._process = os.getpid()

    def run(self, threads: int) -> None:
        helpers: list[threading.Thread] = []
        try:
            for _ in range(min(threads, self._count()) - 1):
                helper = threading.Thread(target=self._work, name="tagrid_reader", daemon=True)
                try:
                    helper.start()
                except RuntimeError:
                    break  # the system has no more
                helpers.append(helper)
            self._work()
            for helper in helpers:
                helper.join()
            if os.getpid() != self._process:
                raise Error(f"{self._blocks.name}: the process was forked while it read, and lacks samples")
        except BaseException as error:  # Ctrl-C, while it waits
            self._fail(error)
        if self._error is not None:
            try:
                for helper in helpers:
                    helper.join()
                raise self._error
            finally:
                self._error = None

    def _count(self) -> int:
        """The bricks that hold samples of the box."""
        info, count = self._blocks.info, 1
        first = info.brick_edge if info.lead else info.brick_edge + 1
        for low, high in zip(self._box.low, self._box.high):
            of_low, of_high = (max(place - first + info.brick_edge, 0) // info.brick_edge for place in (low, high - 1))
            count *= of_high - of_low + 1
        return int(count)

    def _bricks(self) -> Iterator[Block]:
        """The bricks of the box with samples that the step takes."""
        first, found = 0, [Block()] * _AT_ONCE
        while len(found) == _AT_ONCE:
            found = _planned(self._blocks, self._box, first, _AT_ONCE)
            first += len(found)
            for block in found:
                if all(self._positions(block, axis) for axis in range(3)):
                    yield block

    def _positions(self, block: Block, axis: int) -> range:
        """Which positions of the result along an axis a brick has samples for."""
        run, low, high = self._runs[axis], block.box.low[axis], block.box.high[axis]
        begin = max(0, -(-(low - run.start) // run.step))
        return range(begin, max(begin, min(len(run), -(-(high - run.start) // run.step))))

    def _fail(self, error: BaseException) -> None:
        if self._error is None:
            self._error = error
        self._memory.stop()

    def _work(self) -> None:
        decoder = c_void_p()
        try:
            header = self._blocks.header
            status = C.tagrid_decoder_open(header, len(header), byref(decoder))
            if status != OK:
                _raise(status, C.tagrid_decoder_message(decoder), self._blocks.name)
            while self._error is None and os.getpid() == self._process:
                with self._turn:
                    block = next(self._next, None) if self._error is None else None
                if block is None:
                    break
                need = C.tagrid_decoder_memory(decoder, byref(block)) + block.range.bytes
                with self._memory.of(block.number, need):
                    if self._error is None:
                        self._decode(decoder, block)
        except BaseException as error:
            self._fail(error)
        finally:
            C.tagrid_decoder_close(decoder)

    def _decode(self, decoder: c_void_p, block: Block) -> None:
        """Fills the samples of a brick. Nothing of the file is believed that arrays do not allow."""
        name, dtype = self._blocks.name, self._out.dtype
        x, y, z = (block.box.high[axis] - block.box.low[axis] for axis in range(3))
        dims = self._blocks.info.dims
        if not all(0 <= block.box.low[axis] < block.box.high[axis] <= dims[axis] for axis in range(3)):
            raise DamagedError(f"{name}: brick {block.number} is not within the volume")
        data = self._blocks.source.bytes_at(block.range.offset, block.range.bytes)
        samples, count = c_void_p(), c_size_t()
        status = C.tagrid_decoder_decode(decoder, byref(block), data.ctypes.data, data.size, byref(samples),
                                         byref(count))
        if status != OK:
            _raise(status, C.tagrid_decoder_message(decoder), name)
        slices, rest = divmod(count.value, x * y * dtype.itemsize)
        if rest or not min(max(block.slices, 1), z) <= slices <= z or not samples.value:
            raise Error(f"{name}: brick {block.number} has {count.value} bytes of samples; please report this")
        memory = memoryview((ctypes.c_char * count.value).from_address(samples.value))
        brick = np.frombuffer(memory, dtype).reshape(slices, y, x)
        to, of = [], []
        for axis in (2, 1, 0):
            run, positions = self._runs[axis], self._positions(block, axis)
            to.append(slice(positions.start, positions.stop))
            low = block.box.low[axis]
            of.append(slice(run[positions.start] - low, run[positions.stop - 1] - low + 1, run.step))
        part = self._out[tuple(to)]
        part[...] = brick[tuple(of)]
        if self._progress is not None:
            with self._telling:
                self._done += part.nbytes
                if self._error is None:
                    self._progress(self._done, self._out.nbytes)


class _Memory:
    """The memory of the bricks that are decoded at the same time. A limit of 0 is none."""

    def __init__(self, name: str, limit: int):
        self._name, self._limit, self._used = name, limit, 0
        self._changed = threading.Condition()
        self._is_stopped = False

    @contextlib.contextmanager
    def of(self, brick: int, need: int) -> Iterator[None]:
        """Waits until there is so much. MemoryLimitError: there never is."""
        if not self._limit:
            yield
            return
        if need > self._limit:
            raise MemoryLimitError(f"{self._name}: brick {brick} needs {need} bytes of memory, and the limit is "
                                   f"{self._limit}")
        with self._changed:
            while self._used + need > self._limit and not self._is_stopped:
                self._changed.wait(1)
            self._used += need
        try:
            yield
        finally:
            with self._changed:
                self._used -= need
                self._changed.notify_all()

    def stop(self) -> None:
        with self._changed:
            self._is_stopped = True
            self._changed.notify_all()


class _PathFile:
    """A file on disk, read at offsets. Closed with the last reference."""

    def __init__(self, name: str):
        try:
            # Opening a pipe would wait for its writer.
            flags = (getattr(os, flag, 0) for flag in ("O_NONBLOCK", "O_CLOEXEC", "O_BINARY"))
            self._descriptor = os.open(name, os.O_RDONLY | sum(flags))
        except OSError as error:
            raise InputError(f"cannot open {name}: {error.strerror}") from None
        weakref.finalize(self, os.close, self._descriptor).atexit = False
        status = os.fstat(self._descriptor)
        if stat.S_ISDIR(status.st_mode):
            raise InputError(f"cannot read {name}: {os.strerror(errno.EISDIR)}")
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{name}: is not a regular file, and only regular files can be read in any order; copy "
                             "it to a file first")
        self._name, self.size = name, status.st_size
        self._turn = Turn()

    def read_at(self, offset: int, size: int) -> bytes:
        parts = []
        while size:
            part = self._read(offset, size)
            if not part:
                break
            parts.append(part)
            offset, size = offset + len(part), size - len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _read(self, offset: int, size: int) -> bytes:
        try:
            if hasattr(os, "pread"):
                return os.pread(self._descriptor, size, offset)
            # Windows: threads share the position.
            with self._turn:
                os.lseek(self._descriptor, offset, os.SEEK_SET)
                return os.read(self._descriptor, size)
        except OSError as error:
            raise InputError(f"cannot read {self._name}: {error.strerror}") from None
