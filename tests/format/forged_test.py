#!/usr/bin/env python3
"""python3 tests/format/forged_test.py TAGRID

Files with right checksums that break a rule, or that a newer program made: what the program and the second decoder do.
"""

import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import decoder
import decoder_test
from forged import Forged, of_version_6
from second_decoder.coding import Broken

TAGRID = sys.argv.pop(1)
GOLDEN = pathlib.Path(__file__).parents[1] / "golden" / "1.0"
PLAIN = (GOLDEN / "example_int16.tag").read_bytes()
with tempfile.TemporaryDirectory() as made:
    comparison = decoder_test.Comparison(TAGRID, made)
    OVERVIEWS = comparison.encode("int16", "phantom", (9, 8, 7), ["--cube=4", "--overviews=4"])
    VOLUMES = decoder_test.several_volumes(comparison)
    KINDS = [comparison.encode(type_, "phantom", (9, 8, 7), ["--cube=4", *more])
             for type_, *more in (("uint8",), ("float32",), ("uint16", "--effort=fast"))]
NEWER = "the file is of a newer version: update tagrid"


@unittest.skipIf(shutil.which("zstd") is None, "needs the zstd program")
class ForgedFiles(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_it(self, *arguments, code=0, data=None):
        run = subprocess.run([TAGRID, *arguments], cwd=self.folder, capture_output=True, input=data)
        self.assertEqual(run.returncode, code, (arguments, run.stderr))
        return run.stdout.decode() + run.stderr.decode()

    def write(self, data):
        (self.folder / "a.tag").write_bytes(data)
        return data

    def assert_refused(self, data, words, *, also_decode=True):
        """Refused front to back and by `verify`, and if said so by whoever decodes samples by the index."""
        self.write(data)
        self.assertIn(words, self.run_it("info", "-", code=65, data=data))
        self.assertIn(words, self.run_it("verify", "a.tag", code=65))
        self.assertIn(words, self.run_it("verify", "-", code=65, data=data))
        if also_decode:
            self.assertIn(words, self.run_it("decode", "a.tag", "-o", "a.raw", "--region", "0:1,0:1,0:1", code=65))
        with self.assertRaises(Broken):
            decoder.decode(data, with_grid=False)

    def test_a_file_that_is_made_anew_is_the_same(self):
        for data in (PLAIN, OVERVIEWS, VOLUMES):
            again = Forged(data).data()
            self.assertEqual(len(decoder.decode(again, with_grid=False)), len(decoder.decode(data, with_grid=False)))
            self.write(again)
            self.run_it("verify", "a.tag")

    def newer_files(self):
        yield "version 6", of_version_6(PLAIN)
        yield "section of kind 4", Forged(PLAIN).with_section(4, b"must").data()
        yield "section of kind 65535", Forged(PLAIN).with_section(65535, b"must").data()
        for offset, form, value, what in ((40, "B", 9, "sample type"), (41, "B", 2, "mode"), (52, "H", 3, "effort"),
                                          (54, "B", 3, "origin of the grid")):
            yield what, Forged(PLAIN).with_field(offset, form, value).data()

    def test_a_newer_file_is_not_damaged(self):
        for what, data in self.newer_files():
            with self.subTest(what):
                self.assert_refused(data, NEWER)
                for command in (["decode", "a.tag", "-o", "a.raw"], ["decode", "a.tag", "-o", "a.raw", "--salvage"],
                                ["info", "a.tag"], ["verify", "a.tag"]):
                    said = self.run_it(*command, code=65)
                    self.assertIn(what, said)
                    self.assertEqual(said.count("\n"), 1, said)
                    for wrong in ("damage", "salvage", "truncated"):
                        self.assertNotIn(wrong, said)

    def test_values_of_a_newer_kind_are_not_damaged(self):
        for file in KINDS:
            data = bytearray(file)
            first = decoder.Header(data).size
            data[first + 8 + struct.unpack_from("<I", data, first + 4)[0]] = 20
            self.write(decoder_test.with_right_checksums(bytes(data)))
            for command in (["decode", "a.tag", "-o", "a.raw"], ["decode", "a.tag", "-o", "a.raw", "--salvage"],
                            ["verify", "a.tag"]):
                said = self.run_it(*command, code=65)
                self.assertIn(NEWER, said)
                for wrong in ("damage", "salvage"):
                    self.assertNotIn(wrong, said)

    def test_damage_is_not_newer(self):
        for at in (8, 9, 40, 41, 52, 54):
            data = bytearray(PLAIN)
            data[at] ^= 8
            self.write(data)
            said = self.run_it("decode", "a.tag", "-o", "a.raw", code=65)
            self.assertIn("damaged", said)
            self.assertNotIn(NEWER, said)
        self.write(Forged(PLAIN).with_field(8, "I", 4).data())
        self.assertNotIn(NEWER, self.run_it("decode", "a.tag", "-o", "a.raw", code=65))

    def test_a_member_that_needs_a_newer_program(self):
        for change in (lambda inner: Forged(inner).with_section(4, b"must").data(),
                       lambda inner: Forged(inner).with_field(52, "H", 3).data()):
            for data in (OVERVIEWS, VOLUMES):
                self.assert_refused_in_a_member(Forged(data).with_inner(change).data(), NEWER)

    def assert_refused_in_a_member(self, data, words):
        """A reader of other samples by the index need not see it."""
        self.assert_refused(data, words, also_decode=False)
        self.run_it("decode", "a.tag", "-f", "-o", "a.raw", "--region", "0:1,0:1,0:1", "--volume", "0")

    def test_the_end_of_a_member_is_checked(self):
        def with_junk(inner):
            return inner + b"junk"

        def with_member(inner):
            return Forged(inner).with_member(77, 1, b"more").data()

        self.assert_refused_in_a_member(Forged(OVERVIEWS).with_inner(with_junk).data(), "overview 4")
        self.assert_refused_in_a_member(Forged(OVERVIEWS).with_inner(with_member).data(), "must not have")
        self.assert_refused_in_a_member(Forged(VOLUMES).with_inner(with_junk).data(), "volume 1")
        # A volume may have members.
        data = self.write(Forged(VOLUMES).with_inner(with_member).data())
        self.run_it("verify", "a.tag")
        self.run_it("verify", "-", data=data)

    def test_volumes_have_one_step(self):
        def with_step(inner):
            forged = Forged(inner)
            forged.header[-8:-8] = struct.pack("<I", 64)
            return forged.with_field(12, "I", len(forged.header)).data()

        self.assert_refused(Forged(VOLUMES).with_inner(with_step).data(), "another size, type or bound",
                            also_decode=False)

    def test_impossible_fields_of_the_header(self):
        for offset, form, value, words in ((48, "I", 1000001, "accuracy"), (64, "d", 5000.0, "low end"),
                                           (88, "d", 2.0, "bound of active voxels"), (44, "H", 129, "edge of a brick")):
            self.assert_refused(Forged(PLAIN).with_field(offset, form, value).data(), words)

    def test_statistics_of_the_volume(self):
        for number, value, words, in_all in ((6, -1e300, "smallest", False), (5, 1e300, "smallest", False),
                                             (6, math.nan, "not a number", True), (4, math.nan, "not a number", True),
                                             (9, math.nan, "not a number", True), (9, 2.5, "above the bound", True)):
            self.assert_refused(Forged(PLAIN).with_statistic(number, "d", value).data(), words, also_decode=in_all)

    def test_unknown_members_are_named(self):
        data = Forged(PLAIN).with_member(77, 5, b"hello future").data()
        self.assertEqual(decoder.decode(data, with_grid=False), decoder.decode(PLAIN, with_grid=False))
        for source in ({"name": "a.tag"}, {"name": "-", "data": data}):
            name, given = source["name"], source.get("data")
            self.write(data)
            text = self.run_it("info", name, "--no-levels", data=given)
            self.assertIn("a member of kind 77", text)
            self.assertNotIn("overviews", text)
            self.assertRegex(text, r"other members +40 ")
            found = json.loads(self.run_it("info", name, "--json", data=given))
            self.assertEqual(found["unknown_members"], [{"kind": 77, "factor": 5, "bytes": 40}])
            said = self.run_it("decode", name, "-f", "-o", "a.raw", data=given)
            self.assertEqual(said.count("newer version"), 1, said)
        self.write(PLAIN)
        self.assertEqual(self.run_it("decode", "a.tag", "-f", "-o", "a.raw"), "")
        self.assertNotIn("unknown_members", json.loads(self.run_it("info", "a.tag", "--json")))

    def test_many_unknown_sections_take_one_line(self):
        forged = Forged(PLAIN)
        for kind in range(70000, 75000):
            forged.with_section(kind, b"")
        self.write(forged.data())
        text = self.run_it("info", "a.tag", "--no-levels")
        line, = (line for line in text.splitlines() if "70000" in line)
        self.assertIn("70009", line)
        self.assertIn("4990 more", line)
        self.assertLess(len(line), 200)
        self.assertEqual(len(json.loads(self.run_it("info", "a.tag", "--json"))["unknown_sections"]), 5000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
