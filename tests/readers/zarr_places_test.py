"""Where samples of Zarr arrays lie by what stands beside them: coordinates of xarray, the header of NIfTI-Zarr, and what
nobody understands. xarray and nibabel judge.

    zarr_places_test.py PROGRAM
"""

import base64
import json
import math
import shutil
import struct
import unittest

from other_readers import ReaderTest, main, nibabel, numpy, xarray, zarr
from zarr_files import multiscales, write_group, write_v3

SHAPE = (4, 5, 6)


def volume():
    return numpy.arange(math.prod(SHAPE)).reshape(SHAPE).astype("i2")


class Coordinates(ReaderTest):
    def write(self, **coordinates):
        """A group with the array /ct, of version 3, and arrays of one axis."""
        shutil.rmtree(self.folder / "a.zarr", ignore_errors=True)
        write_group(self.folder / "a.zarr")
        write_v3(self.folder / "a.zarr/ct", volume(), SHAPE, codecs=(), dimension_names=["z", "y", "x"])
        for name, (places, attributes) in coordinates.items():
            places = numpy.asarray(places)
            write_v3(self.folder / "a.zarr" / name, places, (2,), codecs=(), attributes=attributes, dimension_names=[name],
                     fill_text=0 if places.dtype.kind in "iu" else 0.0)

    @unittest.skipIf(xarray is None or zarr is None, "there is no xarray on this machine")
    def test_coordinates_that_xarray_writes_are_those_that_it_reads(self):
        data = xarray.Dataset(
            {"ct": (("z", "y", "x"), volume(), {"_units": "HU"})},
            {"z": ("z", numpy.arange(4) * 2.5 - 7, {"units": "mm"}), "y": ("y", numpy.arange(5, dtype="f4") * 0.5 + 1, {"units": "mm"}),
             "x": ("x", numpy.arange(6)[::1] * 3, {"units": "mm"})})
        data.to_zarr(self.folder / "a.zarr", consolidated=True)
        info = self.encodes(volume(), "a.zarr")
        read = xarray.open_zarr(self.folder / "a.zarr")
        for axis, name in enumerate("xyz"):
            places = read[name].values
            self.assertEqual(info["geometry"]["spacing"][axis], places[1] - places[0])
            self.assertEqual(info["geometry"]["origin"][axis], places[0])
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"]), ([3, 0.5, 2.5], ["mm"] * 3))
        self.assertEqual(self.messages, "")

    def test_every_type_of_coordinates(self):
        for type in ("i1", "i2", "i4", "i8", "u1", "u8", "f4", "f8"):
            self.write(z=(numpy.arange(4).astype(type) * 2 + 1, {}), y=(numpy.arange(5).astype(type), {}), x=(numpy.arange(6).astype(type), {}))
            geometry = self.encodes(volume(), "a.zarr")["geometry"]
            self.assertEqual((geometry["spacing"], geometry["origin"], self.messages), ([1, 1, 2], [0, 0, 1], ""), type)

    def test_what_is_uneven_or_unreadable_is_said(self):
        even = {name: (numpy.arange(n) * 1., {}) for name, n in zip("zyx", SHAPE)}
        self.write(**even | {"x": ([0., 1, 2, 4, 5, 6], {})})
        geometry = self.encodes(volume(), "a.zarr", says="samples along x lie at unequal distances")["geometry"]
        self.assertEqual(geometry["spacing"], [None, 1, 1])
        self.write(**even | {"z": ([0., 1, 2, 4], {})})
        info = self.encodes(volume(), "a.zarr", says="slices lie at unequal distances, from 1 to 2")
        self.assertEqual(info["source"]["pairs"]["slice_positions"], "0 0 0; 0 0 1; 0 0 2; 0 0 4")
        for places, attributes, said in (([0., 1, math.nan], {}, "it has 3"), ([0., 1, math.nan, 3], {}, "number 3 is nan"),
                                         ([0., 1, 2, 3], {"scale_factor": 2}, "scale_factor"), (["a"] * 4, {}, "")):
            if not said:
                continue
            self.write(**even | {"z": (places, attributes)})
            self.encodes(volume(), "a.zarr", says=said)
            self.assertIn("the axis z is not a list of 4 positions", self.messages)
        (self.folder / "a.zarr/z/c/1").unlink()
        self.encodes(volume(), "a.zarr", says="the axis z is not a list of 4 positions")

    def test_the_scale_of_ome_zarr_counts_before_coordinates(self):
        self.write(x=(numpy.arange(6) * 9., {}))
        attributes = multiscales([[3, 2, 1]])
        attributes["ome"]["multiscales"][0]["datasets"][0]["path"] = "ct"
        write_group(self.folder / "a.zarr", attributes)
        self.assertEqual(self.encodes(volume(), "a.zarr")["geometry"]["spacing"], [1, 2, 3])

    def test_a_translation_alone_states_no_spacing(self):
        self.write()
        attributes = multiscales([[1, 1, 1]])
        dataset = attributes["ome"]["multiscales"][0]["datasets"][0]
        dataset.update({"path": "ct", "coordinateTransformations": [{"type": "translation", "translation": [1, 2, 3]}]})
        write_group(self.folder / "a.zarr", attributes)
        geometry = self.encodes(volume(), "a.zarr")["geometry"]
        self.assertEqual((geometry["spacing"], geometry["origin"], geometry["units"]), (None, [3, 2, 1], ["micrometer"] * 3))
        geometry = self.encodes(volume(), "a.zarr", "--spacing", "0.0005mm")["geometry"]
        numpy.testing.assert_allclose(geometry["origin"], [.003, .002, .001])
        dataset["path"] = "a/../ct"
        write_group(self.folder / "a.zarr", attributes)
        self.assert_refused(65, 'the path of the finest level is "a/../ct"', "encode", "a.zarr")

    def test_places_that_drift_are_uneven(self):
        self.write(z=([0., 1, 2.009, 3.02], {}), y=(numpy.arange(5), {}), x=(numpy.arange(6), {}))
        self.encodes(volume(), "a.zarr")
        self.assertEqual(self.messages, "", "within one hundredth of a step of an even line")
        self.write(z=([0., 1, 2.03, 3.1], {}), y=(numpy.arange(5), {}), x=(numpy.arange(6), {}))
        self.encodes(volume(), "a.zarr", says="slices lie at unequal distances")

    def test_fill_values_in_base64_are_numbers(self):
        for value in (-999.25, math.nan):
            text = base64.b64encode(struct.pack("<d", value)).decode()
            write_v3(self.folder / "a.zarr", volume().astype("f4"), SHAPE, codecs=(), fill_text=0.0, attributes={"_FillValue": text})
            self.encodes(volume().astype("f4"), "a.zarr")
            self.assertEqual("samples that are -999.25, if there are any, stand for missing ones" in self.messages, value == -999.25)
            self.assertEqual(self.messages == "", math.isnan(value))

    def test_samples_that_netcdf_rounded_have_a_loss(self):
        write_v3(self.folder / "a.zarr", volume(), SHAPE, codecs=(), attributes={"_QuantizeBitGroomNumberOfSignificantDigits": 3})
        self.assertEqual(self.encodes(volume(), "a.zarr")["source"]["pairs"]["lossy source"], "netCDF, BitGroom")

    def test_attributes_that_look_like_geometry_and_nobody_understands_are_said(self):
        write_group(self.folder / "a.zarr", {"voxel_size": [1, 2, 3], "original_name": "x", "title": "scale"})
        write_v3(self.folder / "a.zarr/ct", volume(), SHAPE, codecs=(), attributes={"pixelResolution": [1, 2, 3], "kV": 120})
        info = self.encodes(volume(), "a.zarr", says="pixelResolution, voxel_size (of the root) may describe the geometry, but are not understood")
        self.assertIn("pixelResolution", info["source"]["pairs"]["not understood"])
        self.assertNotIn("original_name", self.messages)
        self.assertIn("--override-spacing", self.messages)
        write_group(self.folder / "a.zarr", {"title": "scale"})
        write_v3(self.folder / "a.zarr/ct", volume(), SHAPE, codecs=(), attributes={"kV": 120, "scale_factor": 2})
        self.encodes(volume(), "a.zarr")
        self.assertEqual(self.messages, "")


@unittest.skipIf(nibabel is None, "there is no nibabel on this machine")
class NiftiZarr(ReaderTest):
    def write(self, affine, header=None, shape=SHAPE):
        write_group(self.folder / "a.nii.zarr", multiscales([[3, 2, 1]], unit="millimeter"))
        write_v3(self.folder / "a.nii.zarr/0", volume(), SHAPE, codecs=())
        image = nibabel.Nifti1Image(numpy.zeros(shape[::-1], "i2"), affine)
        image.header.set_xyzt_units("mm")
        content = numpy.frombuffer(header if header is not None else image.header.binaryblock, "u1")
        write_v3(self.folder / "a.nii.zarr/nifti", content, (len(content),), codecs=())
        return image

    def test_the_header_gives_directions(self):
        c, s = math.cos(.3), math.sin(.3)
        affine = numpy.array([[c, -2 * s, 0, 10], [s, 2 * c, 0, 20], [0, 0, 3, 30], [0, 0, 0, 1]])
        image = self.write(affine)
        geometry = self.encodes(volume(), "a.nii.zarr")["geometry"]
        numpy.testing.assert_allclose(numpy.array(geometry["directions"]).T, image.affine[:3, :3], rtol=1e-6)
        numpy.testing.assert_allclose(geometry["origin"], image.affine[:3, 3], rtol=1e-6)
        self.assertEqual(geometry["space"], "right-anterior-superior")
        self.assertEqual(self.messages, "")

    def test_a_header_that_contradicts_the_scale_is_said(self):
        self.write(numpy.diag([1., 2, 5, 1]))
        geometry = self.encodes(volume(), "a.nii.zarr", says="the scale of OME-Zarr is 3 along z, but the header of NIfTI states 5")["geometry"]
        self.assertEqual(geometry["spacing"], [1, 2, 5])

    def test_a_header_that_cannot_be_read_is_said(self):
        for header, shape, said in ((b"\0" * 348, SHAPE, "it does not begin with a header of NIfTI"), (b"\0" * 20, SHAPE, "a header of NIfTI"),
                                    (None, (4, 5, 7), "it describes 7 x 5 x 4 samples")):
            self.write(numpy.eye(4), header, shape)
            self.assertEqual(self.encodes(volume(), "a.nii.zarr", says="the header of NIfTI in \"nifti\" is not read")["geometry"]["spacing"], [1, 2, 3])
            self.assertIn(said, self.messages)


if __name__ == "__main__":
    main()
