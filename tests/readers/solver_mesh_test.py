"""Meshes with materials from the command line: solvers compute right stresses on them, other programs find their
materials, and a wrong request is answered by a message that helps.

    solver_mesh_test.py PROGRAM

material_mesh_test.py has the formats alone.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import unittest

from other_readers import PROGRAM, ReaderTest, h5py, main, meshio, numpy, vtk_hdf, vtk_numpy, vtk_xml

CCX = shutil.which("ccx")
if CCX is None:
    print("skipped: there is no ccx on this machine (calculix-ccx)", file=sys.stderr)
NRRD_TYPES = {"uint8": "uint8", "uint16": "uint16", "int16": "int16", "float32": "float"}
# "Three-dimensional solid element library" of Abaqus: the nodes of the faces of tetrahedra.
FACES = {"S1": (0, 1, 2), "S2": (0, 3, 1), "S3": (1, 3, 2), "S4": (2, 3, 0)}
SIDES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


def sphere(counts, spacing, radius):
    """The distance from a sphere in the middle of the volume, negative inside; [z, y, x]."""
    axes = [(numpy.arange(n) - (n - 1) / 2) * s for n, s in zip(counts, spacing)]
    z, y, x = numpy.meshgrid(*axes[::-1], indexing="ij")
    return (numpy.sqrt(x * x + y * y + z * z) - radius).astype(numpy.float32)


class Deck:
    """The nodes, elements, sets and surfaces of an .inp file."""

    def __init__(self, path):
        self.nodes, self.elements, self.node_sets, self.surfaces = None, {}, {}, {}
        for block in re.split(r"^(?=\*\w)", path.read_text(), flags=re.MULTILINE)[1:]:
            head, _, body = block.partition("\n")
            keyword, *settings = head[1:].split(", ")
            settings = dict(setting.split("=") for setting in settings)
            if keyword == "NODE":
                self.nodes = numpy.array(body.replace(",", " ").split(), float).reshape(-1, 4)[:, 1:]
            elif keyword == "ELEMENT":
                width = {"C3D4": 5, "C3D10": 11}[settings["TYPE"]]
                self.elements[settings["ELSET"]] = numpy.array(body.replace(",", " ").split(), int).reshape(-1, width)
            elif keyword == "NSET":
                self.node_sets[settings["NSET"]] = numpy.array(body.replace(",", " ").split(), int)
            elif keyword == "SURFACE":
                self.surfaces[settings["NAME"]] = [line.split(",") for line in body.splitlines()]

    def volumes(self, name):
        a, b, c, d = (self.nodes[self.elements[name][:, i] - 1] for i in range(1, 5))
        return numpy.einsum("ij,ij->i", numpy.cross(b - a, c - a), d - a) / 6

    def area(self, surface):
        """A vector: the sum of the normals of the faces, as long as the faces are large."""
        elements = {row[0]: row[1:5] for rows in self.elements.values() for row in rows.tolist()}
        corners = numpy.array([[elements[int(e)][i] for i in FACES[s.strip()]] for e, s in self.surfaces[surface]]) - 1
        a, b, c = (self.nodes[corners[:, i]] for i in range(3))
        return numpy.cross(c - a, b - a).sum(axis=0) / 2


class Isotropic:
    def __init__(self, young, poisson):
        self.young, self.poisson = young, poisson
        self.bulk, self.shear = young / 3 / (1 - 2 * poisson), young / 2 / (1 + poisson)

    def stress(self, strain):
        return 3 * self.bulk * numpy.trace(strain) / 3 * numpy.eye(3) + 2 * self.shear * (strain - numpy.trace(strain) / 3 * numpy.eye(3))


class Inclusion:
    """A sphere of one material in an infinite matrix of another one, which has a uniform strain far away (Goodier 1933,
    Eshelby 1957). The strain in the sphere is uniform.

    The part of the far strain without change of shape is solved by u = a x inside, and by u = (e + b / r^3) x outside. For
    the rest, E, with q = x . E x, u = k E x inside and

        u = E x (1 + c / r^3 + 2 d / r^5) + q x (f / r^5 - 5 d / r^7)

    outside. The equations of equilibrium lead to f = 3 c / (2 - 4 nu). At r = R, displacements and tractions are continuous."""

    def __init__(self, radius, sphere, matrix, far_strain):
        self.radius = radius
        self.mean = numpy.trace(far_strain) / 3
        self.shape = far_strain - self.mean * numpy.eye(3)
        stiff = 4 * matrix.shear
        self.a = self.mean * (3 * matrix.bulk + stiff) / (3 * sphere.bulk + stiff)
        self.b = (self.a - self.mean) * radius ** 3
        nu = matrix.poisson
        share = 2 * (4 - 5 * nu) / (15 * (1 - nu))
        self.k = 1 / (1 + share * (sphere.shear / matrix.shear - 1))
        self.c = (self.k - 1) * radius ** 3 / (1 + 3 / (5 - 10 * nu))
        self.f = 3 * self.c / (2 - 4 * nu)
        self.d = self.f * radius ** 2 / 5
        self.stress = sphere.stress(self.a * numpy.eye(3) + self.k * self.shape)

    def displacements(self, x):
        r = numpy.maximum(numpy.linalg.norm(x, axis=1), self.radius)[:, None]
        sheared = x @ self.shape
        q = (x * sheared).sum(axis=1)[:, None]
        outside = (self.mean + self.b / r ** 3) * x + sheared * (1 + self.c / r ** 3 + 2 * self.d / r ** 5) + q * x * (self.f / r ** 5 - 5 * self.d / r ** 7)
        is_inside = (x * x).sum(axis=1)[:, None] < self.radius ** 2
        return numpy.where(is_inside, self.a * x + self.k * sheared, outside)


class SolverTest(ReaderTest):
    def put(self, name, samples, spacing=(1, 1, 1), unit="mm", *options):
        """Samples [z, y, x] as NAME.tag; the first one is at 0, 0, 0."""
        unit = f'units: "{unit}" "{unit}" "{unit}"\n' if unit else ""
        header = (f"NRRD0004\ntype: {NRRD_TYPES[samples.dtype.name]}\ndimension: 3\nsizes: {' '.join(map(str, samples.shape[::-1]))}\n"
                  f"spacings: {' '.join(map(repr, map(float, spacing)))}\n{unit}encoding: raw\nendian: little\n\n")
        (self.folder / f"{name}.nrrd").write_bytes(header.encode() + samples.tobytes())
        self.ok("encode", f"{name}.nrrd", "-f", "-q", "-o", f"{name}.tag", *options)
        return f"{name}.tag"

    def mesh(self, volume, output, *options):
        """The JSON settings of a mesh."""
        self.ok("mesh", volume, "-f", "-o", output, "--json", "run.json", *options)
        return json.loads((self.folder / "run.json").read_text())["settings"]

    def solve(self, job, text):
        """The tables in the .dat file of CalculiX: {(words of the title, set): rows}."""
        (self.folder / f"{job}.inp").write_text(text)
        run = subprocess.run([CCX, job], cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             env=dict(os.environ, OMP_NUM_THREADS="1"), timeout=500)
        for wrong in ("*ERROR", "*WARNING"):
            self.assertNotIn(wrong, run.stdout)
        self.assertIn("Job finished", run.stdout)
        parts = re.split(r"\n *(\w[\w ]*?) \([^)]*\) for set (\w+) and time[^\n]*\n", "\n" + (self.folder / f"{job}.dat").read_text())
        return {(title, name.lower()): numpy.array([line.split() for line in text.splitlines() if line.strip()], float)
                for title, name, text in zip(parts[1::3], parts[2::3], parts[3::3])}


def elastic(**materials):
    return "".join(f"*MATERIAL, NAME={name}\n*ELASTIC\n{m.young},{m.poisson}\n*SOLID SECTION, ELSET={name}, MATERIAL={name}\n" for name, m in materials.items())


@unittest.skipIf(CCX is None, "there is no ccx on this machine")
class Stresses(SolverTest):
    RADIUS, SIZE = 32.0, 96.0

    def solved(self, exact, edge, order, materials):
        """A line of the table: the nodes, and errors of displacements and of stresses in the sphere."""
        self.mesh("ball.tag", "ball.inp", "--materials", "ball=:0,matrix=0:", "--size", f"{edge}mm..{2 * edge}mm", "--order", order)
        deck = Deck(self.folder / "ball.inp")
        sides = numpy.unique(numpy.concatenate([deck.node_sets[name] for name in SIDES]))
        return self.errors(exact, materials, deck.nodes - self.SIZE / 2, sides, deck.volumes("ball"))

    def solved_with_voxels(self, exact, edge, materials):
        """The same for cubic elements, each of the material in its middle."""
        count = round(self.SIZE / edge)
        places = numpy.indices((count + 1,) * 3).reshape(3, -1).T
        number = numpy.arange(1, len(places) + 1).reshape((count + 1,) * 3)
        cells = numpy.indices((count,) * 3).reshape(3, -1).T
        corners = numpy.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
        nodes = number[tuple((cells[:, None] + corners).reshape(-1, 3).T)].reshape(-1, 8)
        x = edge * places - self.SIZE / 2
        is_ball = numpy.linalg.norm(edge * (cells + 0.5) - self.SIZE / 2, axis=1) < self.RADIUS
        def rows(numbers):
            return "".join(",".join(map(str, row)) + "\n" for row in numbers)
        elements = numpy.column_stack((numpy.arange(1, len(cells) + 1), nodes))
        (self.folder / "ball.inp").write_text(
            "*NODE\n" + rows(numpy.column_stack((number.ravel().astype(object), x.astype(object))))
            + "".join(f"*ELEMENT, TYPE=C3D8I, ELSET={name}\n{rows(elements[mine])}" for name, mine in (("ball", is_ball), ("matrix", ~is_ball))))
        sides = number.ravel()[(abs(x) == self.SIZE / 2).any(axis=1)]
        return self.errors(exact, materials, x, sides, numpy.ones(is_ball.sum()))

    def errors(self, exact, materials, x, sides, volumes):
        """Solves ball.inp, whose nodes are at x, with the exact displacements at the nodes of the sides."""
        imposed = exact.displacements(x)
        boundary = "".join(f"{i},{d + 1},{d + 1},{imposed[i - 1, d]:.12g}\n" for i in sides for d in range(3))
        found = self.solve("job", f"*INCLUDE, INPUT=ball.inp\n{elastic(**materials)}*NSET, NSET=all, GENERATE\n1,{len(x)}\n*STEP\n*STATIC\n*BOUNDARY\n{boundary}"
                                  "*NODE PRINT, NSET=all\nU\n*EL PRINT, ELSET=ball\nS\n*END STEP\n")
        moved = found["displacements", "all"][:, 1:]
        s = found["stresses", "ball"][:, 2:]
        tensors = s[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
        # Points of an element stand for equal parts of it.
        weights = numpy.repeat(volumes, len(s) // len(volumes))
        # Errors are compared with the largest stress along an axis: the mean stress of a shear is 0.
        wrong = tensors - exact.stress
        mean = abs(numpy.trace(wrong, axis1=1, axis2=2)) / 3 / abs(exact.stress).max()
        whole = numpy.linalg.norm(wrong, axis=(1, 2)) / numpy.linalg.norm(exact.stress)
        def rms(errors):
            return numpy.sqrt((weights * errors ** 2).sum() / weights.sum())
        u = numpy.linalg.norm(moved - imposed) / numpy.linalg.norm(imposed)
        return len(x), u, rms(mean), mean.max(), rms(whole)

    def test_the_stress_in_a_sphere_is_that_of_the_exact_solution(self):
        ball, matrix = Isotropic(10, 0.3), Isotropic(1, 0.3)
        self.put("ball", sphere((49,) * 3, (2,) * 3, self.RADIUS), (2,) * 3)
        uniaxial = numpy.diag([-0.3, -0.3, 1]) * 0.01
        print(f"\n{'load':<12}{'H':>4}{'order':>6}{'nodes':>8}{'u rms':>8}{'mean stress: rms':>18}{'worst':>8}{'tensor: rms':>13}", file=sys.stderr)
        for load, strain in (("hydrostatic", -0.01 * numpy.eye(3)), ("uniaxial", uniaxial)):
            exact = Inclusion(self.RADIUS, ball, matrix, strain)
            for edge, order in ((16, 1), (16, 2), (8, 1), (8, 2)):
                nodes, u, mean, worst, whole = self.solved(exact, edge, order, {"ball": ball, "matrix": matrix})
                self.report(load, edge, order, nodes, u, mean, worst, whole)
                if edge == self.RADIUS / 4:
                    self.assertLess(mean, 0.03, (load, order))
                    self.assertLess(whole, 0.07 if order == 1 else 0.03, (load, order))
                    self.assertLess(u, 0.02, (load, order))
            # Voxels become no better where the materials meet.
            for edge in (16, 8):
                nodes, u, mean, worst, whole = self.solved_with_voxels(exact, edge, {"ball": ball, "matrix": matrix})
                self.report(load, edge, "voxel", nodes, u, mean, worst, whole)
                self.assertGreater(mean, 0.1, load)

    @staticmethod
    def report(load, edge, order, nodes, u, mean, worst, whole):
        print(f"{load:<12}{edge:>4}{order:>6}{nodes:>8}{u:>8.2%}{mean:>18.2%}{worst:>8.1%}{whole:>13.2%}", file=sys.stderr)

    def test_the_exact_solution_is_one(self):
        ball, matrix = Isotropic(10, 0.3), Isotropic(1, 0.25)
        exact = Inclusion(2, ball, matrix, numpy.array([[1, 0.2, 0], [0.2, -0.5, 0.1], [0, 0.1, 0.3]]))
        def stress(x, material, step=1e-4):
            gradient = numpy.array([(exact.displacements(x + step * e) - exact.displacements(x - step * e))[0] / (2 * step) for e in numpy.eye(3)])
            return material.stress((gradient + gradient.T) / 2)
        normal = numpy.array([[0.36, 0.48, 0.8]])
        inside, outside = normal * (2 - 1e-3), normal * (2 + 1e-3)
        numpy.testing.assert_allclose(exact.displacements(inside), exact.displacements(outside), atol=1e-2)
        numpy.testing.assert_allclose(stress(inside, ball) @ normal[0], stress(outside, matrix) @ normal[0], rtol=0.01, atol=0.01)
        numpy.testing.assert_allclose(stress(inside, ball), exact.stress, atol=1e-6)
        at = numpy.array([[2.5, 1.0, -0.7]])
        divergence = sum((stress(at + 0.01 * e, matrix) - stress(at - 0.01 * e, matrix))[i] / 0.02 for i, e in enumerate(numpy.eye(3)))
        numpy.testing.assert_allclose(divergence, 0, atol=1e-3)

    def test_the_reaction_of_a_porous_block_is_the_load_on_its_surface(self):
        z, y, x = numpy.mgrid[:41, :41, :41] * (2 * numpy.pi / 20)
        gyroid = numpy.sin(x) * numpy.cos(y) + numpy.sin(y) * numpy.cos(z) + numpy.sin(z) * numpy.cos(x)
        self.put("bone", (1000 * (0.6 - abs(gyroid))).astype(numpy.int16), (0.5, 0.5, 0.5))
        for order, size in ((1, "1.25mm"), (2, "2mm")):
            made = self.mesh("bone.tag", "bone.inp", "--materials", "bone=0:", "--parts", "largest", "--size", size, "--order", order)
            self.assertEqual([m["parts"] for m in made["materials"]], [1])
            deck = Deck(self.folder / "bone.inp")
            for surface, axis in (("bone_z_max", 2), ("x_max", 0)):
                fixed = "xyz"[axis] + "_min"
                area = deck.area(surface)
                self.assertGreater(area[axis], 40)
                found = self.solve("job", f"*INCLUDE, INPUT=bone.inp\n{elastic(bone=Isotropic(17000, 0.3))}*STEP\n*STATIC\n*BOUNDARY\n{fixed},1,3\n"
                                          f"*DSLOAD\n{surface}, P, 2.5\n*NODE PRINT, NSET={fixed}, TOTALS=ONLY\nRF\n*NODE PRINT, NSET={surface}\nU\n*END STEP\n")
                numpy.testing.assert_allclose(found["total force", fixed][0], 2.5 * area, rtol=1e-4, atol=1e-3)
                self.assertLess(found["displacements", surface][:, 1 + axis].mean(), 0)


class Shapes(SolverTest):
    def test_thick_slices_do_not_spoil_angles(self):
        for ratio in (1, 1.25, 2.5, 4):
            spacing = (1, 1, ratio)
            self.put("ball", sphere((61, 61, round(60 / ratio) + 1), spacing, 22), spacing)
            for size in ("2mm", "4mm..8mm"):
                made = self.mesh("ball.tag", "ball.msh", "--materials", "ball=:0,matrix=0:", "--size", size)
                self.assertGreater(made["smallest_angle"], 17, (ratio, size))
                self.assertLess(made["largest_angle"], 153, (ratio, size))

    def test_volumes_fill_the_box_and_the_sphere_has_its_volume_and_area(self):
        radius = 24
        self.put("ball", sphere((65,) * 3, (1,) * 3, radius))
        for options in ((), ("--angles", "15"), ("--order", 2)):
            made = self.mesh("ball.tag", "ball.inp", "--materials", "ball=:0,matrix=0:", "--size", radius / 8, *options)
            # The last incomplete cube is not meshed: 64 = 21 x 3 + 1.
            ball, matrix = made["materials"]
            self.assertAlmostEqual(ball["volume"] + matrix["volume"], 63 ** 3, delta=1)
            self.assertLess(abs(ball["volume"] / (4 / 3 * numpy.pi * radius ** 3) - 1), 0.02, options)
            self.assertLess(abs(ball["area"] / (4 * numpy.pi * radius ** 2) - 1), 0.02, options)
            self.assertEqual((ball["parts"], matrix["parts"], ball["touching_edges"]), (1, 1, 0))
            deck = Deck(self.folder / "ball.inp")
            for material in (ball, matrix):
                volumes = deck.volumes(material["name"])
                self.assertGreater(volumes.min(), 0)
                self.assertEqual(len(volumes), material["tetrahedra"])
                self.assertAlmostEqual(volumes.sum(), material["volume"], delta=1)
            numpy.testing.assert_allclose(deck.area("ball_surface"), 0, atol=1e-3)

    def test_the_quality_that_is_printed_is_that_in_json(self):
        self.put("ball", sphere((33,) * 3, (1,) * 3, 12))
        printed = self.ok("mesh", "ball.tag", "-f", "-o", "ball.msh", "--materials", "ball=:0,matrix=0:", "--quality", "--json", "run.json").stderr
        made = json.loads((self.folder / "run.json").read_text())["settings"]
        for m in made["materials"]:
            self.assertRegex(printed, rf"{m['name']} +{m['tetrahedra']} +{m['volume']:.6g} +{m['area']:.6g} +1 +0\n")
        self.assertIn(f"angles are between {made['smallest_angle']:.1f} and {made['largest_angle']:.1f} degrees", printed)
        for angles in ("smallest_angles", "largest_angles"):
            self.assertEqual(sum(made[angles]), made["tetrahedra"])


class OtherPrograms(SolverTest):
    """The same mesh in every format: names, counts and volumes survive."""

    def setUp(self):
        super().setUp()
        self.put("ball", sphere((33,) * 3, (0.5,) * 3, 5) * 10, (0.5,) * 3)
        self.options = ("--materials", "core=:-20,shell=-20:0,matrix=0:", "--keep", "core,shell", "--size", "1mm..4mm")

    def made(self, name, *options):
        made = self.mesh("ball.tag", name, *self.options, *options)
        self.count = {m["name"]: m["tetrahedra"] for m in made["materials"]}
        self.assertEqual(list(self.count), ["core", "shell"])
        self.assertEqual({s["name"] for s in made["surfaces"]}, {"core_shell", "shell_matrix"})
        self.volume = {m["name"]: m["volume"] for m in made["materials"]}
        return made

    @unittest.skipIf(shutil.which("gmsh") is None, "there is no gmsh on this machine")
    def test_gmsh_finds_nothing_wrong(self):
        for order in (1, 2):
            self.made("ball.msh", "--order", order)
            run = subprocess.run(["gmsh", "-check", "ball.msh"], cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            self.assertEqual(run.returncode, 0, run.stdout)
            self.assertNotRegex(run.stdout, "Warning|Error")

    @unittest.skipIf(meshio is None, "there is no meshio on this machine")
    def test_meshio_reads_points_cells_and_sets(self):
        for name in ("ball.msh", "ball.inp", "ball.mesh"):
            made = self.made(name)
            found = meshio.read(self.folder / name)
            self.assertEqual(len(found.points), made["points"])
            tetrahedra = numpy.concatenate([block.data for block in found.cells if block.type == "tetra"])
            self.assertEqual(len(tetrahedra), made["tetrahedra"])
            a, b, c, d = (found.points[tetrahedra[:, i]] for i in range(4))
            volumes = numpy.einsum("ij,ij->i", numpy.cross(b - a, c - a), d - a) / 6
            self.assertGreater(volumes.min(), 0)
            self.assertAlmostEqual(volumes.sum() / sum(self.volume.values()), 1, places=6)
            if name == "ball.msh":
                self.assertTrue({"core", "shell", "core_shell", "shell_matrix"} <= set(found.field_data), found.field_data)
            elif name == "ball.inp":
                self.assertEqual({k: sum(len(b) for b in sets) for k, sets in found.cell_sets.items()}, self.count)
                self.assertTrue({"core_shell", "shell_matrix"} <= set(found.point_sets), found.point_sets)

    @unittest.skipIf(vtk_xml is None or vtk_hdf is None, "there is no VTK on this machine")
    def test_vtk_reads_materials_and_their_names(self):
        for name, reader in (("ball.vtu", vtk_xml.vtkXMLUnstructuredGridReader()), ("ball.vtkhdf", vtk_hdf.vtkHDFReader())):
            made = self.made(name)
            reader.SetFileName(str(self.folder / name))
            reader.Update()
            grid = reader.GetOutput()
            self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (made["points"], made["tetrahedra"]))
            fields = grid.GetFieldData()
            names = fields.GetAbstractArray("material_names")
            labels = vtk_numpy.vtk_to_numpy(fields.GetArray("material_labels")).tolist()
            self.assertEqual([names.GetValue(i) for i in range(names.GetNumberOfValues())], ["core", "shell"])
            self.assertEqual(fields.GetAbstractArray("unit").GetValue(0), "mm")
            found = vtk_numpy.vtk_to_numpy(grid.GetCellData().GetArray("material")).tolist()
            self.assertEqual({name: found.count(label) for name, label in zip(("core", "shell"), labels)}, self.count)

    @unittest.skipIf(h5py is None or meshio is None, "there is no h5py or meshio on this machine")
    def test_meshio_reads_xdmf(self):
        made = self.made("ball.xdmf")
        found = meshio.read(self.folder / "ball.xdmf")
        self.assertEqual((len(found.points), [len(b.data) for b in found.cells]), (made["points"], [made["tetrahedra"]]))
        self.assertEqual(sorted(found.cell_data["material"][0].tolist().count(label) for label in set(found.cell_data["material"][0].tolist())),
                         sorted(self.count.values()))

    def test_febio_files_name_materials_and_surfaces(self):
        self.made("ball.feb")
        text = (self.folder / "ball.feb").read_text()
        for name in ("core", "shell"):
            self.assertRegex(text, rf'<Elements [^>]*name="{name}"')
            self.assertEqual(text.count("<elem "), sum(self.count.values()))
        self.assertIn('<Surface name="core_shell"', text)


class Labels(SolverTest):
    """A ball of label 2 in one of label 7, in label 0, which is not meshed."""

    def setUp(self):
        super().setUp()
        distance = sphere((25,) * 3, (1,) * 3, 10)
        self.labels = (7 * (distance < 0) - 5 * (distance < -5)).astype(numpy.uint8)
        self.put("labels", self.labels)

    def counts(self, *options):
        return {m["name"]: m["tetrahedra"] for m in self.mesh("labels.tag", "a.inp", *options)["materials"]}

    def test_names_come_from_every_kind_of_table(self):
        tables = {
            "slicer.ctbl": "# Color table file /x/GenericColors.ctbl\n# 3 values\n0 Background 0 0 0 0\n2 cancellous_bone 216 101 79 255\n7 cortical-bone 221 130 101 255\n",
            "itksnap.txt": '################################################\n# ITK-SnAP Label Description File\n# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n################################################\n'
                           '    0     0    0    0        0  0  0    "Clear Label"\n    2   255    0    0        1  1  1    "cancellous bone"\n    7     0  255    0        1  1  1    "cortical bone"\n',
            "names.csv": "label,name\r\n0,air\r\n2,cancellous bone\r\n7,cortical bone\r\n",
            "names.tsv": "2\tcancellous bone\n7\tcortical bone\n",
        }
        expected = self.counts("--labels", "2=cancellous_bone,7=cortical_bone")
        self.assertEqual(list(expected), ["cancellous_bone", "cortical_bone"])
        self.assertGreater(min(expected.values()), 100)
        words = "# Slicer\n0 Background 0 0 0 0\n2 cancellous bone 216 101 79 255\n7 cortical bone 221 130 101 255\n"
        tables["words.ctbl"] = words
        for name, text in tables.items():
            (self.folder / name).write_text(text)
            self.assertEqual(self.counts("--labels", name, "--keep", "cancellous_bone,cortical_bone"), expected, name)
        self.assertEqual(sorted(self.counts("--labels", "all").values()), sorted(expected.values()))
        self.assertEqual(self.counts("--labels", "2=core"), {"core": expected["cancellous_bone"]})

    def test_smoothed_labels_have_smooth_interfaces(self):
        exact = 4 * numpy.pi * 100
        areas = {w: next(m["area"] for m in self.mesh("labels.tag", "a.inp", "--labels", "2=core,7=ring", "--keep", "ring", "--smooth", w)["materials"])
                 for w in (0, 1, 2)}
        inner = 4 * numpy.pi * 25
        self.assertLess(abs(areas[1] / (exact + inner) - 1), 0.05, areas)
        self.assertGreater(areas[0], areas[1])

    def test_labels_may_be_those_of_another_volume(self):
        expected = self.counts("--labels", "2=core,7=ring")
        first = (self.folder / "a.inp").read_bytes()
        self.put("scan", numpy.arange(25 ** 3, dtype=numpy.float32).reshape((25,) * 3))
        made = self.mesh("scan.tag", "a.inp", "--labels", "2=core,7=ring", "--label-volume", "labels.tag")
        self.assertEqual({m["name"]: m["tetrahedra"] for m in made["materials"]}, expected)
        self.assertEqual((self.folder / "a.inp").read_bytes(), first)
        self.put("small", self.labels[1:])
        run = self.tagrid("mesh", "scan.tag", "-f", "-o", "a.inp", "--label-volume", "small.tag")
        self.assertEqual(run.returncode, 64)
        self.assertIn("25 x 25 x 24", run.stderr)

    def test_parts_can_be_left_out(self):
        specks = self.labels.copy()
        specks[1:4, 1:4, 1:4] = 2
        self.put("labels", specks)
        self.assertEqual([m["parts"] for m in self.mesh("labels.tag", "a.inp", "--labels", "2=core,7=ring", "--size", "1")["materials"]], [2, 1])
        for parts in ("largest", "100"):
            made = self.mesh("labels.tag", "a.inp", "--labels", "2=core,7=ring", "--size", "1", "--parts", parts)
            self.assertEqual([m["parts"] for m in made["materials"]], [1, 1])
            self.assertEqual([m["removed_parts"] for m in made["materials"]], [1, 0])
        run = self.tagrid("mesh", "labels.tag", "-f", "-o", "a.inp", "--labels", "2=core,7=ring", "--size", "1", "--parts", "100")
        self.assertRegex(run.stderr, r"^tagrid: a.inp: left out 1 part of core \(\d+ of \d+ tetrahedra\)\n$")
        run = self.tagrid("mesh", "labels.tag", "-f", "-o", "a.inp", "--labels", "2=core,7=ring", "--parts", "1000")
        self.assertIn("warning: no part of core is large enough\n", run.stderr)


class Determinism(SolverTest):
    def setUp(self):
        super().setUp()
        random = numpy.random.default_rng(3)
        noise = random.standard_normal((70, 75, 80))
        for axis in range(3):
            noise = noise + numpy.roll(noise, 1, axis) + numpy.roll(noise, 2, axis)
        self.samples = noise.astype(numpy.float32)
        self.put("noise", self.samples, (1, 1, 1.5))
        self.options = ("--materials", "a=:-1,b=-1:2,c=2:", "--keep", "a,c", "--size", "2..8")

    def bytes_of(self, volume, *options):
        self.mesh(volume, "a.inp", *self.options, *options)
        return (self.folder / "a.inp").read_bytes()

    def test_threads_and_bricks_do_not_change_a_byte(self):
        expected = self.bytes_of("noise.tag", "-T", 1)
        self.assertGreater(len(expected), 1_000_000)
        for threads in (2, 8):
            self.assertEqual(self.bytes_of("noise.tag", "-T", threads), expected, threads)
        for brick in (1, 4):
            self.put("other", self.samples, (1, 1, 1.5), "mm", "--brick", brick)
            self.assertEqual(self.bytes_of("other.tag"), expected, brick)
        self.assertEqual(self.bytes_of("noise.tag", "-M", "280M"), expected)

    def test_a_region_is_part_of_the_whole(self):
        def tetrahedra(*options):
            self.mesh("noise.tag", "a.inp", *self.options, *options)
            deck = Deck(self.folder / "a.inp")
            return {(name, deck.nodes[row[1:] - 1].tobytes()) for name, rows in deck.elements.items() for row in rows}
        whole, part = tetrahedra(), tetrahedra("--region", "20:40,10:50,:")
        self.assertGreater(len(part), 1000)
        self.assertLess(len(part), len(whole) / 2)
        self.assertEqual(part - whole, set())


class WrongInput(SolverTest):
    """Each mistake has an exit code and a message with what to do."""

    def setUp(self):
        super().setUp()
        distance = sphere((20,) * 3, (1,) * 3, 6)
        self.put("scan", distance)
        self.put("bare", distance, unit="")
        labels = (distance < 0).astype(numpy.uint8)
        self.put("labels", labels)
        self.put("lossy", labels, (1, 1, 1), "mm", "--max-error", 1)
        self.put("negative", labels.astype(numpy.int16) - 1)

    def fails(self, code, says, *arguments, output="a.inp"):
        run = self.tagrid("mesh", *arguments, "-o", output)
        self.assertEqual(run.returncode, code, (arguments, run.stderr))
        self.assertRegex(run.stderr, says, arguments)
        self.assertEqual(run.stderr.count("\n"), 1, run.stderr)
        self.assertFalse((self.folder / output).exists())

    def test_sizes(self):
        two = ("scan.tag", "--materials", "in=:0,out=0:", "--size")
        self.fails(64, "'furlong' is not a unit of length, such as mm or um", *two, "1furlong")
        self.fails(64, "'abc' is not a length, such as 0.5mm", *two, "abc")
        self.fails(64, "must be greater than 0", *two, "0")
        self.fails(64, "must not be less than the finest", *two, "4..2")
        self.fails(64, "1e-09 is too fine: samples are 1 mm apart, and cubes must have at least 1/16 of that", *two, "1e-9")
        self.fails(64, "too fine", *two, "0.001mm")
        self.fails(64, "19 mm thick along x.*choose a smaller size", *two, "50mm")
        self.fails(64, "does not state its unit of length; give sizes without 'mm'", "bare.tag", *two[1:], "1mm")

    def test_the_second_file_of_a_format_is_not_the_input(self):
        for arguments in (("scan.h5", "--materials", "in=:0,out=0:"), ("scan.tag", "--labels", "all", "--label-volume", "scan.h5")):
            (self.folder / "scan.h5").write_bytes((self.folder / "labels.tag").read_bytes())
            before = (self.folder / "scan.h5").read_bytes()
            self.fails(64, "is the input itself", *arguments, "-f", output="scan.xdmf")
            self.assertEqual((self.folder / "scan.h5").read_bytes(), before)

    def test_lists_of_names(self):
        (self.folder / "bom.csv").write_bytes(b"\xef\xbb\xbf1,bone\n0,air\n")
        run = self.tagrid("mesh", "labels.tag", "--labels", "bom.csv", "-o", "a.inp", "--json", "a.json")
        self.assertEqual(run.returncode, 0, run.stderr)
        # The background is not meshed.
        report = json.loads((self.folder / "a.json").read_text())
        self.assertEqual([m["name"] for m in report["settings"]["materials"]], ["bone"])

    def test_names_and_ranges(self):
        for code, says, materials in (
                (64, "'骨' is not a name", "骨=:0"), (64, "is not NAME=LOW:HIGH", "=:0"), (64, "two are called 'soft_tissue'", "soft tissue=:0,soft_tissue=0:"),
                (64, "NAME=LOW:HIGH, such as", "bone"), (64, "'x' is not a number", "a=x:3"), (64, "no values from 1 to 0", "a=1:0"),
                (64, "all values are of one material", "a=:"), (64, "b begins at 2, but another one ends at 3", "a=:3,b=2:"), (64, "two are called", "a=:0,A=0:")):
            self.fails(code, says, "scan.tag", "--materials", materials)
        self.fails(64, "no material is called 'bone'.*in, out", "scan.tag", "--materials", "in=:0,out=0:", "--keep", "bone")

    def test_names_become_those_of_sets(self):
        self.ok("mesh", "scan.tag", "--materials", "soft tissue=:0,2nd=0:", "--keep", "Soft tissue", "-o", "a.inp")
        elements = re.findall("ELSET=(.*)", (self.folder / "a.inp").read_text())
        self.assertEqual(elements, ["soft_tissue"])

    def test_a_material_without_values_is_reported_with_the_values_that_there_are(self):
        run = self.ok("mesh", "scan.tag", "--materials", "in=:0,bone=300:", "-o", "a.inp")
        self.assertRegex(run.stderr, "warning: no tetrahedron is of bone; values are from -[0-9.]+ to 10[0-9.]+\n")
        run = self.ok("mesh", "scan.tag", "--materials", "out=0:,in=:-5", "--size", "4", "-o", "c.inp")
        self.assertIn("warning: no tetrahedron is of in: no sample is of it, or it is thinner than the cubes, whose edge is 4 mm\n", run.stderr)
        run = self.ok("mesh", "labels.tag", "--labels", "1=ball,9=bone", "-o", "b.inp")
        self.assertIn("warning: no tetrahedron is of bone; labels are from 0 to 1\n", run.stderr)

    def test_a_mesh_of_nothing_is_an_error(self):
        self.fails(64, "would be empty: no tetrahedron is of bone; values are from", "scan.tag", "--materials", "bone=300:")
        self.fails(64, "would be empty: no part of in is large enough; no part of out", "scan.tag", "--materials", "in=:0,out=0:", "--parts", "1e9")
        self.fails(64, "no tetrahedron is of a label that is not 0", "labels.tag", "--labels", "all", "--parts", "1e9")
        # Of a region, it is not.
        self.ok("mesh", "scan.tag", "--materials", "in=:0", "--region", "0:3,0:3,0:3", "-o", "region.inp")
        self.put("slice", numpy.zeros((1, 9, 9), numpy.uint8))
        self.fails(64, "has one sample along z; a mesh needs a volume", "slice.tag", "--labels", "0=all")

    def test_formats_that_cannot_hold_it(self):
        self.fails(64, "STL files hold surfaces.*must end in .*inp", "scan.tag", "--materials", "in=:0", output="a.stl")
        self.fails(64, "must end in .*inp", "scan.tag", "--materials", "in=:0", output="a.xyz")
        self.fails(64, "holds meshes with materials; give --materials or --labels", "scan.tag")
        self.fails(64, "--size: applies only to materials; give --materials or --labels", "scan.tag", "--size", "2", output="a.vtu")

    def test_samples_that_are_no_labels(self):
        self.fails(64, "may be wrong by 1.*without a loss", "lossy.tag", "--labels", "all")
        self.fails(64, "labels must be integers, but its samples are float32", "scan.tag", "--labels", "all")
        self.fails(64, "from 0 to 65535, but its samples are from -1 to 0", "negative.tag", "--labels", "all")
        self.fails(64, "with --labels; samples are values or labels", "labels.tag", "--labels", "all", "--materials", "a=:0")
        self.fails(64, "with --label-volume; samples are", "scan.tag", "--label-volume", "labels.tag", "--materials", "a=:0")
        self.fails(64, "at most 38 letters", "labels.tag", "--labels", "1=" + 39 * "a")
        self.fails(64, "label 1 has two names", "labels.tag", "--labels", "1=a,1=b")
        self.fails(64, "not LABEL=NAME, such as 1=bone", "labels.tag", "--labels", "x=a")
        self.fails(64, "does not begin with the number of a label", "labels.tag", "--labels", "scan.nrrd")
        self.fails(74, "nothing.csv: cannot open", "labels.tag", "--labels", "nothing.csv")
        self.fails(74, "nothing.tag: cannot open", "labels.tag", "--label-volume", "nothing.tag")
        self.fails(74, "nothing.tag: cannot open", "nothing.tag", "--labels", "all")

    def test_other_options(self):
        two = ("scan.tag", "--materials", "in=:0,out=0:")
        self.fails(64, "1 or 2", *two, "--order", "3")
        self.fails(64, "9 or 15", *two, "--angles", "12")
        self.fails(64, "'some' is neither largest nor a volume", *two, "--parts", "some")
        self.fails(64, "only to labels", *two, "--smooth", "1")
        self.fails(64, "from 0.5 to 4", "labels.tag", "--labels", "all", "--smooth", "9")
        self.fails(64, "adaptive grid", *two, "--level", "3")

    def test_input_that_cannot_be_read(self):
        with open(self.folder / "scan.tag", "rb") as file:
            run = subprocess.run([PROGRAM, "mesh", "-", "--materials", "in=:0", "-o", "standard_input.msh"], cwd=self.folder, text=True, stdin=file, stderr=subprocess.PIPE)
        self.assertEqual(run.returncode, 0, run.stderr)
        run = subprocess.run(f"cat scan.tag | {PROGRAM} mesh - --materials in=:0 -o a.inp", shell=True, cwd=self.folder, text=True, stderr=subprocess.PIPE)
        self.assertEqual(run.returncode, 64)
        self.assertRegex(run.stderr, "write it to a file first")
        self.fails(65, "not a .tag file, but an NRRD volume; encode it first", "scan.nrrd", "--materials", "in=:0")
        whole = (self.folder / "scan.tag").read_bytes()
        damaged = bytearray(whole)
        damaged[len(whole) // 2] ^= 0x55
        (self.folder / "damaged.tag").write_bytes(damaged)
        self.fails(65, "checksum mismatch", "damaged.tag", "--materials", "in=:0")
        (self.folder / "short.tag").write_bytes(whole[:len(whole) // 2])
        self.fails(65, "short.tag", "short.tag", "--materials", "in=:0")
        self.assertEqual([p.name for p in self.folder.glob("*.inp*")], [])


if __name__ == "__main__":
    main()
