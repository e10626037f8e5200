"""Zarr and OME-Zarr: arrays of version 2 that python3-zarr writes, and of version 3."""

import itertools
import json
import math
import os
import shutil
import struct
import subprocess
import unittest
import zipfile

import zarr_files
from other_readers import PROGRAM, ReaderTest, main, numcodecs, numpy, random_samples, some, unless_sanitized, zarr
from zarr_files import multiscales, write_group, write_v3, zipped

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]


def volume(type="i2", shape=(7, 20, 31)):
    return random_samples(type, shape)


@unittest.skipIf(zarr is None, "there is no zarr on this machine")
class Version2(ReaderTest):
    def write(self, name, samples, chunks=(4, 8, 16), **options):
        shutil.rmtree(self.folder / name, ignore_errors=True)
        array = zarr.open(str(self.folder / name), mode="w", shape=samples.shape, chunks=chunks, dtype=samples.dtype, **options)
        array[:] = samples
        return name

    def test_every_type_and_byte_order(self):
        for type, order in itertools.product(TYPES, "<>"):
            truth = volume(type)
            self.encodes(truth, self.write("a.zarr", truth.astype(order + type)), "--range", "auto", what=order + type)

    def test_every_compressor_order_and_separator(self):
        truth = volume()
        compressors = [numcodecs.Blosc(cname, 5, shuffle) for cname, shuffle in
                       itertools.product(("lz4", "lz4hc", "zstd", "zlib", "blosclz"), (0, 1, 2))]
        compressors += [numcodecs.Zstd(), numcodecs.GZip(), numcodecs.Zlib(), None]
        for i, compressor in enumerate(compressors):
            for order, separator in [("C", "."), ("F", "/"), ("F", "."), ("C", "/")][i % 3:][:2]:
                name = self.write("a.zarr", truth, compressor=compressor, order=order, dimension_separator=separator)
                self.encodes(truth, name, what=(compressor, order, separator))

    def test_chunks_of_any_shape(self):
        truth = volume()
        for chunks in ((1, 20, 31), (7, 20, 31), (7, 1, 1), (16, 32, 64), (3, 7, 31), (2, 20, 5)):
            self.encodes(truth, self.write("a.zarr", truth, chunks), what=chunks)

    def test_missing_chunks_are_the_fill_value(self):
        for type, fill in (("i2", -7), ("u1", 255), ("f4", "NaN"), ("f8", math.inf), ("f4", -math.inf), ("f4", 0.1)):
            truth = volume(type)
            array = zarr.open(str(self.folder / "a.zarr"), mode="w", shape=truth.shape, chunks=(4, 8, 16), dtype=type,
                              fill_value=math.nan if fill == "NaN" else fill)
            array[4:, :8, 16:] = truth[4:, :8, 16:]
            self.encodes(array[:], "a.zarr", "--range", "-5000:5000" if type[0] == "f" else "auto", what=(type, fill),
                         says="11 of 12 chunks are missing; their samples are the fill value")

    def test_missing_chunks_without_a_fill_value_are_a_doubt(self):
        truth = volume()
        self.write("a.zarr", truth, fill_value=None)
        self.encodes(truth, "a.zarr")
        self.assertNotIn("missing", self.messages)
        (self.folder / "a.zarr/1.0.0").unlink()
        truth[4:, :8, :16] = 0
        self.encodes(truth, "a.zarr", says="1 of 12 chunks are missing, and the array does not say their values; they are encoded as 0")

    def test_groups_of_arrays(self):
        one, two = volume(), volume("u1", (3, 9, 8))
        group = zarr.open_group(str(self.folder / "a.zarr"), mode="w")
        group.create_dataset("x/one", data=one)
        group.create_dataset("two", data=two)
        group.create_dataset("table", data=numpy.zeros(9))
        message = self.assert_refused(64, "holds 2 volumes", "encode", "a.zarr")
        self.assertIn("two  8 x 9 x 3 uint8", message)
        self.assertIn("x/one  31 x 20 x 7 int16", message)
        for dataset, truth in (("/x/one", one), ("x/one", one), ("2", one), ("x", one), ("two", two), ("1", two)):
            self.encodes(truth, "a.zarr", "--dataset", dataset, what=dataset)
        self.assert_refused(64, "has no dataset nothing", "encode", "a.zarr", "--dataset", "nothing")
        self.assert_refused(64, "has no dataset ../b", "encode", "a.zarr", "--dataset", "../b")

    def test_attributes_of_xarray_count(self):
        """Scales and names of axes, as in HDF5; xarray.open_zarr applies them, too."""
        truth = volume(shape=(3, 4, 5))
        scale = {"scale_factor": 0.5, "add_offset": [-1000], "units": "HU"}
        write_v3(self.folder / "v3.zarr", truth, (3, 4, 5), attributes=scale)
        for name in (self.with_attributes(truth, scale), "v3.zarr"):
            pairs = dict(self.encodes(truth, name)["source"]["pairs"])
            self.assertEqual([pairs[key] for key in ("rescale_slope", "rescale_intercept", "rescale_units")], ["0.5", "-1000", "HU"])
        for attributes, said in (({"scale_factor": "abc"}, 'scale_factor is "abc"'), ({"scale_factor": 0}, "scale_factor is"),
                                 ({"add_offset": [1, 2]}, 'add_offset is "[1,2]"'), ({"_Unsigned": "true"}, '_Unsigned is "true", but samples are signed')):
            self.encodes(truth, self.with_attributes(truth, attributes), says=said)
            self.assertIn("how values follow from samples is not known", self.messages)
            self.assert_refused(64, said, "encode", "a.zarr", "-o", "b.tag", "--max-error", "5")
        self.encodes(truth, self.with_attributes(truth, {"_FillValue": -999}), says="samples that are -999, if there are any, stand for missing ones")
        for names, order in (("zyx", (0, 1, 2)), ("xyz", (2, 1, 0)), ("yxz", (2, 0, 1)), (("lev", "lat", "lon"), (0, 1, 2))):
            self.encodes(truth.transpose(order), self.with_attributes(truth, {"_ARRAY_DIMENSIONS": list(names)}), what=names)
        self.with_attributes(truth, {"_ARRAY_DIMENSIONS": ["time", "y", "x"]})
        self.encodes(truth[1:2], "a.zarr", "--series", "t2")

    def with_attributes(self, samples, attributes):
        array = zarr.open_array(str(self.folder / "a.zarr"), mode="w", shape=samples.shape, dtype=samples.dtype, chunks=(2, 4, 3))
        array[:] = samples
        array.attrs.update(attributes)
        return "a.zarr"

    def test_what_changes_samples_and_is_not_understood_is_refused_by_name(self):
        truth = volume()
        for options, text in (({"filters": [numcodecs.Delta("i2")]}, "has filters, which are not supported"),
                              ({"compressor": numcodecs.BZ2()}, "its codec \"bz2\" is not supported"),
                              ({"compressor": numcodecs.LZMA()}, "its codec \"lzma\" is not supported")):
            self.assert_refused(65, text, "encode", self.write("a.zarr", truth, **options))
        for type in ("i8", "u8", "f2", "?", "c8", "S4"):
            self.write("a.zarr", numpy.zeros((4, 4, 4), type))
            said = self.assert_refused(65, "has no array that is a volume of integers of 8, 16 or 32 bits", "encode", "a.zarr")
            self.assertIn(" is 4 x 4 x 4 ", said)

    def test_nested_and_zipped_stores(self):
        truth = volume()
        for store in (zarr.NestedDirectoryStore(str(self.folder / "a.zarr")), zarr.ZipStore(str(self.folder / "b.zip"), mode="w")):
            zarr.array(truth, chunks=(4, 8, 16), store=store)
            store.close()
        self.encodes(truth, "a.zarr")
        self.encodes(truth, "b.zip")


class Version3Test(ReaderTest):
    def write(self, samples, chunks=(4, 8, 16), name="a.zarr", **options):
        shutil.rmtree(self.folder / name, ignore_errors=True)
        write_v3(self.folder / name, samples, chunks, **options)
        return name


@unittest.skipIf(numcodecs is None, "there is no numcodecs on this machine")
class Version3(Version3Test):
    def test_every_type_and_byte_order(self):
        for type, endian in itertools.product(TYPES, ("little", "big")):
            truth = volume(type)
            self.encodes(truth, self.write(truth, endian=endian), "--range", "auto", what=(type, endian))

    def test_codecs_orders_and_keys(self):
        truth = volume()
        for codecs, order, (keys, separator) in some(itertools.product(
                ((), ("zstd",), ("gzip",), ("blosc",), ("crc32c",), ("zstd", "crc32c"), ("crc32c", "gzip")),
                (None, (2, 1, 0), (1, 0, 2), (2, 0, 1)), (("default", "/"), ("default", "."), ("v2", "."), ("v2", "/"))), 5):
            self.write(truth, codecs=codecs, order=order, keys=keys, separator=separator)
            self.encodes(truth, "a.zarr", what=(codecs, order, keys, separator))

    def test_shards(self):
        truth = volume("u2", (9, 20, 31))
        for location, codecs, order in itertools.product(("start", "end"), (("zstd",), ("blosc", "crc32c"), ()), (None, (2, 1, 0))):
            self.write(truth, (2, 5, 8), shards=(4, 10, 32), codecs=codecs, order=order, index_location=location)
            self.encodes(truth, "a.zarr", what=(location, codecs, order))

    def test_missing_chunks_are_the_fill_value(self):
        for type, fill, text in (("f4", math.nan, "NaN"), ("f4", math.inf, "Infinity"), ("f8", -math.inf, "-Infinity"), ("i2", -300, None),
                                 ("f4", struct.unpack(">f", bytes.fromhex("7fc00001"))[0], "0x7fc00001"),
                                 ("f8", 1.5, "0x3ff8000000000000")):
            for shards in (None, (8, 16, 32)):
                truth = volume(type)
                self.write(truth, shards=shards, fill=fill, fill_text=text, skip=lambda numbers: numbers == (0, 1, 1))
                truth[:4, 8:16, 16:] = fill
                self.encodes(truth, "a.zarr", *(("--range", "-5000:5000") if type[0] == "f" else ()), what=(type, fill, shards),
                             says="1 of 12 chunks are missing; their samples are the fill value")

    def test_what_is_not_understood_is_refused_by_name(self):
        truth = volume()
        self.write(truth)
        good = json.loads((self.folder / "a.zarr/zarr.json").read_text())
        for change, text in (({"storage_transformers": [{"name": "x"}]}, "has storage transformers"),
                             ({"chunk_grid": {"name": "rectangular"}}, "its chunk grid is"),
                             ({"codecs": good["codecs"] + [{"name": "pcodec"}]}, "pcodec"),
                             ({"codecs": [{"name": "cast_value"}] + good["codecs"]}, "cast_value"),
                             ({"codecs": good["codecs"][1:]}, "codec"),
                             ({"secret": {"must_understand": True}}, "has the key \"secret\""),
                             ({"secret": 1}, "has the key \"secret\""),
                             ({"fill_value": 70000}, "its fill value is"),
                             ({"fill_value": "0x12"}, "its fill value is"),
                             ({"chunk_key_encoding": {"name": "hashed"}}, "its chunk key encoding is"),
                             ({"shape": [7, 20]}, "not of one number of axes"),
                             ({"shape": [7, -20, 31]}, "its shape is"),
                             ({"zarr_format": 4}, "is not of Zarr version 3"),
                             ({"data_type": "int64"}, "31 x 20 x 7 int64"),
                             ({"data_type": {"name": "numpy.datetime64"}}, "numpy.datetime64")):
            (self.folder / "a.zarr/zarr.json").write_text(json.dumps(good | change))
            self.assert_refused(65, text, "encode", "a.zarr")
        more = {"extension": {"must_understand": False}, "consolidated_metadata": None}
        (self.folder / "a.zarr/zarr.json").write_text(json.dumps(good | more))
        self.encodes(truth, "a.zarr")


@unittest.skipIf(numcodecs is None, "there is no numcodecs on this machine")
class OmeZarr(Version3Test):
    def write_levels(self, truth, attributes, name="a.ome.zarr", levels=2):
        shutil.rmtree(self.folder / name, ignore_errors=True)
        write_group(self.folder / name, attributes)
        for i in range(levels):
            level = numpy.ascontiguousarray(truth[..., ::2**i, ::2**i, ::2**i])
            write_v3(self.folder / name / str(i), level, (1,) * (truth.ndim - 3) + (4, 8, 16))
        return name

    def test_the_finest_level_and_its_place(self):
        truth = volume()
        attributes = multiscales([[2, .5, .25], [4, 1, .5]], [[10, 20, 30], [11, 20.25, 30.125]])
        self.write_levels(truth, attributes)
        info = self.encodes(truth, "a.ome.zarr")
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["origin"]), ([.25, .5, 2], [30, 20, 10]))
        self.assertEqual(info["geometry"]["units"], ["um"] * 3)
        self.assertEqual(info["source"]["pairs"]["zarr_dataset"], "/0")
        self.assertEqual(json.loads(info["source"]["pairs"]["zarr_attributes"]), attributes)
        info = self.encodes(truth[::2, ::2, ::2], "a.ome.zarr", "--dataset", "1")
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["origin"]), ([.5, 1, 4], [30.125, 20.25, 11]))
        zipped(self.folder / "a.ome.zarr", self.folder / "a.ozx")
        self.encodes(truth, "a.ozx")
        os.rename(self.folder / "a.ozx", self.folder / "a.dat")
        self.encodes(truth, "a.dat")

    def test_a_first_level_that_is_not_the_finest_is_refused(self):
        truth = volume()
        attributes = multiscales([[4, 1, .5], [2, .5, .25]])
        self.write_levels(truth, attributes)
        folder = self.folder / "a.ome.zarr"
        for old, new in (("0", "x"), ("1", "0"), ("x", "1")):
            (folder / old).rename(folder / new)
        self.assert_refused(65, 'the first level, "0", should be the finest one, but "1" has more samples', "encode", "a.ome.zarr")
        for level, step in (("0", 2), ("1", 1)):
            info = self.encodes(truth[::step, ::step, ::step], "a.ome.zarr", "--dataset", level)
            self.assertEqual(info["geometry"]["spacing"], [.25 * step, .5 * step, 2 * step])
        (folder / "1" / "zarr.json").write_text("{")
        self.encodes(truth[::2, ::2, ::2], "a.ome.zarr")

    def test_transformations_of_all_levels_come_after_those_of_one(self):
        truth = volume()
        for more, spacing, origin in (
                ({"coordinateTransformations": [{"type": "scale", "scale": [10, 10, 10]}, {"type": "translation", "translation": [1, 2, 3]}]},
                 [10, 20, 30], [103, 102, 101]), ({"coordinateTransformations": [{"type": "identity"}]}, [1, 2, 3], [10, 10, 10])):
            self.write_levels(truth, multiscales([[3, 2, 1]], [[10, 10, 10]], **more), levels=1)
            info = self.encodes(truth, "a.ome.zarr")
            self.assertEqual((info["geometry"]["spacing"], info["geometry"]["origin"]), (spacing, origin))

    def test_units_become_one(self):
        truth = volume()
        attributes = multiscales([[1, 2, 3]])
        attributes["ome"]["multiscales"][0]["axes"][0]["unit"] = "millimeter"
        self.write_levels(truth, attributes, levels=1)
        info = self.encodes(truth, "a.ome.zarr")
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"]), ([3, 2, 1000], ["um"] * 3))

    def test_channels_and_moments_are_volumes(self):
        truth = volume(shape=(2, 3, 7, 20, 31))
        self.write_levels(truth, multiscales([[1, 1, 2, .5, .25]], axes="tczyx"), levels=1)
        for series, (t, c) in (("c1t1", (0, 0)), ("c3t2", (1, 2)), ("2", (0, 1)), ("4", (1, 0))):
            self.encodes(truth[t, c], "a.ome.zarr", "--series", series, what=series)
        self.assert_refused(64, "has no series c9", "encode", "a.ome.zarr", "--series", "c9")
        self.ok("encode", "a.ome.zarr", "-o", "all.tag", "--series", "all")
        for i, (t, c) in enumerate(itertools.product(range(2), range(3))):
            self.ok("decode", "all.tag", "--volume", i, "-o", "one.raw", "-f")
            self.assertEqual((self.folder / "one.raw").read_bytes(), truth[t, c].tobytes(), (t, c))
        self.write_levels(truth[:1, :1], multiscales([[1, 1, 2, .5, .25]], axes="tczyx"), levels=1)
        self.assertEqual(self.encodes(truth[0, 0], "a.ome.zarr")["geometry"]["spacing"], [.25, .5, 2])

    def test_axes_in_any_order(self):
        truth = volume()
        self.write_levels(truth.transpose(2, 0, 1), multiscales([[.25, 2, .5]], [[3, 1, 2]], axes="xzy"), levels=1)
        info = self.encodes(truth, "a.ome.zarr")
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["origin"]), ([.25, .5, 2], [3, 2, 1]))

    def test_other_transformations_are_refused(self):
        truth = volume()
        for one in ({"type": "rotation", "rotation": [1]}, {"type": "affine"}, {"type": "scale", "path": "x"}, {"type": "scale", "scale": [1, 2]},
                    {"type": "scale", "scale": [1, 2, "3"]}):
            attributes = multiscales([[1, 1, 1]])
            attributes["ome"]["multiscales"][0]["coordinateTransformations"] = [one]
            self.write_levels(truth, attributes, levels=1)
            self.assert_refused(65, one["type"], "encode", "a.ome.zarr")
        newer = {"version": "0.6", "multiscales": [{"coordinateSystems": [], "datasets": [{"path": "0"}]}]}
        self.write_levels(truth, {"ome": newer}, levels=1)
        self.assert_refused(65, "coordinate systems", "encode", "a.ome.zarr")

    def test_a_level_that_is_missing(self):
        self.write_levels(volume(), multiscales([[1, 1, 1]]), levels=0)
        self.assert_refused(65, "the finest level is \"0\", which is missing", "encode", "a.ome.zarr")

    def test_several_images(self):
        one, two = volume(), volume("u1", (5, 6, 7))
        write_group(self.folder / "a.zarr")
        self.write_levels(one, multiscales([[1, 1, 1]]), name="a.zarr/0", levels=1)
        self.write_levels(two, multiscales([[3, 2, 1]]), name="a.zarr/1", levels=1)
        self.assertIn("1/0  7 x 6 x 5 uint8", self.assert_refused(64, "holds 2 volumes", "encode", "a.zarr"))
        self.encodes(one, "a.zarr", "--dataset", "0")
        self.assertEqual(self.encodes(two, "a.zarr", "--dataset", "1")["geometry"]["spacing"], [1, 2, 3])

    @unittest.skipIf(zarr is None, "there is no zarr on this machine")
    def test_version_0_4(self):
        truth = volume()
        group = zarr.open_group(str(self.folder / "a.ome.zarr"), mode="w")
        group.create_dataset("0", data=truth, chunks=(4, 8, 16))
        group.attrs["multiscales"] = multiscales([[2, .5, .25]])["ome"]["multiscales"]
        info = self.encodes(truth, "a.ome.zarr")
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"]), ([.25, .5, 2], ["um"] * 3))

    def test_a_search_lists_it_once(self):
        self.write_levels(volume(), multiscales([[1, 1, 1]]), levels=1, name="b/a.ome.zarr")
        lines = [line for line in self.search("b").stdout.splitlines() if not line.startswith("#")]
        self.assertEqual([line.split("\t")[0] for line in lines], [str(self.folder / "b/a.ome.zarr")])


@unittest.skipIf(numcodecs is None, "there is no numcodecs on this machine")
class Damaged(Version3Test):
    def test_damaged_metadata(self):
        truth = volume()
        for content in ("", "{", "[]", "null", "{\"zarr_format\": 3}", "[" * 100000, "{\"a\":" * 100000, "\xff\xfe"):
            self.write(truth)
            (self.folder / "a.zarr/zarr.json").write_text(content)
            self.assert_refused(65, "zarr.json", "encode", "a.zarr")
        shutil.rmtree(self.folder / "a.zarr")
        os.mkdir(self.folder / "a.zarr")
        self.assert_refused(65, "has no array that is a volume", "encode", "a.zarr")

    def test_every_byte_of_the_metadata(self):
        """Is understood, or refused: no crash."""
        self.write(volume(shape=(3, 4, 5)), (2, 2, 4), shards=(4, 4, 8))
        path = self.folder / "a.zarr/zarr.json"
        good = path.read_text()
        for at in some(range(len(good)), 7):
            for byte in "0\"9{":
                path.write_text(good[:at] + byte + good[at + 1:])
                self.assertIn(self.tagrid("encode", "a.zarr", "-o", "a.tag", "-f").returncode, (0, 64, 65), (at, byte))

    def test_damaged_chunks(self):
        truth = volume()
        for codecs in (("zstd",), ("gzip",), ("blosc",), ("crc32c",), ()):
            self.write(truth, codecs=codecs)
            path = self.folder / "a.zarr/c/1/1/0"
            good = path.read_bytes()
            changed = [good[:9] + bytes([good[9] ^ 1]) + good[10:]] if "crc32c" in codecs else []
            for bad in [good[:-1], good[:20], b"", good + b"\0" * 200000] + changed:
                path.write_bytes(bad)
                self.assert_refused(65, "c/1/1/0", "encode", "a.zarr", "-o", "a.tag")
                self.assertFalse((self.folder / "a.tag").exists())

    def test_damaged_shards(self):
        truth = volume()
        for location in ("start", "end"):
            self.write(truth, shards=(8, 16, 32), index_location=location)
            path = self.folder / "a.zarr/c/0/0/0"
            good = path.read_bytes()
            index = len(good) - 132 if location == "end" else 0
            self.assertEqual(struct.unpack_from("<I", good, index + 128)[0], zarr_files.crc32c(good[index:index + 128]))
            changed = bytearray(good)
            changed[index + 17] ^= 1
            beyond = bytearray(good)
            struct.pack_into("<Q", beyond, index + 16, 2**63)
            struct.pack_into("<I", beyond, index + 128, zarr_files.crc32c(beyond[index:index + 128]))
            for bad, text in ((good[:100], "too short for the index"), (changed, "the checksum of its index"), (beyond, "leads beyond its end")):
                path.write_bytes(bad)
                self.assert_refused(65, text, "encode", "a.zarr")

    @unless_sanitized
    def test_huge_numbers_take_no_memory(self):
        self.write(volume())
        path = self.folder / "a.zarr/zarr.json"
        good = json.loads(path.read_text())
        grid = {"name": "regular", "configuration": {"chunk_shape": [2**20] * 3}}
        for change in ({"shape": [2**40] * 3}, {"shape": [2**61, 8, 16]}, {"shape": [0, 8, 16]}, {"chunk_grid": grid},
                       {"shape": [2**20] * 3, "chunk_grid": grid}):
            path.write_text(json.dumps(good | change))
            command = ["bash", "-c", 'ulimit -v 4000000; exec "$@"', "-", PROGRAM, "encode", "a.zarr", "-o", "a.tag"]
            run = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=60)
            self.assertEqual(run.returncode, 65, (change, run.stderr))

    def test_zip_tricks(self):
        truth = volume()
        self.write(truth)
        zipped(self.folder / "a.zarr", self.folder / "a.ozx")
        self.encodes(truth, "a.ozx")
        good = (self.folder / "a.ozx").read_bytes()
        for name in ("../x", "/x", "a/../../x", "a//b", "a\\b", "./x"):
            shutil.copy(self.folder / "a.ozx", self.folder / "b.ozx")
            with zipfile.ZipFile(self.folder / "b.ozx", "a") as file:
                file.writestr(name.replace("\\", "!"), b"x")
            content = (self.folder / "b.ozx").read_bytes().replace(b"a!b", b"a\\b")
            (self.folder / "b.ozx").write_bytes(content)
            self.assert_refused(65, "leads elsewhere", "encode", "b.ozx")
        shutil.copy(self.folder / "a.ozx", self.folder / "b.ozx")
        with zipfile.ZipFile(self.folder / "b.ozx", "a") as file:
            file.writestr("c/0/0/9", b"x")
        content = (self.folder / "b.ozx").read_bytes()
        (self.folder / "b.ozx").write_bytes(content.replace(b"c/0/0/9", b"c/0/0/0"))
        self.assert_refused(65, "has two members of the name", "encode", "b.ozx")
        zipped(self.folder / "a.zarr", self.folder / "c.ozx", zipfile.ZIP_DEFLATED)
        self.assert_refused(65, "must be stored as it is", "encode", "c.ozx")
        for size in (len(good) - 1, len(good) // 2, 100, 30):
            (self.folder / "b.ozx").write_bytes(good[:size])
            self.assert_refused(65, "b.ozx", "encode", "b.ozx")
        at = good.index(b"c/1/1/0") + 40
        (self.folder / "b.ozx").write_bytes(good[:at] + bytes([good[at] ^ 1]) + good[at + 1:])
        self.assert_refused(65, "is damaged: its checksum in the zip file", "encode", "b.ozx")
        for at in some(range(len(good) - 22, len(good)), 2):
            changed = good[:at] + b"\xff" + good[at + 1:]
            (self.folder / "b.ozx").write_bytes(changed)
            self.assertIn(self.tagrid("encode", "b.ozx", "-o", "b.tag", "-f").returncode, (0, 65), at)

    def test_links_out_of_the_folder(self):
        """Of chunks are followed, as those of slices are; a pipe is no chunk."""
        truth = volume()
        self.write(truth)
        os.rename(self.folder / "a.zarr/c/0/0/0", self.folder / "elsewhere")
        os.symlink(self.folder / "elsewhere", self.folder / "a.zarr/c/0/0/0")
        self.encodes(truth, "a.zarr")
        (self.folder / "a.zarr/c/0/0/0").unlink()
        os.mkfifo(self.folder / "a.zarr/c/0/0/0")
        self.assertIn("1 of 12 chunks are missing", self.ok("encode", "a.zarr", "-o", "p.tag").stderr)


if __name__ == "__main__":
    main()
