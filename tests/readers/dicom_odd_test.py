"""DICOM files that say something else than they should: read as other people's readers do, or refused, never misread.

    dicom_odd_test.py PROGRAM
"""

import shutil
import struct
import subprocess
import unittest

import other_readers
from dicom_test import BIG, CT, IMPLICIT, LITTLE, data_set, volume
from other_readers import ReaderTest

numpy = other_readers.library("numpy", "python3-numpy")
pydicom = other_readers.library("pydicom", "python3-pydicom")

ENCAPSULATED, DEFLATED = "1.2.840.10008.1.2.1.98", "1.2.840.10008.1.2.1.99"
JPEG_LS, RLE, J2K = "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.5", "1.2.840.10008.1.2.4.90"


def item(content):
    return struct.pack("<HHI", 0xFFFE, 0xE000, len(content)) + content


def fragments(items, table=b""):
    return item(table) + b"".join(map(item, items)) + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)


@unittest.skipIf(pydicom is None, "there is no pydicom on this machine")
class DicomOdd(ReaderTest):
    def save(self, name, file, *replaced):
        """Writes a file; what pydicom would not write replaces bytes of the same length."""
        (self.folder / name).parent.mkdir(exist_ok=True)
        file.save_as(self.folder / name, write_like_original=False)
        content = (self.folder / name).read_bytes()
        for old, new in replaced:
            self.assertEqual((content.count(old), len(old)), (1, len(new)), (old, new))
            content = content.replace(old, new)
        (self.folder / name).write_bytes(content)

    def claim(self, name, syntax):
        """Gives a file another transfer syntax, whatever that is."""
        content = (self.folder / name).read_bytes()
        data = content[144 + int.from_bytes(content[140:144], "little"):]
        meta = pydicom.dataset.FileMetaDataset()
        meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID, meta.TransferSyntaxUID = CT, "1.2.3.1", syntax
        with open(self.folder / name, "wb") as file:
            file.write(bytes(128) + b"DICM")
            pydicom.filewriter.write_file_meta_info(file, meta)
            file.write(data)

    def encapsulate(self, file, syntax, items, table=b"", vr="OB"):
        file.file_meta.TransferSyntaxUID = syntax
        file.PixelData = fragments(items, table)
        file["PixelData"].VR, file["PixelData"].is_undefined_length = vr, True
        return file

    def values(self, path, *options):
        """What the samples mean, by slope and intercept."""
        samples, info = self.encoded(path, *options)
        pairs = info["source"]["pairs"]
        return samples * float(pairs.get("rescale_slope", 1)) + float(pairs.get("rescale_intercept", 0)), info

    def assert_stays(self, path, text):
        """A lossy encoding does not replace the file, and says why."""
        before = (self.folder / path).read_bytes()
        run = self.tagrid("encode", path, "-o", "lossy.tag", "-f", "--max-error", "5", "--rm")
        self.assertNotEqual(run.returncode, 0, run.stderr)
        self.assertIn(text, run.stderr)
        self.assertEqual((self.folder / path).read_bytes(), before)

    def test_numbers_with_a_decimal_comma_are_read(self):
        truth = volume()[:1]
        for attribute, text, slope, intercept in (("RescaleSlope", "8.75", 8.75, -1024), ("RescaleIntercept", "-87.5", 1, -87.5)):
            self.save("a.dcm", data_set(truth[0], **{attribute: text}), (text.encode(), text.replace(".", ",").encode()))
            values, _ = self.values("a.dcm")
            numpy.testing.assert_array_equal(values, truth * slope + intercept)
            self.assertIn(f'a.dcm: {attribute} is "{text.replace(".", ",")}", with a decimal comma; it is read as {text}', self.messages)
        self.save("a.dcm", data_set(truth[0], PixelSpacing=["0.75", "0.25"], position=("8.5", "0", "3")),
                  (b"0.75\\0.25", b"0,75\\0,25"), (b"8.5\\0\\3", b"8,5\\0\\3"))
        info = self.encoded("a.dcm")[1]
        self.assertEqual((info["geometry"]["directions"][:2], info["geometry"]["origin"]), ([[0.25, 0, 0], [0, 0.75, 0]], [8.5, 0, 3]))
        self.assertIn(r'PixelSpacing is "0,75\0,25", with a decimal comma; it is read as 0.75, 0.25', self.messages)

    def test_a_slope_that_cannot_be_read_takes_no_bound(self):
        truth = volume()[:1]
        for attribute, text, replaced, said in (
                ("RescaleSlope", "8.75", "    ", "RescaleSlope is empty"), ("RescaleSlope", "8.75", "x.75", 'RescaleSlope is "x.75"'),
                ("RescaleSlope", "8.75", "1\\75", r'RescaleSlope is "1\75"'), ("RescaleSlope", "0.00", "0.00", "RescaleSlope is 0, which"),
                ("RescaleIntercept", "-87.5", "-87.x", 'RescaleIntercept is "-87.x"'),
                ("RescaleIntercept", "-87.5", "     ", "RescaleIntercept is empty"), ("RescaleIntercept", "-1.024", "-1,024", '"-1,024"')):
            self.save("a.dcm", data_set(truth[0], **{attribute: text}), (text.encode(), replaced.encode()))
            samples, info = self.encoded("a.dcm")
            self.assertIn(said, self.messages)
            self.assertIn("samples are kept as they are stored", self.messages)
            self.assert_same(samples, truth.astype("int16"))
            self.assert_refused(64, said, "encode", "a.dcm", "-o", "b.tag", "-f", "--max-error", "5")
            self.assert_stays("a.dcm", said)

    def test_a_doubt_of_one_slice_is_one_of_the_series(self):
        truth = volume()
        for z in range(7):
            replaced = [(b"8.75", b"8.7x")] if z == 3 else []
            self.save(f"s/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", position=(0, 0, z), RescaleSlope="8.75"), *replaced)
        self.assert_same(self.encoded("s")[0], truth.astype("int16"))
        self.assertIn('s: RescaleSlope is "8.7x", which is not a number; samples are kept as they are stored (3.dcm)', self.messages)
        self.assert_refused(64, '"8.7x"', "encode", "s", "-o", "b.tag", "--max-error", "5")

    def test_a_slope_without_an_intercept_is_said(self):
        truth = volume()[:1]
        for missing, values in (("RescaleIntercept", truth * 2.5), ("RescaleSlope", truth - 1024.0)):
            self.save("a.dcm", data_set(truth[0], **({"RescaleSlope": 2.5} | {missing: None})))
            numpy.testing.assert_array_equal(self.values("a.dcm")[0], values)
            self.assertIn(f"a.dcm: {missing} is absent although there is a Rescale", self.messages)
            self.assert_stays("a.dcm", f"{missing} is absent")

    def test_attributes_whose_representation_is_lost_are_read(self):
        """Archives store what they do not know as UN."""
        truth = volume()[:1]
        file = data_set(truth[0])
        for tag, content in ((0x00281053, b"2.5 "), (0x00281052, b"-100"), (0x00280030, b"0.5\\0.25")):
            del file[tag]
            file.add_new(tag, "UN", content)
        self.save("a.dcm", file)
        values, info = self.values("a.dcm")
        numpy.testing.assert_array_equal(values, truth * 2.5 - 100)
        self.assertEqual(info["geometry"]["spacing"][:2], [0.25, 0.5])
        self.assertEqual(self.messages, "")

    def test_an_unreadable_place_is_said_and_is_no_place(self):
        truth = volume()[0]
        for attributes, replaced, said in (
                ({"position": ("8.5", "0", "3")}, (rb"8.5\0\3", rb"8.x\0\3"), r'ImagePositionPatient is "8.x\0\3"'),
                ({"position": ("8.5", "0", "3")}, (rb"8.5\0\3", rb"8.5\053"), r'ImagePositionPatient is "8.5\053", 2 numbers instead of 3'),
                ({"ImageOrientationPatient": [0] * 6}, None, "ImageOrientationPatient is 0, 0, 0, 0, 0, 0, which are not two directions"),
                ({"ImageOrientationPatient": [1, 0, 0, 1, 0, 0]}, None, "which are not two directions at right angles"),
                ({"PixelSpacing": ["0.75", "0.25"]}, (rb"0.75\0.25", rb"0.75 0.25"), 'PixelSpacing is "0.75 0.25"'),
                ({"PixelSpacing": ["0.75", "-1"]}, None, "PixelSpacing is 0.75, -1, which are not distances")):
            self.save("a.dcm", data_set(truth, **attributes), *([replaced] if replaced else []))
            info = self.encoded("a.dcm")[1]
            self.assertIn(said, self.messages)
            self.assertIsNone(info["geometry"]["directions"], said)
        self.save("a.dcm", data_set(truth, SliceThickness="3.25"), (b"3.25", b"3.2x"))
        self.encoded("a.dcm")
        self.assertIn('SliceThickness is "3.2x"', self.messages)
        # Among slices that have places, the file is named.
        for z in range(3):
            self.save(f"s/{z}.dcm", data_set(truth, instance=f"1.2.3.{z}", position=("8.5", "0", str(z))),
                      *([(rb"8.5\0\1", rb"8.x\0\1")] if z == 1 else []))
        self.assert_refused(65, r'1 of 3 slices have no position, as 1.dcm; ImagePositionPatient is "8.x\0\1"', "encode", "s")

    def test_plain_samples_in_fragments_are_unpacked(self):
        truth = volume(shape=(4, 6, 10))
        frames = [frame.astype("<u2").tobytes() for frame in truth]
        table = struct.pack("<4I", *(z * (8 + len(frames[0])) for z in range(4)))
        whole = b"".join(frames)
        for items, offsets in ((frames, b""), (frames, table), ([whole], b""), ([whole[i:i + 70] for i in range(0, len(whole), 70)], b"")):
            self.save("a.dcm", self.encapsulate(data_set(truth), ENCAPSULATED, items, offsets))
            self.assert_same(self.encoded("a.dcm")[0], (truth - 1024).astype("int16"), len(items))
            self.assertEqual(self.messages, "")
        odd = volume(8, (3, 3, 5))
        items = [frame.astype("u1").tobytes() + b"\0" for frame in odd]
        file = data_set(odd, BitsAllocated=8, BitsStored=8, HighBit=7, RescaleIntercept=0)
        self.save("a.dcm", self.encapsulate(file, ENCAPSULATED, items))
        self.assert_same(self.encoded("a.dcm")[0], odd.astype("uint8"))
        for items, said in ((frames[:3], "its fragments have 360 bytes"), ([], "its fragments have 0 bytes"), ([whole + b"1234"], "484 bytes")):
            self.save("a.dcm", self.encapsulate(data_set(truth), ENCAPSULATED, items))
            self.assert_refused(65, said, "encode", "a.dcm")
        file = self.encapsulate(data_set(truth[:2]), ENCAPSULATED, frames)
        self.save("a.dcm", file)
        self.assert_same(self.encoded("a.dcm")[0], (truth[:2] - 1024).astype("int16"))
        self.assertIn("its pixels are those of 4 frames", self.messages)
        self.assert_stays("a.dcm", "its pixels are those of 4 frames")

    def test_samples_in_unknown_syntaxes_are_refused_by_name_and_stay(self):
        truth = volume()[0]
        stream = b"\xff\x4f\xff\x51" + numpy.random.default_rng(1).bytes(4000)
        for syntax, said in (("1.2.840.10008.1.2.4.201", "High-Throughput JPEG 2000"), ("1.2.840.10008.1.2.4.203", "High-Throughput JPEG 2000"),
                             ("1.2.840.10008.1.2.4.110", "JPEG XL"), ("1.2.840.10008.1.2.4.102", "MPEG"), ("1.2.840.10008.1.2.4.100.1", "MPEG"),
                             ("1.2.840.10008.1.2.4.108", "HEVC"), ("1.2.840.10008.1.2.4.92", "Multicomponent"), ("1.2.840.10008.1.2.4.53", "retired"),
                             ("1.2.840.10008.1.2.8.1", "Deflated Image Frame"), ("1.2.3.4.5", "not known"),
                             (LITTLE, "in fragments, which is not possible"), (IMPLICIT, "in fragments")):
            file = self.encapsulate(data_set(truth), J2K, [stream])
            file.is_implicit_VR = syntax == IMPLICIT
            self.save("a.dcm", file)
            self.claim("a.dcm", syntax)
            self.assertIn(said, self.assert_refused(65, syntax, "encode", "a.dcm"))
            self.assert_stays("a.dcm", syntax)
        # Samples that lie plainly, in a syntax of which nobody knows their order, or where there should be fragments.
        for syntax, said in (("1.2.3.4.5", "not known"), ("1.2.840.113619.5.2", "GE Private"), ("1.2.840.10008.1.20", "Papyrus"),
                             ("1.2.840.10008.1.2.4.94", "JPIP"), (J2K, "without fragments"), (RLE, "without fragments"), (ENCAPSULATED, "without fragments")):
            self.save("a.dcm", data_set(truth, syntax=IMPLICIT if "GE" in said else LITTLE))
            self.claim("a.dcm", syntax)
            self.assertIn(said, self.assert_refused(65, syntax, "encode", "a.dcm"))

    def frames_as(self, number, truth, syntax=LITTLE):
        """Pixels of all frames, and a NumberOfFrames of another number."""
        file = data_set(truth, syntax=syntax)
        del file.NumberOfFrames
        if number is not None:
            file.add_new(0x00280008, "IS", number)
        return file

    def test_frames_that_are_left_out_are_said_and_the_file_stays(self):
        truth = volume(shape=(4, 6, 10))
        for syntax in (LITTLE, IMPLICIT, BIG, DEFLATED):
            for number, frames in ((None, 1), ("2", 2), ("0", 1), ("", 1))[:4 if syntax == LITTLE else 1]:
                self.save("a.dcm", self.frames_as(number, truth, syntax))
                self.assert_same(self.encoded("a.dcm")[0], (truth[:frames] - 1024).astype("int16"), number)
                self.assertIn(f"a.dcm: {'NumberOfFrames is' if number in ('0', '') else 'its pixels are those of 4 frames, but it says that it has'}",
                              self.messages)
                self.assert_stays("a.dcm", "NumberOfFrames" if syntax != DEFLATED else "a.dcm")
        for number, said in (("5", "in 5 frames have 600"), ("-1", "has -1 frames"), ("2147483647", "has 2147483647 frames"), ("2.5", '"2.5"'), ("4x", '"4x"')):
            self.save("a.dcm", self.frames_as("9876" if number in ("4x", "2.5") else number, truth),
                      *([(b"\x28\0\x08\0IS\x04\x009876", b"\x28\0\x08\0IS\x04\0" + number.ljust(4).encode())] if number in ("4x", "2.5") else []))
            self.assert_refused(65, said, "encode", "a.dcm")
        file = data_set(truth)
        file.PixelData += b"123456"
        self.save("a.dcm", file)
        self.encoded("a.dcm")
        self.assertIn("its pixels have 6 bytes more than 10 x 6 samples of 16 bits in 4 frames", self.messages)
        file.PixelData = b""
        self.save("a.dcm", file)
        self.assertNotIn("--gaps-ok", self.assert_refused(65, "its pixels have 0 bytes", "encode", "a.dcm"))

    @unittest.skipIf(shutil.which("gdcmconv") is None, "there is no gdcmconv on this machine (libgdcm-tools)")
    def test_streams_that_are_left_out_are_said(self):
        truth = volume(shape=(4, 20, 31))
        self.save("a.dcm", data_set(truth))
        for option in ("--rle", "--jpegls", "--j2k", "--jpeg"):
            subprocess.run(["gdcmconv", option, self.folder / "a.dcm", self.folder / "b.dcm"], check=True)
            file = pydicom.dcmread(self.folder / "b.dcm")
            del file.NumberOfFrames
            file.save_as(self.folder / "b.dcm")
            run = self.tagrid("encode", "b.dcm", "-o", "b.tag", "-f")
            self.assertIn("its pixels are those of 4 frames" if run.returncode == 0 else "frame", run.stderr, option)
            self.assert_stays("b.dcm", "b.dcm")

    def test_lengths_that_are_no_sizes_are_refused(self):
        truth = volume()[0]
        self.save("a.dcm", data_set(truth, PatientComments="0123456789"))
        whole = (self.folder / "a.dcm").read_bytes()
        at = whole.index(b"0123456789") - 2
        for length in (b"\xff\xff", b"\xfe\xff", b"\x0b\0", b"\0\0"):
            (self.folder / "b.dcm").write_bytes(whole[:at] + length + whole[at + 2:])
            self.assert_refused(65, "b.dcm: ", "encode", "b.dcm")
        at = len(whole) - truth.size * 2 - 4
        self.assertEqual(whole[at:at + 4], struct.pack("<I", truth.size * 2))
        for length in (0xFFFFFFFF, 0, 10, truth.size * 2 - 2):
            (self.folder / "b.dcm").write_bytes(whole[:at] + struct.pack("<I", length) + whole[at + 4:])
            self.assert_refused(65, "b.dcm: DICOM file: ", "encode", "b.dcm")
        (self.folder / "b.dcm").write_bytes(whole[:at] + struct.pack("<I", 0xFFFFFFFE) + whole[at + 4:])
        run = self.tagrid("encode", "b.dcm", "-o", "b.tag")
        self.assertIn("its pixels", run.stderr)
        self.assert_stays("b.dcm", "its pixels")


if __name__ == "__main__":
    other_readers.main()
