"""Headers that name files outside of their directory: refused, and read with an option, after a warning."""

import os
import struct
import unittest

from other_readers import ReaderTest, main, numpy

NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nspacings: 1 1 1\nencoding: raw\n"
META = "ObjectType = Image\nNDims = 3\nDimSize = 8 8 8\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n"
VGI = "{volume1}\n[file1]\nSize = 8 8 8\nName = %s\nDatatype = unsigned integer\nBitsPerElement = 8\n"
XTEKCT = "[XTekCT]\nVoxelsX=8\nVoxelsY=8\nVoxelsZ=8\n"


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Outside(ReaderTest):
    def setUp(self):
        super().setUp()
        for name in ("private", "upload", "upload/below"):
            (self.folder / name).mkdir()
        self.truth = numpy.random.default_rng(3).integers(0, 256, (8, 8, 8), "uint8")
        self.secret = self.folder / "private" / "key"
        self.secret.write_bytes(self.truth.tobytes())

    def header(self, name, text):
        (self.folder / "upload" / name).write_text(text)
        return f"upload/{name}"

    def assert_outside(self, path):
        for command in (("encode", path, "-o", "x.tag"), ("estimate", path)):
            message = self.assert_refused(65, "private/key", *command) if command[0] == "encode" else self.tagrid(*command).stderr
            self.assertIn("outside its directory", message)
            self.assertIn("--data-outside", message)
        self.assertFalse((self.folder / "x.tag").exists())
        samples, _ = self.encoded(path, "--data-outside", says="outside its directory")
        self.assertIn("private/key", self.messages)
        self.assert_same(samples, self.truth, path)
        self.assertEqual(self.tagrid("verify", "out.tag", "--against", path).returncode, 65)
        self.ok("verify", "out.tag", "--against", path, "--data-outside")

    def encoded(self, path, *options, says=""):
        self.messages = self.ok("encode", path, "-o", "out.tag", "-f", *options).stderr
        self.assertIn(says, self.messages)
        info = self.info("out.tag")
        self.ok("decode", "out.tag", "-o", "out.raw", "-f", "--samples")
        return numpy.fromfile(self.folder / "out.raw", "uint8").reshape(8, 8, 8), info

    def test_paths_that_leave_the_directory(self):
        for i, name in enumerate(("../private/key", str(self.secret), "below/../../private/key")):
            self.assert_outside(self.header(f"a{i}.nhdr", NRRD + f"data file: {name}\n"))
            self.assert_outside(self.header(f"b{i}.mhd", META + f"ElementDataFile = {name}\n"))
            self.assert_outside(self.header(f"c{i}.vgi", VGI % name))

    def test_lists_and_patterns(self):
        for i in range(2):
            (self.folder / "private" / f"key{i}").write_bytes(self.truth[4 * i:4 * i + 4].tobytes())
            (self.folder / "upload" / f"own{i}").write_bytes(self.truth[4 * i:4 * i + 4].tobytes())
        names = "../private/key0\n../private/key1\n"
        for path in (self.header("l.nhdr", NRRD + "data file: LIST 3\n" + names), self.header("p.nhdr", NRRD + "data file: ../private/key%d 0 1 1 3\n"),
                     self.header("m.nhdr", NRRD + "data file: LIST 3\nown0\n../private/key1\n"),
                     self.header("l.mhd", META + "ElementDataFile = LIST\n" + names),
                     self.header("p.mhd", META + "ElementDataFile = ../private/key%d 0 1 1\n")):
            self.assert_outside(path)

    def test_links_that_leave_the_directory(self):
        os.symlink("../private/key", self.folder / "upload" / "link")
        os.symlink("../private", self.folder / "upload" / "folder")
        self.assert_outside(self.header("a.nhdr", NRRD + "data file: link\n"))
        self.assert_outside(self.header("b.mhd", META + "ElementDataFile = folder/key\n"))
        os.symlink("../private/key", self.folder / "upload" / "scan.vol")
        self.assert_outside(self.header("scan.xtekct", XTEKCT))
        (self.folder / "upload" / "scan.vgi").unlink(missing_ok=True)
        # A pair of NIfTI: the name of the samples follows from that of the header.
        header = bytearray(352)
        struct.pack_into("<i", header, 0, 348)
        struct.pack_into("<8h", header, 40, 3, 8, 8, 8, 1, 1, 1, 1)
        struct.pack_into("<2h", header, 70, 2, 8)
        struct.pack_into("<8f", header, 76, 1, 1, 1, 1, 1, 1, 1, 1)
        header[344:348] = b"ni1\0"
        (self.folder / "upload" / "pair.hdr").write_bytes(bytes(header))
        os.symlink("../private/key", self.folder / "upload" / "pair.img")
        self.assert_outside("upload/pair.hdr")

    def test_what_lies_below_or_beside_is_read(self):
        for place in ("own.raw", "below/own.raw"):
            (self.folder / "upload" / place).write_bytes(self.truth.tobytes())
        for name in ("own.raw", "below/own.raw", "./below/../own.raw", str(self.folder / "upload" / "own.raw")):
            samples, _ = self.encoded(self.header("a.nhdr", NRRD + f"data file: {name}\n"))
            self.assert_same(samples, self.truth, name)
            self.assertEqual(self.messages, "", name)
        # Links to a header and to its samples, and a link to the directory of both.
        (self.folder / "links").mkdir()
        self.header("a.nhdr", NRRD + "data file: own.raw\n")
        for name in ("a.nhdr", "own.raw"):
            os.symlink(f"../upload/{name}", self.folder / "links" / name)
        os.symlink("upload", self.folder / "same")
        for path in ("links/a.nhdr", "same/a.nhdr"):
            samples, _ = self.encoded(path)
            self.assert_same(samples, self.truth, path)

    def test_lists_of_volumes(self):
        self.header("a.nhdr", NRRD + "data file: ../private/key\n")
        found = self.search("upload")
        self.assertIn("# not listed:", found.stdout)
        self.assertIn("--data-outside", found.stdout)
        found = self.search("upload", "--data-outside")
        lines = [line for line in found.stdout.splitlines() if not line.startswith("#")]
        self.assertEqual(len(lines), 1, found.stdout)
        self.assertIn("\tdata-outside=true", lines[0])
        (self.folder / "list.tsv").write_text(found.stdout)
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out")
        (self.folder / "plain.tsv").write_text(found.stdout.replace("\tdata-outside=true", ""))
        self.assertEqual(self.tagrid("convert", "--manifest", "plain.tsv", "--output-dir", "other").returncode, 65)


if __name__ == "__main__":
    main()
