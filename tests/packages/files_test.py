"""Files for packages and desktops say what they must: versions, dependencies, and what a .tag file is.

    files_test.py PROGRAM
"""

import ast
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.path.abspath(sys.argv.pop(1))
PACKAGING = ROOT / "packaging"
CMAKE = (ROOT / "CMakeLists.txt").read_text()
VERSION = (re.search(r"^project\(tagrid VERSION (\S+)", CMAKE, re.MULTILINE)[1] +
           re.search(r"^set\(TAGRID_VERSION \$\{PROJECT_VERSION\}(\S*)\)", CMAKE, re.MULTILINE)[1])
MAGIC = b"\x89TAG\r\n\x1a\n"

# What conda-forge, Spack and vcpkg call the libraries of docs/dev/design.md.
NAMES = {"libtbb-dev": ("tbb-devel", "tbb", "tbb"), "libzstd-dev": ("zstd",) * 3, "libxxhash-dev": ("xxhash",) * 3,
         "libisal-dev": ("isa-l", "isa-l", "isal"), "libcurl4-openssl-dev": ("libcurl", "curl", "curl"), "libsqlite3-dev": ("libsqlite", "sqlite", "sqlite3"),
         "libsodium-dev": ("libsodium",) * 3,
         "libhwy-dev": ("libhwy", "highway", "highway"), "libcli11-dev": ("cli11",) * 3, "libfmt-dev": ("fmt",) * 3,
         "nlohmann-json3-dev": ("nlohmann_json", "nlohmann-json", "nlohmann-json"),
         "zlib1g-dev": ("zlib", "zlib-api", "zlib"),
         "libbz2-dev": ("bzip2",) * 3, "libpng-dev": ("libpng",) * 3, "libtiff-dev": ("libtiff", "libtiff", "tiff"),
         "libseccomp-dev": ("libseccomp", "libseccomp", None), "libpugixml-dev": ("pugixml",) * 3,
         "libdcmtk-dev": ("dcmtk",) * 3, "libopenjp2-7-dev": ("openjpeg",) * 3, "libjxl-dev": ("libjxl",) * 3, "libgsf-1-dev": ("libgsf", None, None), "libglib2.0-dev": ("glib", None, None), "libhdf5-dev": ("hdf5",) * 3,
         "libblosc-dev": ("blosc", "c-blosc", "blosc"), "libopenvdb-dev": ("openvdb",) * 3,
         "libimath-dev": ("imath",) * 3, "libboost-dev": ("libboost-headers", "boost", "boost-any"),
         "pkgconf": ("pkg-config", "pkgconfig", None)}
# Compilers and what builds: the compilers of a recipe have names of their own.
TOOLS = {"g++", "cmake", "ninja-build"}


def yaml(test):
    try:
        import yaml as parser
    except ImportError:
        test.skipTest("there is no python3-yaml on this machine")
    return parser


def said(*command, **options):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, **options).stdout


class Recipes(unittest.TestCase):
    def needed(self):
        """Debian's packages that tools/install_packages.sh builds with."""
        text = (ROOT / "tools/install_packages.sh").read_text()
        return set(re.search(r"^build=\(([^)]*)\)", text, re.MULTILINE)[1].split()) - TOOLS

    def conda(self):
        text = (PACKAGING / "conda/recipe/meta.yaml").read_text()
        self.assertIn(f'{{% set version = "{VERSION.replace("-rc.", "rc")}" %}}', text)
        # What Jinja does, as far as this recipe needs it.
        text = re.sub(r"\{%.*?%\}", "", text)
        text = re.sub(r"\{\{\W*(\w+)(?:\('(\w+)'\))?\W*\}\}", r"\1\2", text)
        requirements = yaml(self).safe_load(text)["requirements"]
        return {line.split()[0] for line in requirements["build"] + requirements["host"]}

    def spack(self):
        calls = [node for node in ast.walk(ast.parse((PACKAGING / "spack/package.py").read_text()))
                 if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "depends_on"]
        return {re.match(r"[\w-]+", call.args[0].value)[0] for call in calls}

    def vcpkg(self):
        port = json.loads((PACKAGING / "vcpkg/vcpkg.json").read_text())
        self.assertEqual(port["version-semver"], VERSION)
        return {each if isinstance(each, str) else each["name"] for each in port["dependencies"]}

    def test_recipes_build_with_every_library(self):
        self.assertEqual(set(NAMES), self.needed(), "the names of a library in recipes are missing here")
        for index, found in enumerate((self.vcpkg, self.spack, self.conda)[::-1]):
            self.assertEqual({names[index] for names in NAMES.values()} - {None} - found(), set(), found.__name__)

    def test_options_that_recipes_set_exist(self):
        options = set(re.findall(r"(?:option|set)\((TAGRID_\w+)|find_program\((TAGRID_\w+)",
                                 (ROOT / "CMakeLists.txt").read_text() + (ROOT / "python/CMakeLists.txt").read_text()))
        options = {name for pair in options for name in pair}
        for file in ("conda/recipe/build.sh", "spack/package.py", "vcpkg/portfile.cmake"):
            for name in re.findall(r"TAGRID_\w+", (PACKAGING / file).read_text()):
                self.assertIn(name, options, file)

    def test_containers_use_files_that_exist(self):
        for file in ("Dockerfile", "tagrid.def"):
            for script in re.findall(r"tools/\w+\.sh", (PACKAGING / "container" / file).read_text()):
                self.assertTrue(os.access(ROOT / script, os.X_OK), f"{file}: {script}")

    def test_workflows_run_what_a_change_must_pass(self):
        runs = {}
        for file in (ROOT / ".github/workflows").glob("*.yml"):
            flow = yaml(self).safe_load(file.read_text())
            # YAML 1.1 reads the key `on` as true.
            self.assertTrue({"name", True, "jobs"} <= set(flow), file)
            steps = [step for job in flow["jobs"].values() for step in job["steps"]]
            self.assertTrue(all(("run" in step) != ("uses" in step) for step in steps), file)
            runs[file.stem] = [step["run"] for step in steps if "run" in step]
            for script in re.findall(r"tools/\w+\.sh|\.ci/run", "\n".join(runs[file.stem])):
                self.assertTrue(os.access(ROOT / script, os.X_OK), script)
        self.assertIn(".ci/run", runs["ci"])

    def test_the_long_workflow_runs_every_fuzzer(self):
        flow = yaml(self).safe_load((ROOT / ".github/workflows/long.yml").read_text())
        of_script = re.search(r"\|\| targets=\((.*)\)", (ROOT / "tools/fuzz.sh").read_text())[1].split()
        of_header = re.findall(r"void (\w+)\(Bytes bytes\);", (ROOT / "tests/fuzz/targets.h").read_text())
        self.assertEqual(flow["jobs"]["fuzz"]["strategy"]["matrix"]["target"], of_script)
        self.assertEqual(sorted(of_script), sorted(of_header))

    def test_the_citation_has_the_fields_of_its_schema(self):
        citation = yaml(self).safe_load((ROOT / "CITATION.cff").read_text())
        self.assertLessEqual({"cff-version", "message", "title", "authors"}, set(citation))
        # Those of the schema 1.2.0 that software has.
        self.assertLessEqual(set(citation), {"cff-version", "message", "title", "authors", "type", "version",
                                             "abstract", "license", "keywords", "date-released", "repository-code",
                                             "url", "doi", "references"})
        self.assertEqual([citation[key] for key in ("cff-version", "type", "version", "license")],
                         ["1.2.0", "software", VERSION, "Apache-2.0"])
        self.assertTrue(all("name" in author or "family-names" in author for author in citation["authors"]))


class Types(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def encode(self, name, type="int16", *options):
        volume = self.folder / "volume.nhdr"
        said(PROGRAM, "phantom", "--dims", "40,30,20", "--type", type, "-o", volume, "-f")
        said(PROGRAM, "encode", volume, "-o", self.folder / name, "-f", *options)
        return self.folder / name

    @unittest.skipUnless(shutil.which("file"), "there is no file(1) on this machine")
    def test_file_says_what_a_tag_file_is(self):
        # In the folder where the compiled database goes.
        compiled = said("file", "-C", "-m", PACKAGING / "mime/magic", cwd=self.folder)
        self.assertNotIn("Warning", compiled)
        database = self.folder / "magic.mgc"

        def file(path, *options):
            return said("file", "-b", "-m", database, *options, path).strip()

        what = "tagrid CT volume, format 5, 40 x 30 x 20"
        for type in ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"):
            self.assertEqual(file(self.encode("a.tag", type)), f"{what} {type}, lossless")
        self.assertEqual(file(self.encode("a", "float32", "--max-error", "2.5")), f"{what} float32, max error 2.5")
        self.assertEqual(file(self.encode("a", "int16", "--grid-only")), f"{what} int16, grid only")
        self.assertEqual(file(self.folder / "a", "--mime-type"), "application/vnd.tagrid")
        self.assertEqual(file(self.folder / "a", "--extension"), "tag")
        said(PROGRAM, "protect", self.encode("a.tag"), "--parity", "5%", "--beside")
        self.assertEqual(file(self.folder / "a.tag.parity"), "tagrid parity")
        newer = bytearray((self.folder / "a.tag").read_bytes())
        newer[8] = 6
        (self.folder / "newer").write_bytes(newer)
        self.assertEqual(file(self.folder / "newer"), "tagrid CT volume, format 6")
        (self.folder / "text").write_bytes(b"\x89TAG\n\x1a\n")
        self.assertNotIn("tagrid", file(self.folder / "text"))

    @unittest.skipUnless(shutil.which("update-mime-database"), "there is no shared-mime-info on this machine")
    def test_desktops_know_tag_files(self):
        (self.folder / "mime/packages").mkdir(parents=True)
        shutil.copy(PACKAGING / "mime/tagrid.xml", self.folder / "mime/packages")
        self.assertNotIn("rror", said("update-mime-database", self.folder / "mime"))
        self.assertIn("50:application/vnd.tagrid:*.tag\n", (self.folder / "mime/globs2").read_text())
        self.assertIn(b"[60:application/vnd.tagrid]\n>0=\x00\x08" + MAGIC, (self.folder / "mime/magic").read_bytes())
        if shutil.which("gio"):
            self.encode("named.tag")
            shutil.copy(self.folder / "named.tag", self.folder / "without")
            for name in ("named.tag", "without"):
                answer = said("gio", "info", "-a", "standard::content-type", self.folder / name,
                              env=os.environ | {"XDG_DATA_HOME": str(self.folder), "HOME": str(self.folder)})
                self.assertIn("standard::content-type: application/vnd.tagrid\n", answer, name)

    def test_the_types_agree_with_the_format(self):
        tree = ElementTree.parse(PACKAGING / "mime/tagrid.xml")
        name = "{http://www.freedesktop.org/standards/shared-mime-info}"
        value = tree.find(f"{name}mime-type/{name}magic/{name}match").get("value")
        self.assertEqual(ast.literal_eval(f'b"{value}"'), MAGIC)
        self.assertIn(r"`\x89TAG\r\n\x1A\n`", (ROOT / "docs/dev/format.md").read_text())


if __name__ == "__main__":
    unittest.main()
