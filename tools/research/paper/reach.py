"""The region of reference: all points whose marks can affect the grid inside one root cube.

It is computed from the paper's definition: the point that bisects a tetrahedron is needed when one that bisects either half of it
is needed. So decisions inside the cube depend on the descendants of all tetrahedra around its points.
"""

import dataclasses

import numpy

from hierarchy import bisected, midpoints, root_tetrahedra


@dataclasses.dataclass
class Region:
    size: int  # edge of a root cube, S
    levels: numpy.ndarray  # [z, y, x] over three root cubes an axis: the level at which a point is reached, or -1
    diamonds: list  # of each level: the tetrahedra around the points reached at it, [m, 4, 3]

    @property
    def points(self):
        """All points that the closed cube depends on, its own among them."""
        return int((self.levels >= 0).sum())

    @property
    def volume(self):
        """In cubes, as the paper counts it."""
        return self.points / self.size**3

    @property
    def distance(self):
        """How far the region reaches beyond the cube along an axis, in samples."""
        reached = numpy.argwhere(self.levels >= 0)
        return int(max((self.size - reached).max(), (reached - 2 * self.size).max()))


def region_of_reference(size):
    """The region of the middle one of 3 x 3 x 3 root cubes."""
    inside = numpy.zeros((3 * size + 1,) * 3, dtype=bool)
    inside[size : 2 * size + 1, size : 2 * size + 1, size : 2 * size + 1] = True
    region = Region(size, numpy.where(inside, 0, -1).astype(numpy.int8), [])
    corners = [(x, y, z) for x in (0, size, 2 * size) for y in (0, size, 2 * size) for z in (0, size, 2 * size)]
    tetrahedra = numpy.concatenate([root_tetrahedra(size, corner=corner) for corner in corners])
    inherited = numpy.zeros(len(tetrahedra), dtype=bool)
    last = 3 * int(size).bit_length() - 3
    for level in range(1, last + 1):
        x, y, z = midpoints(tetrahedra).T
        needed = inside[z, y, x]
        reached = numpy.zeros_like(inside)
        reached[z[inherited], y[inherited], x[inherited]] = True
        needed |= reached[z, y, x]
        levels = region.levels[z, y, x]
        region.levels[z[needed], y[needed], x[needed]] = numpy.where(levels[needed] < 0, level, levels[needed])
        region.diamonds.append(tetrahedra[needed])
        if level < last:
            tetrahedra, inherited = bisected(tetrahedra), numpy.repeat(needed, 2)
    return region
