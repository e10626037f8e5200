"""The filter's options for h5py, and chunks that several threads encode and decode.

    hdf5_test.py PYTHON_FOLDER PLUGINS
        PYTHON_FOLDER: the folder with the built package; PLUGINS: that with the HDF5 plugin
"""

import os
import pathlib
import subprocess
import struct
import sys
import unittest

PYTHON = sys.argv[1]
sys.path.insert(0, PYTHON)
os.environ["HDF5_PLUGIN_PATH"] = sys.argv[2]  # before the library is loaded

try:
    import h5py
except ImportError as missing:
    print(f"skipped: {missing} (python3-h5py)")
    sys.exit(0)
import numpy
import tagrid
import tagrid.hdf5

import parts

from volumes import temporary_folder

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from versions import words_of_filter


def waves(shape, type="<i2"):
    axes = numpy.meshgrid(*[numpy.arange(n) for n in shape], indexing="ij")
    field = 60 + sum(15 * numpy.sin(axis / (7 + 2 * i)) for i, axis in enumerate(axes))
    return (field + numpy.random.default_rng(1).normal(0, 2, shape)).astype(type)


class Hdf5Test(unittest.TestCase):
    def setUp(self):
        self.path = temporary_folder(self) / "a.h5"

    def test_the_filter_is_given_as_options_of_create_dataset(self):
        data = waves((30, 40, 50))
        sizes = {}
        for effort in ("default", "best"):
            with h5py.File(self.path, "w") as file:
                file.create_dataset("a", data=data, chunks=(30, 40, 50), **tagrid.hdf5.Filter(max_error=1.5, effort=effort))
            with h5py.File(self.path) as file:
                self.assertEqual(tagrid.hdf5.filter_of(file["a"]).max_error, 1.5)
                self.assertEqual(tagrid.hdf5.filter_of(file["a"]).effort, effort)
                self.assertEqual(numpy.abs(file["a"][...] - data).max(), 1)
                sizes[effort] = file["a"].id.get_storage_size()
        self.assertLess(sizes["best"], sizes["default"])
        with h5py.File(self.path, "w") as file:
            settings = tagrid.hdf5.Filter(max_error=1.5)
            one = file.create_dataset("a", data=data, chunks=(30, 40, 50), compression=settings)
            self.assertEqual(tagrid.hdf5.filter_of(one), settings)
            self.assertEqual(len({settings, tagrid.hdf5.Filter(1.5), tagrid.hdf5.Filter(2)}), 2)
            for threads, kind in (("2", TypeError), (-1, tagrid.ArgumentError)):
                self.assertRaises(kind, tagrid.hdf5.read, one, threads)
                self.assertRaises(kind, tagrid.hdf5.write, one, data, threads)
        self.assertRaisesRegex(TypeError, "data set of an open file", tagrid.hdf5.read, str(self.path))
        for bad in ({"max_error": -1}, {"max_error": float("nan")}, {"max_error": float("inf")}, {"effort": "most"}):
            with self.assertRaises(ValueError):
                tagrid.hdf5.Filter(**bad)

    def test_threads_write_what_the_filter_reads_and_read_what_it_wrote(self):
        for type, shape, chunks in [("<i2", (70, 50, 33), (32, 32, 32)), (">f4", (9, 20, 21, 22), (1, 16, 16, 16)), ("u1", (50,), (16,))]:
            data = waves(shape, type)
            with h5py.File(self.path, "w") as file:
                one = file.create_dataset("one", shape, type, chunks=chunks, fillvalue=3, **tagrid.hdf5.Filter(max_error=1))
                two = file.create_dataset("two", data=data, chunks=chunks, fillvalue=3, **tagrid.hdf5.Filter(max_error=1))
                tagrid.hdf5.write(one, data, threads=3)
            with h5py.File(self.path) as file:
                for name in ("one", "two"):
                    found = tagrid.hdf5.read(file[name], threads=3)
                    self.assertLessEqual(numpy.abs(found.astype("f8") - data).max(), 1)
                    numpy.testing.assert_array_equal(found, file[name][...])
                    self.assertEqual(found.dtype, data.dtype)

    def test_the_bound_holds_however_a_chunk_is_written(self):
        for number, (samples, bound) in enumerate(parts.cases()):
            what = f"{samples.dtype} within {bound}"
            for whole in (False, True) if bound < 0.6 and samples.dtype.kind != "f" else (False,):
                settings = tagrid.hdf5.Filter(max_error=bound, effort="fast", whole_chunks=whole)
                # Without a cache, each write decodes and encodes the chunks that it meets.
                with h5py.File(self.path, "w", rdcc_nbytes=0) as file:
                    one = file.create_dataset("a", samples.shape, samples.dtype, chunks=parts.CHUNKS, **settings)
                    two = file.create_dataset("b", samples.shape, samples.dtype, chunks=parts.CHUNKS, **settings)
                    tagrid.hdf5.write(two, samples, threads=1)
                    parts.write_in_parts(one, samples, number)
                    parts.write_in_parts(two, samples, number)
                with h5py.File(self.path) as file:
                    for name in "ab":
                        parts.check_within(self, file[name][...], samples, bound, what)
                        numpy.testing.assert_array_equal(tagrid.hdf5.read(file[name], 1), file[name][...])

    def test_a_fill_value_is_kept_however_a_chunk_is_written(self):
        for number, (samples, bound) in enumerate(parts.cases()):
            samples, fill = parts.fill_of(samples, bound)
            for type in (samples.dtype, samples.dtype.newbyteorder(">")):
                with h5py.File(self.path, "w", rdcc_nbytes=0) as file:
                    one, two = (file.create_dataset(name, samples.shape, type, chunks=parts.CHUNKS, fillvalue=fill,
                                                    **tagrid.hdf5.Filter(max_error=bound)) for name in "ab")
                    one[:5, ::2] = samples[:5, ::2]
                    one[:5, 1::2] = samples[:5, 1::2]
                    tagrid.hdf5.write(two, samples, threads=1)
                    two[3] = samples[3]
                with h5py.File(self.path) as file:
                    found = file["a"][...].astype(samples.dtype)
                    parts.check_within(self, found[:5], samples[:5], bound, f"{type} within {bound}")
                    self.assertTrue((found[5:] == fill).all(), f"{type} within {bound}")
                    parts.check_within(self, file["b"][...].astype(samples.dtype), samples, bound, f"{type} within {bound}")
                    for name, end in (("a", 5), ("b", None)):
                        missing = samples[:end] == fill
                        self.assertTrue((file[name][:end][missing] == fill).all(), f"{type} within {bound}")
                        numpy.testing.assert_array_equal(tagrid.hdf5.read(file[name], 1), file[name][...])

    def test_encoding_what_was_decoded_changes_no_byte(self):
        for samples, bound in parts.cases():
            settings, chunk, files = tagrid.hdf5.Filter(bound), samples[:4, :5], []
            for _ in range(2):
                with h5py.File(self.path, "w") as file:
                    one = file.create_dataset("a", data=chunk, chunks=chunk.shape, **settings)
                    two = file.create_dataset("b", chunk.shape, chunk.dtype, chunks=chunk.shape, **settings)
                    tagrid.hdf5.write(two, chunk, threads=1)
                    file.flush()
                    files.append([each.id.read_direct_chunk((0, 0, 0))[1] for each in (one, two)])
                    chunk = one[...]
                    # The package and the filter round alike, and read each other's chunks.
                    for found in (two[...], tagrid.hdf5.read(one, 1), tagrid.hdf5.read(two, 1)):
                        self.assertEqual(found.tobytes(), chunk.tobytes(), f"{samples.dtype} within {bound}")
            self.assertEqual(files[0], files[1], f"{samples.dtype} within {bound}")

    def test_chunks_that_were_never_written_have_the_fill_value(self):
        with h5py.File(self.path, "w") as file:
            set = file.create_dataset("a", (40, 16, 16), "<i2", chunks=(16, 16, 16), fillvalue=7, **tagrid.hdf5.Filter())
            set[:16] = 1
            found = tagrid.hdf5.read(set)
        self.assertTrue((found[:16] == 1).all() and (found[16:] == 7).all())

    def test_files_of_python_are_read_and_written(self):
        code = """if True:
            import io, sys, time
            import h5py, numpy, tagrid.hdf5

            class Slow(io.BytesIO):
                def readinto(self, buffer):
                    time.sleep(0.001)
                    return super().readinto(buffer)

                def write(self, data):
                    time.sleep(0.001)
                    return super().write(data)

            data, file = numpy.random.default_rng(1).integers(-99, 99, (70, 80, 90)).astype("i2"), Slow()
            with h5py.File(file, "w") as opened:
                one = opened.create_dataset("a", data.shape, data.dtype, chunks=(16, 16, 16), **tagrid.hdf5.Filter())
                tagrid.hdf5.write(one, data, threads=4)
            with h5py.File(file, "r") as opened:
                assert (tagrid.hdf5.read(opened["a"], threads=4) == data).all()
            """
        # Threads that wait for each other would never end.
        subprocess.run([sys.executable, "-B", "-c", code], check=True, timeout=120, env=os.environ | {"PYTHONPATH": PYTHON})

    def test_samples_that_do_not_fit_are_refused_and_not_wrapped_around(self):
        data = waves((30, 40, 50))
        with h5py.File(self.path, "w") as file:
            whole = file.create_dataset("whole", data.shape, "<i2", chunks=(16, 16, 16), **tagrid.hdf5.Filter())
            short = file.create_dataset("short", data.shape, ">f4", chunks=(16, 16, 16), **tagrid.hdf5.Filter())
            for fits in (data.astype("int64"), data.tolist(), data.astype(">i2"), (data % 100).astype("uint8")):
                tagrid.hdf5.write(whole, fits)
                file.flush()
                numpy.testing.assert_array_equal(whole[...], fits)
            floats = data.astype("float64")
            floats[3, 4, 5:8] = numpy.nan, numpy.inf, 0.1
            tagrid.hdf5.write(short, floats)
            file.flush()
            numpy.testing.assert_array_equal(short[...], floats.astype("float32"))
            for too_large, message in ((data.astype("int64") + 2**16, "does not fit into int16"),
                                       (numpy.full(data.shape, 40000, "uint16"), "the sample 40000 does not fit")):
                self.assertRaisesRegex(tagrid.ArgumentError, message, tagrid.hdf5.write, whole, too_large)
            self.assertRaisesRegex(tagrid.ArgumentError, "1e\\+39 does not fit into float32", tagrid.hdf5.write, short,
                                   numpy.full(data.shape, 1e39))
            self.assertRaisesRegex(TypeError, "convert them first", tagrid.hdf5.write, whole, data + 0.5)
            self.assertRaisesRegex(TypeError, "fill it first", tagrid.hdf5.write, whole, numpy.ma.masked_less(data, 60))

    def test_a_chunk_of_another_volume_is_an_error_as_it_is_for_the_filter(self):
        data = waves((30, 40, 50))
        with h5py.File(self.path, "w") as file:
            dataset = file.create_dataset("a", data.shape, "<i2", chunks=data.shape, **tagrid.hdf5.Filter())
            for other in (data.T, data.reshape(40, 30, 50), data.astype("uint16"), data.astype("float32"), data[:3]):
                dataset.id.write_direct_chunk((0, 0, 0), tagrid.encode(other))
                file.flush()
                self.assertRaises(OSError, lambda: dataset[...])
                self.assertRaisesRegex(tagrid.DamagedError, r"/a: the chunk at \(0, 0, 0\): it is a volume of the shape",
                                       tagrid.hdf5.read, dataset)
            for file_of_chunk in (tagrid.encode(data, max_error=1), tagrid.encode(data, grid_only=True, max_error=None)):
                dataset.id.write_direct_chunk((0, 0, 0), file_of_chunk)
                file.flush()
                self.assertRaises(OSError, lambda: dataset[...])
                self.assertRaisesRegex(tagrid.DamagedError, "within 0, the bound of the data set", tagrid.hdf5.read, dataset)
            dataset.id.write_direct_chunk((0, 0, 0), tagrid.encode(data)[:-3])
            self.assertRaisesRegex(tagrid.DamagedError, r"/a: the chunk at \(0, 0, 0\): ", tagrid.hdf5.read, dataset)

    def test_no_sample_changes_its_side_of_a_threshold(self):
        random = numpy.random.default_rng(3)
        smooth = 300 * numpy.sin(numpy.linspace(0, 9, 40 * 40 * 50)).reshape(40, 40, 50)
        for dtype, thresholds in (("<i2", (-100, 50.5)), (">f4", (0.1, 200)), ("<f8", 0.1)):
            data = (smooth + random.normal(0, 15, smooth.shape)).astype(dtype)
            settings = tagrid.hdf5.Filter(12, whole_chunks=True, threshold=thresholds)
            with h5py.File(self.path, "w") as file:
                file.create_dataset("a", data=data, chunks=(32, 32, 32), **settings)
                by_threads = file.create_dataset("b", data.shape, dtype, chunks=(32, 32, 32), **settings)
                tagrid.hdf5.write(by_threads, data)
            # Opened anew: HDF5 keeps chunks that it wrote.
            with h5py.File(self.path, "r+") as file:
                by_hdf5, by_threads = file["a"], file["b"]
                for back in (by_hdf5[:], by_threads[:], tagrid.hdf5.read(by_hdf5), tagrid.hdf5.read(by_threads)):
                    self.assertGreater(numpy.abs(back - data).max(), 1)
                    self.assertLessEqual(numpy.abs(back.astype("f8") - data).max(), 12)
                    for threshold in numpy.atleast_1d(thresholds):
                        numpy.testing.assert_array_equal(back >= threshold, data >= threshold)
                self.assertEqual(len(tagrid.hdf5.filter_of(by_hdf5).thresholds), numpy.size(thresholds))
                # A chunk without the thresholds of its data set is not handed out.
                other = numpy.ascontiguousarray(data[:32, :32, :32]).astype(data.dtype.newbyteorder("="))
                by_hdf5.id.write_direct_chunk((0, 0, 0), tagrid.encode(numpy.pad(other, [(0, 32 - n) for n in other.shape]), max_error=12))
                self.assertRaises(OSError, lambda: by_hdf5[0, 0, 0])
                self.assertRaisesRegex(tagrid.DamagedError, "threshold", tagrid.hdf5.read, by_hdf5)
            with h5py.File(self.path, "w") as file:
                file.create_dataset("a", data=data, chunks=(32, 32, 32), **settings)
                file.create_dataset("b", data=data, chunks=(32, 32, 32), **tagrid.hdf5.Filter(12))
            with h5py.File(self.path, "r+") as file:
                whole, parts = file["a"], file["b"]
                # Numbers of a lattice are exact, but not on the sides of samples.
                whole.id.write_direct_chunk((0, 0, 0), parts.id.read_direct_chunk((0, 0, 0))[1])
                self.assertRaises(OSError, lambda: whole[0, 0, 0])
                self.assertRaisesRegex(tagrid.DamagedError, "threshold", tagrid.hdf5.read, whole)
        with h5py.File(self.path, "w") as file:
            for numbers in (numpy.nan, 300, (200, 100)):
                given = tagrid.hdf5.Filter(12, whole_chunks=True).filter_options + sum((
                    struct.unpack("<2I", struct.pack("<d", number)) for number in numpy.atleast_1d(numbers)), ())
                self.assertRaises(ValueError, file.create_dataset, "c", (40, 40, 40), "u1", chunks=(32, 32, 32),
                                  compression=tagrid.hdf5.FILTER_ID, compression_opts=given)
        self.assertRaisesRegex(tagrid.ArgumentError, "at most 2", tagrid.hdf5.Filter, 12, whole_chunks=True, threshold=(1, 2, 3))
        self.assertRaisesRegex(tagrid.ArgumentError, "whole_chunks", tagrid.hdf5.Filter, 12, threshold=5)
        self.assertRaisesRegex(tagrid.ArgumentError, "threshold", tagrid.hdf5.Filter, 12, whole_chunks=True, threshold="a")

    def test_a_chunk_that_was_coded_elsewhere_with_a_bound_needs_whole_chunks(self):
        data = waves((30, 40, 50))
        with h5py.File(self.path, "w") as file:
            for name, whole in (("a", True), ("b", False)):
                dataset = file.create_dataset(name, data.shape, "<i2", chunks=data.shape, **tagrid.hdf5.Filter(2, whole_chunks=whole))
                dataset.id.write_direct_chunk((0, 0, 0), tagrid.encode(data, max_error=1))
                self.assertLessEqual(numpy.abs(tagrid.hdf5.read(dataset) - data).max(), 1)
            self.assertLessEqual(numpy.abs(file["a"][...] - data).max(), 1)
            why = words_of_filter("whole_chunks in Python")
            self.assertRaisesRegex(OSError, why, lambda: file["b"][...])
            self.assertTrue(tagrid.hdf5.filter_of(file["a"]).whole_chunks)
            self.assertRaises(TypeError, tagrid.hdf5.Filter, 2, whole_chunks=1)

    def test_a_lattice_of_another_bound_or_type_or_none_is_an_error(self):
        for type, numbers, good in (("<i2", "int16", "int16"), ("<f4", "int32", "float32 5:7fc00000 -3:ff800000")):
            data = (numpy.arange(4 * 5 * 6) % 9 - 4).reshape(4, 5, 6).astype(numbers)
            step = 5 if numbers == "int16" else 4
            with h5py.File(self.path, "w") as file:
                dataset = file.create_dataset("a", data.shape, type, chunks=data.shape, **tagrid.hdf5.Filter(2))
                dataset.id.write_direct_chunk((0, 0, 0), tagrid.encode(data, metadata={"lattice": good, "rescale_slope": str(step)}))
                expected = (step * data).astype(type)
                expected[data == -3] = -numpy.inf if type == "<f4" else -15
                numpy.testing.assert_array_equal(dataset[...], expected)
                numpy.testing.assert_array_equal(tagrid.hdf5.read(dataset), expected)
                for slope, lattice in (("7", good), ("nan", good), ("x", good), (None, good), (step, "int8"), (step, "uint16"),
                                       (step, "float64"), (step, good + " "), (step, good + " 5"), (step, good + " 5:zz"), (step, "")):
                    pairs = {"lattice": lattice} if slope is None else {"lattice": lattice, "rescale_slope": str(slope)}
                    dataset.id.write_direct_chunk((0, 0, 0), tagrid.encode(data, metadata=pairs))
                    with self.subTest(lattice=lattice, slope=slope):
                        if not lattice.endswith(" "):  # which Python takes for nothing
                            self.assertRaises(tagrid.DamagedError, tagrid.hdf5.read, dataset)
                        self.assertRaises(OSError, lambda: dataset[...])
                dataset.id.write_direct_chunk((0, 0, 0), tagrid.encode(data.astype("int8"), metadata={"lattice": good, "rescale_slope": "5"}))
                self.assertRaises(tagrid.DamagedError, tagrid.hdf5.read, dataset)
                self.assertRaises(OSError, lambda: dataset[...])

    def test_data_sets_without_the_filter_are_refused(self):
        with h5py.File(self.path, "w") as file:
            for name, options in [("a", {}), ("b", {"compression": "gzip"}), ("c", {"fletcher32": True, **tagrid.hdf5.Filter()})]:
                set = file.create_dataset(name, (4, 4, 4), "<i2", chunks=(4, 4, 4), **options)
                with self.assertRaisesRegex(tagrid.ArgumentError, "only filter"):
                    tagrid.hdf5.write(set, numpy.zeros((4, 4, 4)))
                with self.assertRaisesRegex(tagrid.ArgumentError, "only filter"):
                    tagrid.hdf5.read(set)
            good = file.create_dataset("d", (4, 4, 4), "<i2", chunks=(4, 4, 4), **tagrid.hdf5.Filter())
            with self.assertRaisesRegex(tagrid.ArgumentError, "shape"):
                tagrid.hdf5.write(good, numpy.zeros((4, 4, 5)))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
