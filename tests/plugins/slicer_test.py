"""The reader of 3D Slicer, without Slicer: places, and what it asks a mock of Slicer to do.

    slicer_test.py PROGRAM

ITK (plastimatch) is the oracle of places if it is installed: it reads the NRRD file from which the .tag file was made.
"""

import contextlib
import io
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import types
import unittest

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "plugins" / "slicer"))


class Matrix:
    def __init__(self):
        self.rows = [[float(i == j) for j in range(4)] for i in range(4)]

    def SetElement(self, row, column, number):
        self.rows[row][column] = number


class Node:
    def __init__(self, content, name):
        self.content, self.name, self.matrix, self.storage = content, name, None, "a file"

    def GetID(self):
        return "vtkMRMLScalarVolumeNode1"

    def SetIJKToRASMatrix(self, matrix):
        self.matrix = matrix.rows

    def SetAndObserveStorageNodeID(self, number):
        self.storage = number


class Slicer(types.ModuleType):
    """What the reader calls of Slicer."""

    def __init__(self):
        super().__init__("slicer")
        self.util = types.ModuleType("slicer.util")
        self.util.loadVolume = self.load
        self.util.addVolumeFromArray = self.add
        self.util.errorDisplay = lambda text: self.errors.append(text)
        self.util.startupEnvironment = lambda: dict(os.environ)
        self.ScriptedLoadableModule = types.ModuleType("slicer.ScriptedLoadableModule")
        self.ScriptedLoadableModule.ScriptedLoadableModule = type("ScriptedLoadableModule", (), {"__init__": lambda self, parent: None})
        self.errors, self.nodes = [], []

    def load(self, path, properties):
        self.nodes.append(Node(pathlib.Path(path).read_bytes(), properties["name"]))
        return self.nodes[-1]


    def add(self, array, ijkToRAS, name):
        self.nodes.append(Node(array, name))
        self.nodes[-1].matrix = ijkToRAS
        return self.nodes[-1]


SLICER = Slicer()
VTK = types.ModuleType("vtk")
VTK.vtkMatrix4x4 = Matrix
sys.modules.update({"slicer": SLICER, "slicer.util": SLICER.util, "slicer.ScriptedLoadableModule": SLICER.ScriptedLoadableModule, "vtk": VTK})
import TagridReader  # noqa: E402

NOTHING = {"spacing": None, "directions": None, "origin": None, "space": None, "units": None}


class Places(unittest.TestCase):
    def place(self, sample, **geometry):
        rows = TagridReader.ijk_to_ras({**NOTHING, **geometry})
        self.assertEqual(rows[3], [0, 0, 0, 1])
        return [sum(a * b for a, b in zip(row, [*sample, 1])) for row in rows[:3]]

    def test_lps_becomes_ras(self):
        turned = {"directions": [[0, 1, 0], [2, 0, 0], [0, 0, 3]], "origin": [10, 20, 30]}
        for space in ("left-posterior-superior", "LPS"):
            self.assertEqual(self.place((1, 2, 3), space=space, **turned), [-14, -21, 39], space)
        for space in ("right-anterior-superior", "RAS", None, "scanner-xyz", "3D-right-handed"):
            self.assertEqual(self.place((1, 2, 3), space=space, **turned), [14, 21, 39], space)
        for space in ("left-anterior-superior", "LAS"):
            self.assertEqual(self.place((1, 2, 3), space=space, **turned), [-14, 21, 39], space)

        self.assertEqual(self.place((1, 2, 3), space="LAI", **turned), [-14, 21, -39])

    def test_what_is_not_given(self):
        self.assertEqual(self.place((1, 2, 3)), [1, 2, 3])
        self.assertEqual(self.place((1, 2, 3), spacing=[2, None, 4]), [2, 2, 12])

    def test_units(self):
        self.assertEqual(self.place((1, 2, 3), spacing=[500, 500, 2], origin=[1000, 0, 0], units=["um", "\u00b5m", "cm"]), [1.5, 1, 60])

    def test_every_unit_that_the_program_knows(self):
        for unit, length in (("angstrom", 1e-7), ("\u00c5", 1e-7), ("inches", 25.4), ("feet", 304.8), ("Micrometres", 1e-3), ("MM", 1),
                             ("km", 1e6), (" mm ", 1), ("yd", 914.4), ("mil", 0.0254)):
            self.assertEqual(self.place((1, 0, 0), spacing=[1, 1, 1], units=[unit] * 3), [length, 0, 0], unit)

    def test_an_unknown_unit_is_said(self):
        for unit in ("parsec", "constructor", "Mm"):
            with contextlib.redirect_stdout(io.StringIO()) as said:
                self.assertEqual(self.place((1, 2, 3), spacing=[1, 1, 1], units=[unit, "mm", "mm"]), [1, 2, 3])
            self.assertIn(unit, said.getvalue())


class Loading(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        os.environ["TAGRID"] = str(PROGRAM)
        SLICER.errors.clear()
        SLICER.nodes.clear()
        self.parent = types.SimpleNamespace()
        self.reader = TagridReader.TagridReaderFileReader(self.parent)

    def written(self, fields):
        nrrd = self.folder / "a.nrrd"
        nrrd.write_bytes(f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n{fields}\n".encode() + bytes(range(24)))
        subprocess.run([PROGRAM, "encode", nrrd, "-o", self.folder / "my scan.tag", "-q", "-f"], check=True)
        return str(self.folder / "my scan.tag")

    FIELDS = "space: right-anterior-superior\nspace directions: (0,1,0) (2,0,0) (0,0,3)\nspace origin: (10,20,30)\n"

    def test_values_place_and_name(self):
        path = self.written(self.FIELDS + "rescale_slope:=1\nrescale_intercept:=-10\n")
        self.assertTrue(self.reader.load({"fileName": path}))
        node, = SLICER.nodes
        self.assertEqual((node.name, node.storage, self.parent.loadedNodes), ("my scan", None, [node.GetID()]))
        self.assertEqual(node.matrix, [[0, 2, 0, 10], [1, 0, 0, 20], [0, 0, 3, 30], [0, 0, 0, 1]])
        self.assertIn(b"\ntype: int16\n", node.content)
        self.assertEqual(node.content[-48:], b"".join((n - 10).to_bytes(2, "little", signed=True) for n in range(24)))
        self.assertTrue(self.reader.load({"fileName": path, "name": "other"}))
        self.assertEqual(SLICER.nodes[1].name, "other")

    @unittest.skipUnless(shutil.which("plastimatch"), "there is no plastimatch")
    def test_itk_has_the_same_place(self):
        """ITK's places are LPS."""
        path = self.written(self.FIELDS)
        self.assertTrue(self.reader.load({"fileName": path}))
        header = subprocess.run(["plastimatch", "header", self.folder / "a.nrrd"], text=True, stdout=subprocess.PIPE, check=True).stdout
        found = {line.partition("=")[0].strip(): line.partition("=")[2].split() for line in header.splitlines() if "=" in line}
        rows = SLICER.nodes[0].matrix
        self.assertEqual([float(number) for number in found["Origin"]], [-rows[0][3], -rows[1][3], rows[2][3]])

    def test_words_of_the_file_are_utf8_in_any_locale(self):
        path = self.written('space dimension: 3\nspace directions: (500,0,0) (0,500,0) (0,0,500)\nspace units: "\u00b5m" "\u00b5m" "\u00b5m"\n')
        code = "import sys; sys.path.insert(0, sys.argv[1]); import types; slicer = types.ModuleType('slicer'); "
        code += "module = types.ModuleType('slicer.ScriptedLoadableModule'); module.ScriptedLoadableModule = object; "
        code += "sys.modules.update({'slicer': slicer, 'slicer.ScriptedLoadableModule': module}); import TagridReader; "
        code += "print(ascii(TagridReader.run('info', sys.argv[2], '--no-levels')))"
        environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
        said = subprocess.run([sys.executable, "-B", "-c", code, str(pathlib.Path(TagridReader.__file__).parent), path], env=environment,
                              stdout=subprocess.PIPE, text=True, check=True).stdout
        self.assertIn("\\xb5m", said)

    def test_without_the_program_the_package_reads_the_same(self):
        try:
            import tagrid_reader  # noqa: F401
        except (ImportError, OSError):
            raise unittest.SkipTest("there is no tagrid_reader") from None
        scale = "rescale_slope:=2\nrescale_intercept:=-10\n"
        um = 'space units: "um" "um" "um"\n'
        for number, fields in enumerate((self.FIELDS + scale, self.FIELDS + um, "", "spacings: 0.5 nan 2\n",
                                         'spacings: 500 500 2000\nunits: "um" "um" "um"\n',
                                         self.FIELDS.replace("right-anterior", "left-posterior"))):
            path = self.written(fields)
            os.environ["TAGRID"] = str(PROGRAM)
            self.assertTrue(self.reader.load({"fileName": path, "name": "a"}), SLICER.errors)
            del os.environ["TAGRID"]
            found, os.environ["PATH"] = os.environ["PATH"], "/nowhere"
            try:
                self.assertTrue(self.reader.load({"fileName": path, "name": "a"}), SLICER.errors)
            finally:
                os.environ["PATH"] = found
            by_program, by_package = SLICER.nodes[-2:]
            self.assertEqual(by_package.matrix, by_program.matrix, fields)
            samples = by_package.content
            self.assertEqual(samples.shape, (4, 3, 2))
            self.assertTrue(by_program.content.endswith(samples.tobytes()), fields)

    def test_errors_are_shown(self):
        (self.folder / "text.tag").write_text("text")
        self.assertFalse(self.reader.load({"fileName": str(self.folder / "text.tag")}))
        self.assertIn("text.tag", SLICER.errors[0])
        path = self.written("")
        os.environ["TAGRID"] = "/nowhere/tagrid"
        self.assertFalse(self.reader.load({"fileName": path}))
        self.assertIn("was not found", SLICER.errors[1])
        self.assertFalse(hasattr(self.parent, "loadedNodes"))

    def test_what_slicer_asks(self):
        self.assertTrue(self.reader.canLoadFile(self.written("")))
        (self.folder / "text.tag").write_text("text")
        for name in ("text.tag", "a.nrrd", "none.tag", "."):
            self.assertFalse(self.reader.canLoadFile(str(self.folder / name)))
        self.assertEqual(self.reader.extensions(), ["tagrid volume (*.tag)"])
        self.assertTrue(self.reader.description() and self.reader.fileType())
        TagridReader.TagridReader(types.SimpleNamespace())


if __name__ == "__main__":
    unittest.main()
