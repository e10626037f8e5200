"""MetaImage: files as MetaIO writes them, and the geometry that ITK reads from them (through plastimatch)."""

import itertools
import shutil
import subprocess
import unittest
import zlib

from other_readers import PROGRAM, ReaderTest, main, numpy, random_samples, some

TYPES = {"MET_UCHAR": "uint8", "MET_CHAR": "int8", "MET_USHORT": "uint16", "MET_SHORT": "int16", "MET_UINT": "uint32",
         "MET_INT": "int32", "MET_ULONG": "uint32", "MET_LONG": "int32", "MET_FLOAT": "float32", "MET_DOUBLE": "float64"}
MATRIX = "0.96 0.28 0 -0.28 0.96 0 0 0 1"


def volume(type, shape=(7, 19, 23)):
    return random_samples(type, shape)


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class MetaImage(ReaderTest):
    def write(self, name, samples, type, data=b"", file="LOCAL", sign=" = ", **fields):
        """A header, and `data` behind it."""
        fields = {"ObjectType": "Image", "NDims": samples.ndim, "BinaryData": "True", "DimSize": " ".join(map(str, samples.shape[::-1])),
                  "ElementType": type, **fields, "ElementDataFile": file}
        text = "".join(f"{key}{sign}{value}\n" for key, value in fields.items())
        (self.folder / name).write_bytes(text.encode() + data)
        return name

    def test_every_type_byte_order_and_kind_of_file(self):
        for (met, type), msb, packed, is_pair in some(
                itertools.product(TYPES.items(), (False, True), (False, True), (False, True)), 3):
            truth = volume(type)
            data = truth.astype(truth.dtype.newbyteorder(">" if msb else "<")).tobytes()
            data = zlib.compress(data) if packed else data
            fields = {"ElementByteOrderMSB": msb, "CompressedData": packed, "CompressedDataSize": len(data)}
            if is_pair:
                (self.folder / "data.raw").write_bytes(data)
                name = self.write("a.mhd", truth, met, file="data.raw", **fields)
            else:
                name = self.write("a.mha", truth, met, data, **fields)
            self.encodes(truth, name, what=f"{met} {fields} {is_pair}")

    def test_a_pipe_gives_the_same_file(self):
        truth = volume("int16")
        for packed in (False, True):
            data = zlib.compress(truth.tobytes()) if packed else truth.tobytes()
            name = self.write("a.mha", truth, "MET_SHORT", data, CompressedData=packed)
            self.encoded(name)
            self.encoded(name, "--strip")
            run = subprocess.run(f"cat {name} | {PROGRAM} encode --strip -q - | cmp - out.tag", shell=True,
                                 cwd=self.folder)
            self.assertEqual(run.returncode, 0)

    def test_slices_in_many_files(self):
        truth = volume("int16", (12, 20, 30))
        for z in range(12):
            (self.folder / f"s{z + 1:03}.raw").write_bytes(b"head" + truth[z].tobytes())
        (self.folder / "list").write_bytes(b"")
        for file in ("s%03d.raw 1 12 1", "LIST\n" + "\n".join(f"s{z + 1:03}.raw" for z in range(12)), "LIST 2\n" + "\n".join(
                f"s{z + 1:03}.raw" for z in range(12))):
            for size in (4, -1):
                name = self.write("a.mhd", truth, "MET_SHORT", file=file, HeaderSize=size)
                self.encodes(truth, name, what=file)
        two = truth.reshape(2, 6 * 20 * 30)
        for i in range(2):
            (self.folder / f"part{i}").write_bytes(two[i].tobytes())
        self.encodes(truth, self.write("a.mhd", truth, "MET_SHORT", file="LIST 3\npart0\npart1"))

    def test_geometry(self):
        truth = volume("int16")
        fields = {"ElementSpacing": "0.5 0.25 2", "Offset": "-10 20.5 30", "TransformMatrix": MATRIX, "DistanceUnits": "mm",
                  "Modality": "MET_MOD_CT"}
        info = self.encoded(self.write("a.mha", truth, "MET_SHORT", truth.tobytes(), **fields))[1]
        geometry = info["geometry"]
        self.assertEqual(geometry["space"], "left-posterior-superior")
        self.assertEqual(geometry["origin"], [-10, 20.5, 30])
        numpy.testing.assert_allclose(geometry["directions"], [[0.48, 0.14, 0], [-0.07, 0.24, 0], [0, 0, 2]], atol=1e-12)
        self.assertEqual(info["source"]["pairs"], {"metaimage_DistanceUnits": "mm", "metaimage_Modality": "MET_MOD_CT"})
        if shutil.which("plastimatch") is None:
            print("not compared with ITK: there is no plastimatch on this machine")
            return
        run = subprocess.run(["plastimatch", "convert", "--input", "a.mha", "--output-img", "itk.nrrd"], cwd=self.folder,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(run.returncode, 0, run.stdout)
        itk = self.encodes(truth, "itk.nrrd")
        numpy.testing.assert_allclose(itk["geometry"]["directions"], geometry["directions"], atol=1e-6)
        numpy.testing.assert_allclose(itk["geometry"]["origin"], geometry["origin"], atol=1e-6)
        self.assertEqual(itk["geometry"]["space"], geometry["space"])

    def test_spellings_of_others(self):
        truth = volume("uint8")
        for fields in ({"Position": "1 2 3"}, {"Origin": "1 2 3", "ElementSize": "1 1 1"}, {"Offset": "1 2 3", "Rotation": "1 0 0 0 1 0 0 0 1"}):
            for sign in (" = ", "=", ": "):
                name = self.write("a.mha", truth, "MET_UCHAR", truth.tobytes(), sign=sign, **fields)
                info = self.encodes(truth, name)
                self.assertEqual(info["geometry"]["origin"], [1, 2, 3])

    def test_one_of_several_volumes(self):
        truth = volume("int16", (3, 7, 8, 9))
        for packed in (False, True):
            data = zlib.compress(truth.tobytes()) if packed else truth.tobytes()
            name = self.write("a.mha", truth, "MET_SHORT", data, CompressedData=packed)
            self.assert_refused(64, "--series", "estimate", name)
            for i in range(3):
                self.encodes(truth[i], name, "--series", i + 1)

    def test_several_volumes_in_several_files_are_refused_for_that_reason_alone(self):
        truth = volume("int16", (3, 7, 8, 9))
        for slices in (7, 6):  # which can be divided by the number of files, or not
            name = self.write("a.mhd", truth[:, :slices], "MET_SHORT", file="t%d.raw 1 3 1")
            message = self.assert_refused(65, "3 volumes in several files are not supported; write a header for each volume", "encode", name)
            self.assertNotIn("equal parts", message)
            self.assertNotIn("compressed", message)
        name = self.write("a.mhd", truth[0, :6], "MET_SHORT", file="t%d.raw 1 3 1", CompressedData=True)
        self.assertNotIn("volumes", self.assert_refused(65, "several files with compressed samples are not supported",
                                                        "encode", name))

    def test_what_is_no_volume_is_refused_by_name(self):
        truth = volume("int16")
        for fields, text in (({"ElementNumberOfChannels": 3}, "ElementNumberOfChannels"), ({"BinaryData": "False"}, "BinaryData"),
                             ({"ElementType": "MET_LONG_LONG"}, "MET_LONG_LONG"), ({"DimSize": "1 2"}, "DimSize"),
                             ({"DimSize": "1 2 0"}, "DimSize"), ({"NDims": 7}, "NDims"), ({"ObjectType": "Tube"}, "Tube"),
                             ({"HeaderSize": -2}, "HeaderSize"), ({"HeaderSize": -1}, "HeaderSize"), ({"HeaderSize": "x"}, "HeaderSize"),
                             ({"DimSize": "1 2 -1"}, "DimSize"), ({"NDims": 3.5}, "NDims"), ({"ElementType": "MET_UCHAR_ARRAY"}, "ARRAY"),
                             ({"DimSize": "3000000000 3000000000 3000000000"}, "memory")):
            name = self.write("a.mha", truth, fields.pop("ElementType", "MET_SHORT"), truth.tobytes(), **fields)
            self.assert_refused(65, text, "encode", name)
        for file in ("missing.raw", "/dev/zero", "-", "%03d.raw 1 9 0", "LIST\na\nb", "."):
            name = self.write("a.mhd", truth, "MET_SHORT", file=file)
            run = self.tagrid("encode", name)
            self.assertIn(run.returncode, (65, 74), file)
        self.write("a.mha", truth, "MET_SHORT", truth.tobytes()[:-1])
        self.assert_refused(65, "a.mha: ", "encode", "a.mha")
        self.write("a.mha", truth, "MET_SHORT", zlib.compress(truth.tobytes())[:-3], CompressedData=True)
        self.assert_refused(65, "a.mha: ", "encode", "a.mha")
        self.write("a.mha", truth, "MET_SHORT", truth.tobytes() + b"xyz")
        self.encodes(truth, "a.mha", says="3 bytes follow the samples")
        # Single bytes have no order.
        truth = volume("uint8", (5, 7, 9))
        self.write("a.mha", truth, "MET_UCHAR", truth.tobytes(), BinaryDataByteOrderMSB="False", ElementByteOrderMSB="True")
        self.encodes(truth, "a.mha")

    @unittest.skipIf(shutil.which("plastimatch") is None, "there is no plastimatch on this machine")
    def test_odd_headers_are_refused_or_read_as_itk_does(self):
        truth = volume("int16", (5, 7, 9))
        self.write("a.mha", truth, "MET_SHORT", truth.tobytes(), BinaryDataByteOrderMSB="False", ElementByteOrderMSB="True")
        self.assert_refused(65, "contradicts BinaryDataByteOrderMSB", "encode", "a.mha")
        compared = 0
        for fields in ({"ElementSpacing": "0.5 -0.6 2.5"}, {"ElementSpacing": "0.5 -0.6 2.5", "TransformMatrix": MATRIX, "Offset": "1 2 3"},
                       {"ElementSpacing": "0.5 0 2.5"}, {"ElementSpacing": "0,5 0,6 2,5"}, {"ElementSpacing": "0.5 0.6"}, {"ElementSpacing": "0.5 0.6 nan"},
                       {"ElementSize": "0.5 0.6 2.5"}, {"ElementSize": "9 9 9", "ElementSpacing": "0.5 0.6 2.5"}, {"TransformMatrix": "1 0 0 1 0 0 0 0 1"},
                       {"Offset": "1 2"}, {"Offset": "1 x 3"}, {"CompressedData": "False", "CompressedDataSize": "-1"}, {"HeaderSize": "0"},
                       {"CenterOfRotation": "5 5 5", "Offset": "1 2 3"}, {"AnatomicalOrientation": "RAI", "Offset": "1 2 3"},
                       {"ElementToIntensityFunctionSlope": "0"}, {"BinaryDataByteOrderMSB": "False"}, {"ElementByteOrderMSB": "True"}, {"ElementNumberOfChannels": "1"}):
            with self.subTest(fields):
                for file in self.folder.glob("*.nrrd"):
                    file.unlink()
                self.write("a.mha", truth, "MET_SHORT", truth.tobytes(), **fields)
                ours = self.ok("encode", "a.mha", "-o", "a.tag", "-f")
                run = subprocess.run(["plastimatch", "convert", "--input", "a.mha", "--output-img", "itk.nrrd"], cwd=self.folder, capture_output=True)
                if run.returncode or not (self.folder / "itk.nrrd").exists():
                    self.assertIn("warning", ours.stderr)
                    continue
                info = self.info("a.tag")
                self.ok("decode", "a.tag", "-o", "ours.raw", "-f")
                samples, itk = self.encoded("itk.nrrd")
                self.assertEqual((self.folder / "ours.raw").read_bytes(), samples.tobytes())
                compared += 1
                if "warning" in ours.stderr:
                    continue  # ITK has a number where nobody knows one
                directions = info["geometry"]["directions"]
                if directions is None:
                    directions = numpy.diag(info["geometry"]["spacing"] or (1, 1, 1))
                numpy.testing.assert_allclose(directions, itk["geometry"]["directions"], atol=1e-6)
        self.assertGreater(compared, 10)

    def test_samples_are_told_of_their_header(self):
        truth = volume("int16")
        (self.folder / "a.raw").write_bytes(truth.tobytes())
        self.write("a.mhd", truth, "MET_SHORT", file="a.raw")
        self.assertNotIn("--dims", self.assert_refused(65, "a.mhd describes its samples; give that file", "encode", "a.raw"))
        self.encodes(truth, "a.mhd")
        # The header of other samples is none.
        self.write("a.mhd", truth, "MET_SHORT", file="b.raw")
        (self.folder / "b.raw").write_bytes(truth.tobytes())
        self.assert_refused(65, "describe them with --dims and --type", "encode", "a.raw")
        self.encodes(truth, "a.raw", "--dims", "23,19,7", "--type", "int16")
        (self.folder / "b.raw").write_bytes(truth.tobytes()[:-1])
        message = self.assert_refused(65, f"{truth.nbytes - 1} are present", "encode", "b.raw", "--dims", "23,19,7", "--type", "int16")
        self.write("b.mhd", truth, "MET_SHORT", file="b.raw")
        self.assertNotIn("--dims", self.assert_refused(65, f"b.mhd next to it cannot be read: b.raw: {truth.nbytes} bytes", "encode", "b.raw"))


if __name__ == "__main__":
    main()
