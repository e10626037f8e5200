"""A .tag file as a multiresolution Zarr group (Zarr 2, OME-Zarr 0.4), without a copy."""

from __future__ import annotations

import json
import math
import threading
from collections import OrderedDict
from itertools import accumulate, product
from typing import TYPE_CHECKING, Any, Iterator, MutableMapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._arguments import byte_count, whole_number
from ._coordinates import coordinate_of, is_along_world, ome_units, scale_and_translation
from ._errors import ArgumentError
from ._geometry import rescale_of
from ._volume import Volume

_Index = tuple[int, int, int]

if TYPE_CHECKING:
    _Mapping = MutableMapping[str, bytes]
else:
    try:
        from ._zarr3 import StoreMapping as _Mapping
    except ImportError:
        _Mapping = MutableMapping


class Store(_Mapping):
    """A read-only store for zarr.open_group(mode="r"). The array "0" holds the samples of the volume. "1", "2" ...
    hold its overviews, whose samples are means of blocks of 4, 16 ... samples along each axis. If the file has
    none, they hold every 2nd, 4th ... sample, down to one chunk. Chunks have 64 samples along each edge, or fewer
    if the volume is smaller, and are decoded on read.

    source: anything that tagrid.open() accepts, or a Volume. chunk: samples along the edge of a chunk.
    cache_bytes: memory for decoded bricks. A chunk of 64 samples is a brick of the usual size; in a file that
        was encoded with lead=0, and at other sizes, a chunk has samples of up to 8 bricks (see
        Volume.aligned_chunks()).

    Levels without overviews begin at the same sample, so their translations are equal; overviews begin at the
    middle of a block. Positions are world positions if the axes of the scan are world axes, and otherwise distances from
    the first sample. The arrays "z", "y", "x", "z_1" ... hold the position of each sample along an axis, even
    if slices are unevenly spaced.

    Arrays hold stored samples. If value = slope * sample + intercept, their attributes scale_factor and
    add_offset hold slope and intercept. xarray.open_zarr() applies them, unless mask_and_scale=False. The
    attribute "tagrid" of the group has the affine matrix, the bound and the metadata of the file.
    """

    def __init__(self, source: Any, *, chunk: int = 64, threads: int = 0, cache_bytes: int = 1 << 27):
        chunk = whole_number("chunk", chunk)
        if chunk < 1:
            raise ArgumentError(f"a chunk has at least one sample along each edge, not {chunk}")
        self.volume = source if isinstance(source, Volume) else Volume(source, threads)
        cache_bytes = byte_count("cache_bytes", cache_bytes)
        # For a volume of one slice, chunks of 64 slices would be mostly padding.
        self._chunks = tuple(min(chunk, size) for size in self.volume.shape)
        overviews = [self.volume.overview(factor) for factor in self.volume.overviews]
        halved = 0 if overviews else max(0, math.ceil(math.log2(max(self.volume.shape) / chunk)))
        self._levels = [_Level(self.volume, cache_bytes),
                        *(_Level(overview, cache_bytes, block=factor)
                          for factor, overview in zip(self.volume.overviews, overviews)),
                        *(_Level(self.volume, 0, step=2**n) for n in range(1, halved + 1))]
        described, self._fixed = self._described()
        described[".zmetadata"] = {"zarr_consolidated_format": 1, "metadata": dict(described)}
        self._fixed.update((name, json.dumps(value).encode()) for name, value in described.items())

    def _described(self) -> tuple[dict[str, Any], dict[str, bytes]]:
        """The metadata of the group and its arrays, and the chunks of the coordinates."""
        found: dict[str, Any] = {".zgroup": {"zarr_format": 2},
                                 ".zattrs": {"multiscales": [self._multiscales()], "tagrid": _about(self.volume)}}
        places: dict[str, bytes] = {}
        values = _meaning_of_samples(self.volume)
        for number, level in enumerate(self._levels):
            # In xarray, axes with the same name have the same length.
            axes = [f"{name}_{number}" if number else name for name in "zyx"]
            found[f"{number}/.zarray"] = _zarray(level.shape, self._chunks, self.volume.dtype)
            found[f"{number}/.zattrs"] = {"_ARRAY_DIMENSIONS": axes, **values}
            for axis, name in enumerate(axes):
                coordinate = coordinate_of(level.volume, axis)
                numbers = level.places(axis, coordinate.places)
                found[f"{name}/.zarray"] = _zarray(numbers.shape, numbers.shape, numbers.dtype)
                found[f"{name}/.zattrs"] = {"_ARRAY_DIMENSIONS": [name], **coordinate.attributes}
                places[f"{name}/0"] = numbers.tobytes()
        return found, places

    def _multiscales(self) -> dict[str, Any]:
        spacing, origin = scale_and_translation(self.volume)
        datasets = [{"path": str(number), "coordinateTransformations": [
            {"type": "scale", "scale": [step * level.distance for step in spacing]},
            {"type": "translation", "translation": [at + level.first * step for at, step in zip(origin, spacing)]}]}
                    for number, level in enumerate(self._levels)]
        axes = [{"name": name, "type": "space", **unit} for name, unit in zip("zyx", ome_units(self.volume))]
        kind = "mean" if self.volume.overviews else "subsampled"
        return {"version": "0.4", "axes": axes, "datasets": datasets, "type": kind}

    def _counts(self, level: _Level) -> list[int]:
        return [-(-size // edge) for size, edge in zip(level.shape, self._chunks)]

    def _samples(self, level: _Level, index: _Index) -> npt.NDArray[Any]:
        """The samples of a chunk, padded with zeros beyond the volume."""
        lows = [number * edge for number, edge in zip(index, self._chunks)]
        highs = [min(low + edge, size) for low, edge, size in zip(lows, self._chunks, level.shape)]
        chunk = np.zeros(self._chunks, self.volume.dtype)
        level.copy(lows, highs, chunk[tuple(slice(high - low) for low, high in zip(lows, highs))])
        return chunk

    def _chunk_of(self, key: str) -> Optional[tuple[_Level, _Index]]:
        parts = key.split("/")
        if len(parts) != 4 or not all(part.isascii() and part.isdigit() for part in parts):
            return None
        number, z, y, x = map(int, parts)
        if number >= len(self._levels):
            return None
        level = self._levels[number]
        if any(n >= count for n, count in zip((z, y, x), self._counts(level))):
            return None
        return level, (z, y, x)

    def __getitem__(self, key: str) -> bytes:
        if key in self._fixed:
            return self._fixed[key]
        found = self._chunk_of(key) if isinstance(key, str) else None
        if found is None:
            raise KeyError(key)
        return self._samples(*found).tobytes()

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and (key in self._fixed or self._chunk_of(key) is not None)

    def __iter__(self) -> Iterator[str]:
        yield from self._fixed
        for number, level in enumerate(self._levels):
            for index in product(*map(range, self._counts(level))):
                yield "/".join(map(str, (number, *index)))

    def __len__(self) -> int:
        return len(self._fixed) + sum(math.prod(self._counts(level)) for level in self._levels)

    def __setitem__(self, key: str, value: Union[bytes, Any]) -> None:
        raise PermissionError("the store of a .tag file is read-only")

    def __delitem__(self, key: str) -> None:
        raise PermissionError("the store of a .tag file is read-only")

    def __repr__(self) -> str:
        return f"<tagrid.zarr.Store of {self.volume!r}, {len(self._levels)} resolutions>"

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        for level in self._levels:
            level.close()


class _Level:
    """Every `step`-th sample of a volume, or all of an overview, which has means of `block` samples."""

    def __init__(self, volume: Volume, cache_bytes: int, *, step: int = 1, block: int = 1):
        self.volume, self.step, self.block = volume, step, block
        self.shape = [-(-size // step) for size in volume.shape]
        #: Where the first sample is, and the distance of two, in samples of the file's volume.
        self.first, self.distance = (block - 1) / 2, step * block
        self._bricks = _Bricks(volume, cache_bytes) if step == 1 else None

    def places(self, axis: int, of_volume: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The places of the samples along an axis. `of_volume` are those of the samples of self.volume."""
        spacing = self.volume.spacing[axis]
        if self.block == 1:
            return of_volume[::self.step]
        if math.isnan(spacing):
            return self.first + self.distance * np.arange(self.shape[axis])
        # Distances are from the first sample of the file's volume.
        return of_volume if is_along_world(self.volume) else of_volume + self.first * spacing / self.block

    def copy(self, lows: list[int], highs: list[int], out: npt.NDArray[Any]) -> None:
        """Copies the samples of the level from lows up to highs."""
        if self._bricks is not None:
            self._bricks.copy(lows, highs, out)
            return
        step = self.step
        self.volume.read([(low * step, (high - 1) * step + 1) for low, high in zip(lows, highs)], step, out)

    def close(self) -> None:
        self.volume.close()
        if self._bricks is not None:
            self._bricks.forget()


class _Bricks:
    """A cache of recently decoded bricks."""

    def __init__(self, volume: Volume, most_bytes: int):
        self._volume = volume
        self._borders = [list(accumulate(sizes, initial=0)) for sizes in volume.aligned_chunks(1)]
        edge = volume.chunks[0] + 1
        self._most = max(8, most_bytes // (edge**3 * volume.dtype.itemsize))
        self._kept: OrderedDict[_Index, npt.NDArray[Any]] = OrderedDict()
        self._turn = threading.Lock()

    def __getstate__(self) -> Any:
        # Another process has its own lock and cache.
        return self._volume, self._borders, self._most

    def __setstate__(self, state: Any) -> None:
        self._volume, self._borders, self._most = state
        self._kept = OrderedDict()
        self._turn = threading.Lock()

    def forget(self) -> None:
        with self._turn:
            self._kept.clear()

    def copy(self, lows: list[int], highs: list[int], out: npt.NDArray[Any]) -> None:
        """Copies the samples from lows up to highs."""
        met = [range(int(np.searchsorted(borders, low, "right")) - 1, int(np.searchsorted(borders, high, "left")))
               for borders, low, high in zip(self._borders, lows, highs)]
        for z, y, x in product(*met):
            samples = self._brick((z, y, x))
            here, there = [], []
            for axis, number in enumerate((z, y, x)):
                begin, end = self._borders[axis][number:number + 2]
                low, high = max(begin, lows[axis]), min(end, highs[axis])
                here.append(slice(low - begin, high - begin))
                there.append(slice(low - lows[axis], high - lows[axis]))
            out[tuple(there)] = samples[tuple(here)]

    def _brick(self, index: _Index) -> npt.NDArray[Any]:
        with self._turn:
            if index in self._kept:
                self._kept.move_to_end(index)
                return self._kept[index]
        # Without the lock, so that threads decode concurrently.
        samples = self._volume.read([self._borders[axis][n:n + 2] for axis, n in enumerate(index)])
        with self._turn:
            self._kept[index] = samples
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        return samples


def _zarray(shape: Sequence[int], chunks: Sequence[int], dtype: np.dtype[Any]) -> dict[str, Any]:
    # No fill value: xarray would take samples that have it for missing ones.
    return {"zarr_format": 2, "shape": list(shape), "chunks": list(chunks), "dtype": dtype.str, "compressor": None,
            "filters": None, "fill_value": None, "order": "C", "dimension_separator": "/"}


def _about(volume: Volume) -> dict[str, Any]:
    """What the file says besides its samples. JSON has no NaN and no infinity."""
    bounds = {"max_error": volume.max_error, "achieved_max_error": volume.achieved["max_error"]}
    return {**{name: bound if math.isfinite(bound) else None for name, bound in bounds.items()},
            "affine": volume.affine.tolist(), "metadata": volume.metadata}


def _meaning_of_samples(volume: Volume) -> dict[str, Any]:
    """Attributes of the CF conventions: value = scale_factor * sample + add_offset, and the unit of values.
    They cannot hold a slope for each slice."""
    metadata = volume.metadata
    slope, intercept = (1, 0) if "slice_slopes" in metadata else rescale_of(metadata)
    scale = {} if (slope, intercept) == (1, 0) else {"scale_factor": float(slope), "add_offset": float(intercept)}
    units = metadata.get("rescale_units") or metadata.get("sample units")
    return {**scale, **({"units": units} if units else {})}
