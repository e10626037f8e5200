"""tagrid.exe, under Wine, beside the program of this system: the same bytes from the same commands, and what only
Windows does with names, pipes, locks and files that are open.

    windows_test.py PROGRAM FOLDER
        FOLDER: where tools/windows.sh builds. With TAGRID_LONG=1, as that takes minutes.
"""

import contextlib
import http.server
import json
import os
import random
import re
import shutil
import signal
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request
import zlib
from pathlib import Path
from urllib.parse import parse_qs, quote, urljoin, urlsplit

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

import h5py
import numpy
import pydicom
import tifffile

from other_program import OtherProgram, volume
from reading_half import WINE, wine_kept_running
from scans import data_set

PROGRAM, FOLDER = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()


def bmp(width, height, samples):
    """A file of 256 greys, bottom row first; `width` is a multiple of 4."""
    palette = b"".join(bytes([i, i, i, 0]) for i in range(256))
    rows = b"".join(samples[y * width:(y + 1) * width] for y in reversed(range(height)))
    offset = 54 + len(palette)
    return (b"BM" + struct.pack("<IHHI", offset + len(rows), 0, 0, offset) +
            struct.pack("<IiiHHIIiiII", 40, width, height, 1, 8, 0, len(rows), 0, 0, 256, 0) + palette + rows)


def png(width, height, samples):
    """A file of 256 greys."""
    def part(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    rows = b"".join(b"\0" + samples[y * width:(y + 1) * width] for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) +
            part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b""))


def tiff(width, height, samples):
    """A file of 256 greys, compressed by zlib."""
    strip = zlib.compress(samples)
    entries = ((256, width), (257, height), (258, 8), (259, 8), (262, 1), (273, 8), (277, 1), (278, height),
               (279, len(strip)))
    strip += b"\0" * (len(strip) % 2)
    return (b"II*\0" + struct.pack("<I", 8 + len(strip)) + strip + struct.pack("<H", len(entries)) +
            b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries) + bytes(4))


# Opens a file as old programs do: nobody else may rename, replace or remove it for so many milliseconds.
HEADER = ("NRRD0004\ntype: uint16\ndimension: 3\nsizes: 11 10 9\nencoding: raw\nendian: little\nspacings: 1 1 1\n"
          "data file: {}\n")
PATHS = r"""
#include <cstdio>

#include "io/text/paths.h"

using namespace tagrid;

int main() {
  for (const char* text : {R"(\\nas\ct\a\b)", R"(\\nas\ct\..\..\a\.\c\..)", "//nas/ct", "//nas/other/a", "//nas",
                           "C:/a/../b", "a/b", "/nas/ct/a"}) {
    const auto path = path_of(text), whole = normal_path(absolute_path(path));
    const auto below = text_of(relative_path(whole, path_of("//nas/ct/a")));
    std::printf("%s: %d %s %s\n", text_of(path).c_str(), is_absolute(path), text_of(whole).c_str(),
                below.empty() ? "-" : below.c_str());
  }
  for (const char* text : {"//nas/ct/d", "d"})
    std::printf("%s in //nas/ct/a: %s\n", text, path_in("//nas/ct/a", text).c_str());
}
"""

HOLDS = r"""
#include <windows.h>
#include <stdio.h>
#include <stdlib.h>
int main(int count, char** arguments) {
  HANDLE file = CreateFileA(arguments[1], GENERIC_READ, FILE_SHARE_READ, 0, OPEN_EXISTING, 0, 0);
  if (count != 3 || file == INVALID_HANDLE_VALUE) return 1;
  puts("open");
  fflush(stdout);
  Sleep(atoi(arguments[2]));
  return 0;
}
"""


class Ranges(http.server.BaseHTTPRequestHandler):
    """Answers with parts of the server's `content`."""
    protocol_version = "HTTP/1.1"

    def do_GET(self):  # pylint: disable=invalid-name
        content = self.server.content.get(self.path)
        if content is None:
            self.send_error(404)
            return
        first, last = (int(number) for number in self.headers["Range"].removeprefix("bytes=").split("-"))
        part = content[first:last + 1]
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{first + len(part) - 1}/{len(content)}")
        self.send_header("Content-Length", str(len(part)))
        self.send_header("ETag", '"1"')
        self.end_headers()
        self.wfile.write(part)

    def log_message(self, format, *args):  # pylint: disable=redefined-builtin
        pass


@unittest.skipUnless(WINE and shutil.which("x86_64-w64-mingw32-g++-posix"),
                     "there is no mingw-w64, or no Wine: tools/install_packages.sh windows")
class WindowsProgram(OtherProgram, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        build = FOLDER / "windows"
        subprocess.run([ROOT / "tools/windows.sh", "--program", build], check=True, stdout=subprocess.DEVNULL)
        cls.exe = build / "program/tagrid.exe"
        cls.program, cls.command = PROGRAM, [WINE, str(cls.exe)]
        prefix = tempfile.TemporaryDirectory()
        cls.addClassCleanup(prefix.cleanup)
        os.environ.update(WINEPREFIX=prefix.name, WINEDEBUG="-all", LC_ALL="C.UTF-8")
        cls.enterClassContext(wine_kept_running(cls.exe))

    @contextlib.contextmanager
    def server(self, *command, environment=None):
        """A command that serves something, and the first line that it prints; Ctrl-C ends it."""
        with subprocess.Popen([str(part) for part in command], cwd=self.folder / "there", stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, env={**os.environ, **(environment or {})}) as process:
            try:
                yield process.stdout.readline().decode().strip()
                process.send_signal(signal.SIGINT)
                self.assertEqual(process.wait(20), 0, command)
            finally:
                process.kill()

    @staticmethod
    def asked(address, **headers):
        """The code of an answer, what is said of its bytes, and they."""
        request = urllib.request.Request(address, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return answer.status, answer.headers["Content-Type"], answer.headers["Content-Range"], answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.headers["Content-Type"], error.headers["Content-Range"], error.read()

    def test_a_file_is_read_from_standard_input_and_replaced_while_it_is_open(self):
        self.there("phantom", "--dims", "20,20,20", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "-q", "-o", "p.tag")
        with open(self.folder / "there/p.tag", "rb") as file:
            done = subprocess.run([WINE, str(self.exe), "decode", "-", "-o", "-", "-q"], cwd=self.folder, stdin=file,
                                  capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, (self.folder / "there/p.nrrd").read_bytes()[-len(done.stdout):])
        self.assertEqual(len(done.stdout), 16000)
        # protect replaces the file that it reads.
        self.assertEqual(self.there("protect", "p.tag", "--parity", "5%", "-q").returncode, 0)
        self.assertEqual(self.here("verify", "p.tag", "-q", cwd="there").returncode, 0)
        self.assertEqual(set(self.files("there")), {"p.nrrd", "p.tag"})

    def test_errors_are_said_as_elsewhere(self):
        (self.folder / "here/broken.tag").write_bytes(b"TAGRID" + bytes(100))
        shutil.copy(self.folder / "here/broken.tag", self.folder / "there")
        for arguments in (("decode", "none.tag"), ("decode", "broken.tag"), ("encode", "."), ("mesh",),
                          ("--no-option",), ("info", "broken.tag"),
                          ("decode", "broken.tag", "-o", "no/such/folder/x.raw")):
            with self.subTest(arguments):
                done = self.both(*arguments)
                self.assertEqual(done.stderr, self.here(*arguments).stderr)

    def test_names_are_unicode_and_long(self):
        name = "Zürich 目录 \U0001F9B4"
        deep = "/".join(["a folder with a long name, as archives have them"] * 7)
        self.assertGreater(len(deep), 260)
        for name_ in ("here", "there"):
            (self.folder / name_ / deep).mkdir(parents=True)
        self.assertEqual(self.both("phantom", "--dims", "20,20,20", "-q", "-o", f"{name}.nrrd").returncode, 0)
        self.assertEqual(self.both("encode", f"{name}.nrrd", "-q", "-o", f"{deep}/{name}.tag").returncode, 0)
        self.assertEqual(self.both("restore", f"{deep}/{name}.tag", "-q", "-o", f"{name}").returncode, 0)
        self.assertEqual(self.files("there"), self.files("here"))
        # Wine tells no real path of more than 260 letters.
        for folder in ("here", "there"):
            (self.folder / folder / f"{name}.nhdr").write_text(HEADER.format(f"{name}.raw"))
            (self.folder / folder / f"{name}.raw").write_bytes(bytes(range(220)) * 9)
        self.assertEqual(self.both("encode", f"{name}.nhdr", "--rm", "-q", "-o", "removed.tag").returncode, 0)
        self.assertEqual(self.files("there"), self.files("here"))
        self.assertEqual(list((self.folder / "there").rglob("*.raw")), [])
        self.assertIn(f"{name}/{name}.nrrd", self.files("there"))

    def test_names_that_windows_takes_for_something_else_are_refused(self):
        for name in ("..\\..\\evil.nrrd", "C:evil.nrrd", "nul.nrrd", "a:stream.nrrd", "evil.nrrd."):
            with self.subTest(name):
                self.here("phantom", "--dims", "9,9,9", "-q", "-f", "-o", "plain.nrrd")
                (self.folder / "here/plain.nrrd").rename(self.folder / "here" / name)
                made = self.here("encode", f"./{name}", "--from", "nrrd", "-q", "-f", "-o", "evil.tag")
                self.assertEqual(made.returncode, 0, made.stderr)
                shutil.copy(self.folder / "here/evil.tag", self.folder / "there")
                before = sorted(self.folder.rglob("*"))
                done = self.there("restore", "evil.tag", "-o", "out")
                self.assertEqual(done.returncode, 64, done.stderr)
                self.assertIn(b"no file of this system may have this name", done.stderr)
                self.assertEqual(sorted(self.folder.rglob("*")), before)
                # Here, it is a name as others.
                self.assertEqual(self.here("restore", "evil.tag", "-q", "-f", "-o", "out").returncode, 0)
                shutil.rmtree(self.folder / "here")
                (self.folder / "here").mkdir()

    def test_names_that_differ_only_in_case_are_refused(self):
        (self.folder / "here/cs.nhdr").write_text(
            "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 10 10 2\nencoding: raw\nendian: little\ndata file: LIST\n"
            "Scan.raw\nscan.raw\n")
        for name in ("Scan.raw", "scan.raw"):
            (self.folder / "here" / name).write_bytes(name.encode() * 25)
        made = self.here("encode", "cs.nhdr", "-q", "-o", "cs.tag")
        self.assertEqual(made.returncode, 0, made.stderr)
        shutil.copy(self.folder / "here/cs.tag", self.folder / "there")
        for force in ([], ["-f"]):
            done = self.there("restore", "cs.tag", "-o", "back", *force)
            self.assertEqual(done.returncode, 64, done.stderr)
            self.assertIn(b"this file system takes this name and", done.stderr)
            self.assertEqual(list(self.folder.glob("there/back/*.raw")), [])
        for folder, name in (("a", "Knie.nrrd"), ("b", "knie.nrrd")):
            (self.folder / "there" / folder).mkdir()
            self.there("phantom", "--dims", "9,9,9", "-q", "-o", f"{folder}/{name}")
        (self.folder / "there/list.tsv").write_text("a/Knie.nrrd\toutput=Knie\nb/knie.nrrd\toutput=knie\n")
        done = self.there("convert", "--manifest", "list.tsv", "--output-dir", "tags", "-q")
        self.assertEqual(done.returncode, 64, done.stderr)
        self.assertIn(b"would also be the output of line 1", done.stderr)

    def test_outputs_have_names_that_windows_keeps(self):
        self.there("phantom", "--dims", "9,9,9", "-q", "-o", "p.nrrd")
        before = self.files("there")
        for name in ("nul.tag", "con.tag", "folder/aux.tag", "p.tag.", "a?.tag"):
            done = self.there("encode", "p.nrrd", "-o", name)
            self.assertEqual(done.returncode, 64, (name, done.stderr))
            self.assertIn(b"no file of Windows can have this name", done.stderr)
        self.assertEqual(self.there("encode", "p.nrrd", "-q", "-o", "nul").returncode, 0)
        self.assertEqual(self.files("there"), before)

    def test_a_compressed_file_names_the_same_system(self):
        for name in ("p.nii.gz", "p.nrrd"):
            self.assertEqual(self.both("phantom", "--dims", "9,9,9", "-q", "-o", name).returncode, 0)
        self.assertEqual(self.files("there"), self.files("here"))

    def test_a_share_is_not_a_directory_of_the_drive(self):
        # MinGW's library takes \\\\server\\share\\a for \\server\\share\\a of the drive: other samples are there.
        server, share, *rest = self.folder.parts[1:]
        place = self.folder.joinpath("share", *rest, "there")
        place.mkdir(parents=True)
        (Path(os.environ["WINEPREFIX"]) / "dosdevices/unc" / server).mkdir(parents=True)
        (Path(os.environ["WINEPREFIX"]) / "dosdevices/unc" / server / share).symlink_to(self.folder / "share")
        unc = "\\\\" + "\\".join([server, share, *rest, "there"])

        def there(*command):
            done = self.there(*command)
            self.assertEqual(done.returncode, 0, (command, done.stderr))
            return done.stdout.decode()

        samples = numpy.random.default_rng(1).integers(0, 1000, (2, 9, 10, 11), "u2")
        for name, values in zip("pq", samples):
            for folder, values_there in ((place, values), (self.folder / "there", 0 * values)):
                (folder / f"{name}.nhdr").write_text(HEADER.format(f"{name}.raw"))
                values_there.tofile(folder / f"{name}.raw")
        originals = {name: (place / name).read_bytes() for name in ("p.nhdr", "p.raw", "q.nhdr", "q.raw")}
        before = self.files("there")
        there("encode", f"{unc}\\p.nhdr", "-o", f"{unc}\\p.tag", "--json", unc.replace("\\", "/") + "/p.json", "-q")
        there("restore", f"{unc}\\p.tag", "-o", f"{unc}\\new\\..\\back", "-q")
        self.assertEqual((place / "back/p.raw").read_bytes(), originals["p.raw"])
        # Wine knows another path of each file, and tells it as the real one.
        found = [line.split("\t")[0] for line in there("convert", "--find", unc).splitlines() if line[0] != "#"]
        self.assertEqual(found, [f"Z:{place}/{name}.nhdr" for name in ("p", "q", "back/p")])
        # One is listed by its whole path, and one as it is named beside the list.
        (place / "list.tsv").write_text(f"{unc}\\p.nhdr\toutput=deep/p\nq.nhdr\n")
        archive = ("--manifest", f"{unc}\\list.tsv", "--output-dir", f"{unc}\\tags", "-q")
        there("convert", *archive)
        there("convert", *archive, "--remove-verified")
        self.assertFalse(set(originals) & set(os.listdir(place)))
        self.assertEqual(there("archive", "list", f"{unc}\\tags", "--json").count('"original":"removed"'), 2)
        there("restore", "--records", f"{unc}\\tags", "-q")
        there("restore", "--records", f"{unc}\\tags", "-o", f"{unc}\\all", "-q")
        # As Windows, which tells the path of the share, writes records.
        for name in originals:
            (place / name).unlink()
        records = place / "tags/results.jsonl"
        text = records.read_text()
        self.assertIn(f"Z:{place}/p.raw", text)
        records.write_text(text.replace(f"Z:{self.folder}/share/", f"//{server}/{share}/"))
        there("restore", "--records", f"{unc}\\tags", "-f", "-q")
        self.assertEqual(self.files("there"), before)
        there("restore", "--records", f"{unc}\\tags", "-f", "-o", "elsewhere", "-q")
        # That of q is relative to the list: here, one of the drive.
        restored = (self.folder / "there/elsewhere").rglob("*.*")
        self.assertEqual({path.name: path.read_bytes() for path in restored}, originals)
        shutil.rmtree(self.folder / "there/elsewhere")
        records.write_text(text)
        for folder in (place, place / "all"):
            self.assertEqual({name: (folder / name).read_bytes() for name in originals}, originals)
        there("convert", *archive, "--skip-done")
        self.assertEqual(self.files("there"), before)
        # Only the command chooses a server, and no device.
        (place / "other.nhdr").write_text(HEADER.format(f"{unc}\\p.raw"))
        done = self.there("encode", f"{unc}\\other.nhdr", "-o", "other.tag")
        self.assertEqual(done.returncode, 65, done.stderr)
        self.assertIn(b"on a server; copy the file to the directory of the header", done.stderr)
        done = self.there("encode", f"\\\\?\\Z:{self.folder}/there/p.nhdr", "-o", "other.tag")
        self.assertEqual(done.returncode, 64, done.stderr)
        self.assertIn(b"is not a path of a file; give it as C:\\file or \\\\server\\share\\file", done.stderr)
        # A path that begins with one slash is one of the current drive, and no option.
        done = self.there("encode", str(self.folder / "there/p.nhdr"), "-q", "-o", "p.tag")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_paths_of_shares_are_absolute(self):
        program, source = self.folder / "paths.exe", self.folder / "paths.cpp"
        source.write_text(PATHS)
        libraries = [self.exe.parent / f"io/libtagrid_io_{name}.a" for name in ("text", "errors")]
        subprocess.run(["x86_64-w64-mingw32-g++-posix", "-std=c++20", "-static", f"-I{ROOT}", "-o", program, source,
                        *libraries], check=True)
        done = subprocess.run([WINE, program], cwd="/", capture_output=True, check=True)
        self.assertEqual(done.stdout.decode().split("\r\n"), [
            # is absolute; normal and absolute; below //nas/ct/a
            "//nas/ct/a/b: 1 //nas/ct/a/b b",
            "//nas/ct/../../a/./c/..: 1 //nas/ct/a/ .",
            "//nas/ct: 1 //nas/ct ..",
            "//nas/other/a: 1 //nas/other/a -",
            "//nas: 1 //nas -",
            "C:/a/../b: 1 C:/b -",
            "a/b: 0 Z:/a/b -",
            "/nas/ct/a: 0 Z:/nas/ct/a -",
            "//nas/ct/d in //nas/ct/a: //nas/ct/d", "d in //nas/ct/a: //nas/ct/a/d", ""])

    def test_a_directory_may_have_a_slash_at_its_end(self):
        (self.folder / "there/tifs").mkdir()
        for z in range(3):
            (self.folder / f"there/tifs/{z}.raw").write_bytes(bytes([z]) * 144)
        for number, name in enumerate(("tifs/", "tifs\\", "tifs")):
            done = self.there("encode", name, "--dims", "9,8,3", "--type", "int16", "-q", "-f", "-o", f"{number}.tag")
            self.assertEqual(done.returncode, 0, done.stderr)
        done = self.there("encode", "tifs\\", "--dims", "9,8,3", "--type", "int16", "-q")
        self.assertEqual(done.returncode, 0, done.stderr)
        made = {(self.folder / "there" / name).read_bytes() for name in ("0.tag", "1.tag", "2.tag", "tifs.tag")}
        self.assertEqual(len(made), 1)

    def test_pipes_are_binary(self):
        data = bytes(range(256)) * 64
        raw = ["--dims", "32,32,16", "--type", "uint8"]
        encoded = self.there("encode", "-", *raw, "-q", "-o", "-", data=data)
        self.assertEqual(encoded.returncode, 0, encoded.stderr)
        self.assertEqual(encoded.stdout, self.here("encode", "-", *raw, "-q", "-o", "-", data=data).stdout)
        self.assertEqual(self.there("decode", "-", "-q", "-o", "-", data=encoded.stdout).stdout, data)

    def test_nothing_is_replaced_unasked_and_nothing_stays_behind(self):
        self.there("phantom", "--dims", "20,20,20", "-q", "-o", "p.nrrd")
        before = self.files("there")
        done = self.there("phantom", "--dims", "30,20,20", "-q", "-o", "p.nrrd")
        self.assertEqual(done.returncode, 64)
        self.assertIn(b"exists", done.stderr)
        self.assertEqual(self.files("there"), before)
        self.assertEqual(self.there("phantom", "--dims", "30,20,20", "-q", "-f", "-o", "p.nrrd").returncode, 0)
        self.assertEqual(set(self.files("there")), set(before))

    @contextlib.contextmanager
    def held(self, name, milliseconds):
        """A file that another program has open, and shares with nobody who would change its name."""
        program, source = self.folder / "holds.exe", self.folder / "holds.c"
        if not program.exists():
            source.write_text(HOLDS)
            subprocess.run(["x86_64-w64-mingw32-gcc-posix", "-o", program, source], check=True)
        with subprocess.Popen([WINE, program, name, str(milliseconds)], cwd=self.folder / "there",
                              stdout=subprocess.PIPE) as process:
            try:
                self.assertEqual(process.stdout.readline().strip(), b"open")
                yield
            finally:
                process.kill()

    def test_a_file_that_another_program_holds_stays_or_is_waited_for(self):
        self.there("phantom", "--dims", "20,20,20", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "-q", "-o", "p.tag")
        before = self.files("there")
        for name, arguments in (("p.nrrd", ("phantom", "--dims", "30,20,20", "-f", "-o", "p.nrrd")),
                                ("p.tag", ("protect", "p.tag", "--parity", "5%"))):
            with self.subTest(name):
                with self.held(name, 60000):
                    done = self.there(*arguments)
                    self.assertEqual(done.returncode, 74, done.stderr)
                    self.assertIn(b"another program is using it", done.stderr)
                    self.assertEqual(self.files("there"), before)
                with self.held(name, 1500):
                    begin = time.monotonic()
                    done = self.there(*arguments, "-q")
                    self.assertEqual(done.returncode, 0, done.stderr)
                    self.assertGreater(time.monotonic() - begin, 0.5, "it was not waited for")
                after = self.files("there")
                self.assertEqual(set(after), set(before))
                self.assertNotEqual(after, before)
                before = after

    def test_a_full_disk_is_said_and_leaves_nothing(self):
        disk = self.folder / "there/disk"
        disk.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", disk], capture_output=True,
                                 check=False)
        if mounted.returncode != 0:
            self.skipTest(f"no disk of one megabyte: {mounted.stderr.decode()}")
        self.addCleanup(subprocess.run, ["umount", "-l", disk], check=True)
        self.there("phantom", "--dims", "200,200,200", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "--max-error", "8", "-q", "-o", "p.tag")
        os.environ["TAGRID_SANDBOX"] = "off"
        self.addCleanup(os.environ.pop, "TAGRID_SANDBOX")
        (disk / "old.tag").write_bytes(b"old")
        for arguments in (("encode", "p.nrrd", "-o", "disk/new.tag"), ("encode", "p.nrrd", "-f", "-o", "disk/old.tag"),
                          ("encode", "p.nrrd", "--resume", "-o", "disk/new.tag"),
                          ("decode", "p.tag", "-o", "disk/new.nrrd"), ("decode", "p.tag", "-o", "disk/new.h5"),
                          ("mesh", "p.tag", "-o", "disk/new.vtu")):
            with self.subTest(arguments):
                done = self.there(*arguments, "-q")
                self.assertEqual(done.returncode, 74, done.stderr)
                # The C library of Wine 8 gives HDF5 another number of error.
                reason = b"cannot write" if arguments[-1].endswith(".h5") else b"No space left on device"
                self.assertIn(reason, done.stderr)
                self.assertIn(b"disk", done.stderr)
                kept = {"old.tag", ".new.tag.parts"} if "--resume" in arguments else {"old.tag"}
                self.assertLessEqual({path.name for path in disk.iterdir()}, kept)
                shutil.rmtree(disk / ".new.tag.parts", ignore_errors=True)
                self.assertEqual((disk / "old.tag").read_bytes(), b"old")

    def test_a_run_that_is_interrupted_leaves_nothing(self):
        self.there("phantom", "--dims", "300,300,200", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "--max-error", "2", "-q", "-o", "p.tag")
        os.environ["TAGRID_SANDBOX"] = "off"
        self.addCleanup(os.environ.pop, "TAGRID_SANDBOX")
        before = self.files("there")

        def has_begun():
            return set(os.listdir(self.folder / "there")) != set(before)

        for arguments in (("encode", "p.nrrd", "-o", "new.tag"), ("encode", "p.nrrd", "-f", "-o", "p.tag"),
                          ("decode", "p.tag", "-o", "new.mha"), ("decode", "p.tag", "-o", "new.h5"),
                          ("decode", "p.tag", "-f", "-o", "p.nrrd")):
            with self.subTest(arguments):
                with subprocess.Popen([WINE, self.exe, *arguments, "-q", "-T", "1"], cwd=self.folder / "there",
                                      stderr=subprocess.PIPE) as process:
                    while process.poll() is None and not has_begun():
                        time.sleep(0.01)
                    process.send_signal(signal.SIGINT)
                    message = process.communicate(timeout=60)[1]
                self.assertNotEqual(process.returncode, 0, message)
                # Wine removes files that are open after the process has ended.
                for _ in range(100):
                    if set(self.files("there")) == set(before):
                        break
                    time.sleep(0.05)
                self.assertEqual(self.files("there"), before)

    def test_two_passes_at_once_make_one_archive(self):
        for i in range(3):
            self.there("phantom", "--dims", f"{20 + i},20,20", "-q", "-o", f"p{i}.nrrd")
        (self.folder / "list.tsv").write_bytes(self.there("convert", "--find", ".", "-q").stdout)
        (self.folder / "list.tsv").rename(self.folder / "there/list.tsv")
        command = [WINE, str(self.exe), "convert", "--manifest", "list.tsv", "--output-dir", "out", "-q"]
        passes = [subprocess.Popen(command, cwd=self.folder / "there", stderr=subprocess.PIPE) for _ in range(2)]
        ends = [(one.communicate()[1], one.returncode) for one in passes]
        self.assertIn(0, [code for _, code in ends], ends)
        self.assertEqual(self.there("archive", "check", "out", "-q").returncode, 0)
        self.assertEqual(len(list((self.folder / "there/out").glob("*.tag"))), 3)

    def test_serve_gives_the_same_answers(self):
        self.there("phantom", "--dims", "90,80,70", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "--max-error", "2", "--overviews", "4", "-q", "-o", "p.tag")
        answers = []
        paths = ("zarr.json", "0/zarr.json", "0/c/0/0/0", "0/c/1/1/1", "1/c/0/0/0", "none", "/")
        for command in ([PROGRAM], [WINE, self.exe]):
            with self.server(*command, "serve", "p.tag") as address:
                self.assertRegex(address, r"^http://127\.0\.0\.1:\d+/[0-9a-f]{32}/p\.zarr/$")
                page = self.asked(address)
                self.assertIn(address.encode(), page[-1])
                ranges = ("bytes=5-99", "bytes=-7", "bytes=99999999-")
                answers.append([page[:-1], page[-1].replace(address.encode(), b""),
                                *(self.asked(urljoin(address, path)) for path in paths),
                                *(self.asked(urljoin(address, "0/c/0/0/0"), Range=text) for text in ranges),
                                self.asked(address, Host="example.org")])
                # A connection that stays is no reason to wait.
                idle = urllib.request.urlopen(address, timeout=60)  # pylint: disable=consider-using-with
                self.addCleanup(idle.close)
        self.assertEqual(answers[1], answers[0])
        self.assertEqual([answer[0] for answer in answers[0][2:]],
                         [200, 200, 200, 200, 200, 404, 404, 206, 206, 416, 403])

    def test_a_port_has_one_server(self):
        self.there("phantom", "--dims", "20,20,20", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "-q", "-o", "p.tag")
        with self.server(WINE, self.exe, "serve", "p.tag") as address:
            port = urlsplit(address).port
            again = self.there("serve", "p.tag", "--port", port)
            self.assertEqual(again.returncode, 74)
            self.assertIn(f"127.0.0.1, port {port}: Address already in use".encode(), again.stderr)

    def test_view_opens_a_browser_with_an_address_that_works_once(self):
        place = self.folder / "place"
        (place / "viewer/decoder").mkdir(parents=True)
        (place / "viewer/index.html").write_bytes(b"<!DOCTYPE html>")
        (place / "viewer/decoder/worker.js").write_bytes(b"1;")
        shutil.copy(self.exe, place)
        # Wine gives addresses to the browser of Linux.
        browser = self.folder / "xdg-open"
        browser.write_text(f'#!/bin/sh\necho "$1" > "{self.folder}/part"\n'
                           f'mv "{self.folder}/part" "{self.folder}/opened"\n')
        browser.chmod(0o755)
        self.there("phantom", "--dims", "20,20,20", "-q", "-o", "p.nrrd")
        self.there("encode", "p.nrrd", "-q", "-o", "my scan.tag")
        path = {"PATH": f"{self.folder}:{os.environ['PATH']}"}
        with self.server(WINE, place / "tagrid.exe", "view", "my scan.tag", environment=path) as address:
            file = urljoin(address, parse_qs(urlsplit(address).query)["src"][0].replace(" ", "%20"))
            self.assertEqual(self.asked(file)[-1], (self.folder / "there/my scan.tag").read_bytes())
            self.assertEqual(self.asked(file, Range="bytes=1-3")[-1], b"TAG")
            for _ in range(600):
                if (self.folder / "opened").exists():
                    break
                time.sleep(0.05)
            opened = (self.folder / "opened").read_text().strip()
            self.assertEqual([self.asked(opened)[0] for _ in range(2)], [200, 404])

    def test_addresses_are_read_as_files(self):
        self.here("phantom", "--dims", "90,80,70", "-q", "-o", "p.nrrd")
        self.here("encode", "p.nrrd", "--overviews", "auto", "-q", "-o", "p.tag")
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Ranges) as server:
            server.content = {"/p.tag": (self.folder / "here/p.tag").read_bytes()}
            threading.Thread(target=server.serve_forever, daemon=True).start()
            self.addCleanup(server.shutdown)
            address = f"http://127.0.0.1:{server.server_port}/p.tag"
            self.assertEqual(self.both("info", address).returncode, 0)
            self.assertEqual(self.both("decode", address, "-q", "-o", "back.nrrd").returncode, 0)
            self.assertEqual(self.both("decode", address, "--step", "2", "-q", "-o", "small.nrrd").returncode, 0)
            self.assertEqual(self.both("info", address + ".none").returncode, 74)
            there = self.files("there")
            self.assertEqual(there["back.nrrd"], self.files("here")["back.nrrd"])
            self.assertEqual(there["small.nrrd"], self.files("here")["small.nrrd"])
        # Nobody listens there any more.
        self.assertEqual(self.there("info", address).returncode, 74)

    @unittest.skipUnless(shutil.which("openssl"), "there is no openssl, which makes a certificate")
    def test_certificates_are_checked(self):
        key, certificate = self.folder / "key.pem", self.folder / "certificate.pem"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", certificate,
                        "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"],
                       check=True, capture_output=True)
        self.here("phantom", "--dims", "20,20,20", "-q", "-o", "p.nrrd")
        self.here("encode", "p.nrrd", "-q", "-o", "p.tag")
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Ranges) as server:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(certificate, key)
            server.socket = context.wrap_socket(server.socket, server_side=True)
            server.handle_error = lambda *_: None
            server.content = {"/p.tag": (self.folder / "here/p.tag").read_bytes()}
            threading.Thread(target=server.serve_forever, daemon=True).start()
            self.addCleanup(server.shutdown)
            address = f"https://localhost:{server.server_port}/p.tag"
            done = self.there("info", address)
            self.assertEqual(done.returncode, 74)
            self.assertIn(b"UNTRUSTED_ROOT", done.stderr)
            os.environ["CURL_CA_BUNDLE"] = str(certificate)
            self.addCleanup(os.environ.pop, "CURL_CA_BUNDLE")
            self.assertEqual(self.both("info", address).returncode, 0)

    def test_programs_read_folders_of_slices_if_they_may_do_so_without_a_sandbox(self):
        samples = volume("uint8", 40 * 30 * 20, random.Random(1))
        for name in ("here", "there"):
            for kind, image in (("bmp", bmp), ("png", png), ("tif", tiff)):
                (self.folder / name / kind).mkdir()
                for z in range(20):
                    path = self.folder / name / kind / f"s{z:02}.{kind}"
                    path.write_bytes(image(40, 30, samples[z * 1200:][:1200]))
        done = self.there("encode", "bmp", "-o", "s.tag")
        self.assertEqual(done.returncode, 74, done.stderr)
        self.assertIn(b"bmp: is not read, because Windows has no sandbox", done.stderr)
        self.assertIn(b"TAGRID_SANDBOX=off", done.stderr)
        os.environ["TAGRID_SANDBOX"] = "off"
        self.addCleanup(os.environ.pop, "TAGRID_SANDBOX")
        for kind in ("bmp", "png", "tif"):
            self.assertEqual(self.both("encode", kind, "-q", "-o", f"{kind}.tag").returncode, 0)
            self.assertEqual(self.both("decode", f"{kind}.tag", "-q", "-o", f"{kind}.raw").returncode, 0)
            self.assertEqual((self.folder / f"there/{kind}.raw").read_bytes(), samples)
        self.assertEqual(self.both("restore", "bmp.tag", "-q", "-o", "restored").returncode, 0)
        self.assertEqual(self.files("there"), self.files("here"))
        # What is wrong is said as elsewhere.
        for name in ("here", "there"):
            (self.folder / name / "bmp/s07.bmp").write_bytes(b"BM")
        done = self.both("encode", "bmp", "-f", "-o", "s.tag")
        self.assertEqual(done.returncode, 65)
        self.assertEqual(done.stderr, self.here("encode", "bmp", "-f", "-o", "s.tag").stderr)

    def test_programs_read_other_formats_as_elsewhere(self):
        os.environ["TAGRID_SANDBOX"] = "off"
        self.addCleanup(os.environ.pop, "TAGRID_SANDBOX")
        made, random_ = self.folder / "made", numpy.random.default_rng(1)
        made.mkdir()
        samples = (numpy.cumsum(random_.integers(-3, 4, (6, 30, 40)), axis=2) + 500).astype("u2")

        def tool(*command):
            subprocess.run([str(part) for part in command], cwd=made, check=True, capture_output=True)

        with h5py.File(made / "plain.h5", "w") as file:
            file["volume"] = samples
        with h5py.File(made / "chunks.h5", "w") as file:
            file.create_dataset("volume", data=samples, chunks=(2, 10, 20), compression="gzip", shuffle=True)
        (made / "slices").mkdir()
        for z, image in enumerate(samples):
            (made / f"s{z}.pgm").write_bytes(b"P5\n40 30\n65535\n" + image.astype(">u2").tobytes())
            tool("opj_compress", "-n", "2", "-i", f"s{z}.pgm", "-o", f"slices/s{z}.jp2")
            (made / f"s{z}.pgm").unlink()
        for coder in ((), ("dcmcjpeg", "+e1"), ("dcmcjpls", "+el"), ("dcmcrle",), ("dcmconv", "+td")):
            series = f"dicom{coder[0] if coder else ''}"
            (made / series).mkdir()
            for z, image in enumerate(samples):
                name = f"{series}/{z}.dcm"
                data_set(image, instance=f"1.2.3.{z + 1}", number=z, position=(0, 0, 3 * z)).save_as(made / name)
                if coder:
                    tool(*coder, name, name + ".new")
                    (made / (name + ".new")).rename(made / name)
        pydicom.dcmread(made / "dicom/0.dcm")  # it is one for others, too
        # No code page has all of these letters.
        folder = "\u65e5\u672c \xfc"
        for name in ("here", "there"):
            shutil.copytree(made, self.folder / name / folder)
        for source in sorted(path.name for path in made.iterdir()):
            with self.subTest(source):
                done = self.both("encode", f"{folder}/{source}", "-q", "-f", "-o", "v.tag")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(self.both("decode", "v.tag", "-q", "-f", "-o", "v.raw").returncode, 0)
                is_dicom = source.startswith("dicom")
                expected = (samples.astype(int) - 1024).astype("<i2") if is_dicom else samples
                self.assertEqual((self.folder / "there/v.raw").read_bytes(), expected.tobytes())
                self.both("restore", "v.tag", "-q", "-o", "restored " + source)
        # What Windows writes, others read.
        self.assertEqual(self.both("encode", f"{folder}/plain.h5", "-q", "-f", "-o", "v.tag").returncode, 0)
        self.assertEqual(self.both("decode", "v.tag", "-q", "-o", "written.h5").returncode, 0)
        with h5py.File(self.folder / "there/written.h5") as file:
            self.assertTrue((file["volume"][()] == samples).all())
        piped = self.there("decode", "v.tag", "-q", "-o", "-", "--format", "hdf5")
        self.assertEqual((piped.returncode, piped.stderr), (0, b""))
        self.assertEqual(piped.stdout, (self.folder / "there/written.h5").read_bytes())
        here, there = self.files("here"), self.files("there")
        self.assertEqual(sorted(here), sorted(there))
        self.assertEqual([name for name in here if here[name] != there[name]], [])

    def test_a_scan_names_no_file_outside_of_its_folder(self):
        os.environ["TAGRID_SANDBOX"] = "off"
        self.addCleanup(os.environ.pop, "TAGRID_SANDBOX")
        image = numpy.zeros((20, 30), "u2")
        tifffile.imwrite(self.folder / "there/other.tif", image)
        for name in (r"..\there\other.tif", r"C:\other.tif", r"C:other.tif", r"\\host\share\other.tif", "NUL",
                     "other.tif:x"):
            plane = '<TiffData IFD="0" FirstZ="{0}" PlaneCount="1"><UUID FileName="{1}">urn:uuid:{0}</UUID></TiffData>'
            planes = plane.format(0, "ome.ome.tif") + plane.format(1, name)
            description = f"""<?xml version="1.0"?>
                <OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06" UUID="urn:uuid:0"><Image ID="Image:0">
                <Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="30" SizeY="20" SizeZ="2" SizeC="1"
                SizeT="1">{planes}</Pixels></Image></OME>"""
            tifffile.imwrite(self.folder / "there/ome.ome.tif", image, metadata=None, description=description)
            with self.subTest(name):
                done = self.there("encode", "ome.ome.tif", "-q", "-o", "v.tag")
                self.assertEqual(done.returncode, 65, done.stderr)
                self.assertIn(b"which is not in its directory", done.stderr)
        with h5py.File(self.folder / "there/link.h5", "w") as file:
            file["link"] = h5py.ExternalLink(r"\\host\share\other.h5", "/volume")
        done = self.there("encode", "link.h5", "--dataset", "link", "-q", "-o", "v.tag")
        self.assertEqual(done.returncode, 65, done.stderr)
        self.assertIn(b"is named like a file on a server", done.stderr)

    def test_a_program_that_dies_is_named(self):
        place = self.folder / "place"
        place.mkdir()
        (self.folder / "there/scan.dead").write_bytes(b"x")
        # A program that says nothing as a reader does.
        shutil.copy(self.exe, place / "tagrid-read-dead.exe")
        os.environ["TAGRID_READER_PATH"] = f"Z:{self.folder};Z:{place}"
        self.addCleanup(os.environ.pop, "TAGRID_READER_PATH")
        done = self.there("encode", "scan.dead", "-o", "s.tag")
        self.assertEqual(done.returncode, 74, done.stderr)
        self.assertIn(b"tagrid-read-dead.exe: exited with code 64 before it answered", done.stderr)

    def test_the_list_of_dependencies_has_the_sources_that_were_built(self):
        listed = json.loads((self.exe.parent / "tagrid.spdx.json").read_text())["packages"][1:]
        versions = {package["externalRefs"][0]["referenceLocator"]: package["versionInfo"] for package in listed}
        sources = [re.match(r"(\S+) \(([^)]+)\)", (folder / "debian/changelog").read_text()).groups()
                   for folder in (FOLDER / "windows/libraries/sources").iterdir()]
        self.assertGreater(len(sources), 10)
        for name, version in sources:
            encoded = quote(version).replace("~", "%7E")
            self.assertEqual(versions.pop(f"pkg:deb/debian/{name}@{encoded}?arch=source", None), version)
        # What consists of headers is that of this system.
        self.assertEqual({locator.split("@")[0].removeprefix("pkg:deb/debian/") for locator in versions},
                         {"libhwy-dev", "libcli11-dev", "libfmt-dev", "nlohmann-json3-dev"})

    def test_memory_is_limited(self):
        self.there("phantom", "--dims", "100,100,100", "-q", "-o", "p.nrrd")
        done = self.there("encode", "p.nrrd", "-M", "1", "-o", "p.tag")
        self.assertEqual(done.returncode, 64)
        self.assertIn(b"give -M", done.stderr)
        done = self.there("encode", "p.nrrd", "-M", "200M", "-q", "-o", "p.tag", "--json", "r.json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(json.loads((self.folder / "there/r.json").read_text())["peak_memory"], 200 << 20)


if __name__ == "__main__":
    if "TAGRID_LONG" in os.environ:
        unittest.main(argv=sys.argv[:1])
    else:
        print("skipped: builds the program for Windows: set TAGRID_LONG=1")
