"""JPEG 2000: slices that OpenJPEG's own program compresses."""

import shutil
import struct
import subprocess
import unittest

from other_readers import ReaderTest, main, numpy


@unittest.skipIf(numpy is None or shutil.which("opj_compress") is None, "there is no opj_compress on this machine (libopenjp2-tools)")
class Jpeg2000(ReaderTest):
    def compress(self, samples, name, *options, bits=16, signed=False):
        (self.folder / name).parent.mkdir(exist_ok=True)
        samples.astype({8: "u1", 16: ">u2"}[8 if bits <= 8 else 16]).tofile(self.folder / "slice.raw")
        height, width = samples.shape
        run = subprocess.run(["opj_compress", "-i", "slice.raw", "-F", f"{width},{height},1,{bits},{'s' if signed else 'u'}", "-o", name, *options],
                             cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(run.returncode, 0, run.stdout)

    def volume(self, bits, signed=False, shape=(4, 40, 50)):
        low = -(1 << (bits - 1)) if signed else 0
        return numpy.random.default_rng(1).integers(low, low + (1 << bits), shape)

    def test_samples_of_all_kinds(self):
        for bits, signed, type in ((8, False, "uint8"), (8, True, "int8"), (5, False, "uint8"), (16, False, "uint16"), (16, True, "int16"),
                                   (12, False, "uint16"), (12, True, "int16")):
            truth = self.volume(bits, signed)
            for z, slice in enumerate(truth):
                self.compress(slice, f"s/slice{z + 8}.j2k", bits=bits, signed=signed)
            self.encodes(truth.astype(type), "s", what=f"{bits} {signed}")

    def test_files_with_boxes_and_tiles(self):
        truth = self.volume(12)
        for z, slice in enumerate(truth):
            self.compress(slice, f"s/{z}.jp2", "-t", "16,16", "-n", "3", bits=12)
        info = self.encodes(truth.astype("uint16"), "s")
        self.assertNotIn("lossy source", info["source"]["pairs"])
        self.encodes(truth[2:3].astype("uint16"), "s/2.jp2")

    def test_a_loss_is_recorded(self):
        for z, slice in enumerate(self.volume(12)):
            self.compress(slice, f"s/{z}.jp2", "-I", "-r", "10", bits=12)
        info = self.encoded("s")[1]
        self.assertIn("9-7", info["source"]["pairs"]["lossy source"])

    def test_what_is_no_volume_is_refused_by_name(self):
        truth = self.volume(8)
        for z, slice in enumerate(truth):
            self.compress(slice, f"s/{z}.jp2", bits=8)
        self.compress(truth[0][:, :-1], "s/4.jp2", bits=8)
        self.assert_refused(65, "4.jp2: JPEG 2000 file: has 49 x 40 samples of 8 bits", "encode", "s")
        (self.folder / "s" / "4.jp2").unlink()
        (self.folder / "s" / "1.jp2").unlink()
        self.assert_refused(65, "between 0.jp2 and 2.jp2", "encode", "s")
        whole = (self.folder / "s" / "2.jp2").read_bytes()
        (self.folder / "short.jp2").write_bytes(whole[:len(whole) // 2])
        self.assert_refused(65, "short.jp2: ", "encode", "short.jp2")

    def parts(self):
        """A file of one slice: its samples, its boxes before that of the code stream, and the code stream."""
        truth = self.volume(12)[0]
        self.compress(truth, "a.jp2", bits=12)
        whole = (self.folder / "a.jp2").read_bytes()
        at = whole.index(b"jp2c") - 4
        return truth.astype("uint16"), whole[:at], whole[at + 8:]

    def judged(self, name):
        """The samples that opj_decompress gives."""
        run = subprocess.run(["opj_decompress", "-i", name, "-o", "judged.rawl"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(run.returncode, 0, run.stdout)
        return numpy.fromfile(self.folder / "judged.rawl", "<u2").reshape(1, 40, 50)

    def test_boxes_say_their_length_in_three_ways(self):
        truth, boxes, stream = self.parts()
        for head in (struct.pack(">I4s", len(stream) + 8, b"jp2c"), struct.pack(">I4s", 0, b"jp2c"), struct.pack(">I4sQ", 1, b"jp2c", len(stream) + 16)):
            (self.folder / "b.jp2").write_bytes(boxes + head + stream)
            samples, _ = self.encoded("b.jp2")
            self.assert_same(samples[0], truth)
            self.assertEqual(samples.tolist(), self.judged("b.jp2").tolist())
            self.assertNotIn("warning", self.messages)

    def test_bytes_after_the_image_and_further_images_are_said(self):
        truth, boxes, stream = self.parts()
        box = struct.pack(">I4s", len(stream) + 8, b"jp2c") + stream
        for name, content, said in (("b.j2k", stream + b"notes", "b.j2k: 5 bytes follow the samples"), ("b.jp2", boxes + box + b"notes", "b.jp2: 5 bytes follow the samples"),
                                    ("b.jp2", boxes + struct.pack(">I4s", len(stream) + 17, b"jp2c") + stream + bytes(9), "b.jp2: 9 bytes follow the samples"),
                                    ("b.jp2", boxes + box + box, "b.jp2: 1 of 1 files have several images, of which only the first one is read")):
            (self.folder / name).write_bytes(content)
            self.assert_same(self.encoded(name)[0][0], truth)
            self.assertIn(said, self.messages)
        for z in range(3):
            (self.folder / "s").mkdir(exist_ok=True)
            (self.folder / f"s/{z}.j2k").write_bytes(stream + b"notes")
        self.encoded("s", says="0.j2k: 5 bytes follow the samples; they are not part of the volume; likewise in 2 other files")
        # A file that has none of these says nothing.
        (self.folder / "b.j2k").write_bytes(stream)
        self.encoded("b.j2k")
        self.assertNotIn("warning", self.messages)

    def test_a_palette_is_refused(self):
        _, boxes, stream = self.parts()
        at = boxes.index(b"jp2h") - 4
        length = struct.unpack_from(">I", boxes, at)[0]
        colors = b"".join(bytes([255 - i, i, 7]) for i in range(256))
        palette = struct.pack(">I4sHB3B", 8 + 6 + len(colors), b"pclr", 256, 3, 7, 7, 7) + colors
        maps = struct.pack(">I4s", 20, b"cmap") + b"".join(struct.pack(">HBB", 0, 1, i) for i in range(3))
        header = boxes[at:at + length] + palette + maps
        header = struct.pack(">I", len(header)) + header[4:]
        (self.folder / "b.jp2").write_bytes(boxes[:at] + header + boxes[at + length:] + struct.pack(">I4s", 0, b"jp2c") + stream)
        self.assert_refused(65, "b.jp2: JPEG 2000 file: its samples are colors of a palette", "encode", "b.jp2")

    def test_extensions_of_the_standard_are_said(self):
        truth, _, stream = self.parts()
        (self.folder / "b.j2k").write_bytes(stream[:6] + struct.pack(">H", 0x8000) + stream[8:])
        run = self.tagrid("encode", "b.j2k", "-o", "b.tag", "-f")
        self.assertIn(run.returncode, (0, 65))
        if run.returncode == 0:
            self.assertIn("say that they need extensions of JPEG 2000 (part 2)", run.stderr)

    def test_damaged_files_are_errors_or_other_samples_and_no_more(self):
        self.compress(self.volume(12)[0], "a.jp2", bits=12)
        whole = (self.folder / "a.jp2").read_bytes()
        random = numpy.random.default_rng(1)
        for i in range(40):
            broken = bytearray(whole[:random.integers(20, len(whole))] if i % 4 == 0 else whole)
            for _ in range(random.integers(1, 6)):
                broken[random.integers(12, len(broken) if i % 2 else 200)] = random.integers(0, 256)
            (self.folder / "broken.jp2").write_bytes(broken)
            run = self.tagrid("encode", "broken.jp2", "-o", "broken.tag", "-f", "-q")
            self.assertIn(run.returncode, (0, 64, 65, 74), f"{i}: {run.stderr}")

    @unittest.skipIf(shutil.which("ojph_compress") is None, "there is no ojph_compress on this machine (openjph-tools)")
    def test_slices_of_high_throughput_jpeg_2000(self):
        truth = numpy.random.default_rng(1).integers(0, 65536, (3, 20, 31), "uint16")
        (self.folder / "s").mkdir()
        for z, slice in enumerate(truth):
            (self.folder / "a.pgm").write_bytes(b"P5 31 20 65535\n" + slice.astype(">u2").tobytes())
            subprocess.run(["ojph_compress", "-i", "a.pgm", "-o", "a.j2c", "-reversible", "true"], cwd=self.folder, check=True, stdout=subprocess.DEVNULL)
            (self.folder / "a.j2c").rename(self.folder / "s" / f"s{z}.jhc")
        self.encodes(truth, "s")
        self.assertEqual(self.messages, "")


if __name__ == "__main__":
    main()
