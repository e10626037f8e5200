"""napari opens .tag files, by the manifest napari.yaml beside this file. Nothing of napari is imported."""

from __future__ import annotations

from typing import Any, Callable, Optional

import numpy as np

from ._coordinates import is_along_world, ome_units, scale_and_translation
from ._volume import Volume

LayerData = tuple[Any, dict[str, Any], str]


def get_reader(path: Any) -> Optional[Callable[[Any], list[LayerData]]]:
    """The function with which napari reads a path, or None if it is not that of a .tag file."""
    return read if isinstance(path, str) and path.lower().endswith(".tag") else None


def read(path: str) -> list[LayerData]:
    """An image layer of all volumes of a file: an array, or a list of them, from fine to coarse, if the file has
    overviews. Axes are z, y, x; in a file of several volumes, these are stacked along an axis before them. Arrays
    have values, slope * sample + intercept. They are arrays of dask that decode what is shown, or, without dask, of
    numpy with all samples. The layer's metadata are those of the file, and "max_error", the bound of the values.

    The place is in the world of the file, in the order z, y, x, as scale and translate, or as a matrix if the axes
    of the scan are not world axes. Units are given to napari, from 0.5 on, if the file has them.

    Warns if slices are unevenly spaced. Exceptions are those of tagrid.open().
    """
    scan = Volume(path)
    scan._warn_of_uneven_slices("picture")
    volumes = [scan] if scan.volumes == 1 else [scan.volume(number) for number in range(scan.volumes)]
    levels = [_stacked([volume.overview(factor) if factor > 1 else volume for volume in volumes])
              for factor in (1, *scan.overviews)]
    options = {"name": path.replace("\\", "/").rpartition("/")[2][:-len(".tag")], **_place(scan, len(volumes) > 1),
               "metadata": {**scan.metadata, "max_error": scan.rescaled.max_error}}
    if len(levels) == 1:
        return [(levels[0], options, "image")]
    return [(levels, {**options, "multiscale": True}, "image")]


def _stacked(volumes: list[Volume]) -> Any:
    try:
        import dask.array as da
    except ImportError:
        arrays: list[Any] = [np.asarray(volume.rescaled) for volume in volumes]
        return arrays[0] if len(arrays) == 1 else np.stack(arrays)
    arrays = [da.from_array(volume.rescaled, chunks=volume.aligned_chunks(1)) for volume in volumes]
    return arrays[0] if len(arrays) == 1 else da.stack(arrays)


def _place(scan: Volume, has_several: bool) -> dict[str, Any]:
    """Where the samples are; volumes of a stack are 1 apart."""
    before = [1.0] if has_several else []
    units = [unit.get("unit") for unit in ome_units(scan)]
    place: dict[str, Any] = {} if None in units else {"units": [*(["pixel"] if has_several else []), *units]}
    if is_along_world(scan):
        scale, translation = scale_and_translation(scan)
        return {**place, "scale": [*before, *scale], "translate": [0.0] * len(before) + translation}
    # From x, y, z to z, y, x, in rows and columns.
    affine = np.eye(4 + len(before))
    order = [2, 1, 0, 3]
    affine[len(before):, len(before):] = scan.affine[np.ix_(order, order)]
    return {**place, "affine": affine}
