"""Claim 6: steps (C0) and creases (C1) are found and kept, wherever they lie relative to the root cubes."""

import dataclasses

import numpy

import drawing
from mesh import edges_in_plane
from report import FAILS, HOLDS
from study import write
from vtk_data import points_of, read_ply

SIZE = 16  # edge of a root cube
CUBES = 3  # along each axis
UNIT = 512  # of field values, a voxel of height: 8 voxels are 4096
NORMALS = {"across an axis": (1, 0, 0), "diagonal of a face": (1, 1, 0), "diagonal of the cube": (1, 1, 1),
           "oblique": (0.9, 0.38, 0.2)}
LAST = 3 * (SIZE.bit_length() - 1)  # the finest level
# No leaf across a step is coarser than the last cycle; none across a crease is larger than a cell of edge 2.
COARSEST = {"step": LAST - 2, "crease": LAST - 3}


@dataclasses.dataclass
class Plane:
    """A plane through the point (at, at, at)."""

    name: str
    at: float

    def distance(self, places):
        normal = numpy.array(NORMALS[self.name]) / numpy.linalg.norm(NORMALS[self.name])
        return places @ normal - self.at * normal.sum()


@dataclasses.dataclass
class Found:
    plane: Plane
    mesh: object
    crossed: int  # leaves with both sides of the plane
    coarsest: int  # level of the coarsest of them
    active: float  # percent of all points
    off: float  # how far the isosurface of a step is from the plane


def add_to(report, study):
    report.section("Discontinuities")
    positions = range(0, SIZE, 9) if study.quick else range(SIZE)
    found = {kind: [look(study, kind, Plane(name, SIZE + position + shift)) for name in NORMALS for position in positions]
             for kind, shift in (("step", 0.5), ("crease", 0.0))}
    report.figure("discontinuities", "Steps and creases in four directions", picture(study, found),
                  f"The grid in a plane between root cubes of edge {SIZE}. Above a step, below a crease of the same "
                  "direction (both at the red line). It is fine "
                  "there, and coarse elsewhere.")
    claim(report, found, len(positions))


def volume_with(study, kind, plane):
    n = CUBES * SIZE + 1
    z, y, x = numpy.meshgrid(*(numpy.arange(n),) * 3, indexing="ij")
    distance = plane.distance(numpy.stack([x, y, z], axis=-1).astype(float))
    height = numpy.where(distance > 0, 4.0, 0.0) if kind == "step" else numpy.maximum(distance, 0)
    name = f"{kind}_{plane.name.replace(' ', '_')}_{plane.at:g}"
    return write(study.directory, name, numpy.rint(UNIT * height).astype("i2"), -1024, 3072)


def look(study, kind, plane):
    tag = study.tagrid.grid(volume_with(study, kind, plane), "--cube", SIZE)
    mesh = study.tagrid.mesh(tag)
    distance = plane.distance(mesh.points)[mesh.tetrahedra]
    if kind == "step":
        crosses = (distance > 0).any(axis=1) & (distance <= 0).any(axis=1)
    else:  # by more than half a voxel: a crease between two samples is in the voxels beside it
        crosses = numpy.minimum(distance.max(axis=1), -distance.min(axis=1)) > 0.5
    off = 0.0
    if kind == "step":
        ply, _ = study.tagrid.surface(tag, 2 * UNIT)
        off = float(numpy.abs(plane.distance(points_of(read_ply(ply)))).max())
    levels = study.tagrid.info(tag)["levels"][-1]
    coarsest = int(mesh.levels[crosses].min()) if crosses.any() else LAST
    return Found(plane, mesh, int(crosses.sum()), coarsest, 100 * levels["active"] / levels["points"], off)


def picture(study, found):
    extent = CUBES * SIZE
    panels, titles = [], []
    scale = study.pixels(250) / extent
    for kind in found:
        for name in NORMALS:
            one = [one for one in found[kind] if one.plane.name == name][len(found[kind]) // len(NORMALS) // 2]
            panel = drawing.segments(edges_in_plane(one.mesh, SIZE), (extent, extent), scale)
            # Where the plane cuts the picture: along the line of distance 0 at this z.
            normal = numpy.array(NORMALS[name])
            constant = one.plane.at * normal.sum() - normal[2] * SIZE
            ends = [(constant / normal[0], 0), ((constant - normal[1] * extent) / normal[0], extent)]
            pixels = [(x * scale + 2, panel.height - 3 - y * scale) for x, y in ends]
            drawing.outline(panel, pixels, drawing.RED, 2)
            panels.append(panel)
            titles.append(f"{kind}, {name}")
    return drawing.beside(panels, titles, len(NORMALS))


def claim(report, found, positions):
    coarsest = {kind: min(one.coarsest for one in found[kind]) for kind in found}
    active = [one.active for kind in found for one in found[kind]]
    off = max(one.off for one in found["step"])
    kept = all(coarsest[kind] >= COARSEST[kind] for kind in found) and off <= 1
    report.claim(6, "steps and creases of the field are found and kept, wherever they lie relative to the root cubes",
                 HOLDS if kept else FAILS,
                 "Planes of {directions} directions were moved through root cubes of edge {size}, {positions} positions "
                 "each. Of {crossed:,} leaves that a step crosses, the coarsest is of level {step} of {last}. Isosurfaces at "
                 "half the step's height are at most {off:.2f} voxels from its plane. {creased:,} leaves reach over a crease "
                 "by more than half a voxel on both sides, the coarsest of level {crease}. Between {least:.1f} and "
                 "{most:.1f} % of all points are active.",
                 directions=len(NORMALS), size=SIZE, positions=positions, crossed=sum(one.crossed for one in found["step"]),
                 step=coarsest["step"], last=LAST,
                 off=off, creased=sum(one.crossed for one in found["crease"]), crease=coarsest["crease"], least=min(active),
                 most=max(active))
