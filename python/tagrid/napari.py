"""napari opens and writes .tag files, by the manifest napari.yaml beside this file. Nothing of napari is imported."""

from __future__ import annotations

import math
from typing import Any, Callable, Mapping, Optional

import numpy as np
import numpy.typing as npt

from ._arrays import checked_shape
from ._coordinates import is_along_world, ome_units, scale_and_translation
from ._errors import ArgumentError
from ._geometry import FIELDS, PLACES
from ._volume import Volume
from ._writing import encode

LayerData = tuple[Any, dict[str, Any], str]

#: What files call the units of napari.
_UNITS = {"meter": "m", "centimeter": "cm", "millimeter": "mm", "micrometer": "um", "nanometer": "nm",
          "angstrom": "angstrom", "inch": "inch"}


def get_reader(path: Any) -> Optional[Callable[[Any], list[LayerData]]]:
    """The function with which napari reads a path, or None if it is not that of a .tag file."""
    return read if isinstance(path, str) and path.lower().endswith(".tag") else None


def read(path: str) -> list[LayerData]:
    """An image layer of all volumes of a file: an array, or a list of them, from fine to coarse, if the file has
    overviews. Axes are z, y, x; in a file of several volumes, these are stacked along an axis before them. Arrays
    have values, slope * sample + intercept. They are arrays of dask that decode what is shown, or, without dask, of
    numpy with all samples. The layer's metadata are those of the file, and "max_error", the bound of the values. The
    contrast limits are the smallest and the largest value, which the file states.

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
               **_contrast(volumes), "metadata": {**scan.metadata, "max_error": scan.rescaled.max_error}}
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


def _contrast(volumes: list[Volume]) -> dict[str, Any]:
    """From the smallest to the largest value, unless the file does not have them."""
    ends = [volume.rescaled.value_of(volume.info[name]) for volume in volumes for name in ("low", "high")]
    known = [end for end in ends if end is not None and math.isfinite(end)]
    return {"contrast_limits": [min(known), max(known)]} if len(known) == len(ends) and min(known) < max(known) else {}


def write(path: str, data: Any, attributes: Mapping[str, Any]) -> list[str]:
    """Writes an image layer of one volume, or of one slice, losslessly. Returns the path, as napari wants it.

    data: an array, or one of each level, of which the finest is written. attributes: those of the layer. Its position
    and units are kept, and of its metadata the strings, without those that say how samples become values: the file
    has values.

    ArgumentError: the layer is in color, or has more than three axes. TypeError: volumes have no samples of its type.
    """
    if attributes.get("rgb"):
        raise ArgumentError("a volume has one number for each voxel; split the colors into layers first")
    array = data[0] if attributes.get("multiscale") else data
    matrix = _matrix(attributes, array.ndim)
    if array.ndim == 2:
        array, matrix = array[np.newaxis], np.block([[np.ones((1, 1)), np.zeros((1, 3))], [np.zeros((3, 1)), matrix]])
    checked_shape(array.shape)
    units = [_UNITS.get(str(unit)) for unit in attributes.get("units") or ()][-array.ndim:]
    metadata = {name: text for name, text in attributes.get("metadata", {}).items() if _is_kept(name, text)}
    if len(units) == 3 and None not in units:
        metadata["space units"] = " ".join(f'"{unit}"' for unit in units[::-1])
    # From z, y, x to x, y, z, in rows and columns.
    order = [2, 1, 0, 3]
    is_placed = "space units" in metadata or not np.array_equal(matrix, np.eye(4))
    encode(array, path, affine=matrix[np.ix_(order, order)] if is_placed else None, metadata=metadata)
    return [path]


def _is_kept(name: Any, text: Any) -> bool:
    """Of the layer's metadata, not what says where samples are, how they become values, or how far they are off."""
    own = ("space", "space units", "content", "sample units")
    return (isinstance(name, str) and isinstance(text, str) and (name in own or name not in (*PLACES, *FIELDS))
            and not name.startswith(("rescale_", "slice_")) and name != "max_error")


def _matrix(attributes: Mapping[str, Any], axes: int) -> npt.NDArray[np.float64]:
    """From the number of a sample to its place, as napari composes it: scale, shear, rotation, translation, matrix."""
    shear = np.asarray(attributes.get("shear", np.eye(axes)), float)
    if shear.ndim == 1:
        above, shear = shear, np.eye(axes)
        shear[np.triu_indices(axes, 1)] = above
    matrix = np.eye(axes + 1)
    matrix[:axes, :axes] = (np.asarray(attributes.get("rotate", np.eye(axes)), float) @ shear
                            @ np.diag(attributes.get("scale", np.ones(axes))))
    matrix[:axes, axes] = attributes.get("translate", np.zeros(axes))
    after = attributes.get("affine")
    return matrix if after is None else np.asarray(getattr(after, "affine_matrix", after), float) @ matrix
