"""Writes .tag files from arrays, or slice by slice."""

from __future__ import annotations

import errno
import io
import os
import warnings
from typing import Any, Callable, Optional, Protocol, Sequence, Union, overload

import numpy as np
import numpy.typing as npt

from ._arguments import EFFORTS, GRIDS, encoder_settings, error_rule, factors, one_of, thresholds, work
from ._arrays import AnySamples, as_volume, checked_dtype, checked_shape, slabs_of
from ._errors import ArgumentError, DamagedError, InputError
from ._files import NewFile
from ._geometry import Metadata, header_bytes, header_of
from ._labelled import check_missing, label_of
from ._tagrid import Encoder
from ._volume import Progress, Volume


class Sink(Protocol):
    """Receives the bytes of a file as they are produced."""

    def write(self, data: bytes, /) -> object: ...


Output = Union[str, bytes, "os.PathLike[str]", "os.PathLike[bytes]", Sink]


class Writer:
    """Writes a .tag file from consecutive slices:

        with tagrid.Writer("scan.tag", shape=(900, 512, 512), dtype="int16", max_error=5) as writer:
            for slices in source:
                writer.write(slices)

    The file gets its name at the end of the block, complete and on disk. If the block raises an exception or
    writes too few slices, no file remains, and an existing file stays. Memory does not grow with the number
    of slices. A process that is forked inside the block cannot use the writer, and does not disturb it. To
    cancel from a callback, raise an exception; do not call close().

    out: a path, or an object with write(), which receives the bytes as they are produced.
    shape: samples along z, y and x. dtype: one of the eight types of samples.
    samples: samples(first, count) returns samples first .. first + count - 1 of the volume, x fastest, as an
        array. It is called before the first slice, for settings that depend on the samples:
        max_error="noise:K", relative_error, psnr, ratio, bits, and the range of samples of 32 and 64 bits. Without it,
        such bounds are refused, and the range needs value_range or field_scale.
    The other arguments are those of encode().
    """

    def __init__(self, out: Output, *, shape: Sequence[int], dtype: npt.DTypeLike,
                 max_error: Union[float, str, None] = 0, spacing: Optional[Sequence[float]] = None,
                 affine: Optional[npt.ArrayLike] = None,
                 metadata: Optional[Metadata] = None, effort: str = "default", threads: int = 0,
                 surface_error: Optional[float] = None, mesh_error: Optional[float] = None, grid: Optional[str] = None,
                 grid_only: bool = False, value_range: Optional[Sequence[float]] = None,
                 field_scale: Optional[float] = None, max_level: Optional[int] = None, cube: Optional[int] = None,
                 brick: Optional[int] = None, lead: Optional[int] = None, accuracy: Optional[int] = None,
                 memory_limit: int = 0, progress: Progress = None, relative_error: Optional[float] = None,
                 psnr: Optional[float] = None, ratio: Optional[float] = None,
                 bits: Optional[float] = None, samples: Optional[Callable[[int, int], Any]] = None,
                 overviews: Union[str, Sequence[int]] = "auto",
                 threshold: Union[float, Sequence[float], None] = None):
        self._shape = checked_shape(shape)
        self._dtype = checked_dtype(dtype)
        one_of("effort", effort, EFFORTS)
        if grid is not None:
            one_of("grid", grid, GRIDS)
        if self._dtype.itemsize > 2 and value_range is None and field_scale is None and samples is None:
            raise ArgumentError(f"{self._dtype.name} samples have no usual range: give value_range=(low, high), the span of "
                                "values that matters, or field_scale")
        z, y, x = self._shape
        options: dict[str, Any] = {
            "dims": (x, y, z), "dtype": self._dtype, "effort": EFFORTS[effort],
            "grid": 0 if grid is None else GRIDS[grid], "grid_only": grid_only, "metadata": header_bytes(header_of(spacing, affine, metadata))}
        rule = error_rule(max_error, relative_error=relative_error, psnr=psnr, ratio=ratio, bits=bits)
        if rule and samples is None:
            raise ArgumentError("the bound follows from the samples; give samples=, a function that reads them, or a number")
        options.update(rule)
        both_hold = psnr is not None and max_error  # 0 is what is given if nothing is
        options.update(encoder_settings(
            {"max_error": max_error if not rule or both_hold else None, "surface_error": surface_error,
             "mesh_error": mesh_error, "field_scale": field_scale},
            {"max_level": max_level, "cube": cube, "brick": brick, "lead": lead, "accuracy": accuracy}, value_range))
        chosen = factors(overviews)
        if chosen is not None:
            options["overviews"] = chosen
        if threshold is not None:
            options["thresholds"] = thresholds(threshold)
        options["spool"] = os.fsencode(_spool_of(out))
        settings = work(threads, memory_limit)
        self._file = NewFile(out) if isinstance(out, (str, bytes, os.PathLike)) else None
        self._written = 0
        self._info: Optional[dict[str, Any]] = None
        self._encoder: Optional[Encoder] = None
        try:
            self._encoder = Encoder(options, _write_of(out) if self._file is None else self._file.write, samples,
                                    *settings, progress)
        except BaseException:
            self.abort()
            raise

    def write(self, slices: npt.ArrayLike) -> None:
        """Writes the next slices: an array (y, x) or (slices, y, x) of the volume's type, with any
        strides."""
        encoder = self._open_encoder()
        if isinstance(slices, np.ma.MaskedArray):
            raise TypeError("masked slices cannot be encoded; fill them first: slices.filled(value)")
        array = np.asarray(slices)
        if array.ndim == 2:
            array = array[np.newaxis]
        if array.dtype.newbyteorder("=") != self._dtype:
            raise TypeError(f"the slices are {array.dtype.name}, and the volume is {self._dtype.name}; convert them first")
        if array.ndim != 3 or array.shape[1:] != self._shape[1:]:
            raise ArgumentError(f"slices have the shape {self._shape[1:]}, but an array of {np.shape(slices)} was given")
        if self._written + len(array) > self._shape[0]:
            raise ArgumentError(f"there are {self._shape[0]} slices; {self._written} were written, and {len(array)} more "
                                "are too many")
        encoder.write(array if array.dtype.isnative else array.astype(self._dtype))
        self._written += len(array)

    def close(self) -> None:
        """Waits until the file is complete, and gives it its name. The end of a with block does this. If
        slices are missing, it raises ArgumentError, and no file remains."""
        if self._encoder is None:
            return
        try:
            if self._written < self._shape[0]:
                raise ArgumentError(f"{self._shape[0] - self._written} of {self._shape[0]} slices are missing; no file was "
                                    "written")
            self._info = self._encoder.finish()
        except BaseException:
            self.abort()
            raise
        self._encoder.close()
        self._encoder = None
        if self._file is not None:
            self._file.commit()

    def abort(self) -> None:
        """Cancels the encoding. No file remains."""
        if self._encoder is not None:
            self._encoder.close()
            self._encoder = None
        if self._file is not None:
            self._file.discard()

    @property
    def info(self) -> dict[str, Any]:
        """The content of Volume.info, once the file is complete."""
        if self._info is None:
            raise ArgumentError("the file is not complete yet")
        return dict(self._info)

    @property
    def closed(self) -> bool:
        """Whether the writer accepts no more slices: the file is complete, or the encoding was canceled."""
        return self._encoder is None

    def __repr__(self) -> str:
        state = "complete" if self._info is not None else "ended" if self.closed else f"{self._written} written"
        return f"<tagrid.Writer {self._shape} {self._dtype}, {state}>"

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()

    def __del__(self) -> None:
        # A writer that was not closed has no file.
        if getattr(self, "_encoder", None) is not None:
            message = f"{self!r} was not closed, so there is no file"
            self.abort()
            warnings.warn(message, ResourceWarning, source=self)

    def _open_encoder(self) -> Encoder:
        if self._encoder is None:
            raise ArgumentError("the writer is closed")
        return self._encoder


@overload
def encode(array_or_path: Any, out: None = None, max_error: Union[float, str, None] = 0,
           spacing: Optional[Sequence[float]] = None, affine: Optional[npt.ArrayLike] = None,
           metadata: Optional[Metadata] = None, effort: str = "default", threads: int = 0, *,
           surface_error: Optional[float] = None, mesh_error: Optional[float] = None, grid: Optional[str] = None,
           grid_only: bool = False, value_range: Optional[Sequence[float]] = None, field_scale: Optional[float] = None,
           max_level: Optional[int] = None, cube: Optional[int] = None, brick: Optional[int] = None,
           lead: Optional[int] = None, accuracy: Optional[int] = None, memory_limit: int = 0, progress: Progress = None,
           relative_error: Optional[float] = None, psnr: Optional[float] = None, ratio: Optional[float] = None,
           bits: Optional[float] = None,
           overviews: Union[str, Sequence[int]] = "auto",
           threshold: Union[float, Sequence[float], None] = None) -> bytes: ...


@overload
def encode(array_or_path: Any, out: Output, max_error: Union[float, str, None] = 0,
           spacing: Optional[Sequence[float]] = None, affine: Optional[npt.ArrayLike] = None,
           metadata: Optional[Metadata] = None, effort: str = "default", threads: int = 0, *,
           surface_error: Optional[float] = None, mesh_error: Optional[float] = None, grid: Optional[str] = None,
           grid_only: bool = False, value_range: Optional[Sequence[float]] = None, field_scale: Optional[float] = None,
           max_level: Optional[int] = None, cube: Optional[int] = None, brick: Optional[int] = None,
           lead: Optional[int] = None, accuracy: Optional[int] = None, memory_limit: int = 0, progress: Progress = None,
           relative_error: Optional[float] = None, psnr: Optional[float] = None, ratio: Optional[float] = None,
           bits: Optional[float] = None,
           overviews: Union[str, Sequence[int]] = "auto",
           threshold: Union[float, Sequence[float], None] = None) -> None: ...


def encode(array_or_path: Any, out: Any = None, max_error: Union[float, str, None] = 0,
           spacing: Optional[Sequence[float]] = None, affine: Optional[npt.ArrayLike] = None,
           metadata: Optional[Metadata] = None, effort: str = "default", threads: int = 0, *,
           surface_error: Optional[float] = None, mesh_error: Optional[float] = None, grid: Optional[str] = None,
           grid_only: bool = False, value_range: Optional[Sequence[float]] = None, field_scale: Optional[float] = None,
           max_level: Optional[int] = None, cube: Optional[int] = None, brick: Optional[int] = None,
           lead: Optional[int] = None, accuracy: Optional[int] = None, memory_limit: int = 0, progress: Progress = None,
           relative_error: Optional[float] = None, psnr: Optional[float] = None, ratio: Optional[float] = None,
           bits: Optional[float] = None,
           overviews: Union[str, Sequence[int]] = "auto",
           threshold: Union[float, Sequence[float], None] = None) -> Optional[bytes]:
    """Encodes a volume as a .tag file. If `out` is None, returns its bytes.

    array_or_path: samples (z, y, x) of uint8, int8, uint16, int16, uint32, int32, float32 or float64, with
        any strides and byte order. Or any object with shape, dtype and slices, which is loaded slab by slab
        (h5py, zarr, dask). Or a lossless Volume, or the path of one; its position and metadata are kept. (A
        volume with a bound is an ArgumentError, because the errors of two encodings add up.) Or an xarray
        DataArray, whose coordinates along z, y and x give its position. Its attributes are kept, and a warning
        names those that are not. For DICOM, TIFF and other scans, use the program `tagrid encode`.
    out: a path, or an object with write(). The file appears at the path once it is complete and on disk, and
        replaces an existing one. write() may accept only some of the bytes and return their number, or all of
        them and return None.
    max_error: no sample is off by more than this, in units of the samples; 0: lossless. "noise:K": K times
        the standard deviation of the noise. None, with grid_only: no bound.
    relative_error: instead of max_error, the bound as a fraction of the range of the samples. psnr: the smallest
        file that reaches this many dB; with a positive number as max_error, both hold. ratio, bits: the best PSNR
        in a file that is so many times smaller than the samples, or has so many bits a voxel. They and "noise:K"
        read the samples before encoding; Volume.max_error is the resulting bound.
    spacing: the distances between samples along z, y and x, usually in mm.
    affine: 4 x 4: from voxels (x, y, z, 1) to world coordinates, as in Volume.affine.
    metadata: names and strings to keep, as in Volume.metadata; or lines of an NRRD header, as in
        Volume.header.
    effort: "fast", "default" or "best": trades time for size.
    threads: 0: all processors that the process may use.
    surface_error, mesh_error: bounds for the active points and for the mesh.
    grid: "stored", the default, or "derived", the default with psnr, ratio and bits: computed from the decoded
        samples on demand. grid_only: stores only the
        grid, and samples are interpolated.
    value_range: (low, high), the span of values that matters for the grid. The default is the range of the
        type, or of the samples for types of 32 and 64 bits. field_scale, max_level, accuracy, cube (the edge
        of a root cube), brick (root cubes along the edge of a brick): see docs/options.md. lead: 1, the
        default, for bricks that are chunks of their edge; 0 for a lattice that begins at the first sample.
    overviews: factors of the overviews that the file has, such as (4, 16); "none"; or "auto": 4, 16, 64 ...
        if the longest axis has more than 512 samples. Meanwhile, sums wait in a temporary file beside `out`, or in
        $TMPDIR or /tmp if that is no path. For labels, give "none": a mean is the number of another label.
    threshold: a number, or up to 8. No sample changes its side of these: decoded, it is at least a threshold if the
        original is, and otherwise below it. volume >= threshold is then the mask of the original, whatever max_error or
        psnr allows. Volume.info["thresholds"] says how many samples are on the upper side, and how many the loss had moved.
    memory_limit: bytes for the work; 0: no limit.
    progress(done, total): called from time to time with bytes of samples; an exception cancels the encoding.

    TypeError: samples of another type. ArgumentError: invalid or contradictory settings. InputError, OSError:
    reading or writing failed. No incomplete file remains.
    """
    volume, opened = _opened(array_or_path)
    try:
        if isinstance(volume, Volume) and volume.max_error != 0:
            raise ArgumentError(f"{volume!r} has a bound already, and the errors of two encodings add up; encode the original "
                                "volume, or volume.read(), the samples as they are")
        if isinstance(volume, Volume) and metadata is None:
            metadata = volume.header if spacing is None and affine is None else volume.metadata
        follows = error_rule(max_error, relative_error=relative_error, psnr=psnr, ratio=ratio, bits=bits)
        check_missing(volume, None if follows or isinstance(max_error, str) else max_error)
        label = label_of(volume, spacing is None and affine is None, metadata)
        if label.spacing is not None or label.affine is not None:
            spacing, affine = label.spacing, label.affine
        metadata = label.metadata
        if (isinstance(volume, Volume) and volume.dtype.itemsize > 2 and value_range is None and field_scale is None
                and volume.info["low"] < volume.info["high"]):
            value_range = volume.info["low"], volume.info["high"]
        memory = io.BytesIO() if out is None else None
        with Writer(out if memory is None else memory, shape=volume.shape, dtype=volume.dtype, max_error=max_error,
                    spacing=spacing,
                    affine=affine, metadata=metadata, effort=effort, threads=threads, surface_error=surface_error,
                    mesh_error=mesh_error, grid=grid, grid_only=grid_only, value_range=value_range,
                    field_scale=field_scale, max_level=max_level, cube=cube, brick=brick, lead=lead,
                    accuracy=accuracy, memory_limit=memory_limit, progress=progress, relative_error=relative_error,
                    psnr=psnr, ratio=ratio, bits=bits, samples=AnySamples(volume).read, overviews=overviews,
                    threshold=threshold) as writer:
            for slab in slabs_of(volume):
                writer.write(slab)
    finally:
        if opened:
            volume.close()
    return None if memory is None else memory.getvalue()


def verify(source: Any, *, threads: int = 0, memory_limit: int = 0, progress: Progress = None) -> None:
    """Decodes an entire .tag file and checks everything possible without the original: checksums, that every
    brick decodes, that the grid has no crack, and the statistics. `source`: anything that tagrid.open()
    accepts, or a Volume.

    DamagedError names the first error.
    """
    if isinstance(source, Volume):
        source.verify(threads=threads, memory_limit=memory_limit, progress=progress)
        return
    with Volume(source) as volume:
        volume.verify(threads=threads, memory_limit=memory_limit, progress=progress)


def _spool_of(out: Any) -> str:
    """The directory for temporary files: that of the output, which needs space for the result anyway."""
    return os.path.dirname(os.path.realpath(os.fsdecode(out))) if _is_path(out) else os.environ.get("TMPDIR") or "/tmp"


def _is_path(out: Any) -> bool:
    return isinstance(out, (str, bytes, os.PathLike))


def _write_of(out: Any) -> Callable[[bytes], object]:
    if not callable(getattr(out, "write", None)):
        advice = f"; a bound is given by name: max_error={out!r}" if isinstance(out, (int, float)) else ""
        raise TypeError(f"out must be a path, or have write(), not {type(out).__name__!r}{advice}")
    write: Callable[[bytes], Any] = out.write

    def write_all(data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            taken = write(bytes(rest) if len(rest) < len(data) else data)
            if taken is None and not isinstance(out, io.RawIOBase):
                # If write() returns None, it took all bytes. Only for Python's raw files, None means that it
                # took none.
                return
            if taken is None:
                raise BlockingIOError(errno.EAGAIN,
                                      "the file takes no bytes at the moment; give one that waits until it does")
            if not isinstance(taken, (int, np.integer)) or not 0 < taken <= len(rest):
                raise InputError(f"write() of {type(out).__name__!r} was given {len(rest)} bytes, and returned {taken!r}")
            rest = rest[int(taken):]

    return write_all


def _require_one(volume: Volume) -> None:
    """ArgumentError for a file of several volumes, of which only the first one would be encoded."""
    if volume.is_first_of_several:
        raise ArgumentError(f"{volume._name} holds {volume.volumes} volumes, and Python writes one: give "
                            f"tagrid.open(path).volume(number), from 0 to {volume.volumes - 1}")


def _opened(array_or_path: Any) -> tuple[Any, bool]:
    """The samples, and whether to close them."""
    if not _is_path(array_or_path):
        if isinstance(array_or_path, Volume):
            _require_one(array_or_path)
        return as_volume(array_or_path), False
    try:
        volume = Volume(array_or_path)
        _require_one(volume)
        return volume, True
    except DamagedError as error:
        if isinstance(array_or_path, bytes):
            raise
        raise ArgumentError(
            f"{error}\nOnly .tag files are read here. The program reads scans: tagrid encode "
            f"{os.fsdecode(array_or_path)} -o OUTPUT.tag") from error
