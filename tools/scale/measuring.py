"""The rates of one core of this machine, from runs of the program."""

import json
import os
import platform
import subprocess
import tempfile
from pathlib import Path

from volume import Volume

SAMPLE_BYTES = {"uint8": 1, "int8": 1, "uint16": 2, "int16": 2, "uint32": 4, "int32": 4, "float32": 4, "float64": 8}


def seconds_of(command):
    """User and system time: the smallest of three runs."""
    times = []
    for _ in range(3):
        before = os.times()
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        after = os.times()
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip())
        times.append(after.children_user + after.children_system - before.children_user - before.children_system)
    return min(times)


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


def measure(program, path, max_error):
    with tempfile.TemporaryDirectory() as folder:
        file, facts, samples = (Path(folder) / name for name in ("a.tag", "facts.json", "a.raw"))
        common = [program, "encode", path, "-o", file, "-f", "-T", 1, "--max-error", max_error]
        grid = seconds_of(common + ["--grid-only", "--max-level", 0]) if False else None
        encode = seconds_of(common + ["--json", facts])
        decode = seconds_of([program, "decode", file, "-o", samples, "-f", "-T", 1])
        said = json.loads(facts.read_text())
        volume = Volume(tuple(said["dims"]), SAMPLE_BYTES[said["type"]])
        bits = 8 * file.stat().st_size / volume.samples
    return {"source": f"{Path(path).name}, E = {max_error}, {processor()}",
            "rates": {"marks": 0, "encode": 1e9 * encode / volume.samples, "decode": 1e9 * decode / volume.samples,
                      "bits": bits}}
