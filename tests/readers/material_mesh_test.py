"""Meshes with materials: programs that solve with them, and those that convert and show them, find the same points,
tetrahedra, materials and surfaces in every format.

    material_mesh_test.py PROGRAM

The program write_material_mesh (tests/support) writes them: cells of a lattice with six tetrahedra each, in slabs.
"""

import collections
import itertools
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import unittest
import xml.etree.ElementTree as ElementTree

from other_readers import PROGRAM, ReaderTest, gmsh, h5py, main, meshio, numpy, unless_sanitized, vtk_hdf, vtk_numpy, vtk_xml

WRITER = PROGRAM.parent / "tests" / "write_material_mesh"
ENVIRONMENT = dict(os.environ, TAGRID_READER_PATH=str(PROGRAM.parent))
NAMES = ("a.vtu", "a.vtkhdf", "a.msh", "a.inp", "a.feb", "a.mesh", "a.xdmf")
# The nodes of the middles of edges, as VTK, Abaqus, FEBio and Medit have them. Gmsh has the last two the other way round.
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
# "Three-dimensional solid element library" of Abaqus: the nodes of the faces of tetrahedra.
FACES = {"S1": (0, 1, 2), "S2": (0, 3, 1), "S3": (1, 3, 2), "S4": (2, 3, 0)}

CCX = shutil.which("ccx")
if CCX is None:
    print("skipped: there is no ccx on this machine (calculix-ccx)", file=sys.stderr)
try:
    from dolfinx.io import XDMFFile, gmshio
    from mpi4py import MPI
except ImportError:
    gmshio = None
    print("skipped: there is no dolfinx on this machine (python3-dolfinx)", file=sys.stderr)


class Boxes:
    """What write_material_mesh writes."""

    def __init__(self, order=1, cells=(5, 2, 3), spacing=(0.5, 1.25, 3), origin=(10, -2, 0.125), materials=2, mirrored=False, air=False):
        self.order, self.cells, self.spacing, self.origin = order, cells, spacing, origin
        self.mirrored, self.air = mirrored, air
        self.names = ["bone", "soft"][:materials] if materials <= 2 else [f"m{i + 1}" for i in range(materials)]
        self.labels = {name: 10 * (i + 1) for i, name in enumerate(self.names)}
        self.bounds = [i * cells[0] // materials for i in range(materials + 1)]
        size = [2 * n // (1 if order == 2 else 2) + 1 for n in cells]
        self.point_count = size[0] * size[1] * size[2]
        self.cell_counts = {name: 6 * (self.bounds[i + 1] - self.bounds[i]) * cells[1] * cells[2] for i, name in enumerate(self.names)}
        cell = spacing[0] * spacing[1] * spacing[2]
        self.volumes = {name: cell / 6 * count for name, count in self.cell_counts.items()}
        # Of each surface: the axis that it is across, its place there in the lattice, and the direction outwards.
        self.planes, self.areas, self.sides = {}, {}, collections.defaultdict(list)
        for i, name in enumerate(self.names):
            for axis, upper in itertools.product(range(3), (0, 1)):
                end = self.cells[axis] * upper
                if axis == 0 and end != self.bounds[i + upper]:
                    continue
                is_air = air and axis == 2 and upper
                side = "xyz"[axis] + "_" + ("min", "max")[upper]
                self.add(f"{name}_{'air' if is_air else side}", i, axis, end, 1 if upper else -1)
                if not is_air:
                    self.sides[side].append(f"{name}_{side}")
            if i > 0:
                self.add(f"{self.names[i - 1]}_{name}", i - 1, 0, self.bounds[i], 1)

    def add(self, name, material, axis, place, direction):
        width = [(self.bounds[material + 1] - self.bounds[material]) * self.spacing[0], self.cells[1] * self.spacing[1],
                 self.cells[2] * self.spacing[2]]
        self.areas[name] = width[(axis + 1) % 3] * width[(axis + 2) % 3]
        place = self.origin[axis] + self.spacing[axis] * place
        if axis == 0 and self.mirrored:
            place, direction = -place, -direction
        self.planes[name] = (axis, place, direction)

    def settings(self):
        text = [f"order={self.order}", f"materials={len(self.names)}"]
        text += [f"{key}={','.join(map(repr, getattr(self, key)))}" for key in ("cells", "spacing", "origin")]
        return text + ["mirrored"] * self.mirrored + ["air"] * self.air


CASES = [Boxes(), Boxes(order=2), Boxes(mirrored=True, air=True), Boxes(order=2, mirrored=True), Boxes(materials=1, order=2),
         Boxes(materials=5, spacing=(1 / 3, 1 / 7, 1e-5 / 3), origin=(-1 / 3, 1e-7 / 3, 100 / 3))]
ORDERS = [Boxes(), Boxes(order=2, mirrored=True)]


@unittest.skipIf(numpy is None, "there is no NumPy on this machine")
@unittest.skipUnless(WRITER.exists(), f"there is no {WRITER}, which is built with the tests")
class MaterialTest(ReaderTest):
    def write(self, name, boxes, *settings, **options):
        return subprocess.run([WRITER, name, *boxes.settings(), *settings], cwd=self.folder, env=ENVIRONMENT, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def written(self, name, boxes, *settings):
        run = self.write(name, boxes, "overwrite", *settings)
        self.assertEqual((run.returncode, run.stderr), (0, ""), name)
        return self.folder / name

    def check_volume(self, boxes, name, points, cells):
        """The tetrahedra of a material have its volume, and all are positive; middles of edges are in the middle."""
        corners = points[cells[:, :4]]
        volumes = numpy.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
        self.assertEqual(len(cells), boxes.cell_counts[name])
        self.assertGreater(volumes.min(), 0)
        numpy.testing.assert_allclose(volumes.sum(), boxes.volumes[name])
        self.assertEqual(cells.shape[1], 4 if boxes.order == 1 else 10)
        self.check_middles(boxes, points, cells[:, :4], cells[:, 4:])

    def check_middles(self, boxes, points, corners, middles):
        for i in range(middles.shape[1]):
            a, b = EDGES[i]
            numpy.testing.assert_allclose(points[middles[:, i]], (points[corners[:, a]] + points[corners[:, b]]) / 2, rtol=1e-12, atol=1e-20)

    def check_faces(self, boxes, name, points, faces):
        self.check_facets(boxes, [(name, 1)], points, faces)

    def check_facets(self, boxes, parts, points, faces):
        """Triangles have the areas of surfaces [(name, 1 or -1)], on their planes, and seen from outside (-1: from inside)
        their nodes are counterclockwise. There are no others."""
        areas = collections.Counter()
        for name, sign in parts:
            axis, place, direction = boxes.planes[name]
            areas[axis, place, sign * direction] += boxes.areas[name]
        corners = points[faces[:, :3]]
        vectors = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        self.check_middles(boxes, points, faces[:, :3], faces[:, 3:])
        self.assertEqual(faces.shape[1], 3 if boxes.order == 1 else 6)
        left = len(faces)
        for (axis, place, direction), area in areas.items():
            here = numpy.isclose(corners[:, :, axis], place, rtol=1e-12, atol=1e-20).all(axis=1) & (direction * vectors[:, axis] > 0)
            numpy.testing.assert_allclose(vectors[here].sum(axis=0)[axis], direction * area)
            left -= here.sum()
        self.assertEqual(left, 0, parts)

    def check_points(self, boxes, points):
        self.assertEqual(len(points), boxes.point_count)
        low = numpy.array(boxes.origin, float)
        high = low + numpy.array(boxes.spacing) * boxes.cells
        if boxes.mirrored:
            low[0], high[0] = -high[0], -low[0]
        numpy.testing.assert_allclose(points.min(axis=0), low, rtol=1e-12, atol=1e-20)
        numpy.testing.assert_allclose(points.max(axis=0), high, rtol=1e-12, atol=1e-20)

    def facets_of(self, boxes):
        """The sets of facets of Abaqus and FEBio: name -> [(surface, 1 or -1)]."""
        sets = {name: [(name, 1)] for name in boxes.planes}
        for one, other in zip(boxes.names, boxes.names[1:]):
            sets[f"{other}_{one}"] = [(f"{one}_{other}", -1)]
        for i, name in enumerate(boxes.names):
            sets[f"{name}_surface"] = [(surface, 1) for surface in boxes.planes if surface.startswith(name + "_")]
            if i > 0:
                sets[f"{name}_surface"].append((f"{boxes.names[i - 1]}_{name}", -1))
        for side, surfaces in boxes.sides.items():
            sets[side] = [(surface, 1) for surface in surfaces]
        return sets

    def check_sets(self, boxes, points, faces_of, points_of):
        """faces_of: nodes of faces by the name of their set. points_of: sets of points."""
        sets = self.facets_of(boxes)
        self.assertEqual(sorted(faces_of), sorted(sets))
        turned = {f"{other}_{one}" for one, other in zip(boxes.names, boxes.names[1:])}
        self.assertEqual(sorted(points_of), sorted(set(sets) - turned))
        for name, parts in sets.items():
            self.check_facets(boxes, parts, points, faces_of[name])
            if name in points_of:
                self.assertEqual(points_of[name].tolist(), numpy.unique(faces_of[name]).tolist(), name)


def cards(text):
    """The keyword lines of a file of Abaqus, and the data lines of each."""
    result = []
    for line in text.splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword, *settings = line[1:].split(", ")
            result.append((keyword, dict(setting.split("=") for setting in settings), []))
        else:
            result[-1][2].append(line.split(","))
    return result


class Abaqus(MaterialTest):
    def test_every_set_is_where_it_belongs(self):
        for boxes in CASES:
            found = cards(self.written("a.inp", boxes, "empty").read_text())
            self.assertEqual(found[0][0], "NODE")
            points = numpy.array(found[0][2], float)
            self.assertEqual(points[:, 0].tolist(), list(range(1, len(points) + 1)))
            points = points[:, 1:]
            self.check_points(boxes, points)
            elements, faces, sets = {}, {}, {}
            for keyword, settings, lines in found[1:]:
                if keyword == "ELEMENT":
                    self.assertEqual(settings["TYPE"], "C3D4" if boxes.order == 1 else "C3D10")
                    numbers = numpy.array(lines, int)
                    self.check_volume(boxes, settings["ELSET"], points, numbers[:, 1:] - 1)
                    elements.update(zip(numbers[:, 0].tolist(), numbers[:, 1:] - 1))
                elif keyword == "SURFACE":
                    self.assertEqual(settings["TYPE"], "ELEMENT")
                    # The nodes of faces of the manual are counterclockwise as seen from inside.
                    faces[settings["NAME"]] = numpy.array([self.face_of(elements[int(e)], side) for e, side in lines])
                else:
                    self.assertEqual(keyword, "NSET")
                    sets[settings["NSET"]] = numpy.array([int(p) - 1 for line in lines for p in line])
            self.assertEqual(list(elements), list(range(1, sum(boxes.cell_counts.values()) + 1)))
            self.check_sets(boxes, points, faces, sets)

    @staticmethod
    def face_of(nodes, side):
        """The nodes of a face as they are seen from outside, and then its middles."""
        corners = [FACES[side][i] for i in (0, 2, 1)]
        middles = [4 + EDGES.index(tuple(sorted((corners[a], corners[b])))) for a, b in EDGES[:3]]
        return nodes[corners if len(nodes) == 4 else corners + middles]

    @unittest.skipIf(meshio is None, "there is no meshio on this machine")
    def test_meshio_finds_materials_and_sets(self):
        for boxes in CASES:
            mesh = meshio.read(self.written("a.inp", boxes, "empty"))
            self.check_points(boxes, mesh.points)
            self.assertEqual(sorted(mesh.cell_sets), boxes.names)
            for i, name in enumerate(boxes.names):
                self.assertEqual(mesh.cells[i].type, "tetra" if boxes.order == 1 else "tetra10")
                self.check_volume(boxes, name, mesh.points, mesh.cells[i].data)
                self.assertEqual([len(block) for block in mesh.cell_sets[name]],
                                 [boxes.cell_counts[other] * (other == name) for other in boxes.names])
            for name, (axis, place, _) in boxes.planes.items():
                numpy.testing.assert_allclose(mesh.points[mesh.point_sets[name]][:, axis], place)

    def solved(self, boxes, load, poisson):
        """The stresses of each material, the displacements at x_max, and the forces at x_min, of a job that includes the
        file."""
        self.written("a.inp", boxes)
        sections = "".join(f"*SOLID SECTION, ELSET={name}, MATERIAL=m\n" for name in boxes.names)
        prints = "".join(f"*EL PRINT, ELSET={name}\nS\n" for name in boxes.names)
        (self.folder / "job.inp").write_text(
            f"*INCLUDE, INPUT=a.inp\n*MATERIAL, NAME=m\n*ELASTIC\n1000,{poisson}\n{sections}*STEP\n*STATIC\n"
            f"*BOUNDARY\nx_min,1\ny_min,2\nz_min,3\n*DSLOAD\n{load}\n{prints}*NODE PRINT, NSET=x_max\nU\n"
            "*NODE PRINT, NSET=x_min, TOTALS=ONLY\nRF\n*END STEP\n")
        run = subprocess.run([CCX, "job"], cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300)
        self.assertIn("Job finished", run.stdout)
        self.assertNotIn("*ERROR", run.stdout)
        self.assertNotIn("*WARNING", run.stdout)
        parts = re.split(r"\n [^\n]*for set (\w+) and time[^\n]*\n", "\n" + (self.folder / "job.dat").read_text())
        found = [(name.lower(), numpy.array([line.split() for line in text.split("\n") if line.strip()], float))
                 for name, text in zip(parts[1::2], parts[2::2])]
        stresses = {name: numbers[:, 2:] for name, numbers in found[:len(boxes.names)]}
        return stresses, found[-2][1][:, 1:], found[-1][1][0]

    def assert_stress(self, found, x):
        numpy.testing.assert_allclose(found, numpy.tile([x, 0, 0, 0, 0, 0], (len(found), 1)), atol=1e-6)

    @unittest.skipIf(CCX is None, "there is no ccx on this machine")
    def test_calculix_compresses_a_block_uniformly(self):
        for order in (1, 2):
            boxes = Boxes(order=order, cells=(4, 3, 1), spacing=(0.5, 1, 2), origin=(0, 0, 0))
            stresses, moves, force = self.solved(boxes, "x_max, P, 10", 0.25)
            points_of_elements = 1 if order == 1 else 4
            for name in boxes.names:
                self.assertEqual(len(stresses[name]), points_of_elements * boxes.cell_counts[name])
                self.assert_stress(stresses[name], -10)
            numpy.testing.assert_allclose(moves[:, 0], -10 / 1000 * 2, rtol=1e-5)
            numpy.testing.assert_allclose(force, (10 * 3 * 2, 0, 0), atol=1e-4)

    @unittest.skipIf(CCX is None, "there is no ccx on this machine")
    def test_calculix_presses_on_each_side_of_an_interface(self):
        for order, mirrored in ((1, False), (2, False), (1, True)):
            boxes = Boxes(order=order, cells=(4, 3, 1), spacing=(0.5, 1, 2), origin=(0, 0, 0), mirrored=mirrored)
            # A pressure on bone compresses it; one on soft, which is free, pulls bone. Nothing gets wider.
            for load, stress in (("bone_soft", -10), ("soft_bone", 10)):
                stresses, _, force = self.solved(boxes, f"{load}, P, 10", 0)
                self.assert_stress(stresses["bone"], stress)
                self.assert_stress(stresses["soft"], 0)
                numpy.testing.assert_allclose(force, (-stress * 6 * (-1 if mirrored else 1), 0, 0), atol=1e-4)


@unittest.skipIf(gmsh is None, "there is no gmsh on this machine")
class Gmsh(MaterialTest):
    is_open = False

    def close(self):
        if self.is_open:
            gmsh.finalize()
        self.is_open = False

    def opened(self, path):
        self.close()
        gmsh.initialize(["gmsh", "-v", "1"])
        self.is_open = True
        self.addCleanup(self.close)
        gmsh.open(str(path))
        numbers, places, _ = gmsh.model.mesh.getNodes()
        points = numpy.zeros((int(numbers.max()) + 1, 3))
        points[numbers.astype(int)] = places.reshape(-1, 3)
        return points

    def elements(self, dimension, entity, size):
        kinds, numbers, nodes = gmsh.model.mesh.getElements(dimension, entity)
        if len(kinds) == 0:
            return None, [], numpy.zeros((0, size), int)
        self.assertEqual(len(kinds), 1)
        return kinds[0], numbers[0].tolist(), nodes[0].reshape(-1, size).astype(int)

    def test_groups_have_the_names_volumes_and_areas(self):
        for boxes in CASES:
            path = self.written("a.msh", boxes, "empty")
            check = subprocess.run(["gmsh", "-check", path], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            self.assertEqual(check.returncode, 0, check.stdout)
            self.assertNotRegex(check.stdout, "Warning|Error")
            points = self.opened(path)
            self.check_points(boxes, points[1:])
            groups = {gmsh.model.getPhysicalName(*group): group for group in gmsh.model.getPhysicalGroups()}
            self.assertEqual(set(groups), set(boxes.volumes) | set(boxes.areas) | {"nothing", "bone_nothing"})
            seen = set()
            for name, label in boxes.labels.items():
                self.assertEqual(groups[name], (3, label))
                entities = gmsh.model.getEntitiesForPhysicalGroup(3, label)
                self.assertEqual(len(entities), 1)
                kind, numbers, nodes = self.elements(3, entities[0], 4 if boxes.order == 1 else 10)
                self.assertEqual(kind, 4 if boxes.order == 1 else 11)
                corners_and_middles = nodes if boxes.order == 1 else nodes[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
                self.check_volume(boxes, name, points, corners_and_middles)
                for place in ((0.25, 0.25, 0.25), (0.1, 0.2, 0.6)):
                    determinants = gmsh.model.mesh.getJacobians(kind, place, entities[0])[1]
                    self.assertGreater(determinants.min(), 0)
                    numpy.testing.assert_allclose(determinants.sum() / 6, boxes.volumes[name])
                self.assertEqual(seen & set(numbers), set())
                seen |= set(numbers)
            for name, area in boxes.areas.items():
                self.assertEqual(groups[name][0], 2)
                entities = gmsh.model.getEntitiesForPhysicalGroup(*groups[name])
                self.assertEqual(len(entities), 1)
                kind, numbers, nodes = self.elements(2, entities[0], 3 if boxes.order == 1 else 6)
                self.assertEqual(kind, 2 if boxes.order == 1 else 9)
                self.check_faces(boxes, name, points, nodes)
                numpy.testing.assert_allclose(gmsh.model.mesh.getJacobians(kind, (0.25, 0.25, 0), entities[0])[1].sum() / 2, area)
                self.assertEqual(seen & set(numbers), set())
                seen |= set(numbers)
                # The volumes on both sides.
                above = gmsh.model.getAdjacencies(2, entities[0])[0]
                around = {gmsh.model.getPhysicalName(3, gmsh.model.getPhysicalGroupsForEntity(3, entity)[0]) for entity in above}
                self.assertEqual(around, {part for part in name.split("_") if part in boxes.names})
            self.assertEqual(seen, set(range(1, len(seen) + 1)))
            # The node of each facet is used by tetrahedra, and no facet is in two groups.
            facets = [tuple(sorted(facet)) for group in gmsh.model.getPhysicalGroups(2) for entity in gmsh.model.getEntitiesForPhysicalGroup(*group)
                      for facet in self.elements(2, entity, 3 if boxes.order == 1 else 6)[2][:, :3].tolist()]
            self.assertEqual(len(facets), len(set(facets)))

    @unittest.skipIf(meshio is None, "there is no meshio on this machine")
    def test_meshio_finds_the_groups(self):
        for boxes in CASES:
            mesh = meshio.read(self.written("a.msh", boxes, "empty"))
            self.check_points(boxes, mesh.points)
            for name, label in boxes.labels.items():
                self.assertEqual(mesh.field_data[name].tolist(), [label, 3])
                blocks = [block.data[chosen] for block, chosen in zip(mesh.cells, mesh.cell_sets[name]) if len(chosen) and block.dim == 3]
                # meshio has the order of VTK.
                self.check_volume(boxes, name, mesh.points, numpy.concatenate(blocks))
            for name in boxes.areas:
                self.assertEqual(mesh.field_data[name][1], 2)
                blocks = [block.data[chosen] for block, chosen in zip(mesh.cells, mesh.cell_sets[name]) if len(chosen) and block.dim == 2]
                self.check_faces(boxes, name, mesh.points, numpy.concatenate(blocks))

    def test_three_hundred_materials(self):
        boxes = Boxes(materials=300, cells=(300, 1, 1))
        points = self.opened(self.written("a.msh", boxes))
        self.assertEqual(len(gmsh.model.getPhysicalGroups(3)), 300)
        self.assertEqual(len(gmsh.model.getPhysicalGroups(2)), len(boxes.areas))
        entity = gmsh.model.getEntitiesForPhysicalGroup(3, 2570)[0]
        self.check_volume(boxes, "m257", points, self.elements(3, entity, 4)[2])

    @unittest.skipIf(gmshio is None, "there is no dolfinx on this machine")
    def test_fenics_finds_materials_and_surfaces(self):
        for boxes in ORDERS:
            self.opened(self.written("a.msh", boxes))
            mesh, cells, facets = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=3)
            self.assertEqual(mesh.geometry.x.shape[0], boxes.point_count)
            for name, label in boxes.labels.items():
                self.assertEqual((cells.values == label).sum(), boxes.cell_counts[name])
            self.assertEqual(len(set(facets.values.tolist())), len(boxes.areas))

    def test_gmsh_reads_medit_files(self):
        for boxes in CASES:
            path = self.written("a.mesh", boxes)
            points = self.opened(path)
            self.check_points(boxes, points[1:])
            for name, label in boxes.labels.items():
                kind, _, nodes = self.elements(3, label, 4 if boxes.order == 1 else 10)
                self.assertEqual(kind, 4 if boxes.order == 1 else 11)
                self.check_volume(boxes, name, points, nodes if boxes.order == 1 else nodes[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]])
                self.assertGreater(gmsh.model.mesh.getJacobians(kind, (0.1, 0.2, 0.6), label)[1].min(), 0)
            references = {name: int(number) for number, name in re.findall(r"^# triangles (\d+): (\w+)$", path.read_text(), re.M)}
            self.assertEqual(set(references), set(boxes.areas))
            for name, reference in references.items():
                self.check_faces(boxes, name, points, self.elements(2, reference, 3 if boxes.order == 1 else 6)[2])


class Medit(MaterialTest):
    @unittest.skipIf(meshio is None, "there is no meshio on this machine")
    def test_meshio_finds_references(self):
        for boxes in (case for case in CASES if case.order == 1):
            path = self.written("a.mesh", boxes, "empty")
            mesh = meshio.read(path)
            self.check_points(boxes, mesh.points)
            (tetrahedra, triangles), (labels, references) = mesh.cells, mesh.cell_data["medit:ref"]
            self.assertEqual((tetrahedra.type, triangles.type), ("tetra", "triangle"))
            names = dict(re.findall(r"^# (\w+ -?\d+): (\w+)$", path.read_text(), re.M))
            for name, label in boxes.labels.items():
                self.assertEqual(names[f"tetrahedra {label}"], name)
                self.check_volume(boxes, name, mesh.points, tetrahedra.data[labels == label])
            for reference in numpy.unique(references):
                self.check_faces(boxes, names[f"triangles {reference}"], mesh.points, triangles.data[references == reference])


class Vtk(MaterialTest):
    def check(self, boxes, points, cells, labels):
        self.check_points(boxes, points)
        self.assertEqual(len(cells), len(labels))
        for name, label in boxes.labels.items():
            self.check_volume(boxes, name, points, cells[labels == label])

    @unittest.skipIf(vtk_hdf is None or vtk_xml is None, "there is no VTK on this machine")
    def test_vtk_finds_materials_and_their_names(self):
        for boxes, name in itertools.product(CASES, ("a.vtu", "a.vtkhdf")):
            reader = vtk_xml.vtkXMLUnstructuredGridReader() if name == "a.vtu" else vtk_hdf.vtkHDFReader()
            reader.SetFileName(str(self.written(name, boxes, "empty")))
            reader.Update()
            grid = reader.GetOutput()
            array = vtk_numpy.vtk_to_numpy
            self.assertEqual(set(array(grid.GetCellTypesArray())), {10 if boxes.order == 1 else 24})
            self.assertEqual((grid.GetPointData().GetNumberOfArrays(), grid.GetCellData().GetNumberOfArrays()), (0, 1))
            labels = array(grid.GetCellData().GetArray("material"))
            self.assertEqual(labels.dtype, "int32")
            cells = array(grid.GetCells().GetConnectivityArray()).reshape(len(labels), -1)
            self.check(boxes, array(grid.GetPoints().GetData()), cells, labels)
            fields = grid.GetFieldData()
            found = {key: [fields.GetAbstractArray(key).GetVariantValue(i).ToString() for i in range(fields.GetAbstractArray(key).GetNumberOfValues())]
                     for key in ("material_names", "material_labels", "unit")}
            self.assertEqual(dict(zip(found["material_names"], map(int, found["material_labels"]))),
                             dict(boxes.labels, nothing=10 * (len(boxes.names) + 1)))
            self.assertEqual(found["unit"], ["mm"])

    @unittest.skipIf(meshio is None or h5py is None, "there is no meshio on this machine")
    def test_meshio_finds_materials_and_their_names_in_xdmf(self):
        """It does not read texts in .vtu files."""
        for boxes in CASES:
            mesh = meshio.read(self.written("a.xdmf", boxes))
            self.assertEqual([block.type for block in mesh.cells], ["tetra" if boxes.order == 1 else "tetra10"])
            self.check(boxes, mesh.points, mesh.cells[0].data, numpy.ravel(mesh.cell_data["material"][0]))
            self.assertEqual({key: value.tolist() for key, value in mesh.field_data.items()},
                             {key: [label, 3] for key, label in boxes.labels.items()})

    @unittest.skipIf(gmshio is None, "there is no dolfinx on this machine")
    def test_fenics_reads_xdmf(self):
        for boxes in ORDERS:
            with XDMFFile(MPI.COMM_WORLD, str(self.written("a.xdmf", boxes)), "r") as file:
                mesh = file.read_mesh(name="mesh")
                tags = file.read_meshtags(mesh, name="mesh")
            self.check_points(boxes, mesh.geometry.x)
            for name, label in boxes.labels.items():
                self.assertEqual((tags.values == label).sum(), boxes.cell_counts[name])

    @unittest.skipIf(h5py is None, "there is no h5py on this machine")
    def test_xdmf_says_where_each_array_is(self):
        """By its own rules: the text has the path, the shape and the type of each data set."""
        for boxes in CASES:
            root = ElementTree.parse(self.written("a.xdmf", boxes)).getroot()
            for item in root.iter("DataItem"):
                file, _, path = item.text.partition(":")
                self.assertEqual(file, "a.h5")
                with h5py.File(self.folder / file) as numbers:
                    dataset = numbers[path]
                    self.assertEqual(list(dataset.shape), [int(n) for n in item.get("Dimensions").split()])
                    kind = {"Int": "i", "Float": "f", "UInt": "u"}[item.get("NumberType")]
                    self.assertEqual(dataset.dtype.str, f"<{kind}{item.get('Precision')}")
            self.assertEqual(root.find(".//Topology").get("TopologyType"), "Tetrahedron" if boxes.order == 1 else "Tetrahedron_10")
            # Without it, VTK's reader ends the program.
            self.assertIsNotNone(root.find(".//Information").get("Value"))


class Febio(MaterialTest):
    def test_the_file_is_what_version_4_of_the_format_says(self):
        for boxes in CASES:
            root = ElementTree.parse(self.written("a.feb", boxes, "empty")).getroot()
            self.assertEqual((root.tag, root.get("version")), ("febio_spec", "4.0"))
            self.assertEqual([part.tag for part in root], ["Module", "Material", "Mesh", "MeshDomains"])
            self.assertEqual(root.find("Module").get("type"), "solid")
            materials = root.findall("Material/material")
            self.assertEqual([(m.get("id"), m.get("name"), m.get("type")) for m in materials],
                             [(str(i + 1), name, "neo-Hookean") for i, name in enumerate(boxes.names)])
            for material in materials:
                self.assertEqual([value.tag for value in material], ["density", "E", "v"])
            self.assertEqual([dict(domain.attrib) for domain in root.findall("MeshDomains/SolidDomain")],
                             [{"name": name, "mat": name} for name in boxes.names])
            mesh = root.find("Mesh")
            # Parts come in this order, and sets refer to what was before them.
            self.assertEqual([tag for tag, _ in itertools.groupby(part.tag for part in mesh)], ["Nodes", "Elements", "Surface", "NodeSet"])
            nodes = mesh.findall("Nodes/node")
            self.assertEqual([int(node.get("id")) for node in nodes], list(range(1, len(nodes) + 1)))
            points = numpy.array([node.text.split(",") for node in nodes], float)
            self.check_points(boxes, points)
            number = 0
            for part in mesh.findall("Elements"):
                self.assertEqual(part.get("type"), "tet4" if boxes.order == 1 else "tet10")
                for element in part:
                    number += 1
                    self.assertEqual((element.tag, element.get("id")), ("elem", str(number)))
                # FETet10::shape_fnc: the nodes 4 to 9 belong to the edges 01, 12, 20, 03, 13, 23.
                self.check_volume(boxes, part.get("name"), points, numpy.array([e.text.split(",") for e in part], int) - 1)
            faces = {}
            for surface in mesh.findall("Surface"):
                self.assertEqual([(f.tag, int(f.get("id"))) for f in surface],
                                 [("tri3" if boxes.order == 1 else "tri6", i + 1) for i in range(len(surface))])
                # FETri6::shape_fnc: the nodes 3 to 5 belong to the edges 01, 12, 20.
                faces[surface.get("name")] = numpy.array([f.text.split(",") for f in surface], int) - 1
            sets = {s.get("name"): numpy.array(s.text.split(","), int) - 1 for s in mesh.findall("NodeSet")}
            self.check_sets(boxes, points, faces, sets)
            text = (self.folder / "a.feb").read_text()
            self.assertIn("<!-- The properties of all materials are placeholders: replace them. -->", text)


class Failures(MaterialTest):
    def names(self):
        return sorted(file.name for file in self.folder.iterdir())

    def test_a_full_disk_leaves_nothing(self):
        """A file may not become larger than so many bytes: within the output, and before it."""
        for name in NAMES:
            self.written(name, ORDERS[1])
            whole = max(file.stat().st_size for file in self.folder.glob("a.*"))
            for file in list(self.folder.glob("a.*")):
                file.unlink()
            for limit in (100, 5000, whole - 1):
                run = self.write(name, ORDERS[1], restore_signals=False,
                                 preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
                self.assertEqual(run.returncode, 74, f"{name} {limit}: {run.stderr}")
                self.assertIn("File too large", run.stderr)
                self.assertEqual(self.names(), [], name)

    def test_an_existing_file_stays(self):
        for name in (*NAMES, "a.h5"):
            (self.folder / name).write_bytes(b"mine")
            run = self.write("a.xdmf" if name == "a.h5" else name, ORDERS[0])
            self.assertEqual(run.returncode, 64)
            self.assertIn(name, run.stderr)
            self.assertEqual((self.folder / name).read_bytes(), b"mine")
            self.assertEqual(self.names(), [name])
            (self.folder / name).unlink()

    @unless_sanitized
    def test_memory_does_not_grow_with_the_mesh(self):
        peaks = {}
        for name, cells in itertools.product(NAMES, ((24, 24, 24), (60, 60, 60))):
            process = subprocess.Popen([WRITER, name, f"cells={','.join(map(str, cells))}", "order=2", "overwrite"],
                                       cwd=self.folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = status
            self.assertEqual(status, 0)
            peaks[name, cells[0]] = usage.ru_maxrss >> 10
        # The largest file has 150 MB and more. The program that makes the mesh has its faces in memory.
        for name in NAMES:
            self.assertLess(peaks[name, 60] - peaks[name, 24], 32, peaks)


if __name__ == "__main__":
    main()
