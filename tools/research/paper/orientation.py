"""Figs. 21 and 22: four directions of the first diagonal lead to the same grid. Claim 3."""

import numpy

import drawing
from hierarchy import PATTERNS, refined, root_tetrahedra, same_tetrahedra
from primitives import SIZE, uniform_grid
from report import FAILS, HOLDS
from scene import Scene


def add_to(report, study):
    report.section("The first diagonal does not matter (Figs. 21, 22)")
    report.figure("fig-21", "Fig. 21: four patterns of root tetrahedra, and the grid after three bisections",
                  picture_of_patterns(study),
                  "Above: the tetrahedra of each pattern share another diagonal. Below: after three bisections.")
    report.figure("fig-22", "Fig. 22: the patterns of the eight cells after a cycle", picture_of_cells(study),
                  "Each cell of half the edge is cut around a diagonal of its own. All eight diagonals meet in the middle of "
                  "the cube.")
    claim_orientation(report, study)


def picture_of_patterns(study):
    above, below = [], []
    for pattern in PATTERNS:
        for level, row in ((0, above), (3, below)):
            scene = Scene(study.pixels(250), study.pixels(250))
            scene.add_tetrahedra(refined(root_tetrahedra(4, pattern), level), drawing.BLUE, shrink=0.99,
                                 opacity=0.35 if level == 0 else 1)
            if level == 0:
                start = numpy.array(PATTERNS[pattern]) * 4
                scene.add_lines([(start, 4 - start)], drawing.RED, 0.05)
            row.append(scene.picture())
    return drawing.beside(above + below,
                        [f"({pattern})" for pattern in PATTERNS] + [f"({pattern}), level 3" for pattern in PATTERNS], 4)


def diagonals_of_cells(pattern):
    """The diagonal that the six tetrahedra of each cell share after a cycle: {corner of the cell: (end, other end)}."""
    cells = {}
    for tetrahedron in refined(root_tetrahedra(4, pattern), 3):
        cell = tuple((tetrahedron.min(axis=0) // 2).tolist())
        ends = next((a, b) for a in tetrahedron for b in tetrahedron if (b - a == 2).all() or (numpy.abs(b - a) == 2).all())
        cells.setdefault(cell, set()).add(frozenset(tuple(end.tolist()) for end in ends))
    assert all(len(found) == 1 for found in cells.values())
    return {cell: tuple(found.pop()) for cell, found in cells.items()}


def picture_of_cells(study):
    scene = Scene(study.pixels(560), study.pixels(460))
    by_direction = {}
    for cell, (one, other) in diagonals_of_cells("A").items():
        direction = tuple((numpy.sign(numpy.array(other) - one) * numpy.sign(other[0] - one[0])).tolist())
        number = by_direction.setdefault(direction, len(by_direction))
        scene.add_box([2 * c for c in cell], [2 * c + 2 for c in cell], drawing.FAINT, 0.015)
        scene.add_lines([(one, other)], drawing.DIRECTIONS[number], 0.06)
    return drawing.beside([scene.picture()], ["one color for each direction of a diagonal"])


def claim_orientation(report, study):
    same = [all(same_tetrahedra(refined(root_tetrahedra(SIZE), level), refined(root_tetrahedra(SIZE, pattern), level))
                for pattern in PATTERNS) for level in range(7)]
    first = next(level for level in range(len(same)) if all(same[level:]))
    # The program's own grid of the first cube, against the four patterns.
    corners = study.tagrid.mesh(uniform_grid(study), level=3).corners().astype(numpy.int64)
    corners = corners[(corners <= SIZE).all(axis=(1, 2))]
    equal = sum(same_tetrahedra(corners, refined(root_tetrahedra(SIZE, pattern), 3)) for pattern in PATTERNS)
    directions = [numpy.sign(numpy.array(a) - b) * numpy.sign(a[0] - b[0]) for a, b in diagonals_of_cells("A").values()]
    kinds, counts = numpy.unique(directions, axis=0, return_counts=True)
    report.claim(3, "the direction of the first diagonal does not matter after one cycle",
                 HOLDS if all(same[3:]) and equal == len(PATTERNS) and (counts == 2).all() else FAILS,
                 "A cube that is refined everywhere has the same tetrahedra for all {patterns} patterns from level {first} "
                 "on (compared up to level {last}). The program's grid at level 3 is that of {equal} patterns. Of the eight "
                 "cells after a cycle, {kinds} patterns have {counts} each.",
                 patterns=len(PATTERNS), first=first, last=len(same) - 1, equal=equal, kinds=len(kinds),
                 counts=" or ".join(sorted({str(count) for count in counts.tolist()})))
