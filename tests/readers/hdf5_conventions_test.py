"""Where samples lie in HDF5 files of programs that say so beside the samples, each written by hand as its convention has it
(h5py writes and reads), and what nobody understands."""

import math
import unittest

from other_readers import ReaderTest, h5py, main, numpy

SHAPE = (5, 6, 7)


def volume(shape=SHAPE, type="u2"):
    return numpy.arange(math.prod(shape)).reshape(shape).astype(type)


def letters(text):
    """Imaris writes a text as a list of letters."""
    return numpy.array([c.encode() for c in str(text)], "S1")


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Conventions(ReaderTest):
    def make(self, write):
        with h5py.File(self.folder / "a.h5", "w") as file:
            write(file)

    def read(self, write, *options, truth=None, says=""):
        self.make(write)
        info = self.encodes(volume() if truth is None else truth, "a.h5", *options, says=says)
        self.pairs = info["source"]["pairs"]
        return info["geometry"]

    def with_attributes(self, attributes, says="", **more):
        def write(file):
            file["data"] = volume()
            file["data"].attrs.update(attributes)
        return self.read(write, says=says, **more)

    def assert_places(self, geometry, vectors, origin):
        """vectors[i]: from a sample to the next one along axis i of the file, the fastest first."""
        found = geometry["directions"] or numpy.diag(geometry["spacing"])
        numpy.testing.assert_allclose(found, vectors, atol=1e-12)
        if origin is not None:
            numpy.testing.assert_allclose(geometry["origin"], origin, atol=1e-12)

    def test_itk(self):
        """The rows of Directions are the directions of axes: columns of the matrix that ITK has in memory."""
        c, s = math.cos(.3), math.sin(.3)
        matrix = numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

        def write(file):
            group = file.create_group("ITKImage/0")
            file["ITKVersion"] = "5.2.1"
            group["Dimension"] = numpy.array(SHAPE[::-1], "u8")
            group["VoxelType"] = "USHORT"
            group["Origin"], group["Spacing"], group["Directions"] = [10., 20, 30], [.5, .6, 2], matrix.T
            group["VoxelData"] = volume()
            group.create_group("MetaData")
        geometry = self.read(write)
        # The position of index (1, 2, 3), as ITK's TransformIndexToPhysicalPoint() has it.
        place = numpy.array([10, 20, 30]) + matrix @ ([.5, .6, 2] * numpy.array([1, 2, 3]))
        numpy.testing.assert_allclose(geometry["origin"] + numpy.array([1, 2, 3]) @ numpy.array(geometry["directions"]), place)
        self.assertEqual((geometry["space"], self.messages), ("left-posterior-superior", ""))

        def broken(file):
            write(file)
            del file["ITKImage/0/Spacing"]
            file["ITKImage/0/Spacing"] = [.5, .6]
        self.read(broken, says="Origin, Spacing and Directions of /ITKImage/0 are not those of a volume")

    def openpmd(self, labels, order="C", shape=SHAPE, **more):
        steps = {"x": .5, "y": .6, "z": 2.}
        offsets = {"x": 10., "y": 20., "z": 30.}

        def write(file):
            file.attrs.update({"openPMD": "1.1.0", "basePath": "/data/%T/", "meshesPath": "meshes/"})
            mesh = file.create_dataset("data/0/meshes/density", data=volume(shape))
            mesh.attrs.update({"axisLabels": numpy.array([one.encode() for one in labels]), "dataOrder": order, "geometry": "cartesian",
                               "gridSpacing": [steps.get(one, 1.) for one in labels], "gridUnitSI": 1e-3, "unitSI": .01,
                               "gridGlobalOffset": [offsets.get(one, 1.) for one in labels], "position": [.5, .5, .5]} | more)
        return self.read(write, truth=volume(shape))

    def test_openpmd(self):
        vectors, origin = numpy.diag([.5, .6, 2]), [10.25, 20.3, 31]
        for labels, order in (("zyx", "C"), ("xyz", "F")):
            geometry = self.openpmd(labels, order)
            self.assert_places(geometry, vectors, origin)
            self.assertEqual((geometry["units"], self.messages), (["mm"] * 3, ""))
            self.assertEqual(float(self.pairs["rescale_slope"]), .01)
        for labels, order in (("xyz", "C"), ("zyx", "F")):
            self.assert_places(self.openpmd(labels, order), vectors[::-1], origin)
            self.assertIn("its axes are x, y, z, the slowest one first", self.messages)
        geometry = self.openpmd("yxz")
        self.assert_places(geometry, [vectors[2], vectors[0], vectors[1]], origin)
        self.assertEqual(self.openpmd("zyx", gridUnitSI=3.)["units"], ["m"] * 3)
        for labels, more in (("rtz", {}), ("zyx", {"geometry": "cylindrical"}), ("zyx", {"gridSpacing": [1., 2]})):
            self.assertIsNone(self.openpmd(labels, **more)["spacing"])
            self.assertIn("the positions of samples are unknown", self.messages)

    def test_openpmd_components_of_a_vector(self):
        def write(file):
            file.attrs["openPMD"] = "1.1.0"
            group = file.create_group("data/0/meshes/E")
            group.attrs.update({"axisLabels": numpy.array([b"z", b"y", b"x"]), "gridSpacing": [2., .6, .5], "gridUnitSI": 1., "dataOrder": "C"})
            group["x"], group["y"] = volume(), volume() + 1
        self.assert_places(self.read(write, "--dataset", "/data/0/meshes/E/x"), numpy.diag([.5, .6, 2]), None)

    def test_minc(self):
        def write(file, order="zspace,yspace,xspace"):
            file["minc-2.0/image/0/image"] = volume()
            file["minc-2.0/image/0/image"].attrs["dimorder"] = numpy.bytes_(order)
            for name, step, start, cosines in (("x", -.5, 10, [0., 1, 0]), ("y", .6, 20, [1., 0, 0]), ("z", 2, 30, [0., 0, 1])):
                file[f"minc-2.0/dimensions/{name}space"] = 0
                file[f"minc-2.0/dimensions/{name}space"].attrs.update({"step": float(step), "start": float(start), "direction_cosines": cosines, "units": "mm"})
        geometry = self.read(write)
        # World = sum of (start + i * step) * cosines.
        self.assert_places(geometry, [[0, -.5, 0], [.6, 0, 0], [0, 0, 2]], [20, 10, 30])
        self.assertEqual((geometry["space"], geometry["units"], self.messages), ("right-anterior-superior", ["mm"] * 3, ""))
        geometry = self.read(lambda file: write(file, "yspace,zspace,xspace"), says="its axes are y, z, x")
        self.assert_places(geometry, [[0, -.5, 0], [0, 0, 2], [.6, 0, 0]], [20, 10, 30])
        self.assertIsNone(self.read(lambda file: write(file, "time,yspace,xspace"), says='dimorder is "time,yspace,xspace"')["spacing"])

    def imaris(self, file):
        image = file.create_group("DataSetInfo/Image")
        for axis, (low, high, size) in enumerate(((10, 13.5, 7), (20, 23, 6), (-4, 6, 5))):
            image.attrs[f"ExtMin{axis}"], image.attrs[f"ExtMax{axis}"] = letters(low), letters(high)
            image.attrs["XYZ"[axis]] = letters(size)
        image.attrs["Unit"] = letters("um")
        padded = numpy.zeros((8, 8, 8), "u2")
        padded[:5, :6, :7] = volume()
        for level in range(2):
            group = file.create_group(f"DataSet/ResolutionLevel {level}/TimePoint 0/Channel 0")
            step = 2**level
            for axis in range(3):
                group.attrs[f"ImageSize{'XYZ'[axis]}"] = letters((SHAPE[2 - axis] + step - 1) // step)
            group.create_dataset("Data", data=numpy.ascontiguousarray(padded[::step, ::step, ::step]), chunks=(2, 4, 4))

    def test_imaris(self):
        geometry = self.read(self.imaris)
        self.assert_places(geometry, numpy.diag([.5, .5, 2]), [10.25, 20.25, -3])
        self.assertEqual((geometry["units"], self.messages), (["um"] * 3, ""))

        def without_sizes(file):
            self.imaris(file)
            for level in range(2):
                for letter in "XYZ":
                    del file[f"DataSet/ResolutionLevel {level}/TimePoint 0/Channel 0"].attrs[f"ImageSize{letter}"]
        self.assert_places(self.read(without_sizes), numpy.diag([.5, .5, 2]), [10.25, 20.25, -3])
        truth = numpy.zeros((4, 4, 4), "u2")
        truth[:3, :3, :4] = volume()[::2, ::2, ::2]
        self.read(without_sizes, "--dataset", "/DataSet/ResolutionLevel 1/TimePoint 0/Channel 0/Data", truth=truth, says="does not state its size")
        truth = volume()[::2, ::2, ::2]
        geometry = self.read(self.imaris, "--dataset", "/DataSet/ResolutionLevel 1/TimePoint 0/Channel 0/Data", truth=truth)
        self.assert_places(geometry, numpy.diag([3.5 / 4, 1, 10 / 3]), None)

        def two_channels(file):
            self.imaris(file)
            file.copy("DataSet/ResolutionLevel 0/TimePoint 0/Channel 0", "DataSet/ResolutionLevel 0/TimePoint 0/Channel 1")
        self.make(two_channels)
        self.assertNotIn("ResolutionLevel 1", self.assert_refused(64, "holds 2 volumes", "encode", "a.h5"))

        def contiguous(file):
            self.imaris(file)
            name = "DataSet/ResolutionLevel 0/TimePoint 0/Channel 0/Data"
            content = file[name][:]
            del file[name]
            file[name] = content
        self.assert_places(self.read(contiguous), numpy.diag([.5, .5, 2]), [10.25, 20.25, -3])

        def without_borders(file):
            self.imaris(file)
            file["DataSetInfo/Image"].attrs["ExtMax1"] = letters("far")
        self.assertIsNone(self.read(without_borders, says="ExtMin1 and ExtMax1 are not two borders")["spacing"])

    def test_chimera_eman_and_cremi(self):
        def chimera(file, **more):
            group = file.create_group("Chimera/image1")
            group.attrs.update({"step": [.5, .6, 2], "origin": [1., 2, 3], "cell_angles": [90., 90, 90]} | more)
            group["data_zyx"] = volume()
        geometry = self.read(chimera)
        self.assert_places(geometry, numpy.diag([.5, .6, 2]), [1, 2, 3])
        self.assertEqual((geometry["units"], self.messages), (["angstrom"] * 3, ""))
        for more in ({"cell_angles": [90., 90, 120]}, {"rotation_angle": 45., "rotation_axis": [0., 0, 1]}):
            self.read(lambda file: chimera(file, **more), says="rotate its axes, which is not applied")

        def eman(file):
            group = file.create_group("MDF/images/0")
            group.attrs.update({"EMAN.apix_x": 1.5, "EMAN.apix_y": 1.5, "EMAN.apix_z": 3., "EMAN.origin_x": 5.})
            group["image"] = volume()
        geometry = self.read(eman, says="EMAN.origin_x (of /MDF/images/0) may describe the geometry")
        self.assertEqual((geometry["spacing"], geometry["units"]), ([1.5, 1.5, 3], ["angstrom"] * 3))

        def cremi(file):
            file["volumes/raw"] = volume()
            file["volumes/raw"].attrs.update({"resolution": [40., 4, 3], "offset": [400., 40, 30]})
        geometry = self.read(cremi)
        self.assert_places(geometry, numpy.diag([3, 4, 40]), [30, 40, 400])
        self.assertEqual((geometry["units"], self.messages), (["nm"] * 3, ""))

    def test_scales_of_dimensions(self):
        def write(file, places, netcdf=False):
            file["data"] = volume()
            for i, (name, numbers) in enumerate(zip("zyx", places)):
                file[name] = numbers
                file[name].make_scale("This is a netCDF dimension but not a netCDF variable.         6" if netcdf and name == "y" else name)
                file[name].attrs["units"] = "mm"
                file["data"].dims[i].attach_scale(file[name])
        places = [numpy.arange(5) * 2. + 1, numpy.arange(6) * .5, numpy.arange(7) * 3.]
        geometry = self.read(lambda file: write(file, places))
        self.assertEqual((geometry["spacing"], geometry["origin"], geometry["units"], self.messages), ([3, .5, 2], [0, 0, 1], ["mm"] * 3, ""))
        with h5py.File(self.folder / "a.h5") as file:
            self.assertEqual([scale[0][1] - scale[0][0] for scale in file["data"].dims], geometry["spacing"][::-1])
        geometry = self.read(lambda file: write(file, places, netcdf=True))
        self.assertEqual((geometry["spacing"], geometry["origin"]), ([3, None, 2], None))
        geometry = self.read(lambda file: write(file, [[0., 1, 2, 4, 8], *places[1:]]), says="slices lie at unequal distances")
        self.assertEqual(self.pairs["slice_positions"].split("; ")[-1], "0 0 8")
        self.read(lambda file: write(file, [places[0], [0., 1, 2, 4, 8, 9], places[2]]), says="samples along y lie at unequal distances")

    def scaled(self, names, places, shape=SHAPE, unit="mm"):
        def write(file):
            file["data"] = volume(shape)
            for i, (name, numbers) in enumerate(zip(names, places)):
                file[name] = numbers
                file[name].make_scale(name)
                if unit:
                    file[name].attrs["units"] = unit
                file["data"].dims[i].attach_scale(file[name])
        return self.read(write, truth=volume(shape))

    def test_scales_called_x_y_z_lead_where_they_say(self):
        places = {"x": numpy.arange(5) * 2. + 5, "y": numpy.arange(6) * .5 - 1, "z": numpy.arange(7) * -.25 + 3}
        geometry = self.scaled("xyz", places.values())
        self.assertIn("its axes are x, y, z, the slowest one first", self.messages)
        # What h5py says of v[1, 2, 3].
        with h5py.File(self.folder / "a.h5") as file:
            truth = [file["data"].dims[axis][0][index] for axis, index in enumerate((1, 2, 3))]
        found = numpy.array(geometry["origin"]) + numpy.array([3, 2, 1]) @ numpy.array(geometry["directions"])
        numpy.testing.assert_allclose(found, truth)
        for name, unit in (("time", "mm"), ("time", ""), ("channel", "")):
            self.scaled((name, "y", "x"), (numpy.arange(5), numpy.arange(6), numpy.arange(7)), unit=unit)
            self.assertIn(f"its axes are called {name}, y, x (DIMENSION_LIST), the slowest one first, but are read as z, y, x", self.messages)
        self.scaled(("x", "y", "z"), (numpy.arange(5), [0, 1, 2, 4, 8, 9], numpy.arange(7)))
        self.assertIn("its axes are called x, y, z (DIMENSION_LIST)", self.messages)

    def test_places_that_drift_are_uneven(self):
        drifting = numpy.concatenate([numpy.arange(101), 100 + 1.009 * numpy.arange(1, 100)])
        self.scaled("zyx", (drifting, numpy.arange(2), numpy.arange(3)), (200, 2, 3))
        self.assertIn("slices lie at unequal distances", self.messages)
        self.assertEqual(self.pairs["slice_positions"].split("; ")[100], "0 0 100")
        rounded = (numpy.arange(200) * .1 + 1000).astype("f4")
        self.scaled("zyx", (rounded, numpy.arange(2), numpy.arange(3)), (200, 2, 3))
        self.assertEqual(self.messages, "")

    def test_an_origin_alone_states_no_spacing(self):
        geometry = self.with_attributes({"origin": [2., 3, 2]})
        self.assertEqual((geometry["spacing"], geometry["origin"]), (None, [2, 3, 2]))
        geometry = self.encodes(volume(), "a.h5", "--spacing", "0.5um")["geometry"]
        self.assertEqual((geometry["spacing"], geometry["origin"]), ([.5] * 3, [2, 3, 2]))

    def test_a_spacing_whose_order_nobody_states_is_said(self):
        for attributes, said in (({"spacing": [2., .6, .5]}, "spacing is read as x, y, z, because its order is not stated"),
                                 ({"spacing": [1., 1, 1], "origin": [1., 2, 3]}, "origin is read as x, y, z"),
                                 ({"spacing": [2., .6, .5], "axes": "zyx"}, "spacing is read as x, y, z"),
                                 ({"spacing": [.5, .5, .5]}, ""), ({"spacing": [.5, .6, .5], "origin": [1., 2, 1]}, ""),
                                 ({"spacing": [2., .6, .5], "spacing_units": "mm"}, "")):
            geometry = self.with_attributes(attributes, says=said)
            self.assertEqual(geometry["spacing"], attributes["spacing"])
            self.assertEqual("--override-spacing" in self.messages, said != "")
        self.with_attributes({"spacing": [2., .6, .5]})
        self.ok("decode", "out.tag", "-o", "b.h5", "-f")
        self.assertEqual(self.encodes(volume(), "b.h5")["geometry"]["spacing"], [2, .6, .5])
        self.assertEqual(self.messages, "")
        with h5py.File(self.folder / "b.h5", "a") as file:
            file["volume"].attrs["spacing"] = [3., .6, .5]
        self.assertEqual(self.encodes(volume(), "b.h5")["geometry"]["spacing"], [3, .6, .5])
        self.assertEqual(self.messages, "")

    def test_a_matrix_of_directions_turns_axes(self):
        c, s = math.cos(.3), math.sin(.3)
        matrix = numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        vectors = matrix.T * numpy.array([[.5], [.6], [2]])
        for name in ("direction", "directions"):
            for value in (matrix, matrix.ravel()):
                geometry = self.with_attributes({"origin": [10., 20, 30], "spacing": [.5, .6, 2], name: value})
                self.assert_places(geometry, vectors, [10, 20, 30])
                self.assertEqual("directions is read as the rows of a matrix" in self.messages, name == "directions")
        # Vectors of the length of the spacing are those of axes, as the manual has it.
        self.assert_places(self.with_attributes({"spacing": [.5, .6, 2], "directions": vectors.ravel()}), vectors, None)
        self.with_attributes({"spacing": [1., 1, 1], "directions": matrix}, says="the axes are rotated the wrong way")
        self.with_attributes({"direction": matrix}, says="direction rotates the axes, but there is no spacing that is read")
        self.with_attributes({"spacing": [.5, .6, 2], "direction": [1., 2, 3]}, says="direction is ")

    def test_names_of_axes_as_one_text_count(self):
        for name, value in (("axes", "xyz"), ("axes", "x,y,z"), ("axes", '["x", "y", "z"]'), ("axis_order", "xyz"), ("dimension_order", ["x", "y", "z"])):
            self.with_attributes({name: value}, says=f"its axes are called x, y, z ({name}), the slowest one first, but are read as z, y, x")
        for name, value in (("axes", "zyx"), ("axes", "ZYX"), ("axes", "['z', 'y', 'x']"), ("axis_order", "zyx")):
            self.with_attributes({name: value})
            self.assertEqual(self.messages, "", value)

    def test_what_looks_like_geometry_and_nobody_understands_is_said(self):
        for name in ("voxel_size", "pixelSize", "VoxelSizeX", "resolution", "scale", "offset", "affine", "transform", "step", "PixelSpacing",
                     "Image Position Origin", "orientation", "length_unit", "axes_names", "vs_spacing"):
            self.with_attributes({name: [1., 2, 3]}, says=f"/data: {name} may describe the geometry, but is not understood")
            self.assertIn(name, self.pairs["not understood"])
        for name in ("original_name", "units", "scale_factor", "stepper", "description", "exposure", "operator", "escalation"):
            self.with_attributes({name: 1.})
            self.assertEqual(self.messages, "", name)

        def around(file):
            group = file.create_group("scan/first")
            group["data"], group["x_pixel_size"], group["voxel_sizes_of_all"] = volume(), 3., numpy.ones(1000)
            file["scan"].attrs["resolution"] = [1., 2, 3]
            file.attrs["affine"] = numpy.eye(4)
        self.read(around, says="/scan/first/x_pixel_size, resolution (of /scan), affine (of /) may describe the geometry, but are not understood")
        self.assertNotIn("voxel_sizes_of_all", self.messages)
        bounded = self.tagrid("encode", "a.h5", "-o", "lossy.tag", "--max-error", "1", "--rm")
        self.assertNotEqual(bounded.returncode, 0)
        self.assertTrue((self.folder / "a.h5").exists())

    def test_bigdataviewer_is_said(self):
        def write(file):
            file["t00000/s00/0/cells"] = volume(type="i2")
            file["s00/resolutions"] = [[1., 1, 1]]
        self.read(write, truth=volume(type="i2"), says="BigDataViewer keeps the positions of samples in an XML file")

    def test_filters_and_attributes_that_lose_precision_are_recorded(self):
        floats = (numpy.random.default_rng(1).standard_normal(SHAPE)).astype("f4")
        for samples, options, attributes, loss in (
                (floats, {"scaleoffset": 3}, {}, "HDF5, scaleoffset, 3 decimals"), (volume(), {"scaleoffset": 4}, {}, "HDF5, scaleoffset, 4 bits"),
                (volume(), {"scaleoffset": True}, {}, None), (floats, {"compression": "gzip"}, {}, None),
                (floats, {}, {"_QuantizeBitGroomNumberOfSignificantDigits": 3}, "netCDF, BitGroom"),
                (floats, {"scaleoffset": 3}, {"_QuantizeBitRoundNumberOfSignificantBits": 9}, "netCDF, BitRound; HDF5, scaleoffset, 3 decimals"),
                (floats, {"scaleoffset": 3}, {"lossy source": "a camera"}, "a camera; HDF5, scaleoffset, 3 decimals")):
            def write(file):
                file.create_dataset("data", data=samples, chunks=SHAPE, **options).attrs.update(attributes)
            self.make(write)
            with h5py.File(self.folder / "a.h5") as file:
                truth = file["data"][:]
            pairs = self.encodes(truth, "a.h5", "--range", "-1000:1000" if samples is floats else "auto")["source"]["pairs"]
            if loss is None:
                self.assertNotIn("lossy source", pairs)
                numpy.testing.assert_array_equal(truth, samples)
            else:
                self.assertEqual(pairs["lossy source"].replace(" and ", "; ").replace(", then ", "; "), loss)


if __name__ == "__main__":
    main()
