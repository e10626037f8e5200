"""The readers for ParaView, run by VTK alone: its plugin machinery is replaced by decorators that do nothing.

    paraview_test.py PROGRAM PYTHON_FOLDER
        PYTHON_FOLDER: the folder with the built package

Debian cannot install ParaView beside VTK for Python, which other tests need; pvpython_test.py unpacks it.
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
    names = ("reader", "stringvector", "intvector", "intrange", "filelist", "filechooser", "xml")
    setattr(plugin_words, word, types.SimpleNamespace(**{name: leaves_as_it_is for name in names}))
sys.modules.update({"paraview": types.ModuleType("paraview"), "paraview.util": types.ModuleType("paraview.util"),
                    "paraview.util.vtkAlgorithm": plugin_words})

import numpy
import tagrid
from tagrid.paraview.tagrid_readers import TagridImage, TagridMesh, TagridStructuredGrid
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow


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

    def test_a_file_that_was_made_anew_or_named_anew_is_read_anew(self):
        reader = TagridImage()
        for name, shape in (("anew.tag", (20, 20, 20)), ("anew.tag", (20, 20, 30)), ("other.tag", (2, 3, 4))):
            array = numpy.arange(numpy.prod(shape), dtype="uint16").reshape(shape)
            tagrid.encode(array, self.folder / name)
            reader.SetFileName(str(self.folder / name))
            reader.Modified()
            reader.Update()
            numpy.testing.assert_array_equal(self.samples_of(reader.GetOutputDataObject(0)), array)

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

    def test_a_part_is_that_part(self):
        for step, extent in [(1, (3, 9, 5, 64, 60, 70)), (2, (0, 34, 32, 32, 31, 74)), (1, (69, 69, 65, 65, 149, 149))]:
            for reader in (TagridImage(), TagridStructuredGrid()):
                reader.SetFileName(self.path)
                reader.SetStep(step)
                reader.UpdateExtent(extent)
                part = reader.GetOutputDataObject(0)
                self.assertEqual(part.GetExtent(), extent)
                x0, x1, y0, y1, z0, z1 = extent
                expected = self.volume[::step, ::step, ::step][z0:z1 + 1, y0:y1 + 1, x0:x1 + 1]
                numpy.testing.assert_array_equal(self.samples_of(part), expected)
                first = [step * low for low in (x0, y0, z0)]
                place = (self.volume.affine @ [*first, 1])[:3]
                numpy.testing.assert_allclose(self.place(part, (0, 0, 0)), place, atol=1e-9)

    def test_a_volume_that_is_no_image_is_one_with_straight_slices_and_a_warning(self):
        tilted = numpy.array([[0.5, 0, 0, 1], [0, 0.5, 1, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
        uneven = [[0, 0, z] for z in (0, 1, 2, 7, 9)]
        for name, affine, positions, words in (
                ("e.tag", tilted, None, "slices are shifted against each other"),
                ("f.tag", numpy.diag([1.0, 1, 2, 1]), uneven, "slices lie at unequal distances")):
            path, samples = self.encoded(name, affine, positions)
            image, said = self.read(TagridImage(), path)
            numpy.testing.assert_array_equal(self.samples_of(image), samples)
            self.assertEqual(said.count(f"{name}: {words}"), 1, said)
            self.assertIn("TagridStructuredGrid", said)
            directions = [image.GetDirectionMatrix().GetElement(i // 3, i % 3) for i in range(9)]
            numpy.testing.assert_array_equal(directions, numpy.eye(3).ravel())
            if positions is None:
                self.assertEqual((image.GetOrigin(), image.GetSpacing()), ((1, 2, 3), (0.5, 0.5, 2)))

    def encoded(self, name, affine, slice_positions=None):
        """A file of 5 x 4 x 3 samples, and its samples."""
        samples = numpy.arange(60, dtype="uint16").reshape(5, 4, 3)
        metadata = {"space": "left-posterior-superior"}
        if slice_positions is not None:
            metadata["slice_positions"] = "; ".join(" ".join(map(str, place)) for place in slice_positions)
        tagrid.encode(samples, self.folder / name, affine=affine, metadata=metadata)
        return str(self.folder / name), samples

    def read(self, reader, path, step=1):
        """What a reader makes of a file, and what it says."""
        window = vtkStringOutputWindow()
        vtkOutputWindow.SetInstance(window)
        reader.SetFileName(path)
        reader.SetStep(step)
        reader.Update()
        reader.Modified()
        reader.Update()
        return reader.GetOutputDataObject(0), window.GetOutput()

    def test_a_structured_grid_has_each_sample_at_its_place(self):
        turn = numpy.array([[0, -0.5, 0.25, 10], [0.5, 0, 0, 20], [0, 0, 2, 30], [0, 0, 0, 1]])
        uneven = [[0.5, 1, z] for z in (0, 1, 2, 7, 9)]
        for name, affine, positions in (("c.tag", turn, None), ("d.tag", numpy.diag([3.0, 2, 1, 1]), uneven)):
            path, samples = self.encoded(name, affine, positions)
            for step in (1, 2):
                grid, said = self.read(TagridStructuredGrid(), path, step)
                self.assertEqual(said, "")
                some = samples[::step, ::step, ::step]
                self.assertEqual(grid.GetDimensions(), some.shape[::-1])
                numpy.testing.assert_array_equal(self.samples_of(grid), some)
                places = vtk_to_numpy(grid.GetPoints().GetData()).reshape(*some.shape, 3)
                for z, y, x in numpy.ndindex(some.shape):
                    expected = (affine @ [step * x, step * y, step * z, 1])[:3]
                    if positions:
                        expected = positions[step * z] + affine[:3, :2] @ [step * x, step * y]
                    numpy.testing.assert_allclose(places[z, y, x], expected, atol=1e-12)

    def test_an_image_that_is_turned_or_mirrored_needs_no_warning(self):
        for affine in (numpy.diag([-0.5, 0.5, 2, 1]), numpy.array([[0.3, 0.4, 0, 1], [0.4, -0.3, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])):
            path, _ = self.encoded("g.tag", affine)
            image, said = self.read(TagridImage(), path)
            self.assertEqual(said, "")
            place = [0.0, 0, 0]
            image.TransformIndexToPhysicalPoint((2, 3, 4), place)
            numpy.testing.assert_allclose(place, (affine @ [2, 3, 4, 1])[:3], atol=1e-12)

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

    def levels(self):
        """A file with overviews of a turned volume; its samples; and the means of its blocks, by factor."""
        random = numpy.random.default_rng(5)
        z, y, x = numpy.indices((37, 50, 70))
        samples = (20 * z + 7 * y - 3 * x + random.integers(0, 50, z.shape)).astype("int16")
        path = str(self.folder / "levels.tag")
        tagrid.encode(samples, path, affine=self.volume.affine, metadata={"space": "left-posterior-superior"},
                      overviews=[4, 16])
        means = {1: samples}
        for factor in (4, 16):
            blocks = [range(0, n, factor) for n in samples.shape]
            means[factor] = numpy.array([[[numpy.floor(samples[z:z + factor, y:y + factor, x:x + factor].mean(dtype="f8") + 0.5)
                                           for x in blocks[2]] for y in blocks[1]] for z in blocks[0]])
        return path, means

    def test_a_level_has_the_means_of_blocks_in_their_middles(self):
        path, means = self.levels()
        for resolution, factor in ((1, 1), (4, 4), (16, 16), (64, 16), (0, 1)):
            for step in (1, 2):
                for reader in (TagridImage(), TagridStructuredGrid()):
                    reader.SetResolution(resolution)
                    found, said = self.read(reader, path, step)
                    self.assertEqual(said, "")
                    expected = means[factor][::step, ::step, ::step]
                    numpy.testing.assert_array_equal(self.samples_of(found), expected)
                    self.assertEqual(self.samples_of(found).dtype, numpy.int16)
                    for index in ((0, 0, 0), (1, 0, 0), tuple(n - 1 for n in expected.shape[::-1])):
                        place = self.place(found, index)
                        middle = [factor * step * i + (factor - 1) / 2 for i in index]
                        numpy.testing.assert_allclose(place, (self.volume.affine @ [*middle, 1])[:3], atol=1e-9)

    def place(self, found, index):
        if found.IsA("vtkStructuredGrid"):
            x, y, z = found.GetDimensions()
            return found.GetPoint((index[2] * y + index[1]) * x + index[0])
        place, first = [0.0, 0, 0], found.GetExtent()[::2]
        found.TransformIndexToPhysicalPoint([i + f for i, f in zip(index, first)], place)
        return place

    def test_auto_is_the_finest_level_of_the_region_that_is_not_too_large(self):
        path, means = self.levels()
        everything = (0, -1) * 3
        sizes = {factor: level.size for factor, level in means.items()}
        for region, most, factor in ((everything, sizes[1], 1), (everything, sizes[1] - 1, 4),
                                     (everything, sizes[4], 4),
                                     (everything, sizes[4] - 1, 16), (everything, 1, 16),
                                     ((3, 12, 0, 9, 30, 36), 700, 1),
                                     ((3, 12, 0, 9, 30, 36), 699, 4), ((3, 12, 0, 9, 30, 99), 700, 1)):
            for reader in (TagridImage(), TagridStructuredGrid()):
                reader.most_samples = most
                reader.SetRegion(*region)
                found, _ = self.read(reader, path)
                x0, x1, y0, y1, z0, z1 = (end // factor if end >= 0 else None for end in region)
                part = means[factor][slice(z0, z1 if z1 is None else z1 + 1), slice(y0, y1 if y1 is None else y1 + 1),
                                     slice(x0, x1 if x1 is None else x1 + 1)]
                numpy.testing.assert_array_equal(self.samples_of(found), part)
                # What is shown of a part lies where it does in the whole.
                first = (self.volume.affine @ [*(factor * (low or 0) + (factor - 1) / 2
                                                 for low in (x0, y0, z0)), 1])[:3]
                numpy.testing.assert_allclose(self.place(found, (0, 0, 0)), first, atol=1e-9)

    def test_a_part_of_a_level_is_that_part(self):
        path, means = self.levels()
        reader = TagridImage()
        reader.SetFileName(path)
        reader.SetResolution(4)
        reader.UpdateExtent((3, 9, 5, 12, 2, 7))
        image = reader.GetOutputDataObject(0)
        self.assertEqual(image.GetExtent(), (3, 9, 5, 12, 2, 7))
        numpy.testing.assert_array_equal(self.samples_of(image), means[4][2:8, 5:13, 3:10])
        # Then all of it, and then more of it.
        for resolution in (4, 1):
            reader.SetResolution(resolution)
            reader.UpdateWholeExtent()
            numpy.testing.assert_array_equal(self.samples_of(reader.GetOutputDataObject(0)), means[resolution])

    def test_uneven_slices_of_a_level_lie_in_the_middle_of_theirs(self):
        samples = numpy.arange(9 * 8 * 8, dtype="uint16").reshape(9, 8, 8)
        heights = [0, 1, 2, 7, 9, 10, 20, 30, 33]
        path = str(self.folder / "uneven.tag")
        tagrid.encode(samples, path, spacing=(1, 1, 1), overviews=[4],
                      metadata={"space": "left-posterior-superior",
                                "slice_positions": "; ".join(f"0 0 {z}" for z in heights)})
        reader = TagridStructuredGrid()
        reader.SetResolution(4)
        found, _ = self.read(reader, path)
        self.assertEqual(found.GetDimensions(), (2, 2, 3))
        for z, middle in enumerate((10 / 4, 69 / 4, 33)):
            numpy.testing.assert_allclose(self.place(found, (1, 0, z)), (5.5, 1.5, middle), atol=1e-9)

    def test_a_level_that_is_read_does_not_read_the_volume(self):
        path, means = self.levels()
        with open(path, "r+b") as file:
            # Damage in the bricks of the volume, which are first.
            file.seek(20000)
            file.write(bytes(64))
        for resolution, intact in ((4, True), (16, True), (1, False)):
            reader = TagridImage()
            reader.SetResolution(resolution)
            found, said = self.read(reader, path)
            self.assertEqual(found.GetNumberOfPoints() == means[resolution].size and "damaged" not in said, intact,
                             said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
