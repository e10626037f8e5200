"""Arrays of any kind become files, whole or not at all."""

import errno
import io
import os
import pathlib
import signal
import subprocess
import sys
import threading
import unittest

import numpy as np
import tagrid

from volumes import blobs, temporary_folder

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import scans

PROGRAM = sys.argv[1]
SHAPE = (70, 20, 30)
AFFINE = np.array([[0, 0.5, 0, 3], [-0.25, 0, 0, -4], [0, 0, 2, 5.5], [0, 0, 0, 1.0]])


class Loaded:
    """Like a data set of h5py: an array that is loaded slice by slice."""

    def __init__(self, array, chunks=None):
        self.array, self.shape, self.dtype, self.loaded = array, array.shape, array.dtype, []
        if chunks:
            self.chunks = chunks

    def __getitem__(self, key):
        self.loaded.append((key.start, key.stop))
        return self.array[key]


class Encoding(unittest.TestCase):
    def setUp(self):
        self.folder = temporary_folder(self)

    def left(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_no_sample_changes_its_side_of_a_threshold(self):
        noisy = (np.linspace(0, 900, 64 * 50 * 40).reshape(64, 50, 40)
                 + np.random.default_rng(1).normal(0, 10, (64, 50, 40))).astype(np.int16)
        for settings in ({"max_error": 9}, {"psnr": 35}, {"max_error": 4, "threshold": 500}):
            settings = {"threshold": (700, 300.5), **settings}
            with tagrid.open(tagrid.encode(noisy, **settings)) as volume:
                back = volume.read()
                thresholds = sorted(np.atleast_1d(settings["threshold"]))
                for threshold, recorded in zip(thresholds, volume.info["thresholds"], strict=True):
                    np.testing.assert_array_equal(back >= threshold, noisy >= threshold)
                    self.assertEqual(recorded["value"], np.ceil(threshold))
                    self.assertEqual(recorded["at_least"], (noisy >= threshold).sum())
                    self.assertGreater(recorded["moved"], 0)
                self.assertGreater((back != noisy).sum(), 1000)
        self.assertRaisesRegex(tagrid.ArgumentError, "threshold", tagrid.encode, noisy, threshold="300 HU")
        self.assertRaisesRegex(tagrid.ArgumentError, "at most 8", tagrid.encode, noisy, threshold=range(1, 10))
        self.assertRaisesRegex(tagrid.ArgumentError, "one side", tagrid.encode, noisy, threshold=40000)

    def test_bounds_that_follow_from_the_samples_keep_what_they_promise(self):
        # Gaussian noise of a known deviation on a ramp, also in slabs that are loaded out of order.
        noisy = (np.linspace(0, 900, 64 * 50 * 40).reshape(64, 50, 40)
                 + np.random.default_rng(1).normal(0, 10, (64, 50, 40))).astype(np.int16)
        span = int(noisy.max()) - int(noisy.min())
        for settings, low, high in (
                ({"max_error": "noise:2"}, 18, 22), ({"relative_error": 0.05}, span // 20, span // 20), ({"psnr": 50}, 1, span),
                ({"psnr": 50, "max_error": 6}, 1, 6), ({"ratio": 8}, 1, span), ({"bits": 2}, 1, span)):
            data = tagrid.encode(noisy, **settings)
            self.assertEqual(tagrid.encode(Loaded(noisy, (16, 50, 40)), **settings), data)
            with tagrid.open(data) as volume:
                self.assertTrue(low <= volume.achieved["max_error"] <= volume.max_error <= high, settings)
                if "psnr" in settings:
                    self.assertGreaterEqual(volume.achieved["psnr"], 50)
            if settings.keys() & {"ratio", "bits"}:
                self.assertAlmostEqual(len(data) / noisy.size, 0.2462, delta=0.0063)

    def test_a_bound_that_follows_from_the_samples_does_not_change_missing_samples(self):
        array = Loaded(blobs(SHAPE, "int16"))
        array.attrs = {"_FillValue": -9}
        for settings in ({"max_error": "noise:2"}, {"relative_error": 0.1}, {"psnr": 40}):
            with self.assertRaisesRegex(tagrid.ArgumentError, "_FillValue"):
                tagrid.encode(array, **settings)

    def test_a_bound_that_follows_from_the_samples_needs_them(self):
        samples = blobs(SHAPE, "int16")
        for settings in ({"max_error": "noise:2"}, {"relative_error": 0.1}, {"psnr": 40}):
            with self.assertRaisesRegex(tagrid.ArgumentError, "samples="):
                tagrid.Writer(self.folder / "a.tag", shape=SHAPE, dtype="int16", **settings)
        for settings in ({"max_error": "noise"}, {"max_error": "noise:1", "psnr": 40}, {"relative_error": 1, "psnr": 40}, {"psnr": -1}, {"ratio": 8, "bits": 2},
                         {"ratio": 8, "max_error": 2}):
            with self.assertRaises(tagrid.ArgumentError):
                tagrid.encode(samples, self.folder / "a.tag", **settings)
        self.assertEqual(self.left(), [])

    def test_what_reading_the_samples_raises_ends_the_encoding(self):
        def fails(first, count):
            raise KeyError("gone")
        with self.assertRaisesRegex(KeyError, "gone"):
            tagrid.Writer(self.folder / "a.tag", shape=SHAPE, dtype="int16", psnr=40, samples=fails)
        with self.assertRaises(tagrid.InputError):
            tagrid.Writer(self.folder / "a.tag", shape=SHAPE, dtype="int16", psnr=40, samples=lambda first, count: b"short")
        self.assertEqual(self.left(), [])

    def test_strides_and_byte_order_do_not_matter(self):
        for dtype in ("uint8", "int16", "float32"):
            samples = blobs(SHAPE, dtype)
            expected = tagrid.encode(samples)
            wide = np.zeros((2 * SHAPE[0], SHAPE[1], 3 * SHAPE[2]), dtype)[::2, :, ::3]
            wide[:] = samples
            shifted = np.frombuffer(b"x" + samples.tobytes(), "u1")[1:].view(dtype).reshape(SHAPE)
            for array in (np.asfortranarray(samples), samples[::-1, :, ::-1].copy()[::-1, :, ::-1], wide, shifted,
                          samples.astype(samples.dtype.newbyteorder(">")), Loaded(samples), Loaded(samples, (13, 5, 5)),
                          Loaded(samples, ((50, 20), (20,), (30,))), Loaded(samples.astype(samples.dtype.newbyteorder(">")))):
                self.assertEqual(tagrid.encode(array), expected)

    def test_a_number_for_missing_samples_is_not_changed_by_a_bound(self):
        array = Loaded(blobs(SHAPE))
        array.attrs = {"_FillValue": np.array([-999], "i2"), "other": "x"}
        volume = tagrid.open(tagrid.encode(array.array, metadata={"missing_value": "-999"}))
        for wrong in (array, volume):
            self.assertRaisesRegex(tagrid.ArgumentError, "-999 stands for missing samples", tagrid.encode, wrong, max_error=1)
        self.assertEqual(tagrid.encode(array), tagrid.encode(array.array))
        for harmless in (np.nan, "none", None):
            array.attrs["_FillValue"] = harmless
            tagrid.encode(array, max_error=1)

    def test_chunks_of_others_are_loaded_once(self):
        array = Loaded(blobs(SHAPE), (13, 20, 30))
        tagrid.encode(array)
        self.assertEqual(array.loaded, [(z, min(z + 13, 70)) for z in range(0, 70, 13)])

    def test_bytes_do_not_depend_on_threads_and_are_those_of_the_program(self):
        scale = {"float32": ["--range", "-200:200"], "int16": []}
        for dtype in ("int16", "float32"):
            samples = blobs((9, 10, 530), dtype)
            for settings, options in (
                    ({"spacing": (2, 0.5, 0.25)}, []), ({}, []), ({"overviews": "auto"}, ["--overviews", "auto"]),
                    ({"overviews": "none"}, ["--overviews", "none"]), ({"overviews": ()}, ["--overviews", "none"]),
                    ({"overviews": [4]}, ["--overviews", "4"]),
                    ({"overviews": np.array([4, 16, 64])}, ["--overviews", "4,16,64"])):
                fields = "spacings: 0.25 0.5 2.0\n" if "spacing" in settings else ""
                (self.folder / "v.nrrd").write_bytes(scans.nrrd(samples, fields))
                subprocess.run([PROGRAM, "encode", self.folder / "v.nrrd", "--max-error", "2", "--strip", *options,
                                *scale[dtype], "-q", "-f", "-o", self.folder / "v.tag"], check=True)
                data = (self.folder / "v.tag").read_bytes()
                if scale[dtype]:
                    settings = settings | {"value_range": (-200, 200)}
                for threads in (1, 3):
                    found = tagrid.encode(samples, max_error=2, threads=threads, **settings)
                    self.assertEqual(found, data, (dtype, options))
                tagrid.encode(samples, self.folder / "w.tag", max_error=2, **settings)
                self.assertEqual(data, (self.folder / "w.tag").read_bytes())

    def test_overviews_that_cannot_be_are_refused(self):
        samples = blobs((9, 10, 11))
        for wrong in ("all", "4", (3,), (16, 4), (4, 4), (4096,), (-4,), (0,), (2**31,)):
            self.assertRaises(tagrid.ArgumentError, tagrid.encode, samples, self.folder / "v.tag", overviews=wrong)
        for wrong in (4, None, (4.5,), ("4",)):
            self.assertRaises(TypeError, tagrid.encode, samples, self.folder / "v.tag", overviews=wrong)
        self.assertRaises(tagrid.ArgumentError, tagrid.encode, samples, grid_only=True, max_error=None, overviews=[4])
        self.assertEqual(self.left(), [])

    def test_chunks_have_none(self):
        from tagrid._lattice import encode_chunk
        for whole in (False, True):
            with tagrid.open(encode_chunk(blobs((2, 3, 700)), 2, whole, 0, {})) as volume:
                self.assertEqual(volume.overviews, ())

    def test_settings_that_cannot_be_are_refused_and_leave_nothing(self):
        samples = blobs((9, 10, 11))
        for settings in ({"max_error": -1}, {"effort": "more"}, {"grid": "no"}, {"spacing": (1, 2)}, {"spacing": (1, 2, 0)}, {"spacing": (-1, 2, 1)},
                         {"affine": np.eye(3)}, {"affine": np.diag([1, 1, 0, 1])}, {"affine": np.diag([1, 1, 1, 2])},
                         {"affine": np.diag([1, 1, np.nan, 1])}, {"spacing": (1, 1, 2), "affine": np.eye(4)},
                         {"metadata": {"a:b": "c"}}, {"metadata": {"space": "a\nb"}}, {"metadata": {"spacings": "1 2 3"}},
                         {"metadata": {"": "c"}}, {"cube": 5}, {"brick": -1}, {"lead": 2}, {"accuracy": 0},
                         {"threads": -2}, {"max_level": -3},
                         {"value_range": (3, 1)}, {"surface_error": 5}, {"grid": "derived", "grid_only": True},
                         {"metadata": "type: short\n"}, {"metadata": "no line"}):
            with self.subTest(settings), self.assertRaises(tagrid.ArgumentError):
                tagrid.encode(samples, self.folder / "v.tag", **settings)
        self.assertEqual(self.left(), [])

    def test_of_equal_keys_the_last_counts(self):
        volume = tagrid.open(tagrid.encode(blobs((3, 4, 5)), metadata="a:=1\nA:=2\na:=3\nSpace Units:\"um\" \"um\" \"um\"\n"))
        self.assertEqual({key: volume.metadata[key] for key in ("a", "A")}, {"a": "3", "A": "2"})
        self.assertEqual(volume.metadata["space units"], '"um" "um" "um"')

    def test_place_and_metadata_come_back(self):
        samples = blobs((9, 10, 11))
        for settings in ({}, {"spacing": (2.5, 0.1, 1 / 3)}, {"affine": AFFINE}, {"affine": AFFINE, "spacing": (2, 0.5, 0.25)},
                         {"affine": AFFINE, "metadata": {"space": "LPS", "a key": "text\\n\n:=x", "kVp": "120", "#5": "x"}},
                         {"spacing": (1, 2, 3), "metadata": {"space": "right-anterior-superior", "space units": '"mm" "mm" "mm"'}}):
            with self.subTest(settings):
                if "#5" in settings.get("metadata", {}):
                    self.assertRaises(tagrid.ArgumentError, tagrid.encode, samples, **settings)
                    del settings["metadata"]["#5"]
                volume = tagrid.open(tagrid.encode(samples, **settings))
                self.assertEqual(volume.metadata, settings.get("metadata", {}))
                if "affine" in settings:
                    np.testing.assert_array_equal(volume.affine, AFFINE)
                    self.assertEqual(volume.spacing, (2, 0.5, 0.25))
                elif "spacing" in settings:
                    self.assertEqual(volume.spacing, settings["spacing"])
                again = tagrid.open(tagrid.encode(volume))
                self.assertEqual(again.header, volume.header)
                np.testing.assert_array_equal(np.asarray(again), samples)
                moved = tagrid.open(tagrid.encode(volume, spacing=(4, 5, 6)))
                self.assertEqual((moved.spacing, moved.metadata), ((4, 5, 6), volume.metadata))

    def test_a_tag_file_is_encoded_again_and_scans_are_for_the_program(self):
        samples = blobs(SHAPE, "float32")
        tagrid.encode(samples, self.folder / "a.tag")
        tagrid.encode(self.folder / "a.tag", self.folder / "b.tag", max_error=1)
        with tagrid.open(self.folder / "b.tag") as volume:
            self.assertEqual(volume.max_error, 1)
            self.assertLessEqual(np.abs(np.asarray(volume) - samples).max(), 1)
        # Two bounds would add up, so the new one would not be true of the original.
        for bounded in (self.folder / "b.tag", tagrid.encode(samples, grid_only=True, max_error=None)):
            with tagrid.open(bounded) as volume, self.assertRaisesRegex(tagrid.ArgumentError, "add up.*volume.read"):
                tagrid.encode(volume, max_error=1)
        scan = self.folder / "scan.nrrd"
        scan.write_text("NRRD0004\n")
        with self.assertRaisesRegex(ValueError, r"tagrid encode .*scan\.nrrd"):
            tagrid.encode(scan, self.folder / "c.tag")
        self.assertRaises(FileNotFoundError, tagrid.encode, self.folder / "none.tag")
        self.assertEqual(self.left(), ["a.tag", "b.tag", "scan.nrrd"])

    def test_a_file_appears_when_it_is_complete(self):
        samples = blobs(SHAPE)
        path = self.folder / "v.tag"
        for out in (path, str(path), os.fsencode(path)):
            self.assertIsNone(tagrid.encode(samples, out))
            self.assertEqual(path.read_bytes(), tagrid.encode(samples))
        mask = os.umask(0)
        os.umask(mask)
        self.assertEqual(path.stat().st_mode & 0o777, 0o666 & ~mask)
        link = self.folder / "link.tag"
        link.symlink_to("v.tag")
        tagrid.encode(samples, link, max_error=9)
        self.assertTrue(link.is_symlink())
        self.assertEqual(tagrid.open(path).max_error, 9)
        self.assertEqual(self.left(), ["link.tag", "v.tag"])
        self.assertRaises(IsADirectoryError, tagrid.encode, samples, self.folder)
        self.assertRaises(FileNotFoundError, tagrid.encode, samples, self.folder / "none" / "v.tag")
        self.assertRaises(TypeError, tagrid.encode, samples, 3)

    def test_a_pipe_or_a_device_is_not_replaced(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        self.assertRaises(tagrid.ArgumentError, tagrid.encode, blobs(SHAPE), pipe)
        self.assertTrue(pipe.is_fifo())
        self.assertRaises(tagrid.ArgumentError, tagrid.encode, blobs(SHAPE), "/dev/null")
        with open("/dev/null", "wb") as null:
            tagrid.encode(blobs(SHAPE), null)

    def test_an_object_takes_the_bytes(self):
        class Slow(io.RawIOBase):
            data = b""

            def write(self, more):
                self.data += more[:100]
                return len(more[:100])

        samples, slow, plain = blobs(SHAPE), Slow(), io.BytesIO()
        tagrid.encode(samples, slow)
        tagrid.encode(samples, plain)
        self.assertEqual(slow.data, tagrid.encode(samples))
        self.assertEqual(plain.getvalue(), slow.data)

        class Full:
            def write(self, more):
                raise OSError(28, "No space left on device")

        with self.assertRaisesRegex(OSError, "No space left") as caught:
            tagrid.encode(samples, Full())
        self.assertEqual(caught.exception.errno, 28)

    def test_a_writer_that_takes_nothing_is_an_error(self):
        class Writes(io.RawIOBase):
            def __init__(self, *answers):
                self.data, self.answers = b"", [*answers]

            def write(self, more):
                answer = self.answers.pop(0) if self.answers else len(more)
                self.data += bytes(more[:answer or 0])
                return answer

        class Silent:
            data = b""

            def write(self, more):
                self.data += more

        samples, silent, part = blobs(SHAPE), Silent(), Writes(np.int64(3), 5)
        for out in (silent, part):
            tagrid.encode(samples, out)
            self.assertEqual(out.data, tagrid.encode(samples))
        self.assertRaisesRegex(BlockingIOError, "takes no bytes", tagrid.encode, samples, Writes(10, None))
        for wrong in (0, -1, 10**9, "all"):
            class Wrong:
                def write(self, more):
                    return wrong

            self.assertRaisesRegex(tagrid.InputError, f"returned {wrong!r}", tagrid.encode, samples, Wrong())
        read, write = os.pipe()
        os.set_blocking(write, False)
        with open(read, "rb"), open(write, "wb", buffering=0) as full:
            self.assertRaises(BlockingIOError, tagrid.encode, blobs((70, 60, 60)), full)

    def test_an_array_that_fails_leaves_the_file_that_was_there(self):
        path = self.folder / "v.tag"
        path.write_text("before")

        class Failing(Loaded):
            def __getitem__(self, key):
                if key.start > 0:
                    raise ZeroDivisionError("no luck")
                return self.array[key]

        self.assertRaises(ZeroDivisionError, tagrid.encode, Failing(blobs(SHAPE), (20, 20, 30)), path)
        self.assertRaises(ZeroDivisionError, tagrid.encode, blobs(SHAPE), path, progress=lambda *_: 1 / 0)
        self.assertEqual((path.read_text(), self.left()), ("before", ["v.tag"]))


class Writing(unittest.TestCase):
    setUp, left = Encoding.setUp, Encoding.left

    def test_slices_are_taken_as_they_come(self):
        samples = blobs(SHAPE)
        path = self.folder / "v.tag"
        with tagrid.Writer(path, shape=SHAPE, dtype="int16", max_error=2) as writer:
            writer.write(samples[0])
            writer.write(samples[1:1])
            writer.write(samples[1:40])
            self.assertNotIn("v.tag", self.left())
            writer.write(samples[40:].astype(">i2"))
        self.assertEqual(path.read_bytes(), tagrid.encode(samples, max_error=2))
        self.assertEqual(writer.info["dims"], (30, 20, 70))
        self.assertLessEqual(writer.info["achieved_max_error"], 2)
        writer.close()
        self.assertRaises(tagrid.ArgumentError, writer.write, samples)

    def test_an_exception_in_the_block_leaves_nothing(self):
        samples = blobs(SHAPE)
        path = self.folder / "v.tag"
        for error in (ZeroDivisionError, KeyboardInterrupt):
            with self.assertRaises(error):
                with tagrid.Writer(path, shape=SHAPE, dtype="int16") as writer:
                    writer.write(samples)
                    raise error
            self.assertEqual(self.left(), [])
        self.assertRaises(tagrid.ArgumentError, lambda: writer.info)

    def test_too_few_or_too_many_slices_are_errors(self):
        samples = blobs(SHAPE)
        path = self.folder / "v.tag"
        with self.assertRaisesRegex(tagrid.ArgumentError, "30 of 70 slices are missing"):
            with tagrid.Writer(path, shape=SHAPE, dtype="int16") as writer:
                writer.write(samples[:40])
        with self.assertRaisesRegex(tagrid.ArgumentError, "too many"):
            with tagrid.Writer(path, shape=SHAPE, dtype="int16") as writer:
                writer.write(samples)
                writer.write(samples[0])
        self.assertEqual(self.left(), [])

    def test_slices_of_another_shape_or_type_are_refused(self):
        with tagrid.Writer(io.BytesIO(), shape=(1, 3, 4), dtype=np.float32, value_range=(0, 1)) as writer:
            for slices, error in ((np.zeros((4, 3), "f4"), ValueError), (np.zeros((3, 4), "f8"), TypeError),
                                  (np.zeros(12, "f4"), ValueError), (np.zeros((1, 1, 3, 4), "f4"), ValueError), ([[1]], TypeError)):
                self.assertRaises(error, writer.write, slices)
            writer.write(np.zeros((3, 4), "f4"))
        with self.assertRaisesRegex(tagrid.ArgumentError, "value_range"):
            tagrid.Writer(io.BytesIO(), shape=(1, 3, 4), dtype=np.float32)
        with self.assertRaisesRegex(TypeError, "int32"):
            tagrid.Writer(io.BytesIO(), shape=(1, 3, 4), dtype=np.int64)

    def test_a_writer_that_is_never_closed_leaves_nothing_after_the_end_of_the_process(self):
        program = (f"import tagrid, numpy, threading, time\n"
                   f"writer = tagrid.Writer({str(self.folder / 'v.tag')!r}, shape=(700, 40, 50), dtype='int16')\n"
                   "def write():\n"
                   "    while True: writer.write(numpy.zeros((1, 40, 50), 'int16')), time.sleep(0.01)\n"
                   "threading.Thread(target=write, daemon=True).start()\n"
                   "time.sleep(0.1)\n")
        subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
        self.assertEqual(self.left(), [])

    def test_a_forked_process_leaves_the_file_alone(self):
        samples, path = blobs(SHAPE), self.folder / "v.tag"
        with tagrid.Writer(path, shape=SHAPE, dtype="int16") as writer:
            writer.write(samples[:40])
            child = os.fork()
            if child == 0:
                signal.alarm(30)
                refused = 0
                for call in (lambda: writer.write(samples[40:]), writer.close):
                    try:
                        call()
                    except tagrid.ArgumentError:
                        refused += 1
                writer.abort()
                del writer
                os._exit(refused)
            self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 2)
            writer.write(samples[40:])
        np.testing.assert_array_equal(tagrid.open(path)[...], samples)
        self.assertEqual(self.left(), ["v.tag"])

    def test_a_callback_that_uses_its_own_writer_is_an_error_and_does_not_wait_for_itself(self):
        samples = blobs(SHAPE)
        for name in ("write", "close", "abort"):
            writer = tagrid.Writer(self.folder / "v.tag", shape=SHAPE, dtype="int16",
                                   progress=lambda *_: writer.write(samples[0]) if name == "write" else getattr(writer, name)())
            with self.assertRaises(tagrid.ArgumentError):
                writer.write(samples)
                writer.close()
            writer.abort()
            self.assertEqual(self.left(), [])

    def test_names_may_be_as_long_as_the_system_takes_them(self):
        name = "\N{CJK UNIFIED IDEOGRAPH-65E5}" * 80 + ".tag"
        tagrid.encode(blobs((2, 3, 4)), self.folder / name)
        self.assertEqual(self.left(), [name])
        asked = []
        with self.assertRaises(OSError) as caught:
            tagrid.encode(blobs((2, 3, 4)), self.folder / ("a" * 256), progress=lambda *_: asked.append(1))
        self.assertEqual((caught.exception.errno, asked), (errno.ENAMETOOLONG, []))
        self.assertRaises(FileNotFoundError, tagrid.encode, blobs((2, 3, 4)), "")

    def test_what_an_array_does_not_promise_is_not_converted_silently(self):
        samples = blobs(SHAPE)
        for array, message in ((samples.astype(np.int64) * 1000, "are int64, where the array says int16"),
                               (samples + 0.5, "are float64, where the array says int16"),
                               (np.ma.masked_less(samples, 100), "are masked in part")):
            loaded = Loaded(array)
            loaded.dtype = np.dtype("int16")
            self.assertRaisesRegex(TypeError, message, tagrid.encode, loaded)
        self.assertEqual(tagrid.encode(Loaded(np.ma.array(samples))), tagrid.encode(samples))
        with self.assertRaisesRegex(TypeError, "fill them first"):
            with tagrid.Writer(io.BytesIO(), shape=SHAPE, dtype="int16") as writer:
                writer.write(np.ma.masked_less(samples, 100))

    def test_metadata_that_is_not_utf_8_comes_back(self):
        header = b"patient:=M\xfcller\n".decode("utf-8", "surrogateescape")
        first = tagrid.open(tagrid.encode(blobs((2, 3, 4)), metadata=header))
        self.assertEqual(tagrid.open(tagrid.encode(first)).header, header)
        self.assertEqual(tagrid.open(tagrid.encode(first, spacing=(1, 2, 3))).metadata, first.metadata)
        with self.assertRaisesRegex(tagrid.ArgumentError, "NUL"):
            tagrid.encode(blobs((2, 3, 4)), metadata={"patient": "a\0b"})

    def test_threads_may_take_turns(self):
        samples = blobs(SHAPE)
        memory = io.BytesIO()
        with tagrid.Writer(memory, shape=SHAPE, dtype="int16") as writer:
            for first in range(0, 70, 10):
                thread = threading.Thread(target=writer.write, args=(samples[first:first + 10],))
                thread.start()
                thread.join()
        self.assertEqual(memory.getvalue(), tagrid.encode(samples))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
