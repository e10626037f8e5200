"""Running programs: time, memory, and what they print."""

import json
import shlex
import subprocess
from dataclasses import dataclass

from failure import WORLD, Failure


@dataclass(frozen=True)
class Usage:
    """Usage of a command and of all processes that it waited for."""

    wall: float  # seconds by the clock
    cpu: float  # seconds of processor time, user and system
    peak_mb: float  # resident memory of the largest of them, MB (10^6)


class Programs:
    """The programs of the benchmark itself, which are built beside tagrid."""

    def __init__(self, tagrid):
        self.tagrid = tagrid
        self.folder = tagrid.parent / "bench"
        for name in ("measure", "samples"):
            if not self.path(name).exists():
                raise Failure(WORLD, f"{self.path(name)} is missing: build with -DTAGRID_BENCHMARKS=ON")

    def path(self, name):
        return self.folder / f"bench_{name}"

    def samples(self, *arguments):
        """Runs bench_samples and returns what it prints."""
        return output_of(self.path("samples"), *arguments)

    def measure(self, command, folder):
        """Runs a command, a list or a line for the shell, in `folder`. Returns its Usage."""
        arguments = ["sh", "-c", command] if isinstance(command, str) else [str(a) for a in command]
        result = folder / "usage.json"
        run = subprocess.run([self.path("measure"), result, *arguments], cwd=folder, stdin=subprocess.DEVNULL,
                             stderr=subprocess.PIPE, text=True, errors="replace")
        usage = json.loads(result.read_text()) if run.returncode == 0 else {"code": run.returncode}
        if usage["code"] != 0:
            last = (run.stderr.strip().splitlines() or ["no message"])[-1]
            raise Failure(WORLD, f"exit code {usage['code']} of: {shlex.join(arguments)}: {last}")
        return Usage(usage["wall"], usage["user"] + usage["system"], usage["peak_kb"] * 1024 / 1e6)


def output_of(*command):
    """The standard output of a command. Raises Failure if the command fails."""
    run = subprocess.run([str(part) for part in command], capture_output=True, text=True, errors="replace")
    if run.returncode != 0:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        raise Failure(WORLD, f"exit code {run.returncode} of {command[0]}: {last}")
    return run.stdout
