"""docs/solvers.md works as it is shown: its commands and its Python run in their order, and print what the page says.

    solvers_test.py PROGRAM
"""

import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from documents import sessions

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
PAGE = (ROOT / "docs/solvers.md").read_text()


class Solvers(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "tagrid").symlink_to(PROGRAM)
        self.environment = os.environ | {"PATH": f"{self.folder / 'bin'}:{os.environ['PATH']}", "OMP_NUM_THREADS": "1"}

    def run_line(self, *command):
        done = subprocess.run(command, cwd=self.folder, env=self.environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}")
        return done.stdout

    def check_python(self, code):
        """Lines print(...)  # TEXT print the text."""
        (self.folder / "page.py").write_text(code)
        stated = re.findall(r"^print\(.*\) +# (.*)$", code, re.MULTILINE)
        self.assertEqual(self.run_line(sys.executable, "-B", "page.py").splitlines(), stated)
        self.assertTrue(stated)

    def test_the_page_works_from_its_top_to_its_end(self):
        missing = [name for name in ("numpy", "vtk") if importlib.util.find_spec(name) is None]
        missing += [] if shutil.which("ccx") else ["ccx"]
        if missing:
            self.skipTest(f"there is no {', '.join(missing)} on this machine")
        kinds = []
        for block in re.finditer(r"^```(\w*)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL):
            with self.subTest(line=PAGE[:block.start()].count("\n") + 2):
                kinds.append(block[1] or "session")
                if block[1] == "python":
                    self.check_python(block[2])
                    continue
                self.assertTrue(block[2].startswith("$ "))
                for command, printed in next(sessions(block[0])):
                    self.assertEqual(self.run_line("bash", "-o", "pipefail", "-c", command), printed, command)
        self.assertEqual(kinds.count("python"), 2)
        self.assertGreaterEqual(kinds.count("session"), 8)


if __name__ == "__main__":
    unittest.main()
