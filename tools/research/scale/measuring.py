"""The rates of one core of this machine, from runs of the program."""

import json
import os
import platform
import re
import subprocess
import tempfile
from pathlib import Path

from volume import SAMPLE_BYTES, Volume


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


def smallest_memory(command):
    """The limit that a refusal names, as the option wants it."""
    refused = subprocess.run([str(word) for word in command + ["-M", "1"]], capture_output=True, text=True)
    found = re.search(r"-M (\d+M)", refused.stderr)
    if not found:
        raise RuntimeError(f"{refused.stderr.strip()}: names no limit")
    return found.group(1)


def measure(program, path, max_error):
    """Encodes whole layers, then strips of one row of bricks, where marks are computed again: the difference is the
    time of marks, including the reading of their samples."""
    with tempfile.TemporaryDirectory() as folder:
        file, facts, samples = (Path(folder) / name for name in ("a.tag", "facts.json", "a.raw"))
        encode = [program, "encode", path, "-o", file, "-f", "-T", 1, "--max-error", max_error]
        whole = seconds_of(encode + ["-M", "1G", "--json", facts])
        strips = seconds_of(encode + ["-M", smallest_memory(encode)])
        decode = seconds_of([program, "decode", file, "-o", samples, "-f", "-T", 1])
        said = json.loads(facts.read_text())
        volume = Volume(tuple(said["dims"]), SAMPLE_BYTES[said["type"]])
        bits = 8 * file.stat().st_size / volume.samples
    _, marked_again, _ = volume.work(volume.whole(), 1)
    marks = 1e9 * (strips - whole) / (marked_again - volume.samples)
    return {"source": f"{Path(path).name}, E = {max_error}, {processor()}",
            "rates": {"marks": marks, "encode": 1e9 * whole / volume.samples - marks,
                      "decode": 1e9 * decode / volume.samples, "bits": bits}}
