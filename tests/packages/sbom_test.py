"""tagrid.spdx.json is a document of SPDX 2.3, and lists what docs/dev/design.md and the built programs depend on.

    sbom_test.py BUILD
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv.pop(1))
CACHE = (BUILD / "CMakeCache.txt").read_text()
# Packages of the table for other purposes than programs and libraries that are installed from this build.
OTHERWISE = re.compile(r"tests|wheels|benchmark|pictures|fuzzing|report of the paper|the site|web/|static program|Windows")
OPTIONS = {"tagrid-mpi": "TAGRID_MPI", "python3-tagrid": "TAGRID_PYTHON"}
# Of the compiler and the C library.
SYSTEM = r"glibc$|gcc-\d+$"


def table():
    """Debian's packages that the product depends on, of the table in docs/dev/design.md."""
    text = (ROOT / "docs/dev/design.md").read_text().partition("\n## Dependencies\n")[2].partition("\n## ")[0]
    found = set()
    for cell in re.findall(r"^\| ([^|]+) \|", text, re.MULTILINE)[1:]:
        names, _, purpose = cell.partition(" (")
        # Alternatives are in brackets: libcurl4-openssl-dev (or libcurl4-gnutls-dev).
        if not cell.startswith("--") and not OTHERWISE.search(purpose):
            for_option = [option for program, option in OPTIONS.items() if program in purpose]
            if all(f"{option}:BOOL=ON" in CACHE for option in for_option):
                found |= set(names.split(", "))
    return found


def said(*command):
    return subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          text=True).stdout


def sources(packages):
    """The source packages of Debian's packages."""
    return set(said("dpkg-query", "-W", "-f", "${source:Package}\\n", *packages).split())


def linked_by(file):
    """The libraries that `file` itself names, without those of this build."""
    wanted = re.findall(r"\(NEEDED\).*\[(.*)\]", said("readelf", "-d", file))
    where = dict(re.findall(r"^\s*(\S+) => (/\S+) \(", said("ldd", file), re.MULTILINE))
    return {os.path.realpath(where[name]) for name in wanted if not where.get(name, str(BUILD)).startswith(str(BUILD))}


class Sbom(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.document = json.loads((BUILD / "tagrid.spdx.json").read_text())
        cls.packages = cls.document["packages"]

    def test_it_has_the_fields_that_spdx_requires(self):
        document = self.document
        self.assertEqual((document["spdxVersion"], document["dataLicense"], document["SPDXID"]),
                         ("SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT"))
        self.assertRegex(document["documentNamespace"], r"^https://[^#\s]+$")
        self.assertRegex(document["creationInfo"]["created"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        for who in document["creationInfo"]["creators"]:
            self.assertRegex(who, r"^(Tool|Person|Organization): .")
        self.assertTrue(document["name"])
        ids = [package["SPDXID"] for package in self.packages]
        self.assertEqual(len(set(ids)), len(ids))
        for package in self.packages:
            self.assertRegex(package["SPDXID"], r"^SPDXRef-[A-Za-z0-9.-]+$")
            self.assertTrue(package["name"])
            self.assertEqual(package["downloadLocation"], "NOASSERTION")
            # No list of files, so no sum of them is required.
            self.assertIs(package["filesAnalyzed"], False)
            self.assertRegex(package["licenseDeclared"], r"^[A-Za-z0-9.-]+( (OR|AND|WITH) [A-Za-z0-9.-]+)*$")
        for relation in self.document["relationships"]:
            for end in ("spdxElementId", "relatedSpdxElement"):
                self.assertIn(relation[end], ids + ["SPDXRef-DOCUMENT"])
        related = {relation[end] for relation in document["relationships"]
                   for end in ("spdxElementId", "relatedSpdxElement")}
        self.assertIn({"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                       "relatedSpdxElement": "SPDXRef-tagrid"}, document["relationships"])
        self.assertEqual(set(ids) - related, set())

    def test_it_lists_the_dependencies_of_the_design(self):
        comments = [package["comment"].removeprefix("Debian: ") for package in self.packages[1:]]
        listed = {name for comment in comments for name in comment.split(", ")}
        self.assertGreater(len(table()), 20)
        self.assertEqual(table() - listed, set())
        self.assertEqual(listed - table(), {"libcurl4-gnutls-dev"})

    @unittest.skipUnless(shutil.which("dpkg-query"), "there is no dpkg on this machine")
    def test_versions_are_those_of_the_packages(self):
        for package in self.packages[1:]:
            with self.subTest(package["name"]):
                purl = package["externalRefs"][0]["referenceLocator"]
                name = re.fullmatch(r"pkg:deb/debian/([^@]+)@[\w.%~-]+", purl)[1]
                versions = said("dpkg-query", "-W", "-f", "${Version}\\n", name).splitlines()
                self.assertEqual(package["versionInfo"], versions[0])

    @unittest.skipUnless(shutil.which("dpkg-query") and shutil.which("ldd"), "there is no dpkg or ldd on this machine")
    def test_what_programs_link_is_listed(self):
        names = [package["externalRefs"][0]["referenceLocator"] for package in self.packages[1:]]
        listed = sources(re.match(r"pkg:deb/debian/([^@]+)@", name)[1] for name in names)
        built = [file for file in BUILD.iterdir()
                 if file.is_file() and os.access(file, os.X_OK) and re.match(r"(lib)?tagrid", file.name)]
        self.assertGreater(len(built), 1)
        libraries = set().union(*map(linked_by, built))
        self.assertGreater(len(libraries), 5)
        owners = {line.split(":")[0] for line in said("dpkg-query", "-S", *sorted(libraries)).splitlines()}
        missing = {name for name in sources(owners) - listed if not re.match(SYSTEM, name)}
        self.assertEqual(missing, set())


if __name__ == "__main__":
    unittest.main()
