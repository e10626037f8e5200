"""tools/research/scale: parts cover the bricks, more nodes and more memory take less, tables are made."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCALE = Path(__file__).resolve().parents[3] / "tools" / "research" / "scale"
sys.path.insert(0, str(SCALE))
sys.dont_write_bytecode = True

from cluster import Cluster, Rates, simulate
from volume import Volume

SHAPES = [(1, 1, 1), (65, 65, 65), (66, 64, 500), (512, 512, 150), (300, 3000, 70), (4000, 1, 9), (1, 1, 100000),
          (8192, 8192, 400)]
NO_WAIT = {"start": 0, "latency": 0}


class Program(unittest.TestCase):
    def test_reads_what_is_simulated(self):
        for dims in [(70, 300, 200), (200, 210, 90), (64, 64, 1500), (300, 65, 40)]:
            volume = Volume(dims, 2)
            simulated = sum(volume.work(part, volume.bricks(1))[0] for part in volume.parts()) / volume.samples
            with tempfile.TemporaryDirectory() as folder:
                with open(f"{folder}/a.raw", "wb") as samples:
                    samples.truncate(volume.bytes)
                run = subprocess.run(
                    [PROGRAM, "encode", "a.raw", "--dims", ",".join(map(str, dims)), "--type", "int16", "--resume", "--strip",
                     "-o", "a.tag", "-v"], cwd=folder, check=True, capture_output=True, text=True)
            self.assertIn(f"every sample read {simulated:.2f} times", run.stderr)


class Parts(unittest.TestCase):
    def test_cover_every_brick_once_and_in_order(self):
        for dims in SHAPES:
            for brick in (1, 2, 3):
                volume = Volume(dims, 2, brick=brick)
                rows = [(z, y) for part in volume.parts() for z in range(part.z_low, part.z_end)
                        for y in range(part.y_low, part.y_end)]
                self.assertEqual(rows, [(z, y) for z in range(volume.bricks(2)) for y in range(volume.bricks(1))])

    def test_own_every_sample_once(self):
        for dims in SHAPES:
            volume = Volume(dims, 2)
            for rows in (1, 2, volume.bricks(1)):
                works = [volume.work(part, rows) for part in volume.parts()]
                self.assertEqual(sum(owned for _, _, owned in works), volume.samples)
                for read, marked, owned in works:
                    self.assertGreaterEqual(read, marked)
                    self.assertGreaterEqual(marked, owned)


class Simulations(unittest.TestCase):
    rates = Rates(marks=10, encode=30, decode=25, bits=1)

    def test_less_memory_reads_more(self):
        volume = Volume((4096, 4096, 300), 2)
        read = [simulate(volume, self.rates, Cluster(1, 2, 2e9, 1e11, memory, **NO_WAIT)).read
                for memory in (16e9, 2e9, 0.8e9)]
        self.assertEqual(read[0], volume.bytes)
        self.assertEqual(read, sorted(read))
        self.assertLess(read[0], read[2])

    def test_the_program_prints_a_table(self):
        done = subprocess.run([sys.executable, "-B", str(SCALE), "--dims", "2000,2000,2000", "--nodes", "1,4"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sum(line.startswith("| 16 GB") for line in done.stdout.splitlines()), 2)


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv.pop(1)).resolve())
    unittest.main()
