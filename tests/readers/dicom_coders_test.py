"""DICOM: High-Throughput JPEG 2000 and JPEG XL, in streams of encoders that this project does not use."""

import re
import shutil
import subprocess
import unittest

from other_readers import Image, ReaderTest, main, numpy, pydicom
from scans import LITTLE, claim, data_set

HT = {"201": "High-Throughput JPEG 2000 (Lossless only)", "202": "High-Throughput JPEG 2000 with RPCL (Lossless only)", "203": "High-Throughput JPEG 2000"}
XL = {"110": "JPEG XL Lossless", "111": "JPEG XL JPEG Recompression", "112": "JPEG XL"}
PREFIX = "1.2.840.10008.1.2.4."


def images(bits, count=3, shape=(37, 50), signed=False):
    """Smooth images with noise, which have the least and the greatest number."""
    y, x = numpy.mgrid[:shape[0], :shape[1]]
    random = numpy.random.default_rng(bits)
    most = (1 << bits) - 1
    volume = numpy.array([numpy.clip((numpy.sin(x / (7 + z)) + numpy.cos(y / 6) + 2) / 4 * most + random.normal(0, 2, shape), 0, most) for z in range(count)]).astype("int64")
    volume[:, 0, :2] = 0, most
    return volume - (1 << (bits - 1)) if signed else volume


@unittest.skipIf(pydicom is None, "there is no pydicom on this machine")
class Coders(ReaderTest):
    def tool(self, *command):
        run = subprocess.run([str(part) for part in command], cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(run.returncode, 0, f"{command}: {run.stdout}")

    def numbers(self, name):
        """Those of a PGM file. Pillow would scale them to 16 bits."""
        content = (self.folder / name).read_bytes()
        head = re.match(rb"P5\s(?:#.*\n)?(\d+)\s(\d+)\s(\d+)\s", content)
        width, height, most = map(int, head.groups())
        return numpy.frombuffer(content, "u1" if most < 256 else ">u2", offset=head.end()).reshape(height, width).astype(int)

    def pgm(self, image, bits):
        head = b"P5 %d %d %d\n" % (image.shape[1], image.shape[0], (1 << bits) - 1)
        (self.folder / "a.pgm").write_bytes(head + image.astype("u1" if bits <= 8 else ">u2").tobytes())

    def ht(self, image, bits, signed=False, options=("-reversible", "true")):
        # The program does not read signed numbers. Those of a stream differ from others by half of their range.
        self.pgm(image + (1 << (bits - 1)) * signed, bits)
        self.tool("ojph_compress", "-i", "a.pgm", "-o", "a.j2c", *options)
        stream = bytearray((self.folder / "a.j2c").read_bytes())
        assert stream[2:4] == b"\xff\x51" and stream[42] == bits - 1
        stream[42] |= 0x80 * signed
        return bytes(stream)

    def xl(self, image, bits, options=("-d", "0")):
        if bits == 12:  # the program wants numbers of 16 bits
            self.pgm((image * 65535 + 2047) // 4095, 16)
            options = (*options, "--override_bitdepth=12")
        else:
            self.pgm(image, bits)
        self.tool("cjxl", "a.pgm", "a.jxl", "--quiet", *options)
        return (self.folder / "a.jxl").read_bytes()

    def write(self, name, volume, streams, syntax, bits, signed=False, fragments=1, table=True, **attributes):
        """A file of many frames, each in some fragments."""
        size = 8 if bits <= 8 else 16
        file = data_set(volume, BitsAllocated=size, BitsStored=bits, HighBit=bits - 1, PixelRepresentation=int(signed), RescaleIntercept=0, **attributes)
        file.PixelData = pydicom.encaps.encapsulate(streams, fragments_per_frame=fragments, has_bot=table)
        file.file_meta.TransferSyntaxUID = PREFIX + "90"  # pydicom does not know all of them
        file["PixelData"].VR, file["PixelData"].is_undefined_length = "OB", True
        self.save(name, file)
        claim(self.folder / name, PREFIX + syntax)

    def loss(self):
        return self.facts.get("source", {}).get("pairs", {}).get("lossy source")

    @unittest.skipIf(shutil.which("ojph_compress") is None, "there is no ojph_compress on this machine (openjph-tools)")
    def test_high_throughput_jpeg_2000_without_a_loss(self):
        for bits, signed in ((8, False), (8, True), (12, False), (12, True), (16, False), (16, True)):
            volume = images(bits, signed=signed)
            streams = [self.ht(image, bits, signed) for image in volume]
            for syntax in HT:
                self.write("a.dcm", volume, streams, syntax, bits, signed, fragments=1 if syntax == "201" else 2, table=syntax != "203")
                type = ("int8" if signed else "uint8") if bits == 8 else "uint16" if bits == 16 and not signed else "int16"
                self.facts = self.encodes(volume.astype(type), "a.dcm", what=(bits, signed, syntax))
                self.assertIsNone(self.loss())
                self.ok("restore", "out.tag", "-o", "back", "-f")
                back = pydicom.dcmread(self.folder / "back" / "a.dcm")
                self.assertEqual(back.file_meta.TransferSyntaxUID, LITTLE)
                numpy.testing.assert_array_equal(back.pixel_array, volume)

    @unittest.skipIf(shutil.which("ojph_compress") is None, "there is no ojph_compress on this machine (openjph-tools)")
    def test_a_lossy_stream_of_high_throughput_jpeg_2000_is_known(self):
        volume = images(12)
        streams = [self.ht(image, 12, options=("-qstep", "0.002")) for image in volume]
        for number, stream in enumerate(streams):
            (self.folder / f"{number}.j2c").write_bytes(stream)
            self.tool("ojph_expand", "-i", f"{number}.j2c", "-o", f"{number}.pgm")
        self.write("a.dcm", volume, streams, "203", 12)
        samples, self.facts = self.encoded("a.dcm")
        self.assertEqual(self.loss(), "DICOM")
        for number, image in enumerate(samples):
            # The wavelet has rounded numbers, so two decoders may differ by one.
            self.assertLessEqual(abs(self.numbers(f"{number}.pgm") - image).max(), 1)

    @unittest.skipIf(shutil.which("cjxl") is None, "there is no cjxl on this machine (libjxl-tools)")
    def test_jpeg_xl_without_a_loss(self):
        for bits in (8, 12, 16):
            volume = images(bits)
            for options in (("-d", "0"), ("-d", "0", "--container=1"), ("-d", "0", "-e", "3")):
                streams = [self.xl(image, bits, options) for image in volume]
                for syntax in ("110", "112"):
                    # What may be lossy must say that it is not.
                    said = {"LossyImageCompression": "00"} if syntax == "112" else {}
                    self.write("a.dcm", volume, streams, syntax, bits, fragments=2 if syntax == "112" else 1, table=syntax != "112", **said)
                    self.facts = self.encodes(volume.astype({8: "uint8", 12: "int16", 16: "uint16"}[bits]), "a.dcm", what=(bits, options, syntax))
                    self.assertIsNone(self.loss())
        self.write("a.dcm", volume, streams, "112", 16)
        self.assertEqual(self.encoded("a.dcm")[1]["source"]["pairs"]["lossy source"], "DICOM")

    @unittest.skipIf(None in map(shutil.which, ("cjxl", "djxl")), "there are no cjxl and djxl on this machine (libjxl-tools)")
    def test_lossy_jpeg_xl_is_what_djxl_decodes(self):
        for bits in (8, 12, 16):
            volume = images(bits)
            streams = [self.xl(image, bits, ("-d", "1")) for image in volume]
            for syntax in XL:
                self.write("a.dcm", volume, streams, syntax, bits)
                samples, self.facts = self.encoded("a.dcm")
                self.assertEqual(self.loss(), "DICOM", syntax)
            for stream, image, source in zip(streams, samples, volume):
                self.assertLess(abs(image.astype(int) - source).mean(), 0.03 * (1 << bits))
                if bits == 12:  # which the program refuses to write
                    continue
                (self.folder / "b.jxl").write_bytes(stream)
                self.tool("djxl", "b.jxl", "b.pgm", "--quiet")
                self.assertLessEqual(abs(self.numbers("b.pgm") - image).max(), 1, bits)

    @unittest.skipIf(shutil.which("cjxl") is None, "there is no cjxl on this machine (libjxl-tools)")
    def test_a_jpeg_in_jpeg_xl(self):
        volume = images(8)
        streams = []
        for image in volume:
            Image.fromarray(image.astype("uint8")).save(self.folder / "a.jpg", quality=95)
            self.tool("cjxl", "a.jpg", "a.jxl", "--quiet")
            streams.append((self.folder / "a.jxl").read_bytes())
        self.write("a.dcm", volume, streams, "111", 8)
        samples, self.facts = self.encoded("a.dcm")
        self.assertEqual(self.loss(), "DICOM")
        self.assertLess(abs(samples.astype(int) - volume).max(), 24)

    @unittest.skipIf(shutil.which("cjxl") is None, "there is no cjxl on this machine (libjxl-tools)")
    def test_a_sign_that_jpeg_xl_has_not_is_said(self):
        volume = images(16)
        self.write("a.dcm", volume, [self.xl(image, 16) for image in volume], "110", 16, signed=True)
        self.encodes(volume.astype("uint16").view("int16"), "a.dcm", says="those of its code stream have none")

    @unittest.skipIf(None in map(shutil.which, ("ojph_compress", "cjxl")), "there are no ojph_compress and cjxl on this machine")
    def test_broken_streams_are_refused(self):
        volume = images(12)
        for syntax, make in (("201", lambda image: self.ht(image, 12)), ("110", lambda image: self.xl(image, 12))):
            streams = [make(image) for image in volume]
            good = streams[1]
            for broken, said in ((good[:len(good) // 2], "frame 2"), (good[:20], "frame 2"), (b"\xff\x0a" + bytes(500), "frame 2"), (bytes(500), "frame 2"),
                                 (make(volume[1][:30]), "50 x 30 samples, but 50 x 37 are expected"), (make(volume[1][:, :20]), "20 x 37 samples, but 50 x 37")):
                self.write("a.dcm", volume, [streams[0], broken, streams[2]], syntax, 12)
                message = self.assert_refused(65, said, "encode", "a.dcm", "-o", "a.tag")
                self.assertIn("a.dcm", message)
                self.assertFalse((self.folder / "a.tag").exists())
            random = numpy.random.default_rng(1)
            for _ in range(20):  # changed bytes may give other samples, but nothing worse
                bytes_ = bytearray(good)
                for at in random.integers(2, len(good), 4):
                    bytes_[at] = random.integers(0, 256)
                self.write("a.dcm", volume, [streams[0], bytes(bytes_), streams[2]], syntax, 12)
                self.assertIn(self.tagrid("encode", "a.dcm", "-o", "b.tag", "-f").returncode, (0, 65))
        # A stream of colors, and of more bits than a sample has.
        Image.fromarray(numpy.random.default_rng(1).integers(0, 256, (37, 50, 3), "uint8")).save(self.folder / "a.png")
        self.tool("cjxl", "a.png", "a.jxl", "-d", "0", "--quiet")
        self.write("a.dcm", volume, [(self.folder / "a.jxl").read_bytes()] * 3, "110", 12)
        self.assert_refused(65, "has several components, not one", "encode", "a.dcm")
        volume = images(12)
        self.write("a.dcm", volume, [self.xl(image, 16) for image in volume], "110", 12)
        self.encodes(volume.astype("int16"), "a.dcm", what="streams of 16 bits, of which 12 count")
        wide = images(16)
        self.write("a.dcm", volume // 16, [self.xl(image, 16) for image in wide], "110", 8)
        self.assert_refused(65, "the code stream has 16 bits, but a sample has 8", "encode", "a.dcm")


if __name__ == "__main__":
    main()
