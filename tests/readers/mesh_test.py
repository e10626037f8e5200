"""Meshes that mesh writes: VTK, Gmsh, meshio and h5py find the same points, tetrahedra and data in all of them."""

import itertools
import json
import os
import resource
import signal
import subprocess
import time
import unittest

from hdf5_files import MIRRORED, OBLIQUE, Hdf5Test, placed
from other_readers import IS_SANITIZED, PROGRAM, ReaderTest, gmsh, h5py, main, meshio, numpy, vtk_hdf

DIAGONAL = ((0.5, 0, 0), (0, 0.25, 0), (0, 0, 3))
ARRAYS = ("points", "connectivity", "offsets", "types", "value", "level", "type")


class MeshTest(Hdf5Test):
    def mesh(self, name, *options):
        run = self.tagrid("mesh", "a.tag", "-f", "-o", name, *options)
        self.assertEqual((run.returncode, run.stderr), (0, ""), name)

    def arrays(self, name):
        """Those of ARRAYS, as VTK reads them."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

        reader = vtkXMLUnstructuredGridReader() if name.endswith(".vtu") else vtk_hdf.vtkHDFReader()
        self.assertTrue(reader.CanReadFile(str(self.folder / name)))
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        grid = reader.GetOutput()
        self.assertEqual((grid.GetClassName(), grid.GetPointData().GetNumberOfArrays(), grid.GetCellData().GetNumberOfArrays()), ("vtkUnstructuredGrid", 1, 2))
        found = (grid.GetPoints().GetData(), grid.GetCells().GetConnectivityArray(), grid.GetCells().GetOffsetsArray(), grid.GetCellTypesArray(),
                 grid.GetPointData().GetArray("value"), grid.GetCellData().GetArray("level"), grid.GetCellData().GetArray("type"))
        self.assertEqual(grid.GetNumberOfCells(), found[5].GetNumberOfTuples())
        return dict(zip(ARRAYS, map(vtk_to_numpy, found)))

    def volume(self, directions):
        return abs(numpy.linalg.det(numpy.array(directions))) * 22 * 18 * 4


SPACES = (("left-posterior-superior", "LPS"), ("RAS", "RAS"), ("scanner-xyz", "scanner-xyz"), ("", None))


@unittest.skipIf(vtk_hdf is None or h5py is None, "there is no VTK on this machine")
class WhatValuesAndCoordinatesAre(MeshTest):
    """Meshes have the stored samples, and the rescaled values beside them; all files say their space where they can."""

    def grid(self, name):
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

        reader = {"vtu": vtkXMLUnstructuredGridReader, "vtp": vtkXMLPolyDataReader, "vtkhdf": vtk_hdf.vtkHDFReader}[name.split(".")[1]]()
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        return reader.GetOutput()

    def field(self, name, key):
        array = self.grid(name).GetFieldData().GetAbstractArray(key)
        return array and array.GetVariantValue(0).ToString()

    def test_axes_of_different_units_become_ones_of_the_first_unit(self):
        self.encode(fields='spacings: 0.5 0.25 3000\nunits: "mm" "mm" "um"\n')
        self.mesh("b.vtu")
        self.assertEqual(self.arrays("b.vtu")["points"].max(axis=0).tolist(), [22 * 0.5, 18 * 0.25, 4 * 3])
        self.assertIn("in mm", self.tagrid("mesh", "a.tag", "-o", "b.vtu", "-f", "-v").stderr)
        self.encode(fields='spacings: 0.5 0.25 3\nunits: "mm" "mm" "s"\n')
        self.assertIn('axes have different units ("mm", "mm", "s")', self.tagrid("mesh", "a.tag", "-o", "b.vtu", "-f").stderr)

    def test_values_are_samples_and_rescaled_ones(self):
        from vtkmodules.util.numpy_support import vtk_to_numpy

        self.encode("int16", fields=placed(DIAGONAL) + "rescale_slope:=2.5\nrescale_intercept:=-1024\nrescale_units:=HU\n")
        for name in ("b.vtu", "b.vtkhdf", "b.msh"):
            run = self.tagrid("mesh", "a.tag", "-f", "-o", name)
            self.assertEqual((run.returncode, run.stderr), (0, f"tagrid: {name}: value is the stored sample; rescaled is 2.5 * value - 1024 (HU)\n"))
        for name in ("b.vtu", "b.vtkhdf"):
            data = self.grid(name).GetPointData()
            value, rescaled = (vtk_to_numpy(data.GetArray(key)) for key in ("value", "rescaled"))
            self.assertEqual((value.dtype, rescaled.dtype), ("int16", "float64"))
            numpy.testing.assert_array_equal(rescaled, 2.5 * value - 1024)
        if meshio:
            data = meshio.read(self.folder / "b.msh").point_data
            numpy.testing.assert_array_equal(data["value"], value)
            numpy.testing.assert_array_equal(data["rescaled"], rescaled)
        self.assertEqual([self.field("b.vtu", key) for key in ("rescale_slope", "rescale_intercept", "rescale_units")], ["2.5", "-1024", "HU"])
        with h5py.File(self.folder / "b.vtkhdf") as file:
            attributes = dict(file["VTKHDF/PointData/value"].attrs)
            self.assertEqual((attributes["rescale_slope"], attributes["rescale_intercept"], attributes["rescale_units"], attributes["space"]),
                             (2.5, -1024, "HU", "LPS"))

    def test_the_space_of_the_coordinates_is_said(self):
        for space, name in SPACES:
            self.encode("uint8", fields=placed(DIAGONAL, space=space))
            for output in ("b.vtu", "b.vtkhdf", "b.msh"):
                self.mesh(output)
            for output in ("b.ply", "b.stl", "b.obj", "b.vtp"):
                self.ok("surface", "a.tag", "--iso", "120.5", "-o", output, "-f")
            self.assertEqual([self.field(file, "SPACE") for file in ("b.vtu", "b.vtp")], [name, name])
            with h5py.File(self.folder / "b.vtkhdf") as file:
                self.assertEqual(file["VTKHDF/PointData/value"].attrs.get("space"), name)
            comment = f"SPACE={name}".encode()
            for output, start in (("b.ply", b"\ncomment "), ("b.stl", b"; "), ("b.obj", b"# "), ("b.msh", b"$Comments\n")):
                beginning = (self.folder / output).read_bytes()[:300]
                self.assertEqual(beginning.find(start + comment) >= 0, name is not None, (output, space))
                self.assertEqual(b"SPACE" in beginning, name is not None, (output, space))
            if meshio:
                for output in ("b.msh", "b.ply", "b.stl", "b.obj"):
                    self.assertGreater(len(meshio.read(self.folder / output).points), 10)
            for command in (("mesh", "-o", "b.vtu"), ("surface", "--iso", "120.5", "-o", "b.ply")):
                said = self.tagrid(command[0], "a.tag", *command[1:], "-f", "-v").stderr
                self.assertIn(f"coordinates: space {space or 'unknown'}, in mm\n", said)

    def test_slopes_of_slices(self):
        self.encode("uint8", fields=placed(DIAGONAL) + "slice_slopes:=1 2 1 -4 1\nslice_intercepts:=0 0 0 0 0\n")
        run = self.ok("mesh", "a.tag", "-f", "-o", "b.vtu", "--coarsen", "80")
        self.assertIn("each slice has its own slope; in the mesh, value is the stored sample, and the largest slope, 4, converts --coarsen", run.stderr)
        expected = self.arrays("b.vtu")
        refused = self.tagrid("surface", "a.tag", "-f", "-o", "b.ply", "--iso", "120.5")
        self.assertEqual(refused.returncode, 64, refused.stderr)
        self.assertIn("with --samples, the level is a stored sample", refused.stderr)
        self.ok("surface", "a.tag", "-f", "-o", "b.ply", "--iso", "120.5", "--samples")
        self.encode("uint8", fields=placed(DIAGONAL))
        self.mesh("b.vtu", "--coarsen", "20")
        for name in ARRAYS:
            self.assertEqual(expected[name].tobytes(), self.arrays("b.vtu")[name].tobytes())


@unittest.skipIf(vtk_hdf is None or h5py is None, "there is no VTK on this machine")
class Vtkhdf(MeshTest):
    def test_vtk_finds_the_mesh_of_the_vtu_file(self):
        cases = [(type, OBLIQUE, ()) for type in ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")]
        cases += [("int16", MIRRORED, ()), ("int16", DIAGONAL, ("--level", "6")), ("uint8", OBLIQUE, ("--padded",)),
                  ("int16", DIAGONAL, ("--region", "3:9,:5,2:3"))]
        for type, directions, options in cases:
            self.encode(type, fields=placed(directions))
            for name in ("b.vtu", "b.vtkhdf", "b.hdf"):
                self.mesh(name, *options)
            expected, found = self.arrays("b.vtu"), self.arrays("b.vtkhdf")
            self.assertGreater(len(expected["level"]), 10)
            for name in ARRAYS:
                self.assertEqual(found[name].dtype, expected[name].dtype, f"{type} {name}")
                self.assertEqual(found[name].shape, expected[name].shape, f"{type} {name}")
                self.assertEqual(found[name].tobytes(), expected[name].tobytes(), f"{type} {name}")
            self.assertEqual((self.folder / "b.hdf").read_bytes(), (self.folder / "b.vtkhdf").read_bytes())

    def test_the_file_is_that_of_version_1_0(self):
        self.encode()
        self.mesh("b.vtkhdf")
        with h5py.File(self.folder / "b.vtkhdf") as file:
            root = file["VTKHDF"]
            self.assertEqual(root.attrs["Version"].tolist(), [1, 0])
            kind = root.attrs.get_id("Type").get_type()
            self.assertEqual((root.attrs["Type"], kind.is_variable_str(), kind.get_cset()), (b"UnstructuredGrid", False, h5py.h5t.CSET_ASCII))
            points, cells = root["NumberOfPoints"][:].tolist(), root["NumberOfCells"][:].tolist()
            self.assertEqual(root["NumberOfConnectivityIds"][:].tolist(), [4 * cells[0]])
            shapes = {"Points": (points[0], 3), "Connectivity": (4 * cells[0],), "Offsets": (cells[0] + 1,), "Types": (cells[0],),
                      "PointData/value": (points[0],), "CellData/level": (cells[0],), "CellData/type": (cells[0],)}
            for name, shape in shapes.items():
                self.assertEqual((root[name].shape, root[name].chunks, root[name].compression), (shape, None, None), name)
                self.assertIsNotNone(root[name].id.get_offset(), name)

    def test_same_bytes_for_pipes_and_threads(self):
        self.encode()
        self.mesh("b.vtkhdf", "-T1")
        for threads in ("2", "5"):
            run = subprocess.run(f"cat a.tag | {PROGRAM} mesh - -T {threads} -f -o c.vtkhdf", shell=True,
                                 cwd=self.folder)
            self.assertEqual(run.returncode, 0)
            self.assertEqual((self.folder / "c.vtkhdf").read_bytes(), (self.folder / "b.vtkhdf").read_bytes())


@unittest.skipIf(gmsh is None or vtk_hdf is None, "there is no Gmsh on this machine")
class Gmsh(MeshTest):
    def setUp(self):
        super().setUp()
        gmsh.initialize(["gmsh", "-v", "1"])
        self.addCleanup(gmsh.finalize)

    def data(self, index):
        kind, tags, numbers, *_ = gmsh.view.getModelData(index, 0)
        self.assertEqual(list(tags), list(range(1, len(tags) + 1)))
        return kind, numpy.ravel(numpy.array(numbers))

    def check(self, type, directions, *options):
        self.encode(type, fields=placed(directions))
        self.mesh("b.vtu", *options)
        self.mesh("b.msh", *options)
        expected = self.arrays("b.vtu")
        gmsh.clear()
        gmsh.open(str(self.folder / "b.msh"))
        tags, places, _ = gmsh.model.mesh.getNodes()
        self.assertEqual(list(tags), list(range(1, len(tags) + 1)))
        self.assertEqual(places.tobytes(), expected["points"].tobytes())
        kinds, elements, nodes = gmsh.model.mesh.getElements()
        self.assertEqual((list(kinds), list(elements[0])), ([4], list(range(1, len(elements[0]) + 1))))
        self.assertEqual((numpy.array(nodes[0], "i8") - 1).tolist(), expected["connectivity"].tolist())
        self.assertEqual(gmsh.model.getPhysicalGroups(), [(3, 1)])
        numpy.testing.assert_allclose(gmsh.model.getBoundingBox(3, 1), [*expected["points"].min(0), *expected["points"].max(0)])
        # By Gmsh's own count, all volumes are positive.
        determinants = gmsh.model.mesh.getJacobians(4, [0.25, 0.25, 0.25])[1]
        self.assertGreater(determinants.min(), 0)
        for index, (kind, name) in enumerate((("NodeData", "value"), ("ElementData", "level"), ("ElementData", "type"))):
            self.assertEqual(gmsh.option.getString(f"View[{index}].Name"), name)
            found = self.data(index)
            self.assertEqual(found[0], kind)
            self.assertEqual(found[1].tolist(), expected[name].astype("f8").tolist(), name)
        return determinants.sum() / 6

    def test_gmsh_finds_the_mesh_of_the_vtu_file(self):
        for type, directions in (("int16", MIRRORED), ("float64", OBLIQUE), ("uint32", DIAGONAL)):
            numpy.testing.assert_allclose(self.check(type, directions), self.volume(directions))
        numpy.testing.assert_allclose(self.check("int16", OBLIQUE, "--level", "5"), self.volume(OBLIQUE))
        self.assertLess(self.check("int16", OBLIQUE, "--region", "3:9,:5,2:3"), self.volume(OBLIQUE))

    @unittest.skipIf(meshio is None, "there is no meshio on this machine")
    def test_meshio_finds_it_too(self):
        self.encode("float32", fields=placed(OBLIQUE))
        self.mesh("b.vtu")
        self.mesh("b.msh")
        expected, found = self.arrays("b.vtu"), meshio.read(self.folder / "b.msh")
        self.assertEqual(found.points.tobytes(), expected["points"].tobytes())
        self.assertEqual([block.type for block in found.cells], ["tetra"])
        self.assertEqual(found.cells[0].data.reshape(-1).tolist(), expected["connectivity"].tolist())
        self.assertEqual(numpy.ravel(found.point_data["value"]).tolist(), expected["value"].astype("f8").tolist())
        for name in ("level", "type"):
            self.assertEqual(numpy.ravel(found.cell_data[name][0]).tolist(), expected[name].tolist())
        self.assertIn("volume", found.cell_sets)


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Failures(MeshTest):
    def names(self):
        return sorted(file.name for file in self.folder.iterdir())

    def test_a_full_disk_leaves_nothing(self):
        """A file may not become larger than so many bytes: within the program's file, and before it."""
        self.encode(shape=(20, 50, 60))
        self.mesh("b.vtkhdf")
        self.mesh("b.msh")
        with h5py.File(self.folder / "b.vtkhdf") as file:
            largest_array = 8 * file["VTKHDF/Connectivity"].size
        for name in ("b.vtkhdf", "b.msh"):
            whole = (self.folder / name).stat().st_size
            (self.folder / name).unlink()
            for limit in (1000, largest_array + 1000, whole - 1):
                run = subprocess.run([PROGRAM, "mesh", "a.tag", "-o", name], cwd=self.folder, stderr=subprocess.PIPE,
                                     text=True,
                                     restore_signals=False, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
                self.assertEqual(run.returncode, 74, f"{name} {limit}: {run.stderr}")
                self.assertIn(name, run.stderr)
                self.assertIn("File too large", run.stderr)
                self.assertFalse((self.folder / name).exists())
            self.assertEqual([n for n in self.names() if n.startswith(".")], [])

    def test_an_existing_file_stays(self):
        self.encode()
        for name in ("b.vtkhdf", "b.hdf", "b.msh"):
            (self.folder / name).write_bytes(b"mine")
            self.assert_refused(64, "already exists", "mesh", "a.tag", "-o", name)
            self.assertEqual((self.folder / name).read_bytes(), b"mine")

    def test_a_missing_program_is_named_before_anything_is_meshed(self):
        self.encode()
        alone = self.folder / "bin"
        alone.mkdir()
        (alone / "tagrid").write_bytes(PROGRAM.read_bytes())
        (alone / "tagrid").chmod(0o755)
        before = self.names()
        run = subprocess.run([alone / "tagrid", "mesh", "a.tag", "-o", "b.vtkhdf"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn("tagrid-write-hdf5, which is not installed", run.stderr)
        self.assertEqual(self.names(), before)
        self.mesh("b.msh")

    def test_signals_leave_nothing_and_nobody(self):
        """The writer is a script that takes forever, so that it is surely there when the signal comes."""
        self.encode()
        (self.folder / "bin").mkdir()
        script = self.folder / "bin" / "tagrid-write-hdf5"
        script.write_text("#!/bin/sh\necho '{\"tagrid-writer\": 1, \"name\": \"slow\"}'\necho $$ > " + str(self.folder / "process") + "\nread -r line\nsleep 1000\n")
        script.chmod(0o755)
        for kind in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            run = subprocess.Popen([PROGRAM, "mesh", "a.tag", "-o", "b.vtkhdf"], cwd=self.folder,
                                   env=dict(os.environ, TAGRID_READER_PATH=str(self.folder / "bin")))
            deadline = time.monotonic() + 60
            while not (self.folder / "process").exists() or not (self.folder / "process").read_text():
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.02)
            writer = int((self.folder / "process").read_text())
            (self.folder / "process").unlink()
            run.send_signal(kind)
            self.assertEqual(run.wait(), -kind)
            self.assertFalse((self.folder / "b.vtkhdf").exists())
            if kind != signal.SIGKILL:
                self.assertEqual([n for n in self.names() if n.startswith(".")], [])
            for _ in range(1000):
                if not self.is_running(writer):
                    break
                time.sleep(0.05)
            self.assertFalse(self.is_running(writer))

    @staticmethod
    def is_running(process):
        try:
            with open(f"/proc/{process}/stat") as file:
                return file.read().rsplit(")", 1)[1].split()[0] != "Z"
        except OSError:
            return False


class Conversation(ReaderTest):
    """What tagrid-write-hdf5 answers to a tagrid that does not keep to docs/dev/readers.md."""

    MESH = {"points": 5, "tetrahedra": 2, "point_data": [{"name": "value", "type": "int16"}], "cell_data": [{"name": "level", "type": "uint8"}]}
    PIECES = (("positions", 0, 5, 120), ("connectivity", 0, 2, 64), ("value", 0, 5, 10), ("level", 0, 2, 2))

    def talk(self, mesh, pieces, finish=True, extra=b"", before=()):
        """Returns the answers after the first, and the largest memory of the program."""
        (self.folder / "a.vtkhdf").write_bytes(b"")
        lines = [json.dumps(line).encode() + b"\n" for line in before]
        if mesh is not None:
            lines.append(json.dumps({"request": "write-mesh", "path": str(self.folder / "a.vtkhdf"), "name": "a.vtkhdf", "mesh": mesh}).encode() + b"\n")
        for name, first, last, size in pieces:
            lines.append(json.dumps({"request": "array", "name": name, "from": first, "to": last}).encode() + b"\n" + bytes(size))
        if finish:
            lines.append(b'{"request": "finish"}\n')
        run = subprocess.run([PROGRAM.parent / "tagrid-write-hdf5"], input=b"".join(lines) + extra,
                             stdout=subprocess.PIPE, timeout=300,
                             preexec_fn=None if IS_SANITIZED
                             else lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30)))
        self.assertEqual(run.returncode, 0)
        return [json.loads(line) for line in run.stdout.decode().splitlines()[1:]]

    def refused(self, text, *arguments, **options):
        answers = self.talk(*arguments, **options)
        self.assertEqual(answers[-1]["answer"], "error", answers)
        self.assertIn(text, answers[-1]["message"])

    def test_the_mesh_is_written(self):
        answers = self.talk(self.MESH, self.PIECES)
        self.assertEqual([answer["answer"] for answer in answers], ["ready", "done"])
        self.assertLess(answers[0]["memory"], 96 << 20)
        # In pieces, and an empty one.
        pieces = [(name, i, i + 1, size // count) for name, _, count, size in self.PIECES for i in range(count)]
        before = (self.folder / "a.vtkhdf").read_bytes()
        self.assertEqual(self.talk(self.MESH, pieces)[-1]["answer"], "done")
        self.assertEqual((self.folder / "a.vtkhdf").read_bytes(), before)
        self.assertEqual(self.talk({"points": 0, "tetrahedra": 0}, ())[-1]["answer"], "done")

    def test_lies_about_sizes_are_refused(self):
        for count in (-1, 1.5, 1 << 60, "5", None, [5]):
            for what in ("points", "tetrahedra"):
                self.refused("", dict(self.MESH, **{what: count}), self.PIECES)
        # So many are possible, but do not come.
        self.refused("next", dict(self.MESH, points=1 << 50), self.PIECES)
        self.refused("ends after 0 of", dict(self.MESH, points=1 << 40, tetrahedra=1 << 40), ())
        for i, (name, first, last, size) in itertools.product(range(4), [self.PIECES[0]]):
            wrong = [(name, first, last + 1, size), (name, 1, last, size), (name, -1, last, size), (name, 3, 3, 0), (name, first, 1 << 62, 0)][i]
            self.refused("are next", self.MESH, [wrong])
        self.refused("at once are more", dict(self.MESH, points=1 << 20), [("positions", 0, 1 << 20, 100)])
        self.refused("ends after 4 of 5", self.MESH, [("positions", 0, 4, 96)])
        self.refused("are next", self.MESH, [("positions", 0, 5, 120), ("value", 0, 5, 10)])
        self.refused("are next", self.MESH, [("../x", 0, 5, 120)])
        self.refused("when the mesh is complete", self.MESH, self.PIECES + (("level", 0, 2, 2),), finish=False)

    def test_the_end_in_the_middle_is_an_error(self):
        self.refused("end within the array", self.MESH, [("positions", 0, 5, 119)], finish=False)
        self.assertEqual([answer["answer"] for answer in self.talk(self.MESH, self.PIECES, finish=False)], ["ready"])

    def test_requests_in_the_wrong_order_or_without_sense(self):
        self.refused("before a mesh", None, self.PIECES)
        self.refused("before a volume", None, ())
        self.refused("before a volume", self.MESH, (), finish=False, extra=b'{"request": "slices", "from": 0, "to": 1}\n')
        self.refused("", self.MESH, (), finish=False, extra=b"\x00\xff not JSON\n")
        self.refused("not as", dict(self.MESH), (), before=[{"request": "write-mesh", "path": "x", "mesh": self.MESH, "options": {"format": "exodus"}}])
        for data in ([{"name": "a/b", "type": "uint8"}], [{"name": "", "type": "uint8"}], [{"name": "positions", "type": "uint8"}],
                     [{"name": "x", "type": "int64"}], [{"type": "uint8"}], [5], "x", [{"name": 5, "type": "uint8"}],
                     [{"name": "x", "type": "uint8"}, {"name": "x", "type": "uint8"}]):
            self.refused("", dict(self.MESH, point_data=data), ())
        (self.folder / "no").mkdir()
        self.refused("", None, (), before=[{"request": "write-mesh", "path": str(self.folder / "no"), "mesh": self.MESH}])

    def test_tetrahedra_of_ten_nodes_and_fields(self):
        ten = self.PIECES[:1] + (("connectivity", 0, 2, 160),) + self.PIECES[2:]
        fields = [{"name": "material_names", "texts": ["bone", "soft"]}, {"name": "material_labels", "numbers": [1, -(1 << 40)]}]
        self.assertEqual(self.talk(dict(self.MESH, nodes=10, fields=fields), ten)[-1]["answer"], "done")
        if h5py is not None:
            with h5py.File(self.folder / "a.vtkhdf") as file:
                mesh = file["VTKHDF"]
                self.assertEqual((mesh["Types"][:].tolist(), mesh["Offsets"][:].tolist(), mesh["Connectivity"].shape), ([24, 24], [0, 10, 20], (20,)))
                self.assertEqual(mesh["FieldData/material_names"].asstr()[:].tolist(), ["bone", "soft"])
                self.assertEqual(mesh["FieldData/material_labels"][:].tolist(), [1, -(1 << 40)])
        self.assertEqual(self.talk(dict(self.MESH, nodes=4), self.PIECES)[-1]["answer"], "done")
        for nodes in (0, 3, 5, 20, -10, "10", None):
            self.refused("4 or 10 nodes", dict(self.MESH, nodes=nodes), ())
        self.refused("end within the array", dict(self.MESH, nodes=10), self.PIECES[:2], finish=False)
        for fields in ([{"name": "a/b", "numbers": [1]}], [{"name": "", "texts": ["x"]}], [{"texts": ["x"]}], [{"name": "x", "texts": [5]}],
                       [{"name": "x", "numbers": ["y"]}], [5], "x", [{"name": "x", "numbers": [1]}] * 2):
            self.refused("", dict(self.MESH, fields=fields), ())

    def test_other_writers_do_not_know_meshes(self):
        writer = PROGRAM.parent / "tagrid-write-vdb"
        if not writer.exists():
            self.skipTest("there is no tagrid-write-vdb")
        run = subprocess.run([writer], input=json.dumps({"request": "write-mesh", "mesh": self.MESH}) + "\n", text=True, stdout=subprocess.PIPE)
        self.assertEqual(json.loads(run.stdout.splitlines()[1]), {"answer": "unknown"})


if __name__ == "__main__":
    main()
