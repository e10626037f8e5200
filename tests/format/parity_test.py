#!/usr/bin/env python3
"""python3 tests/format/parity_test.py TAGRID

Damages files with parity, and compares `tagrid repair` with parity_decoder.py, which was written from docs/dev/format.md alone.
"""

import os
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

import decoder
import parity_decoder
from second_decoder.xxh3 import xxh3

TAGRID = sys.argv.pop(1)
TIMES = 200 if "TAGRID_LONG" in os.environ else 4


class Parity(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.random = random.Random(int(os.environ.get("TAGRID_SEED", "1")))
        self.run_it("phantom", "--dims", "24,20,18", "-o", "a.nrrd")
        self.run_it("encode", "a.nrrd", "-o", "plain.tag")
        self.run_it("encode", "a.nrrd", "-o", "a.tag", "--parity", "20%")
        self.plain, self.whole = self.read("plain.tag"), self.read("a.tag")

    def read(self, name):
        return (self.folder / name).read_bytes()

    def run_it(self, *arguments, code=0):
        run = subprocess.run([TAGRID, *arguments], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             text=True)
        self.assertEqual(run.returncode, code, f"{arguments}: {run.stdout}")
        return run.stdout

    def damages(self, size, least):
        """Bytes with damage that the promise covers."""
        for i in range(TIMES):
            data = bytearray(self.whole)
            length = self.random.randrange(1, least)
            begin = (0, size - length, self.random.randrange(size - length))[i % 3]
            data[begin:begin + length] = self.random.randbytes(length)
            yield bytes(data[:-length] if i % 4 == 3 else data)

    def test_parity_follows_the_file(self):
        self.assertEqual(self.whole[:len(self.plain)], self.plain)
        self.assertEqual(decoder.without_parity(self.whole), self.plain)
        self.run_it("decode", "a.tag", "-o", "b.raw")
        self.run_it("decode", "plain.tag", "-o", "c.raw")
        self.assertEqual(self.read("b.raw"), self.read("c.raw"))
        with open(self.folder / "a.tag", "rb") as file:
            piped = subprocess.run([TAGRID, "decode", "-"], stdin=file, stdout=subprocess.PIPE)
        self.assertEqual((piped.returncode, piped.stdout), (0, self.read("c.raw")))

    def test_both_repair_the_same(self):
        z = parity_decoder.Numbers(self.whole[-48:], None)
        burst = (z.s * z.m - 1) * z.b
        for i, data in enumerate(self.damages(len(self.whole), burst)):
            with self.subTest(i):
                (self.folder / "bad.tag").write_bytes(data)
                self.assertEqual(parity_decoder.repaired(data, xxh3), self.plain)
                self.assertIn("repairable", self.run_it("verify", "bad.tag", code=65))
                self.run_it("repair", "bad.tag", "-o", "good.tag", "-f")
                self.assertEqual(self.read("good.tag"), self.whole)
                self.assertEqual(self.read("bad.tag"), data)

    def test_protect_gives_what_encode_gives(self):
        (self.folder / "b.tag").write_bytes(self.plain)
        self.run_it("protect", "b.tag", "--parity=20%", "--beside")
        self.assertEqual(self.read("b.tag"), self.plain)
        beside = self.read("b.tag.parity")
        bad = bytes(1000) + self.plain[1000:]
        (self.folder / "b.tag").write_bytes(bad)
        self.assertEqual(parity_decoder.repaired(bad, xxh3, beside), self.plain)
        self.assertIn("repairable", self.run_it("verify", "b.tag", code=65))
        self.run_it("repair", "b.tag", "-o", "c.tag")
        self.assertEqual(self.read("c.tag"), self.plain)
        self.run_it("protect", "b.tag", "--parity=20%", code=65)  # it is damaged
        self.run_it("protect", "c.tag", "--parity", "20")
        self.assertEqual(self.read("c.tag"), self.whole)
        self.assertIn("already has parity of 20 %", self.run_it("protect", "c.tag", "--parity", "20", code=64))
        self.run_it("encode", "a.nrrd", "-o", "d.tag", "--parity=20%", "--resume", "-T1")
        self.assertEqual(self.read("d.tag"), self.whole)

    def test_too_much_is_refused(self):
        data = bytearray(self.whole)
        data[0:len(self.plain)] = self.random.randbytes(len(self.plain))
        (self.folder / "bad.tag").write_bytes(data)
        self.assertIn("not repairable", self.run_it("verify", "bad.tag", code=65))
        self.assertIn("cannot be repaired", self.run_it("repair", "bad.tag", "-o", "out.tag", code=65))
        self.assertEqual(sorted(os.listdir(self.folder)), ["a.nrrd", "a.tag", "bad.tag", "plain.tag"])
        self.run_it("repair", "plain.tag", "-o", "out.tag", code=65)
        self.run_it("encode", "a.nrrd", "-o", "-", "--parity", "5", code=64)
        for wrong in ("0", "101", "x", "-1"):
            self.run_it("encode", "a.nrrd", "-o", "out.tag", f"--parity={wrong}", code=64)
        self.run_it("repair", "a.tag", "-o", "a.tag", "-f", code=64)

    def test_info_and_verify(self):
        self.assertIn("parity: intact", self.run_it("verify", "a.tag"))
        self.assertIn('"percent": 20.0', self.run_it("info", "a.tag", "--json"))
        self.assertIn('"parity": null', self.run_it("info", "plain.tag", "--json"))
        with open(self.folder / "a.tag", "r+b") as file:
            file.seek(len(self.whole) - 3000)
            file.write(b"damage")
        self.assertIn("its parity is damaged; repairable", self.run_it("verify", "a.tag", code=65))
        self.run_it("decode", "a.tag", "-o", "b.raw")


if __name__ == "__main__":
    unittest.main()
