"""The same fault has the same verdict in every format: a table of formats and faults, which is that of docs/formats.md. The
tests of DICOM, TIFF, HDF5 and BMP have these faults among those of their own."""

import gzip
import shutil
import struct
import subprocess
import sys
import unittest

from other_readers import PROGRAM, ReaderTest, main, numpy

DIMS = (9, 7, 5)
SIZE = 2 * 9 * 7 * 5
NAN = float("nan")


def volume():
    """An array [z, y, x]."""
    return (numpy.arange(9 * 7 * 5) * 7 - 900).astype("<i2").reshape(5, 7, 9)


def words(values):
    return " ".join(map(str, values))


class Case:
    """A volume of one format: what its header says, and bytes of samples. `says` are texts where the format has texts."""

    def __init__(self, data=None, spacing=("0.5", "0.6", "2.5"), origin=("10", "12", "-30"),
                 directions=((1, 0, 0), (0, 1, 0), (0, 0, 1)), slope=None, intercept=None):
        self.data = volume().tobytes() if data is None else data
        self.spacing, self.origin, self.directions, self.slope, self.intercept = spacing, origin, directions, slope, intercept


def nrrd_header(case, last):
    lines = ["NRRD0005", "type: short", "dimension: 3", "sizes: 9 7 5", "encoding: raw", "endian: little"]
    if case.origin is None:
        lines.append("spacings: " + words(case.spacing))
    else:
        vectors = [[number * float(spacing) for number in vector] for spacing, vector in zip(case.spacing, case.directions)]
        lines += ["space: left-posterior-superior", "space directions: " + " ".join("(%s)" % ",".join(map(str, vector)) for vector in vectors),
                  "space origin: (%s)" % ",".join(case.origin)]
    lines += [f"rescale_slope:={case.slope}"] * (case.slope is not None) + [f"rescale_intercept:={case.intercept}"] * (case.intercept is not None)
    return "\n".join(lines + [last]).encode() + b"\n"


def meta_image_header(case, file):
    fields = {"ObjectType": "Image", "NDims": 3, "BinaryData": "True", "ElementSpacing": words(case.spacing), "DimSize": "9 7 5"}
    if case.origin is not None:
        fields |= {"Offset": words(case.origin), "TransformMatrix": " ".join(words(vector) for vector in case.directions)}
    if case.slope is not None:
        fields["ElementToIntensityFunctionSlope"] = case.slope
    if case.intercept is not None:
        fields["ElementToIntensityFunctionOffset"] = case.intercept
    return "".join(f"{key} = {value}\n" for key, value in (fields | {"ElementType": "MET_SHORT", "ElementDataFile": file}).items()).encode()


def nifti_header(case, magic):
    header = bytearray(352)
    spacing = [float(text) for text in case.spacing]
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, 9, 7, 5, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 4, 16)
    struct.pack_into("<8f", header, 76, 1, *spacing, 0, 0, 0, 0)
    struct.pack_into("<3f", header, 108, 352 if magic == b"n+1\0" else 0, float(case.slope or 0), float(case.intercept or 0))
    header[123] = 2
    if case.origin is not None:
        struct.pack_into("<2h", header, 252, 0, 1)
        for row in range(3):
            struct.pack_into("<4f", header, 280 + 16 * row, *(case.directions[axis][row] * spacing[axis] for axis in range(3)), float(case.origin[row]))
    header[344:348] = magic
    return bytes(header)


def vgi_header(case):
    return ("{volume1}\n[representation]\nsize = 9 7 5\ndatatype = signed integer\nbitsperelement = 16\n"
            "[file1]\nFileFormat = raw\nSize = 9 7 5\nName = a.vol\nDatatype = signed integer\nBitsPerElement = 16\n"
            f"{{volumeprimitive1}}\n[geometry]\nresolution = {words(case.spacing)}\nunit = mm\n").encode()


def npy_header(case):
    return b"\x93NUMPY\1\0" + struct.pack("<H", 64) + b"{'descr': '<i2', 'fortran_order': False, 'shape': (5, 7, 9), }".ljust(63) + b"\n"


def mrc_header(case):
    header = bytearray(1024)
    struct.pack_into("<10i", header, 0, 9, 7, 5, 1, 0, 0, 0, 9, 7, 5)
    struct.pack_into("<3f", header, 40, *(float(text) * size for text, size in zip(case.spacing, DIMS)))
    header[208:216] = b"MAP DD\0\0"
    return bytes(header)


def edf_header(case):
    fields = "HeaderID = EH:000001:000000:000000 ;\nByteOrder = LowByteFirst ;\nDataType = SignedShort ;\nDim_1 = 9 ;\nDim_2 = 7 ;\nDim_3 = 5 ;\n"
    return ("{\n" + fields + "".join(f"PSize_{axis + 1} = {text} ;\n" for axis, text in enumerate(case.spacing))).encode().ljust(510) + b"}\n"


def vff_header(case):
    return f"ncaa\nrank=3;\nsize=9 7 5;\nbits=16;\nspacing={words(case.spacing)};\nelementsize=1;\n\f\n".encode()


def pyhst_header(case):
    return b"NUM_X = 9\nNUM_Y = 7\nNUM_Z = 5\nvoxelSize = 1\nDATA_TYPE = int16\n"


AMIRA = b"# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\ndefine Lattice 9 7 5\nParameters { BoundingBox 0 4 0 3.6 0 10 }\nLattice { short Data } @1\n@1\n"


def swapped(samples):
    """Complete samples in the other byte order; what follows them stays as it is."""
    array = numpy.frombuffer(samples[:SIZE // 2 * 2], "<i2", min(len(samples), SIZE) // 2)
    return array.astype(">i2").tobytes() + samples[2 * len(array):]


# The files of a case in each format, of which the first one is read. NIfTI, MRC and the scanner's formats with binary numbers
# say no texts; VGStudio, EDF and VFF say neither directions nor a slope here.
ALL = {"NRRD, attached": lambda case: {"a.nrrd": nrrd_header(case, "") + case.data},
       "NRRD, detached": lambda case: {"a.nhdr": nrrd_header(case, "data file: a.raw"), "a.raw": case.data},
       "MetaImage .mha": lambda case: {"a.mha": meta_image_header(case, "LOCAL") + case.data},
       "MetaImage .mhd": lambda case: {"a.mhd": meta_image_header(case, "a.raw"), "a.raw": case.data},
       "NIfTI .nii": lambda case: {"a.nii": nifti_header(case, b"n+1\0") + case.data},
       "NIfTI .nii.gz": lambda case: {"a.nii.gz": gzip.compress(nifti_header(case, b"n+1\0") + case.data)},
       "NIfTI .hdr": lambda case: {"a.hdr": nifti_header(case, b"ni1\0"), "a.img": case.data},
       "VGStudio": lambda case: {"a.vgi": vgi_header(case), "a.vol": case.data},
       "NumPy": lambda case: {"a.npy": npy_header(case) + case.data},
       "MRC": lambda case: {"a.mrc": mrc_header(case) + case.data},
       "EDF": lambda case: {"a.edf": edf_header(case) + case.data},
       "VFF": lambda case: {"a.vff": vff_header(case) + swapped(case.data)},
       "PyHST": lambda case: {"a.vol.info": pyhst_header(case), "a.vol": case.data},
       "AmiraMesh": lambda case: {"a.am": AMIRA + case.data},
       "raw": lambda case: {"a.raw": case.data}}
OPTIONS = {"raw": ["--dims", "9,7,5", "--type", "int16"]}
TEXTS = ["NRRD, attached", "NRRD, detached", "MetaImage .mha", "MetaImage .mhd", "VGStudio", "VFF"]
NUMBERS = ["NIfTI .nii", "NIfTI .nii.gz", "NIfTI .hdr"]
PLACED = TEXTS[:4] + NUMBERS


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Verdicts(ReaderTest):
    def each(self, names, case):
        """Writes the case in each format, and gives the arguments that read it."""
        for name in names:
            for file in self.folder.iterdir():
                shutil.rmtree(file) if file.is_dir() else file.unlink()
            files = ALL[name](case)
            for file, content in files.items():
                (self.folder / file).write_bytes(content)
            try:
                yield name, [next(iter(files)), *OPTIONS.get(name, [])]
            except GeneratorExit:
                print(f"wrong for {name}", file=sys.stderr)
                raise

    def read(self, arguments):
        return self.encodes(volume(), *arguments)

    def assert_said(self, *texts):
        for text in texts:
            self.assertIn(text, self.messages)

    def test_what_has_no_fault_has_no_warning(self):
        for _, arguments in self.each(ALL, Case()):
            info = self.read(arguments)
            self.assertNotIn("warning", self.messages)
            self.assertTrue(info["restorable"] or arguments[0].endswith(".gz"))

    def test_a_pipe_gives_the_same_samples_and_a_search_lists_the_file(self):
        for name, arguments in self.each(ALL, Case()):
            if name != "raw":
                self.assertIn(arguments[0], self.search(".").stdout, name)
            content = (self.folder / arguments[0]).read_bytes()
            if name == "EDF":
                run = subprocess.run([PROGRAM, "encode", "-", "-o", "a.tag"], cwd=self.folder, input=content, capture_output=True)
                self.assertEqual(run.returncode, 64)
                self.assertIn(b"is an EDF file, which can only be read from a file", run.stderr)
            elif len(content) > SIZE or name == "raw" or arguments[0].endswith(".gz"):
                for data, code in ((content, 0), (content[:-1], 65)):
                    run = subprocess.run([PROGRAM, "encode", "-", *arguments[1:], "-o", "a.tag", "-f"], cwd=self.folder, input=data,
                                         capture_output=True)
                    self.assertEqual(run.returncode, code, (name, run.stderr))
                self.ok("decode", "a.tag", "-o", "a.raw", "--samples", "-f")
                self.assertEqual((self.folder / "a.raw").read_bytes(), volume().tobytes(), name)

    def test_bytes_after_the_samples_are_said_and_come_back(self):
        case = Case(volume().tobytes() + b"notes")
        for name, arguments in self.each(ALL, case):
            if name == "raw":  # nothing but the size tells that the description is right
                self.assert_refused(65, f"{SIZE} bytes of samples are expected (9 x 7 x 5 int16), but {SIZE + 5} are present",
                                    "encode", *arguments, "-o", "a.tag")
            else:
                info = self.read(arguments)  # which restores the files
                self.assert_said("5 bytes follow the samples")
                self.assertTrue(info["restorable"] or name == "NIfTI .nii.gz")
                if name == "NIfTI .nii.gz":
                    self.ok("restore", "out.tag", "-o", "back")
                    self.assertEqual((self.folder / "back" / "a.nii").read_bytes(), gzip.decompress((self.folder / "a.nii.gz").read_bytes()))

    def test_slices_after_the_samples_may_be_meant_and_are_not_removed_after_a_loss(self):
        for name, arguments in self.each([name for name in ALL if name != "raw"], Case(volume().tobytes() + volume()[0].tobytes())):
            run = self.tagrid("encode", *arguments, "--max-error", "5", "--rm")
            self.assertNotEqual(run.returncode, 0)
            # What is compressed would come back in another form, too, but that is the weaker reason.
            self.assertIn("126 bytes follow the samples", run.stderr)
            self.assertTrue((self.folder / arguments[0]).exists())
            self.read(arguments)
            self.assert_said("126 bytes follow the samples")

    def test_bytes_that_are_missing_are_refused_with_both_sizes(self):
        for name, arguments in self.each(ALL, Case(volume().tobytes()[:-1])):
            message = self.assert_refused(65, f"{SIZE}", "encode", *arguments, "-o", "a.tag")
            if name in ("VGStudio", "PyHST"):
                self.assertIn(f"has {SIZE - 1} bytes", message)
            else:
                self.assertIn(f"{SIZE - 1}", message)
            self.assertFalse((self.folder / "a.tag").exists())

    def test_a_spacing_with_a_decimal_comma_is_read_and_said(self):
        for name, arguments in self.each(TEXTS, Case(spacing=("0,5", "0,6", "2,5"), origin=None)):
            self.assertEqual(self.read(arguments)["geometry"]["spacing"], [0.5, 0.6, 2.5])
            self.assert_said("0,5", "comma")

    def test_a_spacing_that_cannot_be_read_is_said_and_unknown(self):
        for text in ("inf", "nan", "0", "x", "1,024"):
            binary = text in ("inf", "nan", "0")
            for name, arguments in self.each(TEXTS + NUMBERS * binary, Case(spacing=("0.5", text, "2.5"), origin=None)):
                spacing = self.read(arguments)["geometry"]["spacing"]
                self.assertEqual(spacing, [0.5, None, 2.5])
                if text != "nan" or not name.startswith("NRRD"):  # in NRRD, nan is the word for what is unknown
                    self.assert_said(text, "unknown")
        for name, arguments in self.each(TEXTS, Case(spacing=("0.5", "0.6"), origin=None)):
            self.assertIsNone(self.read(arguments)["geometry"]["spacing"])
            self.assert_said("0.5 0.6", "must be 3 numbers")

    def test_a_negative_spacing_mirrors_or_is_said(self):
        for name, arguments in self.each(TEXTS + NUMBERS, Case(spacing=("0.5", "-0.6", "2.5"), origin=None)):
            geometry = self.read(arguments)["geometry"]
            spacing = geometry["spacing"]
            if name.startswith("NRRD"):
                self.assertEqual(spacing, [0.5, -0.6, 2.5])
            elif name.startswith("MetaImage"):
                self.assertEqual(geometry["directions"], [[0.5, 0, 0], [0, -0.6, 0], [0, 0, 2.5]])
            elif name.startswith("NIfTI"):
                self.assertEqual(spacing, [0.5, numpy.float32(0.6), 2.5])
                self.assert_said("pixdim[2]", "-0.6")
            else:
                self.assertEqual(spacing, [0.5, None, 2.5])
                self.assert_said("-0.6", "unknown")

    def test_directions_that_span_no_volume_are_said_and_left_out(self):
        for directions in (((1, 0, 0), (1, 0, 0), (0, 0, 1)), ((1, 0, 0), (0, 1, 0), (0, 0, 0))):
            for name, arguments in self.each(PLACED, Case(directions=directions)):
                self.assertTrue(self.is_without_directions(self.read(arguments)["geometry"]))
                self.assert_said("not span a volume")

    def is_without_directions(self, geometry):
        """True as well where unit vectors stand for unknown ones, because there is an origin."""
        if geometry["directions"] is None:
            return True
        matrix = numpy.array(geometry["directions"])
        return numpy.count_nonzero(matrix - numpy.diag(numpy.diag(matrix))) == 0

    def test_directions_that_cannot_be_read_are_said_and_left_out(self):
        for number in (NAN, float("inf")):
            for name, arguments in self.each(PLACED, Case(directions=((1, 0, 0), (0, number, 0), (0, 0, 1)))):
                if name.startswith("NRRD") and number != number:
                    continue  # not all three numbers are nan: see below
                self.assertTrue(self.is_without_directions(self.read(arguments)["geometry"]))
                self.assert_said(str(number), "warning")

    def test_a_position_that_cannot_be_read_is_said_and_unknown(self):
        for text in ("nan", "inf", "x"):
            for name, arguments in self.each(TEXTS[:4] + NUMBERS * (text != "x"), Case(origin=("10", text, "-30"))):
                geometry = self.read(arguments)["geometry"]
                self.assertIsNone(geometry["origin"])
                self.assertIsNotNone(geometry["directions"])
                self.assert_said(text, "where the volume lies is unknown")

    def test_a_scale_that_cannot_be_read_allows_no_bound(self):
        for slope, intercept, text in (("x", "3", "x"), ("2", "", "is empty"), ("", "3", "is empty"), ("inf", "0", "inf"), ("2", "inf", "inf"), ("1,024", "0", "1,024")):
            binary = {slope, intercept} <= {"2", "inf", "0"}
            for name, arguments in self.each(TEXTS[:4] + NUMBERS * binary, Case(slope=slope, intercept=intercept)):
                self.read(arguments)
                self.assert_said(text, "what values samples mean is unknown")
                message = self.assert_refused(64, "--max-error", "encode", *arguments, "--max-error", "5", "-o", "b.tag")
                self.assertIn(text, message)
                # What the message advises.
                self.ok("encode", *arguments, "--max-error", "0", "-o", "b.tag")

    def test_a_scale_with_a_decimal_comma_is_read_and_said(self):
        for name, arguments in self.each(TEXTS[:4], Case(slope="2,50", intercept="-102,5")):
            pairs = self.read(arguments)["source"]["pairs"]
            self.assertEqual((float(pairs["rescale_slope"]), float(pairs["rescale_intercept"])), (2.5, -102.5))
            self.assert_said("2,50", "-102,5", "decimal comma")

    def test_what_is_in_doubt_is_not_removed_after_a_loss(self):
        labels = bytearray(nifti_header(Case(), b"n+1\0"))
        struct.pack_into("<h", labels, 68, 1002)
        (self.folder / "labels.nii").write_bytes(bytes(labels) + volume().tobytes())
        run = self.tagrid("encode", "labels.nii", "--max-error", "5", "--rm")
        self.assertNotEqual(run.returncode, 0)
        self.assertIn("intent_code 1002", run.stderr)
        self.assertTrue((self.folder / "labels.nii").exists())
        # Without a loss, nothing is in doubt.
        self.ok("encode", "labels.nii", "--rm", "-f")
        self.assertFalse((self.folder / "labels.nii").exists())


if __name__ == "__main__":
    main()
