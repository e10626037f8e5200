"""DICOM series that leave an archive as images of their own, as pydicom, DCMTK and dciodvfy see them."""

import shutil
import signal
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, main, numpy, pydicom
from scans import BIG, IMPLICIT, LITTLE, data_set, enhanced_ct, sequence, volume

# What an export changes, and what it changes if samples are not exact.
ALWAYS = {"SOPInstanceUID", "SeriesInstanceUID", "SourceImageSequence"}
IF_LOSSY = {"LossyImageCompression", "LossyImageCompressionRatio", "LossyImageCompressionMethod", "ImageType",
            "DerivationDescription", "DerivationCodeSequence"}
GONE_IF_LOSSY = {"SmallestImagePixelValue", "LargestImagePixelValue"}

# With these, dciodvfy finds no error in the originals.
COMPLETE = dict.fromkeys(("PatientBirthDate", "PatientSex", "StudyDate", "StudyTime", "ReferringPhysicianName", "StudyID",
                          "AccessionNumber", "SeriesNumber", "Laterality", "PositionReferenceIndicator", "Manufacturer", "KVP",
                          "AcquisitionNumber"), "") | {"PatientPosition": "HFS", "FrameOfReferenceUID": "1.2.9",
                                                       "ImageType": ["ORIGINAL", "PRIMARY", "AXIAL"],
                                                       "SmallestImagePixelValue": 1, "LargestImagePixelValue": 2}


def content(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def samples_of(file):
    """With a sign, where there is one."""
    file.file_meta.setdefault("TransferSyntaxUID", LITTLE)
    return file.pixel_array.astype("int64")


@unittest.skipIf(pydicom is None, "there is no pydicom on this machine")
class DicomExport(ReaderTest):
    def write(self, samples, folder="s", names="i{:03}.dcm", change=None, **attributes):
        attributes = COMPLETE | attributes
        for z, slice in enumerate(samples):
            file = data_set(slice, instance=f"1.2.3.{z + 1}", number=z + 1, position=(0, 0, 1.5 * z), **attributes)
            for tag in (0x00280106, 0x00280107):
                file[tag].VR = "SS" if file.PixelRepresentation else "US"
            if change:
                change(file)
            self.save(f"{folder}/{names.format(z)}", file)
        return folder

    def encode(self, path, *options, name="a"):
        (self.folder / "tags").mkdir(exist_ok=True)
        self.ok("encode", path, "-o", f"tags/{name}.tag", "-f", *options)

    def export(self, *arguments, target="out"):
        return self.ok("archive", "export", "tags", "name=*", "--format", "dicom", "-o", target, *arguments)

    def exported(self, path, *options):
        """Encodes and exports a series. Returns the directory of the new one."""
        self.encode(path, *options)
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        self.export()
        return self.folder / "out" / "a"

    def run_tool(self, *command):
        """What a program of others prints; none if it is missing."""
        if not shutil.which(command[0]):
            print(f"skipped: there is no {command[0]} on this machine")
            return None
        return subprocess.run([str(part) for part in command], cwd=self.folder, text=True, errors="replace",
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def errors(self, path):
        """Errors of dciodvfy, without what differs from file to file."""
        run = self.run_tool("dciodvfy", path)
        return None if run is None else {line for line in run.stdout.splitlines() if line.startswith("Error")}

    def compare(self, path, exported, bound=None, changed=frozenset(), has_meta=True):
        """The exported series is the one at `path`, within `bound` stored numbers, but for what an export changes."""
        path = self.folder / path
        originals = {"": path} if path.is_file() else {str(p.relative_to(path)): p for p in path.rglob("*") if p.is_file()}
        files = {str(p.relative_to(exported)): p for p in exported.rglob("*") if p.is_file()}
        self.assertEqual(set(files), {path.name} if path.is_file() else set(originals))
        allowed = ALWAYS | set(changed) | (IF_LOSSY if bound else set())
        largest, instances, series, of_original = 0, set(), set(), set()
        for name, original in originals.items():
            new_path = files[name or path.name]
            old, new = pydicom.dcmread(original, force=True), pydicom.dcmread(new_path)
            largest = max(largest, numpy.abs(samples_of(new) - samples_of(old)).max())
            for element in old:
                if bound and element.keyword in GONE_IF_LOSSY:
                    self.assertNotIn(element.tag, new, element)
                elif element.keyword != "PixelData" and element.keyword not in allowed:
                    self.assertEqual(new[element.tag], element, name)
                    self.assertEqual(new[element.tag].VR, element.VR, name)
            self.assertLessEqual({new[tag].keyword for tag in set(new.keys()) - set(old.keys())}, allowed)
            for element in old.file_meta:
                if has_meta and element.keyword not in ("FileMetaInformationGroupLength", "TransferSyntaxUID", "MediaStorageSOPInstanceUID"):
                    self.assertEqual(new.file_meta[element.tag], element)
            self.assertEqual(new.file_meta.MediaStorageSOPInstanceUID, new.SOPInstanceUID)
            for uid in (new.SOPInstanceUID, new.SeriesInstanceUID):
                self.assertRegex(uid, r"^2\.25\.[1-9][0-9]{30,38}$")
                self.assertTrue(pydicom.uid.UID(uid).is_valid)
            instances.add(new.SOPInstanceUID)
            series.add(new.SeriesInstanceUID)
            of_original |= {old.SOPInstanceUID, old.SeriesInstanceUID}
            source = new.SourceImageSequence[-1]
            self.assertEqual((source.ReferencedSOPClassUID, source.ReferencedSOPInstanceUID), (old.SOPClassUID, old.SOPInstanceUID))
            self.assertEqual("PurposeOfReferenceCodeSequence" in source, bool(bound))
            if bound:
                self.assert_marked(old, new)
            self.assert_valid(original, new_path)
        self.assertEqual((len(instances), len(series)), (len(files), 1))
        self.assertFalse((instances | series) & of_original)
        if bound:
            self.assertTrue(0 < largest <= bound, largest)
        else:
            self.assertEqual(largest, 0)

    def assert_marked(self, old, new):
        self.assertEqual(new.LossyImageCompression, "01")
        ratios, methods = (value if isinstance(value, pydicom.multival.MultiValue) else [value]
                           for value in (new.LossyImageCompressionRatio, new.LossyImageCompressionMethod))
        self.assertEqual((len(ratios), methods[-1]), (len(methods), "TAGRID"))
        tag = self.folder / "tags" / "a.tag"
        raw = self.info("tags/a.tag")
        size = numpy.dtype(raw["type"]).itemsize * numpy.prod(raw["dims"])
        self.assertAlmostEqual(float(ratios[-1]), size / tag.stat().st_size, delta=1e-3)
        if "ImageType" in old:
            self.assertEqual(list(new.ImageType), ["DERIVED", *old.ImageType[1:]])
        self.assertIn("lossy compression by tagrid; samples differ from those of the original by at most ", new.DerivationDescription)
        code = new.DerivationCodeSequence[-1]
        self.assertEqual((code.CodeValue, code.CodingSchemeDesignator, code.CodeMeaning), ("113040", "DCM", "Lossy Compression"))

    def assert_valid(self, original, exported):
        for command in (("dcmdump", "-q"), ("dcmftest",)):
            run = self.run_tool(*command, exported)
            if run:
                self.assertEqual((run.returncode, "error" in run.stdout.lower() or "warning" in run.stdout.lower()), (0, False), run.stdout[-500:])
        before = self.errors(original)
        if before is not None:
            self.assertLessEqual(self.errors(exported), before)

    def assert_encodes_again(self, exported):
        """tagrid reads the new series as it decodes the file that it comes from."""
        self.ok("encode", exported, "-o", "again.tag", "-f")
        found = []
        for name in ("tags/a.tag", "again.tag"):
            self.ok("decode", name, "-o", "x.raw", "-f", "--samples")
            info = self.info(name)
            found.append(((self.folder / "x.raw").read_bytes(), info["dims"], info["type"], info["geometry"]))
        self.assertEqual(found[0], found[1])

    KINDS = {
        "unsigned": {}, "implicit": {"syntax": IMPLICIT}, "big endian": {"syntax": BIG},
        "signed": {"PixelRepresentation": 1, "BitsStored": 16, "HighBit": 15, "RescaleSlope": "2", "RescaleIntercept": "-7"},
        "8 bits": {"BitsAllocated": 8, "BitsStored": 8, "HighBit": 7, "RescaleSlope": "1", "RescaleIntercept": "0"},
    }

    def samples(self, what):
        kind = self.KINDS[what]
        bits = kind.get("BitsStored", 12)
        return volume(bits, shape=(5, 20, 31), signed=kind.get("PixelRepresentation", 0) == 1)

    def test_exact_samples_have_the_same_headers_and_no_mark_of_a_loss(self):
        for what, kind in self.KINDS.items():
            with self.subTest(what):
                exported = self.exported(self.write(self.samples(what), **kind))
                self.compare("s", exported)
                self.assertNotIn("LossyImageCompression", pydicom.dcmread(exported / "i000.dcm"))
                self.assert_encodes_again(exported)

    def test_lossy_samples_are_within_the_bound_and_marked(self):
        for what, kind in self.KINDS.items():
            with self.subTest(what):
                exported = self.exported(self.write(self.samples(what), **kind), "--max-error", "7")
                self.compare("s", exported, bound=3 if what == "signed" else 7)
                self.assert_encodes_again(exported)
                # A number has its unit, and that of stored samples its value.
                words = pydicom.dcmread(exported / "i000.dcm").DerivationDescription
                self.assertRegex(words, r"at most [0-9]+ in stored samples \([0-9]+ HU\)$" if what == "signed" else "at most [0-9]+" + (" HU$" if what != "8 bits" else "$"))

    def test_dciodvfy_finds_no_error(self):
        self.write(self.samples("unsigned"))
        for bound in ("0", "7"):
            for path in (self.folder / "s" / "i000.dcm", self.exported("s", "--max-error", bound) / "i000.dcm"):
                self.assertIn(self.errors(path), (set(), None))

    def test_a_bound_that_nothing_needed_marks_nothing(self):
        flat = numpy.full((5, 20, 31), 100)
        self.compare("s", self.exported(self.write(flat), "--max-error", "3"))

    def test_the_same_export_has_the_same_bytes_and_another_bound_has_other_uids(self):
        self.write(volume(shape=(5, 20, 31)))
        seen = {}
        for bound in ("0", "2", "9"):
            exported = self.exported("s", "--max-error", bound)
            first = content(exported)
            self.export("-f")
            self.export(target="other")
            self.assertEqual(first, content(exported))
            self.assertEqual(first, content(self.folder / "other" / "a"))
            shutil.rmtree(self.folder / "other")
            seen[bound] = pydicom.dcmread(exported / "i000.dcm").SeriesInstanceUID
        self.assertEqual(len(set(seen.values())), 3)

    def test_compressed_sources_become_plain(self):
        self.write(volume(shape=(5, 20, 31)), folder="plain")
        for command in (["dcmconv", "+td"], ["dcmcjpeg", "+e1", "+un"], ["dcmcrle"], ["dcmcjpls", "+el"], ["gdcmconv", "--j2k"]):
            with self.subTest(command[0]):
                shutil.rmtree(self.folder / "s", ignore_errors=True)
                (self.folder / "s").mkdir()
                for file in (self.folder / "plain").iterdir():
                    if (run := self.run_tool(*command, file, f"s/{file.name}")) is None:
                        break
                    self.assertEqual(run.returncode, 0, run.stdout)
                else:
                    for bound in ("0", "7"):
                        exported = self.exported("s", "--max-error", bound)
                        self.assertEqual(pydicom.dcmread(exported / "i000.dcm").file_meta.TransferSyntaxUID, LITTLE)
                        # These programs say what they did, in the same attributes.
                        self.compare("plain", exported, bound=int(bound), changed=IF_LOSSY, has_meta=False)

    def test_a_loss_that_only_the_compression_told_is_marked(self):
        self.write(volume(8, shape=(5, 16, 32)), BitsAllocated=8, BitsStored=8, HighBit=7, RescaleIntercept="0")
        if self.run_tool("dcmcjpeg", "--help") is None:
            return
        for path in (self.folder / "s").iterdir():
            self.assertEqual(self.run_tool("dcmcjpeg", "+eb", path, path).returncode, 0)
            file = pydicom.dcmread(path)
            for keyword in IF_LOSSY - {"ImageType"}:
                if keyword in file:
                    del file[keyword]
            file.save_as(path)
        exported = self.exported("s")
        for path in exported.iterdir():
            self.assertEqual(pydicom.dcmread(path).LossyImageCompression, "01")

    def test_earlier_losses_and_sources_stay_before_the_new_one(self):
        earlier = pydicom.Dataset()
        earlier.ReferencedSOPClassUID, earlier.ReferencedSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", "1.9"
        code = pydicom.Dataset()
        code.CodeValue, code.CodingSchemeDesignator, code.CodeMeaning = "113076", "DCM", "Segmentation"
        def change(file):
            file.SourceImageSequence = pydicom.Sequence([earlier])
            file.DerivationCodeSequence = pydicom.Sequence([code])
            for sequence in (file["SourceImageSequence"], file["DerivationCodeSequence"]):
                sequence.is_undefined_length = True
                sequence.value[0].is_undefined_length_sequence_item = True
        self.write(volume(shape=(5, 20, 31)), change=change, LossyImageCompression="01", LossyImageCompressionRatio="4.5",
                   LossyImageCompressionMethod="ISO_10918_1", DerivationDescription="smoothed", ImageType=["DERIVED", "SECONDARY"])
        exported = self.exported("s")
        self.compare("s", exported)
        first = pydicom.dcmread(exported / "i000.dcm")
        self.assertEqual((first.LossyImageCompressionRatio, first.DerivationDescription), (4.5, "smoothed"))
        exported = self.exported("s", "--max-error", "7")
        self.compare("s", exported, bound=7)
        first = pydicom.dcmread(exported / "i000.dcm")
        self.assertEqual(list(first.LossyImageCompressionMethod), ["ISO_10918_1", "TAGRID"])
        self.assertEqual(first.LossyImageCompressionRatio[0], 4.5)
        self.assertTrue(first.DerivationDescription.startswith("smoothed; lossy compression by tagrid"))
        self.assertEqual([item.ReferencedSOPInstanceUID for item in first.SourceImageSequence], ["1.9", "1.2.3.1"])
        self.assertEqual([item.CodeValue for item in first.DerivationCodeSequence], ["113076", "113040"])

    def test_values_that_do_not_fit_each_other_still_do_after_the_export(self):
        for attributes in ({"LossyImageCompressionRatio": ["4.5", "2"]}, {"LossyImageCompressionMethod": "ISO_10918_1"}, {}):
            self.write(volume(shape=(5, 20, 31)), LossyImageCompression="01", DerivationDescription="x" * 1000, **attributes)
            exported = self.exported("s", "--max-error", "7")
            first = pydicom.dcmread(exported / "i000.dcm")
            self.assert_marked(pydicom.dcmread(self.folder / "s" / "i000.dcm"), first)
            self.assertTrue(first.DerivationDescription.startswith("lossy"))

    def test_private_attributes_character_sets_and_unknown_representations_stay(self):
        def change(file):
            file.add_new(0x00090010, "LO", "ACME")
            file.add_new(0x00091001, "UN", b"\x01\x02\x03\x04")
            file.add_new(0x00091002, "SQ", pydicom.Sequence([pydicom.Dataset()]))
            file.add_new(0x70530010, "LO", "OTHER")
            file.add_new(0x70531000, "DS", "1.5")
        for charset, name in (("ISO_IR 192", "Müller^Özge=山田"), ("ISO_IR 100", "Müller^Jörg"),
                              (["", "ISO 2022 IR 87"], "Yamada^Tarou=山田^太郎")):
            for syntax in (LITTLE, IMPLICIT):
                self.write(volume(shape=(5, 20, 31)), change=change, SpecificCharacterSet=charset, PatientName=name, syntax=syntax)
                for bound in ("0", "7"):
                    self.compare("s", self.exported("s", "--max-error", bound), bound=int(bound))

    def test_signatures_and_lengths_of_groups_go(self):
        def change(file):
            file.add_new(0x00080000, "UL", 1234)
            file.add_new(0x00180000, "UL", 26)
            mac, signature = pydicom.Dataset(), pydicom.Dataset()
            mac.MACIDNumber, signature.MACIDNumber, signature.DigitalSignatureUID = 1, 1, "1.2.7"
            file.add_new(0x4FFE0001, "SQ", pydicom.Sequence([mac]))
            file.add_new(0xFFFAFFFA, "SQ", pydicom.Sequence([signature]))
            file.add_new(0xFFFCFFFC, "OB", bytes(10))
        self.write(volume(shape=(5, 20, 31)), change=change)
        for bound in ("0", "7"):
            exported = self.exported("s", "--max-error", bound)
            first = pydicom.dcmread(exported / "i000.dcm")
            for tag in (0x4FFE0001, 0xFFFAFFFA, 0x00080000):
                self.assertNotIn(tag, first)
            self.assertEqual(first[0xFFFCFFFC].value, bytes(10))
            self.assertEqual(first.pixel_array.shape, (20, 31))

    def test_many_frames_in_one_file(self):
        type = ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
        file = enhanced_ct(volume(shape=(7, 20, 31)), range(7),
                           CTImageFrameTypeSequence=sequence(FrameType=type, PixelPresentation="MONOCHROME"))
        file.ImageType, file.ConcatenationUID = type, "1.2.8"
        self.save("a.dcm", file)
        for syntax in ("+te", "+ti", "+tb"):
            if (run := self.run_tool("dcmconv", syntax, "a.dcm", "b.dcm")) is None:
                break
            self.assertEqual(run.returncode, 0)
            for bound in ("0", "7"):
                exported = self.exported("b.dcm", "--max-error", bound)
                self.compare("b.dcm", exported, bound=int(bound),
                             changed={"ConcatenationUID"} | ({"PerFrameFunctionalGroupsSequence"} if int(bound) else set()))
                new = pydicom.dcmread(exported / "b.dcm")
                for frame in new.PerFrameFunctionalGroupsSequence:
                    type = [value.strip() for value in frame.CTImageFrameTypeSequence[0].FrameType]
                    self.assertEqual(type, ["DERIVED" if int(bound) else "ORIGINAL", "PRIMARY", "VOLUME", "NONE"])
                    self.assertEqual(frame.FrameContentSequence[0].StackID, "1")
                self.assertTrue(new.ConcatenationUID.startswith("2.25."))
                self.assert_encodes_again(exported)

    def test_names_and_folders_of_files_stay(self):
        self.write(volume(shape=(4, 20, 31)), names="IMG{:04}")
        self.write(volume(shape=(4, 20, 31)), folder="t", names="Größe {}.dcm")
        for folder in ("s", "t"):
            self.compare(folder, self.exported(folder, "--max-error", "4"), bound=4)

    def test_a_file_without_meta_information_gets_it(self):
        for syntax in (LITTLE, IMPLICIT, BIG):
            self.write(volume(shape=(4, 20, 31)), syntax=syntax)
            for path in (self.folder / "s").iterdir():
                bytes = path.read_bytes()
                path.write_bytes(bytes[132 + 12 + int.from_bytes(bytes[140:144], "little"):])
            run = self.tagrid("encode", "s", "-o", "try.tag", "-f")
            if run.returncode == 0:
                exported = self.exported("s")
                first = pydicom.dcmread(exported / "i000.dcm")
                self.assertEqual((first.file_meta.TransferSyntaxUID, first.file_meta.MediaStorageSOPInstanceUID), (syntax, first.SOPInstanceUID))
                self.assert_encodes_again(exported)

    def test_an_archive_is_a_tree_and_a_failure_stops_no_other_volume(self):
        self.write(volume(shape=(4, 20, 31)))
        (self.folder / "tags/2019").mkdir(parents=True)
        self.encode("s", name="2019/knee")
        self.encode("s", "--strip", name="b")
        self.write_nrrd("c.nrrd", volume(shape=(4, 9, 11)).astype("uint16"))
        self.encode("c.nrrd", name="c")
        for name, samples in (("f", bytes(range(8))), ("g", b"x" * 4)):
            (self.folder / f"{name}.raw").write_bytes(samples)
            self.encode(f"{name}.raw", "--dims", f"1,1,{len(samples)}", "--type", "uint8", name=name)
        self.encode("s", name="z")
        (self.folder / "tags/d.tag").write_bytes((self.folder / "tags/z.tag").read_bytes()[:-5000])
        run = self.tagrid("archive", "export", "tags", "name=*", "--format", "dicom", "-o", "out")
        self.assertEqual(run.returncode, 65, run.stderr)
        self.assertIn("tagrid: b.tag: ", run.stderr)
        self.assertIn("keeps no source files, whose headers a DICOM series needs: it was not made from DICOM files, or without",
                      run.stderr)
        # Whatever is behind the header, or no header at all.
        for name in ("c.tag: c.nrrd", "f.tag: f.raw", "g.tag: g.raw"):
            self.assertIn(f"tagrid: {name}: is not a DICOM file, and only volumes from DICOM files can become a DICOM series; "
                          "choose another format", run.stderr)
        self.assertIn("5 volumes could not be exported", run.stderr)
        self.assertEqual({str(path) for path in content(self.folder / "out")},
                         {f"{name}/i{z:03}.dcm" for name in ("2019/knee", "z") for z in range(4)})

    def test_what_makes_no_sense_is_refused(self):
        self.write(volume(shape=(4, 20, 31)))
        self.encode("s")
        for option in (["--region", "0:3,0:3,0:3"], ["--step", "2"], ["--overview", "2"], ["--values"]):
            self.assert_refused(64, option[0] + ": --format dicom exports complete series", "archive", "export", "tags", "name=*",
                                "--format", "dicom", "-o", "out", *option)
        self.assertFalse((self.folder / "out").exists())
        self.export()
        before = content(self.folder / "out")
        run = self.tagrid("archive", "export", "tags", "name=*", "--format", "dicom", "-o", "out")
        self.assertEqual(run.returncode, 65)
        self.assertIn("already exists", run.stderr)
        self.export("-f")
        self.assertEqual(before, content(self.folder / "out"))
        # Only an earlier export is replaced.
        (self.folder / "out/a/notes.txt").write_text("mine")
        run = self.tagrid("archive", "export", "tags", "name=*", "--format", "dicom", "-o", "out", "-f")
        self.assertEqual(run.returncode, 65)
        self.assertIn("is a directory of other files, which is not replaced", run.stderr)
        self.assertEqual((self.folder / "out/a/notes.txt").read_text(), "mine")

    def test_a_killed_export_leaves_nothing_for_long(self):
        self.write(volume(shape=(40, 200, 310)))
        self.encode("s", "--max-error", "3")
        out = self.folder / "out"
        command = [PROGRAM, "archive", "export", "tags", "name=*", "--format", "dicom", "-o", "out", "-q"]
        for number in (signal.SIGTERM, signal.SIGKILL):
            run = subprocess.Popen(command, cwd=self.folder, stderr=subprocess.DEVNULL)
            while run.poll() is None and not list(out.glob(".a.part*/.restored.part*/3")):
                pass
            run.send_signal(number)
            # The series has its name with all of its files, or it has none.
            if run.wait() == -number:
                self.assertFalse((out / "a").exists())
                self.assertEqual(len(list(out.iterdir())), 0 if number == signal.SIGTERM else 1)
            shutil.rmtree(out / "a", ignore_errors=True)
        self.export()
        self.assertEqual([path.name for path in out.iterdir()], ["a"])
        self.assertEqual(len(content(out)), 40)


if __name__ == "__main__":
    main()
