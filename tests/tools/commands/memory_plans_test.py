"""What a plan says of memory is an upper bound, and not far above what runs of noise take.

Prints a table of plans and peaks. With TAGRID_LONG, that of every mode and type."""

import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time
import unittest

TAGRID = pathlib.Path(sys.argv.pop(1)).resolve()
LONG = "TAGRID_LONG" in os.environ
MIB = 1 << 20
# Plans have 12 MiB for the program, of which it takes 7. Large volumes do not show this.
OF_PROGRAM = 5
# The most that a plan may be, as a multiple of the peak.
MOST = 1.25

# Bounds that change little.
BOUNDS = {"uint8": "1", "uint16": "1", "uint32": "1", "float32": "1e-6", "float64": "1e-15"}
# For the lower limit of peaks, one layer of 64 slices has more bricks than the 32 that two threads have in flight: so
# all of them wait while the slices of a layer, and those read ahead, are in memory.
DIMS = (520, 520, 200) if LONG else (330, 270, 140)
# The default scale of a type that has one; otherwise noise takes warnings.
SCALES = {"uint16": "0.001953125", "uint32": "1e-8", "float32": "4", "float64": "4"}
SIZES = {"uint8": 1, "uint16": 2, "uint32": 4, "float32": 4, "float64": 8}

MODES = {"lossless": [], "stored": ["--max-error", "BOUND", "--grid", "stored"],
         "derived": ["--max-error", "BOUND", "--grid", "derived"], "grid only": ["--grid-only"],
         "mesh": ["--max-error", "BOUND", "--mesh-error", "BOUND"], "psnr": ["--psnr", "20", "--brick", "2"],
         "overviews": ["--max-error", "BOUND", "--overviews", "auto"]}
QUICK = (("uint8", "stored"), ("uint16", "derived"))

# Where plans are larger, and why.
LARGER = {
    # The coder of wide types may take up to 17 events for a sample, and takes about half as many for noise.
    ("encode", "uint32"): 2, ("encode", "float32"): 2, ("encode", "float64"): 2,
    # Points may have up to 33 events each.
    ("encode", "grid only"): 2,
    # All that a brick can take is planned for the transform and for the lossless code that replaces it.
    ("encode", "psnr"): 2.5,
    # Bricks of wide types may be transformed, which takes memory; those of noise are not.
    ("decode", "psnr"): 1.45, ("verify", "psnr"): 1.45,
    # At the smallest limits, one encoded brick is most of the plan: as read, as parsed, and twice more for what the heap
    # may hold of it, which it does not always.
    ("decode", "overviews"): 1.3, ("decode", "float64"): 1.35, ("verify", "float64"): 1.35,
    # Bricks with a bound of the mesh wait with their original; without an original, there is none.
    ("verify", "mesh"): 3}


def noise(path, sample_type, count):
    """Any integers; any mantissas of floats from 1 to 2, with either sign."""
    size, generator = SIZES[sample_type], random.Random(1)
    # Python draws less than 2^31 bits at once.
    samples = bytearray(b"".join(generator.randbytes(count) for _ in range(size)))
    if sample_type.startswith("float"):
        signs, ones = bytes(0x3F | i & 0x80 for i in range(256)), 0x80 if size == 4 else 0xF0
        samples[size - 1::size] = samples[size - 1::size].translate(signs)
        samples[size - 2::size] = samples[size - 2::size].translate(bytes(i | ones for i in range(256)))
    path.write_bytes(samples)


def is_idle(process):
    """True if all threads of a process wait."""
    try:
        states = [(task / "stat").read_text().rpartition(") ")[2][0]
                  for task in pathlib.Path(f"/proc/{process}/task").iterdir()]
    except OSError:
        return True
    return all(state != "R" and state != "D" for state in states)


class MemoryPlans(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.report = self.folder / "report.json"

    def run_late(self, arguments):
        """Runs with a reader of the output that begins when nothing more happens without it."""
        with subprocess.Popen([TAGRID, *arguments], cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE) as process:
            idle = 0
            while idle < 5:
                time.sleep(0.05)
                idle = idle + 1 if is_idle(process.pid) else 0
            _, errors = process.communicate()
        return process.returncode, errors.decode()

    def peak(self, arguments, late=False):
        """The peak and, with -v, the plan, in MiB."""
        self.report.unlink(missing_ok=True)
        arguments = [*arguments, "--json", self.report]
        if late:
            code, errors = self.run_late(arguments)
        else:
            done = subprocess.run([TAGRID, *arguments], cwd=self.folder, capture_output=True, check=False)
            code, errors = done.returncode, done.stderr.decode()
        self.assertEqual(code, 0, (arguments, errors))
        planned = re.search(r"([\d.]+) MiB planned", errors)
        return json.loads(self.report.read_text())["peak_memory"] / MIB, planned and float(planned[1])

    def smallest(self, arguments):
        """The smallest limit, in MiB."""
        refused = subprocess.run([TAGRID, *arguments, "-M", "1"], cwd=self.folder, capture_output=True, text=True,
                                 check=False)
        return int(re.search(r"give -M (\d+)", refused.stderr)[1])

    def check(self, what, case, plan, peak):
        most = max(LARGER.get((what, key), MOST) for key in case)
        print(f"{what:8}{case[0]:9}{case[1]:11}{case[2]:22}{plan:8.1f}{peak:8.1f}{(plan - OF_PROGRAM) / peak:7.2f}{most:7.2f}",
              flush=True)
        with self.subTest((what, *case)):
            self.assertLessEqual(peak, plan)
            # On a busy machine, a late reader may come too early for the peak.
            if LONG or "smallest" in case[2]:
                self.assertLessEqual(plan - OF_PROGRAM, most * peak)

    def check_mode(self, sample_type, mode):
        raw = ["--dims", ",".join(map(str, DIMS)), "--type", sample_type]
        volume, tag = self.folder / f"{sample_type}.raw", "a.tag"
        if not volume.exists():
            noise(volume, sample_type, math.prod(DIMS))
        options = [BOUNDS[sample_type] if option == "BOUND" else option for option in MODES[mode]]
        if sample_type in SCALES:
            options += ["--field-scale", SCALES[sample_type]]
        encode = ["encode", volume.name, *raw, *options, "-v", "-f"]
        verify = ["verify", tag, "-v"]
        self.check_late("encode", (sample_type, mode), [*encode, "-o", "-"])
        self.check_smallest("encode", (sample_type, mode), [*encode, "-o", tag])
        self.check_late("decode", (sample_type, mode), ["decode", tag, "-v", "-o", "-"])
        self.check_smallest("decode", (sample_type, mode), ["decode", tag, "-v", "-f", "-o", "b.raw"])
        self.check_smallest("verify", (sample_type, mode), verify)
        self.check_smallest("verify", (sample_type, mode), [*verify, "--against", volume.name, *raw])

    def check_late(self, what, case, arguments):
        """With its own plan as limit, in whole MiB: without one, a run keeps memory that it has freed."""
        for threads in ("1", "2"):
            with_threads = [*arguments, "-T", threads]
            _, plan = self.peak(with_threads)
            peak, plan = self.peak([*with_threads, "-M", f"{math.ceil(plan) + 1}M"], late=True)
            self.check(what, (*case, f"-T {threads}, a late reader"), plan, peak)

    def check_smallest(self, what, case, arguments):
        limit = self.smallest(arguments)
        peak, _ = self.peak([*arguments, "-T", "2", "-M", f"{limit}M"])
        self.check(what, (*case, "the smallest limit"), limit, peak)

    def test_plans_are_upper_bounds_that_noise_nearly_takes(self):
        cases = [(sample_type, mode) for sample_type in BOUNDS for mode in MODES] if LONG else QUICK
        print(f"\n{'':50}{'plan':>8}{'peak':>8}{'ratio':>7}{'most':>7}")
        for case in cases:
            self.check_mode(*case)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
