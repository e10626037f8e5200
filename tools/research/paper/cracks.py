"""Fig. 7: what a crack is, in two tetrahedra and in a volume."""

import numpy

import drawing
from mesh import Mesh
from scene import Scene
from vtk_data import contour_of, open_edges, part_of

COARSE, FINE = 9, 12  # levels on either side of the plane
NEAR = 64  # samples on either side of it that are shown


def add_to(report, study):
    report.section("Cracks (Fig. 7)")
    report.figure("fig-07", "Fig. 7: the crack problem", picture_of_two(study),
                  "Left: one of two tetrahedra with the face ACE is bisected at M, its neighbor is not. The surface that is "
                  "drawn in both has an open edge (red) on their face. Right: both are bisected, as the region of influence "
                  "demands.")
    picture, torn, whole = picture_of_volume(study)
    report.figure("cracks", "An isosurface with and without cracks", picture,
                  f"The {study.lobster.name}. Left: on one side of a plane between root cubes, the grid of level {COARSE}; "
                  f"on the other side that of level {FINE}, each without regard to the other. The surface is torn at "
                  f"{torn:,} edges (red). Right: the grid of the program at level {FINE}; {whole:,} edges inside the volume "
                  "are open.")


def picture_of_two(study):
    a, e, b, c, d = (0, 0, 0), (4, 0, 0), (2, -3, 0.3), (2, 0.4, 3), (2, 3, 0.3)
    m = (2, 0, 0)
    split, whole = [(a, m, b, c), (m, e, b, c)], [(a, c, d, e)]
    both = [(a, m, c, d), (m, e, c, d)]
    heights = {a: 1.0, e: 1.0, b: -1.0, c: -1.0, d: -1.0, m: 3.0}
    panels = []
    for right in (whole, both):
        corners = numpy.array(split + right, dtype=float)
        values = numpy.array([heights[corner] for tetrahedron in split + right for corner in tetrahedron])
        scene = Scene(study.pixels(520), study.pixels(400), view=(0.2, 0.35, -0.75), zoom=1.2)
        edges = [(tetrahedron[i], tetrahedron[j]) for tetrahedron in split + right for i in range(4) for j in range(i)]
        scene.add_lines(edges, drawing.FAINT, 0.02)
        scene.add_balls([m], drawing.INK, 0.07)
        surface = contour_of(welded(corners, values), 0.0)
        scene.add(surface, drawing.BLUE, edges=drawing.INK)
        edges = open_edges(surface)
        # Those on the face of A, C, E, which both tetrahedra have.
        normal = numpy.cross(numpy.subtract(c, a), numpy.subtract(e, a))
        torn = edges[(numpy.abs((edges - a) @ normal) < 1e-6).all(axis=1)]
        if len(torn):
            scene.add_lines(torn, drawing.RED, 0.05)
        for name, place in zip("AEBCDM", (a, e, b, c, d, m)):
            scene.add_text(place, name)
        panels.append(scene.picture())
    return drawing.beside(panels, ["one is bisected: a crack", "both are bisected: no crack"])


def welded(corners, values):
    """Tetrahedra [m, 4, 3] as a mesh in which equal positions are one point."""
    points, first, inverse = numpy.unique(corners.reshape(-1, 3), axis=0, return_index=True, return_inverse=True)
    none = numpy.zeros(len(corners), dtype=numpy.int32)
    return Mesh(points, values.reshape(-1)[first], inverse.reshape(-1, 4), none, none)


def open_inside(surface, low, high):
    """The edges with one triangle that do not lie on the border of a box."""
    edges = open_edges(surface)
    middles = edges.mean(axis=1)
    return edges[((middles > low + 1e-3) & (middles < high - 1e-3)).all(axis=1)]


def refined_apart(coarse, fine, plane):
    """Both meshes of one volume, each on its side of a plane across x."""
    left = (coarse.corners()[:, :, 0] <= plane).all(axis=1)
    right = (fine.corners()[:, :, 0] >= plane).all(axis=1)
    corners = numpy.concatenate([coarse.corners()[left], fine.corners()[right]])
    values = numpy.concatenate([coarse.values[coarse.tetrahedra[left]], fine.values[fine.tetrahedra[right]]])
    return welded(corners, values)


def picture_of_volume(study):
    """The picture, and the numbers of open edges inside the volume on both its sides."""
    volume = study.lobster
    tag = study.tagrid.grid(volume)
    coarse, fine = (study.tagrid.mesh(tag, level=level) for level in (COARSE, FINE))
    plane = 32 * (volume.dims[0] // 64)
    low, high = fine.points.min(axis=0), fine.points.max(axis=0)
    panels, counts = [], []
    for mesh in (refined_apart(coarse, fine, plane), fine):
        surface = contour_of(mesh, volume.iso)
        torn = open_inside(surface, low, high)
        counts.append(len(torn))
        scene = Scene(study.pixels(540), study.pixels(460), view=(-0.25, 0.45, -0.85), up=(0, 1, 0), zoom=1.45)
        near = part_of(surface, lambda corners: (abs(corners[:, :, 0] - plane) <= NEAR).all(axis=1))
        scene.add(near, drawing.SHELL, edges=(0.66, 0.52, 0.40))
        if len(torn):
            scene.add_lines(torn, drawing.RED, 0.0022 * volume.dims[0])
        panels.append(scene.picture())
    return drawing.beside(panels,
                        [f"levels {COARSE} and {FINE}, apart: {counts[0]:,} open edges",
                         f"level {FINE}: {counts[1]:,} open edges"]), *counts
