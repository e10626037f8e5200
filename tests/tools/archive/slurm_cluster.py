"""A cluster of two nodes on this machine: Slurm's own daemons, in a network that has nothing but the loopback interface.

    enter()             starts this script again, as root of namespaces of its own: no daemon outlives it
    with Cluster(folder) as cluster: cluster.submit(...)
"""

import fcntl
import os
import re
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

NODE = Path(__file__).resolve().parents[2] / "support/node.sh"
NODES = ("n1", "n2")
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "mpirun")
INSIDE = "TAGRID_INSIDE_CLUSTER"
UNSHARE = ["unshare", "--mount", "--uts", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]

CONFIGURATION = """
ClusterName=tagrid
SlurmctldHost=localhost(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
# A job that is queued again waits as long as its credential is valid.
AuthInfo=socket={folder}/munge.socket,cred_expire=5
# With IPv6 allowed, Slurm resolves names even if there is no address but those of the loopback interface.
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny,EnableIPv6
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
TmpFS={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
# The nodes have what is written here, whatever the machine has.
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2,bf_interval=2
ReturnToService=2
KillWait=10
MinJobAge=100000
NodeName=n1 NodeHostname=n1 NodeAddr=127.0.0.1 Port=16821 CPUs=4 RealMemory=4000
NodeName=n2 NodeHostname=n2 NodeAddr=127.0.0.1 Port=16822 CPUs=4 RealMemory=4000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""


def enter():
    """Returns in the namespaces, or says why there can be none, as text."""
    if os.environ.get(INSIDE):
        turn_on_loopback()
        return None
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    missing = [program for program in PROGRAMS if not any((Path(p) / program).exists() for p in path.split(":"))]
    if missing:
        return f"{', '.join(missing)} not found (tools/install_packages.sh slurm)"
    if subprocess.run([*UNSHARE, "true"], capture_output=True).returncode != 0:
        return "unshare of the network and of processes is not permitted here"
    sys.stdout.flush()
    os.execvpe("unshare", [*UNSHARE, sys.executable, "-B", *sys.argv], {**os.environ, "PATH": path, INSIDE: "1"})


def turn_on_loopback():
    set_flags, up = 0x8914, 1
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, set_flags, struct.pack("16sh14x", b"lo", up))


def wait_until(condition, what, seconds=300):
    end = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > end:
            raise AssertionError(f"waited in vain: {what}")
        time.sleep(0.1)
    return value


class Job:
    def __init__(self, cluster, number, log):
        self.cluster, self.number, self.log = cluster, number, log

    def tasks(self):
        """What Slurm knows of the job, or of each task of an array."""
        text = self.cluster.call("scontrol", "show", "job", "-o", self.number)
        return [dict(re.findall(r"(\S+?)=(\S*)", line)) for line in text.splitlines() if line.strip()]

    def signal(self, *arguments):
        self.cluster.call("scancel", *arguments, self.number)

    def output(self):
        return "".join(path.read_text() for path in sorted(self.log.parent.glob(self.log.name + "*")))

    def finish(self, seconds=900):
        """Waits for the end; the codes of all tasks."""
        over = {"COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL", "OUT_OF_MEMORY", "BOOT_FAIL"}
        wait_until(lambda: all(task["JobState"] in over for task in self.tasks()), f"job {self.number}", seconds)
        return [task["ExitCode"] for task in self.tasks()]

    def restarts(self):
        return sum(int(task["Restarts"]) for task in self.tasks())


class Cluster:
    def __init__(self, folder):
        self.folder = Path(folder)
        self.environment = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf"),
                            "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
                            "OMPI_MCA_btl_tcp_if_include": "lo", "OMPI_MCA_oob_tcp_if_include": "lo"}
        self.count = 0

    def __enter__(self):
        for name in ("state", *NODES):
            (self.folder / name).mkdir(parents=True)
        (self.folder / "slurm.conf").write_text(CONFIGURATION.format(folder=self.folder))
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(64))
        key.chmod(0o600)
        self.call("munged", "--force", f"--key-file={key}", *(f"--{name}={self.folder}/munge.{end}" for name, end in (
            ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"), ("seed-file", "seed"))))
        self.call("slurmctld")
        for node in NODES:
            self.call(NODE, node, "slurmd", "-N", node)
        wait_until(lambda: self.call("sinfo", "-h", "-o", "%T %D").split() == ["idle", "2"], "two idle nodes", 60)
        return self

    def __exit__(self, *_):
        self.call("scancel", "--user=root", check=False)
        for name in (*NODES, "slurmctld", "munge"):
            subprocess.run(["pkill", "-F", self.folder / f"{name}.pid"])

    def call(self, *command, check=True, cwd=None, more=None):
        done = subprocess.run(command, env={**self.environment, **(more or {})}, cwd=cwd, capture_output=True,
                              text=True, stdin=subprocess.DEVNULL)
        if check and done.returncode != 0:
            raise AssertionError(f"{command}: {done.returncode}: {done.stdout}{done.stderr}")
        return done.stdout

    def submit(self, *arguments, cwd, **more):
        self.count += 1
        log = Path(cwd) / f"job{self.count}.log"
        name = f"{log}.%a" if any(str(a).startswith("--array") for a in arguments) else str(log)
        text = self.call("sbatch", "--parsable", "-o", name, *map(str, arguments), cwd=cwd, more=more)
        return Job(self, text.strip(), log)
