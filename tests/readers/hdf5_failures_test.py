"""HDF5 and VTKHDF files that cannot be written, and damaged ones: an error message, and nothing is left.

    hdf5_failures_test.py PROGRAM
"""

import itertools
import os
import pathlib
import resource
import signal
import subprocess
import time
import unittest

from hdf5_files import FORMATS, OBLIQUE, Hdf5Test, placed
from other_readers import PROGRAM, h5py, main, numpy, some, unless_sanitized


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Failures(Hdf5Test):
    def large(self, dims="300,200,90"):
        self.ok("phantom", "--dims", dims, "--type", "int16", "-o", "p.nrrd")
        self.ok("encode", "p.nrrd", "-o", "p.tag")
        (self.folder / "p.nrrd").unlink()

    def names(self):
        return sorted(file.name for file in self.folder.iterdir())

    def test_a_full_disk_leaves_nothing(self):
        """A file may not become larger than so many bytes: within the samples, and within what comes before them."""
        self.large()
        for name, limit in itertools.product(FORMATS, (1000, 3000, 1 << 20, 10 << 20)):
            run = subprocess.run([PROGRAM, "decode", "p.tag", "-o", name], cwd=self.folder, stderr=subprocess.PIPE,
                                 text=True,
                                 restore_signals=False, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
            self.assertEqual(run.returncode, 74, f"{name} {limit}: {run.stderr}")
            self.assertIn(f"{name}: cannot write: File too large", run.stderr)
            self.assertEqual(self.names(), ["p.tag"])
        run = self.tagrid("decode", "p.tag", "-f", "-o", "/dev/full", "--format", "hdf5")
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn("/dev/full: cannot write: No space left", run.stderr)

    def test_a_full_disk_for_temporary_files_is_named_as_such(self):
        self.large()
        (self.folder / "spool").mkdir()
        with open(self.folder / "out", "wb") as out:
            run = subprocess.run([PROGRAM, "decode", "p.tag", "-o", "-", "--format", "hdf5", "--spool", "spool"],
                                 cwd=self.folder, stdout=out,
                                 stderr=subprocess.PIPE, text=True, restore_signals=False, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20)))
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn("standard output (through a temporary file in spool): cannot write: File too large", run.stderr)
        self.assertEqual((self.folder / "out").stat().st_size, 0)

    def test_an_existing_file_stays(self):
        self.encode()
        for name in FORMATS:
            (self.folder / name).write_bytes(b"mine")
            self.assert_refused(64, "already exists", "decode", "a.tag", "-o", name)
            self.assertEqual((self.folder / name).read_bytes(), b"mine")
        self.assert_refused(74, "nowhere/b.h5", "decode", "a.tag", "-o", "nowhere/b.h5")
        (self.folder / "a.tag").write_bytes((self.folder / "a.tag").read_bytes()[:-20])
        before = self.names()
        self.assert_refused(65, "a.tag", "decode", "a.tag", "-o", "b.h5", "-f")
        self.assertEqual(self.names(), before)
        self.assertEqual((self.folder / "b.h5").read_bytes(), b"mine")

    def test_a_missing_program_is_named(self):
        self.encode()
        alone = self.folder / "bin"
        alone.mkdir()
        os.link(PROGRAM, alone / "tagrid") if PROGRAM.stat().st_dev == alone.stat().st_dev else \
            (alone / "tagrid").write_bytes(PROGRAM.read_bytes())
        (alone / "tagrid").chmod(0o755)
        for name in FORMATS:
            run = subprocess.run([alone / "tagrid", "decode", "a.tag", "-o", name], cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn("tagrid-write-hdf5, which is not installed", run.stderr)
            self.assertIn("install the package tagrid-readers", run.stderr)
            self.assertFalse((self.folder / name).exists())
        (self.folder / "series").mkdir()
        (self.folder / "series/1.dcm").write_bytes(bytes(128) + b"DICM")
        for name, what in (("series", "series: has DICOM files"), ("series/1.dcm", "series/1.dcm: is a DICOM file")):
            run = subprocess.run([alone / "tagrid", "encode", name], cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn(f"{what}, which tagrid-read-dicom reads; that program is not installed", run.stderr)
            self.assertIn("install the package tagrid-readers", run.stderr)
        (alone / "CMakeCache.txt").touch()  # a build directory
        run = subprocess.run([alone / "tagrid", "encode", "series"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertIn(f"run cmake in {alone} to build all of it\n", run.stderr)

    def test_signals_leave_nothing_and_nobody(self):
        """The rest of the input does not come, so that the run has surely not ended when the signal comes."""
        self.large()
        whole = (self.folder / "p.tag").read_bytes()
        for kind, name in itertools.product((signal.SIGTERM, signal.SIGINT, signal.SIGKILL), FORMATS):
            run = subprocess.Popen([PROGRAM, "decode", "-", "-o", name, "-T1", "-q"], cwd=self.folder,
                                   stdin=subprocess.PIPE)
            run.stdin.write(whole[:len(whole) * 2 // 3])
            run.stdin.flush()
            writers = []
            while not writers and run.poll() is None:
                writers = self.children(run.pid)
            time.sleep(0.1)
            run.send_signal(kind)
            self.assertEqual(run.wait(), -kind)
            run.stdin.close()
            self.assertFalse((self.folder / name).exists())
            if kind != signal.SIGKILL:
                self.assertEqual(self.names(), ["p.tag"])
            for _ in range(1000):
                if not any(pathlib.Path(f"/proc/{writer}").exists() for writer in writers):
                    break
                time.sleep(0.05)
            self.assertFalse([writer for writer in writers if self.is_running(writer)])
            for file in self.folder.glob(".*"):
                file.unlink()

    @staticmethod
    def is_running(process):
        try:
            return pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
        except OSError:
            return False

    @staticmethod
    def children(parent):
        try:
            texts = [path.read_text() for path in pathlib.Path(f"/proc/{parent}/task").glob("*/children")]
        except OSError:
            return []
        return [int(child) for text in texts for child in text.split()]

    @unless_sanitized
    def test_the_memory_of_the_writer_is_bounded_and_counts(self):
        """A volume of 192 MB in slices of 2 MB, within a limit far below; the writer's own limit is that of the system."""
        run = subprocess.run(f"head -c {96 * 1000 * 1000 * 2} /dev/zero | {PROGRAM} encode -q --dims 1000,1000,96 --type int16 - -o z.tag",
                             shell=True, cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        def smallest_for(name):
            said = self.assert_refused(64, "give -M ", "decode", "z.tag", "-o", name, "-M", "1M")
            return int(said.split("give -M ")[1].split("M")[0])

        for name in FORMATS:
            smallest = smallest_for(name)
            self.assertLess(smallest, smallest_for("b.nii.gz") + 64)
            self.assert_refused(64, "give -M ", "decode", "z.tag", "-o", name, "-M", f"{smallest - 1}M")
            self.decode(name, "-M", f"{smallest}M", tag="z.tag")
            self.assertGreater((self.folder / name).stat().st_size, 192 * 1000 * 1000)


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Damage(Hdf5Test):
    def test_damaged_files_are_errors_that_name_them_or_other_samples(self):
        random = numpy.random.default_rng(7)
        self.encode(shape=(3, 5, 7), fields=placed(OBLIQUE) + "Modality:=CT\n")
        for name in FORMATS:
            self.decode(name)
            whole = (self.folder / name).read_bytes()
            for i in some(range(60), 3):
                broken = bytearray(whole[:random.integers(9, len(whole))] if i % 4 == 0 else whole)
                for _ in range(random.integers(0 if i % 4 == 0 else 1, 5)):
                    broken[random.integers(9, len(broken))] ^= 1 << random.integers(0, 8)
                (self.folder / "broken.h5").write_bytes(broken)
                started = time.monotonic()
                run = self.tagrid("encode", "broken.h5", "-o", "broken.tag", "-f", "-q")
                self.assertLess(time.monotonic() - started, 50, f"{name} {i}")
                # A library that crashes is a failure of the reader, 74.
                self.assertIn(run.returncode, (0, 64, 65, 74), f"{name} {i}: {run.stderr}")
                if run.returncode != 0:
                    self.assertIn("broken.h5", run.stderr)
                    self.assertFalse((self.folder / "broken.tag").exists())
                (self.folder / "broken.tag").unlink(missing_ok=True)


if __name__ == "__main__":
    main()
