"""Claims about tools/research/bench, on two small phantoms and with the codecs that this machine has.

    bench_test.py TAGRID
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
SOURCES = Path(__file__).resolve().parents[3]
BENCH = SOURCES / "tools/research/bench"
sys.path[:0] = [str(BENCH), str(BENCH.parent)]

try:
    import numpy  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing} (python3-numpy)")
    sys.exit(0)

import rates  # noqa: E402

TAGRID = None
VOXELS = 40 * 30 * 20
BOUNDS = {0, 3, 9}
# Codecs that Debian has, and the files that show that they are installed.
PROGRAMS = {"zfp": ["zfp"], "zstd -1": ["zstd"], "JPEG XL": ["cjxl", "djxl"], "copy": ["cp"], "SZ3": ["sz3"],
            "SPERR": ["sperr3d"], "SPERR --psnr": ["sperr3d"]}


def bench(*arguments, **options):
    command = [sys.executable, BENCH, "--tagrid", TAGRID, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, **options)


def phantom(path, kind, seed):
    command = [TAGRID, "phantom", "--dims", "40,30,20", "--type", kind, "--seed", str(seed), "-q", "-o", path]
    subprocess.run(command, check=True)


class Run(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        phantom(cls.folder / "signed.nhdr", "int16", 1)
        phantom(cls.folder / "it's small.nrrd", "uint8", 2)
        cls.inputs = {path: path.read_bytes() for path in cls.folder.iterdir()}
        cls.scratch = cls.folder / "scratch"
        cls.scratch.mkdir()
        cls.document = cls.folder / "document.md"
        cls.document.write_text("before\n<!-- begin: written by tools/research/bench -->\nold\n"
                                "<!-- end: written by tools/research/bench -->\nafter\n")
        cls.output = cls.folder / "output"
        cls.run_ = bench(cls.folder / "signed.nhdr", cls.folder / "it's small.nrrd", "--errors", "0,3,9",
                         "--repetitions", 2, "--threads", 2, "--output", cls.output, "--temporary", cls.scratch,
                         "--document", cls.document)
        if cls.run_.returncode != 0:
            raise AssertionError(cls.run_.stderr)
        cls.results = json.loads((cls.output / "results.json").read_text())

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_every_codec_takes_part_or_is_named_with_a_reason(self):
        parts = {row["codec"] for row in self.results["rows"]}
        self.assertIn("tagrid", parts)
        jpegls = (Path(TAGRID).parent / "bench/bench_jpegls").exists()
        for codec in ["JPEG-LS", *PROGRAMS]:
            here = jpegls if codec == "JPEG-LS" else all(map(shutil.which, PROGRAMS[codec]))
            with self.subTest(codec):
                self.assertEqual(here, codec in parts, self.run_.stderr)
                self.assertEqual(not here, codec in self.results["missing"])
                if not here:
                    self.assertIn(f"{codec} does not take part", self.run_.stderr)
                    self.assertIn(f"Not measured: {codec}", (self.output / "results.md").read_text())

    def test_figures_are_consistent(self):
        found = {(row["volume"], row["bound"]) for row in self.results["rows"] if row["codec"] == "tagrid"}
        self.assertEqual(found, {(volume, bound) for volume in ("signed", "it's small") for bound in BOUNDS})
        for row in self.results["rows"]:
            with self.subTest(f"{row['volume']} {row['codec']} {row['bound']}"):
                self.assertAlmostEqual(row["bits"], row["bytes"] * 8 / VOXELS)
                self.assertLessEqual(row["rmse"], row["max_error"])
                self.assertEqual(row["psnr"] is None, row["rmse"] == 0)
                if not row["codec"].endswith("--psnr"):
                    self.assertLessEqual(row["max_error"], row["bound"])
                for steps in row["runs"].values():
                    for run in steps.values():
                        self.assertGreater(run["wall"], 0)
                        self.assertGreater(run["peak_mb"], 0.5)
                self.assertEqual(set(row["runs"]["1"]), {"encode", "decode"})

    def test_the_measured_error_is_that_of_the_file(self):
        """tagrid records the error, and the benchmark measures it after decoding: both give the same figure."""
        row = rates.row_of(self.results, "signed", "tagrid", 9)
        tag = self.folder / "again.tag"
        subprocess.run([TAGRID, "encode", self.folder / "signed.nhdr", "--max-error", "9", "-q", "-o", tag], check=True)
        info = json.loads(subprocess.run([TAGRID, "info", "--json", tag], check=True, capture_output=True).stdout)
        self.assertEqual(info["bytes"]["file"], row["bytes"])
        self.assertEqual(info["achieved"]["max_error"], row["max_error"])
        self.assertAlmostEqual(info["achieved"]["rmse"], row["rmse"], places=5)
        self.assertAlmostEqual(info["achieved"]["psnr"], row["psnr"], places=3)
        tag.unlink()

    def test_the_document_gets_the_summary_and_keeps_what_is_around(self):
        text = self.document.read_text()
        self.assertTrue(text.startswith("before\n<!-- begin"))
        self.assertTrue(text.endswith("<!-- end: written by tools/research/bench -->\nafter\n"))
        self.assertNotIn("\nold\n", text)
        for link in re.findall(r"\]\(([^)]*)\)", text):
            self.assertTrue((self.folder / link).exists(), link)

    def test_volumes_are_as_they_were_and_the_temporary_folder_is_empty(self):
        for path, content in self.inputs.items():
            self.assertEqual(path.read_bytes(), content, path)
        self.assertEqual(list(self.scratch.iterdir()), [])


class Errors(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def test_a_codec_that_fails_is_named_and_the_others_go_on(self):
        phantom(self.folder / "x.nhdr", "uint8", 1)
        (self.folder / "bin").mkdir()
        zstd = self.folder / "bin/zstd"
        zstd.write_text("#!/bin/sh\necho broken >&2\nexit 3\n")
        zstd.chmod(0o755)
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        run = bench("x.nhdr", "--errors", 0, "--repetitions", 1, "--codecs", "tagrid,zstd -1,copy", cwd=self.folder,
                    env=dict(os.environ, PATH=path))
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("zstd -1 failed on x at E = 0: exit code 3", run.stderr)
        rows = json.loads((self.folder / "benchmark/results.json").read_text())["rows"]
        self.assertEqual([row["codec"] for row in rows], ["tagrid", "copy"])


class Reckoning(unittest.TestCase):
    def test_bits_at_a_psnr_are_interpolated_between_measurements_only(self):
        results = {"rows": [{"volume": "v", "codec": "c", "bound": b, "psnr": p, "bits": x}
                            for b, p, x in ((0, None, 9), (1, 60, 4), (2, 50, 1))]}
        self.assertAlmostEqual(rates.bits_at_psnr(results, "v", "c", 55), 2)
        self.assertAlmostEqual(rates.bits_at_psnr(results, "v", "c", 60), 4)
        self.assertIsNone(rates.bits_at_psnr(results, "v", "c", 61))


if __name__ == "__main__":
    TAGRID = os.path.abspath(sys.argv.pop(1))
    unittest.main(verbosity=2)
