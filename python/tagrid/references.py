"""References to the bricks of a .tag file, as fsspec and kerchunk know them: Zarr arrays whose chunks are ranges of bytes.

    refs = tagrid.references.references("scan.tag", "https://example.org/scan.tag")
    python3 -m tagrid.references scan.tag --url https://example.org/scan.tag -o scan.json

Programs that read Zarr then fetch bricks from the file, and the codec TagridBrick decodes them: it must be installed
where they run. The bytes of a brick do not suffice to decode it, so the codec's configuration has what the file holds
besides bricks: its header and its index.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import sys
import threading
from itertools import product
from typing import Any, Iterator, Optional, Sequence

import numpy as np
import numpy.typing as npt
from numcodecs.abc import Codec
from numcodecs.compat import ensure_bytes, ndarray_copy
from numcodecs.registry import register_codec

from ._errors import ArgumentError, DamagedError, Error
from ._volume import Volume
from .zarr import Store

__all__ = ["TagridBrick", "references"]

#: Bytes of the file, from an offset on.
_Part = tuple[int, bytes]


class TagridBrick(Codec):
    """Decodes the chunks of an array that references() describes, which are blocks of a file.

    size: bytes of the file. parts: offsets, and what is there in base64: all that is needed of the file besides blocks.
    checksums: the last eight bytes of each block, in base64. They tell which brick a chunk is. factor: of the overview
    whose bricks the chunks are; 1: those of the volume. base: where it begins in the file. chunk: the shape of a chunk.
    """

    codec_id = "tagrid_brick"

    def __init__(self, size: int, parts: Sequence[Sequence[Any]], checksums: str, factor: int, base: int,
                 chunk: Sequence[int]):
        self.size, self.checksums, self.factor, self.base, self.chunk = size, checksums, factor, base, list(chunk)
        self.parts = [[offset, text] for offset, text in parts]
        self._own = threading.local()

    def get_config(self) -> dict[str, Any]:
        return {"id": self.codec_id, "size": self.size, "parts": self.parts, "checksums": self.checksums,
                "factor": self.factor, "base": self.base, "chunk": self.chunk}

    def __reduce__(self) -> Any:
        return TagridBrick, (self.size, self.parts, self.checksums, self.factor, self.base, self.chunk)

    def encode(self, buf: Any) -> bytes:
        raise PermissionError("the chunks of these arrays are bricks of a .tag file, which cannot be written")

    def decode(self, buf: Any, out: Optional[Any] = None) -> Any:
        """The samples of a chunk, padded with zeros beyond the volume. DamagedError: it is no block of this file."""
        samples = self._samples(ensure_bytes(buf))
        return samples if out is None else ndarray_copy(samples, out)

    def _samples(self, block: bytes) -> npt.NDArray[Any]:
        file = self._file()
        number = file.numbers.get(block[-8:])
        if number is None:
            raise DamagedError("the bytes are not those of a brick of this file, or they are damaged")
        low, high = file.boxes[number]
        samples = file.decoded(number, block)
        chunk = np.zeros(self.chunk, samples.dtype.newbyteorder("<"))
        chunk[tuple(slice(end - begin) for begin, end in zip(low, high))] = samples
        return chunk

    def _file(self) -> _File:
        """A file of this thread."""
        file: Optional[_File] = getattr(self._own, "file", None)
        if file is None:
            parts = [(offset, base64.b64decode(text)) for offset, text in self.parts]
            file = _File(self.size, parts, base64.b64decode(self.checksums), self.factor, self.base)
            self._own.file = file
        return file


class _Known:
    """The bytes of a file of which only some are known, and one block at a time."""

    def __init__(self, size: int, parts: list[_Part]):
        self.size, self._parts = size, parts
        self.block: _Part = (0, b"")

    def read_at(self, offset: int, size: int) -> bytes:
        found = bytearray(size)
        for start, data in (*self._parts, self.block):
            begin, end = max(offset, start), min(offset + size, start + len(data))
            if begin < end:
                found[begin - offset:end - offset] = data[begin - start:end - start]
        return bytes(found)


class _File:
    """A volume, or an overview of it, whose blocks are given one at a time."""

    def __init__(self, size: int, parts: list[_Part], checksums: bytes, factor: int, base: int):
        self._known = _Known(size, parts)
        whole = Volume(self._known, threads=1)
        self._volume = whole.overview(factor) if factor > 1 else whole
        bricks = [self._volume._reader.brick(number) for number in range(int(np.prod(self._volume.info["bricks"])))]
        #: Of each brick: from its first sample up to its last one, along z, y and x.
        self.boxes = [(brick["low_corner"][::-1], brick["high_corner"][::-1]) for brick in bricks]
        self._offsets = [base + brick["offset"] - 8 for brick in bricks]
        #: Of each brick, by the last bytes of its block.
        self.numbers = {checksums[8 * number:8 * number + 8]: number for number in range(len(bricks))}

    def decoded(self, number: int, block: bytes) -> npt.NDArray[Any]:
        """The samples of a brick. DamagedError: the block is not its own."""
        self._known.block = (self._offsets[number], block)
        return self._volume.read(list(zip(*self.boxes[number])), threads=1)


class _Recorded:
    """A file that remembers what was read of it."""

    def __init__(self, data: Any):
        self._data, self.size = data, data.size() if callable(data.size) else data.size
        self.ranges: list[tuple[int, int]] = []

    def read_at(self, offset: int, size: int) -> bytes:
        self.ranges.append((offset, offset + size))
        return bytes(self._data.read_at(offset, size))


    def close(self) -> None:
        self._data.close()


class _OnDisk:
    def __init__(self, path: Any):
        self._file, self._turn = open(path, "rb"), threading.Lock()
        self.size = self._file.seek(0, 2)

    def read_at(self, offset: int, size: int) -> bytes:
        with self._turn:
            self._file.seek(offset)
            return self._file.read(size)

    def close(self) -> None:
        self._file.close()


def references(path: Any, url: Optional[str] = None) -> dict[str, Any]:
    """The references of a file, in version 1 of their specification: a group of Zarr 2, like that of tagrid.zarr.Store.
    Level 0 is the volume; others are its overviews.

    path: of the file, or an object with size and read_at(), as for tagrid.open(). url: what references name; by default
    the path. Eight bytes of each brick are read, and the index.

    ArgumentError: bricks of the file are not chunks of one size, because it was encoded with lead=0.
    """
    is_path = not hasattr(path, "read_at")
    if url is None and not is_path:
        raise ArgumentError("give the url that references name")
    source = _Recorded(_OnDisk(path) if is_path else path)
    try:
        with Volume(source) as volume:
            return _references(volume, source, os.fsdecode(path) if url is None else url)
    finally:
        if is_path:
            source.close()


def _references(volume: Volume, source: _Recorded, url: str) -> dict[str, Any]:
    if volume.volumes > 1:
        raise ArgumentError(f"the file has {volume.volumes} volumes; references are for files of one")
    store = Store(volume)
    levels = [level for level in store._levels if level.step == 1]
    if not _has_chunks(volume):
        raise ArgumentError("the first bricks have a sample more than the others, so bricks are not chunks; encode the "
                            "volume without lead=0")
    store._levels = [level for level in levels if _has_chunks(level.volume)]
    described, places = store._described()
    bases = [_base_of(level.volume, source) for level in store._levels]
    bricks = [list(_blocks_of(level.volume, base)) for level, base in zip(store._levels, bases)]
    parts = list(_without(source, [span for found in bricks for _, *span in found]))
    for number, (level, base) in enumerate(zip(store._levels, bases)):
        chunk = _chunk_of(level.volume)
        texts = [[offset, base64.b64encode(data).decode()] for offset, data in parts]
        checksums = b"".join(source.read_at(end - 8, 8) for _, _, end in bricks[number])
        codec = TagridBrick(source.size, texts, base64.b64encode(checksums).decode(), level.block, base, chunk)
        described[f"{number}/.zarray"].update(compressor=codec.get_config(), chunks=chunk,
                                              dtype=volume.dtype.newbyteorder("<").str)
    refs: dict[str, Any] = {name: json.dumps(about) for name, about in described.items()}
    refs.update((name, "base64:" + base64.b64encode(data).decode()) for name, data in places.items())
    for number, found in enumerate(bricks):
        refs.update((f"{number}/{key}", [url, begin, end - begin]) for key, begin, end in found)
    return {"version": 1, "refs": refs}


def _chunk_of(volume: Volume) -> list[int]:
    return [min(edge, size) for edge, size in zip(volume.chunks, volume.shape)]


def _has_chunks(volume: Volume) -> bool:
    """Whether the bricks of a volume are chunks of one shape; the last ones may have less."""
    return all(set(sizes[:-1]) <= {edge} and sizes[-1] <= edge
               for sizes, edge in zip(volume.aligned_chunks(1), _chunk_of(volume)))


def _base_of(volume: Volume, source: _Recorded) -> int:
    """Where a volume or an overview begins in the file: its bricks are counted from there."""
    before, brick = len(source.ranges), volume._reader.brick(0)
    volume.read([(0, 1)] * 3, threads=1)
    for begin, end in source.ranges[before:]:
        if end - begin == brick["bytes"] + 8:
            return int(begin - (brick["offset"] - 8))
    raise Error("the library reads bricks in another way than this module expects; please report this")


def _blocks_of(volume: Volume, base: int) -> Iterator[tuple[str, int, int]]:
    """The key of each brick, and where its block begins, with the eight bytes before it, and ends."""
    counts = volume.info["bricks"][::-1]
    for number, index in enumerate(product(*map(range, counts))):
        brick = volume._reader.brick(number)
        begin = base + brick["offset"]
        yield "/".join(map(str, index)), begin - 8, begin + brick["bytes"]


def _without(source: _Recorded, blocks: list[Any]) -> Iterator[_Part]:
    """What was read of the file, without its blocks."""
    wanted = list(_joined(sorted(source.ranges)))
    # The checksum at the end of a block is needed: what follows it is bound to it.
    holes = list(_joined(sorted((begin + 8, end - 8) for begin, end in blocks)))
    for begin, end in wanted:
        for low, high in holes:
            if low < end and high > begin:
                if begin < low:
                    yield begin, source.read_at(begin, low - begin)
                begin = max(begin, high)
        if begin < end:
            yield begin, source.read_at(begin, end - begin)


def _joined(ranges: list[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Ranges that touch or overlap become one. They are sorted."""
    last: Optional[tuple[int, int]] = None
    for begin, end in ranges:
        if last is not None and begin <= last[1]:
            last = last[0], max(last[1], end)
            continue
        if last is not None:
            yield last
        last = begin, end
    if last is not None:
        yield last


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python3 -m tagrid.references",
                                     description="Writes references to the bricks of a .tag file")
    parser.add_argument("file")
    parser.add_argument("--url", help="what references name (default: the path as it is given)")
    parser.add_argument("-o", "--output", help="default: standard output")
    given = parser.parse_args()
    text = json.dumps(references(given.file, given.url)) + "\n"
    if given.output is None:
        sys.stdout.write(text)
    else:
        with open(given.output, "w", encoding="utf-8") as file:
            file.write(text)
    return 0


# Entry points do the same once the package is installed.
register_codec(TagridBrick)

if __name__ == "__main__":
    sys.exit(_main())
