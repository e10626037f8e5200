"""What a format cannot hold is said, and what is not said comes back: other people's libraries find it in the file."""

import itertools
import json
import unittest

from other_readers import ReaderTest, h5py, main, nibabel, numpy, tifffile, vtk_image, vtk_numpy, vtk_xml

SHAPE = (3, 4, 5)
DIAGONAL = ((0.5, 0, 0), (0, 0.25, 0), (0, 0, 3))
TURNED = ((0.4, 0.3, 0), (-0.3, 0.4, 0), (0, 0, 2.5))
SHEARED = ((0.5, 0, 0), (0, 0.5, 0), (0.1, 0.2, 2.5))
LPS = "space: left-posterior-superior\n"
# Where a file has the lines of the header, tagrid finds everything in it again.
WITH_HEADER = ("b.nrrd", "b.h5", "b.vtkhdf")
WITHOUT = ("b.nii", "b.nii.gz", "b.mha", "b.mhd", "b.tif", "b.vti")


def placed(directions, space=LPS, unit="mm", origin=(10, -20, 30.5)):
    return space + f"space directions: {' '.join('(' + ','.join(map(str, d)) + ')' for d in directions)}\n" + \
        f"space origin: ({','.join(map(str, origin))})\n" + (f'space units: "{unit}" "{unit}" "{unit}"\n' if unit else "")


@unittest.skipIf(None in (numpy, nibabel, tifffile, h5py, vtk_image, vtk_xml, vtk_numpy), "libraries are missing")
class Lost(ReaderTest):
    def encode(self, fields, shape=SHAPE, type="int16"):
        samples = numpy.arange(numpy.prod(shape), dtype=type).reshape(shape)
        self.write_nrrd("a.nrrd", samples, fields)
        self.encode_file("a.nrrd")

    def encode_file(self, name):
        self.ok("encode", name, "-o", "a.tag", "-f", "--range", "auto")

    def decode(self, name, *options):
        return self.ok("decode", "a.tag", "-o", name, "-f", *options).stderr

    def header_of(self, name):
        """The lines that tagrid finds in a file that has them."""
        self.ok("encode", name, "-o", "again.tag", "-f", "--range", "auto")
        self.ok("decode", "again.tag", "-o", "again.nrrd", "-f")
        return (self.folder / "again.nrrd").read_bytes().split(b"\n\n")[0].decode()

    def image(self, name):
        readers = {".mha": vtk_image.vtkMetaImageReader, ".mhd": vtk_image.vtkMetaImageReader,
                   ".vti": vtk_xml.vtkXMLImageDataReader}
        reader = readers[(self.folder / name).suffix]()
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        return reader.GetOutput()

    def affine(self, name):
        """Places of samples in the world of the format."""
        affine = numpy.eye(4)
        if ".nii" in name:
            return nibabel.load(self.folder / name).affine
        if name.endswith((".mha", ".mhd")):  # VTK 9.1 does not read its matrix
            lines = dict(line.split(" = ") for line in (self.folder / name).read_bytes().decode("latin-1").splitlines()[:20] if " = " in line)
            numbers = {key: numpy.array([float(n) for n in lines[key].split()]) for key in ("ElementSpacing", "TransformMatrix", "Offset") if key in lines}
            affine[:3, :3] = numbers.get("TransformMatrix", numpy.eye(3).ravel()).reshape(3, 3).T * numbers.get("ElementSpacing", numpy.ones(3))
            affine[:3, 3] = numbers.get("Offset", numpy.zeros(3))
            return affine
        image = self.image(name)
        matrix = image.GetDirectionMatrix()
        affine[:3, :3] = numpy.array([[matrix.GetElement(i, j) for j in range(3)] for i in range(3)]) * image.GetSpacing()
        affine[:3, 3] = image.GetOrigin()
        return affine

    def test_places_come_back_or_their_loss_is_said(self):
        for directions, unit in itertools.product((DIAGONAL, TURNED, SHEARED), ("mm", "")):
            self.encode(placed(directions, unit=unit))
            truth = numpy.eye(4)
            truth[:3, :3], truth[:3, 3] = numpy.array(directions).T, (10, -20, 30.5)
            for name in WITHOUT:
                said = self.decode(name)
                what = f"{directions} {unit} {name}: {said}"
                if name == "b.tif":
                    self.assertIn("TIFF has no place for positions and directions", said, what)
                    self.assertEqual("the spacing is not written: its unit is unknown" in said, unit == "", what)
                    continue
                expected = numpy.diag([-1, -1, 1, 1]) @ truth if ".nii" in name else truth
                numpy.testing.assert_allclose(self.affine(name), expected, atol=2e-6, err_msg=what)
                self.assertEqual(said == "", name != "b.vti", what)
                if name == "b.vti":
                    self.assertIn('does not name the space "left-posterior-superior"' + (' and the unit "mm"' if unit else ""), said)
            for name in WITH_HEADER:
                self.assertIn(placed(directions, unit=unit), self.header_of("a.nrrd") + "\n")
                said = self.decode(name)
                self.assertIn(placed(directions, unit=unit), self.header_of(name) + "\n", name)
                self.assertEqual("VTK 9.1 ignores the directions" in said,
                                 name == "b.vtkhdf" and directions != DIAGONAL, said)

    def test_everything_else_comes_back_or_its_loss_is_said(self):
        slices = "slice_positions:=0 0 0; 0 0 1; 0 0 9\n"
        own = "slice_slopes:=1 2 3\nslice_intercepts:=0 0 0\n"
        # Fields, words of the warning, and the formats that have no place for them.
        everywhere = set(WITHOUT)
        for fields, words, lost in (
                ("space dimension: 3\n" + placed(DIAGONAL, space=""), "is not known", everywhere - {"b.tif", "b.vti"}),
                ("spacings: 0.5 0.25 nan\nunits: \"mm\" \"mm\" \"mm\"\n", "a spacing is unknown",
                 everywhere - {"b.tif"} | {"b.vtkhdf"}),
                ("spacings: 0.5 0.25 3\nunits: \"um\" \"um\" \"um\"\n", 'does not name the unit "um"', {"b.vti"}),
                ("spacings: 0.5 0.25 3\n", "the spacing is not written", {"b.tif"}),
                ("spacings: -0.5 0.25 3\nunits: \"um\" \"um\" \"um\"\n", "positions and directions", {"b.tif"}),
                (slices, "slices lie at unequal distances", everywhere | {"b.vtkhdf"}),
                (own, "slices have individual slopes", everywhere | {"b.vtkhdf"}),
                ("rescale_units:=BQML\n", "values are in \"BQML\"", everywhere - {"b.tif"}),
                ("rescale_units:=HU\n", "HU", set()),  # every CT series has it, and values are right
                ("owner:=me\nyear:=1999\n", 'no place for 2 key/value pairs ("owner", "year")', everywhere),
                ("a:=1\nb:=2\nc:=3\nd:=4\n", '4 key/value pairs ("a", "b", "c", ...)', everywhere),
                ("lossy source:=TIFF, JPEG\n", '1 key/value pair ("lossy source")', {"b.vti"}),
                ("# by hand\n", "no place for comments", everywhere),
                ("content: a scan\n", 'the field "content"', everywhere),
                ("labels: \"a\" \"b\" \"c\"\n", 'the field "labels"', everywhere),
                ("nifti_descrip:=a scan\n", "key/value pair", everywhere - {"b.nii", "b.nii.gz"}),
                ("metaimage_Modality:=MET_MOD_CT\n", "key/value pair", everywhere - {"b.mha", "b.mhd"}),
                ("metaimage_CenterOfRotation:=1 0 0\n", '1 key/value pair ("metaimage_CenterOfRotation")', everywhere - {"b.mha", "b.mhd"}),
                # What the geometry says, too, and what ITK writes into every file.
                ("metaimage_CenterOfRotation:=0 0 0\nmetaimage_AnatomicalOrientation:=RAI\nhdf5_element_size_um:=1 1 1\n", "no place for", set()),
                ("nifti_pixdim:=1 1 1 1 0 0 0 0\nnifti_scl_slope:=1\nnifti_quatern_bcd:=0 1 0\nnifti_qoffset_xyz:=1 2 3\n", "no place for", set()),
                ("# Complete NRRD file format specification at:\n# http://teem.sourceforge.net/nrrd/format.html\nkinds: domain domain domain\n",
                 "no place for", set())):
            self.encode(fields)
            for name in WITHOUT + WITH_HEADER:
                said = self.decode(name)
                self.assertEqual(words in said, name in lost, f"{fields} {name}: {said}")
                if name in WITH_HEADER:
                    self.assertIn(fields, self.header_of(name) + "\n", name)
        self.encode("owner:=me\ndicom_PatientName:=Doe\ndicom_Modality:=CT\nslice_sop_instance_uids:=1 2 3\n")
        for name in WITHOUT:  # nobody expects attributes of DICOM there
            self.assertIn(f'{name[1:]} files have no place for 1 key/value pair ("owner")', self.decode(name))
            self.assertNotIn("DICOM", self.decode(name))
            self.assertIn('no place for 3 attributes of DICOM ("dicom_PatientName"', self.decode(name, "-v"))
        self.encode("spacings: 1 1 1\nrescale_units:=HU\n")
        for name in WITHOUT:
            self.assertEqual("no place for the unit of values (HU)" in self.decode(name, "-v"), name != "b.tif", name)
        self.encode("spacings: 1 1 1\ndicom_Modality:=CT\n")
        self.assertEqual(self.decode("b.mha"), "")
        self.encode("spacings: 1 1 1\nnifti_descrip:=a scan\nnifti_aux_file:=other\nnifti_toffset:=2.5\nnifti_intent_p1_p2_p3:=1 2 3\nnifti_slice_end:=2\nnifti_slice_code:=1\n")
        self.assertEqual(self.decode("b.nii"), "")
        header = nibabel.load(self.folder / "b.nii").header
        self.assertEqual([header[key].tolist() for key in ("descrip", "aux_file", "toffset", "intent_p1", "intent_p3", "slice_end", "slice_code")],
                         [b"a scan", b"other", 2.5, 1, 3, 2, 1])
        self.decode("b.nii", "--region", ":,:,0:2")
        self.assertEqual(int(nibabel.load(self.folder / "b.nii").header["slice_end"]), 0)

    def loss_of(self, name):
        self.ok("encode", name, "-o", "again.tag", "-f", "--range", "auto")
        return json.loads(self.ok("info", "again.tag", "--json").stdout)["source"]["pairs"].get("lossy source")

    def test_a_loss_is_remembered_by_every_format_that_is_read(self):
        said = "tagrid, maximum error 5"

        def other_reader_of(name):
            if name == "b.nii":
                return nibabel.load(self.folder / name).header["descrip"].item().decode()
            if name == "b.tif":
                with tifffile.TiffFile(self.folder / name) as file:
                    return "lossy source: " + file.imagej_metadata["lossy source"]
            with h5py.File(self.folder / name) as file:
                return "lossy source: " + file["volume"].attrs["lossy source"]

        names = set(WITHOUT + WITH_HEADER) - {"b.vti"} | {"b.h5", "b.ome.zarr", "b.nrrd"}
        for fields, before in (("spacings: 1 1 1\n", ""), ("nifti_descrip:=a scan\nlossy source:=TIFF, JPEG\n", "TIFF, JPEG; ")):
            self.encode(fields)
            for name in names:
                self.decode(name)
                self.assertEqual(self.loss_of(name), before[:-2] or None, name)
            self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", "--range", "auto", "--max-error", "5")
            for name in names:
                # It says nothing of what is lost: no format loses more than of a lossless file.
                self.assertNotIn("lossy source", self.decode(name))
                self.assertEqual(self.loss_of(name), before + said, name)
                if name in ("b.nii", "b.tif", "b.h5"):
                    self.assertIn("lossy source: " + before + said, other_reader_of(name), name)
            self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", "--range", "auto", "--max-error", "5", "--strip")
            self.decode("b.nrrd")
            # A header may say anything, names of patients, too.
            self.assertEqual(self.loss_of("b.nrrd"), ("an earlier compression; " if before else "") + said)
        # Bounds are in values, and each loss adds to those before.
        self.encode("rescale_slope:=2.5\nrescale_intercept:=-3\n")
        self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", "--range", "auto", "--max-error", "5")
        self.decode("b.nii")
        self.assertEqual(self.loss_of("b.nii"), said)
        self.ok("encode", "b.nii", "-o", "a.tag", "-f", "--range", "auto", "--max-error", "10")
        self.decode("b.mha", "--samples")
        self.assertEqual(self.loss_of("b.mha"), said + "; tagrid, maximum error 10")
        self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", "--range", "auto", "--grid-only")
        self.decode("b.nrrd")
        self.assertEqual(self.loss_of("b.nrrd"), "tagrid, without a bound")

    def test_a_loss_takes_the_place_of_the_end_of_a_long_text(self):
        self.encode(f"nifti_descrip:={'a long text ' * 8}\n")
        self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", "--range", "auto", "--max-error", "5")
        self.decode("b.nii")
        text = nibabel.load(self.folder / "b.nii").header["descrip"].item().decode()
        self.assertEqual(len(text), 79)
        self.assertTrue(text.startswith("a long text a") and text.endswith("; lossy source: tagrid, maximum error 5"), text)

    def lengths(self, name):
        """Spacings as programs take them, in millimetres: they have a unit of their own, or that of the file."""
        unit = {"m": 1000, "meter": 1000, "mm": 1, "um": 1e-3, "micron": 1e-3, "\\u00B5m": 1e-3}
        if ".nii" in name:
            header = nibabel.load(self.folder / name).header
            return numpy.array(header.get_zooms()) * unit[header.get_xyzt_units()[0]]
        if name == "b.tif":
            with tifffile.TiffFile(self.folder / name) as file:
                tags, known = file.pages[0].tags, file.imagej_metadata
                x, y = tags["XResolution"].value, tags["YResolution"].value
                return numpy.array([x[1] / x[0], y[1] / y[0], known["spacing"]]) * unit[known["unit"]]
        if name == "b.vtkhdf":
            return h5py.File(self.folder / name)["VTKHDF"].attrs["Spacing"]
        return numpy.array(self.image(name).GetSpacing())  # millimetres

    def test_other_formats_have_one_unit(self):
        of_first = ("b.tif", "b.vti", "b.vtkhdf")
        for units, spacing, truth in ((("mm", "mm", "um"), (0.5, 0.25, 3), (0.5, 0.25, 0.003)), (("mm", "cm", "inch"), (0.5, 0.25, 3), (0.5, 2.5, 76.2)),
                                      (("mm", "microns", "\u00b5m"), (0.5, 250, 3), (0.5, 0.25, 0.003)), (("mm", "m", "nm"), (1, 1e-3, 5e5), (1, 1, 0.5)),
                                      (("mm", "mm", "Millimeters"), (0.5, 0.25, 3), (0.5, 0.25, 3))):
            texts = " ".join(f'"{unit}"' for unit in units)
            directions = [[s if i == axis else 0 for i in range(3)] for axis, s in enumerate(spacing)]
            for fields in (f"spacings: {' '.join(map(str, spacing))}\nunits: {texts}\n", placed(directions, unit="") + f"space units: {texts}\n"):
                self.encode(fields)
                for name in WITHOUT + ("b.vtkhdf",):
                    said = self.decode(name)
                    self.assertNotIn("different units", said)
                    numpy.testing.assert_allclose(self.lengths(name), truth, rtol=1e-6, err_msg=f"{units} {name}")
                    if "space" in fields and name != "b.tif" and name != "b.vtkhdf":
                        place = self.affine(name)[:3, 3] * ([-1, -1, 1] if ".nii" in name else 1)
                        factor = numpy.array(truth) / spacing
                        numpy.testing.assert_allclose(place, (10, -20, 30.5) * factor, rtol=1e-6, err_msg=f"{units} {name}")
                for name in WITH_HEADER:
                    self.decode(name)
                    self.assertIn(fields, self.header_of(name) + "\n", name)
                self.ok("verify", "a.tag", "--against", "b.mha")
        # One unit that a format does not have; those of the first axis stay where a format has any.
        for unit, name, factor in (("um", "b.mha", 1e-3), ("micron", "b.nii", 1e-3), ("cm", "b.nii", 10), ("inch", "b.mhd", 25.4), ("nm", "b.nii.gz", 1e-6),
                                   ("\u00b5m", "b.tif", 1e-3), ("m", "b.mha", 1000)):
            self.encode(f'spacings: 0.5 0.25 3\nunits: "{unit}" "{unit}" "{unit}"\n')
            self.assertEqual(self.decode(name), "", unit)
            numpy.testing.assert_allclose(self.lengths(name), numpy.array((0.5, 0.25, 3)) * factor, rtol=1e-6, err_msg=f"{unit} {name}")
        for units in (("mm", "mm", "s"), ("mm", "", "mm"), ("furlong", "mm", "mm")):
            texts = " ".join(f'"{unit}"' for unit in units)
            self.encode(f"spacings: 0.5 0.25 3\nunits: {texts}\n")
            for name in WITHOUT + ("b.vtkhdf",):
                self.assertIn("axes have different units", self.decode(name), f"{units} {name}")
            for name in ("b.h5", "b.nrrd"):
                self.assertEqual(self.decode(name), "")
        self.encode('spacings: 0.5 0.25 3\nunits: "furlong" "furlong" "furlong"\n')
        self.assertIn('does not know the unit "furlong"', self.decode("b.nii"))
        self.assertIn('MetaImage does not know the unit "furlong"', self.decode("b.mha"))
        # A MetaImage file said this to others before.
        (self.folder / "m.mha").write_bytes(b"NDims = 3\nDistanceUnits = um\nElementSpacing = 0.5 0.25 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
                                            b"ElementDataFile = LOCAL\n12345678")
        self.encode_file("m.mha")
        self.assertEqual(self.decode("b.mha"), "")
        self.assertEqual(self.image("b.mha").GetSpacing(), (0.5, 0.25, 3))
        self.assertIn(b"DistanceUnits = um\n", (self.folder / "b.mha").read_bytes())

    def test_a_nifti_file_gets_the_forms_that_it_had(self):
        samples = numpy.arange(60, dtype="int16").reshape(5, 4, 3)
        one, two = numpy.eye(4), numpy.eye(4)
        one[:3, :3], one[:3, 3] = numpy.array(TURNED).T, (1, 2, 3)
        two[:3, :3], two[:3, 3] = numpy.diag([-0.5, 0.5, 2.5]), (-7, 0, 9)
        for qform, sform in ((one, None), (None, one), (one, one), (one, two), (two, one)):
            image = nibabel.Nifti1Image(samples, None)
            image.header.set_xyzt_units("mm")
            for set_form, form, code in ((image.header.set_qform, qform, 1), (image.header.set_sform, sform, 3)):
                set_form(form, code if form is not None else 0)
            nibabel.save(image, self.folder / "a.nii")
            truth = nibabel.load(self.folder / "a.nii")
            self.encode_file("a.nii")
            for name in ("b.nii", "b.nii.gz"):
                self.assertEqual(self.decode(name), "")
                found = nibabel.load(self.folder / name)
                for key in ("qform_code", "sform_code"):
                    self.assertEqual(int(found.header[key]), int(truth.header[key]), key)
                numpy.testing.assert_allclose(found.affine, truth.affine, atol=1e-5)
                if qform is not None:
                    numpy.testing.assert_allclose(found.header.get_qform(), qform, atol=1e-5)
                    numpy.testing.assert_allclose(found.header.get_zooms(), truth.header.get_zooms(), rtol=1e-6)
                if sform is not None:
                    numpy.testing.assert_allclose(found.header.get_sform(), sform, atol=1e-5)
            differ = qform is not None and sform is not None and qform is not sform
            said = self.decode("b.nii", "--region", "1:,:,:")
            self.assertEqual("only the sform is written" in said, differ, said)
            part = nibabel.load(self.folder / "b.nii")
            numpy.testing.assert_allclose(part.affine[:, 3], truth.affine @ (1, 0, 0, 1), atol=1e-5)
            self.assertEqual(int(part.header["qform_code"]) > 0, qform is not None and not differ)


if __name__ == "__main__":
    main()
