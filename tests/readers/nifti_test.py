"""NIfTI: samples and geometry are those that nibabel writes and reads."""

import gzip
import itertools
import pathlib
import shutil
import struct
import unittest

from other_readers import ReaderTest, main, nibabel, numpy, random_samples, some

TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


def volume(type, shape=(23, 19, 7)):
    """An array [x, y, z], as nibabel has it."""
    return random_samples(type, shape)


def oblique():
    """An affine transform without symmetries, in float32 as files have it."""
    return numpy.array([[0.4, 0.1, -0.2, -90.5], [-0.1, 0.5, 0.3, 12.25], [0.05, -0.3, 1.5, 7], [0, 0, 0, 1]], "f4").astype("f8")


@unittest.skipIf(nibabel is None, "there is no nibabel on this machine")
class Nifti(ReaderTest):
    def write(self, name, samples, affine=numpy and numpy.eye(4), version=1, byteorder="<", edit=None, pair=False):
        base = {(1, False): nibabel.Nifti1Image, (1, True): nibabel.Nifti1Pair,
                (2, False): nibabel.Nifti2Image, (2, True): nibabel.Nifti2Pair}[version, pair]
        header = base.header_class(endianness=byteorder)
        header.set_data_dtype(samples.dtype)
        image = base(samples, affine, header)
        image.header.set_slope_inter(1, 0)
        if edit:
            edit(image.header)
        nibabel.save(image, self.folder / name)
        return name

    def assert_affine(self, info, affine):
        geometry = info["geometry"]
        self.assertEqual(geometry["space"], "right-anterior-superior")
        numpy.testing.assert_allclose(numpy.array(geometry["directions"]).T, affine[:3, :3], rtol=1e-6, atol=1e-6)
        numpy.testing.assert_allclose(geometry["origin"], affine[:3, 3], rtol=1e-6, atol=1e-6)

    def test_every_type_version_byte_order_and_kind_of_file(self):
        for type, version, order, name in some(
                itertools.product(TYPES, (1, 2), "<>", ("a.nii", "a.nii.gz", "a.img", "a.img.gz")), 3):
            truth = volume(type)
            if type in ("uint8", "int8") and order == ">":
                continue
            pair = ".img" in name
            self.write(name, truth, oblique(), version, order, pair=pair)
            header = name.replace(".img", ".hdr")
            if header == "a.hdr.gz" and not (self.folder / header).exists():
                header = "a.hdr"
            info = self.encodes(truth.transpose(2, 1, 0), header, what=f"{type} {version} {order} {name}")
            self.assert_affine(info, nibabel.load(self.folder / name).affine)
            for file in self.folder.glob("a.*"):
                file.unlink()

    def test_sform_goes_before_qform_and_both_are_kept(self):
        def edit(header):
            header.set_qform(numpy.diag([-2, 3, 4, 1]), 1)
            header["descrip"] = b"left as \xff it is"
        name = self.write("a.nii", volume("int16"), oblique(), edit=edit)
        header = nibabel.load(self.folder / name).header
        info = self.encoded(name)[1]
        self.assert_affine(info, header.get_sform())
        pairs = info["source"]["pairs"]
        for field, value in (("srow_x", header["srow_x"]), ("srow_y", header["srow_y"]), ("srow_z", header["srow_z"]),
                             ("qoffset_xyz", [header[f"qoffset_{axis}"] for axis in "xyz"]),
                             ("quatern_bcd", [header[f"quatern_{axis}"] for axis in "bcd"]), ("pixdim", header["pixdim"])):
            kept = numpy.array([float(word) for word in pairs.get("nifti_" + field, "0 0 0").split()], "f4")
            self.assertEqual(kept.tobytes(), numpy.array(value, "f4").tobytes(), field)
        self.assertEqual((pairs["nifti_sform_code"], pairs["nifti_qform_code"]), (str(header["sform_code"]), "1"))

        def only_qform(header):
            header.set_sform(None, 0)
            header.set_qform(numpy.array([[0, 0, -2, 5], [0, 3, 0, 6], [4, 0, 0, 7], [0, 0, 0, 1]], "f8"), 1)
        # With an affine transform, nibabel would write that as an sform.
        name = self.write("b.nii", volume("int16"), None, edit=only_qform)
        image = nibabel.load(self.folder / name)
        self.assertEqual((image.header["sform_code"], image.header["qform_code"]), (0, 1))
        self.assert_affine(self.encoded(name)[1], image.header.get_qform())

        def left_handed(header):
            header.set_sform(None, 0)
            header.set_qform(oblique() @ numpy.diag([1, 1, -1, 1]), 1, strip_shears=True)
        name = self.write("c.nii", volume("int16"), None, edit=left_handed)
        self.assert_affine(self.encoded(name)[1], nibabel.load(self.folder / name).header.get_qform())

        # The sizes of voxels must be positive; other readers take them for that, too.
        content = bytearray((self.folder / name).read_bytes())
        for at in (80, 88):  # pixdim[1] and [3]
            struct.pack_into("<f", content, at, -struct.unpack_from("<f", content, at)[0])
            (self.folder / "n.nii").write_bytes(content)
            self.assert_affine(self.encoded("n.nii")[1], nibabel.load(self.folder / name).header.get_qform())

        def none(header):
            header.set_zooms((0.5, 0.25, 3))
            header.set_xyzt_units("micron")
        info = self.encoded(self.write("d.nii", volume("int16"), None, edit=none))[1]
        self.assertEqual(info["geometry"]["spacing"], [0.5, 0.25, 3])
        self.assertEqual(info["geometry"]["units"], ["um"] * 3)
        self.assertIsNone(info["geometry"]["directions"])

    def test_forms_that_span_no_volume_are_left_out_with_a_word(self):
        self.write("a.nii", volume("int16"), oblique(), edit=lambda header: header.set_qform(None, 0))
        broken = bytearray((self.folder / "a.nii").read_bytes())
        broken[280:328] = bytes(48)
        (self.folder / "a.nii").write_bytes(broken)
        info = self.encoded("a.nii")[1]
        self.assertIn("sform does not span a volume", self.messages)
        self.assertIsNone(info["geometry"]["directions"])

    def test_one_of_several_volumes(self):
        truth = volume("int16", (9, 8, 7, 3))
        for name in ("a.nii", "a.nii.gz"):
            self.write(name, truth)
            self.assertIn("--series", self.assert_refused(64, "holds 3 volumes", "estimate", name))
            for i in range(3):
                self.encodes(truth[..., i].transpose(2, 1, 0), name, "--series", i + 1)
            for series in ("0", "4", "x", "1x"):
                self.assert_refused(64, "1 to 3", "encode", name, "--series", series)

    def test_values_with_a_slope_are_bound_in_their_units(self):
        def edit(header):
            header.set_slope_inter(2.5, -1000)
        truth = volume("int16")
        info = self.encodes(truth.transpose(2, 1, 0), self.write("a.nii", truth, edit=edit))
        self.assertEqual(info["source"]["pairs"]["nifti_scl_slope"], "2.5")
        self.tagrid("encode", "a.nii", "--max-error", "10", "-o", "b.tag")
        self.assertEqual(self.info("b.tag")["max_error"], 4)
        self.ok("verify", "b.tag", "--against", "a.nii")

    def test_bytes_behind_the_samples_are_left_out_with_a_word(self):
        truth = volume("int16")
        self.write("a.nii", truth)
        with open(self.folder / "a.nii", "ab") as file:
            file.write(b"notes")
        self.encodes(truth.transpose(2, 1, 0), "a.nii", says="5 bytes follow the samples")

    def test_samples_behind_extensions(self):
        truth = volume("int16")
        image = nibabel.Nifti1Image(truth, oblique())
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension("comment", b"x" * 10000))
        for name in ("a.nii", "a.nii.gz"):
            nibabel.save(image, self.folder / name)
            self.encodes(truth.transpose(2, 1, 0), name)

    def test_what_is_no_volume_is_refused_by_name(self):
        for type, word in (("complex64", "complex"), ("int64", "64 bits")):
            image = nibabel.Nifti1Image(numpy.zeros((3, 3, 3), type), numpy.eye(4), dtype=type)
            nibabel.save(image, self.folder / "a.nii")
            self.assert_refused(65, word, "encode", "a.nii")
        self.write("a.nii", volume("int16"))
        whole = (self.folder / "a.nii").read_bytes()
        self.assert_refused(64, "leave out --dims", "encode", "a.nii", "--dims", "23,19,7", "--type", "int16")
        self.assert_refused(64, "--rm", "encode", "a.nii", "--rm", "--strip")
        (self.folder / "short.nii").write_bytes(whole[:-1])
        self.assert_refused(65, "short.nii: ", "encode", "short.nii")
        (self.folder / "short.nii.gz").write_bytes(gzip.compress(whole)[:-9])
        self.assert_refused(65, "short.nii.gz: ", "encode", "short.nii.gz")
        self.write("pair.img", volume("int16"), pair=True)
        (self.folder / "pair.img").unlink()
        self.assert_refused(74, "pair.img", "encode", "pair.hdr")

    def test_odd_headers_are_refused_or_read_as_nibabel_does(self):
        truth = volume("int16", (9, 7, 5))
        self.write("a.nii", truth, oblique(), edit=lambda header: header.set_slope_inter(2, 10))
        whole = (self.folder / "a.nii").read_bytes()
        nan, inf = float("nan"), float("inf")
        # Where a field is, what it is, and the exit code; 0 also where nibabel refuses.
        table = [(108, "f", (offset,), code) for offset, code in ((0, 0), (352, 0), (348, 65), (351, 65), (100, 65), (352.5, 65), (nan, 65), (-1, 65), (inf, 65))]
        table += [(112, "2f", pair, 0) for pair in ((0, 5), (0, nan), (nan, nan), (nan, 0), (1, 0), (2, nan), (-2, 3), (0.5, 0))]
        table += [(40, "h", (axes,), code) for axes, code in ((0, 65), (8, 65), (-1, 65), (300, 65), (3, 0))]
        table += [(42, "3h", sizes, 65) for sizes in ((9, 7, 0), (9, -1, 5), (0, 0, 0), (9, 7, 6))]
        table += [(48, "h", (3,), 0), (70, "h", (128,), 65), (70, "h", (32,), 65), (70, "h", (1536,), 65), (70, "h", (0,), 65), (70, "h", (9999,), 65),
                  (72, "h", (8,), 0), (72, "h", (0,), 0), (123, "B", (7,), 0), (123, "B", (2 + 8,), 0)]
        table += [(80, "3f", sizes, 0) for sizes in ((0, 0, 0), (nan, 1, 1), (-1, -2, 3), (inf, 2, 1))]
        table += [(280, "f", (value,), 0) for value in (nan, inf, 0)] + [(292, "f", (nan,), 0)]
        table += [(254, "h", (0,), 0), (68, "h", (1002,), 0), (68, "h", (1007,), 0), (344, "4s", (b"abcd",), 65)]
        compared = 0
        for at, kind, values, code in table:
            with self.subTest(at=at, values=values):
                broken = bytearray(whole)
                struct.pack_into("<" + kind, broken, at, *values)
                if (at, values[0]) == (108, 0):
                    del broken[352:352 + len(broken) - 352 - truth.nbytes]
                (self.folder / "b.nii").write_bytes(broken)
                run = self.tagrid("encode", "b.nii", "-o", "b.tag", "-f")
                self.assertEqual(run.returncode, code, run.stderr)
                if code:
                    continue
                try:
                    with open(self.folder / "nibabel.log", "w") as log:
                        nibabel.imageglobals.logger.handlers = [__import__("logging").StreamHandler(log)]
                        image = nibabel.load(self.folder / "b.nii")
                        theirs, affine, forms = image.get_fdata(), image.affine, (image.header["sform_code"], image.header["qform_code"])
                    # Where vox_offset is 0, nibabel reads the header as samples.
                    if (at, values[0]) == (108, 0):
                        raise ValueError("vox_offset")
                except Exception as error:
                    # Never silently where others give up.
                    self.assertIn("warning", run.stderr, error)
                    continue
                compared += 1
                self.ok("decode", "b.tag", "-o", "b.raw", "-f")
                info = self.info("b.tag")
                samples = numpy.fromfile(self.folder / "b.raw", info["type"]).reshape(5, 7, 9)
                pairs, geometry = info["source"]["pairs"], info["geometry"]
                ours = samples * float(pairs.get("rescale_slope", 1)) + float(pairs.get("rescale_intercept", 0))
                numpy.testing.assert_allclose(ours, theirs.transpose(2, 1, 0), rtol=1e-6)
                if geometry["directions"] is not None and numpy.isfinite(affine).all():
                    numpy.testing.assert_allclose(numpy.array(geometry["directions"]).T, affine[:3, :3], rtol=1e-5, atol=1e-5)
        self.assertGreater(compared, 20)

    def test_a_slope_without_an_intercept_counts(self):
        truth = volume("int16")
        self.write("a.nii", truth, edit=lambda header: header.set_slope_inter(2, 0))
        content = bytearray((self.folder / "a.nii").read_bytes())
        struct.pack_into("<f", content, 116, float("nan"))
        (self.folder / "a.nii").write_bytes(content)
        info = self.encodes(truth.transpose(2, 1, 0), "a.nii", "--max-error", "0")
        self.assertIn("scl_inter is \"nan\", which is not a number; it counts as 0", self.messages)
        self.assertEqual(info["source"]["pairs"]["rescale_slope"], "2")
        # A slope that is not there, and an intercept that is.
        struct.pack_into("<2f", content, 112, float("nan"), 5)
        (self.folder / "a.nii").write_bytes(content)
        self.assertIn("scl_slope is nan", self.assert_refused(64, "--max-error", "encode", "a.nii", "--max-error", "5"))

    def test_samples_without_their_header_are_told_where_it_is(self):
        truth = volume("int16")
        self.write("pair.img", truth, oblique(), pair=True)
        message = self.assert_refused(65, "pair.hdr describes its samples; give that file", "encode", "pair.img")
        self.assertNotIn("--dims", message)
        self.encodes(truth.transpose(2, 1, 0), "pair.hdr")
        (self.folder / "pair.hdr").rename(self.folder / "pair.old")
        self.assert_refused(65, "pair.hdr, which is missing", "encode", "pair.img")
        (self.folder / "pair.old").rename(self.folder / "pair.hdr")
        self.ok("encode", "pair.hdr", "-f")
        # A volume before NIfTI.
        nibabel.save(nibabel.AnalyzeImage(truth, numpy.eye(4)), self.folder / "old.img")
        for name in ("old.img", "old.hdr"):
            self.assert_refused(65, "is the header of an Analyze 7.5 volume, which does not record its orientation; convert it to NIfTI first", "encode", name)
        nibabel.save(nibabel.Nifti1Image.from_image(nibabel.load(self.folder / "old.img")), self.folder / "new.nii")
        self.encodes(truth.transpose(2, 1, 0), "new.nii")
        # A file that is cut short is no file of samples alone.
        self.write("a.nii", truth)
        self.write("a.nii.gz", truth)
        for name in ("a.nii", "a.nii.gz"):
            (self.folder / name).write_bytes((self.folder / name).read_bytes()[:200])
            self.assertNotIn("--dims", self.assert_refused(65, name + ": ", "encode", name))

    def test_damaged_headers_are_errors_or_other_volumes_and_no_more(self):
        self.write("a.nii", volume("int16"), oblique())
        whole = (self.folder / "a.nii").read_bytes()
        random = numpy.random.default_rng(1)
        for i in range(60):
            broken = bytearray(whole)
            for _ in range(random.integers(1, 6)):
                broken[random.integers(0, 352)] = random.integers(0, 256)
            name = "broken.nii" if i % 2 else "broken.nii.gz"
            (self.folder / name).write_bytes(broken if i % 2 else gzip.compress(broken))
            run = self.tagrid("encode", name, "-o", "broken.tag", "-f", "-q", "--range", "0:1000")
            self.assertIn(run.returncode, (0, 64, 65), f"{i}: {run.stderr}")

    def test_files_that_others_made(self):
        folder = pathlib.Path(nibabel.__file__).parent / "tests" / "data"
        count = 0
        for name in ("example_nifti2.nii.gz", "example4d.nii.gz", "anatomical.nii", "functional.nii", "standard.nii.gz",
                     "reoriented_anat_moved.nii"):
            if not (folder / name).exists():
                continue
            image = nibabel.load(folder / name)
            truth = numpy.asanyarray(image.dataobj.get_unscaled())
            shutil.copy(folder / name, self.folder)
            series = []
            if truth.ndim > 3:
                truth, series = truth[..., 1], ["--series", "2"]
            info = self.encodes(truth.transpose(2, 1, 0), name, *series, what=name)
            self.assert_affine(info, image.affine)
            count += 1
        if count == 0:
            print("skipped: nibabel's files are not on this machine")


if __name__ == "__main__":
    main()
