"""An archive of all formats, with broken files among them: found, converted, and compared.

    archive_test.py PROGRAM [PROGRAM_WITH_MPI]
"""

import json
import os
import re
import shutil
import subprocess
import sys
import unittest

from other_readers import PROGRAM, ArchiveTest, h5py, main, numpy, pydicom, tifffile
from scans import meta_image, nifti

MPI_PROGRAM = os.path.abspath(sys.argv.pop(2)) if len(sys.argv) > 2 and not sys.argv[2].startswith("-") else None


def content(path):
    with open(path, "rb") as file:
        return file.read()


def with_uid_alone(output):
    """The name of an output without the digits that tell volumes of one series apart."""
    return re.sub(r"-[0-9a-f]{8}$", "", output)


@unittest.skipIf(None in (numpy, pydicom, tifffile, h5py), "libraries are missing")
class Archive(ArchiveTest):
    def make(self):
        """All volumes, by the names of their outputs; and the names of what cannot be read."""
        volumes = {}
        self.write_nrrd(self.path("2019/knee.nrrd"), self.volume(1))
        volumes["2019/knee.nrrd"] = self.volume(1)
        self.path("2019/knee.mha").write_bytes(meta_image(self.volume(2)))
        volumes["2019/knee.mha"] = self.volume(2)
        for z, slice in enumerate(self.volume(3)):
            tifffile.imwrite(self.path(f"stacks/rat.1/s{z + 8}.tif"), slice)
        volumes["stacks/rat.1/s#.tif"] = self.volume(3)
        tifffile.imwrite(self.path("stacks/two/whole.tif"), self.volume(4), photometric="minisblack")
        volumes["stacks/two/whole.tif"] = self.volume(4)
        for name, seed in (("a", 5), ("b", 6)):
            for z, slice in enumerate(self.volume(seed)):
                tifffile.imwrite(self.path(f"stacks/both/{name}{z}.tif"), slice)
            volumes[f"stacks/both/{name}#.tif"] = self.volume(seed)
        for uid, seed in (("1.2.3", 7), ("1.2.4", 8)):
            self.write_dicom(f"dicom/study/{uid}-{{}}", uid, self.volume(seed))
            volumes[f"dicom/study/{uid}"] = self.volume(seed).astype("int16")
        with h5py.File(self.path("runs/scan.h5"), "w") as file:
            file["one"] = self.volume(9)
            file["two/three"] = self.volume(10)
        volumes["runs/scan.h5/one"] = self.volume(9)
        volumes["runs/scan.h5/two/three"] = self.volume(10)

        broken = ["runs/broken.h5", "2019/short.nii", "stacks/gap"]
        self.path("runs/broken.h5").write_bytes(self.path("runs/scan.h5").read_bytes()[:700])
        self.path("2019/short.nii").write_bytes(nifti(numpy.zeros((5, 5, 5), "int16"))[:451])
        for z in (1, 2, 4):
            tifffile.imwrite(self.path(f"stacks/gap/{z}.tif"), self.volume(3)[0])
        self.path("2019/notes.txt").write_text("nothing")
        self.path("2019/.hidden.nrrd").write_text("nothing")
        self.path("2019/old.tag").write_text("nothing")
        os.symlink(self.folder / "archive", self.folder / "archive" / "2019" / "loop")
        return volumes, broken

    def find(self):
        run = self.search("archive")
        (self.folder / "list.tsv").write_text(run.stdout)
        return run

    def test_all_volumes_are_found_and_converted(self):
        volumes, broken = self.make()
        run = self.find()
        lines = [line.split("\t") for line in run.stdout.splitlines() if not line.startswith("#")]
        outputs = {with_uid_alone(line[-1].removeprefix("output=")): line[-1].removeprefix("output=") for line in lines}
        self.assertEqual(set(outputs), set(volumes))
        self.assertIn("# 11 x 9 x 4 int16, DICOM, CT, begins with 1.2.3-0\n", run.stdout)
        self.assertEqual(run.stdout.count("# not listed: "), len(broken))
        for name in broken:
            self.assertIn(str(self.folder / "archive" / name), run.stderr)
        self.assertIn(f"volumes: {len(volumes)}, {len(broken)} cannot be read, 3 files passed over", run.stderr)

        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out")
        for name, truth in volumes.items():
            self.tagrid("decode", f"out/{outputs[name]}.tag", "-o", "a.raw", "-f")
            self.assertEqual((self.folder / "a.raw").read_bytes(), truth.tobytes(), name)
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out", "--skip-done")
        records = self.records()
        self.assertEqual([record["status"] for record in records], ["ok"] * len(volumes) + ["skipped"] * len(volumes))

    def test_originals_are_removed_only_if_all_their_bytes_come_back(self):
        volumes, broken = self.make()
        self.find()
        shutil.copytree(self.folder / "archive", self.folder / "before", symlinks=True)
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out")
        run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "--remove-verified")
        records = self.records()
        removed = {record["output"]: record for record in records if record["status"] == "removed"}
        kept = {record["output"].removesuffix(".tag"): record["error"] for record in records if record["status"] == "kept"}
        self.assertEqual({with_uid_alone(output.removesuffix(".tag")) for output in removed} | set(kept), set(volumes))
        # Two data sets of a file, each of which would keep the other.
        self.assertEqual({name for name in kept if "runs/" not in name}, set())
        self.assertTrue(kept)
        self.assertEqual(run.returncode, 65)
        gone = {path.relative_to(self.folder / "before") for path in (self.folder / "before").rglob("*") if path.is_file()
                and not (self.folder / "archive" / path.relative_to(self.folder / "before")).exists()}
        self.assertGreater(len(gone), 20)
        # What was removed is done, though its directory is still there.
        for option in ("--skip-done", "--remove-verified"):
            run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", option)
            later = self.records()[-len(volumes):]
            self.assertEqual({record["status"] for record in later if record["output"] in removed}, {"skipped"}, option)
        for output, record in removed.items():
            self.assertIs(record["restorable"], True)
            folder = os.path.normpath(self.folder / "out" / os.path.dirname(record["input_files"][0]["path"]))
            run = self.ok("restore", f"out/{output}", "-o", folder)
        for path in gone:
            self.assertEqual((self.folder / "archive" / path).read_bytes(), (self.folder / "before" / path).read_bytes(), path)
        # And nothing else was touched.
        run = subprocess.run(["diff", "-r", "archive", "before"], cwd=self.folder, stdout=subprocess.PIPE, text=True)
        self.assertEqual(run.stdout, "")

    def test_a_series_that_lost_a_slice_does_not_replace_the_whole_one(self):
        self.make()
        (self.folder / "list.tsv").write_text("archive/dicom/study\tseries=1.2.3\toutput=a\n")
        convert = ["convert", "--manifest", "list.tsv", "--output-dir", "out"]
        self.ok(*convert)
        whole = (self.folder / "out" / "a.tag").read_bytes()
        self.path("dicom/study/1.2.3-3").unlink()
        self.assert_refused_volume(convert, "it is 11 x 9 x 3 int16 instead of 11 x 9 x 4 int16")
        self.assertEqual((self.folder / "out" / "a.tag").read_bytes(), whole)
        # Nothing goes, either, as what was encoded is not all there.
        run = self.tagrid(*convert, "--remove-verified")
        self.assertEqual(run.returncode, 65)
        self.assertEqual(self.records()[-1]["status"], "kept")
        self.assertIn("its last encoding failed: ", self.records()[-1]["error"])
        self.ok(*convert, "--skip-done", "-f")
        self.assertNotEqual((self.folder / "out" / "a.tag").read_bytes(), whole)

    def assert_refused_volume(self, convert, why):
        run = self.tagrid(*convert, "--skip-done")
        self.assertEqual(run.returncode, 65)
        self.assertIn(why, run.stderr)
        self.assertEqual((self.records()[-1]["status"], self.records()[-1]["code"]), ("failed", 65))

    def test_names_of_any_bytes_come_back_by_their_records(self):
        names = [b"back\\tslash.nrrd", b"not\xff\xef\xbf\xbdutf8.nrrd", b"sp ace%20.nrrd", "\u00e4.nrrd".encode(), b"stack\\n/sub", b"\xe9/a.nrrd", b"plain.nrrd"]
        archive = os.fsencode(self.folder) + b"/archive/"
        self.path("x")
        before = {}
        for i, name in enumerate(names):
            if name.endswith(b"sub"):
                os.makedirs(archive + name)
                for z in range(4):
                    tifffile.imwrite(os.fsdecode(archive + name) + f"/s{z}.tif", self.volume(i)[z])
            else:
                self.path("a.nrrd").write_bytes(b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 11 9 4\nendian: little\nencoding: raw\n\n" +
                                                self.volume(i).tobytes())
                os.makedirs(os.path.dirname(archive + name), exist_ok=True)
                os.rename(self.path("a.nrrd"), archive + name)
        for folder, _, files in os.walk(archive):
            before |= {os.path.join(folder, file): content(os.path.join(folder, file)) for file in files}
        with open(self.folder / "list.tsv", "wb") as out:
            subprocess.run([PROGRAM, "convert", "--find", "archive"], cwd=self.folder, stdout=out, check=True)
        convert = ["convert", "--manifest", "list.tsv", "--output-dir", "out"]
        self.ok(*convert)
        self.assertEqual([record["status"] for record in self.records()], ["ok"] * len(names))
        self.ok(*convert, "--skip-done")
        self.assertEqual([record["status"] for record in self.records()[len(names):]], ["skipped"] * len(names))
        self.assertIn("not\ufffdFF\ufffdEF\ufffdBF\ufffdBDutf8.nrrd", "".join(record["input"] for record in self.records()))
        self.ok(*convert, "--remove-verified")
        self.assertFalse([path for path in before if os.path.exists(path)])
        self.ok("restore", "--records", "out", "-o", "elsewhere")
        elsewhere = os.fsencode(self.folder / "elsewhere") + b"/"
        self.assertEqual({path: content(elsewhere + path[len(archive):]) for path in before}, before)
        self.assertFalse([path for path in before if os.path.exists(path)])
        self.assert_refused(64, "give a .tag file", "restore", "-o", "x")
        # One that is damaged does not keep the others away.
        tag = self.folder / "out" / "plain.nrrd.tag"
        whole = tag.read_bytes()
        tag.write_bytes(whole[:-7])
        run = self.tagrid("restore", "--records", "out")
        self.assertEqual(run.returncode, 65)
        self.assertIn("originals: 7, 6 restored, 0 were there, 1 failed", run.stderr)
        tag.write_bytes(whole)
        self.ok("restore", "--records", "out")
        self.assertEqual({path: content(path) for path in before}, before)
        self.ok("restore", "--records", "out")
        # -f is for what is left of an original, and leaves the work on others alone.
        (self.folder / "archive" / "plain.nrrd").write_bytes(b"its beginning")
        changed = archive + b"sp ace%20.nrrd"
        before[changed] = before[changed][:-1] + b"\x7f"
        with open(changed, "wb") as file:
            file.write(before[changed])
        run = self.tagrid("restore", "--records", "out")
        self.assertEqual(run.returncode, 65)
        self.assertIn("plain.nrrd: already exists; give -f to overwrite it", run.stderr)
        self.ok("restore", "--records", "out", "-f")
        self.assertEqual({path: content(path) for path in before}, before)

    def test_a_record_that_cannot_be_read_is_named(self):
        names = ("a.nrrd", "b.nrrd")
        for seed, name in enumerate(names):
            self.write_nrrd(self.path(name), self.volume(seed))
        (self.folder / "list.tsv").write_text("".join(f"archive/{name}\n" for name in names))
        convert = ["convert", "--manifest", "list.tsv", "--output-dir", "out"]
        self.ok(*convert)
        self.ok(*convert, "--remove-verified")
        results = self.folder / "out" / "results.jsonl"
        whole = results.read_text()
        lines = whole.splitlines(keepends=True)
        self.assertEqual([json.loads(line)["status"] for line in lines], ["ok", "ok", "removed", "removed"])
        lost = json.loads(lines[2])
        results.write_text("".join(lines[:2] + ["[" + lines[2][1:]] + lines[3:]))
        run = self.tagrid("restore", "--records", "out")
        self.assertEqual(run.returncode, 65)
        self.assertIn("out/results.jsonl: line 3 is not a record\n", run.stderr)
        self.assertIn(f'out/{lost["output"]}: is in no record that says "removed"', run.stderr)
        self.assertIn("originals: 1, 1 restored, 0 were there, 0 failed", run.stderr)
        self.assertEqual(run.stderr.count("is in no record"), 1)
        self.assertEqual([self.path(name).exists() for name in names], [name != os.path.basename(lost["input"]) for name in names])
        # Half a last line is what a killed run leaves.
        results.write_text(whole + lines[2][:40])
        self.ok("restore", "--records", "out")
        self.assertTrue(all(self.path(name).exists() for name in names))
        (self.folder / "empty").mkdir()
        self.assert_refused(65, "empty: has no records of convert", "restore", "--records", "empty")

    def test_what_cannot_come_back_byte_for_byte_is_counted(self):
        self.write_nrrd(self.path("a.nrrd"), self.volume(1))
        tifffile.imwrite(self.path("b.tif"), self.volume(2), photometric="minisblack", compression="zlib")
        (self.folder / "list.tsv").write_text("archive/a.nrrd\narchive/b.tif\narchive/a.nrrd\tmax-error=5\toutput=c\n")
        run = self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out", "--progress=plain", "-v")
        self.assertIn("2 of them cannot be restored byte for byte\n", run.stderr)
        self.assertIn("b.tif: cannot be restored byte for byte: its samples are compressed", run.stderr)
        self.assertIn("a.nrrd: cannot be restored byte for byte: its samples are kept within 5", run.stderr)
        self.assertIsNone(self.records()[0]["why_not_restorable"])
        self.assertEqual(self.records()[2]["why_not_restorable"], "its samples are kept within 5")

    def test_a_list_may_name_folders(self):
        self.make()
        (self.folder / "list.tsv").write_text("archive/stacks/rat.1/\narchive/stacks/both\tseries=b#.tif\toutput=b\narchive/stacks/gap\tgaps-ok=true\n"
                                              "archive/dicom/study\n")
        run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "--keep-folders")
        self.assertEqual(run.returncode, 65)
        self.assertIn("holds 2 volumes", (self.folder / "out" / "results.jsonl").read_text())
        for name in ("archive/stacks/rat.1.tag", "b.tag", "archive/stacks/gap.tag"):
            self.assertTrue((self.folder / "out" / name).exists(), name)
        run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "flat", "-q")
        self.assertTrue((self.folder / "flat" / "rat.1.tag").exists())

    @unittest.skipIf(MPI_PROGRAM is None or shutil.which("mpirun") is None, "there is no tagrid-mpi, or no mpirun")
    def test_many_processes_share_the_list(self):
        volumes, _ = self.make()
        self.find()
        environment = os.environ | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        run = subprocess.run(["mpirun", "--oversubscribe", "-np", "3", MPI_PROGRAM, "convert", "--manifest", "list.tsv", "--output-dir", "out"],
                             cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(run.returncode, 0, run.stdout)
        outputs = {str(path.relative_to(self.folder / "out")).removesuffix(".tag") for path in (self.folder / "out").rglob("*.tag")}
        self.assertEqual({with_uid_alone(output) for output in outputs}, set(volumes))

    def test_names_in_files_write_no_lines_of_the_list(self):
        (self.folder / "victim").write_bytes(b"abc")
        with h5py.File(self.path("a.h5"), "w") as file:
            file[f"b\n{self.folder}/victim\tdims=3,1,1\ttype=uint8\n#"] = self.volume(1)
            file["c"] = self.volume(2)
        for z in range(3):
            tifffile.imwrite(self.path(f"a\tmax-error={z}.tif"), self.volume(1)[0])
            tifffile.imwrite(self.path(f"b{z}.tif"), self.volume(1)[0])
        tifffile.imwrite(self.path("n\nn.tif"), self.volume(1)[0])
        run = self.find()
        lines = [line for line in run.stdout.splitlines() if not line.startswith("#")]
        self.assertEqual([line.split("\t")[1:] for line in lines], [["dataset=/c", "output=a.h5/c"], ["series=b#.tif", "output=b#.tif"]])
        self.assertIn("n\\nn.tif: a name has a tab or a line end, which a list cannot have; rename it, or give this volume to tagrid "
                      "encode", run.stderr)

    def test_stacks_with_numbered_names_are_volumes_of_their_own(self):
        for i in range(3):
            tifffile.imwrite(self.path(f"scan{i}.tif"), self.volume(i), photometric="minisblack")
        self.assertEqual(self.find().stdout.count("\toutput=scan"), 3)

    def test_what_cannot_be_searched_is_an_error(self):
        self.assert_refused(74, "nowhere", "convert", "--find", "nowhere")
        (self.folder / "file").write_text("x")
        self.assert_refused(64, "file: is a file; --find takes a directory", "convert", "--find", "file")
        self.assert_refused(64, "give --manifest FILE and --output-dir DIR, or --find ROOT", "convert", "--output-dir",
                            "out")
        self.assert_refused(64, "give --manifest FILE and --output-dir DIR, or --find ROOT", "convert", "--manifest",
                            "file")


if __name__ == "__main__":
    main()
