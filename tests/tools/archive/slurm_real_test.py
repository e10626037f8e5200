"""tools/slurm on a real Slurm with two nodes: arrays and large volumes that are interrupted in all ways.

    slurm_real_test.py TAGRID TAGRID_MPI

It takes minutes, and so runs only if TAGRID_LONG is set.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import slurm_cluster
from slurm_cluster import wait_until

TAGRID, TAGRID_MPI = (os.path.abspath(argument) for argument in sys.argv[1:3])
SCRIPTS = Path(__file__).resolve().parents[3] / "tools/slurm"
SMALL_JOB = ["--mem=500M", "--cpus-per-task=1", "--time=30"]
LARGE_JOB = ["--nodes=2", "--mem=1G", "--cpus-per-task=2", "--time=30"]
# Slow, as many jobs are interrupted in the middle.
LARGE = ["--max-error", "5", "--cube", "16", "--brick", "2", "-T1"]


def tagrid(*arguments, cwd):
    subprocess.run([TAGRID, *map(str, arguments)], cwd=cwd, check=True)


class Slurm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="tagrid-slurm-")
        cls.volumes = Path(cls.temporary.name) / "volumes"
        cls.volumes.mkdir()
        names = [f"v{i}.nrrd" for i in range(12)]
        for i, name in enumerate(names):
            tagrid("phantom", "--dims", "90,80,70", "--seed", i, "-qo", name, cwd=cls.volumes)
        tagrid("phantom", "--dims", "200,180,160", "-qo", "large.nhdr", cwd=cls.volumes)
        (cls.volumes / "list.tsv").write_text("".join(name + "\n" for name in names))
        tagrid("convert", "--manifest", "list.tsv", "--output-dir", "whole", "--max-error", 3, "--progress=none",
               cwd=cls.volumes)
        tagrid("encode", "large.nhdr", "-qo", "large.tag", *LARGE, cwd=cls.volumes)
        cls.cluster = slurm_cluster.Cluster(Path(cls.temporary.name) / "slurm").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.cluster.__exit__()
        cls.temporary.cleanup()

    def setUp(self):
        self.out = self.volumes / self.id().split(".")[-1]
        self.out.mkdir()

    def array(self, tasks, *arguments):
        return self.cluster.submit(*SMALL_JOB, f"--array=0-{tasks - 1}", *arguments, SCRIPTS / "convert_array.sbatch",
                                   "list.tsv", self.out, "--max-error", 3, cwd=self.volumes, TAGRID=TAGRID)

    def large(self, *arguments, launcher=""):
        return self.cluster.submit(*LARGE_JOB, *arguments, SCRIPTS / "encode_large.sbatch", "large.nhdr",
                                   self.out / "large.tag", *LARGE, "-M", "800M", cwd=self.volumes, TAGRID_MPI=TAGRID_MPI,
                                   TAGRID_LAUNCHER=launcher)

    def expect_all_volumes(self):
        tags = {path.name: path.read_bytes() for path in (self.volumes / "whole").glob("*.tag")}
        self.assertEqual(len(tags), 12)
        self.assertEqual({path.name for path in self.out.glob("*.tag")}, set(tags))
        for name, content in tags.items():
            self.assertTrue((self.out / name).read_bytes() == content, name)
        self.assertEqual([path.name for path in self.out.iterdir() if path.name.startswith(".")], [])

    def expect_large_volume(self, job):
        self.assertEqual(job.finish(), ["0:0"], job.output())
        self.assertEqual([path.name for path in self.out.iterdir()], ["large.tag"], job.output())
        self.assertTrue((self.out / "large.tag").read_bytes() == (self.volumes / "large.tag").read_bytes())

    def expect_cancelled(self, job):
        """It has ended for good: Slurm had time to start it again."""
        job.finish()
        wait_until(lambda: not self.processes(), "the end of all processes", 60)
        time.sleep(10)
        self.assertEqual([task["JobState"] for task in job.tasks()], ["CANCELLED"], job.output())
        self.assertEqual(job.restarts(), 0, job.output())
        self.assertNotIn("queued again", job.output())

    def records(self, name):
        return [json.loads(line) for line in (self.out / f"{name}.jsonl").read_text().splitlines()]

    def wait_for_some_tags(self, job):
        wait_until(lambda: list(self.out.glob("*.tag")) or "COMPLETED" in job.tasks()[0]["JobState"], "a first volume")

    def processes(self):
        """Of tagrid-mpi, with the output of this test. Only processes of this cluster can be seen."""
        found = []
        for process in Path("/proc").glob("[0-9]*"):
            try:
                arguments = (process / "cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            if arguments[0] == os.fsencode(TAGRID_MPI) and os.fsencode(self.out / "large.tag") in arguments:
                found.append(int(process.name))
        return found

    def wait_for_some_parts(self):
        folder = self.out / ".large.tag.parts"
        wait_until(lambda: len(list(folder.glob("[0-9]*"))) > 3, "some parts")

    def test_an_array_converts_the_list(self):
        job = self.array(3)
        self.assertEqual(job.finish(), ["0:0"] * 3, job.output())
        self.expect_all_volumes()
        self.assertEqual(job.restarts(), 0)

    def test_two_arrays_at_once_convert_one_list(self):
        for job, tasks in [(self.array(2), 2), (self.array(3), 3)]:
            self.assertEqual(job.finish(), ["0:0"] * tasks, job.output())
        self.expect_all_volumes()
        job = self.array(3)
        self.assertEqual(job.finish(), ["0:0"] * 3, job.output())
        for shard in range(3):
            self.assertEqual([record["status"] for record in self.records(f"results-{shard}-of-3")][-4:], ["skipped"] * 4)
        self.expect_all_volumes()

    def test_a_task_that_is_told_to_stop_is_queued_again_and_goes_on(self):
        job = self.array(1)
        self.wait_for_some_tags(job)
        job.signal("--batch", "--signal=USR1")
        self.assertEqual(job.finish(), ["0:0"], job.output())
        self.assertEqual(job.restarts(), 1)
        self.assertIn("queued again", job.output())
        self.expect_all_volumes()
        self.assertIn("skipped", [record["status"] for record in self.records("results-0-of-1")])

    def test_a_task_that_is_cancelled_ends_and_can_be_continued(self):
        job = self.array(1)
        self.wait_for_some_tags(job)
        job.signal()
        self.expect_cancelled(job)
        self.assertIn("cancelled", job.output())
        self.assertLess(len(list(self.out.glob("*.tag"))), 12)
        job = self.array(1)
        self.assertEqual(job.finish(), ["0:0"], job.output())
        self.expect_all_volumes()
        self.assertIn("skipped", [record["status"] for record in self.records("results-0-of-1")])

    def test_a_task_that_an_administrator_requeues_goes_on(self):
        job = self.array(1)
        self.wait_for_some_tags(job)
        self.cluster.call("scontrol", "requeue", job.number)
        wait_until(lambda: job.restarts() == 1, "the requeue")
        self.assertEqual(job.finish(), ["0:0"], job.output())
        self.expect_all_volumes()

    def test_a_large_volume_is_encoded_by_the_launcher_that_works(self):
        # In this Slurm, srun by itself does not tell the processes of each other.
        job = self.large()
        self.expect_large_volume(job)
        self.assertIn("the launcher is srun --cpus-per-task=2 --mpi=pmix\n", job.output())

    def test_a_large_volume_is_encoded_by_mpirun(self):
        self.expect_large_volume(self.large(launcher="mpirun"))

    def test_a_large_volume_is_told_to_stop_with_each_launcher_and_goes_on(self):
        for launcher in ("", "mpirun"):
            with self.subTest(launcher=launcher):
                job = self.large(launcher=launcher)
                self.wait_for_some_parts()
                job.signal("--batch", "--signal=USR1")
                self.expect_large_volume(job)
                self.assertEqual(job.restarts(), 1, job.output())
                (self.out / "large.tag").unlink()

    def test_a_large_volume_that_is_cancelled_with_each_launcher_ends_and_can_be_continued(self):
        for launcher in ("", "mpirun"):
            with self.subTest(launcher=launcher):
                job = self.large(launcher=launcher)
                self.wait_for_some_parts()
                job.signal()
                self.expect_cancelled(job)
                self.assertEqual([path.name for path in self.out.iterdir()], [".large.tag.parts"])
                self.expect_large_volume(self.large(launcher=launcher))
                (self.out / "large.tag").unlink()

    def test_a_large_volume_that_an_administrator_requeues_goes_on(self):
        job = self.large()
        self.wait_for_some_parts()
        self.cluster.call("scontrol", "requeue", job.number)
        wait_until(lambda: job.restarts() == 1, "the requeue")
        self.expect_large_volume(job)

    def test_a_volume_that_takes_longer_than_its_job_is_completed_by_the_next_ones(self):
        # Slurm looks at the time every half minute, and so sends the signal up to a minute early. However fast the machine
        # is, the first job is not done by then.
        job = self.large("--time=1", "--signal=B:USR1@30")
        self.wait_for_some_parts()
        for process in self.processes():
            os.kill(process, signal.SIGSTOP)
        self.expect_large_volume(job)
        self.assertGreaterEqual(job.restarts(), 1, job.output())


if __name__ == "__main__":
    if not os.environ.get("TAGRID_LONG"):
        sys.exit(print("skipped: takes minutes, and so runs only with TAGRID_LONG=1 (tools/test.sh --long)"))
    reason = slurm_cluster.enter()
    if reason:
        sys.exit(print("skipped:", reason))
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
