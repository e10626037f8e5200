"""Files of several volumes: numpy and the bytes of NIfTI files say what is in them.

    volumes_test.py TAGRID
"""

import gzip
import json
import struct
import unittest

from program import ProgramTest, decoder, numpy

from forged import Forged

CODES = {"uint8": 2, "int16": 4, "float32": 16, "uint16": 512}


def nifti(volumes, sizes=None, step=2.5, trailer=b""):
    """A NIfTI-1 file of volumes (t, z, y, x), with an extension between the header and the samples."""
    count, nz, ny, nx = volumes.shape
    header = bytearray(368)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, *(sizes or [4, nx, ny, nz, count, 1, 1, 1]))
    struct.pack_into("<hh", header, 70, CODES[volumes.dtype.name], 8 * volumes.itemsize)
    struct.pack_into("<8f", header, 76, 1, 2, 2, 3, step, 0, 0, 0)
    struct.pack_into("<fff", header, 108, 368, 1, 0)
    header[123] = 2 | 8  # mm, s
    struct.pack_into("<f", header, 136, 1.5)  # toffset
    struct.pack_into("<hh", header, 252, 0, 1)
    struct.pack_into("<12f", header, 280, -2, 0, 0, 90, 0, 2, 0, -126, 0, 0, 3, -72)
    header[344:348] = b"n+1\0"
    header[348] = 1
    struct.pack_into("<ii", header, 352, 16, 6)
    header[360:368] = b"a note.."
    return bytes(header) + volumes.tobytes() + trailer


def moments(type, shape, seed=1):
    """Volumes (t, z, y, x) that differ from each other."""
    random = numpy.random.default_rng(seed)
    count, nz, ny, nx = shape
    z, y, x = numpy.mgrid[:nz, :ny, :nx]
    smooth = numpy.stack([(x * (1 + t) + 2 * y + 3 * z + 100 * t) for t in range(count)])
    volumes = smooth + random.integers(0, 9, shape)
    if numpy.dtype(type).kind == "f":
        volumes = volumes * 0.37 - 5
        volumes[random.random(shape) < 0.01] = numpy.nan
    return volumes.astype(type)


class Volumes(ProgramTest):
    def decoded(self, name, number, type, shape, *options):
        self.tagrid("decode", name, "--volume", number, "-o", "one.raw", "-f", "-q", *options)
        return numpy.fromfile(self.folder / "one.raw", type).reshape(shape)

    def write(self, name, data):
        (self.folder / name).write_bytes(gzip.compress(data) if name.endswith(".gz") else data)
        return data

    def test_every_volume_comes_back(self):
        for type, shape in (("int16", (3, 5, 67, 70)), ("float32", (2, 70, 9, 33)), ("uint8", (4, 1, 8, 130))):
            for name in ("scan.nii", "scan.nii.gz"):
                with self.subTest(type=type, name=name):
                    volumes = moments(type, shape)
                    self.write(name, nifti(volumes))
                    self.tagrid("encode", name, "-o", "scan.tag", "-f", "-q")
                    self.assertEqual(self.info("scan.tag")["volumes"], shape[0])
                    self.assertEqual(self.info("scan.tag")["dims"], list(shape[:0:-1]))
                    for number, volume in enumerate(volumes):
                        numpy.testing.assert_array_equal(self.decoded("scan.tag", number, type, shape[1:]), volume)
                    self.tagrid("verify", "scan.tag", "--against", name, "-q")

    def test_the_nifti_file_comes_back_byte_for_byte(self):
        for type in ("int16", "float32"):
            data = self.write("scan.nii", nifti(moments(type, (3, 6, 7, 70))))
            self.tagrid("encode", "scan.nii", "-q", "-f")
            self.tagrid("restore", "scan.tag", "-o", "back", "-q", "-f")
            self.assertEqual((self.folder / "back/scan.nii").read_bytes(), data)

    def test_all_volumes_are_decoded_to_nifti(self):
        volumes = moments("int16", (6, 5, 6, 70))
        for sizes in ([4, 70, 6, 5, 6, 1, 1, 1], [5, 70, 6, 5, 2, 3, 1, 1]):
            self.write("scan.nii", nifti(volumes, sizes))
            self.tagrid("encode", "scan.nii", "-q", "-f")
            for name in ("all.nii", "all.nii.gz"):
                self.assertEqual(self.tagrid("decode", "scan.tag", "-o", name, "-f").stderr, b"")
                data = (self.folder / name).read_bytes()
                data = gzip.decompress(data) if name.endswith(".gz") else data
                self.assertEqual(list(struct.unpack_from("<8h", data, 40)), sizes)
                self.assertEqual(struct.unpack_from("<8f", data, 76)[1:5], (2, 2, 3, 2.5))
                self.assertEqual(data[123], 2 | 8)
                self.assertEqual(data[352:], volumes.tobytes())

    def test_names_are_moments(self):
        self.write("scan.nii", nifti(moments("int16", (3, 2, 6, 7))))
        self.tagrid("encode", "scan.nii", "-q")
        self.assertEqual(self.info("scan.tag")["volume_names"], ["1.5 s", "4 s", "6.5 s"])
        self.assertIn(b"3 of 7 x 6 x 2 int16", self.tagrid("info", "scan.tag").stdout)

    def test_a_region_of_a_volume(self):
        volumes = moments("int16", (3, 9, 12, 70))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q")
        part = self.decoded("scan.tag", 2, "int16", (4, 3, 10), "--region", "60:70,2:5,3:7")
        numpy.testing.assert_array_equal(part, volumes[2, 3:7, 2:5, 60:70])

    def test_overviews_of_every_volume(self):
        volumes = moments("int16", (2, 8, 8, 72))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q", "--overviews", "4")
        self.tagrid("verify", "scan.tag", "--against", "scan.nii", "-q")
        for number in (0, 1):
            blocks = volumes[number].astype("i8").reshape(2, 4, 2, 4, 18, 4).sum((1, 3, 5))
            self.assertTrue((self.decoded("scan.tag", number, "int16", (2, 2, 18), "--overview", 4) == (2 * blocks + 64) // 128).all())

    def test_one_of_several_must_be_chosen(self):
        self.write("scan.nii", nifti(moments("int16", (3, 2, 6, 7))))
        self.tagrid("encode", "scan.nii", "-q")
        for options in (["-o", "a.nrrd"], ["-o", "a.nii", "--region", ":,:,0:1"], ["-o", "a.nii", "--salvage"],
                        ["-o", "-"]):
            refused = self.tagrid("decode", "scan.tag", *options, code=64)
            self.assertIn(b"3 volumes", refused.stderr)
            self.assertIn(b"--volume", refused.stderr)
        self.assertIn(b"no volume 3; the volumes are 0 to 2",
                      self.tagrid("mesh", "scan.tag", "-o", "a.vtu", "--padded", "--volume", 3, code=64).stderr)
        self.assertIn(b"volume 3", self.tagrid("decode", "scan.tag", "-o", "a.nrrd", "--volume", 3, code=64).stderr)
        self.assertFalse((self.folder / "a.nrrd").exists())

    def test_meshes_and_previews_of_a_volume_are_those_of_its_own_file(self):
        volumes = moments("int16", (2, 40, 41, 42))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q")
        self.tagrid("encode", "scan.nii", "--series", 2, "-o", "second.tag", "-q")
        for command, options, name in (("mesh", [], "vtu"), ("surface", ["--iso", 150], "ply"),
                                       ("mesh", ["--region", "0:20,:,:"], "vtu")):
            self.tagrid(command, "scan.tag", *options, "--volume", 1, "-o", f"a.{name}", "-q", "-f")
            self.tagrid(command, "second.tag", *options, "-o", f"b.{name}", "-q", "-f")
            self.assertEqual((self.folder / f"a.{name}").read_bytes(), (self.folder / f"b.{name}").read_bytes())
        said = self.tagrid("preview", "scan.tag", "-o", "a.png").stderr
        self.assertEqual(said.count(b"--volume"), 1, said)
        self.tagrid("preview", "scan.tag", "-o", "b.png", "--volume", 1)
        self.assertNotEqual((self.folder / "a.png").read_bytes(), (self.folder / "b.png").read_bytes())

    def test_the_same_bytes_for_any_number_of_threads(self):
        self.write("scan.nii", nifti(moments("int16", (3, 66, 67, 70))))
        for threads in (1, 4):
            self.tagrid("encode", "scan.nii", "-T", threads, "-o", f"{threads}.tag", "-q", "--max-error", 2)
        self.assertEqual((self.folder / "1.tag").read_bytes(), (self.folder / "4.tag").read_bytes())

    def test_a_pipe_gives_the_same_volumes(self):
        volumes = moments("int16", (3, 5, 6, 70))
        for name in ("scan.nii", "scan.nii.gz"):
            self.write(name, nifti(volumes))
            data = (self.folder / name).read_bytes()
            coded = self.tagrid("encode", "-", "-o", "-", input=data).stdout
            (self.folder / "pipe.tag").write_bytes(coded)
            self.tagrid("verify", "pipe.tag", "--against", name, "-q")
            for number, volume in enumerate(volumes):
                numpy.testing.assert_array_equal(self.decoded("pipe.tag", number, "int16", (5, 6, 70)), volume)
            self.tagrid("verify", "-", input=coded)
            self.assertIn(b"3 of 70 x 6 x 5", self.tagrid("info", "-", input=coded).stdout)

    def test_bounds_hold_in_every_volume(self):
        volumes = moments("float32", (3, 8, 20, 70))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "--max-error", 0.5, "-q")
        self.tagrid("verify", "scan.tag", "--against", "scan.nii", "-q")
        for number, volume in enumerate(volumes):
            decoded = self.decoded("scan.tag", number, "float32", volume.shape)
            finite = numpy.isfinite(volume)
            self.assertLessEqual(numpy.abs(decoded[finite] - volume[finite]).max(), 0.5)
            self.assertTrue(numpy.isnan(decoded[~finite]).all())

    def test_a_psnr_is_that_of_all_volumes(self):
        volumes = moments("int16", (3, 16, 40, 70))
        volumes[0] = volumes[0] // 8 * 8
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "--psnr", 50, "-q")
        self.tagrid("decode", "scan.tag", "-o", "all.nii", "-q")
        decoded = numpy.fromfile(self.folder / "all.nii", "int16", offset=352).reshape(volumes.shape).astype("f8")
        rmse = numpy.sqrt(((decoded - volumes) ** 2).mean())
        self.assertGreaterEqual(20 * numpy.log10(float(volumes.max() - volumes.min()) / rmse), 50)

    def test_an_original_that_differs_in_one_volume(self):
        volumes = moments("int16", (3, 5, 6, 70))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q")
        volumes[2, 1, 2, 3] += 1
        self.write("other.nii", nifti(volumes))
        self.assertIn(b"volume 2", self.tagrid("verify", "scan.tag", "--against", "other.nii", code=65).stderr)
        self.write("fewer.nii", nifti(volumes[:2]))
        self.assertIn(b"2 volumes", self.tagrid("verify", "scan.tag", "--against", "fewer.nii", code=65).stderr)

    def test_statistics_say_how_many_volumes_there_are(self):
        self.write("scan.nii", nifti(moments("int16", (3, 5, 6, 70))))
        for command, expected in ((["encode", "scan.nii"], 3), (["verify", "scan.tag", "--against", "scan.nii"], 3),
                                  (["restore", "scan.tag", "-o", "back"], 3),
                                  (["decode", "scan.tag", "-o", "all.nii"], 3),
                                  (["decode", "scan.tag", "--volume", 0, "-o", "one.nii"], 1),
                                  (["encode", "scan.nii", "--series", 2, "-o", "one.tag"], 1)):
            figures = json.loads(self.tagrid(*command, "--json", "-", "-q").stdout)
            self.assertEqual(figures["volumes"], expected, command)
            self.assertEqual(figures["dims"], [70, 6, 5])
            voxels = figures["voxels_per_second"] * figures["seconds"]
            self.assertAlmostEqual(voxels, expected * 70 * 6 * 5, delta=1)

    def test_damage_costs_only_the_volume_that_has_it(self):
        volumes = moments("int16", (3, 70, 70, 70))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q")
        data = bytearray((self.folder / "scan.tag").read_bytes())
        content = Forged(data).members()[0][2]
        data[data.index(content) + len(content) // 2] ^= 1
        (self.folder / "scan.tag").write_bytes(data)
        for number in (0, 2):
            numpy.testing.assert_array_equal(self.decoded("scan.tag", number, "int16", (70, 70, 70)), volumes[number])
        refused = self.tagrid("decode", "scan.tag", "--volume", 1, "-o", "a.raw", code=65)
        self.assertIn(b"volume 1", refused.stderr)
        self.tagrid("decode", "scan.tag", "--volume", 1, "--salvage", "-o", "a.raw", "--json", "lost.json", code=65)
        lost = self.statistics("lost.json")["lost"]
        self.assertEqual(len(lost), 1)
        same = numpy.fromfile(self.folder / "a.raw", "int16").reshape(70, 70, 70) == volumes[1]
        self.assertGreater(same.mean(), 0.02)
        self.assertLess(same.mean(), 1)
        verified = self.tagrid("verify", "scan.tag", "--json", "damaged.json", code=65)
        self.assertIn(b"volume 1", verified.stderr)
        self.assertRegex(verified.stdout, rb"^scan.tag: volume 1: brick \d is damaged or missing: region \S+\n"
                                          rb"scan.tag: volume 1: 1 of 8 bricks is lost; decode --salvage --volume 1 decodes all others\n$")
        damaged = self.statistics("damaged.json")["damaged"]
        self.assertEqual(damaged, [dict(lost[0], volume=1)])

    def test_damage_of_several_volumes_is_listed(self):
        self.write("scan.nii", nifti(moments("int16", (4, 70, 70, 70))))
        self.tagrid("encode", "scan.nii", "-q", "--strip")
        data = bytearray((self.folder / "scan.tag").read_bytes())
        first, second, _ = (data.index(content) for _, _, content in Forged(data).members())
        data[first // 2] ^= 1
        data[second + 30] ^= 1  # in the header of volume 2
        (self.folder / "scan.tag").write_bytes(data)
        verified = self.tagrid("verify", "scan.tag", "--json", "damaged.json", code=65)
        lines = verified.stdout.decode().splitlines()
        self.assertEqual([line.split(": ")[1] for line in lines], ["volume 0"] * 2 + ["volume 2"] * 2, lines)
        self.assertEqual(lines[3], "scan.tag: volume 2: 8 of 8 bricks are lost")
        damaged = self.statistics("damaged.json")["damaged"]
        self.assertEqual([box["volume"] for box in damaged], [0, 2])
        self.assertEqual(damaged[1]["high"], [70, 70, 70])

    def test_volumes_that_cannot_be_found_are_said(self):
        self.write("scan.nii", nifti(moments("int16", (2, 9, 9, 9))))
        self.tagrid("encode", "scan.nii", "-o", "scan.tag")
        with open(self.folder / "scan.tag", "ab") as file:
            file.write(b"x")
        verified = self.tagrid("verify", "scan.tag", "--json", "damaged.json", code=65)
        self.assertEqual(verified.stdout, b"scan.tag: only volume 0 of 2 can be found, as the directory is damaged\n")
        report = self.statistics("damaged.json")
        self.assertEqual((report["volumes_found"], report["damaged"]), (1, []))
        advised = b"; tagrid decode scan.tag --salvage --volume 0 decodes the intact bricks of one volume\n"
        for command in (["decode", "scan.tag", "-o", "back.nii"], ["repair", "scan.tag", "-o", "back.tag"]):
            self.assertTrue(self.tagrid(*command, code=65).stderr.endswith(advised), command)
        lost = self.tagrid("decode", "scan.tag", "--salvage", "--volume", 1, "-o", "one.raw", code=65)
        self.assertIn(b"volume 1 cannot be found: the end of the file is damaged", lost.stderr)

    def test_advice_is_of_a_volume_that_has_bricks(self):
        volumes = moments("int16", (2, 20, 20, 20))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q", "--strip")
        data = bytearray((self.folder / "scan.tag").read_bytes())
        second = data.index(Forged(data).members()[0][2])
        data[second - 400:second - 300] = bytes(100)  # in the only brick of volume 0
        (self.folder / "scan.tag").write_bytes(data)
        refused = self.tagrid("decode", "scan.tag", "-o", "back.nii", code=65)
        self.assertIn(b"; tagrid decode scan.tag --salvage --volume 1 decodes the intact bricks of one", refused.stderr)
        self.tagrid("decode", "scan.tag", "--salvage", "--volume", 1, "-o", "one.raw")
        found = numpy.fromfile(self.folder / "one.raw", "int16").reshape(20, 20, 20)
        numpy.testing.assert_array_equal(found, volumes[1])

    def test_parity_leads_to_volumes_where_the_end_is_damaged(self):
        volumes = moments("int16", (3, 20, 20, 20))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q", "--parity", "10%")
        data = bytearray((self.folder / "scan.tag").read_bytes())
        data[-12] ^= 1
        (self.folder / "scan.tag").write_bytes(data)
        self.tagrid("decode", "scan.tag", "--salvage", "--volume", 2, "-o", "two.raw")
        found = numpy.fromfile(self.folder / "two.raw", "int16").reshape(20, 20, 20)
        numpy.testing.assert_array_equal(found, volumes[2])
        refused = self.tagrid("decode", "scan.tag", "-o", "back.nii", code=65)
        self.assertIn(b"; tagrid repair scan.tag -o OUT rebuilds what is damaged", refused.stderr)

    def test_parity_repairs_a_volume(self):
        self.write("scan.nii", nifti(moments("int16", (3, 5, 60, 70))))
        self.tagrid("encode", "scan.nii", "-q", "--parity", "10%")
        good = (self.folder / "scan.tag").read_bytes()
        data = bytearray(good)
        data[len(data) // 2] ^= 255
        (self.folder / "scan.tag").write_bytes(data)
        self.tagrid("repair", "scan.tag", "-o", "back.tag", "-q")
        self.assertEqual((self.folder / "back.tag").read_bytes(), good)

    def test_an_archive_is_converted_and_its_original_removed(self):
        (self.folder / "archive").mkdir()
        data = nifti(moments("int16", (3, 5, 6, 70)))
        (self.folder / "archive/scan.nii").write_bytes(data)
        found = self.tagrid("convert", "--find", "archive").stdout
        self.assertIn(b"3 volumes of 70 x 6 x 5 int16", found)
        (self.folder / "list").write_bytes(found)
        self.tagrid("convert", "--manifest", "list", "--output-dir", "out", "-q", "--json", "1.json")
        outputs = [path for path in (self.folder / "out").rglob("*.tag")]
        self.assertEqual(len(outputs), 1)
        self.tagrid("convert", "--manifest", "list", "--output-dir", "out", "-q", "--remove-verified", "--json",
                    "2.json")
        self.assertFalse((self.folder / "archive/scan.nii").exists())
        self.tagrid("restore", outputs[0], "-o", "back", "-q")
        self.assertEqual(next((self.folder / "back").rglob("*.nii")).read_bytes(), data)

    def test_an_error_in_any_volume_is_said_and_reported(self):
        volumes = moments("int16", (3, 20, 33, 41))
        volumes[0] = 0  # comes back exactly
        volumes[1:] = numpy.random.default_rng(2).integers(0, 2000, volumes[1:].shape)
        (self.folder / "archive").mkdir()
        for grid in ([], ["--grid", "derived"]):
            data = self.write("scan.nii", nifti(volumes))
            self.tagrid("encode", "scan.nii", "--max-error", 20, "-q", "-f", *grid)
            restored = self.tagrid("restore", "scan.tag", "-o", "back", "-f", "--json", "r.json")
            back = numpy.frombuffer((self.folder / "back/scan.nii").read_bytes()[-volumes.nbytes:], "int16")
            error = int(numpy.abs(back.astype("i4") - volumes.ravel()).max())
            self.assertGreater(error, 0)
            self.assertIn(f"the samples in scan.nii were not kept exactly; they differ by up to {error}".encode(),
                          restored.stderr)
            self.assertEqual(self.statistics("r.json")["achieved"]["max_error"], error)
            self.assertEqual(self.info("scan.tag")["achieved"]["max_error"], error)
            self.assertIn(f"reached {error}\n".encode(), self.tagrid("info", "scan.tag").stdout)
            # Of a pipe, the errors of other volumes are not known, and info says whose they are.
            of_pipe = self.tagrid("info", "-", input=(self.folder / "scan.tag").read_bytes()).stdout
            self.assertIn(b"what follows on errors, values and levels is of volume 0", of_pipe)
        self.tagrid("encode", "scan.nii", "--max-error", 20, "--rm", "-q", "-f")
        self.assertIn(b"differ by up to", self.tagrid("restore", "scan.tag", "-o", ".").stderr)
        (self.folder / "archive/scan.nii").write_bytes(data)
        (self.folder / "list").write_bytes(self.tagrid("convert", "--find", "archive").stdout)
        self.tagrid("convert", "--manifest", "list", "--output-dir", "out", "-q", "--max-error", 20)
        self.tagrid("convert", "--manifest", "list", "--output-dir", "out", "-q", "--max-error", 20, "--remove-verified")
        self.assertFalse((self.folder / "archive/scan.nii").exists())
        self.assertIn(b"differ by up to", self.tagrid("restore", "--records", "out").stderr)
        self.assertNotEqual((self.folder / "archive/scan.nii").read_bytes(), data)

    def test_an_input_is_removed_after_a_proof(self):
        data = self.write("scan.nii", nifti(moments("int16", (3, 5, 6, 70))))
        self.tagrid("encode", "scan.nii", "--rm", "-q")
        self.assertFalse((self.folder / "scan.nii").exists())
        self.tagrid("restore", "scan.tag", "-o", ".", "-q")
        self.assertEqual((self.folder / "scan.nii").read_bytes(), data)

    def test_a_run_that_continues_is_refused(self):
        self.write("scan.nii", nifti(moments("int16", (3, 5, 6, 70))))
        self.assertIn(b"3 volumes", self.tagrid("encode", "scan.nii", "--resume", code=64).stderr)
        self.tagrid("encode", "scan.nii", "--resume", "--series", 2, "-q")
        self.assertEqual(self.info("scan.tag")["volumes"], 1)
        self.assertIn(b"--series", self.tagrid("estimate", "scan.nii", code=64).stderr)

    def test_all_by_name(self):
        self.write("scan.nii", nifti(moments("int16", (3, 5, 6, 70))))
        self.tagrid("encode", "scan.nii", "--series", "all", "-q")
        self.assertEqual(self.info("scan.tag")["volumes"], 3)
        self.write("one.nii", nifti(moments("int16", (1, 5, 6, 70))))
        self.tagrid("encode", "one.nii", "--series", "all", "-q")
        self.assertEqual(self.info("one.tag")["volumes"], 1)

    def test_the_report_counts_all_volumes(self):
        volumes = numpy.zeros((4, 10, 20, 30), "int16")
        (self.folder / "scan.nii.gz").write_bytes(gzip.compress(nifti(volumes)))
        told = self.tagrid("encode", "scan.nii.gz", "-v").stderr
        self.assertIn(b"48.0 kB -> ", told)
        self.assertTrue((self.folder / "scan.tag").exists())

    def test_many_volumes(self):
        volumes = moments("uint8", (3000, 2, 3, 4))
        self.write("scan.nii", nifti(volumes))
        self.tagrid("encode", "scan.nii", "-q")
        self.tagrid("decode", "scan.tag", "-o", "all.nii", "-q")
        self.assertEqual((self.folder / "all.nii").read_bytes()[352:], volumes.tobytes())
        self.write("too.nii", nifti(moments("uint8", (10001, 1, 1, 1))))
        self.assertIn(b"10001 volumes", self.tagrid("encode", "too.nii", code=64).stderr)

    def test_meta_image(self):
        volumes = moments("int16", (3, 5, 6, 70))
        header = b"ObjectType = Image\nNDims = 4\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = 1 2 3 4\nDimSize = 70 6 5 3\nElementType = MET_SHORT\nElementDataFile = LOCAL\n"
        data = self.write("scan.mha", header + volumes.tobytes())
        self.tagrid("encode", "scan.mha", "-q")
        for number, volume in enumerate(volumes):
            numpy.testing.assert_array_equal(self.decoded("scan.tag", number, "int16", (5, 6, 70)), volume)
        self.tagrid("restore", "scan.tag", "-o", "back", "-q")
        self.assertEqual((self.folder / "back/scan.mha").read_bytes(), data)

    def test_forged_members(self):
        self.write("scan.nii", nifti(moments("int16", (3, 5, 6, 70))))
        self.tagrid("encode", "scan.nii", "-q")
        data = (self.folder / "scan.tag").read_bytes()
        contents = Forged(data).members()
        self.assertEqual([c[:2] for c in contents], [(2, 1), (2, 2)])
        (self.folder / "same.tag").write_bytes(Forged(data).with_members(contents).data())
        self.tagrid("verify", "same.tag", "--against", "scan.nii")
        self.tagrid("encode", "scan.nii", "--series", 1, "--max-error", 2, "-q", "-o", "loose.tag")
        self.write("small.nii", nifti(moments("int16", (1, 4, 6, 70))))
        self.tagrid("encode", "small.nii", "-q", "--strip")
        loose, small = ((self.folder / name).read_bytes() for name in ("loose.tag", "small.tag"))
        for parts, words in (
                (contents[:1], b"volumes"), ([], b"missing"), (contents[::-1], b"order"),
                ([(2, 1, contents[0][2]), (2, 3, contents[1][2])], b"order"),
                ([(1, 4, contents[0][2]), contents[1]], b"overview 4"),
                (contents + [(2, 3, contents[0][2])], b"order"),
                ([contents[0], (2, 2, small)], b"volume 2: the volume has another size"),
                ([contents[0], (2, 2, loose)], b"volume 2: the volume has another size"),
                ([contents[0], (2, 2, data)], b"volume 2: the volume has another size"),
                ([contents[0], (2, 2, b"x" * 100)], b"volume 2")):
            (self.folder / "forged.tag").write_bytes(Forged(data).with_members(parts).data())
            self.assertIn(words, self.tagrid("verify", "forged.tag", code=65).stderr)
            self.tagrid("decode", "forged.tag", "-o", "a.nii", "-f", code=65)
            self.tagrid("verify", "-", code=65, input=(self.folder / "forged.tag").read_bytes())
        for count in (0, 2, 4, 10001, 2**32 - 1):
            changed = bytearray(data)
            struct.pack_into("<I", changed, 112, count)
            size, = struct.unpack_from("<I", changed, 12)
            changed[size - 8:size] = struct.pack("<Q", decoder.xxh3(bytes(changed[:size - 8])))
            (self.folder / "forged.tag").write_bytes(changed)
            self.tagrid("info", "forged.tag", code=65)
            self.tagrid("decode", "forged.tag", "--volume", 1, "-o", "a.raw", code=65)


if __name__ == "__main__":
    unittest.main()
