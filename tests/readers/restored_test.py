"""Source files come back byte for byte, or it is said which do not, and why.

The tests of all formats restore what they encode, too: see ReaderTest.encoded()."""

import gzip
import json
import os
import re
import shutil
import struct
import subprocess
import unittest
import zlib

from other_readers import PROGRAM, ReaderTest, h5py, main, nibabel, numpy, pydicom, unless_sanitized
from scans import data_set, write_series

NRRD = b"NRRD0004\n# a comment \xff\ntype: %s\ndimension: 3\nsizes: 11 9 4\nendian: %s\nencoding: raw\nkey:=value\n\n"

# A reader that does something while its file is used.
CHANGING = """#!/usr/bin/python3
import json, os, struct, sys
WHOLE = {"answer": "volume", "dims": [11, 9, 4], "type": "uint16", "places": [{"slices": 4}], "complete": True}
at = os.environ["TAGRID_CHANGE_AT"]
%s
print(json.dumps({"tagrid-reader": 1, "name": "change", "version": "1"}), flush=True)
for request in map(json.loads, sys.stdin):
    if request["request"] != "describe":
        slices(request)
        continue
    with open(request["path"] + ".opened", "a+") as file:
        file.write("x")
        opened = file.tell()
    print(json.dumps(describe(request["path"], opened)), flush=True)
"""


@unittest.skipIf(None in (numpy, pydicom, nibabel), "libraries are missing")
class Restored(ReaderTest):
    def volume(self, type="uint16", shape=(4, 9, 11), seed=1):
        return numpy.random.default_rng(seed).integers(0, 4000, shape).astype(type)

    def write(self, name, *parts):
        path = self.folder / name if isinstance(name, str) else os.path.join(os.fsencode(self.folder), name)
        with open(path, "wb") as file:
            file.write(b"".join(part if isinstance(part, bytes) else part.tobytes() for part in parts))

    def files(self, folder="."):
        return {str(path.relative_to(self.folder / folder)) for path in (self.folder / folder).rglob("*")}

    def bytes(self, name):
        return (self.folder / name).read_bytes()

    def encode_and_compare(self, path, *options):
        _, info = self.encoded(path, *options)  # compares
        self.assertIs(info["restorable"], True, path)
        self.assertGreater(info["bytes"]["envelope"], 0)
        run = self.ok("verify", "out.tag", "--against", path, *options)
        self.assertIn("source files: the same, byte for byte\n", run.stdout)

    def test_all_that_surrounds_samples(self):
        shape = ("--dims", "11,9,4", "--type", "uint16")
        self.write("a.nrrd", NRRD % (b"ushort", b"big"), self.volume(">u2"))
        self.encode_and_compare("a.nrrd")
        self.write("b.raw", b"head", self.volume())
        self.encode_and_compare("b.raw", *shape, "--offset", "4")
        self.encode_and_compare("b.raw", "--dims", "11,9,4", "--type", "uint16", "--endian", "big", "--offset", "4")
        for z, slice in enumerate(self.volume()):
            self.write(f"c{z}.raw", slice)
        self.write("c.nhdr", (NRRD % (b"ushort", b"little"))[:-1], b"data file: LIST\n", *[b"c%d.raw\n" % z for z in range(4)])
        self.encode_and_compare("c.nhdr")

    def test_names_of_any_bytes(self):
        os.mkdir(self.folder / "a b")
        name = b"a b/sc\xe4n\n\t.nrrd"
        self.write(name, NRRD % (b"ushort", b"little"), self.volume())
        folder = os.fsencode(self.folder)
        for arguments in ([b"encode", name, b"-o", b"a.tag"], [b"restore", b"a.tag", b"-o", b"r"]):
            run = subprocess.run([PROGRAM, *arguments], cwd=self.folder, stderr=subprocess.PIPE)
            self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(os.listdir(folder + b"/r"), [os.path.basename(name)])
        with open(os.path.join(folder, name), "rb") as a, open(os.path.join(folder, b"r", os.path.basename(name)), "rb") as b:
            self.assertEqual(a.read(), b.read())

    def dicom_series(self, high_bits, signed):
        os.makedirs(self.folder / "s", exist_ok=True)
        truth = self.volume()
        for z, slice in enumerate(truth):
            words = slice & 0xFFF
            if high_bits == "sign":
                words = ((words.astype("int32") ^ 0x800) - 0x800).astype("int16").view("uint16")
            elif high_bits == "overlay":
                words = words | (numpy.random.default_rng(z).integers(0, 16, words.shape).astype("uint16") << 12)
            file = data_set(words, instance=f"1.2.{z}", position=(0, 0, z), BitsStored=12, HighBit=11, PixelRepresentation=int(signed))
            self.save(f"s/{9 - z}.dcm", file)

    def test_bits_that_do_not_belong_to_samples(self):
        for signed in (False, True):
            sizes = {}
            for high_bits in ("zero", "sign", "overlay"):
                self.dicom_series(high_bits, signed)
                self.encode_and_compare("s")
                sizes[high_bits] = (self.folder / "out.tag").stat().st_size
            self.assertLess(abs(sizes["zero"] - sizes["sign"]), 100)
            self.assertGreater(sizes["overlay"], sizes["zero"] + 100)

    def test_after_a_loss_only_samples_differ(self):
        self.dicom_series("zero", False)
        self.ok("encode", "s", "-o", "a.tag", "--max-error", "20")
        run = self.ok("restore", "a.tag", "-o", "r")
        self.assertIn("9.dcm and 3 other files were not kept exactly; they differ by up to 20", run.stderr.replace("6.dcm", "9.dcm"))
        self.assertEqual(self.ok("restore", "a.tag", "-o", "quiet", "-q").stderr, "")
        self.assertIs(self.info("a.tag")["restorable"], False)
        for name in self.files("s"):
            then, now = (pydicom.dcmread(self.folder / folder / name) for folder in ("s", "r"))
            difference = numpy.abs(then.pixel_array.astype(int) - now.pixel_array.astype(int)).max()
            self.assertTrue(0 < difference <= 20, difference)
            del then.PixelData, now.PixelData
            self.assertEqual(then, now)
        run = self.ok("verify", "a.tag", "--against", "s")
        self.assertIn("source files: identical except for samples\n", run.stdout)

    def test_a_grid_alone_stays_in_the_range_of_the_bits(self):
        z, y, x = numpy.mgrid[0:20, 0:24, 0:24]
        truth = numpy.where((x - 12) ** 2 + (y - 12) ** 2 + (z - 10) ** 2 < 50, 4095, 0).astype("uint16")
        write_series(self.folder / "s", truth, names="{:02}.dcm")
        self.ok("encode", "s", "-o", "a.tag", "--grid-only", "--max-error", "5")
        self.ok("restore", "a.tag", "-o", "r")
        for z, slice in enumerate(truth):
            now = pydicom.dcmread(self.folder / "r" / f"{z:02}.dcm").pixel_array.astype(int)
            self.assertLessEqual(numpy.abs(now - slice.astype(int)).max(), 5)

    def test_only_files_are_replaced_and_never_the_input(self):
        self.write("x.nrrd", NRRD % (b"ushort", b"little"), self.volume())
        self.ok("encode", "x.nrrd", "-o", "a.tag")
        os.mkdir(self.folder / "r")
        os.mkfifo(self.folder / "r" / "x.nrrd")
        for force in ((), ("-f",)):
            self.assert_refused(64, "not a regular file", "restore", "a.tag", "-o", "r", *force)
        os.remove(self.folder / "r" / "x.nrrd")
        os.link(self.folder / "a.tag", self.folder / "r" / "x.nrrd")
        self.assert_refused(64, "is the input itself", "restore", "a.tag", "-o", "r", "-f")
        self.assertEqual(self.bytes("a.tag"), self.bytes("r/x.nrrd"))

    def test_what_cannot_be_kept_is_refused_by_restore(self):
        self.write("a.nrrd", NRRD % (b"ushort", b"little"), self.volume())
        nibabel.save(nibabel.Nifti1Image(self.volume("int16", (4, 5, 6, 300)), numpy.eye(4)), self.folder / "many.nii")
        for command in ("encode a.nrrd --strip", "encode many.nii --series 7", "encode - < a.nrrd"):
            run = subprocess.run(f"{PROGRAM} {command} -q -f -o x.tag", shell=True, cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertLess((self.folder / "x.tag").stat().st_size, 4000)
            run = subprocess.run(f"{PROGRAM} {command} -v -f -o x.tag", shell=True, cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertIn("cannot be restored byte for byte: ", run.stderr)
            self.assertIs(self.info("x.tag")["restorable"], False)
            before = self.files()
            self.assert_refused(64, "holds no source files", "restore", "x.tag", "-o", "r")
            self.assertEqual(self.files(), before)
        self.ok("encode", "a.nrrd", "-o", "a.tag")
        self.assert_refused(64, "give -o DIR", "restore", "a.tag")
        self.assert_refused(64, "-o -", "restore", "a.tag", "-o", "-")
        self.assert_refused(64, "is not a directory", "restore", "a.tag", "-o", "a.nrrd")
        self.assert_refused(64, "regular file", "restore", "-", "-o", "r")
        self.assert_refused(64, "standard input: only a regular file can be restored; save it as one first", "restore",
                            "-")
        self.assert_refused(74, "none.tag", "restore", "none.tag", "-o", "r")
        self.assert_refused(65, "a.nrrd", "restore", "a.nrrd", "-o", "r")

    def test_files_are_replaced_only_if_that_is_asked_for(self):
        self.dicom_series("zero", False)
        self.ok("encode", "s", "-o", "a.tag")
        before = {name: self.bytes(f"s/{name}") for name in self.files("s")}
        (self.folder / "s" / "7.dcm").write_bytes(b"older")
        (self.folder / "s" / "9.dcm").unlink()
        self.assert_refused(64, ".dcm: already exists; give -f to overwrite it", "restore", "a.tag", "-o", "s")
        self.assertEqual(self.files("s"), set(before) - {"9.dcm"})
        self.assertEqual(self.bytes("s/7.dcm"), b"older")
        self.ok("restore", "a.tag", "-o", "s", "-f")
        self.assertEqual({name: self.bytes(f"s/{name}") for name in self.files("s")}, before)

    @unless_sanitized
    def test_names_of_many_files_count_in_the_limit_on_memory(self):
        os.mkdir(self.folder / "s")
        for z in range(2000):
            self.write(f"s/{'a' * 200}{z:05}.raw", bytes([z % 7, z % 5, z % 3, 1]))
        shape = ("--dims", "2,2,2000", "--type", "uint8")
        for command in (("encode", "s", *shape, "-f", "-o", "a.tag"), ("encode", "s", *shape, "--strip", "-f", "-o", "b.tag"),
                        ("verify", "a.tag"), ("verify", "a.tag", "--against", "s", *shape), ("verify", "b.tag"),
                        ("restore", "a.tag", "-f", "-o", "r")):
            message = self.assert_refused(64, "; give -M ", *command, "-M", "1M")
            limit = int(re.search(r"give -M (\d+)M", message)[1])
            self.ok(*command, "-M", f"{limit}M", "--json", "report.json", *(["-f"] if "-f" not in command else []))
            peak = json.loads((self.folder / "report.json").read_text())["peak_memory"]
            self.assertLessEqual(peak, limit << 20, command)
            self.assert_refused(64, f"; give -M {limit}M", *command, "-M", f"{limit - 1}M")
        self.assertEqual(self.files("s"), self.files("r"))

    def test_the_folder_is_made_with_its_parents(self):
        self.write("x.nrrd", NRRD % (b"ushort", b"little"), self.volume())
        self.ok("encode", "x.nrrd", "-o", "a.tag")
        for folder in ("a/b/c", "d/e///", "./f/../g/h", str(self.folder / "i" / "j")):
            self.ok("restore", "a.tag", "-o", folder)
            self.assertEqual(self.bytes(f"{folder}/x.nrrd"), self.bytes("x.nrrd"))
        before = self.files()
        self.write("b.tag", self.bytes("a.tag")[:-1])
        self.assert_refused(65, "b.tag", "restore", "b.tag", "-o", "k/l/m")
        self.assert_refused(64, "a.tag: is not a directory", "restore", "a.tag", "-o", "a.tag")
        self.assert_refused(74, "a.tag", "restore", "a.tag", "-o", "a.tag/b")
        self.assert_refused(64, "a/b: is a directory; give a .tag file", "restore", "a/b", "-o", "k")
        self.assertEqual(self.files(), before | {"b.tag"})

    def change_by(self, code):
        """Makes a reader of .change files with this describe(path, opened), whose file was described so often."""
        self.write("tagrid-read-change", (CHANGING % code).encode())
        os.chmod(self.folder / "tagrid-read-change", 0o755)

    def encode_changing(self, at, *options, **environment):
        self.write("scan.change", self.volume())
        for old in ("scan.change.opened", "scan.tag", "new.change"):
            (self.folder / old).unlink(missing_ok=True)
        environment |= {"TAGRID_READER_PATH": str(self.folder), "TAGRID_CHANGE_AT": str(at)}
        run = subprocess.run([PROGRAM, "encode", self.folder / "scan.change", "-o", "scan.tag", *options], cwd=self.folder,
                             text=True, stderr=subprocess.PIPE, env=os.environ | environment)
        if "--rm" in options:
            self.assertEqual((self.folder / "scan.change").exists(), run.returncode != 0, run.stderr)
        return run

    def test_a_source_that_changes_within_the_bound_is_not_removed(self):
        self.change_by("""
def describe(path, opened):
    if str(opened) == at:
        with open(path, "r+b") as file:
            value, = struct.unpack("<H", file.read(2))
            file.seek(0)
            file.write(struct.pack("<H", value + 1))
    return WHOLE
""")
        codes = set()
        for change_at in range(1, 9):
            run = self.encode_changing(change_at, "--max-error", "5", "--rm")
            codes.add(run.returncode)
            if run.returncode != 0:
                self.assertEqual(run.returncode, 65, run.stderr)
                self.assertIn("scan.change: was changed while it was being read", run.stderr)
                self.assertFalse((self.folder / "scan.tag").exists())
            else:
                # Either before anything was read, or never.
                opened = (self.folder / "scan.change.opened").stat().st_size
                self.assertTrue(change_at <= 2 or change_at > opened, (change_at, opened))
        self.assertIn(65, codes)

    def test_a_source_that_changes_with_its_time_set_back(self):
        """It is never removed, and is not a bug of the program; without --rm, a warning says that a comparison is needed."""
        self.change_by("""
def change(path):
    status = os.stat(path)
    with open(path, "r+b") as file:
        file.write(b"other")
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
def describe(path, opened):
    if str(opened) == at:
        change(path)
    return {key: value for key, value in WHOLE.items() if at != "slices" or key != "places"}
def slices(request):
    change("scan.change")
    print(json.dumps({**request, "answer": "slices"}), flush=True)
    sys.stdout.buffer.write(bytes(198 * (request["to"] - request["from"])))
    sys.stdout.flush()
""")
        codes = set()
        for change_at in (2, 3, 4):
            run = self.encode_changing(change_at, "--rm")
            codes.add(run.returncode)
            if run.returncode != 0:
                self.assertEqual(run.returncode, 65, run.stderr)
                self.assertIn("scan.change: was changed", run.stderr)
        self.assertIn(65, codes)
        for options in ([], ["--resume"]):
            run = self.encode_changing("slices", *options)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("scan.change: its metadata changed while it was read (ctime", run.stderr)

    def test_another_file_that_breaks_or_comes_between_encoding_and_verification(self):
        """It is named, and is not a bug of the program."""
        self.change_by("""
def describe(path, opened):
    folder = os.path.dirname(path)
    if opened < int(at):
        return WHOLE
    if os.environ["TAGRID_CHANGE"] == "breaks":
        return {"answer": "error", "kind": "input", "message": folder + "/other.change: is damaged"}
    with open(folder + "/new.change", "wb") as file:
        file.write(bytes(198))
    return WHOLE | {"dims": [11, 9, 5], "files": [path, folder + "/new.change"],
                    "places": [{"slices": 4}, {"file": 1, "slices": 1}]}
""")
        for change, said in (("breaks", "/other.change: is damaged"), ("comes", "/new.change: became a file of ")):
            seen = set()
            for change_at in range(2, 9):
                run = self.encode_changing(change_at, "--rm", TAGRID_CHANGE=change)
                self.assertNotIn("bug", run.stderr)
                self.assertIn(run.returncode, (0, 64, 65), run.stderr)
                seen |= {line for line in (said, "while") if line in run.stderr} if run.returncode == 65 else set()
            self.assertEqual(seen, {said, "while"})

    def test_removal_and_verification_look_at_every_byte(self):
        self.dicom_series("overlay", False)
        before = {name: self.bytes(f"s/{name}") for name in self.files("s")}
        self.ok("encode", "s", "-o", "a.tag")
        # One byte of a name in the header of a slice.
        changed = before["8.dcm"].replace(b"1.2.1", b"1.2.7", 1)
        self.assertNotEqual(changed, before["8.dcm"])
        (self.folder / "s" / "8.dcm").write_bytes(changed)
        self.assert_refused(65, "would be restored differently: 8.dcm differs from the file", "verify", "a.tag",
                            "--against", "s")
        (self.folder / "s" / "8.dcm").write_bytes(before["8.dcm"])
        self.ok("encode", "s", "-o", "a.tag", "-f", "--rm")
        self.assertEqual(self.files("s"), set())
        self.ok("restore", "a.tag", "-o", "s")
        self.assertEqual({name: self.bytes(f"s/{name}") for name in self.files("s")}, before)

    def test_damage_is_found_and_leaves_nothing(self):
        self.dicom_series("overlay", False)
        self.ok("encode", "s", "-o", "a.tag")
        whole, sizes = self.bytes("a.tag"), self.info("a.tag")["bytes"]
        index = struct.unpack("<Q", whole[-24:-16])[0]
        before = None
        for position in range(index - sizes["envelope"], index, 97):
            damaged = bytearray(whole)
            damaged[position] ^= 1 << (position % 8)
            self.write("b.tag", bytes(damaged))
            before = before or self.files()
            self.assert_refused(65, "b.tag", "restore", "b.tag", "-o", "r")
            self.assert_refused(65, "b.tag", "verify", "b.tag")
            self.assertEqual(self.files(), before)

    def uncompressed(self, path, compression, *options):
        """Restores what it encodes, and gives the bytes of the files. That they are the same volume, `encoded` has shown."""
        _, info = self.encoded(path, *options)
        self.assertEqual((info["restorable"], info["compression"]), (False, compression))
        self.assertIn(f"can be restored, but uncompressed ({compression})", self.ok("info", "out.tag").stdout)
        run = self.ok("verify", "out.tag", "--against", path, *options)
        self.assertIn(f"source files: the same, uncompressed (the samples of the original are compressed: {compression})", run.stdout)
        self.ok("restore", "out.tag", "-o", "back", "-f")
        files = {name: self.bytes(f"back/{name}") for name in self.files("back")}
        shutil.rmtree(self.folder / "back")
        return files

    def test_nrrd_in_gzip_comes_back_raw(self):
        samples = self.volume(">u2").tobytes()
        head = (NRRD % (b"ushort", b"big"))[:-1].replace(b"encoding: raw", b"Encoding:  gzip ").replace(b"\n", b"\r\n")
        raw = head.replace(b"gzip ", b"raw ")
        packed = gzip.compress(b"skipped" + samples)
        skip = b"lineskip: 1\nbyte skip: 7\n"
        self.write("a.nrrd", head, skip, b"\n", b"a line\n", packed)
        self.assertEqual(self.uncompressed("a.nrrd", "gzip"), {"a.nrrd": raw + skip + b"\na line\nskipped" + samples})
        self.write("b.raw.gz", b"a line\n", packed)
        self.write("b.nhdr", head, skip, b"data file: b.raw.gz\n\nnotes")
        self.assertEqual(self.uncompressed("b.nhdr", "gzip"), {"b.nhdr": raw + skip + b"data file: b.raw\n\nnotes", "b.raw": b"a line\nskipped" + samples})
        slices = [samples[z * 198:][:198] for z in range(4)]
        for z, slice in enumerate(slices):
            self.write(f"{z}.raw.gz", gzip.compress(slice))
        files = {f"{z}.raw": slice for z, slice in enumerate(slices)}
        self.write("c.nhdr", head, b"data file: %d.raw.gz 0 3 1\n")
        self.assertEqual(self.uncompressed("c.nhdr", "gzip"), files | {"c.nhdr": raw + b"data file: %d.raw 0 3 1\n"})
        self.write("d.nhdr", head, b"data file: LIST\n", *[b"%d.raw.gz\r\n" % z for z in range(4)])
        self.assertEqual(self.uncompressed("d.nhdr", "gzip"), files | {"d.nhdr": raw + b"data file: LIST\n" + b"".join(b"%d.raw\r\n" % z for z in range(4))})

    def test_compressed_nifti_comes_back_as_gunzip_gives_it(self):
        image = nibabel.Nifti2Image(self.volume("int16").T, numpy.diag([1, 2, 3, 1]))
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension("comment", b"a note of 17 bytes"))
        nibabel.save(image, self.folder / "a.nii.gz")
        self.assertEqual(self.uncompressed("a.nii.gz", "gzip"), {"a.nii": gzip.decompress(self.bytes("a.nii.gz"))})
        # Of several volumes, one is encoded; the others are bytes besides its samples.
        nibabel.save(nibabel.Nifti1Image(self.volume("int16", (11, 9, 4, 3)), numpy.eye(4)), self.folder / "b.nii.gz")
        for series in "123":
            self.assertEqual(self.uncompressed("b.nii.gz", "gzip", "--series", series), {"b.nii": gzip.decompress(self.bytes("b.nii.gz"))})
        nibabel.save(nibabel.Nifti1Pair(self.volume("int16").T, numpy.eye(4)), self.folder / "c.img")
        plain = {name: self.bytes(name) for name in ("c.hdr", "c.img")}
        for packed in (["c.img"], ["c.img", "c.hdr"]):
            for name in packed:
                self.write(name + ".gz", gzip.compress(plain[name]))
                (self.folder / name).unlink(missing_ok=True)
            path = "c.hdr.gz" if "c.hdr" in packed else "c.hdr"
            self.ok("encode", path, "-o", "c.tag", "-f")
            self.ok("restore", "c.tag", "-o", "r", "-f")
            self.assertEqual({name: self.bytes(f"r/{name}") for name in self.files("r")}, plain)

    def test_compressed_metaimage_comes_back_uncompressed(self):
        samples, size = self.volume().tobytes(), b"CompressedDataSize = 123\n"
        packed = zlib.compress(samples)
        head = (b"ObjectType = Image\nNDims = 3\nComment = \xff\nCompressedData = True\n" + size
                + b"DimSize = 11 9 4\nElementType = MET_USHORT\nElementSpacing = 1 2 3\nElementDataFile = ")
        raw = head.replace(size, b"").replace(b"True", b"False")
        self.write("a.mha", head, b"LOCAL\n", packed)
        self.assertEqual(self.uncompressed("a.mha", "zlib"), {"a.mha": raw + b"LOCAL\n" + samples})
        self.write("b.zraw", gzip.compress(samples))
        self.write("b.mhd", head, b"b.zraw\n")
        self.assertEqual(self.uncompressed("b.mhd", "gzip"), {"b.mhd": raw + b"b.raw\n", "b.raw": samples})

    @unittest.skipIf(shutil.which("gdcmconv") is None or shutil.which("dcmcrle") is None, "there are no gdcmconv and dcmcrle on this machine")
    def test_compressed_dicom_comes_back_as_the_same_data_set(self):
        truth = self.volume(shape=(4, 9, 11))
        for option in ("--rle", "--jpeg", "--jpegls", "--j2k", "dcmcrle"):
            shutil.rmtree(self.folder / "s", ignore_errors=True)
            os.mkdir(self.folder / "s")
            for z, slice in enumerate(truth):
                file = data_set(slice, instance=f"1.2.{z}", position=(0, 0, z))
                block = file.private_block(0x0009, "SOMEBODY", create=True)
                block.add_new(1, "OB", bytes(range(200)))
                block.add_new(2, "LO", "M\xfcller")
                file.SpecificCharacterSet = "ISO_IR 100"
                item = pydicom.Dataset()
                item.CodeValue = "1"
                file.ProcedureCodeSequence = pydicom.Sequence([item, item])
                file.DataSetTrailingPadding = b"\0" * 10
                self.save("a.dcm", file)
                command = [option] if option == "dcmcrle" else ["gdcmconv", option]
                subprocess.run([*command, "a.dcm", f"s/{z}.dcm"], cwd=self.folder, check=True)
            compression = self.encoded("s")[1]["compression"]
            self.assertTrue(compression, self.ok("encode", "s", "-o", "x.tag", "-f", "-v").stderr + option)
            for name, after in self.uncompressed("s", compression).items():
                (self.folder / "now.dcm").write_bytes(after)
                then, now = (pydicom.dcmread(self.folder / path) for path in (f"s/{name}", "now.dcm"))
                self.assertEqual(now.file_meta.TransferSyntaxUID, pydicom.uid.ExplicitVRLittleEndian)
                numpy.testing.assert_array_equal(now.pixel_array, truth[int(name[0])])
                self.assertEqual(now.file_meta.FileMetaInformationGroupLength,
                                 then.file_meta.FileMetaInformationGroupLength + 20 - len(then.file_meta.TransferSyntaxUID) - len(then.file_meta.TransferSyntaxUID) % 2)
                del then.file_meta.TransferSyntaxUID, now.file_meta.TransferSyntaxUID, then.PixelData, now.PixelData
                del then.file_meta.FileMetaInformationGroupLength, now.file_meta.FileMetaInformationGroupLength
                self.assertEqual(str(then.file_meta), str(now.file_meta))
                self.assertEqual(then, now)

    @unittest.skipIf(shutil.which("gdcmconv") is None, "there is no gdcmconv on this machine")
    def test_dicom_that_has_no_plain_form_is_not_kept(self):
        data_set(self.volume(), BitsStored=16, HighBit=15).save_as(self.folder / "a.dcm", write_like_original=False)
        subprocess.run(["gdcmconv", "--j2k", "a.dcm", "b.dcm"], cwd=self.folder, check=True)
        narrow = pydicom.dcmread(self.folder / "b.dcm")
        narrow.BitsStored, narrow.HighBit = 8, 7
        narrow.save_as(self.folder / "b.dcm")
        run = self.ok("encode", "b.dcm", "-o", "a.tag", "-f", "-v")
        self.assertIn("its code stream has larger numbers than it says", run.stderr)
        self.assert_refused(64, "holds no source files", "restore", "a.tag", "-o", "r")

    def test_a_pipe_has_no_files_to_restore_and_decode_gives_all_that_is_known(self):
        head = b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 11 9 4\nencoding: raw\nendian: little\nspacings: 1 2 3\nkey:=value\n\n"
        samples = self.volume().tobytes()
        for sent, options, known in ((head + samples, "", {"key": "value"}), (samples, "--dims 11,9,4 --type uint16 --spacing 1,2,3", {})):
            self.write("sent", sent)
            run = subprocess.run(f"{PROGRAM} encode - {options} -v -f -o x.tag < sent", shell=True, cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertIn("standard input: cannot be restored byte for byte: it came through a pipe", run.stderr)
            info = self.info("x.tag")
            self.assertEqual((info["restorable"], info["compression"], info["bytes"]["envelope"]), (False, None, 0))
            self.assertIn("source files    not kept", self.ok("info", "x.tag").stdout)
            message = self.assert_refused(64, "holds no source files: the volume came through a pipe,", "restore",
                                          "x.tag", "-o", "r")
            # The advice, followed.
            advice = re.search(r"use tagrid (decode FILE\.tag -o FILE\.nrrd) to get the volume", message)[1].replace("FILE", "x").split()
            self.ok(*advice, "-f")
            self.assertTrue(self.bytes("x.nrrd").endswith(b"\n\n" + samples))
            self.ok("encode", "x.nrrd", "-o", "y.tag", "-f")
            again = self.info("y.tag")
            self.assertEqual((again["geometry"], again["source"]["pairs"]), (info["geometry"], known))
            self.assertEqual(info["geometry"]["spacing"], [1, 2, 3])

    def test_compressed_files_are_not_removed(self):
        nibabel.save(nibabel.Nifti1Image(self.volume("int16"), numpy.eye(4)), self.folder / "a.nii.gz")
        self.assert_refused(64, "its samples are compressed (gzip), and come back uncompressed", "encode", "a.nii.gz", "--rm")
        (self.folder / "list").write_text("a.nii.gz\n")
        self.ok("convert", "--manifest", "list", "--output-dir", "out")
        self.assertIn('"restorable": false', (self.folder / "out" / "results.jsonl").read_text().replace('":', '": '))
        self.assertEqual(self.tagrid("convert", "--manifest", "list", "--output-dir", "out", "--remove-verified").returncode, 65)
        self.assertTrue((self.folder / "a.nii.gz").exists())

    def test_files_whose_chunks_come_back_contiguous_are_not_removed(self):
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("data", data=self.volume("int16"), chunks=(2, 4, 4))
        self.assert_refused(64, "its samples are in chunks, and come back contiguous", "encode", "a.h5", "--rm")
        self.assertTrue((self.folder / "a.h5").exists())

    def test_after_a_loss_compressed_files_differ_in_their_samples_alone(self):
        nibabel.save(nibabel.Nifti1Image(self.volume("int16"), numpy.eye(4)), self.folder / "a.nii.gz")
        self.ok("encode", "a.nii.gz", "-o", "a.tag", "--max-error", "20")
        run = self.ok("restore", "a.tag", "-o", "r")
        for words in ("samples were compressed (gzip)", "a.nii were not kept exactly; they differ by up to 20"):
            self.assertIn(words, run.stderr)
        then, now = gzip.decompress(self.bytes("a.nii.gz")), self.bytes("r/a.nii")
        self.assertEqual(then[:352], now[:352])
        difference = numpy.abs(numpy.frombuffer(then[352:], "<i2").astype(int) - numpy.frombuffer(now[352:], "<i2")).max()
        self.assertTrue(0 < difference <= 20)

    def test_many_ranks_and_resumed_runs_keep_the_same(self):
        self.dicom_series("zero", False)
        self.ok("encode", "s", "-o", "a.tag")
        self.ok("encode", "s", "-o", "b.tag", "--resume")
        self.assertEqual(self.bytes("a.tag"), self.bytes("b.tag"))


if __name__ == "__main__":
    main()
