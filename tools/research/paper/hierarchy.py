"""The hierarchy as the paper defines it, by its geometry alone: six root tetrahedra a cube, bisected at their longest edges.

It shares nothing with the program, so that the two can be compared.
"""

import itertools

import numpy

from mesh import EDGES, squared_lengths

# Fig. 21: the corner, in units of the cube, from which the diagonal that all six root tetrahedra share leads to the opposite one.
PATTERNS = {"A": (0, 0, 0), "B": (1, 0, 0), "C": (0, 1, 0), "D": (0, 0, 1)}


def root_tetrahedra(size, pattern="A", corner=(0, 0, 0)):
    """The six root tetrahedra of a cube: [6, 4, 3]. Each is a path of three edges along the diagonal."""
    start = numpy.array(PATTERNS[pattern])
    found = []
    for axes in itertools.permutations(range(3)):
        path = [start]
        for axis in axes:
            step = path[-1].copy()
            step[axis] = 1 - step[axis]
            path.append(step)
        found.append(path)
    return numpy.array(found, dtype=numpy.int32) * size + numpy.array(corner, dtype=numpy.int32)


def base_edges(corners):
    """The longest edge of each tetrahedron, as two numbers of corners: [m, 2]."""
    lengths = squared_lengths(corners)
    longest = lengths.argmax(axis=1)
    assert ((lengths == lengths.max(axis=1, keepdims=True)).sum(axis=1) == 1).all(), "two edges are longest"
    return EDGES[longest]


def midpoints(corners):
    """The midpoints of the base edges: [m, 3]."""
    rows, base = numpy.arange(len(corners)), base_edges(corners)
    return (corners[rows, base[:, 0]] + corners[rows, base[:, 1]]) // 2


def bisected(corners):
    """Both halves of each tetrahedron: [2 m, 4, 3], the halves of one after each other. Edges must be even."""
    rows, base = numpy.arange(len(corners)), base_edges(corners)
    middle = midpoints(corners)
    halves = numpy.repeat(corners[:, None], 2, axis=1)
    halves[rows, 0, base[:, 0]] = middle
    halves[rows, 1, base[:, 1]] = middle
    return halves.reshape(-1, 4, 3)


def refined(corners, levels):
    for _ in range(levels):
        corners = bisected(corners)
    return corners


def sorted_tetrahedra(corners):
    """The same set of tetrahedra in an order that depends on the set only."""
    keys = corners @ numpy.array([1, 1 << 20, 1 << 40], dtype=numpy.int64)
    keys = numpy.sort(keys, axis=1)
    return keys[numpy.lexsort(keys.T[::-1])]


def same_tetrahedra(one, other):
    return len(one) == len(other) and bool((sorted_tetrahedra(one) == sorted_tetrahedra(other)).all())
