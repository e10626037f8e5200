"""Zarr hierarchies that are large, deep, lost in part, or written by Python: nothing is lost without a word. zarr-python
judges what a chunk is."""

import base64
import itertools
import json
import math
import os
import shutil
import struct
import unittest

from other_readers import ReaderTest, main, nibabel, numpy, xarray, zarr
from zarr_files import multiscales, write_group, write_v3, zipped

SHAPE, CHUNK = (4, 6, 8), (2, 3, 4)


def volume():
    return (numpy.arange(math.prod(SHAPE)) + 1).reshape(SHAPE).astype("u2")


def metadata(shape=SHAPE, chunks=CHUNK, **more):
    return {"zarr_format": 2, "shape": list(shape), "chunks": list(chunks), "dtype": "<u2", "compressor": None, "fill_value": 0,
            "order": "C", "filters": None} | more


class Stores(ReaderTest):
    def write(self, key, description=None, name="a.zarr", kept=lambda numbers: True):
        """An array of version 2 or 3 whose chunks are under the keys that the function makes of their numbers."""
        folder = self.folder / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        description = description or metadata()
        (folder / (".zarray" if description["zarr_format"] == 2 else "zarr.json")).write_text(json.dumps(description))
        for numbers in filter(kept, itertools.product(range(2), repeat=3)):
            block = volume()[tuple(slice(n * c, (n + 1) * c) for n, c in zip(numbers, CHUNK))]
            path = folder / key(numbers)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(block.tobytes())

    @staticmethod
    def keys(separator, first=()):
        return lambda numbers: separator.join([*first, *map(str, numbers)])

    def descriptions(self):
        """Each description of an array with the rule of its keys and two other rules."""
        v3 = {"zarr_format": 3, "node_type": "array", "shape": SHAPE, "data_type": "uint16", "fill_value": 0, "attributes": {},
              "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": CHUNK}},
              "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}]}
        dot, slash, c_dot, c_slash = self.keys("."), self.keys("/"), self.keys(".", "c"), self.keys("/", "c")
        def keys(name, separator):
            return v3 | {"chunk_key_encoding": {"name": name, "configuration": {"separator": separator}}}
        return [(metadata(), dot, (slash, c_slash)), (metadata(dimension_separator="/"), slash, (dot, c_dot)),
                (keys("default", "/"), c_slash, (slash, c_dot)), (keys("default", "."), c_dot, (c_slash, dot)),
                (keys("v2", "."), dot, (slash, c_dot))]

    def test_chunks_under_other_keys_are_refused_and_both_keys_are_named(self):
        for description, own, others in self.descriptions():
            self.write(own, description)
            self.encodes(volume(), "a.zarr")
            self.assertEqual(self.messages, "")
            for other in others:
                self.write(other, description)
                said = self.assert_refused(65, "8 of 8 chunks are missing, but there is a file", "encode", "a.zarr")
                self.assertIn(f'"{other((0, 0, 0))}"', said)
                self.assertIn(f'"{own((0, 0, 0))}"', said)
                # Some of each: half of the volume would be lost.
                self.write(lambda numbers: (own if numbers[0] == 0 else other)(numbers), description)
                said = self.assert_refused(65, "4 of 8 chunks are missing, but there is a file", "encode", "a.zarr")
                self.assertIn(f'"{other((1, 0, 0))}"', said)

    def test_other_files_are_no_chunks(self):
        self.write(self.keys("."), kept=lambda numbers: numbers != (1, 1, 1))
        for name in ("2.0.0", "0.0", "00.0.0", "0.0.0.tmp", "x.0.0", "0/0/2", "5/0/0", "-1.0.0", "99999999999999999999.0.0"):
            path = self.folder / "a.zarr" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"")
        truth = volume()
        truth[2:, 3:, 4:] = 0
        self.encodes(truth, "a.zarr", says="1 of 8 chunks are missing; their samples are the fill value")

    def test_links_that_lead_nowhere_are_no_missing_chunks(self):
        """As DataLad and git-annex leave them for content that they do not keep."""
        says = "is a broken symbolic link; its content may have to be fetched first (git annex get)"
        for description, own, others in self.descriptions():
            for key in (own, others[0]):
                self.write(key, description)
                path = self.folder / "a.zarr" / key((0, 1, 1))
                path.unlink()
                path.symlink_to("../../nowhere/chunk")
                self.assert_refused(65, says if key is own else "chunks are missing", "encode", "a.zarr", "-q")
            # Its folder, and all of them.
            for folder in own((0, 1, 1)).split("/")[:-1][::-1]:
                self.write(own, description)
                path = self.folder / "a.zarr" / own((0, 1, 1)).split(f"{folder}/")[0] / folder
                shutil.rmtree(path)
                path.symlink_to("nowhere")
                self.assert_refused(65, f"{folder}: {says}", "encode", "a.zarr", "-q")
        # What is no part of the volume may be lost.
        self.write(self.keys("."))
        (self.folder / "a.zarr" / "notes.txt").symlink_to("nowhere")
        self.encodes(volume(), "a.zarr")
        self.assertEqual(self.messages, "")

    def test_links_of_shards_that_lead_nowhere_are_refused(self):
        write_v3(self.folder / "a.zarr", volume(), (1, 1, 1), shards=(2, 3, 4), codecs=())
        path = next(path for path in (self.folder / "a.zarr").rglob("*") if path.name == "1" and path.is_file())
        path.unlink()
        path.symlink_to("nowhere")
        self.assert_refused(65, "1: is a broken symbolic link", "encode", "a.zarr", "-q")

    def test_lost_chunks_are_counted_whatever_the_number(self):
        """More than 100,000, of which each is one sample."""
        edge = 47
        for separator in "./":
            folder = self.folder / "a.zarr"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            (folder / ".zarray").write_text(json.dumps(metadata([edge] * 3, [1] * 3, dimension_separator=separator)))
            truth = numpy.zeros([edge] * 3, "u2")
            for x in range(20):
                truth[0, 0, x] = 500 + x
                path = folder / separator.join(("0", "0", str(x)))
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(struct.pack("<H", 500 + x))
            self.encodes(truth, "a.zarr", says=f"{edge**3 - 20} of {edge**3} chunks are missing")

    def test_lost_chunks_in_shards_and_in_zip_files_are_counted(self):
        truth = volume()
        write_v3(self.folder / "a.zarr", truth, (1, 1, 1), shards=(2, 3, 4), codecs=(), skip=lambda numbers: numbers[2] == 3)
        truth[:, :, 3] = 0
        self.encodes(truth, "a.zarr", says=f"{4 * 6} of {4 * 6 * 8} chunks are missing")
        zipped(self.folder / "a.zarr", self.folder / "a.ozx")
        self.encodes(truth, "a.ozx", says=f"{4 * 6} of {4 * 6 * 8} chunks are missing")

    def test_lost_chunks_of_other_moments_are_not_counted(self):
        truth = numpy.stack([volume(), volume() + 1000])
        write_v3(self.folder / "a.zarr", truth, (1, *CHUNK), codecs=(), dimension_names=["t", "z", "y", "x"],
                 skip=lambda numbers: numbers == (1, 0, 0, 0))
        self.encodes(truth[0], "a.zarr", "--series", "t1")
        self.assertEqual(self.messages, "")
        truth[1, :2, :3, :4] = 0
        self.encodes(truth[1], "a.zarr", "--series", "t2", says="1 of 8 chunks are missing")

    def test_numbers_that_python_writes_and_json_has_not(self):
        truth = volume().astype("f4")
        for fill in (math.nan, math.inf, -math.inf):
            folder = self.folder / "a.zarr"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            (folder / ".zarray").write_text(json.dumps(metadata(SHAPE, SHAPE, dtype="<f4", fill_value=fill)))
            (folder / ".zattrs").write_text(json.dumps({"a": [fill, 1.0], "note": 'a "NaN", -Infinity \\'}))
            (folder / "0.0.0").write_bytes(truth.tobytes())
            attributes = json.loads(self.encodes(truth, "a.zarr")["source"]["pairs"]["zarr_attributes"])
            self.assertEqual(attributes["note"], 'a "NaN", -Infinity \\')
            self.assertEqual(attributes["a"], [{"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}[str(fill)], 1.0])
            (folder / "0.0.0").unlink()
            if zarr is not None:
                expected = zarr.open(str(folder), mode="r")[:]
                numpy.testing.assert_array_equal(expected, numpy.full(SHAPE, fill, "f4"))
                self.encodes(expected, "a.zarr", "--range", "0:1", says="1 of 1 chunks are missing")
        for broken in ("{\"a\": NaN, \"b\": }", "{\"a\": nan}", "{\"a\": NaNNaN}", "NaN"):
            (self.folder / "a.zarr/.zattrs").write_text(broken)
            self.assert_refused(65, ".zattrs", "encode", "a.zarr")

    def test_a_search_has_no_limit_without_a_word(self):
        write_group(self.folder / "a.zarr")
        path, names = "", []
        for level in range(20):
            path += f"g{level}/"
            write_group(self.folder / "a.zarr" / path)
            self.write(self.keys("."), name=f"a.zarr/{path}volume")
            names.append(f"{path}volume")
        listed = [line for line in self.search("a.zarr").stdout.splitlines() if not line.startswith("#")]
        self.assertEqual([line.split("\t")[1] for line in listed], [f"dataset={name}" for name in sorted(names)])
        deep = self.folder / "deep.zarr" / "/".join(["g"] * 80)
        deep.mkdir(parents=True)
        said = self.assert_refused(65, "has directories that are nested more than 64 deep", "encode", "deep.zarr")
        self.assertIn("--dataset", said)

    def test_more_volumes_than_any_limit_before_are_listed(self):
        write_group(self.folder / "many.zarr")
        for i in range(2100):
            folder = self.folder / f"many.zarr/v{i:04d}"
            folder.mkdir()
            (folder / ".zarray").write_text(json.dumps(metadata((2, 2, 2), (2, 2, 2))))
        self.assertIn("holds 2100 volumes", self.assert_refused(64, "v0000", "encode", "many.zarr"))

    def test_links_in_circles_end(self):
        write_group(self.folder / "a.zarr")
        for name in "bc":
            (self.folder / "a.zarr" / name).mkdir()
        self.write(self.keys("."), name="a.zarr/b/volume")
        os.symlink("../..", self.folder / "a.zarr/b/up")
        os.symlink("../c", self.folder / "a.zarr/b/other")
        os.symlink("../b", self.folder / "a.zarr/c/other")
        os.symlink(".", self.folder / "a.zarr/c/self")
        self.encodes(volume(), "a.zarr")


class Levels(ReaderTest):
    def write(self, path="0", group=True, key=None):
        folder = self.folder / "a.zarr"
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "0").mkdir(parents=True)
        if group:
            (folder / ".zgroup").write_text('{"zarr_format": 2}')
        attributes = multiscales([[3, 2, 1]])["ome"]
        attributes["multiscales"][0]["datasets"][0]["path"] = path
        (folder / ".zattrs").write_text(json.dumps({key: attributes} if key else attributes))
        (folder / "0/.zarray").write_text(json.dumps(metadata(SHAPE, SHAPE)))
        (folder / "0/0.0.0").write_bytes(volume().tobytes())

    def test_paths_of_levels_as_programs_write_them(self):
        for path, group in itertools.product(("0", "./0", "0/", "/0", ".//0/."), (True, False)):
            self.write(path, group)
            for options in ((), ("--dataset", "0")):
                info = self.encodes(volume(), "a.zarr", *options)
                self.assertEqual(info["geometry"]["spacing"], [1, 2, 3], (path, group))
                self.assertEqual(self.messages, "")
        self.write("../a.zarr/0")
        self.assert_refused(65, "the finest level is", "encode", "a.zarr")

    def test_a_level_that_no_description_names_is_said(self):
        self.write("0")
        (self.folder / "a.zarr/0").rename(self.folder / "a.zarr/1")
        info = self.encodes(volume(), "a.zarr", "--dataset", "1", says='the description of levels in its root does not name "1"')
        self.assertIsNone(info["geometry"]["spacing"])


# Where samples of Zarr arrays lie by what stands beside them: coordinates of xarray, the header of NIfTI-Zarr, and what
# nobody understands. xarray and nibabel judge.

SMALL = (4, 5, 6)


def stored():
    return numpy.arange(math.prod(SMALL)).reshape(SMALL).astype("i2")


class Coordinates(ReaderTest):
    def write(self, **coordinates):
        """A group with the array /ct, of version 3, and arrays of one axis."""
        shutil.rmtree(self.folder / "a.zarr", ignore_errors=True)
        write_group(self.folder / "a.zarr")
        write_v3(self.folder / "a.zarr/ct", stored(), SMALL, codecs=(), dimension_names=["z", "y", "x"])
        for name, (places, attributes) in coordinates.items():
            places = numpy.asarray(places)
            write_v3(self.folder / "a.zarr" / name, places, (2,), codecs=(), attributes=attributes, dimension_names=[name],
                     fill_text=0 if places.dtype.kind in "iu" else 0.0)

    @unittest.skipIf(xarray is None or zarr is None, "there is no xarray on this machine")
    def test_coordinates_that_xarray_writes_are_those_that_it_reads(self):
        data = xarray.Dataset(
            {"ct": (("z", "y", "x"), stored(), {"_units": "HU"})},
            {"z": ("z", numpy.arange(4) * 2.5 - 7, {"units": "mm"}), "y": ("y", numpy.arange(5, dtype="f4") * 0.5 + 1, {"units": "mm"}),
             "x": ("x", numpy.arange(6)[::1] * 3, {"units": "mm"})})
        data.to_zarr(self.folder / "a.zarr", consolidated=True)
        info = self.encodes(stored(), "a.zarr")
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
            geometry = self.encodes(stored(), "a.zarr")["geometry"]
            self.assertEqual((geometry["spacing"], geometry["origin"], self.messages), ([1, 1, 2], [0, 0, 1], ""), type)

    def test_what_is_uneven_or_unreadable_is_said(self):
        even = {name: (numpy.arange(n) * 1., {}) for name, n in zip("zyx", SMALL)}
        self.write(**even | {"x": ([0., 1, 2, 4, 5, 6], {})})
        geometry = self.encodes(stored(), "a.zarr", says="samples along x lie at unequal distances")["geometry"]
        self.assertEqual(geometry["spacing"], [None, 1, 1])
        self.write(**even | {"z": ([0., 1, 2, 4], {})})
        info = self.encodes(stored(), "a.zarr", says="slices lie at unequal distances, from 1 to 2")
        self.assertEqual(info["source"]["pairs"]["slice_positions"], "0 0 0; 0 0 1; 0 0 2; 0 0 4")
        for places, attributes, said in (([0., 1, math.nan], {}, "it has 3"), ([0., 1, math.nan, 3], {}, "number 3 is nan"),
                                         ([0., 1, 2, 3], {"scale_factor": 2}, "scale_factor"), (["a"] * 4, {}, "")):
            if not said:
                continue
            self.write(**even | {"z": (places, attributes)})
            self.encodes(stored(), "a.zarr", says=said)
            self.assertIn("the axis z is not a list of 4 positions", self.messages)
        (self.folder / "a.zarr/z/c/1").unlink()
        self.encodes(stored(), "a.zarr", says="the axis z is not a list of 4 positions")

    def test_the_scale_of_ome_zarr_counts_before_coordinates(self):
        self.write(x=(numpy.arange(6) * 9., {}))
        attributes = multiscales([[3, 2, 1]])
        attributes["ome"]["multiscales"][0]["datasets"][0]["path"] = "ct"
        write_group(self.folder / "a.zarr", attributes)
        self.assertEqual(self.encodes(stored(), "a.zarr")["geometry"]["spacing"], [1, 2, 3])

    def test_a_translation_alone_states_no_spacing(self):
        self.write()
        attributes = multiscales([[1, 1, 1]])
        dataset = attributes["ome"]["multiscales"][0]["datasets"][0]
        dataset.update({"path": "ct", "coordinateTransformations": [{"type": "translation", "translation": [1, 2, 3]}]})
        write_group(self.folder / "a.zarr", attributes)
        geometry = self.encodes(stored(), "a.zarr")["geometry"]
        self.assertEqual((geometry["spacing"], geometry["origin"], geometry["units"]), (None, [3, 2, 1], ["micrometer"] * 3))
        geometry = self.encodes(stored(), "a.zarr", "--spacing", "0.0005mm")["geometry"]
        numpy.testing.assert_allclose(geometry["origin"], [.003, .002, .001])
        dataset["path"] = "a/../ct"
        write_group(self.folder / "a.zarr", attributes)
        self.assert_refused(65, 'the path of the finest level is "a/../ct"', "encode", "a.zarr")

    def test_places_that_drift_are_uneven(self):
        self.write(z=([0., 1, 2.009, 3.02], {}), y=(numpy.arange(5), {}), x=(numpy.arange(6), {}))
        self.encodes(stored(), "a.zarr")
        self.assertEqual(self.messages, "", "within one hundredth of a step of an even line")
        self.write(z=([0., 1, 2.03, 3.1], {}), y=(numpy.arange(5), {}), x=(numpy.arange(6), {}))
        self.encodes(stored(), "a.zarr", says="slices lie at unequal distances")

    def test_fill_values_in_base64_are_numbers(self):
        for value in (-999.25, math.nan):
            text = base64.b64encode(struct.pack("<d", value)).decode()
            write_v3(self.folder / "a.zarr", stored().astype("f4"), SMALL, codecs=(), fill_text=0.0, attributes={"_FillValue": text})
            self.encodes(stored().astype("f4"), "a.zarr")
            self.assertEqual("samples that are -999.25, if there are any, stand for missing ones" in self.messages, value == -999.25)
            self.assertEqual(self.messages == "", math.isnan(value))

    def test_samples_that_netcdf_rounded_have_a_loss(self):
        write_v3(self.folder / "a.zarr", stored(), SMALL, codecs=(), attributes={"_QuantizeBitGroomNumberOfSignificantDigits": 3})
        self.assertEqual(self.encodes(stored(), "a.zarr")["source"]["pairs"]["lossy source"], "netCDF, BitGroom")

    def test_attributes_that_look_like_geometry_and_nobody_understands_are_said(self):
        write_group(self.folder / "a.zarr", {"voxel_size": [1, 2, 3], "original_name": "x", "title": "scale"})
        write_v3(self.folder / "a.zarr/ct", stored(), SMALL, codecs=(), attributes={"pixelResolution": [1, 2, 3], "kV": 120})
        info = self.encodes(stored(), "a.zarr", says="pixelResolution, voxel_size (of the root) may describe the geometry, but are not understood")
        self.assertIn("pixelResolution", info["source"]["pairs"]["not understood"])
        self.assertNotIn("original_name", self.messages)
        self.assertIn("--override-spacing", self.messages)
        write_group(self.folder / "a.zarr", {"title": "scale"})
        write_v3(self.folder / "a.zarr/ct", stored(), SMALL, codecs=(), attributes={"kV": 120, "scale_factor": 2})
        self.encodes(stored(), "a.zarr")
        self.assertEqual(self.messages, "")


@unittest.skipIf(nibabel is None, "there is no nibabel on this machine")
class NiftiZarr(ReaderTest):
    def write(self, affine, header=None, shape=SMALL):
        write_group(self.folder / "a.nii.zarr", multiscales([[3, 2, 1]], unit="millimeter"))
        write_v3(self.folder / "a.nii.zarr/0", stored(), SMALL, codecs=())
        image = nibabel.Nifti1Image(numpy.zeros(shape[::-1], "i2"), affine)
        image.header.set_xyzt_units("mm")
        content = numpy.frombuffer(header if header is not None else image.header.binaryblock, "u1")
        write_v3(self.folder / "a.nii.zarr/nifti", content, (len(content),), codecs=())
        return image

    def test_the_header_gives_directions(self):
        c, s = math.cos(.3), math.sin(.3)
        affine = numpy.array([[c, -2 * s, 0, 10], [s, 2 * c, 0, 20], [0, 0, 3, 30], [0, 0, 0, 1]])
        image = self.write(affine)
        geometry = self.encodes(stored(), "a.nii.zarr")["geometry"]
        numpy.testing.assert_allclose(numpy.array(geometry["directions"]).T, image.affine[:3, :3], rtol=1e-6)
        numpy.testing.assert_allclose(geometry["origin"], image.affine[:3, 3], rtol=1e-6)
        self.assertEqual(geometry["space"], "right-anterior-superior")
        self.assertEqual(self.messages, "")

    def test_a_header_that_contradicts_the_scale_is_said(self):
        self.write(numpy.diag([1., 2, 5, 1]))
        geometry = self.encodes(stored(), "a.nii.zarr", says="the scale of OME-Zarr is 3 along z, but the header of NIfTI states 5")["geometry"]
        self.assertEqual(geometry["spacing"], [1, 2, 5])

    def test_a_header_that_cannot_be_read_is_said(self):
        for header, shape, said in ((b"\0" * 348, SMALL, "it does not begin with a header of NIfTI"), (b"\0" * 20, SMALL, "a header of NIfTI"),
                                    (None, (4, 5, 7), "it describes 7 x 5 x 4 samples")):
            self.write(numpy.eye(4), header, shape)
            self.assertEqual(self.encodes(stored(), "a.nii.zarr", says="the header of NIfTI in \"nifti\" is not read")["geometry"]["spacing"], [1, 2, 3])
            self.assertIn(said, self.messages)


if __name__ == "__main__":
    main()
