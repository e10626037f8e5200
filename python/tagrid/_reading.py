"""Samples and metadata of .tag files, read region by region. The package tagrid-reader has this module, too."""

from __future__ import annotations

import hashlib
import html
import math
import os
import uuid
from itertools import product
from typing import Any, Callable, Iterator, Optional, Sequence, Type, TypeVar, Union

import numpy as np
import numpy.typing as npt

from ._arguments import whole_number, work
from ._errors import ArgumentError, InputError
from ._geometry import affine_of, metadata_of, slice_positions_of
from ._kept import KeptBox
from ._regions import Region, checked_out, runs_of
from ._rescaling import rescaling_of
from ._selection import Run, Selection, select
from ._sources import OverviewOf, VolumeOf, describe, is_memory, is_path, is_tied, open_reader

Progress = Optional[Callable[[int, int], object]]
AnyVolume = TypeVar("AnyVolume", bound="Volume")


def _opened_again(of: Type[AnyVolume], source: Any, threads: int, contents: str) -> AnyVolume:
    """Restores a pickled volume. InputError: its file has been replaced since then."""
    volume = of(source, threads)
    if contents and volume._contents != contents:
        raise InputError(f"{volume._name}: the file is not the one that was open when the volume was pickled; open it again")
    return volume


class Volume:
    """An open .tag file, which open() returns. It acts like an array of samples. A slice reads and
    decodes only the bricks that it intersects.

    Axes are z, y, x, as in numpy: v[z, y, x]. World coordinates are x, y, z. Samples are stored samples, each
    within max_error of the original. If metadata has "rescale_slope", value = slope * sample + intercept, and
    v.rescaled[z, y, x] is that value. Any number of threads may use one volume.
    """

    def __init__(self, source: Any, threads: int = 0):
        self._threads = whole_number("threads", threads)
        self._reader = open_reader(source)
        self._source = os.path.abspath(source) if is_path(source) else source
        self._name = describe(source)
        self._kept = KeptBox()
        self._info = self._reader.info()
        self._overviews = self._reader.overviews()
        self._volumes = self._reader.volumes()
        self._header = self._reader.metadata().decode("utf-8", "surrogateescape")
        # Bytes go to another process with the volume; a name may refer to another file there.
        self._contents = "" if is_memory(source) else self._digest()
        self._token = self._token_of(source)

    # ---- what it is

    @property
    def shape(self) -> tuple[int, int, int]:
        """Samples along z, y and x."""
        x, y, z = self._info["dims"]
        return z, y, x

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of the samples: an integer of 8, 16 or 32 bits, float32 or float64."""
        dtype: np.dtype[Any] = self._info["dtype"]
        return dtype

    ndim = 3

    @property
    def size(self) -> int:
        """The number of samples."""
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """The bytes of all decoded samples. The file has info["file_bytes"]."""
        return self.size * self.dtype.itemsize

    @property
    def chunks(self) -> tuple[int, int, int]:
        """The size of a brick along z, y and x, (64, 64, 64) by default. Along an axis, the first brick holds
        samples 0 to 63, the next one 64 to 127, and so on: such a chunk is a brick. Only in a file that was
        encoded with lead=0 does the first one hold a sample more; see aligned_chunks()."""
        edge = self._info["brick_edge"]
        return edge, edge, edge

    def aligned_chunks(self, bricks: int = 4) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
        """The sizes of chunks along z, y and x that hold this many complete bricks along each axis. With
        these, no brick is decoded twice:

            dask.array.from_array(volume, chunks=volume.aligned_chunks())
        """
        if bricks < 1:
            raise ArgumentError(f"a chunk has at least one brick along each axis, not {bricks}")
        z, y, x = (tuple(int(count) for count in np.diff(self._borders(axis, bricks))) for axis in range(3))
        return z, y, x

    def _borders(self, axis: int, bricks: int = 1) -> list[int]:
        size, edge = self.shape[axis], self._info["brick_edge"]
        return [0, *range((bricks - 1) * edge + self._first_brick, size, bricks * edge), size]

    @property
    def _first_brick(self) -> int:
        """The samples of the first brick along an axis."""
        edge: int = self._info["brick_edge"]
        return edge if self._info["lead"] else edge + 1

    @property
    def spacing(self) -> tuple[float, float, float]:
        """The distances between neighboring samples along z, y and x, in the units of the scan, usually mm.
        NaN if unknown."""
        x, y, z = self._info["spacing"] if self._info["has_spacing"] else (math.nan,) * 3
        return z, y, x

    @property
    def affine(self) -> npt.NDArray[np.float64]:
        """4 x 4: affine @ (x, y, z, 1) is the world position of sample v[z, y, x]. If the file does not give
        it, samples are 1 apart and the first one is at 0."""
        return affine_of(self._info)

    @property
    def slice_positions(self) -> Optional[npt.NDArray[np.float64]]:
        """(slices, 3): x, y, z of the first sample of each slice in the world, if slices are unevenly spaced.
        None if they are evenly spaced; `affine` then gives their positions."""
        return slice_positions_of(self.metadata, self.shape[0])

    @property
    def max_error(self) -> float:
        """The bound: no stored sample is further than this from the original. 0: lossless. inf: no bound.
        Multiply it by the slope for values, such as HU."""
        bound: float = self._info["max_error"]
        return math.inf if math.isnan(bound) else bound

    @property
    def achieved(self) -> dict[str, float]:
        """The errors of stored samples, measured during encoding: max_error, rmse, psnr (in dB) and
        mesh_error. NaN if unknown."""
        return {name: self._info[f"achieved_{name}"] for name in ("max_error", "rmse", "psnr", "mesh_error")}

    @property
    def levels(self) -> int:
        """The deepest level of the grid: levels are 0, the coarsest, up to this one."""
        levels: int = self._info["levels"]
        return levels

    @property
    def metadata(self) -> dict[str, str]:
        """Other metadata of the source: names and strings."""
        return metadata_of(self._header)

    @property
    def header(self) -> str:
        """All metadata of the source, as lines of an NRRD header."""
        return self._header

    @property
    def info(self) -> dict[str, Any]:
        """Everything known without decoding. The keys are the members of tagrid_info in tagrid.h; three
        numbers are x, y, z here."""
        return dict(self._info)

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        closed = ", closed" if self._reader.closed else ""
        return f"<{__package__}.Volume {self._name!r} {self.shape} {self.dtype}, {self._bound_in_words()}{closed}>"

    def _repr_html_(self) -> str:
        rows = {"shape (z, y, x)": " × ".join(map(str, self.shape)), "type": str(self.dtype),
                "spacing (z, y, x)": " × ".join(f"{step:g}" for step in self.spacing),
                "error": self._bound_in_words(), "achieved": f"{self.achieved['max_error']:g}",
                "bytes": f"{self._info['file_bytes']:,} of {self.nbytes:,}"}
        cells = "".join(f"<tr><th>{name}</th><td>{html.escape(text)}</td></tr>" for name, text in rows.items())
        return f"<table><caption>tagrid: {html.escape(self._name)}</caption>{cells}</table>"

    def _bound_in_words(self) -> str:
        bound = self.max_error
        return "lossless" if bound == 0 else "no bound" if math.isinf(bound) else f"max_error {bound:g}"

    # ---- samples

    def __getitem__(self, key: Any) -> Any:
        """Returns the samples v[z, y, x] with numpy indexing: integers, slices with any step, Ellipsis, None,
        and an index array or a boolean mask along one axis. Decodes only the bricks that hold them. When two
        consecutive reads need the same bricks, they are cached; all volumes of a process share a cache of at
        most 256 MiB.

        IndexError: a position is outside the volume, or the index is not supported.
        """
        selection = select(key, self.shape, self._info["brick_edge"], self._first_brick)
        samples = np.empty(selection.shape, self.dtype)
        self._fill(samples, selection)
        return samples[selection.key]

    def __iter__(self) -> Iterator[npt.NDArray[Any]]:
        """Yields slices along z. Each brick is decoded once, and a layer of bricks is in memory."""
        for layer in self._layers():
            yield from self[layer]

    def _layers(self) -> Iterator[slice]:
        borders = self._borders(0)
        return map(slice, borders[:-1], borders[1:])

    def __array__(self, dtype: npt.DTypeLike = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        """Returns all samples, for np.asarray(v) and np.array(v, dtype). This always copies: copy=False is a
        ValueError."""
        if copy is False:
            raise ValueError("the samples of a volume must be decoded, which makes a copy")
        samples = np.empty(self.shape, self.dtype if dtype is None else dtype)
        if samples.dtype == self.dtype:
            self.read(out=samples)
        else:
            for layer in self._layers():
                samples[layer] = self[layer]
        return samples

    def read(self, region: Optional[Region] = None, step: Union[int, Sequence[int]] = 1,
             out: Any = None, *, threads: Optional[int] = None, memory_limit: int = 0,
             progress: Progress = None) -> npt.NDArray[Any]:
        """Reads samples, and caches nothing.

        region: ((z0, z1), (y0, y1), (x0, x1)), excluding the second numbers; None: all.
        step: 2 takes every second sample. One number for all axes, or one for each (z, y, x).
        out: a writable array of the same shape and dtype, with any strides. It is filled and returned.
        threads: 0 for all processors; None for the number given to open().
        memory_limit: bytes for the work, without the result; 0: no limit.
        progress(done, total): called from time to time with bytes of samples; an exception cancels the call.

        ArgumentError: the region is not within the volume, or `out` does not fit. TypeError: `out` is not an
        array, or has another type. DamagedError, InputError, MemoryLimitError: see their help.
        """
        runs = runs_of(region, step, self.shape)
        shape = tuple(run.length for run in runs)
        target = np.empty(shape, self.dtype) if out is None else checked_out(out, shape, self.dtype)
        self._read_runs(runs, target, threads, memory_limit, progress)
        result: npt.NDArray[Any] = target if out is None else out
        return result

    @property
    def rescaled(self) -> Rescaled:
        """An array of values, slope * sample + intercept, such as HU: v.rescaled[z, y, x].

        ArgumentError: there are slopes for slices, but not one for each slice.
        """
        return Rescaled(self)

    @property
    def overviews(self) -> tuple[int, ...]:
        """The factors of the overviews that the file has, from fine to coarse: (4, 16) for example, or ()."""
        return self._overviews

    def overview(self: AnyVolume, factor: int) -> AnyVolume:
        """The overview with this factor, as a volume: each sample is the mean of factor x factor x factor samples,
        and `affine` and `spacing` say where it is. It reads nothing but the overview.

        ArgumentError: the file has no overview with this factor.
        """
        if factor not in self._overviews:
            there = ", ".join(map(str, self._overviews)) or "none"
            raise ArgumentError(f"{self._name}: has no overview {factor!r}; it has {there}")
        return type(self)(OverviewOf(self._source, factor), self._threads)

    @property
    def volumes(self) -> int:
        """How many volumes the file has: 1, or more, such as time points. They are numbered from 0 on, and this one
        is volume 0 unless volume() returned it."""
        return self._volumes

    @property
    def is_first_of_several(self) -> bool:
        """True if the file has several volumes, and none of them was chosen with volume()."""
        return self._volumes > 1 and not isinstance(self._source, VolumeOf)

    def volume(self: AnyVolume, number: int) -> AnyVolume:
        """The volume with this number: all of them have the same shape and type. It reads nothing but that volume.
        Its metadata may have "volume_name", its name or time.

        TypeError: it is not an integer. ArgumentError: the file has no such volume.
        """
        number = whole_number("the number of a volume", number)
        if not 0 <= number < self._volumes:
            there = "only volume 0" if self._volumes == 1 else f"{self._volumes} volumes, 0 to {self._volumes - 1}"
            raise ArgumentError(f"{self._name}: has no volume {number}; it has {there}")
        return type(self)(VolumeOf(self._source, number), self._threads)

    # ---- opening and closing

    def close(self) -> None:
        """Closes the volume. Running calls of other threads complete. A file object given to open() stays
        open."""
        self._reader.close()
        self._kept.forget()

    @property
    def closed(self) -> bool:
        """Whether close() was called. Samples are then unavailable, but everything in the header remains."""
        return self._reader.closed

    def __enter__(self: AnyVolume) -> AnyVolume:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> Any:
        # Objects with read_at(), and fsspec files, know whether they can go to another process.
        if is_tied(self._source):
            raise TypeError(f"a volume from {type(self._source).__name__!r} cannot be pickled; open it by its path")
        return _opened_again, (type(self), self._source, self._threads, self._contents)

    def __dask_tokenize__(self) -> Any:
        """Keeps the names of dask tasks as long as the file is the same."""
        return self._token

    def _token_of(self, source: Any) -> Any:
        try:
            status = os.stat(source) if is_path(source) else None
        except OSError:
            status = None
        if status is None:
            # Not id(), which another volume may get later.
            return "tagrid.Volume", self._name, uuid.uuid4().hex
        # The current status: later, the name may refer to another file.
        return ("tagrid.Volume", os.path.abspath(os.fsdecode(source)), status.st_ino, status.st_mtime_ns,
                status.st_size, self._contents)

    def _digest(self) -> str:
        """Distinguishes this file from others, without decoding it."""
        bricks = math.prod(self._info["bricks"])
        some = [self._reader.brick(number) for number in sorted({0, bricks // 2, bricks - 1})]
        numbers = [self._info[name] for name in ("file_bytes", "dims", "low", "high", "mean")]
        numbers += [brick[name] for brick in some for name in ("offset", "bytes", "mean") if name in brick]
        text = f"{numbers} {self.dtype.str} {self._header}"
        return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()

    # ---- arguments

    def _work(self, threads: Optional[int], memory_limit: int) -> tuple[int, int]:
        return work(self._threads if threads is None else threads, memory_limit)

    # ---- work

    def _read_runs(self, runs: Sequence[Run], out: npt.NDArray[Any], threads: Optional[int] = None,
                   memory_limit: int = 0, progress: Progress = None) -> None:
        z, y, x = runs
        self._reader.read((x.start, y.start, z.start), (x.stop, y.stop, z.stop), (x.step, y.step, z.step), out,
                          *self._work(threads, memory_limit), progress)

    def _whole_bricks(self, axis: int, low: int, high: int) -> tuple[int, int]:
        """The samples of the bricks that hold samples [low, high)."""
        edge, of_first = self._info["brick_edge"], self._first_brick
        first, last = (max(position - of_first + edge, 0) // edge for position in (low, high - 1))
        return (first - 1) * edge + of_first if first else 0, min(last * edge + of_first, self.shape[axis])

    def _fill(self, samples: npt.NDArray[Any], selection: Selection) -> None:
        if self._reader.closed:
            raise ArgumentError("the volume is closed")
        if all(len(runs) == 1 and runs[0].step == 1 for runs in selection.runs):
            part = tuple((runs[0].start, runs[0].stop) for runs in selection.runs)
            box = tuple(self._whole_bricks(axis, *ends) for axis, ends in enumerate(part))
            # Reads that need most samples of their bricks are not part of a slice-by-slice loop.
            if math.prod(high - low for low, high in box) >= 2 * samples.size and self._kept.read(box, part, samples, self.read):
                return
        starts = [np.cumsum([0] + [run.length for run in runs]) for runs in selection.runs]
        for numbers in product(*(range(len(runs)) for runs in selection.runs)):
            runs = [selection.runs[axis][number] for axis, number in enumerate(numbers)]
            place = tuple(slice(starts[axis][n], starts[axis][n + 1]) for axis, n in enumerate(numbers))
            self._read_runs(runs, samples[place])


class Rescaled:
    """The values of a volume, such as HU: an array v[z, y, x] of slope * sample + intercept. Volume.rescaled
    returns it. A slice reads and decodes only the bricks that it intersects.

    Values have the first of these types that holds all of them exactly: int16, uint16, int32, uint32. If the
    slope or the intercept has a fraction, if samples are floats, or if none of these types holds all values,
    values are float32. They are float64 if samples are float64. Without a slope and an intercept, values equal samples.
    """

    ndim = 3

    def __init__(self, volume: Volume):
        self.volume = volume
        self._rescaling = rescaling_of(repr(volume), volume.shape, volume.info, volume.metadata)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Values along z, y and x."""
        return self.volume.shape

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of the values, for any region."""
        return self._rescaling.dtype

    def __len__(self) -> int:
        return len(self.volume)

    def __repr__(self) -> str:
        return f"<{__package__}.Rescaled {self.shape} {self.dtype} of {self.volume!r}>"

    def __getitem__(self, key: Any) -> Any:
        """Returns the values v[z, y, x], with the rules of Volume.__getitem__()."""
        return self._rescaling.values_of(self.volume[key], key)

    def __iter__(self) -> Iterator[npt.NDArray[Any]]:
        for z, samples in enumerate(self.volume):
            yield self._rescaling.values_of(samples, z)

    def __array__(self, dtype: npt.DTypeLike = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        if copy is False:
            raise ValueError("the values of a volume must be computed, which makes a copy")
        values = self.read()
        return values if dtype is None else values.astype(dtype, copy=False)

    def read(self, region: Optional[Region] = None, step: Union[int, Sequence[int]] = 1, *,
             threads: Optional[int] = None, memory_limit: int = 0,
             progress: Optional[Callable[[int, int], object]] = None) -> npt.NDArray[Any]:
        """Returns the values of a region, with the arguments of Volume.read()."""
        runs = runs_of(region, step, self.shape)
        samples = self.volume.read(region, step, threads=threads, memory_limit=memory_limit, progress=progress)
        values: npt.NDArray[Any] = self._rescaling.values_of(samples, tuple(slice(*run) for run in runs))
        return values

    def value_of(self, sample: float) -> Optional[float]:
        """The value of a sample; None if it differs between slices."""
        return self._rescaling.value_of(sample)

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata of the volume. "applied_slope" and "applied_intercept" record how samples became
        values, as in files that `tagrid decode --values` writes."""
        return self._rescaling.applied_to(self.volume.metadata)

    @property
    def max_error(self) -> float:
        """The bound in values: that of the volume times the largest slope."""
        return self.volume.max_error * self._rescaling.largest_slope

    @property
    def achieved(self) -> dict[str, float]:
        """The measured errors of values, as Volume.achieved has those of samples. If each slice has its own
        slope, these are upper limits."""
        slope = self._rescaling.largest_slope
        return {name: error if name == "psnr" else error * slope for name, error in self.volume.achieved.items()}

    def __dask_tokenize__(self) -> Any:
        return "tagrid.Rescaled", self.volume.__dask_tokenize__()
