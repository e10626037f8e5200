"""A volume is opened from anywhere, says what it is, and hostile input is an error of its own class."""

import io
import math
import os
import pathlib
import pickle
import shutil
import signal
import tempfile
import threading
import time
import sys
import unittest

import numpy as np
import tagrid

from volumes import TYPES, blobs, in_threads, module

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "format"))
from forged import Forged, of_version_6  # noqa: E402

SHAPE = (20, 30, 40)
AFFINE = np.array([[0, 0.5, 0, 3], [-0.25, 0, 0, -4], [0, 0, 2, 5.5], [0, 0, 0, 1.0]])


class Object:
    """A file in memory that is read at an offset."""

    def __init__(self, data, error=None):
        self.data, self.error, self.name = data, error, "an object"

    def size(self):
        return len(self.data)

    def read_at(self, offset, size):
        if self.error:
            raise self.error
        return memoryview(self.data)[offset:offset + size]


class Unsteady(io.RawIOBase):
    """A raw file that returns a few bytes at a time, and shows when a thread reads where another one has moved it."""

    def __init__(self, data):
        self.file, self.mover = io.BytesIO(data), None

    def seek(self, offset, whence=0):
        self.mover = threading.get_ident()
        position = self.file.seek(offset, whence)
        time.sleep(0.0005)
        return position

    def read(self, size=-1):
        assert self.mover == threading.get_ident(), "another thread has moved it"
        return self.file.read(min(size, 1000))


class Opening(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.samples = blobs(SHAPE)
        cls.bytes = tagrid.encode(cls.samples, max_error=3, affine=AFFINE, cube=8, brick=2,
                                  metadata={"Scanner": "a: b\\n\nc", "space": "right-anterior-superior"})
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = os.path.join(cls.folder.name, "scan é.tag")
        pathlib.Path(cls.path).write_bytes(cls.bytes)
        cls.decoded = np.asarray(tagrid.open(cls.bytes))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_bytes_that_are_a_path_are_not_taken_for_a_file(self):
        short = os.path.join(self.folder.name, "a.tag")
        pathlib.Path(short).write_bytes(self.bytes)
        for call in (tagrid.open, tagrid.verify, tagrid.encode):
            self.assertRaisesRegex(TypeError, r"os.fsdecode\(path\)", call, os.fsencode(short))
        self.assertRaises(tagrid.DamagedError, tagrid.open, b"/there/is/no.tag")
        self.assertRaises(tagrid.DamagedError, tagrid.open, b"\0")

    def test_every_source_gives_the_same_samples(self):
        with open(self.path, "rb") as file, open(self.path, "rb", buffering=0) as raw:
            for source in (self.path, pathlib.Path(self.path), file, raw, io.BytesIO(self.bytes), self.bytes,
                           bytearray(self.bytes), memoryview(self.bytes), memoryview(np.frombuffer(self.bytes, np.uint8)),
                           Object(self.bytes), Unsteady(self.bytes)):
                with self.subTest(type(source)), tagrid.open(source) as volume:
                    np.testing.assert_array_equal(np.asarray(volume), self.decoded)

    def test_a_file_object_stays_open_and_may_be_read_by_many_threads(self):
        file = Unsteady(self.bytes)
        volume = tagrid.open(file)
        wrong = []

        def read(seed):
            random = np.random.default_rng(seed)
            for _ in range(20):
                low = [int(random.integers(0, n)) for n in SHAPE]
                key = tuple(slice(n, n + 9) for n in low)
                if not np.array_equal(volume[key], self.decoded[key]):
                    wrong.append(key)

        in_threads(read, range(4))
        self.assertEqual(wrong, [])
        volume.close()
        file.seek(0)

    def test_a_file_on_a_server_is_read_through_fsspec(self):
        fsspec, _ = module("fsspec"), module("aiohttp")
        sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools" / "commands"))
        from web_server import WebServer, page

        array = blobs((70, 80, 90))
        with WebServer({"/scan.tag": tagrid.encode(array)}) as server:
            with fsspec.open(server.url + "/scan.tag") as file, tagrid.open(file) as volume:
                np.testing.assert_array_equal(volume[10:60, ::2, 33], array[10:60, ::2, 33])
            self.assertTrue(any("Range" in headers for _, headers in server.requests))
            server.misbehave = page
            with fsspec.open(server.url + "/scan.tag") as file, self.assertRaises(tagrid.DamagedError):
                tagrid.open(file)

    def test_an_overview_is_a_volume_of_its_own(self):
        path = pathlib.Path(__file__).parents[1] / "golden/1.0/lead_voxels_overviews_int16.tag"
        volume = tagrid.open(path)
        self.assertEqual((volume.overviews, tagrid.open(self.bytes).overviews), ((4, 16), ()))
        self.assertRaisesRegex(tagrid.ArgumentError, "it has 4, 16", volume.overview, 8)
        expected = np.asarray(volume).astype(float)[4:8, 8:12, 12:16].mean()
        for source in (path, Object(path.read_bytes())):
            overview = tagrid.open(source).overview(4)
            self.assertEqual(overview.shape, (10, 9, 11))
            self.assertLess(abs(overview[1, 2, 3] - expected), 16.5)
        again = pickle.loads(pickle.dumps(volume.overview(16)))
        self.assertEqual(again.shape, (3, 3, 3))
        again.verify()
        failing = Object(path.read_bytes())
        overview, failing.error = tagrid.open(failing).overview(4), OSError("gone")
        with self.assertRaises(OSError) as raised:
            np.asarray(overview)
        self.assertIs(raised.exception, failing.error)
        volume.close()
        self.assertRaises(tagrid.ArgumentError, volume._reader.overviews)

    def test_a_volume_of_several_is_a_volume_of_its_own(self):
        path = pathlib.Path(__file__).parents[1] / "golden/1.0/volumes_bounded_int16.tag"
        first = tagrid.open(path)
        self.assertEqual((first.volumes, tagrid.open(self.bytes).volumes), (3, 1))
        for volume, number, error, words in (
                (first, 3, tagrid.ArgumentError, "has no volume 3; it has 3 volumes, 0 to 2$"),
                (first, -1, tagrid.ArgumentError, "has no volume -1; it has 3 volumes, 0 to 2$"),
                (tagrid.open(self.bytes), 1, tagrid.ArgumentError, "has no volume 1; it has only volume 0$"),
                (first, "1", TypeError, "the number of a volume must be a whole number, not '1'"),
                (first, 1.0, TypeError, "the number of a volume must be a whole number, not 1.0")):
            self.assertRaisesRegex(error, words, volume.volume, number)
        one, two = (np.asarray(first.volume(number)) for number in (1, 2))
        np.testing.assert_array_equal(np.asarray(first.volume(0)), np.asarray(first))
        self.assertFalse(np.array_equal(one, two))
        for source in (path, Object(path.read_bytes())):
            volume = tagrid.open(source).volume(2)
            self.assertEqual((volume.shape, volume.volumes, volume.overviews), ((11, 18, 19), 1, (4,)))
            np.testing.assert_array_equal(volume[3:5], two[3:5])
            self.assertEqual(volume.overview(4).shape, (3, 5, 5))
        again = pickle.loads(pickle.dumps(first.volume(1)))
        np.testing.assert_array_equal(np.asarray(again), one)
        for volume in (again, first):
            volume.verify()
        for several in (path, first):
            self.assertRaisesRegex(tagrid.ArgumentError, "holds 3 volumes, and Python writes one", tagrid.encode,
                                   several)

    def test_other_sources_are_a_TypeError(self):
        for source in (3, None, [1], object(), io.StringIO("text"), np.zeros(3)):
            with self.subTest(type(source)), self.assertRaises((TypeError, tagrid.DamagedError)):
                tagrid.open(source)

    def test_it_says_what_it_is(self):
        volume = tagrid.open(self.path)
        self.assertEqual((volume.shape, volume.ndim, volume.size, volume.nbytes, len(volume)), (SHAPE, 3, 24000, 48000, 20))
        self.assertEqual((volume.dtype, volume.chunks, volume.max_error, volume.levels), (np.int16, (16, 16, 16), 3, 9))
        self.assertEqual(volume.spacing, (2, 0.5, 0.25))
        np.testing.assert_array_equal(volume.affine, AFFINE)
        self.assertEqual(volume.metadata, {"Scanner": "a: b\\n\nc", "space": "right-anterior-superior"})
        measured = self.decoded.astype(float) - self.samples
        self.assertEqual(volume.achieved["max_error"], abs(measured).max())
        self.assertAlmostEqual(volume.achieved["rmse"], np.sqrt((measured ** 2).mean()))
        self.assertGreater(volume.achieved["psnr"], 20)
        self.assertTrue(math.isnan(volume.achieved["mesh_error"]))
        self.assertEqual(sum(volume.active_points()), volume.info["active_points"])
        self.assertEqual(len(volume.active_points()), volume.levels + 1)
        self.assertIn("scan é.tag' (20, 30, 40) int16, max_error 3>", repr(volume))
        self.assertIn("<table>", volume._repr_html_())
        self.assertIn("20 × 30 × 40", volume._repr_html_())

    def test_what_is_unknown_is_said_to_be_unknown(self):
        volume = tagrid.open(tagrid.encode(self.samples, grid_only=True, max_error=None))
        self.assertTrue(all(math.isnan(step) for step in volume.spacing))
        np.testing.assert_array_equal(volume.affine, np.eye(4))
        self.assertEqual((volume.max_error, volume.metadata), (math.inf, {}))
        self.assertEqual(volume.chunks, (64, 64, 64))

    def test_slices_at_unequal_distances_have_their_places(self):
        places = [[1, 2, z] for z in (0, 1, 5)]

        def opened(text):
            return tagrid.open(tagrid.encode(self.samples[:3], metadata={"slice_positions": text}))

        text = "; ".join(" ".join(map(str, place)) for place in places)
        np.testing.assert_array_equal(opened(text).slice_positions, places)
        self.assertIsNone(tagrid.open(tagrid.encode(self.samples[:3])).slice_positions)
        # What a reader cannot use is in the metadata only.
        for other in ("", "1 2 3", text + "; 1 2 9", "1 2 3; 4 5; 6 7 8", "a b c; d e f; g h i", "0 0 0; 0 0 nan; 0 0 1"):
            with self.subTest(other):
                self.assertIsNone(opened(other).slice_positions)
                self.assertEqual(opened(other).metadata.get("slice_positions"), other)

    def test_every_type_comes_back(self):
        for dtype in TYPES:
            samples = blobs((9, 10, 11), dtype)
            volume = tagrid.open(tagrid.encode(samples))
            self.assertEqual(volume.dtype, samples.dtype)
            np.testing.assert_array_equal(np.asarray(volume), samples)

    def test_a_volume_of_a_path_can_be_pickled(self):
        again = pickle.loads(pickle.dumps(tagrid.open(self.path, threads=1)))
        np.testing.assert_array_equal(again[3], self.decoded[3])

    # ---- hostile input

    def test_a_missing_or_unreadable_file_is_an_OSError_of_Python(self):
        with self.assertRaises(FileNotFoundError) as missing:
            tagrid.open(self.path + "x")
        self.assertIsNone(missing.exception.__context__)  # a traceback shows one exception
        self.assertRaises(IsADirectoryError, tagrid.open, self.folder.name)
        self.assertRaises(ValueError, tagrid.open, "a\0b")
        pipe = os.path.join(self.folder.name, "pipe")
        os.mkfifo(pipe)
        with self.assertRaises((tagrid.InputError, tagrid.DamagedError, tagrid.ArgumentError)):
            tagrid.open(pipe)

    def test_truncated_and_random_bytes_are_damaged(self):
        random = np.random.default_rng(1)
        for data in (b"", b"x", random.bytes(5000), self.bytes[:-1], self.bytes[:100], self.bytes[1:], self.bytes + b"x"):
            with self.subTest(len(data)):
                with self.assertRaises(tagrid.DamagedError) as caught:
                    tagrid.open(data)
                self.assertIsInstance(caught.exception, (tagrid.Error, ValueError))
                self.assertRaises(tagrid.DamagedError, tagrid.verify, io.BytesIO(data))

    @unittest.skipIf(shutil.which("zstd") is None, "needs the zstd program")
    def test_parts_that_are_not_known_are_counted(self):
        self.assertEqual(tagrid.open(self.bytes).info["unknown_parts"], 0)
        data = Forged(self.bytes).with_section(70000, b"more").with_member(77, 1, b"and more").data()
        volume = tagrid.open(data)
        self.assertEqual(volume.info["unknown_parts"], 2)
        np.testing.assert_array_equal(volume[:], self.decoded)

    def test_a_newer_file_is_not_damaged(self):
        data = of_version_6(self.bytes)
        for read in (tagrid.open, tagrid.verify):
            with self.assertRaisesRegex(tagrid.NewerFormatError, "format version 6.*update tagrid") as caught:
                read(data)
            self.assertIsInstance(caught.exception, (tagrid.Error, ValueError))
            self.assertNotIsInstance(caught.exception, tagrid.DamagedError)

    def test_a_flipped_bit_is_found_before_samples_are_returned(self):
        offset = tagrid.open(self.bytes)._reader.brick(0)["offset"] + 20
        data = bytearray(self.bytes)
        data[offset] ^= 1
        volume = tagrid.open(data)
        with self.assertRaisesRegex(tagrid.DamagedError, "."):
            volume[0, 0, 0]
        self.assertRaises(tagrid.DamagedError, volume.verify)
        self.assertRaises(tagrid.DamagedError, tagrid.verify, bytes(data))
        self.assertRaises(tagrid.DamagedError, volume.mesh)
        self.assertRaises(tagrid.DamagedError, volume.surface, 100)
        np.testing.assert_array_equal(volume[-1], self.decoded[-1])
        self.assertIsNone(tagrid.verify(self.bytes))
        self.assertIsNone(tagrid.verify(tagrid.open(self.bytes)))

    def test_what_a_source_raises_is_passed_on(self):
        class Mine(Exception):
            pass

        self.assertRaises(Mine, tagrid.open, Object(self.bytes, Mine()))
        source = Object(self.bytes)
        volume = tagrid.open(source)
        source.error = Mine("no luck")
        for work in (lambda: volume[0], volume.verify, volume.mesh, lambda: volume.surface(100), lambda: np.asarray(volume)):
            with self.assertRaisesRegex(Mine, "no luck"):
                work()
        self.assertEqual(volume[2:2].shape, (0, 30, 40))

        file = io.BytesIO(self.bytes)
        volume = tagrid.open(file)
        file.close()
        with self.assertRaisesRegex(ValueError, "closed file"):
            volume[0]

    def test_threads_that_fail_together_all_get_the_exception(self):
        source = Object(self.bytes)
        volume = tagrid.open(source)
        source.error = OSError("no luck")
        caught = []

        def read(_):
            for _ in range(20):
                try:
                    volume[0]
                except Exception as error:
                    caught.append((type(error), str(error)))

        in_threads(read, range(4))
        self.assertEqual(set(caught), {(OSError, "no luck")})
        self.assertEqual(len(caught), 80)

    def test_a_source_that_lies_is_an_error(self):
        whole = Object(self.bytes)
        for answer in (lambda data: data[:-1], lambda data: bytes(data) + b"x", lambda data: None, lambda data: "text",
                       lambda data: 3):
            source = Object(self.bytes)
            source.read_at = lambda offset, size: answer(whole.read_at(offset, size))
            with self.subTest(answer), self.assertRaises((tagrid.InputError, TypeError)):
                tagrid.open(source)
        for size in (-1, "a", None, 2.5):
            source = Object(self.bytes)
            source.size = size
            with self.subTest(size), self.assertRaises(TypeError):
                tagrid.open(source)
        source = Object(self.bytes)
        source.size = 2 ** 62
        self.assertRaises(tagrid.Error, tagrid.open, source)

    def test_a_closed_volume_says_so(self):
        with tagrid.open(self.path) as volume:
            pass
        volume.close()
        for work in (lambda: volume[0], volume.verify, volume.mesh, volume.read, lambda: np.asarray(volume), volume.active_points,
                     lambda: volume.surface(3), lambda: volume[0:0]):
            with self.assertRaisesRegex(ValueError, "the volume is closed"):
                work()
        self.assertEqual(volume.shape, SHAPE)
        self.assertIn("closed", repr(volume))

    def test_it_may_be_closed_while_others_read(self):
        for _ in range(20):
            volume = tagrid.open(Object(self.bytes))
            results = []

            def read():
                try:
                    while True:
                        results.append(np.array_equal(volume[:], self.decoded))
                except tagrid.ArgumentError as error:
                    results.append(str(error))

            threads = [threading.Thread(target=read) for _ in range(3)]
            for thread in threads:
                thread.start()
            time.sleep(0.003)
            volume.close()
            for thread in threads:
                thread.join()
            self.assertEqual(set(results) - {True}, {"the volume is closed"})

    # ---- calls

    def test_progress_is_told_and_may_end_a_call(self):
        volume = tagrid.open(self.bytes)
        told = []
        volume.read(progress=lambda done, total: told.append((done, total)))
        self.assertEqual(told[-1], (volume.nbytes, volume.nbytes))
        for work in (volume.read, volume.verify, volume.mesh, lambda **k: volume.surface(100, **k)):
            with self.assertRaises(ZeroDivisionError):
                work(progress=lambda done, total: 1 / 0)
            with self.assertRaises(ZeroDivisionError):
                work(progress=lambda done, total: 1 / (total - done))

    def test_memory_limits_are_kept_or_refused(self):
        with self.assertRaises(MemoryError) as caught:
            tagrid.encode(blobs((40, 200, 200)), memory_limit=1000)
        self.assertIsInstance(caught.exception, tagrid.MemoryLimitError)

    def test_ctrl_c_ends_a_long_call(self):
        class Slow(Object):
            reads = 0
            begun = threading.Event()

            def read_at(self, offset, size):
                self.reads += 1
                time.sleep(0.02 if self.reads > 5 else 0)
                if self.reads == 15:
                    self.begun.set()
                return super().read_at(offset, size)

        data = tagrid.encode(blobs((64, 64, 128), "uint8"), max_error=20, cube=4, brick=2)
        slow = Slow(data)
        volume = tagrid.open(slow, threads=1)

        def press():
            slow.begun.wait()
            os.kill(os.getpid(), signal.SIGINT)

        user = threading.Thread(target=press, daemon=True)
        user.start()
        with self.assertRaises(KeyboardInterrupt):
            np.asarray(volume)
        user.join()
        # All 1024 bricks would take 20 s. Reads are counted, for a busy machine makes each of them slower.
        self.assertLess(slow.reads, 300)
        self.assertEqual(volume[0, 0, 0].dtype, np.uint8)

    def test_ctrl_c_ends_a_mesh_between_two_reports_of_progress(self):
        # There are three of them in some seconds; a fast machine may reach the first one.
        volume = tagrid.open(tagrid.encode(np.random.default_rng(1).normal(0, 300, (65, 200, 200)).astype(np.int16), effort="fast"))
        for work in (volume.mesh, lambda **k: volume.surface(0, **k)):
            told = []
            timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                work(progress=lambda done, total: told.append(done))
            timer.join()
            self.assertLessEqual(len(told), 1)

    def test_other_threads_of_python_run_during_a_call(self):
        if len(os.sched_getaffinity(0)) < 2:
            self.skipTest("one processor")
        samples = blobs((64, 256, 256))
        counted = []
        ended = threading.Event()

        def count():
            while not ended.is_set():
                counted.append(1)
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        before = len(counted)
        tagrid.encode(samples, threads=1)
        during = len(counted) - before
        ended.set()
        thread.join()
        self.assertGreater(during, 10)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
