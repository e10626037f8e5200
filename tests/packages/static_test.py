"""The static program needs no library of the system and no new kernel, and writes the same files as the ordinary one,
also on other releases of Debian.

    static_test.py PROGRAM
        PROGRAM: the ordinary one. With TAGRID_LONG=1, as building takes minutes, and other releases are installed.
"""

import ctypes
import filecmp
import os
import pathlib
import platform
import shutil
import struct
import subprocess
import sys
import tarfile
import tempfile
import unittest

import h5py
import numpy
import tifffile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

from scans import write_series
from served_page import served_page

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
# The files that these make in an empty folder are compared.
COMMANDS = """
set -e
tagrid phantom --dims 120,100,80 -o scan.nhdr -q
tagrid encode scan.nhdr -o lossless.tag -q
tagrid encode scan.nhdr --max-error 5 --overviews 4 -o bound.tag -q
tagrid encode scan.nhdr --psnr 40 --memory 200M -o psnr.tag -q
tagrid encode - --dims 120,100,80 --type int16 -o piped.tag -q < scan.raw
cp bound.tag protected.tag
tagrid protect protected.tag --parity 5% -q
cp protected.tag damaged.tag
printf damage | dd of=damaged.tag bs=1 seek=20000 conv=notrunc status=none
tagrid repair damaged.tag -o repaired.tag -q
cmp protected.tag repaired.tag
for end in nrrd nii.gz mha ome.zarr; do tagrid decode bound.tag -o back.$end -q; done
tagrid decode lossless.tag -o back.raw -q
cmp back.raw scan.raw
tagrid verify bound.tag --against scan.nhdr > verified
tagrid info bound.tag --json > info.json
tagrid preview bound.tag -o preview.png -q
tagrid mesh bound.tag --level 9 -o mesh.vtu -q
tagrid surface bound.tag --iso 300.5 -o surface.stl -q
mkdir archive
cp scan.nhdr scan.raw archive
tagrid convert --find archive > list.tsv 2> /dev/null
tagrid convert --manifest list.tsv --output-dir tags -q > /dev/null 2>&1
# These have names of folders and times.
rm list.tsv tags/results.jsonl
"""


def calls_of_linux_4_18():
    """From now on, this process sees the system calls of x86-64 that Linux 4.18 has: newer ones do not exist."""
    # Load the number of the call; from 335 on, fail with ENOSYS.
    instructions = [(0x20, 0, 0, 0), (0x35, 0, 1, 335), (0x06, 0, 0, 0x50000 | 38), (0x06, 0, 0, 0x7FFF0000)]
    filter = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *each) for each in instructions))
    program = ctypes.create_string_buffer(struct.pack("@HP", len(instructions), ctypes.addressof(filter)))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(38, 1, 0, 0, 0) != 0 or libc.prctl(22, 2, program) != 0:
        raise OSError(ctypes.get_errno(), "prctl")


class Static(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        subprocess.run([ROOT / "tools/static.sh", cls.folder], check=True, stdout=subprocess.DEVNULL)
        (archive,) = cls.folder.glob("tagrid-*.tar.gz")
        with tarfile.open(archive) as file:
            file.extractall(cls.folder)
        cls.unpacked = cls.folder / archive.name.removesuffix(".tar.gz")
        cls.program = cls.unpacked / "bin/tagrid"
        cls.expected = cls.folder / "expected"
        cls.expected.mkdir()
        cls.run_commands(PROGRAM, cls.expected)

    @staticmethod
    def run_commands(program, folder, **options):
        environment = os.environ | {"PATH": f"{program.parent}:{os.environ['PATH']}"}
        subprocess.run(["bash", "-c", COMMANDS], cwd=folder, env=environment, check=True, **options)

    def assert_expected(self, folder):
        """The files of `folder` are those of the ordinary program."""
        names = {path.relative_to(self.expected) for path in self.expected.rglob("*") if path.is_file()}
        self.assertGreater(len(names), 20)
        for name in sorted(names):
            self.assertTrue(filecmp.cmp(self.expected / name, folder / name, shallow=False), name)

    def test_it_needs_no_library(self):
        shown = subprocess.run(["readelf", "-ld", self.program], check=True, capture_output=True, text=True).stdout
        for word in ("NEEDED", "INTERP", "RPATH", "RUNPATH"):
            self.assertNotIn(word, shown)
        # Its addresses are random all the same.
        self.assertIn("DYN (", shown)

    def test_it_writes_what_the_ordinary_program_writes(self):
        folder = self.folder / "static"
        folder.mkdir()
        self.run_commands(self.program, folder)
        self.assert_expected(folder)

    @unittest.skipUnless(platform.machine() == "x86_64", "the numbers of calls are those of x86-64")
    def test_it_runs_with_the_calls_of_an_old_kernel(self):
        newer = subprocess.run([sys.executable, "-c", "import os; os.pidfd_open(os.getpid())"], capture_output=True,
                               text=True, preexec_fn=calls_of_linux_4_18)
        self.assertIn("Function not implemented", newer.stderr)
        folder = self.folder / "old kernel"
        folder.mkdir()
        self.run_commands(self.program, folder, preexec_fn=calls_of_linux_4_18)
        self.assert_expected(folder)

    def test_it_runs_on_other_releases_of_debian(self):
        for release in ("11", "13"):
            with self.subTest(release), tempfile.TemporaryDirectory(dir=self.build_of(release)) as name:
                folder = pathlib.Path(name)
                begun = self.in_debian(release, "true")
                if begun.returncode != 0:
                    self.skipTest(begun.stdout.strip().splitlines()[-1])
                shutil.copy(self.program, folder)
                (folder / "made").mkdir()
                script = f"export PATH=/work/build/{folder.name}:$PATH\ncd /work/build/{folder.name}/made\n{COMMANDS}"
                done = self.in_debian(release, "bash", "-c", script)
                self.assertEqual(done.returncode, 0, done.stdout)
                self.assert_expected(folder / "made")

    @staticmethod
    def in_debian(release, *command):
        return subprocess.run([ROOT / "tools/in_debian.sh", release, *command], text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT)

    @staticmethod
    def build_of(release):
        folder = ROOT / f"build/debian-{release}-build"
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def test_it_says_what_it_cannot_do(self):
        done = subprocess.run([self.program, "info", "http://127.0.0.1:1/scan.tag"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 74, done.stderr)
        self.assertIn("needs libcurl, which this static program cannot load; download the file", done.stderr)
        (self.folder / "volume.vdb").write_bytes(b" BDV\0\0\0\0" + bytes(100))
        done = subprocess.run([self.program, "encode", self.folder / "volume.vdb"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 74, done.stderr)
        self.assertIn("tagrid-read-vdb", done.stderr)

    def test_its_readers_need_no_library(self):
        readers = sorted(path.name for path in (self.unpacked / "libexec/tagrid").iterdir())
        self.assertEqual(readers, ["tagrid-read-bmp", "tagrid-read-dicom", "tagrid-read-hdf5", "tagrid-read-jp2",
                                   "tagrid-read-png", "tagrid-read-tiff", "tagrid-write-hdf5"])
        for reader in readers:
            shown = subprocess.run(["readelf", "-ld", self.unpacked / "libexec/tagrid" / reader], check=True,
                                   capture_output=True, text=True).stdout
            for word in ("NEEDED", "INTERP", "RPATH", "RUNPATH"):
                self.assertNotIn(word, shown, reader)

    def read_by_both(self, folder, **options):
        """The .tag files of DICOM, TIFF and HDF5 that other programs wrote, by the ordinary and by the static program."""
        folder.mkdir()
        samples = numpy.random.default_rng(1).integers(-1000, 3000, (9, 40, 50), dtype=numpy.int16)
        with h5py.File(folder / "volume.h5", "w") as file:
            file.create_dataset("data", data=samples, compression="gzip", chunks=(3, 40, 50))
        tifffile.imwrite(folder / "volume.tif", samples, compression="zlib", photometric="minisblack")
        # One series as it is, and one with JPEG's lossless form.
        write_series(folder / "series", samples & 0xFFF)
        (folder / "jpeg").mkdir()
        for file in (folder / "series").iterdir():
            subprocess.run(["dcmcjpeg", "--encode-lossless", file, folder / "jpeg" / file.name], check=True)
        for name in ("volume.h5", "volume.tif", "series", "jpeg"):
            files = []
            for program in (PROGRAM, self.program):
                files.append(folder / f"{program.parent.name}-{pathlib.Path(name).name}.tag")
                self.run_program(program, "encode", folder / name, "--strip", "-o", files[-1],
                                 **(options if program == self.program else {}))
            self.assertTrue(filecmp.cmp(*files, shallow=False), name)
            if name.startswith("volume"):
                decoded = self.run_program(self.program, "decode", files[1], "--format", "raw", "-o", "-").stdout
                self.assertEqual(decoded, samples.tobytes(), name)

    @staticmethod
    def run_program(program, *arguments, **options):
        done = subprocess.run([program, *arguments, "-q"], capture_output=True, **options)
        if done.returncode != 0:
            raise AssertionError((program, arguments, done.stderr))
        return done

    def test_it_reads_dicom_tiff_and_hdf5_as_the_ordinary_program_does(self):
        self.read_by_both(self.folder / "formats")

    @unittest.skipUnless(platform.machine() == "x86_64", "the numbers of calls are those of x86-64")
    def test_its_readers_run_with_the_calls_of_an_old_kernel(self):
        self.read_by_both(self.folder / "formats of old kernels", preexec_fn=calls_of_linux_4_18)

    def test_it_serves_its_page(self):
        page, decoder = served_page(self.program, self.expected / "bound.tag")
        self.assertIn(b"viewer.js", page)
        self.assertEqual(decoder[:4], b"\0asm")

    def test_the_archive_has_licenses_and_the_list_of_what_is_linked(self):
        documents = self.unpacked / "share/doc/tagrid"
        listed = (documents / "tagrid.spdx.json").read_text()
        self.assertNotIn("DYNAMIC_LINK", listed)
        self.assertIn("DCMTK", listed)
        self.assertNotIn("libjxl", listed)
        for package in ("libtbb-dev", "libisal-dev", "libzstd-dev", "zlib1g-dev", "libc6-dev"):
            self.assertGreater((documents / "licenses" / package).stat().st_size, 500, package)
        self.assertTrue(any((documents / "licenses").glob("libstdc++-*-dev")))


if __name__ == "__main__":
    if "TAGRID_LONG" not in os.environ:
        print("skipped: takes minutes and installs releases of Debian; set TAGRID_LONG=1")
    else:
        unittest.main()
