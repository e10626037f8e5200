"""The half of the library that reads blocks is built alone, with no library but zstd's and xxHash's, and decodes every
golden file as the program does: for this system, and for Windows, under Wine.

    reading_only_test.py PROGRAM FOLDER [CLASS ...]
        FOLDER: where it is built. With TAGRID_LONG=1, as that takes minutes. CLASS: only these tests.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

from reading_half import WINE, exported

PROGRAM, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE).stdout


class Decodes:
    """What holds for `reader`, a command that writes the samples of a file."""

    def test_it_decodes_what_the_program_decodes(self):
        files = sorted((ROOT / "tests/golden/1.0").glob("*.tag"))
        self.assertGreater(len(files), 30)
        with tempfile.TemporaryDirectory() as folder:
            for file in files:
                with self.subTest(file.name):
                    run(PROGRAM, "decode", file, "--volume", "0", "-o", f"{folder}/back.raw", "-q", "-f")
                    self.assertEqual(run(*self.reader, file), pathlib.Path(folder, "back.raw").read_bytes())

    def test_damage_is_refused(self):
        content = bytearray((ROOT / "tests/golden/1.0/voxels_lossless_int16.tag").read_bytes())
        content[len(content) // 2] ^= 1
        with tempfile.NamedTemporaryFile() as file:
            file.write(content)
            file.flush()
            self.assertEqual(subprocess.run([*self.reader, file.name], capture_output=True).returncode, 65)


class ThisSystem(Decodes, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        run("cmake", "-S", ROOT, "-B", FOLDER, "-G", "Ninja", "-DTAGRID_READING_ONLY=ON", "-DTAGRID_UNITY=most",
            "-DTAGRID_WERROR=ON")
        run("cmake", "--build", FOLDER)
        cls.reader = [FOLDER / "read_blocks"]
        run("cc", "-std=c11", "-c", f"-I{ROOT / 'include'}", ROOT / "tests/library/read_blocks.c",
            "-o", FOLDER / "read_blocks.o")
        run("c++", FOLDER / "read_blocks.o", FOLDER / "libtagrid_reading.a", "-lzstd", "-lxxhash", "-o", *cls.reader)

    def test_it_needs_nothing_else(self):
        needed = run("readelf", "-d", *self.reader).decode()
        for library in ("tbb", "fmt", "isal", "png", "libz."):
            self.assertNotIn(library, needed)
        self.assertNotIn("pthread_create", run("nm", "-u", FOLDER / "libtagrid_reading.a").decode())


@unittest.skipUnless(WINE and shutil.which("x86_64-w64-mingw32-g++-posix"),
                     "there is no mingw-w64, or no Wine: tools/install_packages.sh windows")
class Windows(Decodes, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = FOLDER.parent / "windows"
        run(ROOT / "tools/windows.sh", folder)
        prefix = tempfile.TemporaryDirectory()
        cls.addClassCleanup(prefix.cleanup)
        os.environ.update(WINEPREFIX=prefix.name, WINEDEBUG="-all")
        cls.reader = [WINE, folder / "reading/read_blocks.exe"]

    def described(self, program):
        return run("x86_64-w64-mingw32-objdump", "-p", program).decode()

    def libraries(self, program):
        return {line.split()[-1].lower() for line in self.described(program).splitlines() if "DLL Name:" in line}

    def test_it_needs_only_windows(self):
        self.assertLessEqual(self.libraries(self.reader[-1]), {"kernel32.dll", "msvcrt.dll"})


class WindowsLibrary(Windows):
    """The same program, with the DLL that the wheel of tagrid-reader has."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = cls.reader[-1].parent
        cls.reader = [WINE, cls.folder / "read_blocks_dll.exe"]

    def test_it_needs_only_windows(self):
        self.assertLessEqual(self.libraries(self.folder / "tagrid_reading.dll"), {"kernel32.dll", "msvcrt.dll"})
        self.assertIn("tagrid_reading.dll", self.libraries(self.reader[-1]))

    def test_it_exports_its_interface_and_nothing_else(self):
        table = self.described(self.folder / "tagrid_reading.dll").partition("[Ordinal/Name Pointer] Table")[2]
        names = set(re.findall(r"^\t\[ *\d+\] (\w+)", table, re.MULTILINE))
        self.assertEqual(names, exported())

    def test_the_wheel_is_for_every_python_of_windows(self):
        with tempfile.TemporaryDirectory() as folder:
            run("env", f"TAGRID_BUILD={FOLDER.parent / 'windows'}", ROOT / "tools/reader_wheel.sh", "windows", folder)
            wheel, = pathlib.Path(folder).glob("*.whl")
            self.assertRegex(wheel.name, r"^tagrid_reader-[\d.rc]+-py3-none-win_amd64\.whl$")
            with zipfile.ZipFile(wheel) as content:
                library = content.read("tagrid_reader/tagrid_reading.dll")
                self.assertEqual(library, (self.folder / "tagrid_reading.dll").read_bytes())


if __name__ == "__main__":
    if "TAGRID_LONG" in os.environ:
        unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
    else:
        print("skipped: compiles half of the library again: set TAGRID_LONG=1")
