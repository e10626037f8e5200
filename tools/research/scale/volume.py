"""The geometry of a volume that is encoded in parts: the samples that a part reads, computes and owns."""

import math
from dataclasses import dataclass
from functools import lru_cache

SAMPLE_BYTES = {"uint8": 1, "int8": 1, "uint16": 2, "int16": 2, "uint32": 4, "int32": 4, "float32": 4, "float64": 8}

# As in pipeline/parts/part_work.cpp: samples that a part aims at, and into how many parts a small volume is cut.
MOST_SAMPLES, FEWEST_PARTS = 2 ** 29, 16
INDEX_ENTRY = 32  # bytes of a brick in the index
MARK_HALO = 1  # samples around the root cubes that marks depend on (curvature)


@dataclass(frozen=True)
class Part:
    """Rows of bricks: y_low .. y_end - 1 of layer z_low, or all rows of the layers z_low .. z_end - 1."""
    y_low: int
    y_end: int
    z_low: int
    z_end: int


@dataclass(frozen=True)
class Volume:
    dims: tuple  # x, y, z
    sample_bytes: int
    cube: int = 32
    brick: int = 2  # root cubes an edge

    @property
    def samples(self):
        return math.prod(self.dims)

    @property
    def bytes(self):
        return self.samples * self.sample_bytes

    @property
    def brick_edge(self):
        return self.cube * self.brick

    def first(self, axis):
        """The coordinate of the first sample in the lattice, which begins one step before it."""
        return 1 if self.dims[axis] > 1 else 0

    def cubes(self, axis):
        return max(1, math.ceil((self.first(axis) + self.dims[axis] - 1) / self.cube))

    def bricks(self, axis):
        return math.ceil(self.cubes(axis) / self.brick)

    @property
    def brick_count(self):
        return math.prod(self.bricks(axis) for axis in range(3))

    @property
    def index_bytes(self):
        return INDEX_ENTRY * self.brick_count

    def whole(self):
        return Part(0, self.bricks(1), 0, self.bricks(2))

    def parts(self):
        """The parts, in the order of their bricks: whole layers, or rows of one layer."""
        wanted = max(1, min(self.samples // FEWEST_PARTS, MOST_SAMPLES))
        row = self.dims[0] * min(self.brick_edge, self.dims[1]) * min(self.brick_edge, self.dims[2])
        rows = max(1, wanted // row)
        ny, nz = self.bricks(1), self.bricks(2)
        if rows >= ny:
            layers = rows // ny
            return [Part(0, ny, z, min(z + layers, nz)) for z in range(0, nz, layers)]
        return [Part(y, min(y + rows, ny), z, z + 1) for z in range(nz) for y in range(0, ny, rows)]

    def strips(self, part, rows):
        """`part` in strips of at most `rows` rows of bricks."""
        if rows >= self.bricks(1):
            return [part]
        return [Part(y, min(y + rows, part.y_end), z, z + 1) for z in range(part.z_low, part.z_end)
                for y in range(part.y_low, part.y_end, rows)]

    def extent(self, axis, low, end, halo):
        """Samples along an axis of the bricks low .. end - 1, with `halo` on both sides."""
        first = low * self.brick_edge - halo
        last = min(end * self.brick_edge, self.cubes(axis) * self.cube) + halo
        sample = self.first(axis)
        return min(last, sample + self.dims[axis] - 1) - max(first, sample) + 1

    def samples_around(self, part, halo):
        return (self.dims[0] * self.extent(1, part.y_low, part.y_end, halo)
                * self.extent(2, part.z_low, part.z_end, halo))

    def owned(self, part):
        """Samples of the bricks themselves; a shared face belongs to the lower brick."""
        along = 1
        for axis, low, end in ((1, part.y_low, part.y_end), (2, part.z_low, part.z_end)):
            along *= self.extent(axis, low, end, 0) - (low > 0)
        return self.dims[0] * along

    @lru_cache(maxsize=None)
    def work(self, part, rows):
        """(samples read, samples whose marks are computed, samples encoded) of a part in strips of `rows` rows."""
        strips = self.strips(part, rows)
        return (sum(self.samples_around(s, self.cube + MARK_HALO) for s in strips),
                sum(self.samples_around(s, self.cube) for s in strips), self.owned(part))

    def window_bytes(self, rows):
        """Memory of the slices and marks that strips of `rows` rows need at once."""
        high = min(rows * self.brick_edge + 2 * (self.cube + MARK_HALO), self.dims[1])
        slices = min(self.brick_edge + 2 * (self.cube + MARK_HALO), self.dims[2])
        marks = self.dims[0] * high * (self.brick_edge + 2 * self.cube) // 8
        return self.dims[0] * high * slices * self.sample_bytes + marks
