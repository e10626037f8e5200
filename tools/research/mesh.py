"""A tetrahedral mesh as arrays, and what can be counted on it. Nothing here trusts the program that wrote it."""

import dataclasses
import re

import numpy

EDGES = numpy.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
FACES = numpy.array([(1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)])
TYPES = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "Int32": "<i4", "Int16": "<i2", "UInt16": "<u2", "Int8": "i1",
         "UInt8": "u1"}


@dataclasses.dataclass
class Mesh:
    points: numpy.ndarray  # [n, 3], in samples
    values: numpy.ndarray  # [n]
    tetrahedra: numpy.ndarray  # [m, 4], indices of points
    levels: numpy.ndarray  # [m], number of bisections
    types: numpy.ndarray  # [m], 0, 1 or 2: primitive I, II or III

    def corners(self):
        """Positions: [m, 4, 3]."""
        return self.points[self.tetrahedra]

    def part(self, chosen):
        """The chosen tetrahedra, with all points."""
        return dataclasses.replace(self, tetrahedra=self.tetrahedra[chosen], levels=self.levels[chosen], types=self.types[chosen])


def read_vtu(path):
    """Reads what `tagrid mesh` writes: appended raw data, each array after its number of bytes (64 bits)."""
    data = path.read_bytes()
    begin = data.index(b"_", data.index(b'<AppendedData encoding="raw">')) + 1
    head = data[:begin].decode("ascii")

    def array(name):
        declaration = next(text for text in re.findall(r"<DataArray [^>]*>", head) if f'Name="{name}"' in text)
        kind = numpy.dtype(TYPES[re.search(r'type="(\w+)"', declaration)[1]])
        offset = begin + int(re.search(r'offset="(\d+)"', declaration)[1])
        size = int.from_bytes(data[offset : offset + 8], "little")
        return numpy.frombuffer(data, kind, size // kind.itemsize, offset + 8)

    return Mesh(array("Points").reshape(-1, 3), array("value"), array("connectivity").reshape(-1, 4), array("level"), array("type"))


def volumes(corners):
    """Six times the volume of each tetrahedron, signed. Exact for integer and half coordinates."""
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
    return numpy.einsum("ij,ij->i", numpy.cross(a, b), c)


def squared_lengths(corners):
    """Squares of the six edges' lengths: [m, 6]."""
    return ((corners[:, EDGES[:, 0]] - corners[:, EDGES[:, 1]]) ** 2).sum(axis=2)


def unique_edges(tetrahedra, points):
    """Each edge once, and how many tetrahedra have it."""
    pairs = numpy.sort(tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    keys, counts = numpy.unique(pairs[:, 0] * points + pairs[:, 1], return_counts=True)
    return numpy.stack([keys // points, keys % points], axis=1), counts


def unique_faces(tetrahedra, points):
    """Each face once, and how many tetrahedra have it. There must be fewer than 2^21 points."""
    assert points < 1 << 21
    triples = numpy.sort(tetrahedra[:, FACES].reshape(-1, 3), axis=1).astype(numpy.int64)
    keys, counts = numpy.unique((triples[:, 0] << 42) | (triples[:, 1] << 21) | triples[:, 2], return_counts=True)
    mask = (1 << 21) - 1
    return numpy.stack([keys >> 42, (keys >> 21) & mask, keys & mask], axis=1), counts


@dataclasses.dataclass
class Conformity:
    inner_faces: int
    cracks: int  # faces inside the mesh's box that only one tetrahedron has
    crowded: int  # faces of three or more
    missing_volume: float  # of the box, less that of the tetrahedra

    @property
    def holds(self):
        return self.cracks == 0 and self.crowded == 0 and self.missing_volume == 0


def conformity(mesh):
    """Whether tetrahedra meet face to face and fill the box of all points. Exact for integer coordinates."""
    faces, counts = unique_faces(mesh.tetrahedra, len(mesh.points))
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    alone = mesh.points[faces[counts == 1]]
    on_border = ((alone == low).all(axis=1) | (alone == high).all(axis=1)).any(axis=1)
    box = numpy.prod(high - low) * 6
    missing = (box - numpy.abs(volumes(mesh.corners())).sum()) / 6
    return Conformity(int((counts == 2).sum()), int((~on_border).sum()), int((counts > 2).sum()), float(missing))


def edges_in_plane(mesh, z):
    """The edges of all triangles that lie in a plane of this z, each once: [n, 4] with x0, y0, x1, y1."""
    inside = mesh.points[:, 2] == z
    three = mesh.tetrahedra[inside[mesh.tetrahedra].sum(axis=1) == 3]
    triangles = three[inside[three]].reshape(-1, 3)
    pairs = numpy.unique(numpy.sort(triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1), axis=0)
    return mesh.points[pairs][:, :, :2].reshape(-1, 4)
