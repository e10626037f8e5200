"""Overviews are the means of blocks, however a volume is encoded: an oracle computes them from the whole volume.

    overviews_test.py TAGRID
"""

import json
import shutil
import unittest

from program import ProgramTest, decoder, numpy

from forged import Forged

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")


def sums_of(values, counts):
    """Sums and counts of blocks of 4 (z, y, x): along columns with y fastest, then z; then over the columns."""
    for axis in range(3):
        pad = [(0, 0)] * 3
        pad[axis] = (0, -values.shape[axis] % 4)
        values, counts = numpy.pad(values, pad), numpy.pad(counts, pad)
    shape = [n for length in values.shape for n in (length // 4, 4)]
    values, counts = values.reshape(shape), counts.reshape(shape)
    columns = numpy.zeros_like(values[:, 0, :, 0])
    for z in range(4):
        for y in range(4):
            columns = columns + values[:, z, :, y]
    total = columns[..., 0]
    for x in range(1, 4):
        total = total + columns[..., x]
    return total, counts.sum((1, 3, 5))


def means(volume, factor):
    """The overview of a volume (z, y, x) with a factor that is a power of 4."""
    real = volume.dtype.kind == "f"
    finite = numpy.isfinite(volume)
    values = numpy.where(finite, volume, 0).astype("f8" if real else "i8")
    counts = finite.astype("i8")
    with numpy.errstate(all="ignore"):
        while factor > 1:
            values, counts = sums_of(values, counts)
            factor //= 4
        if not real:
            return ((2 * values + counts) // (2 * counts)).astype(volume.dtype)
        return numpy.where((counts == 0) | ~numpy.isfinite(values), numpy.nan, values / counts).astype(volume.dtype)


class Overviews(ProgramTest):
    def volume(self, type, shape, seed=1):
        random = numpy.random.default_rng(seed)
        smooth = numpy.add.outer(numpy.add.outer(numpy.arange(shape[0]), 2 * numpy.arange(shape[1])),
                                 3 * numpy.arange(shape[2]))
        volume = (smooth + random.integers(0, 20, shape)).astype(type)
        if volume.dtype.kind == "f":
            volume = (volume * 0.37 - 5).astype(type)
            volume[random.random(shape) < 0.2] = numpy.nan
            volume[:9, :9, :9] = numpy.nan
            volume.flat[-1] = numpy.inf
        return volume

    def encode(self, volume, name, *options, **run):
        (self.folder / "volume.raw").write_bytes(volume.tobytes())
        dims = ",".join(map(str, volume.shape[::-1]))
        range_ = ("--range", "0:100")
        self.tagrid("encode", "volume.raw", "--dims", dims, "--type", volume.dtype.name, *range_, "-q", "-f", "-o",
                    name, *options, **run)
        return (self.folder / name).read_bytes()

    def overview(self, name, factor, volume, *options):
        self.tagrid("decode", name, "--overview", factor, "-q", "-f", "-o", "level.raw", *options)
        shape = [(n - 1) // factor + 1 for n in volume.shape]
        return numpy.frombuffer((self.folder / "level.raw").read_bytes(), volume.dtype).reshape(shape)

    def verify(self, name, volume, code=0):
        (self.folder / "original.raw").write_bytes(volume.tobytes())
        dims = ",".join(map(str, volume.shape[::-1]))
        self.tagrid("verify", name, "--against", "original.raw", "--dims", dims, "--type", volume.dtype.name, "-q",
                    code=code)

    def require_means(self, name, factor, volume):
        bound = next(level["max_error"] for level in self.info(name)["overviews"] if level["factor"] == factor)
        decoded, expected = self.overview(name, factor, volume), means(volume, factor)
        if bound == 0:
            numpy.testing.assert_array_equal(decoded, expected)
            return
        numpy.testing.assert_array_equal(numpy.isnan(decoded), numpy.isnan(expected))
        error = numpy.abs(decoded.astype("f8") - expected.astype("f8"))
        self.assertLessEqual(numpy.nanmax(error, initial=0), bound)

    def test_they_are_the_means_of_all_types_and_awkward_sizes(self):
        shapes = [(1, 1, 1), (3, 4, 5), (5, 1, 17), (16, 16, 16), (17, 9, 33), (4, 64, 66), (23, 65, 19), (63, 129, 3)]
        for type in TYPES:
            for seed, shape in enumerate(shapes):
                volume = self.volume(type, shape, seed)
                for options in ((), ("--cube", "4", "--brick", "1"), ("--lead", "0"), ("--max-error", "2")):
                    self.encode(volume, "a.tag", "--overviews", "4,16", *options)
                    for factor in (4, 16):
                        self.require_means("a.tag", factor, volume)
                self.verify("a.tag", volume)

    def test_verify_compares_them_with_the_means_of_the_original(self):
        if shutil.which("zstd") is None:
            self.skipTest("there is no zstd")
        for type in ("int16", "float32"):
            volume = self.volume(type, (19, 33, 70))
            other = volume.copy()
            other[12:16, 12:16, 12:16] += 40
            for options in ((), ("--max-error", "3"), ("--lead", "0")):
                data = self.encode(volume, "a.tag", "--overviews", "4", *options)
                self.verify("a.tag", volume)
                theirs = decoder.overviews(self.encode(other, "b.tag", "--overviews", "4", *options))[4]
                (self.folder / "c.tag").write_bytes(Forged(data).with_members([(1, 4, theirs)]).data())
                self.tagrid("verify", "c.tag", "-q")
                self.verify("c.tag", volume, code=65)

    def test_the_file_is_the_same_in_every_way_of_encoding(self):
        volumes = [self.volume("uint16", (41, 131, 67)), self.volume("float32", (70, 133, 37)),
                   self.volume("int32", (9, 300, 20))]
        for volume in volumes:
            options = ["--cube", "8", "--brick", "2", "--overviews", "4,16,64"]
            whole = self.encode(volume, "a.tag", *options)
            self.assertEqual(whole, self.encode(volume, "b.tag", *options, "-T", "1"))
            self.assertEqual(whole, self.encode(volume, "b.tag", *options, "--resume"))
            self.assertEqual(whole, self.encode(volume, "b.tag", *options, "--resume", "-T", "1"))
            lossy = [*options, "--max-error", "3", "--mesh-error", "4"]
            with_mesh = self.encode(volume, "c.tag", *lossy)
            self.assertEqual(with_mesh, self.encode(volume, "d.tag", *lossy, "--resume"))
            derived = [*options, "--grid", "derived"]
            self.assertEqual(self.encode(volume, "c.tag", *derived), self.encode(volume, "d.tag", *derived, "--resume"))
            dims = ",".join(map(str, volume.shape[::-1]))
            # A pipe has no source files to keep.
            piped = self.tagrid("encode", "-", "--dims", dims, "--type", volume.dtype.name, "--range", "0:100", "-q", "-o", "-",
                                "--strip", *options, input=volume.tobytes())
            self.assertEqual(self.encode(volume, "e.tag", *options, "--strip"), piped.stdout)

    def test_strips_give_the_same_file(self):
        volume = self.volume("uint16", (40, 700, 400))
        options = ["--cube", "8", "--brick", "2", "--overviews", "4,16"]
        whole = self.encode(volume, "a.tag", *options)
        small = self.encode(volume, "b.tag", *options, "-M", "40M", "-T", "1")
        self.assertEqual(whole, small)

    def test_large_volumes_have_them_by_themselves(self):
        for shape, factors in (((2, 2, 512), []), ((2, 2, 513), [4]), ((1, 1025, 3), [4, 16]),
                               ((4097, 1, 2), [4, 16, 64])):
            self.encode(self.volume("uint8", shape), "a.tag")
            levels = self.info("a.tag")["overviews"]
            self.assertEqual([level["factor"] for level in levels], factors)
            for level in levels:
                self.assertEqual(level["dims"], [(n - 1) // level["factor"] + 1 for n in shape[::-1]])
        self.encode(self.volume("uint8", (2, 2, 600)), "a.tag", "--overviews", "none")
        self.assertEqual(self.info("a.tag")["overviews"], [])

    def test_factors_that_are_impossible_are_refused(self):
        (self.folder / "volume.raw").write_bytes(bytes(27))
        encode = ("encode", "volume.raw", "--dims", "3,3,3", "--type", "uint8", "-o", "a.tag", "--overviews")
        for factors in ("2", "4,4", "16,4", "8", "4096", "x", ""):
            self.tagrid(*encode, factors, code=64)
        for factors in ("4,", ",4", "4,,16", "4, 16", "auto,4"):
            self.assertIn(f"--overviews: {factors}: must be auto, none, or factors with commas between them, such as 4,16",
                          self.tagrid(*encode, factors, code=64).stderr.decode())
        self.tagrid(*encode, "4", "--grid-only", code=64)
        self.tagrid(*encode, "4")
        self.assertIn(b"it has 4", self.tagrid("decode", "a.tag", "--overview", "16", "-o", "c.raw", code=64).stderr)

    def test_a_region_counts_samples_of_the_volume(self):
        volume = self.volume("int16", (30, 40, 50))
        self.encode(volume, "a.tag", "--overviews", "4")
        self.tagrid("decode", "a.tag", "--overview", "4", "--region", "7:9,:,29:", "-q", "-o", "part.raw")
        part = numpy.frombuffer((self.folder / "part.raw").read_bytes(), "i2").reshape(1, 10, 2)
        numpy.testing.assert_array_equal(part, means(volume, 4)[7:8, :, 1:3])
        self.tagrid("decode", "a.tag", "--overview", "4", "--region", "7:51,:,:", "-o", "part2.raw", code=64)

    def test_blocks_lie_where_their_middles_are(self):
        (self.folder / "v.nrrd").write_bytes(
            b"NRRD0005\ntype: uint8\ndimension: 3\nsizes: 6 5 9\nencoding: raw\nspace: left-posterior-superior\n"
            b"space directions: (0.5,0,0) (0,0,2) (0,3,0)\nspace origin: (1,2,3)\n\n" + bytes(6 * 5 * 9))
        self.tagrid("encode", "v.nrrd", "--overviews", "4", "-q", "-o", "v.tag")
        self.tagrid("decode", "v.tag", "--overview", "4", "-q", "-o", "level.nrrd")
        header = (self.folder / "level.nrrd").read_bytes().split(b"\n\n")[0].decode()
        self.assertIn("space directions: (2,0,0) (0,0,8) (0,12,0)", header)
        self.assertIn("space origin: (1.75,6.5,6)", header)
        self.assertIn("sizes: 2 2 3", header)

    def test_a_second_decoder_finds_the_same(self):
        if shutil.which("zstd") is None:
            self.skipTest("there is no zstd")
        for type in ("uint8", "float32"):
            volume = self.volume(type, (6, 9, 11))
            data = self.encode(volume, "a.tag", "--overviews", "4,16", "--cube", "8", "--brick", "1")
            self.assertEqual(decoder.decode(data), volume.tobytes())
            found = decoder.overviews(data)
            self.assertEqual(list(found), [4, 16])
            for factor, inner in found.items():
                self.assertEqual(decoder.decode(inner), self.overview("a.tag", factor, volume).tobytes())

    def test_damage_is_found_and_costs_no_brick(self):
        volume = self.volume("uint8", (20, 30, 40))
        data = self.encode(volume, "a.tag", "--overviews", "4,16")
        inner = decoder.overviews(data)
        start = data.index(inner[4])
        for place in (start - 20, start - 16, start - 12, start - 8, start, start + 20, start + len(inner[4]) // 2,
                      start + len(inner[4]) - 1, start + len(inner[4])):
            damaged = bytearray(data)
            damaged[place] ^= 1
            (self.folder / "b.tag").write_bytes(damaged)
            self.tagrid("verify", "b.tag", "-q", code=65)
            with self.assertRaises(decoder.Broken):
                decoder.decode(bytes(damaged))
            self.tagrid("decode", "-", "-q", "-f", "-o", "all.raw", code=65, input=bytes(damaged))
            self.tagrid("decode", "b.tag", "--salvage", "-q", "-f", "-o", "all.raw", code=65)
            self.assertEqual((self.folder / "all.raw").read_bytes(), volume.tobytes())
        for end in range(start - 24, len(data), 7):
            (self.folder / "b.tag").write_bytes(data[:end])
            self.tagrid("verify", "b.tag", "-q", code=65)

    def test_info_names_them_whatever_the_grid_and_from_a_pipe(self):
        volume = self.volume("uint8", (20, 30, 40))
        for grid in ("stored", "derived"):
            data = self.encode(volume, "a.tag", "--overviews", "4,16", "--grid", grid, "--max-error", "1")
            for source, given in (("a.tag", None), ("-", data)):
                told = json.loads(self.tagrid("info", source, "--json", input=given).stdout)["overviews"]
                self.assertEqual([level["factor"] for level in told], [4, 16])
                self.assertIn(b"overviews       4: 10 x 8 x 5 means", self.tagrid("info", source, input=given).stdout)

    def test_one_with_a_damaged_header_costs_nothing_else(self):
        volume = self.volume("uint8", (20, 30, 640))
        data = self.encode(volume, "a.tag", "--overviews", "4,16", "--max-error", "1")
        damaged = bytearray(data)
        damaged[data.index(decoder.overviews(data)[4]) + 50] ^= 1
        (self.folder / "b.tag").write_bytes(damaged)
        told = json.loads(self.tagrid("info", "b.tag", "--json").stdout)["overviews"]
        self.assertEqual([level["max_error"] for level in told], [None, 1])
        self.assertIn(b", damaged", self.tagrid("info", "b.tag").stdout)
        self.tagrid("preview", "b.tag", "-q", "-f", "-o", "b.png")

    def test_verify_says_what_a_pipe_leaves_out(self):
        volume = self.volume("uint8", (20, 30, 40))
        data = self.encode(volume, "a.tag", "--overviews", "4")
        self.assertIn(b"only their checksums were checked", self.tagrid("verify", "-", input=data).stdout)
        self.assertNotIn(b"checksums", self.tagrid("verify", "a.tag").stdout)

    def test_members_of_unknown_kinds_are_skipped_and_named(self):
        volume = self.volume("uint8", (6, 7, 9))
        data = self.encode(volume, "a.tag", "--overviews", "4")
        new = Forged(data).with_members([(77, 0, b"from the future")]).data()
        (self.folder / "b.tag").write_bytes(new)
        self.tagrid("verify", "b.tag", "-q")
        self.assertIn(b"kind 77", self.tagrid("info", "b.tag").stdout)
        self.assertEqual(self.tagrid("decode", "-", "-q", "-o", "-", "--format", "raw", input=new).stdout,
                         volume.tobytes())
        self.assertEqual(self.info("b.tag")["overviews"], [])


if __name__ == "__main__":
    unittest.main()
