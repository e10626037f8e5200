"""The chunks of Zarr 3 arrays are .tag files, and what would be registered of it is true.

    zarr_codec_test.py rewrite      writes the sample arrays anew, with zarr 3
"""

import json
import pathlib
import shutil
import sys
import tempfile
import unittest
import warnings

import numpy as np
import tagrid
from tagrid._lattice import decode_chunk, lattice_of

import parts
from volumes import TYPES, blobs, in_threads, module

ROOT = pathlib.Path(__file__).resolve().parents[2]
FORM = ROOT / "packaging/zarr-extensions/codecs/tagrid"
sys.path.append(str(ROOT / "tests/support"))
from versions import has_zarr_3

HAS_ZARR_3 = has_zarr_3()
SWAPPED = ()
if HAS_ZARR_3:
    import zarr
    from tagrid.zarr_codec import TagridCodec
    # zarr 3.0 does not create arrays from samples in the other byte order.
    SWAPPED = () if zarr.__version__.startswith("3.0.") else (">i2", ">f4")


def empty_like(samples, chunks, codec, store=None, compressors=None, **more):
    return zarr.create_array({} if store is None else store, shape=samples.shape, dtype=samples.dtype, chunks=chunks,
                             serializer=codec, compressors=compressors, **more)


def array_of(samples, chunks, codec, store=None, **more):
    array = empty_like(samples, chunks, codec, store, **more)
    array[...] = samples
    return array


@unittest.skipUnless(HAS_ZARR_3, "there is no zarr 3 (Debian 12 has zarr 2)")
class Codec(unittest.TestCase):
    def test_arrays_of_every_type_come_back(self):
        for dtype in (*TYPES, *SWAPPED):
            samples = blobs((20, 30, 25), np.dtype(dtype).newbyteorder("=")).astype(dtype)
            for chunks in ((16, 16, 16), (20, 30, 25), (7, 30, 1)):
                array = array_of(samples, chunks, TagridCodec())
                np.testing.assert_array_equal(array[...], samples)
                np.testing.assert_array_equal(array[3:18, ::2, 24], samples[3:18, ::2, 24])

    def test_axes_of_one_sample_do_not_count_and_other_arrays_are_refused(self):
        samples = blobs((20, 30, 25)).reshape(1, 20, 30, 1, 25)
        np.testing.assert_array_equal(array_of(samples, (1, 16, 16, 1, 16), TagridCodec())[...], samples)
        four = np.stack([blobs((9, 8, 7), seed=seed) for seed in range(3)])
        np.testing.assert_array_equal(array_of(four, (1, 9, 8, 7), TagridCodec())[...], four)
        for flat in (blobs((1, 1, 100)).ravel(), blobs((1, 30, 40))[0], np.array(5, "i2")):
            np.testing.assert_array_equal(array_of(flat, flat.shape, TagridCodec())[...], flat)
        self.assertRaises(TypeError, array_of, four, four.shape, TagridCodec())
        for dtype in ("i8", "?", "c8", "f2"):
            self.assertRaises(TypeError, array_of, np.ones((2, 2, 2), dtype), (2, 2, 2), TagridCodec())

    def test_an_array_on_disk_is_read_by_its_metadata_and_keeps_the_bound(self):
        samples = blobs((40, 50, 60), "float32")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "a.zarr")
            codec = TagridCodec(max_error=np.float32(0.5), effort="fast", threads=1)
            array_of(samples, (32, 32, 32), codec, str(path))
            described, = json.loads((path / "zarr.json").read_text())["codecs"]
            settings = {"max_error": 0.5, "effort": "fast", "whole_chunks": False}
            self.assertEqual(described, {"name": "tagrid", "configuration": settings})
            again = zarr.open_array(str(path), mode="r")
            self.assertEqual(again.metadata.codecs, (codec,))
            self.assertLessEqual(abs(again[...] - samples).max(), 0.5)
            chunks = [file for file in path.rglob("*") if file.is_file() and file.name != "zarr.json"]
            self.assertEqual(len(chunks), 8)
            self.assertLess(sum(file.stat().st_size for file in chunks), samples.nbytes / 2)
            # A chunk is a file for any other program.
            with tagrid.open(path / "c/0/0/0") as volume:
                self.assertEqual(volume.shape, (32, 32, 32))

    def test_the_bound_holds_however_a_chunk_is_written(self):
        for number, (samples, bound) in enumerate(parts.cases()):
            array = empty_like(samples, parts.CHUNKS, TagridCodec(max_error=bound, effort="fast", threads=1))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                parts.write_in_parts(array, samples, number)
            parts.check_within(self, array[...], samples, bound, f"{samples.dtype} within {bound}")

    def test_the_fill_value_of_the_array_is_kept_however_a_chunk_is_written(self):
        for number, (samples, bound) in enumerate(parts.cases()):
            samples, fill = parts.fill_of(samples, bound)
            array = empty_like(samples, parts.CHUNKS, TagridCodec(max_error=bound, threads=1), fill_value=fill)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                array[:, 2] = samples[:, 2]
                self.assertTrue((array[:, 3] == fill).all())
                parts.write_in_parts(array, samples, number)
            parts.check_within(self, array[...], samples, bound, f"{samples.dtype} within {bound}")
            self.assertTrue((array[...][samples == fill] == fill).all(), f"{samples.dtype} within {bound}")
        samples = blobs((9, 8, 7), "float32")
        for fill in (0.0, np.nan, -np.inf):
            array_of(samples, (9, 8, 7), TagridCodec(max_error=1, whole_chunks=True), fill_value=fill)
        self.assertRaisesRegex(tagrid.ArgumentError, "the fill value 3.* is not kept", array_of, samples, (9, 8, 7),
                               TagridCodec(max_error=1, whole_chunks=True), fill_value=3)

    def test_chunks_that_are_written_in_parts_are_told_of_or_refused(self):
        samples = blobs((32, 32, 20))
        array = empty_like(samples, (16, 16, 10), TagridCodec(max_error=5))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            array[...] = samples
            array[16:, :16] = samples[16:, :16]
        with self.assertWarnsRegex(UserWarning, r"a part of a chunk of 2560 samples .* array.rechunk\(target.chunks\)"):
            array[3] = samples[3]
        whole = array_of(samples, (16, 16, 10), TagridCodec(max_error=5, whole_chunks=True))
        stored = whole[...]
        self.assertRaisesRegex(tagrid.ArgumentError, "Write whole chunks", whole.__setitem__, 3, samples[3])
        np.testing.assert_array_equal(whole[...], stored)

    def test_it_works_inside_shards_and_after_a_transposition_and_before_a_checksum(self):
        from zarr.codecs import Crc32cCodec, TransposeCodec
        samples = blobs((40, 50, 60))
        shards = array_of(samples, (16, 16, 16), TagridCodec(max_error=3), shards=(32, 32, 32))
        self.assertLessEqual(abs(shards[...].astype(int) - samples).max(), 3)
        turned = array_of(samples, (16, 50, 60), TagridCodec(), filters=[TransposeCodec(order=(2, 0, 1))])
        np.testing.assert_array_equal(turned[...], samples)
        checked = array_of(samples, (32, 32, 32), TagridCodec(), compressors=[Crc32cCodec()])
        np.testing.assert_array_equal(checked[...], samples)

    def test_threads_read_and_write_at_once(self):
        samples = blobs((64, 32, 32))
        array = array_of(samples, (16, 16, 16), TagridCodec())

        def work(seed):
            slab = slice(16 * seed, 16 * seed + 16)
            array[slab] = samples[slab] + seed
            np.testing.assert_array_equal(array[slab], samples[slab] + seed)

        in_threads(work, range(4))
        np.testing.assert_array_equal(array[48:], samples[48:] + 3)

    def test_damaged_chunks_and_those_of_other_arrays_are_an_error(self):
        samples = blobs((9, 9, 9))
        bytes_of = {name: tagrid.encode(data, **more) for name, data, more in (
            ("shape", blobs((9, 9, 8)), {}), ("type", samples.astype("u2"), {}), ("bound", samples, {"max_error": 7}))}
        whole = tagrid.encode(samples)
        for damaged in (whole[:-3], b"", b"PK", *bytes_of.values()):
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder, "a.zarr")
                array = array_of(samples, (9, 9, 9), TagridCodec(max_error=2), str(path))
                (path / "c/0/0/0").write_bytes(damaged)
                self.assertRaises(tagrid.DamagedError, array.__getitem__, ...)
                (path / "c/0/0/0").write_bytes(whole)
                np.testing.assert_array_equal(array[...], samples)

    def test_settings_that_cannot_be_are_refused(self):
        for wrong in ({"max_error": -1}, {"max_error": np.inf}, {"effort": "most"}):
            self.assertRaises(tagrid.ArgumentError, TagridCodec, **wrong)
        for wrong in ({"max_error": "5"}, {"whole_chunks": 1}, {"threads": "all"}):
            self.assertRaises(TypeError, TagridCodec, **wrong)
        self.assertEqual(TagridCodec.from_dict({"name": "tagrid"}), TagridCodec())
        self.assertRaisesRegex(tagrid.ArgumentError, "no setting 'bits'", TagridCodec.from_dict,
                               {"name": "tagrid", "configuration": {"bits": 5}})
        self.assertRaises(tagrid.ArgumentError, TagridCodec.from_dict, {"name": "zstd"})

    def test_sample_arrays_are_what_zarr_reads(self):
        for path in sorted((FORM / "sample_data").glob("*.zarr")):
            array = zarr.open_array(str(path), mode="r")
            np.testing.assert_array_equal(array[...], samples_of(path))


def example(dtype):
    """The samples of the arrays in sample_data before they were encoded."""
    z, y, x = np.ogrid[:6, :7, :8]
    return (100 * z - 7 * y * y + x + ((3 * x + 5 * y + 7 * z) % 11 == 0) * 40).astype(dtype)


def rewrite():
    for name, chunks, codec in (("lossless_int16", (6, 4, 8), TagridCodec()),
                                ("bounded_float32", (6, 7, 8), TagridCodec(max_error=0.5)),
                                ("whole_chunks_uint8", (6, 7, 8), TagridCodec(max_error=5, whole_chunks=True))):
        path = FORM / f"sample_data/{name}.zarr"
        shutil.rmtree(path, ignore_errors=True)
        dtype = name.rpartition("_")[2]
        array_of(example(dtype), chunks, codec, str(path), fill_value=-9999 if dtype == "float32" else 0)


def samples_of(path):
    """An array of sample_data, put together without zarr: chunks by their keys, each by tagrid."""
    about = json.loads((path / "zarr.json").read_text())
    chunk = about["chunk_grid"]["configuration"]["chunk_shape"]
    array = np.full(about["shape"], about["fill_value"], about["data_type"])
    for file in (path / "c").rglob("*"):
        if file.is_file():
            index = [int(part) for part in file.relative_to(path / "c").parts]
            with tagrid.open(file) as volume:
                samples = decode_chunk(volume).reshape(chunk)
            place = tuple(slice(i * n, (i + 1) * n) for i, n in zip(index, chunk))
            array[place] = samples[tuple(slice(n) for n in array[place].shape)]
    return array


class Registration(unittest.TestCase):
    def test_sample_arrays_hold_what_they_say(self):
        paths = sorted((FORM / "sample_data").glob("*.zarr"))
        self.assertEqual([path.stem for path in paths], ["bounded_float32", "lossless_int16", "whole_chunks_uint8"])
        for path in paths:
            about = json.loads((path / "zarr.json").read_text())
            codec, = about["codecs"]
            bound = codec["configuration"]["max_error"]
            expected = example(about["data_type"])
            self.assertLessEqual(np.abs(samples_of(path).astype(float) - expected).max(), bound, path.name)
            with tagrid.open(path / "c/0/0/0") as volume:
                self.assertEqual(lattice_of(volume)[0] > 0, bound > 0 and not codec["configuration"]["whole_chunks"])

    def test_the_schema_accepts_what_the_codec_writes_and_nothing_else(self):
        schema = json.loads((FORM / "schema.json").read_text())
        configuration = schema["properties"]["configuration"]
        self.assertEqual(set(configuration["properties"]), {"max_error", "effort", "whole_chunks"})
        self.assertEqual(configuration["properties"]["effort"]["enum"], ["default", "fast", "best"])
        Validator = module("jsonschema").Draft202012Validator
        Validator.check_schema(schema)
        check = Validator(schema)
        for path in [*(FORM / "examples").glob("*.json"), *(FORM / "sample_data").glob("*/zarr.json")]:
            about = json.loads(path.read_text())
            check.validate(about["codecs"][0] if "codecs" in about else about)
        for wrong in ({"max_error": -1}, {"max_error": "5"}, {"effort": "most"}, {"whole_chunks": 1}, {"bits": 3}):
            self.assertFalse(check.is_valid({"name": "tagrid", "configuration": wrong}), wrong)
        self.assertTrue(check.is_valid({"name": "tagrid"}))
        self.assertFalse(check.is_valid({"name": "zfp"}))
        self.assertFalse(check.is_valid({"name": "tagrid", "more": 1}))

    def test_the_entry_point_is_the_codec(self):
        points = (ROOT / "python/entry_points.txt").read_text()
        self.assertIn("[zarr.codecs]\ntagrid = tagrid.zarr_codec:TagridCodec\n", points)


if __name__ == "__main__":
    if sys.argv[1:] == ["rewrite"]:
        sys.exit(rewrite())
    if not HAS_ZARR_3:
        print("in part not tested: there is no zarr 3 (Debian 12 has zarr 2)")
    unittest.main(argv=["zarr_codec_test"])
