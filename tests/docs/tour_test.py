"""docs/tour.md works as it is shown: its commands run in their order, print what the page says, and so does its Python.

    tour_test.py BUILD UNPACKED
        BUILD: the build folder; what is installed from it is used. UNPACKED: where ParaView is unpacked if it is not installed

That the first two commands make packages that can be installed is proved by tests/library/installed_prefix_test.py.
"""

import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
import urllib.parse
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD, UNPACKED = (os.path.abspath(argument) for argument in sys.argv[1:3])
sys.path.append(str(ROOT / "tests/plugins"))

import paraview_program
from documents import sessions, without_memory

PAGE = (ROOT / "docs/tour.md").read_text()
DICOM = """
import pathlib, sys
sys.path.insert(0, sys.argv[1])
import scans
scans.write_series(pathlib.Path("series/ct"), scans.volume(shape=(9, 40, 50)), step=1.5)
"""


class Tour(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.home = pathlib.Path(folder.name)
        prefix = cls.home / "usr"
        for component in ("tagrid", "tagrid-readers", "libtagrid", "python3-tagrid"):
            subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix, "--component", component], check=True, capture_output=True)
        package = next(prefix.rglob("tagrid/__init__.py")).parents[1]
        cls.environment = os.environ | {"HOME": str(cls.home), "PATH": f"{prefix / 'bin'}:{os.environ['PATH']}",
                                        "PYTHONPATH": str(package)}

    def setUp(self):
        type(self).place = self.home

    def run_line(self, command):
        """Runs a command where the one before it has ended."""
        done = subprocess.run(["bash", "-o", "pipefail", "-c", f'{command}\ncode=$?\npwd > "$HOME/place"\nexit $code'], cwd=self.place,
                              env=self.environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        type(self).place = (self.home / "place").read_text().strip()
        return done

    def has_what_it_needs(self, command):
        if command.startswith("jq") and not shutil.which("jq"):
            print(f"not run, as there is no jq on this machine: {command}", file=sys.stderr)
            return False
        if "series/ct" in command and not (pathlib.Path(self.place) / "series/ct").exists():
            done = subprocess.run([sys.executable, "-B", "-c", DICOM, ROOT / "tests/support"], cwd=self.place, capture_output=True, text=True)
            if done.returncode != 0:
                print(f"not run, as pydicom cannot make a series: {command}\n{done.stderr}", file=sys.stderr)
                shutil.rmtree(pathlib.Path(self.place) / "series", ignore_errors=True)
                return False
        return True

    def check_session(self, session):
        for command, printed in session:
            if command.startswith("paraview "):
                self.check_paraview(command.split()[1])
            elif command.startswith("tagrid view "):
                self.check_view(command.split()[2])
            elif self.has_what_it_needs(command):
                done = self.run_line(command)
                self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}")
                # What an estimate measures is different each time.
                if not command.startswith("tagrid estimate"):
                    self.assertEqual(without_memory(done.stdout), without_memory(printed), command)

    def check_python(self, code):
        """Lines print(...)  # TEXT print the text."""
        (pathlib.Path(self.place) / "page.py").write_text(code)
        done = self.run_line(f"{sys.executable} -B page.py")
        self.assertEqual(done.returncode, 0, done.stdout)
        stated = re.findall(r"^print\(.*\)  +# (.*)$", code, re.MULTILINE)
        self.assertGreater(len(stated), 2)
        self.assertEqual(done.stdout.splitlines(), stated)

    def check_view(self, name):
        """The address that the program prints has the page and the file."""
        program = self.home / "usr/bin/tagrid"
        if not (self.home / "usr/share/tagrid/viewer/index.html").exists():
            print(f"not run, as the page of the viewer is not built: tagrid view {name}", file=sys.stderr)
            return
        with subprocess.Popen([program, "view", name, "--no-browser", "-q"], cwd=self.place, text=True, stdout=subprocess.PIPE) as view:
            try:
                address = view.stdout.readline().strip()
                source = urllib.parse.parse_qs(urllib.parse.urlsplit(address).query)["src"][0]
                page, file = (urllib.request.urlopen(urllib.parse.urljoin(address, path), timeout=20).read() for path in ("", source))
                self.assertIn(b"viewer.js", page)
                self.assertEqual(file, (pathlib.Path(self.place) / name).read_bytes())
            finally:
                view.send_signal(signal.SIGINT)
        self.assertEqual(view.returncode, 0)

    def check_paraview(self, name):
        program, why_not = paraview_program.pvpython(UNPACKED)
        if program is None or not shutil.which("xvfb-run"):
            print(f"not run: paraview {name}: {why_not or 'there is no xvfb-run'}", file=sys.stderr)
            return
        done = subprocess.run(["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset", program,
                               ROOT / "tools/research/pictures/tour_mesh.py", name,
                               "tour_mesh.png"], cwd=self.place, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn(f"{re.search(r'points, ([0-9]+) tetrahedra', PAGE)[1]} tetrahedra", done.stdout)
        drawn, shown = ((folder / "tour_mesh.png").read_bytes() for folder in (pathlib.Path(self.place), ROOT / "docs/images"))
        self.assertEqual(size_of(drawn), size_of(shown))

    def test_the_page_works_from_its_top_to_its_end(self):
        found = list(re.finditer(r"^```(\w*)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
        kinds = []
        for block in found:
            with self.subTest(line=PAGE[:block.start()].count("\n") + 2):
                if block[1] == "python":
                    self.check_python(block[2])
                    kinds.append("python")
                elif block[2].startswith("$ "):
                    self.check_session(next(sessions(block[0])))
                    kinds.append("session")
                else:
                    # Building and installing: see above.
                    commands = [line.split("  ")[0] for line in block[2].splitlines()]
                    self.assertEqual(commands, ["tools/packages.sh", "sudo apt-get install -y ./build/packages/*.deb"])
                    kinds.append("install")
        self.assertEqual((kinds[0], kinds.count("install"), kinds.count("python")), ("install", 1, 1))
        self.assertGreaterEqual(kinds.count("session"), 8)


def size_of(png):
    return struct.unpack(">2I", png[16:24])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
