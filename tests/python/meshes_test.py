"""Meshes and surfaces: where the world is, what their laws are, and that others take them."""

import sys
import unittest
import warnings

import numpy as np
import tagrid

from volumes import blobs

SHAPE = (18, 21, 24)
AFFINE = np.array([[0, 0.5, 0, 3], [-0.25, 0, 0, -4], [0, 0, 2, 5.5], [0, 0, 0, 1.0]])


def to_voxels(points):
    """World coordinates x, y, z as indices z, y, x."""
    return (np.c_[points, np.ones(len(points))] @ np.linalg.inv(AFFINE).T)[:, 2::-1]


def volumes_of(mesh):
    a, b, c, d = (mesh.points[mesh.cells[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


class Meshes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.samples = blobs(SHAPE)
        cls.volume = tagrid.open(tagrid.encode(cls.samples, affine=AFFINE, cube=8, brick=1))
        cls.mesh = cls.volume.mesh()
        cls.surface = cls.volume.surface(600)

    def test_points_are_samples_in_the_world(self):
        places = to_voxels(self.mesh.points)
        np.testing.assert_allclose(places, places.round(), atol=1e-9)
        samples = places.round().astype(int)
        inside = ((samples > 0) & (samples < np.array(SHAPE) - 1)).all(axis=1)
        z, y, x = samples[inside].T
        # Points on the first and the last planes may be cut, and have values of the field.
        np.testing.assert_array_equal(self.mesh.values[inside], self.samples[z, y, x])
        self.assertEqual(self.mesh.values.dtype, np.int16)

    def test_tetrahedra_fill_the_volume(self):
        whole = np.prod(np.array(SHAPE) - 1) * abs(np.linalg.det(AFFINE[:3, :3]))
        sizes = volumes_of(self.mesh)
        self.assertGreater(abs(sizes).min(), 0)
        self.assertEqual(len(set(np.sign(sizes))), 1)
        self.assertAlmostEqual(abs(sizes).sum(), whole)
        self.assertEqual((self.mesh.cells.dtype, self.mesh.cells.shape[1], self.mesh.levels.shape),
                         (np.int64, 4, (len(self.mesh.cells),)))
        self.assertEqual(set(self.mesh.types), {10})
        self.assertIn(f"{len(self.mesh.cells)} tetrahedra", repr(self.mesh))

    def test_a_level_is_coarser_and_a_region_is_a_part(self):
        coarse = self.volume.mesh(level=3)
        self.assertLess(len(coarse.cells), len(self.mesh.cells))
        self.assertLessEqual(coarse.levels.max(), 3)
        part = self.volume.mesh(region=((2, 9), (3, 8), (1, 7)))
        self.assertLess(len(part.cells), len(self.mesh.cells))

        def tetrahedra(mesh):
            return {frozenset(map(tuple, tet)) for tet in mesh.points[mesh.cells]}

        self.assertLess(tetrahedra(part), tetrahedra(self.mesh))
        self.assertEqual(tetrahedra(self.volume.mesh(region=((0, None), (0, None), (0, 24)))), tetrahedra(self.mesh))
        padded = self.volume.mesh(padded=True)
        self.assertGreater(abs(volumes_of(padded)).sum(), abs(volumes_of(self.mesh)).sum())
        for level in (-1, 10, 1000):
            self.assertRaises(tagrid.ArgumentError, self.volume.mesh, level=level)
            self.assertRaises(tagrid.ArgumentError, self.volume.surface, 600, level=level)
        self.assertRaises(tagrid.ArgumentError, self.volume.mesh, region=((0, 19), (0, 1), (0, 1)))

    def test_a_surface_has_a_border_unless_it_is_closed(self):
        for surface, borders in ((self.surface, True), (self.volume.surface(600, close=True), False)):
            points, triangles = surface
            self.assertEqual((points.dtype, triangles.dtype, points.shape[1], triangles.shape[1]),
                             (np.float64, np.int64, 3, 3))
            np.testing.assert_array_equal(np.unique(triangles), np.arange(len(points)))
            edges = np.sort(np.r_[triangles[:, :2], triangles[:, 1:], triangles[:, ::2]], axis=1)
            self.assertEqual(set(np.unique(edges, axis=0, return_counts=True)[1]), {1, 2} if borders else {2})

    def test_inside_is_where_samples_are_high(self):
        z, y, x = np.meshgrid(*map(np.arange, SHAPE), indexing="ij")
        distance = np.sqrt((z - 9) ** 2 + (y - 10) ** 2 + (x - 12) ** 2)
        ball = tagrid.open(tagrid.encode((1000 - 100 * distance).astype(np.int16), value_range=(0, 500)))
        points, triangles = ball.surface(400)
        a, b, c = (points[triangles[:, i]] for i in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        self.assertAlmostEqual(volume / (4 / 3 * np.pi * 6 ** 3), 1, delta=0.05)
        self.assertEqual(len(ball.surface(5000).points), 0)
        self.assertEqual(ball.surface(5000).triangles.shape, (0, 3))
        for iso in (np.nan, np.inf):
            self.assertRaises(ValueError, ball.surface, iso)

    def test_a_value_may_be_rescaled(self):
        data = tagrid.encode(self.samples, metadata={"rescale_slope": "2", "rescale_intercept": "-100"})
        volume = tagrid.open(data)
        for a, b in zip(volume.surface(1100, rescaled=True), volume.surface(600)):
            np.testing.assert_array_equal(a, b)

    def test_values_may_be_rescaled(self):
        data = tagrid.encode(self.samples, metadata={"rescale_slope": "2", "rescale_intercept": "-100"})
        volume = tagrid.open(data)
        stored, rescaled = volume.mesh(), volume.mesh(rescaled=True)
        self.assertEqual(stored.values.dtype, self.samples.dtype)
        np.testing.assert_array_equal(rescaled.values, 2.0 * stored.values - 100)
        np.testing.assert_array_equal(tagrid.open(tagrid.encode(self.samples)).mesh(rescaled=True).values, stored.values)
        of_slices = tagrid.open(tagrid.encode(self.samples, metadata={"slice_slopes": "1 2"}))
        self.assertRaises(tagrid.ArgumentError, of_slices.mesh, rescaled=True)

    def test_slices_at_unequal_distances_are_warned_of(self):
        positions = "; ".join(f"0 0 {z * z}" for z in range(SHAPE[0]))
        uneven = tagrid.open(tagrid.encode(self.samples, metadata={"slice_positions": positions}))
        for work, name in ((lambda: uneven.mesh(level=0), "mesh"), (lambda: uneven.surface(600), "surface")):
            with self.assertWarnsRegex(UserWarning, f"unequally spaced; in the {name} all distances are equal") as said:
                work()
            self.assertEqual(said.filename, __file__)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.volume.mesh(level=0)
            self.volume.surface(600)

    def test_meshio_takes_them(self):
        try:
            import meshio
        except ImportError:
            self.skipTest("there is no meshio")
        mesh = meshio.Mesh(self.mesh.points, {"tetra": self.mesh.cells}, point_data={"value": self.mesh.values},
                           cell_data={"level": [self.mesh.levels]})
        self.assertEqual(len(mesh.cells_dict["tetra"]), len(self.mesh.cells))
        surface = meshio.Mesh(self.surface.points, {"triangle": self.surface.triangles})
        self.assertEqual(len(surface.cells_dict["triangle"]), len(self.surface.triangles))

    def test_vtk_takes_them(self):
        try:
            from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
            from vtkmodules.vtkCommonCore import vtkPoints
            from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
            from vtkmodules.vtkFiltersVerdict import vtkMeshQuality
        except ImportError:
            self.skipTest("there is no vtk")
        grid, points, cells = vtkUnstructuredGrid(), vtkPoints(), vtkCellArray()
        points.SetData(numpy_to_vtk(self.mesh.points))
        offsets = 4 * np.arange(len(self.mesh.cells) + 1)
        cells.SetData(numpy_to_vtkIdTypeArray(offsets), numpy_to_vtkIdTypeArray(self.mesh.cells.ravel()))
        grid.SetPoints(points)
        grid.SetCells(numpy_to_vtk(self.mesh.types), cells)
        quality = vtkMeshQuality()
        quality.SetInputData(grid)
        quality.SetTetQualityMeasureToVolume()
        quality.Update()
        sizes = quality.GetOutput().GetCellData().GetArray("Quality")
        total = sum(sizes.GetValue(i) for i in range(sizes.GetNumberOfTuples()))
        self.assertAlmostEqual(abs(total), abs(volumes_of(self.mesh)).sum())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
