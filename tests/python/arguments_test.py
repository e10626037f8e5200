"""Arguments of a wrong kind: the message names the argument, and says what helps. Nothing of the extension shows."""

import gc
import io
import multiprocessing
import pickle
import subprocess
import sys
import unittest
import warnings

import numpy as np
import tagrid

from volumes import blobs, temporary_folder

SHAPE = (20, 30, 40)
SAMPLES = blobs(SHAPE)
DATA = tagrid.encode(SAMPLES, cube=8, brick=2)


class KnowsItsBytes:
    """A source that another process may have, too."""

    def __init__(self, data):
        self.data, self.size = data, len(data)

    def read_at(self, offset, size):
        return self.data[offset:offset + size]


def sum_of(slice_):
    return int(Arguments.volume[slice_].sum())


shared = None


def sum_of_shared(slice_):
    return int(shared[slice_].sum())


class Arguments(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder(cls)
        cls.path = cls.folder / "a.tag"
        cls.path.write_bytes(DATA)
        cls.volume = tagrid.open(cls.path)

    def refused(self, kind, words, call, *arguments, **named):
        """The call raises exactly this class, with all of these words."""
        with self.assertRaises(kind) as raised:
            call(*arguments, **named)
        for word in words.split("|"):
            self.assertIn(word, str(raised.exception))
        for word in ("pybind", "incompatible", "Unable to cast"):
            self.assertNotIn(word, str(raised.exception))
        return raised.exception

    def test_settings_of_a_call_are_numbers(self):
        volume = self.volume
        for call in (volume.read, volume.mesh, volume.verify, volume.active_points):
            self.refused(TypeError, "threads must be a whole number, not 'all'", call, threads="all")
            self.refused(TypeError, "threads must be a whole number, not 1.5", call, threads=1.5)
            self.refused(TypeError, "memory_limit must be a whole number of bytes, such as 2**30, not '1G'", call, memory_limit="1G")
        self.refused(TypeError, "threads must be a whole number, not 'r'", tagrid.open, self.path, "r")
        for name, value in (("threads", 2**40), ("memory_limit", -1), ("memory_limit", 2**64), ("level", 2**70)):
            self.refused(tagrid.ArgumentError, f"not {value}", volume.mesh, **{name: value})
        self.refused(TypeError, "level must be a whole number, not 1.5", volume.mesh, level=1.5)
        self.refused(TypeError, "iso must be a number, not 'bone'", volume.surface, "bone")
        self.refused(tagrid.ArgumentError, "iso must be a number, not nan", volume.surface, float("nan"))

    def test_regions_and_steps_are_whole_numbers(self):
        read = self.volume.read
        wrong = [5, (0, 5, 0, 5, 0, 5), ((0, 5), (0, 5)), ((0, 5), None, (0, 5)), ((0, 5.0), (0, 5), (0, 5)), "all", np.s_[0:5, :, 2:4],
                 ((0, 1, 2),) * 3]
        for region in wrong:
            self.refused(tagrid.ArgumentError, "a region is ((z0, z1), (y0, y1), (x0, x1))|volume[z0:z1, y0:y1, x0:x1]", read, region)
        # Those that are not in the volume.
        for pair in ((0, 21), (-1, 3), (3, 3), (2**70, 2**71)):
            with self.subTest(pair), self.assertRaises((tagrid.ArgumentError, TypeError)):
                read((pair, (0, 1), (0, 1)))
        self.assertRaises(tagrid.ArgumentError, read, threads=-1)
        for step in (0, -1, 2.0, "2", None, (1, 2), (1, 2, 0), (1, 2, 1.5)):
            self.refused(tagrid.ArgumentError, "a step is a whole number of at least 1, or three (z, y, x)", read, step=step)
        for region, step in [(np.array([[1, 5], [2, 6], [3, 7]]), np.int64(2)), ([[1, 5], [2, 6], [3, 7]], np.array([2, 2, 2]))]:
            np.testing.assert_array_equal(read(region, step), read(((1, 5), (2, 6), (3, 7)), 2))

    def test_settings_of_an_encoding_are_numbers(self):
        for name in ("max_error", "surface_error", "mesh_error", "field_scale"):
            self.refused(TypeError, f"{name} must be a number, not '5'", tagrid.encode, SAMPLES, **{name: "5"})
            self.refused(tagrid.ArgumentError, f"{name} must be a number, not nan", tagrid.encode, SAMPLES, **{name: float("nan")})
        for name in ("max_level", "cube", "brick", "lead", "accuracy", "threads", "memory_limit"):
            self.refused(TypeError, f"{name} must be a whole number", tagrid.encode, SAMPLES, **{name: 1.5})
            self.refused(tagrid.ArgumentError, f"{name} must be a whole number from", tagrid.encode, SAMPLES, **{name: 2**70})
        self.refused(tagrid.ArgumentError, "at most 2^31 samples", tagrid.Writer, io.BytesIO(), shape=(2**70, 1, 1), dtype="i2")
        for wrong in (5, "abc", (1, 2, 3, 4), ("a", "b")):
            self.refused(tagrid.ArgumentError, "value_range must be (low, high), not", tagrid.encode, SAMPLES, value_range=wrong)
            self.refused(tagrid.ArgumentError, "spacing must be three numbers (z, y, x), not", tagrid.encode, SAMPLES, spacing=wrong)
        for wrong in ("abc", 1, [[1, 2], [3]]):
            self.refused(tagrid.ArgumentError, "affine must be a 4 x 4 matrix", tagrid.encode, SAMPLES, affine=wrong)
        self.refused(TypeError, "metadata is a dictionary", tagrid.encode, SAMPLES, metadata=1.5)
        self.refused(TypeError, "out must be a path|max_error=5", tagrid.encode, SAMPLES, 5)
        for value in (2, 2.0, np.float32(2), np.int8(2)):
            self.assertEqual(tagrid.open(tagrid.encode(SAMPLES, max_error=value)).max_error, 2)

    def test_the_messages_about_samples_say_what_to_do(self):
        for dtype, advice in [("?", "numpy.uint8"), ("f2", "numpy.float32"), ("i8", "numpy.int32"), ("u8", "numpy.uint32"),
                              ("g", "numpy.float64"), ("c8", "array.real and array.imag"), ("U3", "one number for each voxel"),
                              (">i8", "numpy.int32"), (">f2", "numpy.float32"), ("V2", "types are"), ("M8[s]", "no dates"),
                              (">m8[s]", "no dates"), ([("a", "i2")], "one number"), (object, "one number")]:
            self.refused(TypeError, advice, tagrid.encode, np.zeros((2, 3, 4), dtype))
        self.refused(TypeError, "filled", tagrid.encode, np.ma.zeros((3, 4, 5), "u1"))
        self.refused(ValueError, "at least one", tagrid.encode, np.zeros((0, 4, 5), "u1"))
        self.refused(tagrid.ArgumentError, "array[numpy.newaxis]", tagrid.encode, SAMPLES[0])
        self.refused(tagrid.ArgumentError, "one volume at a time, such as array[0]", tagrid.encode, SAMPLES[None])
        for nothing in (None, 5, {}, (one for one in SAMPLES)):
            self.refused(TypeError, f"cannot encode '{type(nothing).__name__}'|tagrid.Writer", tagrid.encode, nothing)
        self.assertEqual(tagrid.encode(list(SAMPLES), cube=8, brick=2), DATA)
        self.refused(tagrid.ArgumentError, "three whole numbers (z, y, x), not 3", tagrid.Writer, io.BytesIO(), shape=3, dtype="i2")

    def test_messages_about_sources_say_what_to_do(self):
        for url in ("http://localhost/a.tag", "s3://bucket/a.tag", f"file://{self.path}"):
            error = self.refused(FileNotFoundError, "for a URL give fsspec.open(URL).open()|read_at(offset, size)", tagrid.open, url)
            self.assertEqual(error.filename, url)
        for url, shown in (("https://user:SECRET@host:8/a.tag?X-Amz-Signature=SECRET", "https://host:8/a.tag"),
                           ("https://user:SE/CRET@host/a.tag#SECRET", "https://host/a.tag"), ("s3://key:SECRET@bucket/a.tag", "s3://bucket/a.tag"),
                           ("https://host/a@b.tag", "https://host/a@b.tag"), ("https://[::1]:8/a@b", "https://[::1]:8/a@b")):
            error = self.refused(FileNotFoundError, "for a URL give", tagrid.open, url)
            self.assertEqual(error.filename, shown)
            self.assertNotIn("SECRET", str(error))
            far = type("Far", (), {"name": url, "size": 5000, "read_at": lambda self, offset, size: b"x" * size})()
            self.assertIn(shown, str(self.refused(tagrid.DamagedError, "not a .tag file", tagrid.open, far)))
            with self.assertRaises(OSError) as failed:
                tagrid.encode(SAMPLES, url)
            self.assertNotIn("SECRET", str(failed.exception))
        self.refused(TypeError, "tagrid.encode(array)", tagrid.open, SAMPLES)
        self.assertNotIn("xxxx", str(self.refused(tagrid.DamagedError, "not a .tag file", tagrid.encode, b"x" * 5000)))
        for memory in (np.frombuffer(DATA, np.uint8), np.frombuffer(DATA, np.uint8).repeat(2)[::2]):
            self.assertEqual(tagrid.open(memory).shape, SHAPE)
        with open(self.path) as text:
            self.refused(TypeError, "the file must be opened in binary mode", tagrid.open, text)
        has_open = type("OpenFile", (), {"open": lambda self: io.BytesIO(DATA)})()
        self.refused(TypeError, "cannot open 'OpenFile': give the file that its open() returns", tagrid.open, has_open)
        self.assertEqual(tagrid.open(has_open.open()).shape, SHAPE)

    def test_a_mesh_and_a_surface_are_taken_apart_alike(self):
        mesh = self.volume.mesh(level=3)
        points, cells, values, levels = mesh
        self.assertIs(points, mesh.points)
        self.assertIs(cells, mesh.cells)
        self.assertIs(values, mesh.values)
        self.assertIs(levels, mesh.levels)

    def test_what_an_index_cannot_do_has_a_way(self):
        for key in (SAMPLES > 5, ([1, 2], [3, 4]), 1.0, "a"):
            self.refused(IndexError, "numpy.asarray(volume)[...]", self.volume.__getitem__, key)

    def test_a_file_that_cannot_be_made_is_named_as_it_was_given(self):
        for path, kind in (("nowhere/b.tag", FileNotFoundError), ("a.tag/b.tag", NotADirectoryError)):
            error = self.refused(kind, path, tagrid.encode, SAMPLES, self.folder / path)
            self.assertEqual(error.filename, str(self.folder / path))

    def test_volumes_and_writers_say_whether_they_are_closed(self):
        volume = tagrid.open(DATA)
        self.assertFalse(volume.closed)
        with volume:
            pass
        self.assertTrue(volume.closed)
        writer = tagrid.Writer(io.BytesIO(), shape=SHAPE, dtype="int16")
        self.assertEqual(repr(writer), "<tagrid.Writer (20, 30, 40) int16, 0 written>")
        writer.write(SAMPLES)
        self.assertFalse(writer.closed)
        writer.close()
        self.assertTrue(writer.closed)
        self.assertIn("complete", repr(writer))
        with self.assertWarnsRegex(ResourceWarning, "3 written> was not closed, so there is no file"):
            writer = tagrid.Writer(self.folder / "dropped.tag", shape=SHAPE, dtype="int16")
            writer.write(SAMPLES[:3])
            del writer
            gc.collect()
        self.assertFalse((self.folder / "dropped.tag").exists())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            writer = tagrid.Writer(self.folder / "ended.tag", shape=SHAPE, dtype="int16")
            writer.abort()
            self.assertIn("ended", repr(writer))
            del writer
            gc.collect()

    def test_names_are_those_that_people_write(self):
        for name in tagrid.__all__:
            self.assertEqual(getattr(tagrid, name).__module__, "tagrid", name)
        self.assertLessEqual({"hdf5", "zarr", "open", "Volume"}, set(dir(tagrid)))
        self.assertNotIn("Any", dir(tagrid))
        self.assertEqual(dict(tagrid.hdf5.Filter(max_error=2))["compression"], tagrid.hdf5.FILTER_ID)
        self.refused(AttributeError, "module 'tagrid' has no attribute 'load'", getattr, tagrid, "load")
        self.refused(TypeError, "max_error must be a number, not 'a'", tagrid.hdf5.Filter, "a")

    def test_help_needs_no_other_library(self):
        code = """
import sys
for name in ("xarray", "numcodecs", "zarr", "dask"):
    sys.modules[name] = None
import pydoc, tagrid
assert "decoded" in pydoc.render_doc(tagrid)
assert not hasattr(tagrid, "xarray") and hasattr(tagrid, "zarr")
try:
    tagrid.xarray
except AttributeError as error:
    print(error)
"""
        done = subprocess.run([sys.executable, "-B", "-c", code], text=True, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("tagrid.xarray cannot be used: ", done.stdout)

    def test_sources_that_can_go_to_another_process_do(self):
        for source in (self.path, str(self.path), DATA, bytearray(DATA), np.frombuffer(DATA, np.uint8), io.BytesIO(DATA), KnowsItsBytes(DATA)):
            again = pickle.loads(pickle.dumps(tagrid.open(source)))
            np.testing.assert_array_equal(again[3], SAMPLES[3])
        with open(self.path, "rb") as file, open(self.path, "rb", buffering=0) as raw:
            for source in (file, raw, memoryview(DATA)):
                self.refused(TypeError, "cannot be pickled; open it by its path", pickle.dumps, tagrid.open(source))

    def test_processes_share_a_volume(self):
        for method in ("fork", "spawn"):
            # Threads of this process are at work already, which a forked one does not have.
            self.assertEqual(sum_of(0), int(SAMPLES[0].sum()))
            with multiprocessing.get_context(method).Pool(2) as pool:
                if method == "fork":
                    self.assertEqual(pool.map_async(sum_of, range(8)).get(60), [int(SAMPLES[i].sum()) for i in range(8)])
                found = pool.starmap_async(tagrid.Volume.__getitem__, [(self.volume, i) for i in range(4)]).get(60)
                np.testing.assert_array_equal(found, SAMPLES[:4])

    def test_processes_share_a_file_object(self):
        global shared
        with open(self.path, "rb") as file:
            file.seek(5)
            shared = tagrid.open(file)
            with multiprocessing.get_context("fork").Pool(4) as pool:
                found = pool.map_async(sum_of_shared, [i % 8 for i in range(400)], chunksize=1).get(60)
            self.assertEqual(found, [int(SAMPLES[i % 8].sum()) for i in range(400)])
            self.assertEqual(file.tell(), 5)
        self.assertRaisesRegex(ValueError, "closed file", shared.read)

    def test_errors_can_go_to_another_process(self):
        for name in ("ArgumentError", "DamagedError", "Error", "InputError", "MemoryLimitError", "NewerFormatError"):
            error = pickle.loads(pickle.dumps(getattr(tagrid, name)("what, and where")))
            self.assertEqual((type(error), str(error)), (getattr(tagrid, name), "what, and where"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
