"""The filter for HDF5 files, as h5py, h5dump, h5repack and VTK load it.

    hdf5_filter_test.py PROGRAM PLUGINS
        PLUGINS: the folder with the plugin
"""

import importlib.util
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PROGRAM, PLUGINS = sys.argv[1], sys.argv[2]
os.environ["HDF5_PLUGIN_PATH"] = PLUGINS  # before the library is loaded

import h5py
import numpy

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from versions import words_of_filter

FILTER = 33184
TYPES = ["u1", "i1", "<u2", ">u2", "<i2", ">i2", "<u4", ">u4", "<i4", ">i4", "<f4", ">f4", "<f8", ">f8"]


def waves(shape, type="<i2", seed=1):
    """A smooth volume with noise."""
    axes = numpy.meshgrid(*[numpy.arange(n) for n in shape], indexing="ij")
    field = 60 + sum(15 * numpy.sin(axis / (7 + 2 * i)) for i, axis in enumerate(axes))
    return (field + numpy.random.default_rng(seed).normal(0, 2, shape)).astype(type)


def double(bound):
    """The bound as two numbers."""
    bits = int(numpy.float64(bound).view(numpy.uint64))
    return (bits & 0xFFFFFFFF, bits >> 32)


def largest_error(a, b):
    return numpy.abs(a.astype("f8") - b.astype("f8")).max()


class FilterTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.path = self.folder / "a.h5"

    def write(self, data, numbers=(), chunks=True, **options):
        with h5py.File(self.path, "w") as file:
            file.create_dataset("a", data=data, chunks=chunks, compression=FILTER, compression_opts=numbers, **options)

    def read(self, part=()):
        with h5py.File(self.path) as file:
            return file["a"][part]

    def run_program(self, *arguments, check=True):
        return subprocess.run(arguments, check=check, capture_output=True, text=True)

    def test_every_type_and_byte_order_comes_back_within_the_bound(self):
        for type, (bound, numbers) in itertools.product(TYPES, [(0, ()), (0, (0,)), (3, (3,)), (0.75, double(0.75)), (3, double(3) + (1,))]):
            data = waves((9, 20, 31), type)
            self.write(data, numbers, chunks=(8, 16, 31))
            found = self.read()
            self.assertEqual(found.dtype, data.dtype)
            self.assertLessEqual(largest_error(found, data), bound, f"{type} {numbers}")
            if bound == 0:
                self.assertEqual(found.tobytes(), data.tobytes(), f"{type} {numbers}")

    def test_any_rank_with_three_long_axes_at_most(self):
        for shape, chunks in [((100,), (33,)), ((40, 30), (16, 30)), ((2, 3, 20, 21, 5), (1, 3, 20, 1, 5)), ((1,), (1,)), ((7, 1, 1), (2, 1, 1))]:
            data = waves(shape)
            self.write(data, chunks=chunks)
            numpy.testing.assert_array_equal(self.read(), data, str(shape))

    def test_fill_values_and_partial_chunks_do_not_disturb(self):
        data = waves((20, 21, 22), "<f4")
        for fill in (0, 1e30, float("nan"), float("inf")):
            with h5py.File(self.path, "w") as file:
                set = file.create_dataset("a", data.shape, "<f4", chunks=(16, 16, 16), fillvalue=fill, compression=FILTER, compression_opts=(1,))
                set[:18] = data[:18]
            found = self.read()
            self.assertLessEqual(largest_error(found[:18], data[:18]), 1, str(fill))
            # As every sample, those of a chunk that was written only in part.
            numpy.testing.assert_allclose(found[18:], numpy.full_like(data[18:], fill), rtol=0, atol=1, err_msg=str(fill))

    def test_samples_that_are_not_finite_come_back(self):
        for type in ("<f4", ">f8"):
            data = waves((8, 8, 8), type)
            data[0, 0, :3] = numpy.nan, numpy.inf, -numpy.inf
            for shown in (data, numpy.full_like(data, numpy.nan), numpy.full_like(data, numpy.inf)):
                self.write(shown, (1,), chunks=data.shape)
                found, finite = self.read(), numpy.isfinite(shown)
                numpy.testing.assert_array_equal(found[~finite], shown[~finite])
                if finite.any():
                    self.assertLessEqual(largest_error(found[finite], shown[finite]), 1)

    def test_what_cannot_be_coded_is_refused_with_a_reason(self):
        small = numpy.zeros((4, 4, 4), "<i2")
        for what, data, options, words in [
            ("64 bits", small.astype("i8"), {}, "8, 16 or 32 bits"),
            ("half floats", small.astype("f2"), {}, "8, 16 or 32 bits"),
            ("booleans", small.astype(bool), {}, "8, 16 or 32 bits"),
            ("a compound type", numpy.zeros(4, [("a", "i2"), ("b", "i2")]), {}, "8, 16 or 32 bits"),
            ("four long axes", numpy.zeros((2, 2, 2, 2), "i2"), {}, "more than three axes"),
            ("shuffle", small, {"shuffle": True}, "first filter"),
            ("a negative bound", small, {"numbers": double(-1)}, "at least 0"),
            ("a bound of NaN", small, {"numbers": double(float("nan"))}, "at least 0"),
            ("a bound of infinity", small, {"numbers": double(float("inf"))}, "at least 0"),
            ("an effort of 3", small, {"numbers": (0, 0, 3)}, "effort"),
            ("five numbers", small, {"numbers": (1, 2, 3, 4, 5)}, "none to four numbers"),
            ("a fourth number of 2", small, {"numbers": (0, 0, 0, 2)}, "fourth number"),
        ]:
            with self.assertRaisesRegex(ValueError, words, msg=what):
                self.write(data, options.get("numbers", ()), chunks=data.shape, shuffle=options.get("shuffle", False))

    def test_a_fill_value_is_not_lost_in_whole_chunks(self):
        for type, fill, bound, refused in (("<i2", -999, 2, True), (">f4", -999, 2, True), ("<f8", numpy.nan, 2, False), ("<i2", -999, 0.5, False),
                                           ("<f4", numpy.inf, 2, False), ("<i2", 0, 2, False), ("<i2", None, 2, False)):
            data = waves((4, 4, 4), type)
            numbers = double(bound) + (0, 1)
            if refused:
                with self.assertRaisesRegex(ValueError, "the fill value would not come back"):
                    self.write(data, numbers, chunks=data.shape, fillvalue=fill)
            else:
                self.write(data, numbers, chunks=data.shape, fillvalue=fill)
            self.write(data, double(bound), chunks=data.shape, fillvalue=fill)

    def test_checksums_after_the_filter_work(self):
        data = waves((16, 16, 16))
        self.write(data, fletcher32=True)
        numpy.testing.assert_array_equal(self.read(), data)

    def test_h5repack_compresses_and_h5dump_shows_it(self):
        data = waves((40, 33, 34))
        with h5py.File(self.folder / "plain.h5", "w") as file:
            file.create_dataset("a", data=data)
        packed, again = self.folder / "packed.h5", self.folder / "again.h5"
        self.run_program("h5repack", "-l", "a:CHUNK=16x33x34", "-f", f"a:UD={FILTER},0,1,2", self.folder / "plain.h5", packed)
        shown = self.run_program("h5dump", "-p", "-H", packed).stdout
        self.assertIn(f"FILTER_ID {FILTER}", shown)
        self.assertIn("COMMENT tagrid", shown)
        self.run_program("h5repack", "-f", f"a:UD={FILTER},0,0", packed, again)  # lossless now
        with h5py.File(packed) as one, h5py.File(again) as two:
            self.assertLessEqual(largest_error(one["a"][...], data), 2)
            self.assertGreater(largest_error(one["a"][...], data), 0)
            numpy.testing.assert_array_equal(one["a"][...], two["a"][...])
        self.run_program("h5repack", "-f", "NONE", "-l", "CONTI", packed, again)
        self.assertEqual(self.run_program("h5diff", packed, again, "/a").stdout, "")

    def test_a_chunk_is_a_tag_file(self):
        data = waves((16, 20, 24))
        # Where chunks may be written in parts, the file has places on a lattice, and the slope that makes samples of them.
        for numbers, slope in (((), 1), (double(2) + (0, 1), 1), ((2,), 5)):
            self.write(data, numbers, chunks=data.shape)
            with h5py.File(self.path) as file:
                chunk = file["a"].id.read_direct_chunk((0, 0, 0))[1]
                expected = file["a"][...]
            (self.folder / "chunk.tag").write_bytes(chunk)
            self.run_program(PROGRAM, "verify", self.folder / "chunk.tag")
            self.run_program(PROGRAM, "decode", self.folder / "chunk.tag", "-f", "-o", self.folder / "chunk.raw")
            found = numpy.fromfile(self.folder / "chunk.raw", data.dtype).reshape(data.shape)
            numpy.testing.assert_array_equal(slope * found, expected)
            info = json.loads(self.run_program(PROGRAM, "info", "--json", self.folder / "chunk.tag").stdout)
            self.assertEqual(float(info["source"]["pairs"].get("rescale_slope", 1)), slope)

    def test_slices_are_written_one_by_one_within_the_bound(self):
        for type, bound in itertools.product(("<i2", ">u2", "<f4"), (2, 20)):
            data = waves((16, 40, 40), type)
            for whole in (0, 1):
                with h5py.File(self.path, "w", rdcc_nbytes=0) as file:
                    dataset = file.create_dataset("a", data.shape, type, chunks=(16, 20, 20), compression=FILTER,
                                                  compression_opts=double(bound) + (0, whole))
                    for z, plane in enumerate(data):
                        dataset[z] = plane
                # Errors add up only where a user says that it does not happen.
                self.assertEqual(largest_error(self.read(), data) <= bound, not whole, f"{type} {bound} {whole}")

    def test_tag_files_are_written_as_chunks(self):
        data = waves((64, 32, 48))
        files = {}
        for z in range(0, 64, 16):
            part, source = self.folder / f"{z}.tag", self.folder / f"{z}.raw"
            source.write_bytes(data[z:z + 16].tobytes())
            grid = "stored" if z == 0 else "derived"
            self.run_program(PROGRAM, "encode", source, "--dims", "48,32,16", "--type", "int16", "--max-error", "1", "--grid", grid, "-o", part)
            files[z] = part.read_bytes()
        with h5py.File(self.path, "w") as file:
            set = file.create_dataset("a", data.shape, data.dtype, chunks=(16, 32, 48), compression=FILTER,
                                      compression_opts=double(1) + (0, 1))
            parts = file.create_dataset("parts", data.shape, data.dtype, chunks=(16, 32, 48), compression=FILTER, compression_opts=(1,))
            for z, chunk in files.items():
                set.id.write_direct_chunk((z, 0, 0), chunk)
                parts.id.write_direct_chunk((z, 0, 0), chunk)
        self.assertLessEqual(largest_error(self.read(), data), 1)
        # Writing a part of such a chunk would add another error.
        why = words_of_filter("whole_chunks in Python")
        with h5py.File(self.path) as file, self.assertRaisesRegex(OSError, why):
            file["parts"][...]

    def test_damaged_chunks_are_errors_and_never_other_samples(self):
        data = waves((12, 13, 14))
        self.write(data, (1,), chunks=data.shape)
        expected = self.read()
        with h5py.File(self.path, "r+") as file:
            set = file["a"]
            chunk = bytearray(set.id.read_direct_chunk((0, 0, 0))[1])
            damages = [chunk[:n] for n in range(0, len(chunk), 37)] + [chunk + b"x"]
            for i in range(0, len(chunk), 3):
                damages.append(chunk[:i] + bytes([chunk[i] ^ (1 << i % 8)]) + chunk[i + 1:])
            caught = 0
            for damage in damages:
                set.id.write_direct_chunk((0, 0, 0), bytes(damage) or b"\0")
                set.id.refresh() if hasattr(set.id, "refresh") else None
                try:
                    found = set[...]
                except OSError:
                    caught += 1
                else:
                    numpy.testing.assert_array_equal(found, expected)
        # Statistics in the index say nothing that a chunk is read by.
        self.assertGreater(caught, 0.9 * len(damages))

    def test_damaged_numbers_are_errors(self):
        data = waves((12, 13, 14))
        self.write(data, (1,), chunks=data.shape)
        stored = numpy.array(double(1) + (0, 0, 2, 4, 14, 13, 12, 0, 0), "<u4").tobytes()
        content = self.path.read_bytes()
        at = content.index(stored)
        for number, value in [(1, 0x40080000), (3, 2), (4, 1), (4, 0), (5, 0), (5, 9), (5, 3), (5, 4 + 512), (6, 0), (6, 13), (6, 2**32 - 1),
                              (7, 2**31), (8, 14), (9, 1)]:
            damaged = bytearray(content)
            damaged[at + 4 * number:at + 4 * number + 4] = value.to_bytes(4, "little")
            self.path.write_bytes(damaged)
            with self.assertRaises(OSError, msg=f"number {number} is {value}"):
                self.read()

    def test_the_examples_of_the_document_work(self):
        text = (pathlib.Path(__file__).resolve().parents[2] / "docs/hdf5.md").read_text()
        blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        if importlib.util.find_spec("tagrid") is None:
            blocks = [block for block in blocks if "import tagrid" not in block]
        self.assertGreaterEqual(len(blocks), 2)
        python = "".join(blocks)
        subprocess.run([sys.executable, "-c", python], check=True, cwd=self.folder)
        with h5py.File(self.folder / "plain.h5", "w") as file, h5py.File(self.folder / "scan.h5") as packed:
            file["scan"] = packed["scan"][...]
        commands = [line for line in text.splitlines() if line.startswith("h5repack ")]
        self.assertEqual(len(commands), 3)
        for command in commands:
            subprocess.run(["bash", "-euc", command], check=True, cwd=self.folder)

    def test_vtk_reads_a_compressed_vtkhdf_file(self):
        try:
            from vtkmodules.vtkIOHDF import vtkHDFReader
            from vtkmodules.util.numpy_support import vtk_to_numpy
        except ImportError:
            self.skipTest("there is no VTK for Python on this machine (python3-vtk9)")
        data = waves((24, 25, 26))
        path = self.folder / "a.vtkhdf"
        with h5py.File(path, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = (1, 0)
            root.attrs.create("Type", b"ImageData", dtype=h5py.string_dtype("ascii", 9))
            root.attrs["WholeExtent"] = (0, 25, 0, 24, 0, 23)
            root.attrs["Origin"], root.attrs["Spacing"], root.attrs["Direction"] = (0.0, 0, 0), (1.0, 1, 1), (1.0, 0, 0, 0, 1, 0, 0, 0, 1)
            root.create_group("PointData").create_dataset("value", data=data, chunks=(16, 16, 16), compression=FILTER, compression_opts=(2,))
        reader = vtkHDFReader()
        reader.SetFileName(str(path))
        reader.Update()
        found = vtk_to_numpy(reader.GetOutput().GetPointData().GetArray("value")).reshape(data.shape)
        self.assertLessEqual(largest_error(found, data), 2)
        self.assertGreater(largest_error(found, data), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
