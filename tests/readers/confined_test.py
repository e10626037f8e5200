"""What code that took over a reader can open, and what it sees of the environment: the source, and what its format may
need next to it. And what a format needs is read all the same.

The code is a library that takes the place of seccomp_load(): it tries the moment the sandbox is closed."""

import os
import re
import shutil
import subprocess
import unittest

from other_readers import IS_SANITIZED, PROGRAM, ReaderTest, h5py, main, numpy
from zarr_files import write_v3

TAKEN_OVER = r"""
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
extern char** environ;
int seccomp_load(void* filter) {
  int (*real)(void*) = (int (*)(void*))dlsym(RTLD_NEXT, "seccomp_load");
  if (real(filter) != 0) _exit(90);
  char seen[1500] = "TRIED";
  for (char* path = strtok(getenv("TAGRID_TRIES"), ":"); path; path = strtok(NULL, ":")) {
    char byte[8];
    int file = open(path, O_RDONLY);
    if (file >= 0 && read(file, byte, sizeof byte) > 0) strcat(strcat(seen, " "), strrchr(path, '/') + 1);
  }
  int own = open("/proc/self/environ", O_RDONLY), held = 0;
  char block[65536];
  ssize_t size = own < 0 ? 0 : read(own, block, sizeof block);
  for (char** variable = environ; *variable; ++variable) held += strstr(*variable, "SECRET") != NULL;
  held += size > 0 && memmem(block, (size_t)size, "SECRET", 6) != NULL;
  strcat(seen, held ? " SEEN" : " none");
  strcat(seen, getenv("TAGRID_OWN") ? " own" : "");
  fprintf(stderr, "%s.\n", seen);
  _exit(41);
}
"""


@unittest.skipIf(IS_SANITIZED, "sanitizers are not confined")
@unittest.skipUnless(shutil.which("gcc"), "there is no gcc on this machine")
class TakenOver(ReaderTest):
    def setUp(self):
        super().setUp()
        words = subprocess.run([PROGRAM, "formats", "-v"], capture_output=True, text=True, check=True).stdout
        if "Landlock" not in words or "no Landlock" in words:
            self.skipTest("this kernel has no Landlock")
        (self.folder / "code.c").write_text(TAKEN_OVER)
        subprocess.run(["gcc", "-shared", "-fPIC", "-w", "-o", "code.so", "code.c", "-ldl"], cwd=self.folder, check=True)
        self.home = self.folder / "home"
        for name in (".ssh/id", ".netrc", "notes.txt", "credentials", "more/deep", ".hidden.h5", ".hidden.tif", ".hidden.dcm"):
            self.put(name)

    def put(self, name):
        path = self.home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"samples of something")
        return str(path)

    def seen(self, reader, source, others=()):
        """The names of files that the reader of this source can open, and what it sees of the environment."""
        tried = [self.home / name for name in (".ssh/id", ".netrc", "notes.txt", "credentials", "more/deep")]
        tried += [self.home / f".hidden.{kind}" for kind in ("h5", "tif", "dcm")] + [self.home / name for name in others]
        secrets = {name: "SECRET" for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN", "GITHUB_TOKEN",
                                               "SSH_AUTH_SOCK", "https_proxy", "PASSWORD", "KRB5CCNAME", "S3_SECRET_KEY")}
        run = subprocess.run([PROGRAM, "encode", source, "--from", reader, "-o", self.folder / "o.tag", "-f"], text=True,
                             capture_output=True, check=False,
                             env={**os.environ, **secrets, "LD_PRELOAD": str(self.folder / "code.so"), "TAGRID_OWN": "1",
                                  "TAGRID_TRIES": ":".join(map(str, [*tried, "/etc/passwd"]))})
        found = re.search(r"TRIED(.*)\.", run.stderr)
        self.assertTrue(found, run.stderr)
        self.assertEqual(run.returncode, 74)
        *names, environment, own = found[1].split()
        self.assertEqual((environment, own), ("none", "own"))
        return names

    def test_a_file_is_no_way_to_what_lies_beside_it(self):
        formats = set(subprocess.run([PROGRAM, "formats"], capture_output=True, text=True, check=True).stdout.split())
        for reader, name, more, others in [
                ("hdf5", "scan.h5", ["part.h5", "part.nxs", "part.hdf5"], ["part.tif", "part.dcm", "more/part.h5"]),
                ("hdf5", "scan.data", ["part.data", "part.h5"], ["part.tif"]),
                ("hdf5", "scan", ["part.h5"], ["part"]),
                ("tiff", "scan.ome.tif", ["part.tiff", "set.companion.ome", "set.xml"], ["part.h5", "more/part.tif"]),
                ("dicom", "IM0001", ["IM0002", "part.dcm"], ["IMAGE", "part.h5", "more/IM0003"]),
                ("dicom", "scan.dcm", ["part.dcm"], ["part.tif", "id_rsa"]),
                ("vdb", "scan.vdb", [], ["part.vdb"]), ("jp2", "scan.jp2", [], ["part.jp2"]),
                ("bmp", "scan.bmp", [], ["part.bmp"]), ("png", "scan.png", [], ["part.png"]), ("zeiss", "scan.txm", [], ["part.txm"]), ("zarr", "scan.ozx", [], ["part.ozx"])]:
            with self.subTest(name):
                if reader not in formats:
                    continue
                source = self.put(name)
                for other in [*more, *others]:
                    self.put(other)
                self.assertEqual(self.seen(reader, source, [name, *more, *others]), [name, *more])

    def test_a_directory_is_all_of_it_but_what_is_hidden(self):
        for reader, name in (("tiff", "a01.tif"), ("dicom", "a01.dcm"), ("zarr", ".zarray")):
            with self.subTest(reader):
                self.put(name)
                self.assertEqual(self.seen(reader, str(self.home), [name]), ["notes.txt", "credentials", "deep", name])

    def test_a_dicomdir_is_what_is_below_it(self):
        self.assertEqual(self.seen("dicom", self.put("DICOMDIR")), ["notes.txt", "credentials", "deep"])


@unittest.skipUnless(h5py and numpy, "h5py")
class Needed(ReaderTest):
    def test_links_lead_to_files_of_the_directory_by_their_names(self):
        volume = numpy.arange(60, dtype="i2").reshape(3, 4, 5)
        (self.folder / "more").mkdir()
        for name in ("part.h5", "part.nxs", "part.odd", ".part.h5", "more/part.h5"):
            with h5py.File(self.folder / name, "w") as file:
                file["data"] = volume
        for name, words in (("part.h5", ""), ("part.nxs", ""), ("part.odd", "does not have the name of an HDF5 file, so it is not read"),
                            (".part.h5", "is hidden, so it is not read"), ("more/part.h5", "is in another directory")):
            with self.subTest(name):
                with h5py.File(self.folder / "a.h5", "w") as file:
                    file["here"] = h5py.ExternalLink(name, "/data")
                    file["own"] = volume + 1
                if words:
                    message = self.assert_refused(65, words, "encode", "a.h5", "--dataset", "/here", "-o", "refused.tag")
                    self.assertIn(f"in the file {name}", message)
                else:
                    self.encodes(volume, "a.h5", "--dataset", "/here")

    def test_links_behind_links_to_directories_are_read(self):
        """As in a store of links whose parts are links to such stores."""
        volume = numpy.arange(60, dtype="u2").reshape(3, 4, 5)
        write_v3(self.folder / "a.zarr", volume, (2, 2, 2))
        content = self.folder / "elsewhere" / "content"
        content.mkdir(parents=True)
        links = self.folder / "links" / "array"
        for number, path in enumerate(path for path in (self.folder / "a.zarr").rglob("*") if path.is_file()):
            shutil.copy(path, content / str(number))
            link = links / path.relative_to(self.folder / "a.zarr")
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(content / str(number))
        (links / "circle").symlink_to("..")
        (self.folder / "b.zarr").mkdir()
        (self.folder / "b.zarr" / "zarr.json").write_text('{"zarr_format": 3, "node_type": "group"}')
        (self.folder / "b.zarr" / "0").symlink_to(links)
        (self.folder / "b.zarr" / "circle").symlink_to(".")
        self.encodes(volume, "b.zarr", "--dataset", "0")

    @unittest.skipIf(IS_SANITIZED, "sanitizers are not confined")
    def test_what_the_sandbox_keeps_from_a_reader_is_said(self):
        if "Landlock" not in self.ok("formats", "-v").stdout or "no Landlock" in self.ok("formats", "-v").stdout:
            self.skipTest("this kernel has no Landlock")
        write_v3(self.folder / "a.zarr" / ".hidden", numpy.arange(60, dtype="u2").reshape(3, 4, 5), (2, 2, 2))
        (self.folder / "a.zarr" / "zarr.json").write_text('{"zarr_format": 3, "node_type": "group"}')
        self.assert_refused(74, "the sandbox of the reader blocks it (TAGRID_SANDBOX=off allows it)", "encode", "a.zarr",
                            "--dataset", ".hidden")


if __name__ == "__main__":
    main()
