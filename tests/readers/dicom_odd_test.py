"""DICOM files that say something else than they should: read as other people's readers do, or refused, never misread."""

import pathlib
import re
import shutil
import struct
import subprocess
import unittest
import warnings

from other_readers import ReaderTest, main, numpy, pydicom, some
from scans import BIG, IMPLICIT, LITTLE, claim, data_set, sequence, volume


if pydicom is not None:
    from pydicom.pixel_data_handlers.util import apply_modality_lut

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

    def pairs(self, *paths):
        """Those of a volume, which comes back byte for byte."""
        return self.encoded(*paths)[1]["source"]["pairs"]

    def test_letters_of_every_character_set_become_utf_8(self):
        """As pydicom reads them, and as they were written."""
        for sets, name in (("ISO_IR 100", "Müller^Jörg"), ("ISO_IR 101", "Dvořák^Antonín"), ("ISO_IR 109", "Ħal^Ġorġ"),
                           ("ISO_IR 110", "Āboliņš^Jānis"), ("ISO_IR 144", "Люкceмбypг"), ("ISO_IR 127", "قباني^لنزار"),
                           ("ISO_IR 126", "Διονυσιος"), ("ISO_IR 138", "שרון^דבורה"), ("ISO_IR 148", "Çavuşoğlu"),
                           ("ISO_IR 166", "สมชาย"), ("ISO_IR 13", "ﾔﾏﾀﾞ^ﾀﾛｳ"), ("ISO_IR 192", "Wang^XiaoDong=王^小东"),
                           ("GB18030", "Wang^XiaoDong=王^小东"), ("GBK", "Wang^XiaoDong=王^小东"), ("ISO 2022 IR 100", "Müller^Jörg"),
                           (["", "ISO 2022 IR 87"], "Yamada^Tarou=山田^太郎=やまだ^たろう"),
                           (["ISO 2022 IR 13", "ISO 2022 IR 87"], "ﾔﾏﾀﾞ^ﾀﾛｳ=山田^太郎=やまだ^たろう"),
                           (["", "ISO 2022 IR 87", "ISO 2022 IR 159"], "Yamada^Tarou=丂田^太郎"),
                           (["", "ISO 2022 IR 149"], "Hong^Gildong=洪^吉洞=홍^길동"),
                           (["ISO 2022 IR 100", "ISO 2022 IR 144"], "Müller^Jörg=Люкceмбypг")):
            file = data_set(volume()[0], SpecificCharacterSet=sets, PatientName=name, StudyDescription=name.split("=")[-1] + " 7",
                            # pydicom does not repeat escape sequences in each line, as the standard wants it.
                            PatientComments="\r\n".join([name.split("=")[-1]] * (2 if isinstance(sets, str) else 1)),
                            OperatorsName=[name, "Doe^Jane", name])
            self.save("a.dcm", file)
            pairs, seen = self.pairs("a.dcm"), pydicom.dcmread(self.folder / "a.dcm")
            self.assertEqual((pairs["dicom_PatientName"], str(seen.PatientName)), (name, name), sets)
            self.assertEqual(pairs["dicom_OperatorsName"], "\\".join(map(str, seen.OperatorsName)), sets)
            for attribute in ("StudyDescription", "PatientComments"):
                self.assertEqual(pairs[f"dicom_{attribute}"], str(seen[attribute].value).replace("\r", ""), sets)
            self.assertEqual(self.messages, "", sets)

    def test_a_set_that_holds_by_an_escape_sequence_ends_where_the_standard_says(self):
        def check(sets, written, read):
            placeholder = "x" * len(written)
            self.save("a.dcm", data_set(volume()[0], SpecificCharacterSet=sets, PatientName=placeholder),
                      (placeholder.encode(), written))
            self.assertEqual(self.pairs("a.dcm")["dicom_PatientName"], read)

        check(["", "ISO 2022 IR 58"], b"Zhang^XiaoDong=\x1b$)A\xd5\xc5^\x1b$)A\xd0\xa1\xb6\xab", "Zhang^XiaoDong=张^小东")
        check("ISO_IR 203", b"\xbcuvre\xa4 ", "Œuvre€")  # pydicom does not know it
        # The second byte of a letter may be that of a delimiter.
        check(["", "ISO 2022 IR 87"], b"A=\x1b$B%=\x1b(B^\x1b$B%^\x1b(B ", "A=ソ^マ")
        check(["ISO 2022 IR 100", "ISO 2022 IR 126"], b"\xe4\x1b-F\xe4=\xe4^\xe4", "äδ=ä^ä")
        # Other spellings are met.
        check("ISO_IR_100", b"M\xfcller", "Müller")
        check("ISO-IR 144", b"\xbb\xee\xda ", "Люк")

    def test_bytes_that_are_no_letters_are_kept_and_said(self):
        for sets, written in (("ISO_IR 192", b"M\xfcller"), ("ISO_IR 100", b"M\x81ller"), (["", "ISO 2022 IR 87"], b"\x1b$B;3E"),
                              (["", "ISO 2022 IR 149"], b"\xc8\xab"), ("ISO_IR 4711", b"M\xfcller"), (None, b"M\xfcller"),
                              (["", "ISO 2022 IR 87"], b"\x1b$X;3\x1b(B"), ("GB18030", b"\xff\xff")):
            placeholder = "x" * len(written)
            more = {"SpecificCharacterSet": sets} if sets else {}
            self.save("a.dcm", data_set(volume()[0], PatientName=placeholder, StudyDescription="Knie", **more),
                      (placeholder.encode(), written))
            pairs = self.pairs("a.dcm")
            escaped = re.sub(rb"[^ -~]", lambda byte: f"\ufffd{byte[0][0]:02X}".encode(), written).decode()
            self.assertEqual(pairs["dicom_PatientName"], escaped)
            self.assertEqual(pairs["dicom_StudyDescription"], "Knie")
            self.assertIn("a.dcm: PatientName has bytes that are not letters of its character set (SpecificCharacterSet is ",
                          self.messages, written)
        # The other texts of the file are read all the same.
        self.save("a.dcm", data_set(volume()[0], SpecificCharacterSet="ISO_IR 100", PatientName="xxxxxx", StudyDescription="Übung"),
                  (b"xxxxxx", b"M\x81ller"[:6]))
        self.assertEqual(self.pairs("a.dcm")["dicom_StudyDescription"], "Übung")

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
        self.encodes(truth.astype("int16"), "s")
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
        self.save("a.dcm", data_set(truth[0], RescaleSlope="2.5", RescaleIntercept="-100", position=("1", "2", "3")))
        content = (self.folder / "a.dcm").read_bytes()
        for tag, length in ((b"\x28\0\x53\x10", 4), (b"\x28\0\x52\x10", 4), (b"\x28\0\x30\0", 8), (b"\x20\0\x32\0", 6)):
            old = tag + b"DS" + struct.pack("<H", length)
            self.assertEqual(content.count(old), 1, tag)
            content = content.replace(old, tag + b"UN\0\0" + struct.pack("<I", length))
        (self.folder / "a.dcm").write_bytes(content)
        values, info = self.values("a.dcm")
        numpy.testing.assert_array_equal(values, truth * 2.5 - 100)
        self.assertEqual((info["geometry"]["directions"][:2], info["geometry"]["origin"]), ([[0.25, 0, 0], [0, 0.5, 0]], [1, 2, 3]))
        self.assertEqual(self.messages, "")

    def test_an_unreadable_place_is_said_and_is_no_place(self):
        truth = volume()[0]
        for attributes, replaced, said in (
                ({"position": ("8.5", "0", "3")}, (rb"8.5\0\3", rb"8.x\0\3"), r'ImagePositionPatient is "8.x\0\3"'),
                ({"position": ("8.5", "0", "3")}, (rb"8.5\0\3", rb"8.5\053"), r'ImagePositionPatient is "8.5\053", 2 numbers instead of 3'),
                ({"ImageOrientationPatient": [0] * 6}, None, "ImageOrientationPatient is 0, 0, 0, 0, 0, 0, which are not two directions"),
                ({"ImageOrientationPatient": [1, 0, 0, 1, 0, 0]}, None, "which are not two directions at right angles"),
                ({"PixelSpacing": ["0.75", "0.25"]}, (rb"0.75\0.25", rb"0.75 0.25"), 'PixelSpacing is "0.75 0.25"'),
                ({"PixelSpacing": ["0.75", "-1"]}, None, "PixelSpacing is 0.75, -1, which are not distances"),
                ({"PixelSpacing": ["0", "0.5"]}, None, "which are not distances")):
            self.save("a.dcm", data_set(truth, **attributes), *([replaced] if replaced else []))
            info = self.encoded("a.dcm")[1]
            self.assertIn(said, self.messages)
            self.assertIsNone(info["geometry"]["directions"], said)
        self.save("a.dcm", data_set(truth, SliceThickness="3.25"), (b"3.25", b"3.2x"))
        self.encoded("a.dcm", says='SliceThickness is "3.2x"')
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
            self.encodes((truth - 1024).astype("int16"), "a.dcm", what=len(items))
            self.assertEqual(self.messages, "")
        odd = volume(8, (3, 3, 5))
        items = [frame.astype("u1").tobytes() + b"\0" for frame in odd]
        file = data_set(odd, BitsAllocated=8, BitsStored=8, HighBit=7, RescaleIntercept=0)
        self.save("a.dcm", self.encapsulate(file, ENCAPSULATED, items))
        self.encodes(odd.astype("uint8"), "a.dcm")
        for items, said in ((frames[:3], "its fragments have 360 bytes"), ([], "its fragments have 0 bytes"), ([whole + b"1234"], "484 bytes")):
            self.save("a.dcm", self.encapsulate(data_set(truth), ENCAPSULATED, items))
            self.assert_refused(65, said, "encode", "a.dcm")
        file = self.encapsulate(data_set(truth[:2]), ENCAPSULATED, frames)
        self.save("a.dcm", file)
        self.encodes((truth[:2] - 1024).astype("int16"), "a.dcm", says="its pixels are those of 4 frames")
        self.assert_stays("a.dcm", "its pixels are those of 4 frames")

    def test_samples_in_unknown_syntaxes_are_refused_by_name_and_stay(self):
        truth = volume()[0]
        stream = b"\xff\x4f\xff\x51" + numpy.random.default_rng(1).bytes(4000)
        for syntax, said in (("1.2.840.10008.1.2.4.204", "JPIP HTJ2K"), ("1.2.840.10008.1.2.4.102", "MPEG"), ("1.2.840.10008.1.2.4.100.1", "MPEG"),
                             ("1.2.840.10008.1.2.4.108", "HEVC"), ("1.2.840.10008.1.2.4.92", "Multicomponent"), ("1.2.840.10008.1.2.4.53", "retired"),
                             ("1.2.840.10008.1.2.8.1", "Deflated Image Frame"), ("1.2.3.4.5", "not known"),
                             (LITTLE, "in fragments, which is not possible"), (IMPLICIT, "in fragments")):
            file = self.encapsulate(data_set(truth), J2K, [stream])
            file.is_implicit_VR = syntax == IMPLICIT
            self.save("a.dcm", file)
            claim(self.folder / "a.dcm", syntax)
            self.assertIn(said, self.assert_refused(65, syntax, "encode", "a.dcm"))
            self.assert_stays("a.dcm", syntax)
        # Samples that lie plainly, in a syntax of which nobody knows their order, or where there should be fragments.
        for syntax, said in (("1.2.3.4.5", "not known"), ("1.2.840.113619.5.2", "GE Private"), ("1.2.840.10008.1.20", "Papyrus"),
                             ("1.2.840.10008.1.2.4.94", "JPIP"), (J2K, "without fragments"), (RLE, "without fragments"), (ENCAPSULATED, "without fragments")):
            self.save("a.dcm", data_set(truth, syntax=IMPLICIT if "GE" in said else LITTLE))
            claim(self.folder / "a.dcm", syntax)
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
                self.encodes((truth[:frames] - 1024).astype("int16"), "a.dcm", what=number)
                self.assertIn(f"a.dcm: {'NumberOfFrames is' if number in ('0', '') else 'its pixels are those of 4 frames, but it says that it has'}",
                              self.messages)
                self.assert_stays("a.dcm", "NumberOfFrames" if syntax != DEFLATED else "a.dcm")
        for number, said in (("5", "in 5 frames have 600"), ("-1", "has -1 frames"), ("2147483647", "has 2147483647 frames"), ("2.5", '"2.5"'), ("4x", '"4x"')):
            self.save("a.dcm", self.frames_as("9876" if number in ("4x", "2.5") else number, truth),
                      *([(b"\x28\0\x08\0IS\x04\x009876", b"\x28\0\x08\0IS\x04\0" + number.ljust(4).encode())] if number in ("4x", "2.5") else []))
            self.assert_refused(65, said, "encode", "a.dcm")
        for padding, is_said in ((b"\0\0", False), (b"\1\0", True), (b"\0\0\0\0", True)):
            file = data_set(truth)
            file.PixelData += padding
            self.save("a.dcm", file)
            info = self.encoded("a.dcm")[1]  # and restores the file
            self.assertEqual((info["restorable"], "more than 10 x 6 samples" in self.messages), (True, is_said), padding)
            run = self.tagrid("encode", "a.dcm", "-o", "lossy.tag", "-f", "--max-error", "5", "--rm")
            self.assertEqual(run.returncode, 64 if is_said else 0, run.stderr)
        file = data_set(truth)
        file.PixelData += b"123456"
        self.save("a.dcm", file)
        self.encoded("a.dcm", says="its pixels have 6 bytes more than 10 x 6 samples of 16 bits in 4 frames")
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

    @unittest.skipIf(shutil.which("gdcmconv") is None, "there is no gdcmconv on this machine (libgdcm-tools)")
    def test_streams_of_other_sizes_than_the_file_says_are_refused(self):
        """DCMTK decodes what a stream of JPEG holds, and fills up what one of RLE lacks."""
        truth = volume(shape=(2, 20, 31))
        for option, stream in (("--jpeg", "the code stream has 31 x 20 samples of 16 bits"), ("--rle", "the RLE stream has")):
            self.save("a.dcm", data_set(truth))
            subprocess.run(["gdcmconv", option, self.folder / "a.dcm", self.folder / "b.dcm"], check=True)
            self.encodes((truth - 1024).astype("int16"), "b.dcm", what=option)
            for attributes in ({"Rows": 40}, {"Rows": 10}, {"Columns": 30}, {"BitsAllocated": 32}, {"BitsAllocated": 8, "BitsStored": 8, "HighBit": 7}):
                file = pydicom.dcmread(self.folder / "b.dcm")
                for name, value in attributes.items():
                    setattr(file, name, value)
                file.save_as(self.folder / "c.dcm")
                self.assertIn(stream, self.assert_refused(65, "c.dcm: DICOM file: frame 1: ", "encode", "c.dcm", "-o", "c.tag"), attributes)
        # A frame that ends too soon.
        frames = list(pydicom.encaps.generate_pixel_data_frame(pydicom.dcmread(self.folder / "b.dcm").PixelData, 2))
        for length in (64, len(frames[1]) // 4 * 2, len(frames[1]) - 4):
            file = self.encapsulate(data_set(truth), RLE, [])
            file.PixelData = pydicom.encaps.encapsulate([frames[0], frames[1][:length]])
            self.save("d.dcm", file)
            self.assert_refused(65, "d.dcm: DICOM file: frame 2: the RLE stream", "encode", "d.dcm", "-o", "d.tag")
        file.PixelData = pydicom.encaps.encapsulate([frames[0], frames[1] + bytes(20)])  # some programs fill up more than others
        self.save("d.dcm", file)
        self.encodes((truth - 1024).astype("int16"), "d.dcm")
        self.save("a.dcm", data_set(truth[0] // 8, BitsAllocated=8, BitsStored=8, HighBit=7))
        subprocess.run(["gdcmconv", "--jpeg", self.folder / "a.dcm", self.folder / "b.dcm"], check=True)
        file = pydicom.dcmread(self.folder / "b.dcm")
        file.BitsAllocated = 16
        file.save_as(self.folder / "c.dcm")
        self.assert_refused(65, "31 x 20 samples of 8 bits in 1 component, but 31 x 20 samples in 16 bits are expected", "encode", "c.dcm")

    @unittest.skipIf(shutil.which("opj_compress") is None, "there is no opj_compress on this machine (libopenjp2-tools)")
    def test_signs_of_jpeg_2000_and_of_the_file_that_differ_are_said_or_refused(self):
        """GDCM takes the sign of the stream, pydicom that of the file."""
        truth = volume()[0].astype("i2")
        truth[0, :2] = -5, 4000
        for is_signed, header, negative in (("s", 1, True), ("u", 1, False), ("s", 0, True), ("s", 0, False), ("u", 0, False)):
            samples = truth if negative else abs(truth) // 2
            (self.folder / "a.raw").write_bytes(samples.astype(">i2").tobytes())
            subprocess.run(["opj_compress", "-i", "a.raw", "-o", "a.j2k", "-n", "1", "-F", f"{samples.shape[1]},{samples.shape[0]},1,16,{is_signed}"],
                           cwd=self.folder, check=True, stdout=subprocess.DEVNULL)
            file = data_set(samples, BitsStored=16, HighBit=15, PixelRepresentation=header, RescaleIntercept=0)
            file.file_meta.TransferSyntaxUID, file.PixelData = J2K, pydicom.encaps.encapsulate([(self.folder / "a.j2k").read_bytes()])
            file["PixelData"].VR, file["PixelData"].is_undefined_length = "OB", True
            self.save("a.dcm", file)
            if negative and header == 0:
                self.assert_refused(65, "the code stream has negative samples", "encode", "a.dcm")
                continue
            numpy.testing.assert_array_equal(self.values("a.dcm")[0][0], samples)
            self.assertEqual("those of its code stream have none" in self.messages, (is_signed, header) == ("u", 1))

    def test_bits_above_those_that_count_are_said(self):
        """pydicom reads them as a part of the number, DCMTK and GDCM do not."""
        said = "only the lowest 12 bits of its samples count, but higher ones are set, too"
        for sample, is_signed, value, is_said in ((0x0fff, 0, 4095, False), (5000, 0, 5000 - 4096, True), (0xffff, 1, -1, False), (0x0fff, 1, -1, False),
                                                  (-3024, 1, -3024 + 4096, True)):
            truth = volume()[:1] // 8
            truth[0, 3, 4] = sample
            self.save("a.dcm", data_set(truth[0], PixelRepresentation=is_signed, RescaleIntercept=0))
            self.assertEqual(self.encoded("a.dcm")[0][0, 3, 4], value)
            self.assertEqual(said in self.messages, is_said, sample)

    @unittest.skipIf(None in map(shutil.which, ("gdcmconv", "dcmcjpls")), "there are no gdcmconv and dcmcjpls on this machine (libgdcm-tools, dcmtk)")
    def test_bits_above_those_that_count_are_said_of_compressed_files(self):
        """The streams have samples of 16 bits, and the files say that 12 of them count."""
        truth = volume(shape=(3, 20, 31)) // 8
        for tool in (["gdcmconv", "--rle"], ["gdcmconv", "--jpeg"], ["dcmcjpls"], ["gdcmconv", "--jpegls"], ["dcmconv", "+td"]):
            for sample, is_said in ((0x0fff, False), (5000, True)):
                truth[1, 3, 4] = sample
                self.save("a.dcm", data_set(truth, BitsStored=16, HighBit=15, RescaleIntercept=0))
                subprocess.run([*tool, self.folder / "a.dcm", self.folder / "b.dcm"], check=True)
                file = pydicom.dcmread(self.folder / "b.dcm")
                file.BitsStored, file.HighBit = 12, 11
                file.save_as(self.folder / "b.dcm")
                run = self.tagrid("encode", "b.dcm", "-o", "b.tag", "-f")
                self.assertEqual((run.returncode, "b.dcm: only the lowest 12 bits of its samples count" in run.stderr), (0, is_said), (tool, run.stderr))
                numpy.testing.assert_array_equal(self.encoded("b.dcm")[0][1, 3, 4], sample & 0xfff)

    def test_slices_that_may_be_of_several_scans_are_said(self):
        truth = volume()
        for attribute, one, other in (("PatientID", "a", "b"), ("StudyInstanceUID", "1.2", "1.3"), ("FrameOfReferenceUID", "1.2", "1.3"),
                                      ("ConvolutionKernel", "B30f", "B70f")):
            for z in range(4):
                self.save(f"s/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", position=(0, 0, z), **{attribute: other if z == 2 else one}))
            self.encoded("s", says=f's: its slices may be of several scans: {attribute} is "{one}" in 0.dcm, and "{other}" in 2.dcm')
            self.save("s/2.dcm", data_set(truth[2], instance="1.2.3.2", position=(0, 0, 2), **{attribute: ""}))
            self.encodes((truth[:4] - 1024).astype("int16"), "s", what=f"without {attribute}")

    def test_texts_are_those_of_pydicom(self):
        self.save("a.dcm", data_set(volume()[0], ImageType=["ORIGINAL", "PRIMARY", "AXIAL"], PatientName="Doe^Jane",
                                    SeriesDescription=r"a\b", ImageComments="two\r\nlines"))
        stored = pydicom.dcmread(self.folder / "a.dcm")
        for pairs in (self.encoded("a.dcm")[1]["source"]["pairs"], self.decoded_pairs()):
            self.assertEqual(pairs["dicom_ImageType"], "\\".join(stored.ImageType))
            self.assertEqual(pairs["dicom_PatientName"], str(stored.PatientName))

    def decoded_pairs(self):
        """Those of the NRRD file that decode writes, read by the rules of the format: \\\\ is a backslash, \\n ends a line."""
        self.ok("encode", "a.dcm", "-fo", "pairs.tag")
        self.ok("decode", "pairs.tag", "-fo", "pairs.nrrd")
        header = (self.folder / "pairs.nrrd").read_bytes().split(b"\n\n")[0].decode()
        pairs = dict(line.split(":=", 1) for line in header.split("\n") if ":=" in line)
        return {key: re.sub(r"\\([n\\])", lambda m: {"n": "\n"}.get(m[1], m[1]), value) for key, value in pairs.items()}

    def test_images_whose_samples_are_no_slice_are_said(self):
        self.save("a.dcm", data_set(volume()[0], ImageType=["ORIGINAL", "PRIMARY", "M", "MOSAIC"]))
        self.encoded("a.dcm", says="its images are mosaics of several slices")
        self.save("a.dcm", data_set(volume()[0], SegmentationType="FRACTIONAL", MaximumFractionalValue=255))
        self.encoded("a.dcm", says="its samples are fractions of MaximumFractionalValue")

    def test_directions_of_rounded_length_do_not_change_distances(self):
        self.save("a.dcm", data_set(volume()[0], position=(1, 2, 3), ImageOrientationPatient=[0.998, 0, 0, 0, 0.996, 0]))
        self.assertEqual(self.encoded("a.dcm")[1]["geometry"]["directions"], [[0.25, 0, 0], [0, 0.5, 0], [0, 0, 3]])

    def test_a_distance_of_frames_that_is_a_guess_is_said(self):
        for attributes, is_said in (({"SpacingBetweenSlices": None}, True), ({}, False)):
            self.save("a.dcm", data_set(volume(), position=(1, 2, 3), **attributes))
            geometry = self.encoded("a.dcm")[1]["geometry"]
            self.assertEqual(geometry["directions"][2], [0, 0, 3])
            self.assertEqual("a.dcm: the distance between its frames is not given; it is taken to be their thickness, 3 mm" in self.messages, is_said)

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

    def assert_as_pydicom(self, path, what=""):
        """The values are those of pydicom, if it can read the file. Returns the exit code, and notes what is said."""
        run = self.tagrid("encode", path, "-o", "out.tag", "-f")
        self.messages = run.stderr
        self.assertIn(run.returncode, (0, 64, 65), run.stderr)
        if run.returncode == 0:
            values, _ = self.values(path)
            file = pydicom.dcmread(self.folder / path)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    truth = apply_modality_lut(file.pixel_array, file)
            except (RuntimeError, NotImplementedError, AttributeError):
                return 0  # it has no decoder for it
            except OverflowError:
                return 0  # pydicom 2.4 with numpy 2: signed samples in JPEG 2000
            numpy.testing.assert_allclose(values, truth.reshape((-1, *truth.shape[-2:])) * file.get("DoseGridScaling", 1), rtol=1e-9, err_msg=f"{path} {what}")
        return run.returncode

    def test_what_is_read_is_what_pydicom_reads(self):
        frames = volume(shape=(2, 6, 10))
        for exit, attributes, said in (
                (0, {}, ""), (0, {"RescaleSlope": "-2.5"}, ""), (0, {"RescaleSlope": "1.0E+01 "}, ""), (0, {"RescaleSlope": "+2.5"}, ""),
                (0, {"RescaleSlope": None, "RescaleIntercept": None}, ""), (0, {"HighBit": None}, ""), (0, {"PixelRepresentation": 1, "BitsStored": 16, "HighBit": 15}, ""),
                (0, {"BitsStored": None, "HighBit": None}, "BitsStored is absent; it is taken as 16"), (0, {"NumberOfFrames": 2}, ""),
                (0, {"SamplesPerPixel": 1, "PlanarConfiguration": 1}, ""), (0, {"WindowCenter": "40"}, ""), (0, {"PixelPaddingValue": 0}, ""),
                (0, {"PresentationLUTShape": "INVERSE"}, "PresentationLUTShape INVERSE"), (0, {"PhotometricInterpretation": "MONOCHROME1"}, "MONOCHROME1"),
                (65, {"PixelRepresentation": 2}, "PixelRepresentation is 2"), (65, {"BitsAllocated": 1, "BitsStored": 1, "HighBit": 0}, "samples of 1 bits"),
                (65, {"BitsAllocated": 12}, "samples of 12 bits"), (65, {"BitsAllocated": 24, "BitsStored": 24, "HighBit": 23}, "samples of 24 bits"),
                (65, {"BitsAllocated": 64, "BitsStored": 64, "HighBit": 63}, "samples of 64 bits"), (65, {"SamplesPerPixel": 3}, "colors"), (65, {"HighBit": 15}, "number 15"),
                (65, {"PixelData": None, "FloatPixelData": frames.astype("<f4").tobytes()}, "FloatPixelData, which is not supported"),
                (65, {"PixelData": None, "DoubleFloatPixelData": frames.astype("<f8").tobytes()}, "DoubleFloatPixelData"), (65, {"PixelData": None}, "its pixels cannot be found")):
            for syntax in (LITTLE, IMPLICIT) if exit == 0 and "RescaleSlope" in attributes else (LITTLE,):
                file = data_set(frames, syntax=syntax)
                for name, value in attributes.items():
                    if value is None:
                        delattr(file, name)
                    else:
                        setattr(file, name, value)
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    self.save("a.dcm", file)
                self.assertEqual(self.assert_as_pydicom("a.dcm", attributes), exit, (attributes, self.messages))
                self.assertIn(said, self.messages)
                if exit == 0 and not said:
                    self.assertEqual(self.messages, "", attributes)

    def test_files_of_pydicom_are_read_as_it_reads_them(self):
        folder = pathlib.Path(pydicom.__file__).parent / "data" / "test_files"
        read = 0
        for path in some(sorted(folder.glob("*.dcm")), 2):
            shutil.copy(path, self.folder / "a.dcm")
            (self.folder / "a.dcm").chmod(0o644)
            read += self.assert_as_pydicom("a.dcm", path.name) == 0
        if not read:
            print("skipped: pydicom's files are not on this machine")

    def test_samples_that_are_no_plain_numbers_are_said_and_stay(self):
        truth = volume()[0]
        table = sequence(LUTDescriptor=[4096, 0, 16], ModalityLUTType="OD", LUTData=numpy.arange(4096, dtype="<u2").tobytes())
        table[0]["LUTDescriptor"].VR, table[0]["LUTData"].VR = "US", "OW"
        for attributes, said in (
                ({"ModalityLUTSequence": table, "RescaleSlope": None, "RescaleIntercept": None}, "by a table (ModalityLUTSequence), which is not applied"),
                ({"RealWorldValueMappingSequence": sequence(RealWorldValueLUTData=[1.0, 4.0])}, "a table of real world values (RealWorldValueLUTData)"),
                ({"RealWorldValueMappingSequence": sequence(RealWorldValueSlope=0.5, RealWorldValueIntercept=1.0)}, "real world values are 0.5 * sample + 1 (Real"),
                ({"PixelPresentation": "MIXED"}, "numbers of colors"), ({"PixelRepresentation": None}, "PixelRepresentation is absent; it is taken as 0"),
                ({"OverlayRows": 4}, "an overlay in bits of its pixels")):
            file = data_set(truth, **{name: value for name, value in attributes.items() if not name.startswith("Overlay")})
            if "OverlayRows" in attributes:
                for element, vr, value in ((0x10, "US", 20), (0x11, "US", 31), (0x40, "CS", "G"), (0x50, "SS", [1, 1]), (0x100, "US", 16), (0x102, "US", 12)):
                    file.add_new((0x6000, element), vr, value)
            self.save("a.dcm", file)
            samples, _ = self.encoded("a.dcm")
            self.assertIn(said, self.messages)
            self.assert_stays("a.dcm", said)
            if "ModalityLUTSequence" in attributes:
                self.assert_same(samples, truth[None].astype("int16"))
                self.assert_refused(64, said, "encode", "a.dcm", "-o", "b.tag", "-f", "--max-error", "5")
        # The same as the slope is nothing new.
        self.save("a.dcm", data_set(truth, RealWorldValueMappingSequence=sequence(RealWorldValueSlope=1.0, RealWorldValueIntercept=-1024.0)))
        self.encoded("a.dcm")
        self.assertEqual(self.messages, "")

    def test_gaps_are_advised_only_where_slices_are_left(self):
        truth = volume(shape=(3, 5, 6))
        for z in range(3):
            self.save(f"s/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", position=(0, 0, z)))
        cut = self.folder / "s" / "1.dcm"
        cut.write_bytes(cut.read_bytes()[:-10])
        self.assertIn("--gaps-ok", self.assert_refused(65, "ends too soon, within its pixels", "encode", "s"))
        self.encodes((truth[[0, 2]] - 1024).astype("int16"), "s", "--gaps-ok")
        for z in (0, 2):
            other = self.folder / "s" / f"{z}.dcm"
            other.write_bytes(other.read_bytes()[:-10])
        self.assertNotIn("--gaps-ok", self.assert_refused(65, "ends too soon, within its pixels", "encode", "s"))
        self.save("a.dcm", data_set(truth))
        (self.folder / "a.dcm").write_bytes((self.folder / "a.dcm").read_bytes()[:-10])
        self.assertNotIn("--gaps-ok", self.assert_refused(65, "ends too soon, within its pixels", "encode", "a.dcm"))


if __name__ == "__main__":
    main()
