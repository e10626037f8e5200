"""Zeiss TXM and TXRM: compound files (OLE2) of a writer by the specification of Microsoft ([MS-CFB]), which olefile reads, too.
"""

import struct
import unittest

from other_readers import PROGRAM, ReaderTest, main, numpy, random_samples

try:
    import olefile
except ImportError:
    olefile = None

FREE, END, FAT, DIFAT = 0xffffffff, 0xfffffffe, 0xfffffffd, 0xfffffffc
NUMBERS = {"int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "float32": 10, "float64": 11}


class Storage(dict):
    """Streams (bytes) and storages by their names."""


def compound(root, version=3, backwards=False):
    """A file of OLE2. With `backwards`, sectors of a stream come in the reverse order."""
    sector = 512 if version == 3 else 4096
    small, cutoff = 64, 4096
    entries, bodies = [], []

    def add(name, item):
        number = len(entries)
        entries.append({"name": name, "kind": 5 if number == 0 else 1 if isinstance(item, dict) else 2, "child": FREE, "left": FREE, "right": FREE, "start": END, "size": 0})
        if isinstance(item, dict):
            # Names are ordered by their length, and then in capitals. The tree is only as deep as it must be.
            numbers = [add(key, value) for key, value in sorted(item.items(), key=lambda one: (len(one[0]), one[0].upper()))]

            def tree(part):
                if not part:
                    return FREE
                middle = len(part) // 2
                entries[part[middle]]["left"], entries[part[middle]]["right"] = tree(part[:middle]), tree(part[middle + 1:])
                return part[middle]
            entries[number]["child"] = tree(numbers)
        else:
            bodies.append((number, item))
        return number

    add("Root Entry", root)
    sectors, table = [], {}

    def chain(data, size, first):
        count = -(-len(data) // size)
        numbers = [first + i for i in range(count)][::-1 if backwards else 1]
        parts = [data[i * size:(i + 1) * size].ljust(size, b"\0") for i in range(count)]
        return numbers, dict(zip(numbers, parts))

    def store(data):
        numbers, parts = chain(data, sector, len(sectors))
        sectors.extend(parts[number] for number in sorted(parts))
        for here, following in zip(numbers, [*numbers[1:], END]):
            table[here] = following
        return numbers[0] if numbers else END

    mini, mini_table = b"", []
    for number, data in bodies:
        entries[number]["size"] = len(data)
        if len(data) >= cutoff:
            entries[number]["start"] = store(data)
        elif data:
            numbers, parts = chain(data, small, len(mini_table))
            mini += b"".join(parts[one] for one in sorted(parts))
            following = dict(zip(numbers, [*numbers[1:], END]))
            mini_table += [following[one] for one in sorted(numbers)]
            entries[number]["start"] = numbers[0]
    entries[0]["start"], entries[0]["size"] = store(mini), len(mini)
    mini_start = store(struct.pack(f"<{len(mini_table)}I", *mini_table).ljust(-(-len(mini_table) * 4 // sector) * sector, b"\xff"))
    directory = b""
    for entry in entries:
        name = (entry["name"] + "\0").encode("utf-16-le")
        directory += name.ljust(64, b"\0") + struct.pack("<HBBIII", len(name), entry["kind"], 1, entry["left"], entry["right"], entry["child"]) + bytes(36) + \
            struct.pack("<IQ", entry["start"], entry["size"])
    empty = bytes(64) + struct.pack("<HBBIII", 0, 0, 0, FREE, FREE, FREE) + bytes(48)
    directory += empty * (-(len(directory) // 128) % (sector // 128))
    backwards_before, backwards = backwards, False
    directory_start = store(directory)
    backwards = backwards_before
    each = sector // 4
    count = 1
    while count * each < len(sectors) + count:
        count += 1
    assert count <= 109
    fat_at = [len(sectors) + i for i in range(count)]
    for at in fat_at:
        table[at] = FAT
    fat = struct.pack(f"<{count * each}I", *(table.get(i, FREE) for i in range(count * each)))
    head = bytes.fromhex("d0cf11e0a1b11ae1") + bytes(16) + struct.pack("<HHHHH", 0x3e, version, 0xfffe, 9 if version == 3 else 12, 6) + bytes(6) + \
        struct.pack("<IIIIIIIII", 0 if version == 3 else len(directory) // sector, count, directory_start, 0, cutoff, mini_start, -(-len(mini_table) * 4 // sector), END, 0) + \
        struct.pack("<109I", *fat_at, *[FREE] * (109 - count))
    return head.ljust(sector, b"\0") + b"".join(sectors) + fat


def scan(samples, pixel=0.65, angles=None, **changed):
    """The storages of a scan. What is None is left out."""
    info = {"ImageWidth": struct.pack("<I", samples.shape[2]), "ImageHeight": struct.pack("<I", samples.shape[1]), "NoOfImages": struct.pack("<I", len(samples)),
            "DataType": struct.pack("<I", NUMBERS[str(samples.dtype)]), "PixelSize": None if pixel is None else struct.pack("<f", pixel),
            "Angles": struct.pack(f"<{len(samples)}f", *(angles if angles is not None else [0] * len(samples)))} | changed
    root = Storage(ImageInfo=Storage((name, value) for name, value in info.items() if value is not None))
    for z, slice in enumerate(samples):
        root.setdefault(f"ImageData{z // 100 + 1}", Storage())[f"Image{z + 1}"] = slice.astype(slice.dtype.newbyteorder("<")).tobytes()
    return root


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
@unittest.skipIf(not (PROGRAM.parent / "tagrid-read-zeiss").exists(), "tagrid-read-zeiss was left out, as libgsf is missing")
class Zeiss(ReaderTest):
    def write(self, name, root, **options):
        (self.folder / name).write_bytes(compound(root, **options))
        return name

    def test_every_type(self):
        for type in NUMBERS:
            truth = random_samples(type, (5, 41, 53))  # short and long streams
            for version, backwards in ((3, False), (4, False), (3, True)):
                self.write("a.txm", scan(truth), version=version, backwards=backwards)
                info = self.encodes(truth, "a.txm", what=(type, version, backwards))
                self.assertEqual((self.messages, info["geometry"]["spacing"], info["geometry"]["units"]), ("", [0.65] * 3, ["um"] * 3))
            small = truth[:, :3, :4].copy()
            self.encodes(small, self.write("b.TXM", scan(small)), what=(type, "small"))

    @unittest.skipIf(olefile is None, "there is no olefile on this machine (python3-olefile)")
    def test_more_images_than_a_storage_has_are_those_of_olefile(self):
        truth = random_samples("uint16", (205, 8, 9))
        self.write("a.txm", scan(truth))
        with olefile.OleFileIO(str(self.folder / "a.txm")) as ole:
            judged = [numpy.frombuffer(ole.openstream(f"ImageData{z // 100 + 1}/Image{z + 1}").read(), "<u2").reshape(8, 9) for z in range(205)]
        self.encodes(numpy.array(judged), "a.txm")
        self.encodes(truth, "a.txm")

    def test_projections_are_said_with_their_angles(self):
        truth = random_samples("uint16", (3, 20, 30))
        root = scan(truth, angles=[-90, 0.5, 90.25])
        root["ReferenceData"] = Storage(Image=bytes(1200))
        for name in ("a.txrm", "a.xrm"):
            info = self.encodes(truth, self.write(name, root), says="its slices are projections, not those of a reconstructed volume")
            self.assertIn("reference image (flat field) is not part", self.messages)
            self.assertEqual((info["geometry"]["spacing"], info["source"]["pairs"]["zeiss_angles"]), ([0.65, 0.65, None], "-90 0.5 90.25"))
        self.encodes(truth, self.write("a.txm", root))
        self.assertEqual(self.messages, "")
        # A scan that was stopped.
        for field in ({"NoOfImages": struct.pack("<I", 7), "ImagesTaken": struct.pack("<I", 3)}, {"PixelSize": None, "pixelsize": struct.pack("<d", 0.65)}):
            info = self.encodes(truth, self.write("a.txrm", scan(truth, **field)), says="3 of 7 planned images were taken" if "ImagesTaken" in field else "")
            self.assertEqual(info["geometry"]["spacing"], [0.65, 0.65, None])
        self.assertIsNone(self.encodes(truth, self.write("a.txm", scan(truth, pixel=None)), says="does not state its pixel size")["geometry"]["spacing"])
        self.assertEqual(self.encodes(truth, "a.txm", "--spacing", "2um")["geometry"]["spacing"], [2] * 3)

    def test_images_beyond_the_stated_number_are_said(self):
        truth = random_samples("uint16", (103, 4, 5))
        for field, count in (("NoOfImages", 3), ("NoOfImages", 100), ("NoOfImages", 102), ("ImagesTaken", 3), ("ImagesTaken", 100)):
            self.write("a.txm", scan(truth, **{field: struct.pack("<I", count)}))
            said = f"has more images than the {count} of {field}; those from image {count + 1} on are not read"
            info = self.encodes(truth[:count], "a.txm", what=(field, count), says=f"a.txm: {said}")
            self.assertEqual(info["source"]["pairs"]["not understood"], said)
        self.write("a.txm", scan(truth, ImagesTaken=struct.pack("<I", 103)))
        self.assertNotIn("not understood", self.encodes(truth, "a.txm")["source"]["pairs"])
        self.assertEqual(self.messages, "")

    def test_what_is_not_supported_is_refused(self):
        truth = random_samples("uint16", (3, 20, 30))
        for changed, said in (({"DataType": struct.pack("<I", 9)}, "of the type 9 (DataType)"), ({"DataType": struct.pack("<I", 10)}, "has 1200 bytes, but 30 x 20 samples of float32 have 2400"),
                              ({"ImageWidth": None}, "has no ImageInfo/ImageWidth"), ({"ImageWidth": b"ab"}, "has no ImageInfo/ImageWidth"), ({"ImageHeight": struct.pack("<I", 0)}, "its ImageInfo/ImageHeight is 0"),
                              ({"NoOfImages": struct.pack("<I", 4)}, "has no stream ImageData1/Image4"), ({"NoOfImages": struct.pack("<I", 2**31 - 1)}, "has no stream ImageData1/Image4"),
                              ({"ImageWidth": struct.pack("<I", 2**30), "ImageHeight": struct.pack("<I", 2**30)}, ""), ({"ImageWidth": bytes(5000)}, "at most 8 are expected")):
            self.write("a.txm", scan(truth, **changed))
            self.assertIn("a.txm", self.assert_refused(65, said, "encode", "a.txm", "-o", "a.tag"))
            self.assertFalse((self.folder / "a.tag").exists())
        self.assert_refused(65, "so it is not one of an X-ray microscope", "encode", self.write("a.txm", Storage(WordDocument=b"text" * 3000)))
        self.assert_refused(65, "OLE2", "encode", self.write("a.doc", Storage(WordDocument=b"text" * 3000)))

    def test_damaged_files_are_refused(self):
        truth = random_samples("uint16", (3, 60, 70))
        good = compound(scan(truth))
        for size in (8, 100, 511, 512, 1000, 5000, len(good) // 2, len(good) - 513):
            (self.folder / "a.txm").write_bytes(good[:size])
            self.assertIn("a.txm", self.assert_refused(65, "", "encode", "a.txm", "-o", "a.tag"))
            self.assertFalse((self.folder / "a.tag").exists())
        random = numpy.random.default_rng(1)
        for i in range(40):  # changed bytes may give other samples, but nothing worse
            broken = bytearray(good)
            where = (0, 512) if i % 2 else (len(good) - 2048, len(good))
            for at in random.integers(*where, 3):
                broken[at] = random.integers(0, 256)
            (self.folder / "a.txm").write_bytes(broken)
            self.assertIn(self.tagrid("encode", "a.txm", "-o", "b.tag", "-f").returncode, (0, 65))


if __name__ == "__main__":
    main()
