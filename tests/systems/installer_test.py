"""The installer for Windows, run under Wine with files in place of the program: what it installs, registers and refuses,
and what an update and the removal leave of others' files and types.

    installer_test.py
        With TAGRID_LONG=1, as Wine needs a minute.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

from reading_half import WINE

TYPE, CLASS = r"HKLM\Software\Classes\.tag", r"HKLM\Software\Classes\tagrid.volume"
UNINSTALL = r"HKLM\Software\Microsoft\Windows\CurrentVersion\Uninstall\tagrid"


class Installer(unittest.TestCase):
    """One Windows for all, as Wine needs half a minute to make it."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.windows = cls.folder / "wine"
        cls.drive = cls.windows / "drive_c"
        cls.programs = cls.drive / "Program Files"
        cls.run_windows("wineboot", "--init")
        server = shutil.which("wineserver") or pathlib.Path(WINE).with_name("wineserver")
        cls.addClassCleanup(subprocess.run, [server, "-k"], check=False, env=cls.environment())
        cls.first = cls.made("1.0", {"bin/tagrid.exe": "first", "share/doc/old page.html": "old"})
        cls.second = cls.made("1.1", {"bin/tagrid.exe": "second", "share/doc/new/page.html": "new"})

    def tearDown(self):
        self.remove(self.programs / "tagrid")
        self.run_windows("reg", "delete", TYPE, "/f")

    @classmethod
    def environment(cls):
        return {"PATH": "/usr/bin:/bin", "HOME": str(cls.folder), "WINEPREFIX": str(cls.windows), "WINEDEBUG": "-all"}

    @classmethod
    def run_windows(cls, *command):
        return subprocess.run([WINE, *map(str, command)], env=cls.environment(), capture_output=True, text=True,
                              check=False, timeout=300, stdin=subprocess.DEVNULL)

    @classmethod
    def made(cls, version, files):
        """An installer of these files."""
        staged = cls.folder / version
        for name, content in {"LICENSE.txt": "license", **files}.items():
            (staged / name).parent.mkdir(parents=True, exist_ok=True)
            (staged / name).write_text(content)
        subprocess.run([ROOT / "tools/windows_installer.sh", version, staged, cls.folder / f"{version}.exe"],
                       check=True, stdout=subprocess.DEVNULL)
        return cls.folder / f"{version}.exe"

    def install(self, setup, *options):
        return self.run_windows(setup, "/S", *options).returncode

    def remove(self, folder):
        # In place: a copy of itself would go on after it has ended.
        if (folder / "uninstall.exe").exists():
            self.run_windows(folder / "uninstall.exe", "/S", f"_?={self.in_windows(folder)}")

    def in_windows(self, path):
        return "C:\\" + str(path.relative_to(self.drive)).replace("/", "\\")

    def files(self, folder=None):
        folder = folder or self.programs / "tagrid"
        return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*")
                if path.is_file() and path.name != "uninstall.exe"}

    def value(self, key, name=None):
        """A text in the registry, or None."""
        answer = self.run_windows("reg", "query", key, *(["/v", name] if name else ["/ve"]))
        _, found, text = answer.stdout.partition("REG_SZ")
        return text.strip() if answer.returncode == 0 and found else None

    def test_files_and_their_type_are_installed(self):
        self.assertEqual(self.install(self.first), 0)
        self.assertEqual(self.files(), {"LICENSE.txt": "license", "bin/tagrid.exe": "first",
                                        "share/doc/old page.html": "old"})
        self.assertEqual(self.value(TYPE), "tagrid.volume")
        self.assertEqual(self.value(CLASS + r"\shell\open\command"),
                         r'"C:\Program Files\tagrid\bin\tagrid.exe" view "%1"')
        self.assertEqual(self.value(UNINSTALL, "DisplayVersion"), "1.0")
        self.assertEqual(self.value(r"HKLM\Software\tagrid", "Folder"), r"C:\Program Files\tagrid")

    def test_an_update_goes_where_the_last_version_is_and_leaves_nothing_of_it(self):
        place = self.drive / "mine"  # /D takes no quotes
        self.install(self.first, f"/D={self.in_windows(place)}")
        (place / "share/notes.txt").write_text("mine")
        self.assertEqual(self.install(self.second), 0)
        self.assertFalse((self.programs / "tagrid").exists())
        self.assertEqual(self.files(place), {"LICENSE.txt": "license", "bin/tagrid.exe": "second",
                                             "share/doc/new/page.html": "new", "share/notes.txt": "mine"})
        self.assertEqual(self.value(UNINSTALL, "DisplayVersion"), "1.1")
        self.remove(place)

    def test_removal_takes_what_was_installed_and_nothing_else(self):
        self.install(self.first)
        (self.programs / "tagrid/share/notes.txt").write_text("mine")
        self.remove(self.programs / "tagrid")
        self.assertEqual(self.files(), {"share/notes.txt": "mine"})
        self.assertFalse((self.programs / "tagrid/bin").exists())
        for key in (TYPE, CLASS, UNINSTALL, r"HKLM\Software\tagrid"):
            self.assertNotEqual(self.run_windows("reg", "query", key).returncode, 0, key)
        shutil.rmtree(self.programs / "tagrid")

    def test_the_type_of_another_program_comes_back(self):
        self.run_windows("reg", "add", TYPE, "/ve", "/d", "tags.of.music", "/f")
        self.install(self.first)
        self.install(self.second)
        self.assertEqual(self.value(TYPE), "tagrid.volume")
        self.remove(self.programs / "tagrid")
        self.assertEqual(self.value(TYPE), "tags.of.music")

    def test_a_type_that_another_program_has_taken_since_stays(self):
        self.install(self.first)
        self.run_windows("reg", "add", TYPE, "/ve", "/d", "tags.of.music", "/f")
        self.remove(self.programs / "tagrid")
        self.assertEqual(self.value(TYPE), "tags.of.music")

    def test_a_folder_with_files_of_others_is_refused(self):
        place = self.drive / "data"
        place.mkdir()
        (place / "scan.tag").write_text("mine")
        self.assertNotEqual(self.install(self.first, f"/D={self.in_windows(place)}"), 0)
        self.assertEqual(self.files(place), {"scan.tag": "mine"})
        self.assertIsNone(self.value(TYPE))


if __name__ == "__main__":
    if "TAGRID_LONG" not in os.environ:
        print("skipped: installs under Wine: set TAGRID_LONG=1")
    elif WINE is None or shutil.which("makensis") is None:
        print("skipped: wine64 or makensis is missing (tools/install_packages.sh windows)")
    else:
        unittest.main()
