"""Meshes and surfaces: what Volume.mesh() and Volume.surface() return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterator, NamedTuple

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A conforming mesh of tetrahedra: every point occurs once, and neighbors share entire faces.

    points, cells, values, levels = mesh
    """

    #: (n, 3) float64: x, y, z of each point in the world.
    points: npt.NDArray[np.float64]
    #: (m, 4) int64: the numbers of the points of each tetrahedron, in positive order.
    cells: npt.NDArray[np.int64]
    #: (n,): the value of each point: a sample in the volume's type, or slope * sample + intercept in float64.
    values: npt.NDArray[Any]
    #: (m,) uint8: the level of each tetrahedron in the grid; 0 is the coarsest.
    levels: npt.NDArray[np.uint8]

    @property
    def types(self) -> npt.NDArray[np.uint8]:
        """(m,) uint8: the type of each cell as VTK numbers them: 10, a tetrahedron."""
        return np.full(len(self.cells), 10, np.uint8)

    def __iter__(self) -> Iterator[npt.NDArray[Any]]:
        return iter((self.points, self.cells, self.values, self.levels))

    def __repr__(self) -> str:
        return f"<tagrid.Mesh of {len(self.points)} points and {len(self.cells)} tetrahedra>"


class Surface(NamedTuple):
    """An oriented surface of triangles: every point occurs once."""

    #: (n, 3) float64: x, y, z of each point in the world.
    points: npt.NDArray[np.float64]
    #: (m, 3) int64: the numbers of the points of each triangle, counterclockwise seen from outside.
    triangles: npt.NDArray[np.int64]

    def __repr__(self) -> str:
        return f"<tagrid.Surface of {len(self.points)} points and {len(self.triangles)} triangles>"
