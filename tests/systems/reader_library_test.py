"""The half of the library that reads, as a shared library for old Linux, for arm64 and for macOS: what it needs and exports;
and that it decodes every golden file, where something here runs it.

    reader_library_test.py PROGRAM FOLDER
        FOLDER: where it is built. With TAGRID_LONG=1, as that takes minutes.
"""

import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

from reading_half import exported

PROGRAM, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
ARM64, X86_64 = 0x0100000C, 0x01000007


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE).stdout


def library(system):
    run(ROOT / "tools/reader_library.sh", system, FOLDER / "reader" / system)
    return FOLDER / "reader" / system / ("libtagrid_reading.so" if "linux" in system else "libtagrid_reading.dylib")


class MachO:
    """A library of macOS with 64 bits, as far as loader.h of macOS describes it."""

    def __init__(self, content):
        magic, self.processor, _, self.kind, commands = struct.unpack_from("<5I", content)
        assert magic == 0xFEEDFACF
        self.needs, self.names, self.oldest, self.is_signed = [], set(), None, False
        at = 32
        for _ in range(commands):
            command, size = struct.unpack_from("<2I", content, at)
            if command == 0xC:  # LC_LOAD_DYLIB
                begin, = struct.unpack_from("<I", content, at + 8)
                self.needs.append(content[at + begin:at + size].split(b"\0")[0].decode())
            elif command == 0x1D:  # LC_CODE_SIGNATURE
                self.is_signed = True
            elif command == 0x32:  # LC_BUILD_VERSION
                self.oldest, = struct.unpack_from("<I", content, at + 12)
            elif command == 2:  # LC_SYMTAB
                symbols, count, texts, _ = struct.unpack_from("<4I", content, at + 8)
                for i in range(count):
                    text, type_, section = struct.unpack_from("<IBB", content, symbols + 16 * i)
                    if type_ & 1 and section:  # N_EXT, and defined here
                        self.names.add(content[texts + text:].split(b"\0", 1)[0].decode())
            at += size


@unittest.skipUnless(shutil.which("npm") or "TAGRID_NODE_MODULES" in os.environ, "npm is missing, which has the compiler")
class ReaderLibraries(unittest.TestCase):
    def assert_for_linux(self, path, processor):
        shown = run("readelf", "-hd", "-V", path).decode()
        self.assertIn(processor, shown)
        needed = set(re.findall(r"\(NEEDED\).*\[(.*?)\.so", shown))
        self.assertLessEqual(needed, {"libc", "libm", "libpthread", "libdl", "ld-linux-x86-64", "ld-linux-aarch64"})
        newest = max(tuple(map(int, version.split("."))) for version in re.findall(r"GLIBC_([\d.]+)", shown))
        self.assertLessEqual(newest, (2, 17))
        names = re.findall(r" T (\w+)$", run("nm", "-D", "--defined-only", path).decode(), re.MULTILINE)
        self.assertEqual(set(names), exported())

    def assert_decodes(self, path, compiler, *emulator):
        golden = sorted((ROOT / "tests/golden/1.0").glob("*.tag"))
        self.assertGreater(len(golden), 30)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            run(compiler, "-std=c11", f"-I{ROOT / 'include'}", ROOT / "tests/library/read_blocks.c", path,
                f"-Wl,-rpath,{path.parent}", "-o", folder / "read")
            for file in golden:
                with self.subTest(file.name):
                    run(PROGRAM, "decode", file, "--volume", "0", "-o", folder / "back.raw", "-q", "-f")
                    self.assertEqual(run(*emulator, folder / "read", file), (folder / "back.raw").read_bytes())

    def test_for_linux(self):
        path = library("linux-x86_64")
        self.assert_for_linux(path, "X86-64")
        self.assert_decodes(path, "cc")

    def test_for_linux_on_arm64(self):
        path = library("linux-aarch64")
        self.assert_for_linux(path, "AArch64")
        if not shutil.which("qemu-aarch64") or not shutil.which("aarch64-linux-gnu-gcc"):
            self.skipTest("there is no qemu-user, or no compiler for arm64: tools/install_packages.sh arm64")
        self.assert_decodes(path, "aarch64-linux-gnu-gcc", "qemu-aarch64", "-L", "/usr/aarch64-linux-gnu")

    def test_for_macos(self):
        for system, processor in (("macos-arm64", ARM64), ("macos-x86_64", X86_64)):
            with self.subTest(system):
                found = MachO(library(system).read_bytes())
                self.assertEqual((found.processor, found.kind), (processor, 6))
                self.assertEqual(found.oldest, 11 << 16)
                self.assertEqual(set(found.needs), {"/usr/lib/libSystem.B.dylib"})
                self.assertEqual(found.names, {f"_{name}" for name in exported()})
                # Processors of arm64 start nothing without.
                self.assertTrue(found.is_signed or processor == X86_64)


if __name__ == "__main__":
    if "TAGRID_LONG" in os.environ:
        unittest.main(argv=sys.argv[:1])
    else:
        print("skipped: compiles half of the library four times: set TAGRID_LONG=1")
