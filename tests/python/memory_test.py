"""A slice of a large file takes the memory of its bricks; encoding an array takes no copy of it."""

import os
import subprocess
import sys
import unittest

from volumes import temporary_folder

PROGRAM = sys.argv[1]
MB = 1_000_000

# The peak is that of a process of its own, above what it had before.
MEASURE = """
import sys
import numpy as np, tagrid

def peak():
    with open("/proc/self/status") as status:
        return next(1024 * int(line.split()[1]) for line in status if line.startswith("VmHWM"))

def reset():
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")

tagrid.open(tagrid.encode(np.zeros((9, 9, 9), np.int16), threads=2))[3]
{before}
reset()
start = peak()
{work}
print(peak() - start)
"""


def peak_of(work, before="", path=""):
    done = subprocess.run([sys.executable, "-B", "-c", MEASURE.format(work=work, before=before), path], check=True,
                          stdout=subprocess.PIPE, text=True, env=os.environ)
    return int(done.stdout)


@unittest.skipUnless(os.access("/proc/self/clear_refs", os.W_OK), "peaks cannot be reset here")
class Memory(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = temporary_folder(cls)
        subprocess.run([PROGRAM, "phantom", "--dims", "512,512,200", "-q", "-o", folder / "p.nhdr"], check=True)
        subprocess.run([PROGRAM, "encode", folder / "p.nhdr", "--max-error", "20", "--effort", "fast", "--grid", "derived", "-q", "-o",
                        folder / "p.tag"], check=True)
        cls.path = folder / "p.tag"

    def test_a_slice_takes_the_memory_of_its_bricks(self):
        # Of 105 MB; one layer of bricks along z has 33 MB, and one brick 0.5 MB.
        before = "v = tagrid.open(sys.argv[1], threads=2)"
        for work, limit in (("v[10:12, ::2, 5]", 15), ("v[100]", 20), ("v[:64, :64, :64]", 15), ("for i in range(200): v[i]", 60), ("len(v), v.affine", 1),
                            ("v.read(step=8)", 20), ("v.mesh(level=0, region=((0, 9), (0, 9), (0, 9)))", 40)):
            with self.subTest(work):
                self.assertLess(peak_of(work, before, self.path), limit * MB)

    def test_an_array_of_another_byte_order_is_converted_by_slabs(self):
        work = "tagrid.encode(a, grid='derived', value_range=(0, 1), threads=1)"
        peaks = [peak_of(work, f"a = np.full((128, 256, 512), 1, '{order}f4')") for order in "<>"]
        # Of 67 MB.
        self.assertLess(peaks[1], peaks[0] + 30 * MB)

    def test_another_type_is_converted_by_layers(self):
        before = "v = tagrid.open(tagrid.encode(np.zeros((512, 256, 256), 'i2'), grid='derived'), threads=2)"
        # 134 MB for the result, 9 MB for a layer.
        self.assertLess(peak_of("np.asarray(v, np.float32)", before), (134 + 30) * MB)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
