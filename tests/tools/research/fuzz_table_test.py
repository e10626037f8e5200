"""The table of fuzzers has the sums of all recorded runs, and takes the place of the one in a page."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "tools/research/fuzz_table.py"
RUNS = """2026-01-01\taaaaaaaa\theader\t60\t1000\t70\t900\t0
2026-01-03\tbbbbbbbb\theader\t3600\t234\t75\t900\t0
2026-01-02\tbbbbbbbb\tpng\t30\t5\t10\t900\t77
"""


class FuzzTable(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_script(self, *arguments):
        return subprocess.run([sys.executable, SCRIPT, self.folder, *arguments], capture_output=True, text=True)

    def test_sums(self):
        (self.folder / "runs.tsv").write_text(RUNS)
        table = self.run_script().stdout.splitlines()
        self.assertIn("| 1,234 | 75 | 0 |", next(line for line in table if line.startswith("| header |")))
        self.assertIn("| 5 | 10 | 1 |", next(line for line in table if line.startswith("| png |")))
        self.assertIn("| none |", next(line for line in table if line.startswith("| brick |")))
        self.assertEqual(table[-1], "| **all** | 3 runs from 2026-01-01 to 2026-01-03, of 2 commits | **1,239** in 1.0 h | | |")

    def test_replaces_the_table_of_a_page(self):
        (self.folder / "runs.tsv").write_text(RUNS)
        page = self.folder / "page.md"
        page.write_text("before\n\n| target | old |\n|---|---|\n| header | 1 |\n\nafter\n\n| other |\n|---|\n")
        self.assertEqual(self.run_script(page).returncode, 0)
        self.assertEqual(page.read_text(), "before\n\n" + self.run_script().stdout + "\nafter\n\n| other |\n|---|\n")
        page.write_text("no table\n")
        self.assertIn("0 tables", self.run_script(page).stderr)
        self.assertEqual(page.read_text(), "no table\n")

    def test_an_unknown_target_ends_it(self):
        (self.folder / "runs.tsv").write_text(RUNS.replace("png", "gone"))
        self.assertIn("no target gone", self.run_script().stderr)


unittest.main()
