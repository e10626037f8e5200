"""The package tagrid-reader reads what the package tagrid reads: same samples, metadata, exceptions and words. What is
damaged, forked or used by several threads gives neither a crash nor wrong samples.

    reader_test.py PROGRAM BUILD
"""

import importlib
import io
import os
import pathlib
import pickle
import shutil
import subprocess
import sys
import threading
import time
import types
import unittest
from unittest import mock

import numpy as np
import tagrid
import tagrid_reader
from tagrid_reader import _library, _tagrid

from volumes import TYPES, blobs, in_threads, temporary_folder

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.path.abspath(sys.argv[1])
GOLDEN = sorted((ROOT / "tests/golden/1.0").glob("*.tag"))
sys.path.insert(0, str(ROOT / "tests/format"))
from forged import of_version_6  # noqa: E402

METADATA = {"space": "left-posterior-superior", "rescale_slope": "2", "rescale_intercept": "-1024",
            "Scanner": "a: b\n\\c"}
#: Ends within bricks.
SHAPES = ((1, 1, 1), (1, 5, 70), (65, 1, 66), (30, 40, 3), (9, 66, 68), (64, 64, 64), (7, 8, 9), (67, 33, 20))
# Reads a file that is damaged in many ways; another process, so that a crash is seen.
DAMAGES = """
import faulthandler, sys
import numpy as np
import tagrid_reader
faulthandler.enable()
random = np.random.default_rng(int(sys.argv[2]))
good = open(sys.argv[1], "rb").read()
def samples(data):
    volume = tagrid_reader.open(data)
    volumes = [volume.volume(number) for number in range(volume.volumes)]
    return [np.asarray(one) for each in volumes for one in (each, *map(each.overview, each.overviews))]
expected, refused = samples(good), 0
for round in range(int(sys.argv[3])):
    data = bytearray(good)
    if round % 3 == 0:
        del data[int(random.integers(len(data))):]
    elif round % 3 == 1:
        # Also at both ends, which say where everything is.
        places = random.integers(len(data)), random.integers(128), len(data) - 1 - random.integers(200)
        place = int(random.choice(places))
        data[place] ^= 1 << int(random.integers(8))
    else:
        place = int(random.integers(len(data)))
        data[place:place + 50] = random.bytes(50)
    try:
        found = samples(data)
    except (tagrid_reader.DamagedError, tagrid_reader.NewerFormatError) as error:
        assert str(error).startswith("bytearray"), error
        refused += 1
        continue
    assert [one.tobytes() for one in found] == [one.tobytes() for one in expected], f"wrong samples in round {round}"
print(refused)
"""


def encoded():
    """Odd volumes: each type, with and without a grid, overviews and positions."""
    for number, (dtype, shape) in enumerate(zip(TYPES, SHAPES)):
        samples = blobs(shape, dtype, number)
        more = {} if dtype in ("uint8", "int8", "uint16", "int16") else {"value_range": (0, 100)}
        yield f"lossless {dtype}", tagrid.encode(samples, metadata=METADATA, spacing=(2, 0.5, 0.25))
        yield f"bounded {dtype}", tagrid.encode(samples, max_error=3, cube=8, brick=2, lead=number % 2, **more)
        yield f"derived {dtype}", tagrid.encode(samples, max_error=2, grid="derived", overviews=(4,), **more)
    affine = np.array([[0, 0.5, 0, 3], [-0.25, 0, 0, -4], [0, 0, 2, 5.5], [0, 0, 0, 1.0]])
    yield "grid", tagrid.encode(blobs((20, 30, 40)), grid_only=True, max_error=None, affine=affine)
    places = "; ".join(f"1 2 {z * z}" for z in range(9))
    slopes = {"slice_positions": places, "slice_slopes": " ".join(map(str, range(1, 10))), "slice_intercepts": "5 " * 9}
    yield "slices", tagrid.encode(blobs((9, 70, 40), "uint8"), metadata=slopes)


def outcome(work, *arguments):
    """The result of a call, or its exception, in words that do not name the package."""
    try:
        found = work(*arguments)
    except Exception as error:
        return type(error).__name__, str(error).replace("tagrid_reader", "tagrid")
    if isinstance(found, (np.ndarray, np.generic)):
        return found.dtype.str, found.shape, found.tobytes()
    return repr(found).replace("tagrid_reader", "tagrid")


class Source:
    """A file in memory that waits before each read, and may fail."""

    name = "a source"

    def __init__(self, data, wait=0.0):
        self.data, self.size, self.wait, self.error = data, len(data), wait, None

    def read_at(self, offset, size):
        time.sleep(self.wait)
        if self.error:
            raise self.error
        return memoryview(self.data)[offset:offset + size]


class Reading(unittest.TestCase):
    def assert_same(self, one, other, work, *arguments):
        self.assertEqual(outcome(work, other, *arguments), outcome(work, one, *arguments))

    def assert_same_volume(self, one, other):
        random = np.random.default_rng(1)
        self.assert_same(one, other, np.asarray)
        for name in ("shape", "dtype", "size", "nbytes", "chunks", "spacing", "affine", "slice_positions", "max_error",
                     "achieved", "levels", "metadata", "header", "overviews", "volumes", "is_first_of_several"):
            self.assert_same(one, other, getattr, name)
        self.assertEqual(repr(sorted(one.info.items())), repr(sorted(other.info.items())))
        for bricks in (1, 2):
            self.assert_same(one, other, lambda volume: volume.aligned_chunks(bricks))
        for work in (repr, len, lambda volume: volume._repr_html_(), lambda volume: np.stack(list(volume)),
                     lambda volume: volume.rescaled, lambda volume: np.asarray(volume.rescaled),
                     lambda volume: volume.rescaled[-1, ..., ::2], lambda volume: volume.rescaled.metadata,
                     lambda volume: volume.rescaled.achieved):
            self.assert_same(one, other, work)
        for _ in range(8):
            ends = [sorted(random.integers(-2, size + 3, 2)) for size in one.shape]
            key = tuple(slice(int(low), int(high), int(random.choice([1, 2, 5, 70, -1, -3]))) for low, high in ends)
            self.assert_same(one, other, lambda volume: volume[key])
            region, step = [tuple(map(int, pair)) for pair in ends], tuple(map(int, random.integers(0, 9, 3)))
            self.assert_same(one, other, lambda volume: volume.read(region, step, threads=int(random.integers(1, 4))))

    def test_golden_files_are_those_of_the_package_and_of_the_program(self):
        folder = temporary_folder(self)
        self.assertGreater(len(GOLDEN), 30)
        for path in GOLDEN:
            with self.subTest(path.name):
                one, other = tagrid.open(path), tagrid_reader.open(path)
                decode = [PROGRAM, "decode", path, "--volume", "0", "-o", folder / "a.raw", "-q", "-f"]
                subprocess.run(decode, check=True)
                self.assertEqual(np.asarray(other).tobytes(), (folder / "a.raw").read_bytes())
                self.assert_same_volume(one, other)
                for factor in one.overviews:
                    self.assert_same_volume(one.overview(factor), other.overview(factor))
                for number in range(one.volumes):
                    self.assert_same_volume(one.volume(number), other.volume(number))
                for work in (lambda volume: volume.overview(7), lambda volume: volume.volume(9),
                             lambda volume: volume.volume("0")):
                    self.assert_same(one, other, work)

    def test_odd_volumes_are_those_of_the_package(self):
        for name, data in encoded():
            with self.subTest(name):
                self.assert_same_volume(tagrid.open(data), tagrid_reader.open(data))

    def test_arguments_are_refused_in_the_same_words(self):
        data = tagrid.encode(blobs((20, 30, 70)))
        one, other = tagrid.open(data), tagrid_reader.open(data)
        for key in (20, (0, 0, 0, 0), (0, [1, 2], [3, 4]), 1.5, "a", [True] * 20, np.ones((20, 30, 70), bool), None,
                    (..., [1, 69, 3])):
            self.assert_same(one, other, lambda volume: volume[key])
        for arguments in ({"region": 5}, {"region": ((0, 0), (0, 1), (0, 1))}, {"step": 0}, {"threads": -1},
                          {"threads": "2"}, {"out": np.empty(3, np.int16)}, {"out": np.empty((20, 30, 70), np.uint8)},
                          {"out": 5},
                          {"memory_limit": -1}, {"out": np.empty((70, 30, 20), np.int16).T[::-1]}):
            self.assert_same(one, other, lambda volume: volume.read(**arguments))
        folder = temporary_folder(self)
        os.mkfifo(folder / "pipe")
        for source in (folder, folder / "pipe", folder / "none", "http://localhost/a.tag", "a\0b", 3, None,
                       io.StringIO(), np.zeros(3), b"/", os.fsencode(__file__), b"", b"x" * 99, data[:-1], data[1:],
                       data + b"x", of_version_6(data), __file__):
            outcomes = [outcome(package.open, source) for package in (tagrid, tagrid_reader)]
            self.assertEqual(*outcomes)
            self.assertIn(outcomes[0][0], ("DamagedError", "NewerFormatError", "InputError", "TypeError", "ValueError",
                                           "FileNotFoundError", "IsADirectoryError"))
        for volume in (one, other):
            volume.close()
        self.assert_same(one, other, lambda volume: volume[0])
        self.assert_same(one, other, repr)

    def test_every_source_gives_the_same_samples(self):
        samples = blobs((66, 30, 70))
        path = temporary_folder(self) / "scan é.tag"
        path.write_bytes(tagrid.encode(samples))
        data = path.read_bytes()
        with open(path, "rb") as file, open(path, "rb", buffering=0) as raw:
            for source in (path, str(path), file, raw, io.BytesIO(data), data, bytearray(data), memoryview(data),
                           Source(data)):
                with self.subTest(type(source)), tagrid_reader.open(source) as volume:
                    np.testing.assert_array_equal(np.asarray(volume), samples)
                    self.assertTrue(volume.closed is False)
        volume = tagrid_reader.open(path)
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(volume))[5], samples[5])
        again = pickle.dumps(volume)
        path.write_bytes(tagrid.encode(samples + np.int16(1)))
        self.assertRaisesRegex(tagrid_reader.InputError, "not the one", pickle.loads, again)

    # ---- what goes wrong

    def test_damaged_files_give_exceptions_and_no_wrong_samples(self):
        rounds = 3000 if os.environ.get("TAGRID_LONG") else 45
        for name in ("lead_voxels_overviews_int16", "pages_lossless_uint8", "volumes_bounded_int16",
                     "few_labels_uint16", "parity_bounded_int16", "transformed_float32"):
            path = ROOT / f"tests/golden/1.0/{name}.tag"
            run = subprocess.run([sys.executable, "-B", "-c", DAMAGES, path, "1", str(rounds)], text=True,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            self.assertEqual(run.returncode, 0, f"{name}: {run.stdout}")
            self.assertGreater(int(run.stdout), rounds // 3, name)

    def test_numbers_of_the_library_are_not_believed(self):
        volume = tagrid_reader.open(tagrid.encode(blobs((20, 30, 70))))
        planned = _tagrid._planned
        for change in (lambda block: setattr(block.range, "bytes", 2**63),
                       lambda block: setattr(block.range, "offset", 2**63),
                       lambda block: block.box.high.__setitem__(0, 71), lambda block: block.box.low.__setitem__(1, -1),
                       lambda block: block.box.high.__setitem__(2, 3), lambda block: setattr(block, "number", 99)):
            def changed(*arguments):
                found = planned(*arguments)
                change(found[0])
                return found
            with mock.patch.object(_tagrid, "_planned", changed), self.assertRaises(tagrid_reader.Error):
                volume[:]

    def test_what_a_source_raises_is_passed_on(self):
        samples = blobs((20, 30, 200))
        source = Source(tagrid.encode(samples))
        volume = tagrid_reader.open(source)
        source.error = KeyError("mine")
        for threads in (1, 3):
            self.assertRaisesRegex(KeyError, "mine", volume.read, threads=threads)
        self.assertRaisesRegex(KeyError, "mine", tagrid_reader.open, source)
        source.error = None
        source.data = source.data[:-5000]
        words = r"a source: read_at\(\d+, \d+\) returned \d+ bytes"
        self.assertRaisesRegex(tagrid_reader.InputError, words, lambda: volume[:])

    def test_progress_and_a_limit_of_memory(self):
        samples = blobs((70, 70, 140))
        volume, told = tagrid_reader.open(tagrid.encode(samples)), []
        np.testing.assert_array_equal(volume.read(threads=2, progress=lambda *numbers: told.append(numbers)), samples)
        self.assertEqual(told[-1], (samples.nbytes, samples.nbytes))
        self.assertEqual(told, sorted(told))
        self.assertRaises(ZeroDivisionError, volume.read, progress=lambda done, total: 1 // 0)
        words = r"needs \d+ bytes of memory, and the limit is 1$"
        with self.assertRaisesRegex(tagrid_reader.MemoryLimitError, words) as raised:
            volume.read(memory_limit=1)
        self.assertIsInstance(raised.exception, MemoryError)
        np.testing.assert_array_equal(volume.read(threads=4, memory_limit=4_000_000), samples)

    def test_ctrl_c_ends_a_read(self):
        program = ("import os, signal, sys, threading, time, tagrid_reader\n"
                   "class Source:\n"
                   "    data = open(sys.argv[1], 'rb').read(); size = len(data)\n"
                   "    def read_at(self, offset, size):\n"
                   "        time.sleep(0.05)\n"
                   "        return self.data[offset:offset + size]\n"
                   "volume = tagrid_reader.open(Source())\n"
                   "threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
                   "try:\n"
                   "    while True: volume.read(threads=2)\n"
                   "except KeyboardInterrupt: print('ended')\n")
        path = ROOT / "tests/golden/1.0/pages_lossless_uint8.tag"
        done = subprocess.run([sys.executable, "-B", "-c", program, path], stdout=subprocess.PIPE, text=True,
                              timeout=60)
        self.assertEqual((done.returncode, done.stdout), (0, "ended\n"))

    # ---- threads and processes

    def test_threads_decode_at_the_same_time(self):
        samples = blobs((140, 70, 140))
        data = tagrid.encode(samples)
        for source in (data, io.BytesIO(data)):
            volume, wrong = tagrid_reader.open(source), []

            def read(seed):
                random = np.random.default_rng(seed)
                for _ in range(8):
                    low = [int(random.integers(0, size)) for size in samples.shape]
                    key = tuple(slice(n, n + 40) for n in low)
                    if not np.array_equal(volume[key], samples[key]):
                        wrong.append(key)

            in_threads(read, range(2))
            self.assertEqual(wrong, [])

    def test_it_may_be_closed_while_it_is_read(self):
        samples = blobs((140, 70, 140))
        volume = tagrid_reader.open(tagrid.encode(samples))
        np.testing.assert_array_equal(volume.read(threads=2, progress=lambda done, total: volume.close()), samples)
        self.assertRaisesRegex(tagrid_reader.ArgumentError, "closed", volume.read)

    def test_a_forked_process_reads_whatever_other_threads_did(self):
        samples = blobs((66, 70, 140))
        source = Source(tagrid.encode(samples, overviews=(4,)), 0.002)
        volume = tagrid_reader.open(source)
        overview = volume.overview(4)
        expected, ended = np.asarray(overview), threading.Event()

        def read():
            while not ended.is_set():
                tagrid_reader.open(source).overview(4).close()
                volume.read(threads=2)

        threads = [threading.Thread(target=read) for _ in range(2)]
        for thread in threads:
            thread.start()
        try:
            for _ in range(5):
                time.sleep(0.003)
                child = os.fork()
                if child == 0:
                    good = np.array_equal(overview[:], expected) and np.array_equal(volume[:], samples)
                    overview.close()
                    volume.close()
                    os._exit(0 if good else 1)
                limit = time.monotonic() + 30
                while (ended_child := os.waitpid(child, os.WNOHANG))[0] == 0:
                    self.assertLess(time.monotonic(), limit, "the forked process hangs")
                    time.sleep(0.005)
                self.assertEqual(ended_child[1], 0)
        finally:
            ended.set()
            for thread in threads:
                thread.join()

    def test_a_process_that_is_forked_within_a_read_does_not_take_it_for_complete(self):
        volume = tagrid_reader.open(tagrid.encode(blobs((66, 70, 260))))
        parent, children = os.getpid(), []

        def fork(done, total):
            if os.getpid() == parent and not children and threading.current_thread() is threading.main_thread():
                children.append(os.fork())

        try:
            while not children:
                volume.read(threads=2, progress=fork)
        except tagrid_reader.Error as error:
            os._exit(3 if "forked" in str(error) else 4)
        if os.getpid() != parent:
            os._exit(0)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1]), 3)

    # ---- the library

    def test_another_version_of_the_library_is_refused(self):
        folder = temporary_folder(self)
        package = pathlib.Path(tagrid_reader.__file__).parent
        copy = shutil.copytree(package, folder / "tagrid_reader", ignore=shutil.ignore_patterns("__pycache__"))
        good = package / "libtagrid_reading.so"
        for version, library, words in (("0.9.0", good, "0.9.0 cannot use .* which has version"),
                                        (_library.VERSION, os.devnull, "cannot use its library")):
            (copy / "_version.py").write_text(f'VERSION = "{version}"\n')
            shutil.copyfile(library, copy / "libtagrid_reading.so")
            done = subprocess.run([sys.executable, "-B", "-c", "import tagrid_reader"], cwd=folder, text=True,
                                  stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(folder)})
            self.assertRegex(done.stderr, f"ImportError: tagrid_reader .*{words}")
        self.assertEqual(tagrid_reader.__version__, tagrid.__version__)

    @unittest.skipUnless(shutil.which("cc"), "there is no compiler for C")
    def test_structs_and_numbers_are_those_of_the_header(self):
        folder, lines, expected = temporary_folder(self), [], []
        for struct in (_library.Range, _library.Box, _library.Geometry, _library.Info, _library.Block):
            name = f"tagrid_{struct.__name__.lower()}"
            for field, _ in struct._fields_:
                lines.append(f"offsetof({name}, {field}), sizeof((({name}*)0)->{field}),")
                expected += [getattr(struct, field).offset, getattr(struct, field).size]
            lines.append(f"sizeof({name}),")
            expected.append(_library.ctypes.sizeof(struct))
        for name in ("OK", "INVALID_ARGUMENT", "BROKEN_INPUT", "IO_ERROR", "MEMORY_LIMIT", "OUT_OF_MEMORY",
                     "NEEDS_BYTES", "NEWER_FORMAT", "MOST_OVERVIEWS"):
            lines.append(f"TAGRID_{name},")
            expected.append(getattr(_library, name))
        for number, name in _library.TYPES.items():
            lines.append(f"TAGRID_{name.upper()},")
            expected.append(number)
        (folder / "a.c").write_text("#include <stdio.h>\n#include \"tagrid/tagrid_blocks.h\"\n"
                                    "int main(void) {\n  const long n[] = {" + "\n".join(lines) + "};\n"
                                    "  for (unsigned i = 0; i < sizeof n / sizeof *n; ++i)\n"
                                    "    printf(\"%ld \", n[i]);\n}\n")
        subprocess.run(["cc", f"-I{ROOT / 'include'}", folder / "a.c", "-o", folder / "a"], check=True)
        said = subprocess.run([folder / "a"], check=True, stdout=subprocess.PIPE, text=True).stdout
        self.assertEqual(list(map(int, said.split())), expected)

    def test_it_has_what_the_package_has_for_reading(self):
        names = set(tagrid_reader.__all__)
        self.assertLess(names, set(tagrid.__all__))
        public = {name for name in dir(tagrid.Volume) if not name.startswith("_")}
        self.assertEqual(public - set(dir(tagrid_reader.Volume)), {"verify", "active_points", "mesh", "surface"})
        for name in ("napari", "xarray", "zarr"):
            self.assertFalse(hasattr(tagrid_reader, name))
        for module in (ROOT / "python/reader/shared_modules.txt").read_text().split():
            if module.endswith(".py"):
                self.assertIsInstance(importlib.import_module(f"tagrid_reader.{module[:-3]}"), types.ModuleType)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
