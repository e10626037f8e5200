"""Figs. 9, 23 and 24: the region of reference. Claim 5: a cube can be refined alone, and cubes fit each other."""

import numpy
from PIL import Image

import drawing
from hierarchy import same_tetrahedra
from mesh import FACES, conformity
from reach import region_of_reference
from report import FAILS, PARTLY
from scene import Scene
from study import write

PRINTED_VOLUME = 25 / 3  # cubes: 1 + 6 + 8/6, below Eq. 5 of the paper


def add_to(report, study):
    report.section("The region of reference (Figs. 9, 23, 24)")
    small = region_of_reference(8)
    region = small if study.quick else region_of_reference(16)
    report.figure("fig-09", "Figs. 9 and 23: how far the region reaches, projected on a plane", picture_of_levels(small),
                  "The square is the cube. Around it lie the tetrahedra whose bisection can affect it, colored by their level. "
                  f"S is {small.size}; the farthest point is {small.distance} samples away.")
    report.figure("fig-24", "Fig. 24: the region grows with the level", picture_of_growth(study, region),
                  "The tetrahedra whose bisection can affect the cube, up to a level. The cube is drawn inside.")
    measured = [region_of_reference(size) for size in ((8,) if study.quick else (8, 16, 32))]
    report.table("The region of reference of one root cube, its own points included",
                 ["S", "points", "in cubes S³", "the paper", "farthest, samples", "bound of Eq. 5"],
                 [(one.size, f"{one.points:,}", f"{one.volume:.2f}", f"{PRINTED_VOLUME:.2f}", one.distance,
                   f"< {one.size}") for one in measured])
    claim(report, study, measured)


def picture_of_levels(region):
    """What the diamonds of each level cover, seen along z; coarser levels lie above finer ones."""
    last, size = len(region.diamonds), region.size
    scale = 480 / (3 * size)
    image = drawing.blank(481, 481)
    for level in range(last, 0, -1):
        triangles = region.diamonds[level - 1][:, FACES][..., :2].reshape(-1, 6)
        drawing.fill(image, numpy.unique(triangles, axis=0).reshape(-1, 3, 2) * scale, drawing.of_level(level, last))
    square = numpy.array([(1, 1), (2, 1), (2, 2), (1, 2), (1, 1)]) * size * scale
    drawing.outline(image, square)
    legend = drawing.blank(150, image.height)
    for level in range(1, last + 1):
        legend.paste(Image.new("RGB", (20, 16), drawing.bytes_of(drawing.of_level(level, last))), (0, 26 * level))
        drawing.write(legend, (28, 26 * level - 2), f"level {level}")
    return drawing.beside([image, legend], ["three root cubes an axis, on the XY plane", ""])


def picture_of_growth(study, region):
    last = len(region.diamonds)
    levels = sorted({1, 2, 3, min(6, last), min(9, last), last})
    panels = []
    for level in levels:
        scene = Scene(study.pixels(340), study.pixels(320))
        size = region.size
        scene.add_hull(numpy.concatenate(region.diamonds[:level]), drawing.of_level(level, last), 0.55,
                       edges=drawing.INK if level < 7 else None)
        scene.add_box((size,) * 3, (2 * size,) * 3, drawing.INK, 0.012 * size)
        scene.add_box((0,) * 3, (3 * size,) * 3, drawing.FAINT, 0.006 * size)
        panels.append(scene.picture())
    return drawing.beside(panels, [f"up to level {level}" for level in levels], 3)


def cubes_alone(study, size, margin, most):
    """Refines cubes of the foot alone, with `margin` samples around: how many were tried, and how many are not as in the whole."""
    volume = study.foot
    whole = study.tagrid.mesh(study.tagrid.grid(volume, "--cube", size)).corners().astype(numpy.int32)
    low_corners, high_corners = whole.min(axis=1), whole.max(axis=1)
    samples = volume.samples()
    cubes = [(x, y, z) for z in range(0, volume.dims[2] - 1, size) for y in range(0, volume.dims[1] - 1, size)
             for x in range(0, volume.dims[0] - 1, size)]
    cubes = cubes[:: max(1, len(cubes) // most)]
    different = 0
    for cube in cubes:
        low = numpy.maximum(numpy.array(cube) - margin, 0)
        high = numpy.array(cube) + size + margin + 1
        name = f"part_{margin}_{'_'.join(map(str, cube))}"
        part = write(study.directory, name, samples[low[2] : high[2], low[1] : high[1], low[0] : high[0]], volume.low,
                             volume.high)
        tag = study.tagrid.grid(part, "--cube", size)
        alone = study.tagrid.mesh(tag).corners().astype(numpy.int32) + low
        expected = whole[((low_corners >= cube) & (high_corners <= numpy.array(cube) + size)).all(axis=1)]
        inside = ((alone >= cube) & (alone <= numpy.array(cube) + size)).all(axis=(1, 2))
        different += not same_tetrahedra(alone[inside], expected)
    return len(cubes), different


def claim(report, study, measured):
    size, most = (8, 4) if study.quick else (32, 24)
    tried, different = cubes_alone(study, size, size, most)
    # Too few samples around: the comparison can fail.
    _, different_without = cubes_alone(study, size, 0, most)
    tag = study.tagrid.grid(study.lobster)
    check = conformity(study.tagrid.mesh(tag))
    _, closed = study.tagrid.surface(tag, study.lobster.iso, "--close")
    largest = measured[-1]
    bounded = all(one.distance < one.size for one in measured)
    works = bounded and different == 0 and check.holds and closed["boundary_edges"] == 0
    report.claim(5, "decisions in a cube depend on a bounded region of 8 1/3 cubes; so each cube can be refined alone, and all fit without cracks",
                 PARTLY if works and abs(largest.volume - PRINTED_VOLUME) > 0.01 else FAILS,
                 "The region is bounded: it ends {distance} samples from a cube of edge {size}. But it is larger than "
                 "printed: {volume:.1f} cubes, not {printed:.2f}, because neighbors across edges take part, too. Cubes can "
                 "be refined alone: of {tried} cubes of the {foot}, each cut out with one cube of samples around it, "
                 "{different} get other tetrahedra than in the entire volume (cut out with nothing around them, {without} "
                 "do). They fit: in the complete grid of the {lobster}, {faces:,} inner faces each belong to two tetrahedra, "
                 "{cracked} faces have no neighbor, and {missing:g} of the volume is missing or covered twice. Its "
                 "isosurface, closed at the border, has {triangles:,} triangles and {open} open edges.",
                 distance=largest.distance, size=largest.size, volume=largest.volume, printed=PRINTED_VOLUME, tried=tried,
                 different=different,
                 without=different_without, foot=study.foot.name, lobster=study.lobster.name, faces=check.inner_faces,
                 cracked=check.cracks,
                 missing=check.missing_volume, triangles=closed["triangles"], open=closed["boundary_edges"])
