"""AmiraMesh files of Amira and Avizo, made by the description of the format."""

import unittest
import zlib

from other_readers import ReaderTest, main, numpy, random_samples

TYPES = {"uint8": "byte", "int8": "sbyte", "uint16": "ushort", "int16": "short", "uint32": "uint", "int32": "int", "float32": "float", "float64": "double"}
HEADER = """# AmiraMesh {storage} 2.1


define Lattice 9 7 5

Parameters {{
    Materials {{
        Exterior {{
            Color 0 0 0,
            Id 1
        }}
    }}
    Units {{
        Coordinates "mm"
    }}
    Content "9x7x5 {type}, uniform coordinates",
    BoundingBox 1 9 -2 1 0 10,
    CoordType "uniform"
}}

Lattice {{ {type} Data }} @1{encoding}

# Data section follows
@1
"""


def text_of(type="ushort", storage="BINARY-LITTLE-ENDIAN", encoding=""):
    return HEADER.format(storage=storage, type=type, encoding=encoding)


def runs_of(samples):
    """Bytes as runs: equal ones repeated, others as they are."""
    data, runs, at = samples.tobytes(), b"", 0
    while at < len(data):
        end = at + 1
        while end < len(data) and end - at < 127 and data[end] == data[at]:
            end += 1
        if end - at > 1:
            runs += bytes((end - at, data[at]))
        else:
            while end < len(data) and end - at < 127 and (end + 1 == len(data) or data[end] != data[end + 1]):
                end += 1
            runs += bytes((128 + end - at,)) + data[at:end]
        at = end
    return runs


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Amira(ReaderTest):
    def write(self, text, samples=b"", name="a.am"):
        (self.folder / name).write_bytes(text.encode() + samples)
        return name

    def test_every_type_in_both_byte_orders(self):
        for type, name in TYPES.items():
            truth = random_samples(type, (5, 7, 9))
            for storage, order in (("BINARY-LITTLE-ENDIAN", "<"), ("BINARY", ">"), ("3D BINARY", ">")):
                samples = truth.astype(truth.dtype.newbyteorder(order)).tobytes()
                for end in (b"", b"\n", b"\r\n"):
                    info = self.encodes(truth, self.write(text_of(name, storage), samples + end), what=(type, storage))
                    geometry = info["geometry"]
                    self.assertEqual((self.messages, info["restorable"]), ("", True))
                    self.assertEqual((geometry["spacing"], geometry["origin"], geometry["units"]), ([1, 0.5, 2.5], [1, -2, 0], ["mm"] * 3))

    def test_headers_of_other_programs(self):
        truth = random_samples("uint16", (5, 7, 9))
        good, samples = text_of(), truth.tobytes()
        for old, new in (("# AmiraMesh", "# Avizo"), ("@1\n\n#", "= @1\n\n#"), ("# Data section follows\n", ""), ("\n", "\r\n"), ("Lattice { ushort Data }", "Lattice{ushort Data}"),
                         ('    Units {\n        Coordinates "mm"\n    }\n', ""), (",\n", "\n"), ("\n@1\n", " \n@1 \n"), ("define Lattice", "# a remark { with a brace\ndefine Lattice")):
            self.assertIn(old, good)
            geometry = self.encodes(truth, self.write(good.replace(old, new), samples), what=new)["geometry"]
            self.assertEqual(geometry["spacing"], [1, 0.5, 2.5], new)
        box = "    BoundingBox 1 9 -2 1 0 10,\n"
        for new, spacing in (("", None), ("BoundingBox 1 9 -2 1 0,\n", None), ("BoundingBox 1 9 -2 1 0 x,\n", None), ("BoundingBox 1 9 -2 -2 10 0,\n", [1, None, None])):
            self.assertEqual(self.encodes(truth, self.write(good.replace(box, new), samples))["geometry"]["spacing"], spacing, new)
        one = good.replace("9 7 5", "9 7 1").replace(" 0 10,", " 0 0,")
        self.assertEqual(self.encodes(truth[:1], self.write(one, truth[:1].tobytes()))["geometry"]["spacing"], [1, 0.5, None])
        matrix = "1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1"
        self.encodes(truth, self.write(good.replace(box, box + f"    TransformationMatrix {matrix},\n"), samples), says="TransformationMatrix is not applied")
        self.encodes(truth, self.write(good.replace(box, box + f"    TransformationMatrix {matrix.replace('5 6 7', '0 0 0')},\n"), samples))
        self.assertEqual(self.messages, "")
        self.assertIn("Materials", dict(self.info("out.tag")["source"]["pairs"])["amira_parameters"])

    def test_labels_as_runs(self):
        rough = random_samples("uint8", (5, 7, 9))
        smooth = numpy.repeat(numpy.arange(5, dtype="uint8"), 63).reshape(5, 7, 9)
        mixed = numpy.where(rough < 128, smooth, rough)
        for truth in (rough, smooth, mixed):
            runs = runs_of(truth)
            for end in (b"", b"\n"):
                info = self.encodes(truth, self.write(text_of("byte", encoding=f"(HxByteRLE,{len(runs)})"), runs + end))
                self.assertEqual((self.messages, info["compression"]), ("", "HxByteRLE"))
        self.ok("encode", "a.am", "--max-error", "3", "--spool", ".", "-o", "lossy.tag")
        text = text_of("byte", encoding=f"(HxByteRLE,{len(runs)})")
        for runs_there, says in ((runs[:-1], "end before its samples"), (runs + b"\1\1", "hold more than"), (b"\0\1" + runs, "one of them is empty"), (b"\x80" + runs, "one of them is empty")):
            self.write(text.replace(f",{len(runs)})", f",{len(runs_there)})"), runs_there)
            self.assert_refused(65, says, "encode", "a.am")
        self.write(text.replace("9 7 5", "900 700 500").replace("9x7x5", "x"), runs)
        self.assert_refused(65, "cannot hold the samples", "encode", "a.am")
        self.write(text_of("ushort", encoding="(HxByteRLE,10)"), runs)
        self.assert_refused(65, "samples stored like this are not supported", "encode", "a.am")

    def test_samples_in_zip(self):
        for type, name in (("uint8", "byte"), ("int16", "short"), ("float32", "float")):
            truth = random_samples(type, (5, 7, 9))
            packed = zlib.compress(truth.tobytes())
            for end in (b"", b"\n"):
                info = self.encodes(truth, self.write(text_of(name, encoding=f"(HxZip,{len(packed)})"), packed + end))
                self.assertEqual((self.messages, info["compression"]), ("", "zlib"))
        self.write(text_of("float", encoding=f"(HxZip,{len(packed)})"), packed[:-10])
        self.assert_refused(65, "a.am", "encode", "a.am")

    def test_what_is_not_supported_is_refused(self):
        truth = random_samples("uint16", (5, 7, 9))
        good = text_of()
        for old, new, text in (("BINARY-LITTLE-ENDIAN", "ASCII", "samples as text"), ("BINARY-LITTLE-ENDIAN", "3D", "how samples are stored"), ('"uniform"', '"rectilinear"', "uniform coordinates"),
                               ("ushort Data", "float[3] Data", "samples of this type"), ("ushort Data", "complex Data", "samples of this type"), ("define Lattice 9 7 5", "define Lattice 9 35", "three axes"),
                               ("define Lattice 9 7 5", "define Nodes 9", "three axes"), ("9 7 5\n", "9 0 5\n", "positive"), ("9 7 5\n", "9 7 99999999999999\n", "a volume cannot have"),
                               ("9 7 5\n", "9 7 6\n", "expected"), ("@1\n\n", "@1\nLattice { byte Labels } @2\n\n", "more data"), ("@1\n\n", "@1\nCoordinates { float xyz } @2\n\n", "more data"),
                               ("Lattice { ushort Data } @1", "", "none"), ("@1\n\n", "@2\n\n", "must come first"), ("@1\n\n", "@1(HxOther,5)\n\n", "stored like this"), ("@1\n\n", "@1(HxZip)\n\n", "number of its bytes"),
                               ("@1\n\n", "@1(HxZip,x)\n\n", "number of its bytes"), ("@1\n\n", "@1(HxZip,99999999999999999999)\n\n", "number of its bytes"), ("\n@1\n", "\n@12\n", "must come first")):
            self.assertIn(old, good)
            self.write(good.replace(old, new), truth.tobytes())
            self.assert_refused(65, text, "encode", "a.am")
        (self.folder / "a.surf").write_text("# HyperSurface 0.1 BINARY\n")
        self.assert_refused(65, "is a surface of Amira", "encode", "a.surf")

    def test_damaged_files_are_refused(self):
        truth = random_samples("uint16", (5, 7, 9))
        head, samples = text_of(), truth.tobytes()
        whole = head.encode() + samples
        for size in (11, 40, 100, len(head) - 2, len(head), len(whole) - 1):
            (self.folder / "a.am").write_bytes(whole[:size])
            self.assert_refused(65, "a.am", "encode", "a.am")
        self.write(head, samples + b"more")
        self.encodes(truth, "a.am", says="4 bytes follow the samples")
        self.write("# AmiraMesh BINARY 2.1\n" + "x\n" * (1 << 20))
        self.assert_refused(65, "does not end within", "encode", "a.am")


if __name__ == "__main__":
    main()
