"""Archives of small series: how often files are opened, made durable, and readers started, as strace counts it."""

import collections
import re
import shutil
import statistics
import subprocess
import time
import unittest

from other_readers import IS_SANITIZED, PROGRAM, ReaderTest, main, numpy, pydicom
from scans import data_set, write_series

SERIES, SLICES = 6, 5
CALLS = "open,openat,execve,fsync,fdatasync"


def can_trace():
    """Some machines let nobody trace a program."""
    if not shutil.which("strace"):
        return False
    run = subprocess.run(["strace", "-f", "-e", "trace=execve", "true"], capture_output=True, text=True)
    return run.returncode == 0 and "execve" in run.stderr


@unittest.skipIf(pydicom is None or numpy is None, "there is no pydicom on this machine")
@unittest.skipIf(not can_trace(), "strace cannot trace programs here")
@unittest.skipIf(IS_SANITIZED, "sanitized readers start anew for each volume")
class Effort(ReaderTest):
    def write_series(self, folder_of):
        for series in range(SERIES):
            samples = numpy.random.default_rng(series).integers(0, 4096, (SLICES, 32, 32))
            write_series(self.folder / folder_of(series), samples, names=f"s{series}z{{}}.dcm", series=f"1.2.3.{series}")
        time.sleep(4.5)  # what changed a moment ago may change once more

    def traced(self, *arguments):
        """Runs the program; returns openings of each slice, and numbers of syncs and of programs started."""
        trace = self.folder / "trace"
        run = subprocess.run(["strace", "-f", "-qq", "-o", trace, "-e", f"trace={CALLS}", PROGRAM, *arguments], cwd=self.folder,
                             stdin=subprocess.DEVNULL, capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        text = trace.read_text()
        opened = collections.Counter(re.findall(r"open(?:at)?\(.*\"[^\"]*/(s\d+z\d+\.dcm)\"", text))
        return run.stdout, opened, len(re.findall(r" f(?:data)?sync\(", text)), len(re.findall(r"execve\(.* = 0", text))

    def assert_opened(self, opened, most):
        """The first file of a directory also tells the format."""
        self.assertEqual(len(opened), SERIES * SLICES)
        self.assertLessEqual(statistics.median(opened.values()), most)
        self.assertLessEqual(sum(opened.values()), most * SERIES * SLICES + 3 * SERIES)

    def convert(self, lists):
        (self.folder / "list.tsv").write_text(lists)
        return self.traced("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q")[1:]

    def test_in_directories_of_their_own(self):
        self.write_series(lambda series: f"in/patient{series}/CT")
        listed, opened, _, programs = self.traced("convert", "--find", "in")
        self.assert_opened(opened, 3)  # to know the format, by the reader, and for the sizes
        self.assertLessEqual(programs, 2)
        opened, syncs, programs = self.convert(listed)
        self.assert_opened(opened, 2)  # by the reader, and by tagrid
        # A file, its directory, and the two new ones; those of the run, records among them, about once a second.
        self.assertLessEqual(syncs, 3 * SERIES + 6)
        self.assertLessEqual(programs, 2)

    def test_in_one_directory(self):
        self.write_series(lambda series: "in")
        listed, opened, _, programs = self.traced("convert", "--find", "in")
        self.assert_opened(opened, 3)
        self.assertLessEqual(programs, 2)
        opened, syncs, programs = self.convert(listed)
        self.assert_opened(opened, 2)
        self.assertLessEqual(syncs, 2 * SERIES + 6)
        self.assertLessEqual(programs, 2)

    def test_all_volumes_of_a_set_are_those_of_its_files(self):
        """Each volume has files of its own, plain ones or compressed ones."""
        from pydicom.fileset import FileSet

        truth = numpy.random.default_rng(1).integers(0, 4096, (2, 4, 32, 32))
        for compressed in (False, True):
            disk = FileSet()
            for series, volume in enumerate(truth):
                for z, slice in enumerate(volume):
                    file = data_set(slice, series=f"1.2.3.{series}", instance=f"1.2.3.{series}.{z}", number=z, position=(0, 0, z),
                                    RescaleIntercept=0, StudyDate="20200101", StudyTime="120000", StudyID="1", SeriesNumber=series)
                    if compressed and series == 1:
                        file.compress("1.2.840.10008.1.2.5")
                    disk.add(file)
            name = f"disk{compressed}"
            disk.write(self.folder / name)
            time.sleep(4.5)
            (self.folder / "list.tsv").write_text(f"{name}/DICOMDIR\tseries=all\toutput={name}\n")
            self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q")
            for i, volume in enumerate(truth):
                self.ok("decode", f"out/{name}.tag", "--samples", "--volume", i, "-o", "one.raw", "-f")
                samples = numpy.fromfile(self.folder / "one.raw", self.info(f"out/{name}.tag")["type"])
                self.assertTrue((samples.reshape(volume.shape) == volume).all(), (name, i))


if __name__ == "__main__":
    main()
