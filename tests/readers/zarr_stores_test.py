"""Zarr hierarchies that are large, deep, lost in part, or written by Python: nothing is lost without a word. zarr-python
judges what a chunk is.

    zarr_stores_test.py PROGRAM
"""

import itertools
import json
import math
import os
import shutil
import struct
import unittest

from other_readers import ReaderTest, main, numpy, zarr
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
        listed = [line for line in self.ok("convert", "--find", "a.zarr").stdout.splitlines() if not line.startswith("#")]
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


if __name__ == "__main__":
    main()
