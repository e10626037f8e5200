"""Volumes in .tag files, with their meshes and surfaces."""

from __future__ import annotations

from typing import Any, Optional, Union, overload

import numpy as np
import numpy.typing as npt

from . import _reading
from ._arguments import number, whole_number
from ._errors import ArgumentError, warn_caller
from ._geometry import rescale_of
from ._materials import Labels, Materials, Size, made, requested
from ._meshes import MaterialMesh, Mesh, Surface
from ._reading import Progress, Rescaled
from ._regions import Region, runs_of

__all__ = ["Progress", "Rescaled", "Volume"]


class Volume(_reading.Volume):
    """An open .tag file, which tagrid.open() returns. It acts like an array of samples. A slice reads and
    decodes only the bricks that it intersects.

    Axes are z, y, x, as in numpy: v[z, y, x]. World coordinates are x, y, z. Samples are stored samples, each
    within max_error of the original. If metadata has "rescale_slope", value = slope * sample + intercept, and
    v.rescaled[z, y, x] is that value. Any number of threads may use one volume.

    A volume can be pickled if its source can: a path, bytes, an fsspec file, or an object with read_at(). It is
    then opened again; if the file was replaced in the meantime, that is an InputError.
    """

    def verify(self, *, threads: Optional[int] = None, memory_limit: int = 0, progress: Progress = None) -> None:
        """Decodes the entire file and checks everything possible without the original. DamagedError names the
        first error."""
        self._reader.verify(*self._work(threads, memory_limit), progress)

    # ---- the grid

    def active_points(self, *, threads: Optional[int] = None, memory_limit: int = 0,
                      progress: Progress = None) -> npt.NDArray[np.uint64]:
        """The number of grid vertices on each level, 0 up to `levels`. If the file does not store its grid,
        the entire file is decoded."""
        return self._reader.levels(*self._work(threads, memory_limit), progress)

    @overload
    def mesh(self, level: Optional[int] = None, region: Optional[Region] = None, *, padded: bool = False,
             rescaled: bool = False, threads: Optional[int] = None, memory_limit: int = 0,
             progress: Progress = None) -> Mesh: ...

    @overload
    def mesh(self, level: None = None, region: Optional[Region] = None, *, materials: Materials,
             size: Size = None, smooth: Optional[float] = None, parts: Union[None, str, float] = None, angles: int = 9,
             order: int = 1, threads: Optional[int] = None, memory_limit: int = 0,
             progress: Progress = None) -> MaterialMesh: ...

    @overload
    def mesh(self, level: None = None, region: Optional[Region] = None, *, labels: Labels,
             size: Size = None, smooth: Optional[float] = None, parts: Union[None, str, float] = None, angles: int = 9,
             order: int = 1, threads: Optional[int] = None, memory_limit: int = 0,
             progress: Progress = None) -> MaterialMesh: ...

    def mesh(self, level: Optional[int] = None, region: Optional[Region] = None, *, padded: bool = False,
             rescaled: bool = False, materials: Optional[Materials] = None, labels: Optional[Labels] = None,
             size: Size = None, smooth: Optional[float] = None, parts: Union[None, str, float] = None, angles: int = 9,
             order: int = 1, threads: Optional[int] = None, memory_limit: int = 0,
             progress: Progress = None) -> Union[Mesh, MaterialMesh]:
        """Returns the tetrahedra of the grid, or those of materials for solvers, in world coordinates.
        metadata["space"] names the coordinate system.

        level: the grid up to this level, for a coarser mesh. region: only tetrahedra that intersect it, as in
        read(); reads only the bricks around it. padded: entire root cubes, instead of ending at the first and
        last samples. rescaled: values are slope * sample + intercept, in float64, if the file has them;
        otherwise samples. If each slice has its own slope, this raises ArgumentError.

        materials: a name and a range of values for each, such as {"soft": (-200, 300), "bone": (300, None)}: the mesh
        has only these, and their interfaces are where interpolated values reach the limits. Values are slope * sample
        + intercept. labels: instead, the samples are labels with these names, such as {1: "bone"}; True: all labels
        but 0. size: the edge of the cubes at interfaces, or (fine, coarse), in units of the spacing. smooth: the
        radius in samples within which interfaces of labels are smoothed; 0: not at all. parts: "largest", or the
        least volume of the connected parts that stay. angles: 9 or 15, the least dihedral angle within the volume.
        order: 2 for tetrahedra of ten nodes.

        Warns if slices are unevenly spaced: the mesh is evenly spaced. slice_positions has their positions.
        """
        self._warn_of_uneven_slices("mesh")
        if materials is not None or (labels is not None and labels is not False):
            if level is not None or padded or rescaled:
                raise ArgumentError("level, padded and rescaled are about the grid; materials are ranges of values, "
                                    "such as HU")
            options, named = requested(materials, labels, size, smooth, parts, angles, order)
            return made(*self._reader.material_mesh(
                options, named, self._box_of(region), *self._work(threads, memory_limit), progress), order)
        if (size, smooth, parts, angles, order) != (None, None, None, 9, 1):
            raise ArgumentError("size, smooth, parts, angles and order are about materials: give materials or labels")
        rescale = rescale_of(self.metadata) if rescaled else None
        points, values, cells, levels = self._reader.mesh(
            self._checked_level(level), padded, self._box_of(region), *self._work(threads, memory_limit), progress)
        if rescale is not None:
            slope, intercept = rescale
            values = slope * values.astype(np.float64) + intercept
        return Mesh(points, cells, values, levels)

    def surface(self, iso: float, level: Optional[int] = None, region: Optional[Region] = None, close: bool = False, *,
                rescaled: bool = False, threads: Optional[int] = None, memory_limit: int = 0,
                progress: Progress = None) -> Surface:
        """Returns the isosurface as points and triangles. Samples of at least `iso` are inside.

        iso: in units of the samples; with rescaled, in units of slope * sample + intercept, as in `tagrid
        surface`. level, region: as in mesh(). close: closes the surface at the border of the volume, as if
        samples outside were below `iso`. Within the volume, every edge has exactly two triangles. Warns like
        mesh().
        """
        self._warn_of_uneven_slices("surface")
        points, triangles = self._reader.surface(
            number("iso", iso), rescaled, self._checked_level(level), close, self._box_of(region),
            *self._work(threads, memory_limit), progress)
        return Surface(points, triangles)

    def _warn_of_uneven_slices(self, what: str) -> None:
        if "slice_positions" in self.metadata:
            warn_caller(f"{self._name}: slices of the source are unequally spaced; in the {what} all distances are equal")

    # ---- arguments

    def _checked_level(self, level: Optional[int]) -> int:
        if level is None:
            return -1
        level = whole_number("level", level)
        if not 0 <= level <= self.levels:
            raise ArgumentError(f"the grid has the levels 0 to {self.levels}, not {level}")
        return level

    def _box_of(self, region: Optional[Region]) -> Any:
        if region is None:
            return None
        z, y, x = runs_of(region, 1, self.shape)
        return (x.start, y.start, z.start), (x.stop, y.stop, z.stop)
