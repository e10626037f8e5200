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


@dataclass(frozen=True, eq=False, repr=False)
class MaterialMesh:
    """A conforming mesh of tetrahedra for solvers, each of one material, with named surfaces where materials end."""

    #: (n, 3) float64: x, y, z of each point in the world.
    points: npt.NDArray[np.float64]
    #: (m, 4) or (m, 10) int64: the numbers of the points of each tetrahedron, material by material. The first 4 are
    #: corners in positive order; the others are the middles of the edges 01, 12, 02, 03, 13, 23.
    cells: npt.NDArray[np.int64]
    #: (m,) int64: for each tetrahedron the label of its samples, or the place of its material by value, from 1 on.
    materials: npt.NDArray[np.int64]
    #: The tetrahedra of each material, by its name: cells[groups["bone"]].
    groups: dict[str, slice]
    #: The triangles of each surface, such as "bone_soft" or "bone_x_min": (k, 3) or (k, 6) int64 numbers of points,
    #: counterclockwise seen from outside of the first material, then the middles of the edges 01, 12, 02.
    surfaces: dict[str, npt.NDArray[np.int64]]

    def meshio(self) -> Any:
        """The mesh as a meshio.Mesh with cell sets for materials and surfaces, and with physical groups, which
        meshio writes to Gmsh's files. Requires meshio."""
        import meshio  # type: ignore[import]

        second = self.cells.shape[1] == 10
        blocks: list[Any] = [("tetra10" if second else "tetra", self.cells)]
        material = [self.materials]
        # Numbers of groups are from 1 on.
        physical = [self.materials + (0 if np.all(self.materials > 0) else 1)]
        groups = {name: np.array([physical[0][cells.start], 3]) for name, cells in self.groups.items()
                  if cells.start < cells.stop}
        sets: dict[str, list[Any]] = {name: [np.arange(cells.start, cells.stop)] for name, cells in self.groups.items()}
        nothing = np.empty(0, np.int64)
        for number, (name, triangles) in enumerate(self.surfaces.items(), start=1):
            blocks.append(("triangle6" if second else "triangle", triangles))
            material.append(np.zeros(len(triangles), np.int64))
            physical.append(np.full(len(triangles), number, np.int64))
            groups[name] = np.array([number, 2])
            sets[name] = [nothing] * number + [np.arange(len(triangles))]
        for parts in sets.values():
            parts.extend([nothing] * (len(blocks) - len(parts)))
        data = {"material": material, "gmsh:physical": physical, "gmsh:geometrical": physical}
        return meshio.Mesh(self.points, blocks, cell_data=data, cell_sets=sets, field_data=groups)

    def __repr__(self) -> str:
        return (f"<tagrid.MaterialMesh of {len(self.points)} points and {len(self.cells)} tetrahedra of "
                f"{', '.join(self.groups) or 'no material'}>")


class Surface(NamedTuple):
    """An oriented surface of triangles: every point occurs once."""

    #: (n, 3) float64: x, y, z of each point in the world.
    points: npt.NDArray[np.float64]
    #: (m, 3) int64: the numbers of the points of each triangle, counterclockwise seen from outside.
    triangles: npt.NDArray[np.int64]

    def __repr__(self) -> str:
        return f"<tagrid.Surface of {len(self.points)} points and {len(self.triangles)} triangles>"
