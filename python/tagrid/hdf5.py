"""HDF5: the filter's options for h5py, and multithreaded encoding and decoding of chunks.

    with h5py.File("scan.h5", "w") as file:
        file.create_dataset("scan", data=scan, chunks=(64, 64, 64), **tagrid.hdf5.Filter(max_error=2))

To read, you need only h5py and the plugin, not this module: see docs/hdf5.md.
"""

from __future__ import annotations

import itertools
import os
import struct
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from ._arguments import EFFORTS, finite_bound, flag, one_of, thresholds, whole_number
from ._arrays import with_three_axes
from ._errors import ArgumentError, DamagedError
from ._lattice import decode_chunk, encode_chunk, lattice_of, step_of
from ._volume import Volume

__all__ = ["FILTER_ID", "Filter", "read", "write"]

#: The number of the filter, unless the plugin was built with another one.
FILTER_ID = 33184
#: The filter's numbers in a file: how many, and the version, which is the fifth number
#: (plugins/hdf5/coding.h).
_STORED_NUMBERS, _LAYOUT, _LAYOUT_WITH_THRESHOLDS, _MOST_THRESHOLDS = 11, 2, 3, 2

if TYPE_CHECKING:
    _Base = Mapping[str, Any]
else:
    try:
        # With it, create_dataset(..., compression=Filter()) also works.
        import h5py

        _Base = h5py.filters.FilterRefBase
    except ImportError:
        _Base = Mapping


class Filter(_Base):
    """Options of h5py's create_dataset() that compress a data set: create_dataset(..., **Filter(max_error=2)).

    max_error: no sample is off by more than this, in units of the samples; 0: lossless.
    effort: "fast", "default" or "best": trades time for size.
    whole_chunks: promises that every chunk is written once and completely. Chunks with a bound then take
        fewer bytes. HDF5 decodes and encodes a chunk again whenever part of it is written, and the errors of
        these encodings add up. Without this promise, the bound holds however a chunk is written.
    threshold: a number, or two; needs whole_chunks. No sample changes its side of these; see tagrid.encode().

    Chunks of 64 x 64 x 64 are best. The filter must be the first one, so do not combine it with shuffle.

    Without whole_chunks, samples are rounded to a fixed lattice: integers to every (2 E + 1)-th number, counted
    from the fill value, and floats to multiples of the largest m * 2**n that is at most 2 E, with m below 32.
    Kept bit by bit are the limits of integers, non-finite floats, the fill value, and floats that are farther from
    0 than 2**19 (float32) or 2**30 (float64) multiples. A chunk with more than 8 different ones of these floats is
    lossless.
    """

    def __init__(self, max_error: float = 0, effort: str = "default", whole_chunks: bool = False,
                 threshold: Union[float, Sequence[float], None] = None):
        one_of("effort", effort, EFFORTS)
        self.max_error, self.effort = finite_bound(max_error), effort
        self.whole_chunks = flag("whole_chunks", whole_chunks)
        self.thresholds = thresholds(() if threshold is None else threshold)
        if len(self.thresholds) > _MOST_THRESHOLDS:
            raise ArgumentError(f"threshold has at most {_MOST_THRESHOLDS} numbers in HDF5")
        if self.thresholds and not whole_chunks:
            raise ArgumentError("threshold needs whole_chunks=True: chunks that are written once and completely")

    @property
    def filter_id(self) -> int:
        return FILTER_ID

    @property
    def filter_options(self) -> tuple[int, ...]:
        """The numbers (cd_values) that HDF5 passes to the filter."""
        return (*_halves(self.max_error), EFFORTS[self.effort], int(self.whole_chunks),
                *itertools.chain(*map(_halves, self.thresholds)))

    def __getitem__(self, key: str) -> Any:
        return {"compression": self.filter_id, "compression_opts": self.filter_options}[key]

    def __iter__(self) -> Iterator[str]:
        return iter(("compression", "compression_opts"))

    def __len__(self) -> int:
        return 2

    def __hash__(self) -> int:
        return hash(self.filter_options)

    def __repr__(self) -> str:
        whole = ", whole_chunks=True" if self.whole_chunks else ""
        threshold = f", threshold={self.thresholds}" if self.thresholds else ""
        return f"tagrid.hdf5.Filter(max_error={self.max_error:g}, effort={self.effort!r}{whole}{threshold})"


def _halves(number: float) -> tuple[int, ...]:
    """The low and the high 32 bits of a double."""
    return struct.unpack("<2I", struct.pack("<d", number))


def filter_of(dataset: Any) -> Filter:
    """The filter of a data set. ArgumentError: it has none, or several."""
    if not hasattr(dataset, "id"):
        raise TypeError(f"give a data set of an open file, h5py.File(path)[name], not {dataset!r}")
    properties = dataset.id.get_create_plist()
    if properties.get_nfilters() != 1 or properties.get_filter(0)[0] != FILTER_ID:
        raise ArgumentError(f"{dataset.name}: tagrid must be the only filter of the data set")
    given = properties.get_filter(0)[2]
    others = len(given) - _STORED_NUMBERS
    if (others not in range(0, 2 * _MOST_THRESHOLDS + 1, 2) or given[2] >= len(EFFORTS) or given[3] > 1
            or given[4] != (_LAYOUT if others == 0 else _LAYOUT_WITH_THRESHOLDS)):
        raise DamagedError(f"{dataset.name}: the numbers of its filter are {tuple(given)}, which tagrid does not know")
    doubles = (*given[:2], *given[_STORED_NUMBERS:])
    bound, *thresholds_given = struct.unpack(f"<{len(doubles) // 2}d", struct.pack(f"<{len(doubles)}I", *doubles))
    return Filter(bound, [*EFFORTS][given[2]], bool(given[3]), thresholds_given)


def write(dataset: Any, array: npt.ArrayLike, threads: int = 0) -> None:
    """Writes an entire data set that has the filter. Several threads encode chunks, whereas HDF5 uses one.

    array: has the shape of the data set. It may have another type if the type of the data set can hold its
    samples.
    threads: 0 for all processors that the process may use.

    TypeError: floats for a data set of integers. ArgumentError: another shape, or a sample that does not fit.
    Some chunks may then already be written.
    """
    settings = filter_of(dataset)
    if isinstance(array, np.ma.MaskedArray):
        raise TypeError("a masked array cannot be written; fill it first: array.filled(value)")
    samples = np.asarray(array)
    if samples.shape != dataset.shape:
        raise ArgumentError(f"the array has the shape {samples.shape}, and the data set {dataset.shape}")
    if not np.can_cast(samples.dtype, dataset.dtype, "same_kind") and samples.dtype.kind not in "biu":
        raise TypeError(f"samples are {samples.dtype.name}, and the data set {dataset.dtype.name}; convert them first, for "
                        f"example by numpy.rint(array).astype({dataset.dtype.name!r})")

    # Threads must not use h5py. It has one lock, which this thread may hold while a Python file waits for a
    # thread.
    shape_of_chunk, fill, dtype = dataset.chunks, dataset.fillvalue, dataset.dtype

    def encoded(place: tuple[int, ...]) -> bytes:
        # HDF5 chunks are complete, even if the data set ends earlier.
        chunk = np.full(shape_of_chunk, fill, dtype)
        part = samples[tuple(slice(low, low + size) for low, size in zip(place, shape_of_chunk))]
        chunk[tuple(map(slice, part.shape))] = _converted(part, dtype)
        return encode_chunk(chunk, settings.max_error, settings.whole_chunks, fill, {}, effort=settings.effort,
                            grid="derived", threads=1, threshold=settings.thresholds or None)

    for place, chunk in _in_order(encoded, _places(samples.shape, shape_of_chunk), threads):
        dataset.id.write_direct_chunk(place, chunk)


def read(dataset: Any, threads: int = 0) -> npt.NDArray[Any]:
    """Reads an entire data set that has the filter. Several threads decode chunks, whereas HDF5 uses one.

    DamagedError names the first chunk that is damaged, or whose type, shape or bound does not fit the data
    set.
    """
    settings = filter_of(dataset)
    bound, thresholds_given = settings.max_error, settings.thresholds
    # As in write(): threads must not use h5py.
    name, shape_of_chunk = dataset.name, dataset.chunks
    dtype = dataset.dtype.newbyteorder("=")
    shape = tuple(with_three_axes(np.broadcast_to(np.uint8(0), shape_of_chunk)).shape)
    samples = np.full(dataset.shape, dataset.fillvalue, dataset.dtype)

    def decoded(item: tuple[tuple[int, ...], bytes]) -> None:
        place, file = item
        try:
            with Volume(file, threads=1) as volume:
                step, found = lattice_of(volume)
                if (volume.shape, found) != (shape, dtype):
                    raise DamagedError(f"it is a volume of the shape {volume.shape} and the type {found.name}")
                if volume.max_error > bound or step not in (0, step_of(dtype, bound)):
                    raise DamagedError(f"its samples are not known to be within {bound:g}, the bound of the data set")
                if (volume.max_error > 0 or step != 0) and [entry["value"] for entry in volume.info["thresholds"]] != thresholds_given:
                    raise DamagedError("its samples are not known to be on their sides of the thresholds of the data set")
                chunk = decode_chunk(volume).reshape(shape_of_chunk)
        except DamagedError as error:
            raise DamagedError(f"{name}: the chunk at {tuple(place)}: {error}") from error
        target = samples[tuple(slice(low, low + size) for low, size in zip(place, shape_of_chunk))]
        target[...] = chunk[tuple(map(slice, target.shape))]

    stored = ((place, dataset.id.read_direct_chunk(place)[1]) for place in _stored_places(dataset))
    for _ in _in_order(decoded, stored, threads):
        pass
    return samples


def _converted(part: npt.NDArray[Any], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """Samples in the type of the data set. ArgumentError: a sample does not fit; numpy would wrap it
    around."""
    if np.can_cast(part.dtype, dtype, "safe"):
        return part
    with np.errstate(over="ignore"):
        converted = part.astype(dtype)
    # Floats may lose digits, but not become infinite; integers lose nothing.
    kept = np.isfinite(converted) | ~np.isfinite(part) if part.dtype.kind == "f" else converted == part
    if not kept.all():
        raise ArgumentError(f"the sample {part[~kept][0]} does not fit into {dtype.name}, the type of the data set")
    return converted


def _places(shape: tuple[int, ...], chunks: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """The position of the first sample of each chunk."""
    return itertools.product(*(range(0, size, edge) for size, edge in zip(shape, chunks)))


def _stored_places(dataset: Any) -> Iterator[tuple[int, ...]]:
    for i in range(dataset.id.get_num_chunks()):
        info = dataset.id.get_chunk_info(i)
        if info.filter_mask:
            raise ArgumentError(f"{dataset.name}: the chunk at {info.chunk_offset} was stored without the filter; read it by slices")
        yield info.chunk_offset


def _in_order(work: Any, items: Iterator[Any], threads: int) -> Iterator[tuple[Any, Any]]:
    """Yields items and the results of work(). Only a few are ahead, so memory does not grow with their
    number."""
    count = whole_number("threads", threads) or len(os.sched_getaffinity(0))
    if count < 0:
        raise ArgumentError("threads must be 0, for all processors, or more")
    with ThreadPoolExecutor(count) as pool:
        waiting: list[Any] = []
        for item in items:
            waiting.append((item, pool.submit(work, item)))
            if len(waiting) > 2 * count:
                first, future = waiting.pop(0)
                yield first, future.result()
        for first, future in waiting:
            yield first, future.result()
