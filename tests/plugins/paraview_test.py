"""The readers for ParaView, run by VTK alone: its plugin machinery is replaced by decorators that do nothing.

    paraview_test.py PROGRAM PYTHON_FOLDER
        PYTHON_FOLDER: the folder with the built package

Debian cannot install ParaView beside VTK for Python, which other tests need.
"""

import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

PROGRAM, FOLDER = sys.argv[1], sys.argv[2]
sys.path.insert(0, FOLDER)

try:
    import vtkmodules.util.vtkAlgorithm as vtk_algorithm
except ImportError:
    print("skipped: there is no VTK for Python on this machine (python3-vtk9)")
    sys.exit(0)


def leaves_as_it_is(*_, **__):
    return lambda decorated: decorated


plugin_words = types.ModuleType("paraview.util.vtkAlgorithm")
plugin_words.VTKPythonAlgorithmBase = vtk_algorithm.VTKPythonAlgorithmBase
for word in ("smdomain", "smhint", "smproperty", "smproxy"):
    names = ("reader", "stringvector", "intvector", "intrange", "filelist", "filechooser")
    setattr(plugin_words, word, types.SimpleNamespace(**{name: leaves_as_it_is for name in names}))
sys.modules.update({"paraview": types.ModuleType("paraview"), "paraview.util": types.ModuleType("paraview.util"),
                    "paraview.util.vtkAlgorithm": plugin_words})

import numpy
import tagrid
from tagrid.paraview.tagrid_readers import TagridImage, TagridMesh
from vtkmodules.util.numpy_support import vtk_to_numpy


class ReadersTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        subprocess.run([PROGRAM, "phantom", "--dims", "70,66,150", "-o", cls.folder / "a.nhdr"], check=True, capture_output=True)
        text = (cls.folder / "a.nhdr").read_text()
        kept = [line for line in text.splitlines() if not line.startswith(("space", "spacings"))]
        placed = ["space: left-posterior-superior", "space directions: (0,0.5,0) (-0.5,0,0) (0,0,2)", "space origin: (10,20,30)"]
        (cls.folder / "a.nhdr").write_text("\n".join(kept + placed) + "\n")
        subprocess.run([PROGRAM, "encode", cls.folder / "a.nhdr", "--max-error", "3"], check=True, capture_output=True)
        cls.path = str(cls.folder / "a.tag")
        cls.volume = tagrid.open(cls.path)

    def image(self, step=1):
        reader = TagridImage()
        reader.SetFileName(self.path)
        reader.SetStep(step)
        return reader

    def mesh(self, level):
        reader = TagridMesh()
        reader.SetFileName(self.path)
        reader.SetLevel(level)
        return reader

    def samples_of(self, image):
        x, y, z = image.GetDimensions()
        return vtk_to_numpy(image.GetPointData().GetArray("value")).reshape(z, y, x)

    def test_an_image_has_the_samples_and_their_places(self):
        for step in (1, 2, 7):
            reader = self.image(step)
            reader.Update()
            image = reader.GetOutputDataObject(0)
            expected = self.volume[::step, ::step, ::step]
            numpy.testing.assert_array_equal(self.samples_of(image), expected)
            self.assertEqual(self.samples_of(image).dtype, self.volume.dtype)
            z, y, x = (n - 1 for n in expected.shape)
            for index in ((0, 0, 0), (x, 0, 0), (0, y, 0), (x, y, z)):
                place = [0.0, 0, 0]
                image.TransformIndexToPhysicalPoint(index, place)
                numpy.testing.assert_allclose(place, (self.volume.affine @ [*(step * i for i in index), 1])[:3], atol=1e-9)

    def test_a_part_of_an_image_is_that_part(self):
        for step, extent in [(1, (3, 9, 5, 64, 60, 70)), (2, (0, 34, 32, 32, 31, 74)), (1, (69, 69, 65, 65, 149, 149))]:
            reader = self.image(step)
            reader.UpdateExtent(extent)
            image = reader.GetOutputDataObject(0)
            self.assertEqual(image.GetExtent(), extent)
            x0, x1, y0, y1, z0, z1 = extent
            numpy.testing.assert_array_equal(self.samples_of(image), self.volume[::step, ::step, ::step][z0:z1 + 1, y0:y1 + 1, x0:x1 + 1])

    def tetrahedra_of(self, grid):
        """Corners, value at each, and level of each tetrahedron, in an order of their own."""
        points, values = vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetPointData().GetArray("value"))
        cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
        levels = vtk_to_numpy(grid.GetCellData().GetArray("level"))
        rows = numpy.concatenate([points[cells].reshape(-1, 12), values[cells], levels[:, None]], axis=1)
        return rows[numpy.lexsort(rows.T)]

    def test_a_mesh_is_that_of_the_volume(self):
        for level in (0, 9, 24):
            reader = self.mesh(level)
            reader.Update()
            grid, mesh = reader.GetOutputDataObject(0), self.volume.mesh(level=min(level, self.volume.levels))
            self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (len(mesh.points), len(mesh.cells)))
            self.assertTrue(all(grid.GetCellType(i) == 10 for i in range(min(100, grid.GetNumberOfCells()))))

    def test_pieces_are_the_mesh_and_no_tetrahedron_is_in_two(self):
        whole = self.mesh(9)
        whole.Update()
        expected = self.tetrahedra_of(whole.GetOutputDataObject(0))
        for pieces in (2, 3, 7):
            parts = []
            for piece in range(pieces):
                reader = self.mesh(9)
                reader.UpdatePiece(piece, pieces, 0)
                if reader.GetOutputDataObject(0).GetNumberOfCells() > 0:
                    parts.append(self.tetrahedra_of(reader.GetOutputDataObject(0)))
            self.assertGreater(len(parts), 1)
            found = numpy.concatenate(parts)
            numpy.testing.assert_allclose(found[numpy.lexsort(found.T)], expected, atol=1e-9)

    def test_another_file_is_read_when_it_is_named(self):
        array = numpy.arange(24, dtype="uint8").reshape(2, 3, 4)
        tagrid.encode(array, self.folder / "b.tag")
        reader = self.image()
        reader.Update()
        reader.SetFileName(str(self.folder / "b.tag"))
        reader.Update()
        numpy.testing.assert_array_equal(self.samples_of(reader.GetOutputDataObject(0)), array)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
