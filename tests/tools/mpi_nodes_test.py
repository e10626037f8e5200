"""tagrid-mpi on two nodes, with Open MPI as it is by default: processes of two nodes share no memory, and reach each other
only by TCP. tests/support/node.sh makes the nodes on this machine.

    mpi_nodes_test.py TAGRID TAGRID_MPI FAULT_INJECTION
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

TAGRID, TAGRID_MPI, FAULT_INJECTION = (os.path.abspath(argument) for argument in sys.argv[1:4])
NODE = Path(__file__).resolve().parents[1] / "support/node.sh"
BROKEN, WORLD = 65, 74
# Ranks 0 and 1 are on the first node, 2 and 3 on the second. mpirun is on neither, so it starts both by the agent.
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--map-by", "ppr:2:node", "--host", "n1:2,n2:2",
          "--mca", "btl_tcp_if_include", "lo", "-n", "4"]
# The agent of Open MPI 4, and that of Open MPI 5.
AGENT = {"OMPI_MCA_plm_rsh_agent": str(NODE), "PRTE_MCA_plm_ssh_agent": str(NODE)}
SETTINGS = ["--cube=8", "--brick=1", "--max-error=2", "-T2"]
ENCODE = ["encode", "volume.nhdr", "-qo", "new.tag", *SETTINGS]
RESUME = [*ENCODE, "--resume"]
CONVERT = ["convert", "--manifest", "list.tsv", "--output-dir", "out"]
# The disk calls of one rank are counted, and it is killed at one of them.
KILLED = ('[ $OMPI_COMM_WORLD_RANK != 3 ] || export LD_PRELOAD=$LIBRARY TAGRID_FAULT_FOLDER=$PWD TAGRID_FAULT_AT=$AT '
          'TAGRID_FAULT_KIND=SIGKILL TAGRID_FAULT_LASTING=; exec "$0" "$@"')


class TwoNodes(unittest.TestCase):
    def setUp(self):
        # Each node has a /dev/shm of its own.
        temporary = tempfile.TemporaryDirectory(dir="/var/tmp")
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name).resolve()

    def start(self, *command, **environment):
        # mpirun counts the processors of this machine for each of the nodes.
        environment = {**os.environ, "OMPI_MCA_rmaps_base_oversubscribe": "1", **AGENT, **environment}
        return subprocess.Popen([*MPIRUN, *command], cwd=self.folder, env=environment, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)

    def finish(self, process):
        process.out, process.err = process.communicate(timeout=300)
        # Processes of a node end when they notice that mpirun has ended.
        end = time.monotonic() + 60
        while self.is_somebody_here() and time.monotonic() < end:
            time.sleep(0.05)
        self.assertFalse(self.is_somebody_here())
        return process

    def is_somebody_here(self):
        for process in Path("/proc").glob("[0-9]*"):
            try:
                if (process / "cwd").readlink() == self.folder:
                    return True
            except OSError:
                pass
        return False

    def by_four(self, *arguments, **environment):
        return self.finish(self.start(TAGRID_MPI, *arguments, **environment))

    def with_rank_killed(self, at, *arguments):
        return self.finish(self.start("bash", "-c", KILLED, TAGRID_MPI, *arguments, AT=str(at), LIBRARY=FAULT_INJECTION))

    def alone(self, *arguments):
        subprocess.run([TAGRID, *arguments], cwd=self.folder, check=True)

    def expect_well(self, process):
        self.assertEqual(process.returncode, 0, process.err)

    def names(self):
        return sorted(path.name for path in self.folder.iterdir())

    def records(self):
        return [json.loads(line) for line in self.content("out/results.jsonl").splitlines()]

    def content(self, name):
        return (self.folder / name).read_bytes()

    def make_volume(self):
        self.alone("phantom", "--dims", "50,41,45", "-qo", "volume.nhdr")
        self.alone("encode", "volume.nhdr", "-qo", "plain.tag", *SETTINGS)
        self.plain = self.content("plain.tag")
        (self.folder / "plain.tag").unlink()

    def expect_result(self, process):
        self.expect_well(process)
        self.assertEqual(self.names(), ["new.tag", "volume.nhdr", "volume.raw"])
        self.assertTrue(self.content("new.tag") == self.plain)
        (self.folder / "new.tag").unlink()

    def test_nodes_share_no_memory_and_reach_each_other_by_tcp_only(self):
        script = "touch /dev/shm/of_$(hostname); sleep 0.5; echo $(hostname) $TMPDIR $(ls -d /dev/shm/of_*)"
        process = self.finish(self.start("bash", "-c", script))
        self.expect_well(process)
        self.assertEqual(sorted(process.out.splitlines()),
                         sorted(2 * [f"{n} /dev/shm/scratch_of_{n} /dev/shm/of_{n}" for n in ("n1", "n2")]))
        self.assertRegex(self.by_four("--version", OMPI_MCA_btl="self,vader").err,
                         "unreachable|unable to reach each other")
        self.expect_well(self.by_four("--version", OMPI_MCA_btl="self,vader,tcp"))

    def test_they_write_the_files_of_one_process(self):
        self.make_volume()
        self.expect_result(self.by_four(*RESUME))
        self.expect_well(self.by_four(*ENCODE))
        self.assertTrue(self.content("new.tag") == self.plain)
        self.alone("decode", "new.tag", "-qo", "alone.nrrd")
        self.expect_well(self.by_four("decode", "new.tag", "-qo", "back.nrrd"))
        self.assertTrue(self.content("back.nrrd") == self.content("alone.nrrd"))
        self.expect_well(self.by_four("verify", "new.tag", "--against", "volume.nhdr"))

    def test_a_run_that_a_signal_ended_goes_on(self):
        self.make_volume()
        process = self.start(TAGRID_MPI, *RESUME)
        end = time.monotonic() + 60
        while not list(self.folder.glob(".new.tag.parts/[0-9]*")) and process.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        self.finish(process)
        if "new.tag" not in self.names():
            self.assertNotEqual(process.returncode, 0)
            self.assertEqual(self.names(), [".new.tag.parts", "volume.nhdr", "volume.raw"])
            self.expect_result(self.by_four(*RESUME))

    def test_a_rank_that_is_killed_on_the_other_node_ends_the_job_and_the_next_one_goes_on(self):
        self.make_volume()
        process = self.with_rank_killed(40, *RESUME)
        self.assertNotEqual(process.returncode, 0)
        # Open MPI 5 reports that rank or the one that lost the connection, whichever it hears of first.
        version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True).stdout
        self.assertRegex(process.err, r'on node n1 calling\s"abort"|on node n2 exited on\ssignal 9 \(Killed\)'
                         if "(Open MPI) 5" in version
                         else r"on node n2 exited on\ssignal 9 \(Killed\)")
        self.assertNotIn("tagrid: ", process.err)
        self.assertEqual(self.names(), [".new.tag.parts", "volume.nhdr", "volume.raw"])
        self.expect_result(self.by_four(*RESUME))
        # Without --resume it leaves nothing.
        self.assertNotEqual(self.with_rank_killed(40, *ENCODE).returncode, 0)
        self.assertEqual(self.names(), ["volume.nhdr", "volume.raw"])

    def test_a_failure_names_the_rank_and_its_node(self):
        self.make_volume()
        local = self.folder / "local"
        local.mkdir()
        for name in ("volume.nhdr", "volume.raw"):
            shutil.copy(self.folder / name, local)
        for said, *arguments in (
                ("local/volume.nhdr: ", "encode", "local/volume.nhdr", "-qo", "new.tag"),
                ("local/.new.tag.parts: does not exist on this machine", *ENCODE, "-o", "local/new.tag", "--resume")):
            process = self.by_four(*arguments, TAGRID_MISSING_ON_n2=str(local))
            self.assertEqual(process.returncode, WORLD, process.err)
            self.assertIn("tagrid: rank 2 on n2: " + said, process.err)
            self.assertEqual(process.err.count("tagrid: "), 1, process.err)
        names = [f"local/{name}.nrrd" for name in "abcdefgh"]
        for name in names:
            self.alone("phantom", "--dims", "21,18,13", "-qo", name)
        (self.folder / "list.tsv").write_text("\n".join(names))
        process = self.by_four(*CONVERT, TAGRID_MISSING_ON_n2=str(local))
        failed = [record for record in self.records() if record["status"] != "ok"]
        for record in failed:
            self.assertTrue(record["error"].startswith(f"on n2: {local}/"), record)
        self.assertEqual(process.returncode, BROKEN if failed else 0, process.err)
        # A long reason is told once; records have it for each volume.
        told = process.err.count(f"tagrid: on n2: {local}/") + process.err.count("fails for the same reason")
        self.assertEqual(told, len(failed), process.err)
        # The other node has them.
        self.assertLess(len(failed), len(names))
        # A directory of outputs that each node has for itself is refused, as they would be scattered.
        shutil.rmtree(self.folder / "out")
        (self.folder / "out").mkdir()
        process = self.by_four(*CONVERT, TAGRID_MISSING_ON_n2=str(self.folder / "out"))
        self.assertEqual(process.returncode, WORLD, process.err)
        self.assertIn("tagrid: rank 2 on n2: out: is not the same directory on this machine", process.err)
        self.assertEqual([path.name for path in (self.folder / "out").iterdir()], ["results.jsonl"])

    def test_volumes_are_converted_as_by_one_process_also_after_a_rank_was_killed(self):
        names = [name + ".nrrd" for name in "abcdef"]
        for i, name in enumerate(names):
            self.alone("phantom", "--dims", "21,18,13", "--seed", str(i), "-qo", name)
        (self.folder / "list.tsv").write_text("\n".join(names))
        self.alone(*CONVERT, "--progress=none")
        tags = {path.name: path.read_bytes() for path in self.folder.glob("out/*.tag")}
        self.assertEqual(len(tags), 6)

        def expect_tags():
            for name, content in tags.items():
                self.assertTrue(self.content("out/" + name) == content, name)
            shutil.rmtree(self.folder / "out")

        shutil.rmtree(self.folder / "out")
        self.expect_well(self.by_four(*CONVERT))
        self.assertEqual(sorted(record["output"] for record in self.records()), sorted(tags))
        expect_tags()
        self.with_rank_killed(20, *CONVERT)
        for record in self.records():
            self.assertTrue((self.folder / "out" / record["output"]).exists(), record)
        self.expect_well(self.by_four(*CONVERT, "--skip-done"))
        expect_tags()


if __name__ == "__main__":
    for needed in (["mpirun", "--version"], ["unshare", "--mount", "--uts", "--ipc", "true"]):
        if not shutil.which(needed[0]) or subprocess.run(needed, capture_output=True).returncode != 0:
            sys.exit(print("skipped:", *needed, "does not work here, so there are no nodes"))
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
