"""The readers in ParaView itself, and the steps of docs/viewing.md.

    pvpython_test.py PROGRAM PYTHON_FOLDER UNPACKED_FOLDER
        UNPACKED_FOLDER: where ParaView is unpacked if pvpython is not installed, and found the next time
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import paraview_program

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM, PACKAGE, UNPACKED = (os.path.abspath(argument) for argument in sys.argv[1:4])

# Runs in pvpython, and writes what it finds as JSON.
LOOK = """
import json, sys
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
window = vtkStringOutputWindow()
import tagrid.paraview
tagrid.paraview.load()
from paraview import simple
from paraview.simple import TagridImage, TagridMesh, TagridStructuredGrid

found = {}
for name in sys.argv[1:]:
    for reader in (TagridImage, TagridStructuredGrid, TagridMesh):
        vtkOutputWindow.SetInstance(window)
        before = len(window.GetOutput())
        # Coarser levels miss what is thin.
        source = reader(FileName=name, Level=15) if reader is TagridMesh else reader(FileName=name)
        source.UpdatePipeline()
        about = source.GetDataInformation()
        contour = simple.Contour(Input=source, ContourBy=["POINTS", "value"], Isosurfaces=[300.5])
        contour.UpdatePipeline()
        found[f"{name} {reader.__name__}"] = {
            "type": about.GetDataSetTypeAsString(), "points": about.GetNumberOfPoints(), "cells": about.GetNumberOfCells(),
            "bounds": about.GetBounds(), "range": source.PointData.GetArray("value").GetRange(),
            "contour": contour.GetDataInformation().GetBounds(), "warnings": window.GetOutput()[before:]}
    image = TagridImage(FileName=name, Step=3)
    image.UpdatePipeline()
    found[f"{name} Step"] = {"points": image.GetDataInformation().GetNumberOfPoints()}
    level = TagridImage(FileName=name, Resolution="1/4")
    part = TagridStructuredGrid(FileName=name, Region=[10, 19, 0, -1, 5, 6])
    for what, source in (("1/4", level), ("Region", part)):
        source.UpdatePipeline()
        about = source.GetDataInformation()
        found[f"{name} {what}"] = {"points": about.GetNumberOfPoints(), "bounds": about.GetBounds()}
chosen = simple.OpenDataFile(sys.argv[1])
found["opened"] = chosen is not None and chosen.GetXMLName()
with open("found.json", "w") as file:
    json.dump(found, file)
"""

# The same for meshes with materials.
LOOK_AT_MATERIALS = """
import json, sys
from paraview import servermanager, simple

def largest_distance(grid):
    # Of nodes from the middles of edges.
    found, place = 0, grid.GetPoint
    for cell in range(grid.GetNumberOfCells()):
        ids = [grid.GetCell(cell).GetPointId(i) for i in range(grid.GetCell(cell).GetNumberOfPoints())]
        for middle, (a, b) in zip(ids[4:], ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
            found = max([found] + [abs(m - (p + q) / 2) for m, p, q in zip(place(middle), place(ids[a]), place(ids[b]))])
    return found

found = {}
for name in sys.argv[1:]:
    for reader in (simple.XDMFReader(FileNames=[name]), simple.Xdmf3ReaderS(FileName=[name])):
        grid = servermanager.Fetch(reader)
        labels = grid.GetCellData().GetArray("material")
        volumes = servermanager.Fetch(simple.IntegrateVariables(Input=reader)).GetCellData().GetArray("Volume")
        found.setdefault(name, []).append(
            {"type": grid.GetCellType(0), "points": grid.GetNumberOfPoints(), "volume": volumes.GetValue(0),
             "labels": [labels.GetValue(i) for i in range(labels.GetNumberOfTuples())], "distance": largest_distance(grid)})
with open("found.json", "w") as file:
    json.dump(found, file)
"""
# Beside the tests; see tests/support.
WRITE_MATERIAL_MESH = pathlib.Path(PROGRAM).parent / "tests" / "write_material_mesh"

DIMS = (40, 36, 30)
# Lines of a header: where the samples are.
PLACES = {
    "turned": ["space: left-posterior-superior", "space directions: (0,0.5,0) (-0.5,0,0) (0,0,2)", "space origin: (10,20,30)"],
    "sheared": ["space: left-posterior-superior", "space directions: (0.5,0,0) (0,0.5,0) (0,1,2)", "space origin: (0,0,0)"],
    "uneven": ["space: left-posterior-superior", "space directions: (0.5,0,0) (0,0.5,0) (0,0,2)", "space origin: (0,0,0)",
               "slice_positions:=" + "; ".join(f"0 0 {z if z < 20 else z + 30}" for z in range(DIMS[2]))],
}
BOUNDS = {
    "turned": ([-7.5, 10, 20, 39.5, 30, 88], [-7.5, 10, 20, 39.5, 30, 88]),
    "sheared": ([0, 19.5, 0, 17.5, 0, 58], [0, 19.5, 0, 46.5, 0, 58]),
    "uneven": ([0, 19.5, 0, 17.5, 0, 58], [0, 19.5, 0, 17.5, 0, 59]),
}


PVPYTHON, WHY_NOT = paraview_program.pvpython(UNPACKED)
if PVPYTHON is None:
    print("skipped:", WHY_NOT)
    sys.exit(0)


class Readers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        for name, places in PLACES.items():
            subprocess.run([PROGRAM, "phantom", "--dims", ",".join(map(str, DIMS)), "-q", "-o", cls.folder / f"{name}.nhdr"], check=True)
            header = cls.folder / f"{name}.nhdr"
            kept = [line for line in header.read_text().splitlines() if not line.startswith(("space", "spacings"))]
            header.write_text("\n".join(kept + places) + "\n")
            subprocess.run([PROGRAM, "encode", header, "--overviews", "4", "-q"], check=True, capture_output=True)
        files = [cls.folder / f"{name}.tag" for name in PLACES]
        cls.run_in_pvpython(LOOK, *files)
        cls.found = {key.replace(f"{cls.folder}/", ""): value
                     for key, value in json.loads((cls.folder / "found.json").read_text()).items()}

    @classmethod
    def run_in_pvpython(cls, code, *arguments):
        (cls.folder / "script.py").write_text(code)
        done = subprocess.run([PVPYTHON, cls.folder / "script.py", *arguments], cwd=cls.folder, text=True, capture_output=True,
                              env=os.environ | {"PYTHONPATH": PACKAGE})
        if done.returncode != 0 or "Traceback" in done.stderr:
            raise AssertionError(f"pvpython ended with {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done

    def test_voxels_are_in_both_readers(self):
        for name in PLACES:
            image, grid = self.found[f"{name}.tag TagridImage"], self.found[f"{name}.tag TagridStructuredGrid"]
            self.assertEqual((image["type"], grid["type"]), ("vtkImageData", "vtkStructuredGrid"))
            self.assertEqual(image["points"], 40 * 36 * 30)
            self.assertEqual((grid["points"], grid["cells"], grid["range"]), (image["points"], image["cells"], image["range"]))
            self.assertLess(image["range"][0], image["range"][1])
            self.assertEqual(self.found[f"{name}.tag Step"]["points"], 14 * 12 * 10)

    def test_they_are_where_the_file_says(self):
        for name, expected in BOUNDS.items():
            for reader, bounds in zip(("TagridImage", "TagridStructuredGrid"), expected):
                found = self.found[f"{name}.tag {reader}"]["bounds"]
                self.assertLess(max(abs(a - b) for a, b in zip(found, bounds)), 1e-5, (name, reader, found))

    def test_levels_and_regions_are_where_they_belong(self):
        for name in PLACES:
            self.assertEqual(self.found[f"{name}.tag 1/4"]["points"], 10 * 9 * 8)
            self.assertEqual(self.found[f"{name}.tag Region"]["points"], 10 * 36 * 2)
        for key, expected in (("1/4", [-6.75, 9.25, 20.75, 38.75, 33, 89]), ("Region", [-7.5, 10, 25, 29.5, 40, 42])):
            found = self.found[f"turned.tag {key}"]["bounds"]
            self.assertLess(max(abs(a - b) for a, b in zip(found, expected)), 1e-5, (key, found))

    def test_a_contour_of_the_structured_grid_is_where_that_of_the_mesh_is(self):
        for name in ("turned", "sheared"):
            contours = [self.found[f"{name}.tag {reader}"]["contour"] for reader in ("TagridStructuredGrid", "TagridMesh")]
            self.assertLess(max(abs(a - b) for a, b in zip(*contours)), 2, (name, contours))

    def test_an_image_that_cannot_be_right_is_a_warning_once(self):
        for name, words in (("turned", None), ("sheared", "tilted gantry"), ("uneven", "unequal distances")):
            said = self.found[f"{name}.tag TagridImage"]["warnings"]
            self.assertEqual((said.count("TagridStructuredGrid"), not words or words in said), (1 if words else 0, True), (name, said))
            self.assertNotIn("unequal", self.found[f"{name}.tag TagridStructuredGrid"]["warnings"])

    def test_a_mesh_is_read_up_to_a_level(self):
        for name in PLACES:
            mesh = self.found[f"{name}.tag TagridMesh"]
            self.assertEqual(mesh["type"], "vtkUnstructuredGrid")
            self.assertGreater(mesh["cells"], 100)

    def test_the_page_says_what_paraview_shows(self):
        if not shutil.which("xvfb-run"):
            self.skipTest("there is no xvfb-run")
        done = subprocess.run([ROOT / "tools/research/paraview.sh", "--tagrid", PROGRAM, "--output",
                               self.folder / "pictures"], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ | {"PVPYTHON": str(PVPYTHON)})
        self.assertEqual(done.returncode, 0, done.stdout)
        page = (ROOT / "docs/viewing.md").read_text()
        drawn = {path.name for path in (self.folder / "pictures").iterdir()}
        self.assertEqual(drawn, set(re.findall(r"\(paraview/(\w+\.png)\)", page)))

    def test_the_code_of_the_page_runs(self):
        page = (ROOT / "docs/viewing.md").read_text()
        blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
        self.assertGreaterEqual(len(blocks), 3)
        commands = ["phantom --dims 64,64,48 -o scan.nhdr", "encode scan.nhdr --max-error 5", "decode scan.tag -o scan.vtkhdf"]
        for command in commands:
            subprocess.run([PROGRAM, *command.split(), "-q"], cwd=self.folder, check=True)
        said = self.run_in_pvpython("\n".join(blocks)).stdout
        self.assertGreater(int(said.split()[-1]), 1000, said)

    def test_both_readers_of_xdmf_read_meshes_with_materials(self):
        if not WRITE_MATERIAL_MESH.exists():
            self.skipTest(f"there is no {WRITE_MATERIAL_MESH}")
        for order in (1, 2):
            subprocess.run([WRITE_MATERIAL_MESH, f"m{order}.xdmf", f"order={order}", "cells=3,1,2", "spacing=0.5,2,1.5"], check=True,
                           cwd=self.folder, capture_output=True, env=os.environ | {"TAGRID_READER_PATH": str(pathlib.Path(PROGRAM).parent)})
        # Xdmf3ReaderS finds the numbers only by a complete path.
        self.run_in_pvpython(LOOK_AT_MATERIALS, *(self.folder / f"m{order}.xdmf" for order in (1, 2)))
        for path, meshes in json.loads((self.folder / "found.json").read_text()).items():
            self.assertEqual(len(meshes), 2)
            for mesh in meshes:
                self.assertEqual((mesh["type"], mesh["points"]), (10, 24) if path.endswith("m1.xdmf") else (24, 105), path)
                self.assertEqual(mesh["labels"], [10] * 12 + [20] * 24)
                self.assertAlmostEqual(mesh["volume"], 1.5 * 2 * 3)
                self.assertAlmostEqual(mesh["distance"], 0)

    def test_paraview_opens_tag_files(self):
        self.assertIn(self.found["opened"], ("TagridImage", "TagridMesh", "TagridStructuredGrid"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
