"""tools/site.sh builds the site of the documents. No link in it is broken; its references have all that is public."""

import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools" / "documents"))
from check_links import faults

MODULES = ("sphinx", "myst_parser", "furo", "breathe", "numpy")
MISSING = [name for name in MODULES if importlib.util.find_spec(name) is None]
MISSING += [] if shutil.which("doxygen") else ["doxygen"]


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.site = pathlib.Path(cls.folder.name) / "site"
        cls.before = set(ROOT.rglob("docs/**/*"))
        done = subprocess.run([ROOT / "tools" / "site.sh", cls.site], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True)
        if done.returncode != 0:
            raise AssertionError(done.stdout)

    def ids(self, page):
        return set(re.findall(r'\bid="([^"]+)"', (self.site / "docs" / "reference" / page).read_text()))

    def test_no_link_is_broken(self):
        found, count = faults(self.site)
        self.assertEqual(found, [])
        self.assertGreater(count, 10000)

    def test_every_page_is_there_and_the_first_one_is_the_index(self):
        for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
            self.assertTrue((self.site / path.relative_to(ROOT)).with_suffix(".html").is_file(), path)
        self.assertEqual((self.site / "index.html").read_bytes(), (self.site / "README.html").read_bytes())

    def test_pictures_are_shown(self):
        for page in ("index.html", "docs/tour.html", "docs/dev/format.html"):
            self.assertRegex((self.site / page).read_text(), r'<img [^>]*src="[^"]*_images/')

    def test_nothing_in_it_depends_on_this_machine(self):
        for path in self.site.rglob("*"):
            if path.suffix in (".html", ".js", ".css"):
                self.assertNotIn(str(ROOT), path.read_text(), path)

    def test_the_sources_are_as_they_were(self):
        self.assertEqual(set(ROOT.rglob("docs/**/*")), self.before)

    def test_everything_of_the_c_library_is_in_its_reference(self):
        text = "".join((ROOT / "include/tagrid" / name).read_text() for name in ("tagrid.h", "tagrid_blocks.h"))
        names = set(re.findall(r"\b(tagrid_\w+)\(", "".join(re.findall(r"^TAGRID_API [^;]*;", text, re.M))))
        names |= set(re.findall(r"^\} (tagrid_\w+);", text, re.M)) | set(re.findall(r"^  (TAGRID_\w+) =", text, re.M))
        names = {name for name in names if not name.endswith("_init_sized")}
        self.assertGreater(len(names), 80)
        page = (self.site / "docs/reference/c.html").read_text()
        self.assertEqual({name for name in names if f".{name}" not in page}, set())

    def test_everything_public_of_the_python_package_is_in_its_reference(self):
        shown = self.ids("python.html")
        text = (ROOT / "python/tagrid/__init__.py").read_text()
        names = set(re.findall(r'"(\w+)"', re.search(r"__all__ = \[(.*?)\]", text, re.S)[1]))
        self.assertEqual({f"tagrid.{name}" for name in names} - shown, set())
        for module in ("_volume", "_reading"):
            source = (ROOT / f"python/tagrid/{module}.py").read_text()
            of_class = source.partition("\nclass Volume")[2].partition("\nclass ")[0]
            members = re.findall(r"^    def ([a-z]\w*)\(", of_class, re.M)
            self.assertEqual({f"tagrid.Volume.{name}" for name in members} - shown, set())

    def test_everything_of_the_javascript_package_is_in_its_reference(self):
        page = (self.site / "docs/reference/javascript.html").read_text()
        declarations = (ROOT / "web/decoder/src/index.d.ts").read_text()
        names = re.findall(r"^export (?:interface|class|function|type|const) (\w+)", declarations, re.M)
        self.assertGreater(len(names), 10)
        self.assertEqual([name for name in names if name not in page], [])

    def test_code_in_guides_leads_to_the_references(self):
        for guide, reference in (("library", "reference/c.html#"), ("python", "reference/python.html#tagrid.")):
            self.assertIn(reference, (self.site / "docs" / guide).with_suffix(".html").read_text())


if __name__ == "__main__":
    if MISSING:
        print(f"skipped: there is no {', '.join(MISSING)} for /usr/bin/python3 (tools/install_packages.sh site)")
    else:
        os.environ.setdefault("PYTHONDONTWRITEBYTECODE", "1")
        unittest.main()
