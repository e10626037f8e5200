"""convert --find: each volume of a disk once, under a name that stays, and a word on everything else."""

import importlib
import itertools
import json
import os
import re
import shutil
import subprocess
import unittest

from other_readers import PROGRAM, ArchiveTest, h5py, main, nibabel, numpy, pydicom, tifffile
from scans import data_set


@unittest.skipIf(None in (numpy, nibabel, pydicom, tifffile, h5py), "libraries are missing")
class Find(ArchiveTest):
    archive = "a"

    def nrrd(self, name, seed=1):
        self.write_nrrd(self.path(name), self.volume(seed))

    def dicom(self, folder, uid, seed, slices=4):
        self.write_dicom(f"{folder}/{uid}-{{}}.dcm", uid, self.volume(seed, (slices, 9, 11)), StudyDate="20200101", StudyTime="120000",
                         StudyID="1", SeriesNumber=1)

    def find(self, *options):
        """The output of each line, with the rest of the line; and all comments. Of names of series, the UIDs alone."""
        run = self.search("a", *options)
        self.messages = run.stderr
        (self.folder / "list.tsv").write_text(run.stdout)
        lines = [line.split("\t") for line in run.stdout.splitlines() if not line.startswith("#")]
        self.assertEqual(len({line[-1] for line in lines}), len(lines))
        uid = lambda text: re.sub(r"(\d)-[0-9a-f]{8}$", r"\1", text)
        found = {uid(line[-1].removeprefix("output=")): list(map(uid, line[:-1])) for line in lines}
        self.outputs = [line[-1].removeprefix("output=") for line in lines]
        return found, [line for line in run.stdout.splitlines() if line.startswith("#")]

    def convert(self, *options):
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out", *options)

    def test_links_of_hdf5_are_no_further_volumes(self):
        """Each data set once, as if the file was named."""
        with h5py.File(self.path("a.h5"), "w") as file:
            file["raw/one"] = self.volume(1)
            file["raw/two"] = self.volume(2)
            file["again"] = file["raw/one"]
            file["soft"] = h5py.SoftLink("/raw/two")
            file["gone"] = h5py.SoftLink("/raw/three")
            file["far"] = h5py.ExternalLink("b.h5", "/one")
        with h5py.File(self.path("b.h5"), "w") as file:
            file["one"] = self.volume(3)
        found, _ = self.find()
        self.assertEqual(set(found), {"a.h5/again", "a.h5/raw/two", "b.h5"})
        run = self.tagrid("encode", "a/a.h5")
        self.assertEqual([line.split()[1] for line in run.stderr.splitlines() if "11 x 9 x 4" in line], ["/again", "/raw/two"])

    def test_a_file_of_four_axes_has_one_line(self):
        truth = self.volume(1, (11, 9, 4, 12)).astype("int16")
        for name in ("scan.nii", "scan.nii.gz"):
            nibabel.save(nibabel.Nifti1Image(truth, numpy.eye(4)), self.path(f"4d/{name}"))
        self.path("4d/b.mha").write_bytes(b"NDims = 4\nDimSize = 11 9 4 2\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" + truth[..., :2].tobytes("F"))
        found, comments = self.find()
        self.assertEqual(set(found), {"4d/scan.nii", "4d/scan.nii.gz", "4d/b.mha"})
        self.assertEqual(found["4d/scan.nii"], [str(self.path("4d/scan.nii"))])
        self.assertIn("# 12 volumes of 11 x 9 x 4 int16, NIfTI", comments)
        self.convert("-q")
        for name in ("scan.nii", "scan.nii.gz", "b.mha"):
            for i in range(12 if "nii" in name else 2):
                self.ok("decode", f"out/4d/{name}.tag", "--volume", i, "-o", "x.raw", "-f")
                self.assertEqual((self.folder / "x.raw").read_bytes(), truth[..., i].tobytes("F"))
        # A file that ends too soon for its last volume.
        whole = self.path("4d/scan.nii").read_bytes()
        self.path("4d/scan.nii").write_bytes(whole[:-2])
        found, comments = self.find()
        self.assertNotIn("4d/scan.nii", found)
        self.assertTrue([line for line in comments if line.startswith("# not listed: ") and "scan.nii" in line])

    def test_a_header_that_claims_many_volumes_costs_nothing(self):
        image = nibabel.Nifti2Image(numpy.zeros((2, 2, 2, 2), "int16"), numpy.eye(4))
        nibabel.save(image, self.path("a.nii"))
        header = bytearray(self.path("a.nii").read_bytes())
        header[16 + 4 * 8:16 + 5 * 8] = (1 << 50).to_bytes(8, "little")
        self.path("a.nii").write_bytes(header)
        run = self.tagrid("encode", "a/a.nii")
        self.assertEqual(run.returncode, 64)
        self.assertIn("holds 1125899906842624 volumes of 2 x 2 x 2 int16; choose one with --series", run.stderr)
        self.assertEqual(len(run.stderr.splitlines()), 1)
        self.assertEqual(self.find()[0], {})

    def test_a_broken_image_hides_no_other_series_and_every_file_is_named(self):
        self.dicom("two", "1.1", 1)
        self.dicom("two", "2.2", 2)
        broken = self.path("two/1.1-3.dcm")
        broken.write_bytes(broken.read_bytes()[:400])
        self.path("two/report.txt").write_text("a report")
        plan = data_set(self.volume(3)[0], series="3.3", SOPClassUID="1.2.840.10008.5.1.4.1.1.481.5")
        for tag in ("Rows", "Columns", "PixelData"):
            delattr(plan, tag)
        self.save(self.path("two/plan.dcm"), plan)
        self.dicom("cut", "4.4", 4)
        cut = self.path("cut/4.4-2.dcm")
        cut.write_bytes(cut.read_bytes()[:-7])
        self.dicom("zeros", "5.5", 5)
        self.path("zeros/5.5-3.dcm").write_bytes(bytes(2000))
        self.dicom("with", "6.6", 6)
        self.save(self.path("with/plan.dcm"), plan)
        found, comments = self.find()
        # Names with two numbers: the broken file may be of either series.
        self.assertEqual(set(found), {"with/6.6"})
        comments = "\n".join(comments)
        for series in ("1.1", "2.2"):
            self.assertRegex(comments, rf"# not listed: .*/two: 1 file cannot be read and may belong to series {series}: 1.1-3.dcm \(ends too soon")
        self.assertRegex(comments, r"cut/4.4-2.dcm: DICOM file: ends too soon, within its pixels: 7 bytes are missing; "
                                   r"it is one of the 4 files of series 4.4, 4.4-0.dcm to 4.4-3.dcm")
        self.assertIn("5.5-3.dcm (is not a DICOM file)", comments)
        self.assertIn("# passed over: two: report.txt: no known format", comments)
        self.assertIn("# passed over: with: plan.dcm: DICOM without an image", comments)
        self.assertRegex(comments, "# passed over: two: .* and 4 more: DICOM of a series that is not listed, or without an image")
        broken.rename(self.path("two/a3.dcm"))
        for z in range(3):
            self.path(f"two/1.1-{z}.dcm").rename(self.path(f"two/a{z}.dcm"))
        self.assertEqual(set(self.find()[0]), {"with/6.6", "two/2.2"})
        found, comments = self.find("--gaps-ok")
        self.assertEqual(set(found), {"with/6.6", "two/1.1", "two/2.2", "cut/4.4", "zeros/5.5"})
        self.assertEqual([name for name, line in found.items() if "gaps-ok=true" in line], ["cut/4.4", "two/1.1", "zeros/5.5"])
        self.assertIn("the volume is without it: a3.dcm", "\n".join(comments))

    def test_names_stay_when_the_archive_grows(self):
        self.nrrd("2019/knee.nrrd", 2)
        self.dicom("study", "1.2.3", 3)
        for z, slice in enumerate(self.volume(4)):
            tifffile.imwrite(self.path(f"slices/b{z}.tif"), slice)
        before, _ = self.find()
        self.assertEqual(set(before), {"2019/knee.nrrd", "study/1.2.3", "slices/b#.tif"})
        self.assertEqual(before["study/1.2.3"], [str(self.path("study")), "series=1.2.3"])
        self.convert("-q")
        # All of these come before the others in natural order.
        self.path("2019/knee.mha").write_bytes(b"NDims = 3\nDimSize = 11 9 4\nElementType = MET_USHORT\nElementDataFile = LOCAL\n" + self.volume(5).tobytes())
        self.nrrd("2018/knee.nrrd", 6)
        self.nrrd("2019/knee/x.nrrd", 7)
        self.dicom("study", "1.2.1", 8)
        for z, slice in enumerate(self.volume(9)):
            tifffile.imwrite(self.path(f"slices/a{z}.tif"), slice)
        shutil.copytree(self.path("slices"), self.path("a/slices"))
        # The older list still means the same volumes, and the new one the same outputs.
        self.convert("-q", "--skip-done")
        after, _ = self.find()
        self.assertLess(set(before), set(after))
        self.assertEqual({name: after[name] for name in before}, before)
        self.convert("-q", "--skip-done")
        records = self.records()
        self.assertEqual([record["status"] for record in records].count("ok"), len(after))
        self.assertEqual([record["status"] for record in records].count("skipped"), 2 * len(before))

    def test_what_is_added_to_a_name_that_is_taken_stays_when_others_come(self):
        """Files that are called like series."""
        self.disk("x")
        self.find()
        one, other = self.outputs
        self.nrrd(other, 8)
        self.find()
        before = self.outputs
        self.assertEqual(before[:2], [other, one])
        self.assertRegex(before[2], f"^{re.escape(other)}-[0-9a-f]{{8}}$")
        self.convert("-q")
        records = self.records()
        self.nrrd(one, 7)
        self.find()
        self.assertEqual(self.outputs[:2] + self.outputs[3:], [one, other, before[2]])
        self.assertRegex(self.outputs[2], f"^{re.escape(one)}-[0-9a-f]{{8}}$")
        # The output of another volume stays, and nothing is removed for it.
        tag = (self.folder / "out" / f"{one}.tag").read_bytes()
        for options in (["--skip-done"], ["--remove-verified"]):
            run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q", *options)
            self.assertEqual(run.returncode, 65, run.stderr)
            record, = (record for record in self.records()[len(records):] if record["output"] == f"{one}.tag"
                       and record["code"] != 0)
            self.assertRegex(record["error"], "is not known to be made from|is recorded as made from")
            self.assertTrue(self.path(one).exists())
            self.assertEqual((self.folder / "out" / f"{one}.tag").read_bytes(), tag)
            records = self.records()

    def test_names_of_outputs_differ_in_more_than_their_ending(self):
        with h5py.File(self.path("a.h5"), "w") as file:
            for i, name in enumerate(("x", "x.tag", "y.tag")):
                file[name] = self.volume(i)
        self.find()
        self.assertRegex(" ".join(self.outputs), r"^a\.h5/x a\.h5/x\.tag-[0-9a-f]{8} a\.h5/y\.tag$")
        self.convert("-q")

    def test_data_sets_have_names_of_their_own(self):
        with h5py.File(self.path("a.h5"), "w") as file:
            for i, name in enumerate(("a/b", "a_b", "..x/y", "c%2Fd")):
                file[name] = self.volume(i)
        found, _ = self.find()
        self.assertEqual(set(found), {"a.h5/a/b", "a.h5/a_b", "a.h5/%2E.x/y", "a.h5/c%252Fd"})
        self.convert("-q")

    def disk(self, *folders):
        """A disk with a DICOMDIR and two series, whose images lie in directories by other means."""
        shutil.rmtree(self.folder / "a" / "disk", ignore_errors=True)
        self.dicom("x", "1.2.3", 1)
        self.dicom("x", "1.2.4", 2)
        files = importlib.import_module("pydicom.fileset").FileSet()
        for folder in folders:
            for file in sorted((self.folder / "a" / folder).iterdir()):
                files.add(file)
        files.write(self.folder / "a" / "disk")
        for folder in folders:
            shutil.rmtree(self.folder / "a" / folder)

    def test_a_disk_with_a_directory_is_listed_once(self):
        self.disk("x")
        found, comments = self.find()
        directory = str(self.path("disk/DICOMDIR"))
        self.assertEqual(found, {"disk/1.2.3": [directory, "series=1.2.3"], "disk/1.2.4": [directory, "series=1.2.4"]})
        self.convert("-q")
        self.tagrid("decode", f"out/{self.outputs[1]}.tag", "-o", "x.raw")
        self.assertEqual((self.folder / "x.raw").read_bytes(), self.volume(2).tobytes())
        # Under another name, it is no way to files below its directory.
        shutil.copy(self.path("disk/DICOMDIR"), self.path("disk/other.dcm"))
        self.assert_refused(65, "rename it to DICOMDIR", "encode", self.path("disk/other.dcm"), "--series", "1.2.3", "-o", "y.tag")
        self.path("disk/other.dcm").unlink()
        # An image that cannot be read is said once, too.
        self.dicom("y", "1.2.6", 3, slices=1)
        file = pydicom.dcmread(self.path("y/1.2.6-0.dcm"))
        file.PhotometricInterpretation = "PALETTE COLOR"
        file.save_as(self.path("y/1.2.6-0.dcm"))
        self.disk("x", "y")
        found, comments = self.find()
        self.assertEqual(set(found), {"disk/1.2.3", "disk/1.2.4"})
        self.assertEqual(len([line for line in comments if "has colors" in line]), 1, comments)
        # What the directory does not know is listed besides.
        self.dicom("disk/more", "1.2.5", 3)
        self.assertEqual(set(self.find()[0]), {"disk/1.2.3", "disk/1.2.4", "disk/more/1.2.5"})
        # Without a directory that can be read, images are found where they lie.
        self.path("disk/DICOMDIR").write_bytes(self.path("disk/DICOMDIR").read_bytes()[:400])
        found, comments = self.find()
        self.assertIn("disk/more/1.2.5", found)
        self.assertTrue([name for name in found if name.endswith("/1.2.3")], found)
        self.assertTrue([line for line in comments if "DICOMDIR" in line and line.startswith("# not listed")], comments)

    def test_the_images_of_a_directory_are_kept(self):
        self.disk("x")
        self.find()
        before = {path: path.read_bytes() for path in self.path("disk").rglob("*") if path.is_file()}
        self.convert("-q")
        self.assert_refused_removal("a DICOMDIR whose images are gone cannot be read, not even for its other series; encode the directories of its images instead")
        # The advice works.
        folders = sorted({path.parent for path in before if path.name != "DICOMDIR"})
        (self.folder / "list.tsv").write_text("".join(f"{folder}\toutput={i}\n" for i, folder in enumerate(folders)))
        self.convert("-q")
        self.convert("-q", "--remove-verified")
        self.assertEqual([path.name for path in before if path.exists()], ["DICOMDIR"])
        self.ok("restore", "--records", "out")
        self.assertEqual({path: path.read_bytes() for path in before}, before)

    def assert_refused_removal(self, why):
        run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q", "--remove-verified")
        self.assertEqual(run.returncode, 65)
        self.assertIn(why, run.stderr)

    def test_links_to_files_that_are_found_are_passed_over(self):
        self.nrrd("knee.nrrd")
        self.nrrd(".store/hidden.nrrd")
        (self.folder / "outside.nrrd").write_bytes(self.path("knee.nrrd").read_bytes())
        for name, target in (("sub/link.nrrd", "../knee.nrrd"), ("annexed.nrrd", ".store/hidden.nrrd"), ("far.nrrd", "../outside.nrrd")):
            os.symlink(target, self.path(name))
        found, comments = self.find()
        self.assertEqual(set(found), {"knee.nrrd", "annexed.nrrd", "far.nrrd"})
        self.assertIn("# passed over: sub: link.nrrd: a link to a file that is found at its own location", comments)

    def test_slices_at_unequal_distances_are_said(self):
        self.dicom("whole", "1.2.3", 1)
        self.dicom("gap", "1.2.4", 1, slices=6)
        self.path("gap/1.2.4-2.dcm").unlink()
        _, comments = self.find()
        self.assertEqual([line for line in comments if "DICOM" in line],
                         ["# 11 x 9 x 5 int16, DICOM; slices are unequally spaced, or some are missing",
                          "# 11 x 9 x 4 int16, DICOM"])

    def test_volumes_of_one_series_are_told_apart(self):
        """The same ones as of their directory, each once."""
        for echo, z in itertools.product((2, 5), range(3)):
            file = data_set(self.volume(echo)[z], series="1.2.3", instance=f"1.{echo}.{z}", position=(0, 0, z), EchoTime=str(echo), SeriesDescription="T2\nmap")
            self.save(self.path(f"s/{echo}{z}.dcm"), file)
        found, comments = self.find()
        self.assertEqual(found, {"s/1.2.3": [str(self.path("s")), "series=1.2.3"]})
        self.assertEqual([line for line in comments if "DICOM" in line],
                         [f"# 11 x 9 x 3 int16, DICOM, CT, T2 map, EchoTime {echo}" for echo in (2, 5)])
        self.convert("-q")
        for output, echo in zip(self.outputs, (2, 5), strict=True):
            self.tagrid("decode", f"out/{output}.tag", "-o", "x.raw", "-f")
            self.assertEqual((self.folder / "x.raw").read_bytes(), ((self.volume(echo)[:3] & 0xFFFF).astype("int64") - 1024).astype("int16").tobytes())

    def test_parts_of_a_series_in_several_folders_are_named(self):
        self.dicom("x", "1.2.3", 1)
        for z in range(4):
            self.path(f"{'ab'[z // 2]}/{z}.dcm").write_bytes(self.path(f"x/1.2.3-{z}.dcm").read_bytes())
        shutil.rmtree(self.folder / "a" / "x")
        found, comments = self.find()
        self.assertEqual(set(found), {"a/1.2.3", "b/1.2.3"})
        self.assertEqual([line for line in comments if "DICOM" in line],
                         ["# 11 x 9 x 2 int16, DICOM", "# 11 x 9 x 2 int16, DICOM; a also has images of this series: copies, or parts of one volume, which must then be in one directory"])
        # In one directory, they are one volume.
        for z in range(2):
            self.path(f"a/{z}.dcm").rename(self.path(f"b/{z}.dcm"))
        found, comments = self.find()
        self.assertEqual(set(found), {"b/1.2.3"})
        self.assertIn("# 11 x 9 x 4 int16, DICOM", comments)

    def test_names_of_outputs_are_those_that_shares_allow(self):
        with h5py.File(self.path("a.h5"), "w") as file:
            file["b:c*d?e|f"] = self.volume(1)
            file["g"] = self.volume(2)
        self.dicom("s", "1.2.3", 1)
        for z in range(3):
            file = data_set(self.volume(2, (3, 5, 7))[z], series="1.2.3", instance=f"9.{z}", position=(0, 0, z), RescaleIntercept=0)
            self.save(self.path(f"s/small{z}.dcm"), file)
        found, _ = self.find()
        self.assertEqual({name for name in found if name.startswith("a.h5")}, {"a.h5/b%3Ac%2Ad%3Fe%7Cf", "a.h5/g"})
        names = [name for name in self.outputs if name.startswith("s/")]
        self.assertEqual(len(names), 2)
        for name in names:
            self.assertRegex(name, r"^s/1\.2\.3-[0-9a-f]{8}$")
        self.convert("-q")

    def test_what_is_passed_over_is_said(self):
        self.nrrd("knee.nrrd")
        self.path("b.nhdr").write_text("NRRD0004\ntype: ushort\ndimension: 3\nsizes: 11 9 4\nendian: little\nencoding: raw\ndata file: data/b.raw\n")
        self.path("data/b.raw").write_bytes(self.volume(1).tobytes())
        self.path("data/other.raw").write_bytes(self.volume(1).tobytes())
        for name, content in (("notes.txt", b"nothing"), ("empty", b""), ("old.tag", b"\x89TAG\r\n"), ("x.nrrd.bz2", b"BZh91AY"), (".hidden", b"x")):
            self.path(name).write_bytes(content)
        for i in range(8):
            self.path(f"many/{i}.txt").write_text("nothing")
        os.symlink("nowhere", self.path("dangling"))
        os.symlink("data", self.path("link"))
        found, comments = self.find()
        self.assertEqual(set(found), {"knee.nrrd", "b.nhdr"})
        text = "\n".join(comments) + "\n"
        for line in (".: notes.txt: no known format", ".: empty: empty", ".: old.tag: is already a .tag file",
                     ".: x.nrrd.bz2: is compressed", ".: link: a link to a directory",
                     ".: dangling: not a file", "data: other.raw: perhaps samples without a header: a line needs the columns dims= and type=",
                     "many: 0.txt, 1.txt, 2.txt, 3.txt, 4.txt and 3 more: no known format"):
            self.assertIn(f"# passed over: {line}", text)
        self.assertNotIn("b.raw", text.replace("other.raw", ""))
        self.assertNotIn("hidden", text)
        self.assertIn("volumes: 2, 15 files passed over, as comments of the list say", self.messages)
        # The list can be converted as it is.
        self.convert("-q")
        found, comments = self.find("-q")
        self.assertNotIn("passed over", "\n".join(comments))
        self.assertEqual(self.messages, "")

    @unittest.skipIf(os.geteuid() == 0 and shutil.which("setpriv") is None, "root may read everything, and there is no setpriv")
    def test_a_folder_that_cannot_be_read_does_not_end_the_search(self):
        self.nrrd("knee.nrrd")
        self.nrrd("closed/a.nrrd")
        self.nrrd("closed.nrrd")
        for path in (self.folder, self.folder / "a"):
            path.chmod(0o755)
        drop = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"] if os.geteuid() == 0 else []
        if subprocess.run([*drop, "test", "-r", str(self.folder / "a")], capture_output=True).returncode != 0:
            self.skipTest(f"others cannot read {self.folder}")
        self.path("closed").chmod(0)
        self.path("closed.nrrd").chmod(0)
        run = subprocess.run([*drop, PROGRAM, "convert", "--find", "a"], cwd=self.folder, capture_output=True,
                             text=True)
        self.path("closed").chmod(0o755)
        if run.returncode == 126 or "setpriv" in run.stderr or "execvp" in run.stderr:
            self.skipTest("the program cannot be started by others here")
        self.assertEqual(run.returncode, 65, run.stderr)
        self.assertIn("output=knee.nrrd", run.stdout)
        for name in ("closed", "closed.nrrd"):
            self.assertIn(f"# not listed: {self.folder}/a/{name}: cannot", run.stdout)
        self.assertIn("volumes: 1, 2 cannot be read", run.stderr)
        self.assertIn("2 of 3 volumes cannot be read; see the comments of the list", run.stderr)

    def test_gaps_are_accepted_where_they_are(self):
        for z in (1, 2, 4):
            tifffile.imwrite(self.path(f"gap/{z}.tif"), self.volume(z)[0])
            tifffile.imwrite(self.path(f"whole/{min(z, 3)}.tif"), self.volume(z)[0])
        found, comments = self.find()
        self.assertEqual(set(found), {"whole/#.tif"})
        self.assertIn("--gaps-ok", "\n".join(comments))
        found, _ = self.find("--gaps-ok")
        self.assertEqual(found, {"whole/#.tif": [str(self.path("whole")), "series=#.tif"],
                                 "gap/#.tif": [str(self.path("gap")), "gaps-ok=true", "series=#.tif"]})
        self.convert("-q")

    def test_options_that_have_no_effect_are_refused(self):
        self.nrrd("knee.nrrd")
        for options in (["--max-error", "2"], ["--manifest", "x"], ["--output-dir", "x"], ["--keep-folders"], ["--skip-done"], ["--shard", "0/2"], ["-f"],
                        ["--json", "x"], ["--series", "2"], ["--remove-verified"]):
            self.assert_refused(64, "has no effect with --find", "convert", "--find", "a", *options)


if __name__ == "__main__":
    main()
