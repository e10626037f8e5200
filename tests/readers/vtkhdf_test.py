"""VTKHDF: VTK reads what decode writes, and tagrid reads image data of others.

    vtkhdf_test.py PROGRAM
"""

import unittest

from hdf5_files import MIRRORED, OBLIQUE, SHEARED, Hdf5Test, placed
from other_readers import ReaderTest, h5py, main, numpy, vtk_hdf

TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


@unittest.skipIf(vtk_hdf is None or h5py is None, "there is no VTK on this machine")
class Vtk(Hdf5Test):
    def image(self, name):
        reader = vtk_hdf.vtkHDFReader()
        self.assertTrue(reader.CanReadFile(str(self.folder / name)))
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        return reader.GetOutput()

    def test_vtk_reads_samples_and_places(self):
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonDataModel import vtkImageData as vtk_image

        for type, directions in [(type, OBLIQUE) for type in TYPES] + [("int16", SHEARED), ("int16", MIRRORED)]:
            truth = self.encode(type, fields=placed(directions))
            self.decode("b.vtkhdf")
            image = self.image("b.vtkhdf")
            self.assertEqual((image.GetClassName(), image.GetDimensions()), ("vtkImageData", (23, 19, 5)))
            self.assertEqual(image.GetPointData().GetNumberOfArrays(), 1)
            array = image.GetPointData().GetArray("value")
            samples = vtk_to_numpy(array).reshape(truth.shape)
            self.assertEqual(samples.astype(type).tobytes(), truth.tobytes(), type)
            # VTK 9.1 reads the directions, but goes on with transforms without them.
            again = vtk_image()
            again.SetOrigin(image.GetOrigin())
            again.SetSpacing(image.GetSpacing())
            again.SetDirectionMatrix([image.GetDirectionMatrix().GetElement(row, column) for row in range(3) for column in range(3)])
            for index in ((0, 0, 0), (22, 0, 0), (0, 18, 0), (0, 0, 4), (7, 5, 3)):
                place = [0.0] * 3
                again.TransformContinuousIndexToPhysicalPoint(index, place)
                expected = numpy.array((10, -20, 30.5)) + numpy.array(index) @ numpy.array(directions)
                numpy.testing.assert_allclose(place, expected, atol=1e-9)

    def test_without_directions(self):
        self.encode(fields="spacings: 0.5 0.25 3\naxis mins: 1 2 3\ncenters: node node node\n")
        self.decode("b.vtkhdf")
        image = self.image("b.vtkhdf")
        self.assertEqual((image.GetSpacing(), image.GetOrigin()), ((0.5, 0.25, 3), (1, 2, 3)))


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class VtkhdfOfOthers(ReaderTest):
    def write(self, name="a.vtkhdf", type="ImageData", where="PointData", shape=(4, 5, 6), extent=(2, 7, 0, 4, -3, 0), arrays=("density",), **attributes):
        samples = numpy.arange(numpy.prod(shape), dtype="i2").reshape(shape)
        with h5py.File(self.folder / name, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = [1, 0]
            root.attrs["Type"] = numpy.bytes_(type)
            for key, value in dict(WholeExtent=extent, Origin=[1., 2, 3], Spacing=[0.5, 0.25, 2], Direction=[1., 0, 0, 0, 1, 0, 0, 0, 1]).items():
                root.attrs[key] = value
            for key, value in attributes.items():
                root.attrs[key] = value
            for array in arrays:
                root.create_dataset(f"{where}/{array}", data=samples, chunks=(2,) * len(shape))
        return samples

    def test_image_data_says_where_samples_lie(self):
        truth = self.write()
        info = self.encodes(truth, "a.vtkhdf")
        self.assertEqual(info["geometry"]["spacing"], [0.5, 0.25, 2])
        self.assertEqual(info["geometry"]["origin"], [1 + 2 * 0.5, 2, 3 - 3 * 2])
        self.assertEqual(info["source"]["pairs"]["hdf5_dataset"], "/VTKHDF/PointData/density")
        self.write(Direction=[0., -1, 0, 1, 0, 0, 0, 0, 1])
        info = self.encoded("a.vtkhdf")[1]
        self.assertEqual(info["geometry"]["directions"], [[0, 0.5, 0], [-0.25, 0, 0], [0, 0, 2]])
        self.assertEqual(info["geometry"]["origin"], [1, 2 + 2 * 0.5, -3])

    def test_cells_lie_between_points(self):
        self.write(where="CellData", extent=(0, 6, 0, 5, 0, 4))
        self.assertEqual(self.encoded("a.vtkhdf")[1]["geometry"]["origin"], [1.25, 2.125, 4])

    def test_one_of_several_arrays(self):
        truth = self.write(arrays=("a", "b"))
        self.assertIn("/VTKHDF/PointData/b", self.assert_refused(64, "holds 2 volumes", "encode", "a.vtkhdf"))
        info = self.encodes(truth, "a.vtkhdf", "--dataset", "VTKHDF/PointData/b")
        self.assertEqual(info["geometry"]["spacing"], [0.5, 0.25, 2])

    def test_a_mesh_is_no_volume(self):
        self.write(type="UnstructuredGrid", shape=(7,))
        self.assert_refused(65, 'holds "UnstructuredGrid", which is no volume', "encode", "a.vtkhdf")

    def test_what_makes_no_sense_gives_no_geometry(self):
        for attributes in (dict(Spacing=[1., 0, 1]), dict(Spacing=[1., numpy.nan, 1]), dict(WholeExtent=[0, 1, 0, 1, 0, 1]), dict(Origin=[1.]),
                           dict(Direction=[0.] * 9), dict(Spacing=numpy.bytes_("x"))):
            truth = self.write(**attributes)
            info = self.encodes(truth, "a.vtkhdf")
            self.assertIsNone(info["geometry"]["spacing"], attributes)
            self.assertIn(f"VTKHDF file: {next(iter(attributes))} ", self.messages)

    def test_attributes_that_cannot_be_read_are_quoted(self):
        for attributes, text in ((dict(Direction=[1., 0, 0]), 'Direction is "1 0 0", which is not 9 numbers'), (dict(Direction="up"), 'Direction is "up"'),
                                 (dict(Direction=[numpy.nan] * 9), "Direction is"), (dict(Spacing="a b c"), 'Spacing is "a b c"')):
            truth = self.write(**attributes)
            info = self.encodes(truth, "a.vtkhdf")
            self.assertIsNone(info["geometry"]["spacing"], attributes)
            self.assertIn(text, self.messages)
        self.write(Spacing="0,5 0,25 2")
        self.assertEqual(self.encoded("a.vtkhdf")[1]["geometry"]["spacing"], [0.5, 0.25, 2])
        self.assertIn("decimal comma", self.messages)


if __name__ == "__main__":
    main()
