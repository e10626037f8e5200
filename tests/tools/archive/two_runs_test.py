"""Two runs at once on the same volumes and outputs, in every mixture of passes, some of them killed: no original is lost.

Every original is there unchanged, or comes back byte for byte from a .tag file. Lossy encodings are allowed only where the
command that removes allows them; here none does, except `encode --rm -f --max-error`, whose mixtures are judged by its bound.
Usage: two_runs_test.py TAGRID. TAGRID_ROUNDS: how often each mixture is tried.
"""
import array
import itertools
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = str(Path(sys.argv.pop(1)).resolve()) if len(sys.argv) > 1 else "tagrid"
ROUNDS = int(os.environ.get("TAGRID_ROUNDS", "1"))
SIZE = 40
VOLUMES = 3


def samples_of(seed):
    numbers = random.Random(seed)
    return array.array("h", (numbers.randrange(-900, 900) // 30 * 30 + z for z in range(SIZE) for _ in range(SIZE * SIZE)))


HEADER = f"NRRD0004\ntype: short\ndimension: 3\nsizes: {SIZE} {SIZE} {SIZE}\nencoding: raw\nendian: little\n\n".encode()
ORIGINALS = {f"v{i}.nrrd": HEADER + samples_of(i).tobytes() for i in range(VOLUMES)}
CONVERT = ["convert", "--manifest", "list.tsv", "--output-dir", "out", "-q", "-T", "1"]
PASSES = {
    "force": CONVERT + ["-f", "--max-error", "5", "--shard", "0/1"],
    "force again": CONVERT + ["-f"],
    "remove": CONVERT + ["--remove-verified"],
    "remove in a shard": CONVERT + ["--remove-verified", "--shard", "0/1"],
    "continue": CONVERT + ["--skip-done", "--shard", "1/2"],
    "encode": ["encode", "src/v0.nrrd", "-fo", "out/v0.tag", "--max-error", "5", "-q", "-T", "1"],
    "encode and remove": ["encode", "src/v0.nrrd", "-fo", "out/v0.tag", "--rm", "-q", "-T", "1"],
    "protect": ["protect", "out/v0.tag", "--parity", "20%", "-q"],
    "restore": ["restore", "--records", "out", "-q"],
}


class TwoRuns(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = Path(place.name)

    def run_to_end(self, *arguments):
        return subprocess.run([PROGRAM, *arguments], cwd=self.folder, capture_output=True, text=True, errors="replace")

    def begin_anew(self):
        subprocess.run(["rm", "-rf", "src", "out", "list.tsv"], cwd=self.folder, check=True)
        (self.folder / "src").mkdir()
        for name, content in ORIGINALS.items():
            (self.folder / "src" / name).write_bytes(content)
        (self.folder / "list.tsv").write_text("".join(f"src/{name}\n" for name in ORIGINALS))
        self.assertEqual(self.run_to_end(*CONVERT).returncode, 0)

    def lost(self):
        """Originals that are neither there, unchanged, nor come back from an output."""
        gone = []
        for name, content in ORIGINALS.items():
            source = self.folder / "src" / name
            if source.exists() and source.read_bytes() == content:
                continue
            back = self.folder / "back"
            subprocess.run(["rm", "-rf", back], check=True)
            self.run_to_end("restore", "out/" + name.replace(".nrrd", ".tag"), "-q", "-o", "back")
            if not (back / name).exists() or (back / name).read_bytes() != content:
                gone.append(name)
        return gone

    def spoil(self, one, other, kill):
        self.begin_anew()
        pause = random.uniform(0, 0.25)
        runs = []
        for name in (one, other):
            runs.append(subprocess.Popen([PROGRAM, *PASSES[name]], cwd=self.folder, stdout=subprocess.DEVNULL,
                                         stderr=subprocess.PIPE))
            time.sleep(pause)
        if kill:
            time.sleep(random.uniform(0, 0.15))
            random.choice(runs).send_signal(random.choice([signal.SIGKILL, signal.SIGTERM]))
        for name, run in zip((one, other), runs):
            message = run.communicate(timeout=120)[1].decode(errors="replace")
            self.assertIn(run.returncode, [0, 64, 65, 74, 75, -signal.SIGKILL, -signal.SIGTERM], f"{name}: {message}")
            self.assertNotIn("bug", message)
        self.assertEqual(self.lost(), [], f"{one} beside {other}, {'one killed' if kill else 'both to their ends'}")
        # What a killed run left blocks nobody, and does not stay.
        for name in ("remove", "restore"):
            self.assertIn(self.run_to_end(*PASSES[name]).returncode, [0, 65], name)
        self.assertEqual(self.lost(), [])
        if not kill:
            hidden = [path.name for path in (self.folder / "out").iterdir() if path.name.startswith(".")]
            self.assertEqual(hidden, [])

    def test_no_mixture_loses_an_original(self):
        random.seed(os.environ.get("TAGRID_SEED", "1"))
        for number, (one, other) in enumerate(list(itertools.product(PASSES, PASSES)) * ROUNDS):
            with self.subTest(one=one, other=other, number=number):
                self.spoil(one, other, kill=random.random() < 0.5)

    def test_a_lock_that_a_killed_run_left_blocks_nobody(self):
        self.begin_anew()
        lock = self.folder / "out" / ".v0.tag.lock"
        lock.write_bytes(b"")
        self.assertEqual(self.run_to_end(*PASSES["remove"]).returncode, 0)
        self.assertFalse((self.folder / "src" / "v0.nrrd").exists())
        self.assertFalse(lock.exists())

    def test_whoever_renames_waits_for_the_lock(self):
        self.begin_anew()
        before = (self.folder / "out" / "v0.tag").read_bytes()
        holder = subprocess.Popen(["flock", "out/.v0.tag.lock", "sleep", "1.5"], cwd=self.folder)
        self.addCleanup(holder.wait)
        while not (self.folder / "out" / ".v0.tag.lock").exists():
            time.sleep(0.01)
        runs = [subprocess.Popen([PROGRAM, *PASSES[name]], cwd=self.folder, stderr=subprocess.DEVNULL)
                for name in ("encode", "protect", "remove")]
        time.sleep(0.9)
        self.assertEqual((self.folder / "out" / "v0.tag").read_bytes(), before)
        self.assertTrue((self.folder / "src" / "v0.nrrd").exists())
        for run in runs:
            run.wait(timeout=60)
        self.assertEqual(self.lost(), [])

    def stopped_at_first(self, *options):
        """A run over a list whose first volume is large, stopped while it has that one open; v0 comes after it."""
        large = array.array("h", (numbers % 977 for numbers in range(160 ** 3)))
        header = HEADER.replace(f"{SIZE} {SIZE} {SIZE}".encode(), b"160 160 160")
        (self.folder / "src" / "large.nrrd").write_bytes(header + large.tobytes())
        (self.folder / "long.tsv").write_text("src/large.nrrd\nsrc/v0.nrrd\n")
        (self.folder / "v0.tsv").write_text("src/v0.nrrd\n")
        of_list = ["convert", "--manifest", "long.tsv", "--output-dir", "out", "-q", "-T", "1"]
        self.assertEqual(self.run_to_end(*of_list, "--skip-done").returncode, 0)
        run = subprocess.Popen([PROGRAM, *of_list, *options], cwd=self.folder, stderr=subprocess.DEVNULL)
        self.addCleanup(run.wait)
        while run.poll() is None:
            try:
                links = [os.readlink(file) for file in Path(f"/proc/{run.pid}/fd").iterdir()]
            except OSError:  # closed in the meantime
                continue
            if any(link.endswith("large.nrrd") for link in links):
                run.send_signal(signal.SIGSTOP)
                return run
        self.fail("the run ended before it could be stopped")

    def other_run(self, *options):
        return self.run_to_end("convert", "--manifest", "v0.tsv", "--output-dir", "out", "-q", "-T", "1", "--shard", "0/1", *options)

    def test_a_removal_is_the_newest_record_however_long_the_run_was(self):
        self.begin_anew()
        removal = self.stopped_at_first("--remove-verified")
        self.other_run("--skip-done")
        os.utime(self.folder / "src" / "v0.nrrd")
        self.other_run("--skip-done")
        removal.send_signal(signal.SIGCONT)
        removal.wait()
        self.run_to_end("restore", "--records", "out")
        self.assertEqual((self.folder / "src" / "v0.nrrd").read_bytes(), ORIGINALS["v0.nrrd"])

    def test_an_output_whose_original_was_removed_in_the_meantime_is_not_replaced(self):
        self.begin_anew()
        force = self.stopped_at_first("-f")
        self.assertEqual(self.other_run("--remove-verified").returncode, 0)
        (self.folder / "src" / "v0.nrrd").write_bytes(ORIGINALS["v1.nrrd"])
        force.send_signal(signal.SIGCONT)
        self.assertEqual(force.wait(), 65)
        self.run_to_end("restore", "out/v0.tag", "-o", "back")
        self.assertEqual((self.folder / "back" / "v0.nrrd").read_bytes(), ORIGINALS["v0.nrrd"])


if __name__ == "__main__":
    unittest.main()
