"""Figs. 3 to 6 and 8: root tetrahedra, the three primitives, regions of influence. Claims 1, 2 and 4."""

import collections

import numpy

import drawing
from hierarchy import base_edges, bisected, midpoints, refined, root_tetrahedra, same_tetrahedra
from mesh import conformity, squared_lengths, unique_edges, unique_faces, volumes
from report import FAILS, HOLDS
from scene import Scene
from study import write

NAMES = ("TYPE-I", "TYPE-II", "TYPE-III")
# The ratios of the longest to the shortest edge that the paper states, squared.
SQUARED_RATIOS = (3, 8 / 3, 4)
SIZE = 8  # edge of the root cubes with which the laws are tested
CUBES = 3  # root cubes along each axis


def add_to(report, study):
    report.section("Root tetrahedra, primitives, regions of influence (Figs. 3 to 6, 8)")
    uniform = uniform_grid(study)
    report.figure("fig-03", "Fig. 3: a cube is cut into six root tetrahedra", picture_of_roots(study),
                  "All six share the diagonal of the cube. Right: pulled apart.")
    claim_roots(report, study, uniform)
    report.figure("fig-04", "Figs. 4 to 6: the three primitives", picture_of_primitives(study),
                  "TYPE-I at levels 3N, TYPE-II at 3N+1, TYPE-III at 3N+2. The base edge, at whose middle each is bisected, "
                  "is dark.")
    claim_primitives(report, study, uniform)
    report.figure("fig-08", "Fig. 8: regions of influence", picture_of_diamonds(study),
                  "The tetrahedra that share a base edge: a diagonal inside a cube, a diagonal on a face, an edge parallel "
                  "to an axis.")
    claim_diamonds(report, study, uniform)


def uniform_grid(study):
    """A grid that is refined everywhere: that of noise, of which every voxel is kept."""
    samples = numpy.random.default_rng(1).integers(0, 4096, (CUBES * SIZE + 1,) * 3).astype("i2")
    noise = write(study.directory, "noise", samples, 0, 4096)
    return study.tagrid.grid(noise, "--max-error", 0, "--cube", SIZE)


def picture_of_roots(study):
    roots = root_tetrahedra(2)
    pull = [(root.mean(axis=0) - 1) * 1.1 for root in roots]
    panels = []
    for apart in (False, True):
        scene = Scene(study.pixels(520), study.pixels(420))
        for i, root in enumerate(roots):
            scene.add_tetrahedra((root + (pull[i] if apart else 0))[None], drawing.PRIMITIVES[i % 3],
                                 opacity=0.95 if apart else 0.45)
        scene.add_lines([((0, 0, 0), (2, 2, 2))], drawing.INK, 0.025)
        panels.append(scene.picture())
    return drawing.beside(panels, ["together, around the diagonal", "apart"])


def picture_of_primitives(study):
    panels, titles = [], []
    tetrahedron = root_tetrahedra(8)[:1]
    for kind in range(4):
        scene = Scene(study.pixels(300), study.pixels(300))
        scene.add_tetrahedra(tetrahedron, drawing.PRIMITIVES[kind % 3], opacity=0.75)
        base = tetrahedron[0][base_edges(tetrahedron)[0]]
        scene.add_lines([base], drawing.INK, 0.012 * numpy.ptp(tetrahedron, axis=1).max())
        scene.add_balls(midpoints(tetrahedron), drawing.RED, 0.03 * numpy.ptp(tetrahedron, axis=1).max())
        panels.append(scene.picture())
        ratio = longest_to_shortest(tetrahedron)[0]
        titles.append(f"{NAMES[kind % 3]}: edges 1 : {ratio:.3f}" if kind < 3 else "TYPE-I again, half the edges")
        tetrahedron = bisected(tetrahedron)[:1]
    return drawing.beside(panels, titles, 2)


def longest_to_shortest(corners):
    squares = squared_lengths(corners)
    return numpy.sqrt(squares.max(axis=1) / squares.min(axis=1))


def picture_of_diamonds(study):
    panels, titles = [], []
    cubes = [(x, y, z) for x in (0, 4) for y in (0, 4) for z in (0, 4)]
    for level, place in enumerate([(2, 2, 2), (4, 2, 2), (4, 4, 2)]):
        tetrahedra = refined(numpy.concatenate([root_tetrahedra(4, corner=corner) for corner in cubes]), level)
        around = tetrahedra[(midpoints(tetrahedra) == place).all(axis=1)]
        scene = Scene(study.pixels(360), study.pixels(360))
        scene.add_tetrahedra(around, drawing.PRIMITIVES[level], shrink=0.93, opacity=0.8)
        scene.add_lines([around[0][base_edges(around)[0]]], drawing.INK, 0.05)
        panels.append(scene.picture())
        titles.append(f"{len(around)} tetrahedra")
    return drawing.beside(panels, titles)


def claim_roots(report, study, tag):
    """Faces of cubes are squares with one diagonal; those of opposite faces are parallel."""
    mesh = study.tagrid.mesh(tag, level=0)
    faces, _ = unique_faces(mesh.tetrahedra, len(mesh.points))
    corners = mesh.points[faces]
    directions = collections.defaultdict(set)  # of diagonals, for each axis that a face is across
    for axis in range(3):
        flat = corners[(corners[:, :, axis] == corners[:, :1, axis]).all(axis=1)]
        for one, other in ((0, 1), (0, 2), (1, 2)):
            step = flat[:, other] - flat[:, one]
            for direction in step[(step != 0).sum(axis=1) == 2]:
                directions[axis].add(tuple((direction * numpy.sign(direction[direction != 0][0]) / SIZE).astype(int).tolist()))
    per_cube = len(mesh.tetrahedra) / CUBES**3
    check = conformity(mesh)
    expected = numpy.concatenate([root_tetrahedra(SIZE, corner=(x, y, z)) for x in range(0, CUBES * SIZE, SIZE)
                                  for y in range(0, CUBES * SIZE, SIZE) for z in range(0, CUBES * SIZE, SIZE)])
    same = same_tetrahedra(mesh.corners().astype(numpy.int64), expected)
    parallel = len(directions) == 3 and all(len(found) == 1 for found in directions.values())
    report.claim(1, "six root tetrahedra a cube, whose faces fit those of all neighbors, without an alternating pattern",
                 HOLDS if per_cube == 6 and parallel and check.holds and same else FAILS,
                 "In {cubes} root cubes that the program wrote there are {tetrahedra} tetrahedra, {per_cube:g} a cube. "
                 "Diagonals on faces across x, y and z have {directions} directions in all. Of {faces} inner faces, each "
                 "belongs to two tetrahedra; there are {cracks} faces without a neighbor. The tetrahedra are those of Fig. "
                 "3: {same}.",
                 cubes=CUBES**3, tetrahedra=len(mesh.tetrahedra), per_cube=per_cube, faces=check.inner_faces, cracks=check.cracks,
                 directions=sum(map(len, directions.values())), same="yes" if same else "no")


def claim_primitives(report, study, tag):
    levels = 3 * (SIZE.bit_length() - 1)
    wrong, rows = 0, []
    for level in range(levels + 1):
        mesh = study.tagrid.mesh(tag, level=level)
        corners = mesh.corners()
        squares = squared_lengths(corners)
        ratios = squares.max(axis=1) / squares.min(axis=1)
        sixfold = numpy.abs(volumes(corners)) / SIZE**3
        wrong += int((mesh.levels != level).sum() + (mesh.types != level % 3).sum())
        wrong += int((numpy.abs(ratios - SQUARED_RATIOS[level % 3]) > 1e-12).sum() + (sixfold * 2**level != 1).sum())
        wrong += int((squares.max(axis=1) != (3, 2, 1)[level % 3] * (SIZE / 2 ** (level // 3)) ** 2).sum())
        rows.append((level, NAMES[level % 3], f"{len(corners):,}", f"{numpy.sqrt(ratios.mean()):.4f}",
                     f"{numpy.sqrt(squares.max()):.4f}",
                     f"{sixfold.mean() / 6 * SIZE**3:.4f}"))
    report.table(f"All tetrahedra of {CUBES**3} root cubes of edge {SIZE}, refined everywhere",
                 ["level", "primitive", "tetrahedra", "longest : shortest edge", "longest edge", "volume"], rows)
    count = int(rows[-1][2].replace(",", ""))
    report.claim(2, "three primitives follow one another; each bisection halves the volume, three halve the edges",
                 FAILS if wrong else HOLDS,
                 "On {levels} levels, up to {count:,} tetrahedra, the level, the primitive, the ratio of edges (√3, 2√2/√3, "
                 "2), the longest edge and the volume of every tetrahedron were compared with the paper: {wrong} of these "
                 "differ.",
                 levels=levels + 1, count=count, wrong=wrong)


def claim_diamonds(report, study, tag):
    """How many tetrahedra share a base edge, for every base edge that does not lie on the border."""
    found = collections.defaultdict(set)
    edges_seen = 0
    for level in range(3 * (SIZE.bit_length() - 1)):
        mesh = study.tagrid.mesh(tag, level=level)
        pairs, counts = unique_edges(mesh.tetrahedra, len(mesh.points))
        lengths = ((mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]]) ** 2).sum(axis=1)
        middles = mesh.points[pairs].mean(axis=1)
        inner = ((middles > 0) & (middles < CUBES * SIZE)).all(axis=1) & (lengths == lengths.max())
        found[level % 3].update(counts[inner].tolist())
        edges_seen += int(inner.sum())
    sizes = [sorted(found[kind]) for kind in range(3)]
    report.claim(4, "6, 4 and 8 tetrahedra share a base edge, and a bisection affects no others",
                 HOLDS if sizes == [[6], [4], [8]] else FAILS,
                 "The program's grids of all levels have {edges:,} base edges inside the volume. These numbers of tetrahedra "
                 "share one: {first} at levels 3N, {second} at 3N+1, {third} at 3N+2.",
                 edges=edges_seen, first=" or ".join(map(str, sizes[0])), second=" or ".join(map(str, sizes[1])),
                 third=" or ".join(map(str, sizes[2])))
