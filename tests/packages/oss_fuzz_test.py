"""The fuzzers that packaging/oss-fuzz builds run without the libraries of the system, and begin with their seeds.

    oss_fuzz_test.py    with TAGRID_LONG=1, as building takes minutes; needs clang and its sanitizers
"""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
TARGETS = re.findall(r"^void (\w+)\(Bytes bytes\);", (ROOT / "tests/fuzz/targets.h").read_text(), re.M)
# What the image sets for its AddressSanitizer; its C++ library is another.
FLAGS = "-O1 -fno-omit-frame-pointer -gline-tables-only -fsanitize=address -fsanitize=fuzzer-no-link"


@unittest.skipUnless(os.environ.get("TAGRID_LONG"), "builds for minutes; set TAGRID_LONG=1")
@unittest.skipUnless(shutil.which("clang++") and shutil.which("zip"), "needs clang++ and zip")
class OssFuzz(unittest.TestCase):
    def test_builds_and_runs_every_fuzzer(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            out = folder / "out"
            out.mkdir()
            environment = {**os.environ, "CC": "clang", "CXX": "clang++", "CFLAGS": FLAGS,
                           "CXXFLAGS": FLAGS + " -stdlib=libc++", "LIB_FUZZING_ENGINE": "-fsanitize=fuzzer",
                           "WORK": str(folder / "work"), "OUT": str(out)}
            build = subprocess.run([ROOT / "packaging/oss-fuzz/build.sh"], cwd=ROOT, env=environment,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual(build.returncode, 0, build.stdout[-4000:])
            self.assertEqual({file.name for file in out.glob("fuzz_*") if file.suffix != ".zip"},
                             {f"fuzz_{target}" for target in TARGETS})
            for target in TARGETS:
                with self.subTest(target):
                    self.run_from_seeds(out, target, folder / target)

    def run_from_seeds(self, out, target, seeds):
        with zipfile.ZipFile(out / f"fuzz_{target}_seed_corpus.zip") as archive:
            self.assertTrue(archive.namelist())
            archive.extractall(seeds)
        libraries = subprocess.run(["ldd", out / f"fuzz_{target}"], capture_output=True, text=True).stdout
        elsewhere = [line for line in libraries.splitlines() if "=>" in line and str(out) not in line
                     and not re.search(r"\b(libc|libm|libdl|libpthread|librt|libresolv)\.so", line)]
        self.assertEqual(elsewhere, [])
        run = subprocess.run([out / f"fuzz_{target}", "-runs=200", "-seed=1", seeds], env={}, cwd=seeds,
                             capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr[-4000:])


unittest.main()
