"""The rates of one core of this machine, from runs of the program."""

import json
import re
import subprocess
import tempfile
from pathlib import Path

from running import WORLD, Failure, processor, usage_of
from volume import SAMPLE_BYTES, Volume


def seconds_of(command):
    """Processor time: the smallest of three runs."""
    return min(usage_of(*command).cpu for _ in range(3))


def smallest_memory(command):
    """The limit that a refusal names, as the option takes it."""
    refused = subprocess.run([str(word) for word in command + ["-M", "1"]], capture_output=True, text=True)
    found = re.search(r"-M (\d+M)", refused.stderr)
    if not found:
        raise Failure(WORLD, f"{refused.stderr.strip()}: names no limit")
    return found.group(1)


def measure(program, path, max_error):
    """Encodes complete layers, then strips of one row of bricks, where marks are computed again: the difference is the
    time of marks, including the reading of their samples."""
    with tempfile.TemporaryDirectory() as directory:
        file, facts, samples = (Path(directory) / name for name in ("a.tag", "facts.json", "a.raw"))
        encode = [program, "encode", path, "-o", file, "-f", "-T", 1, "--max-error", max_error]
        whole = seconds_of(encode + ["-M", "1G", "--json", facts])
        strips = seconds_of(encode + ["-M", smallest_memory(encode)])
        decode = seconds_of([program, "decode", file, "-o", samples, "-f", "-T", 1])
        reported = json.loads(facts.read_text())
        volume = Volume(tuple(reported["dims"]), SAMPLE_BYTES[reported["type"]])
        bits = 8 * file.stat().st_size / volume.samples
    _, marked_again, _ = volume.work(volume.whole(), 1)
    marks = 1e9 * (strips - whole) / (marked_again - volume.samples)
    return {"source": f"{Path(path).name}, E = {max_error}, {processor()}",
            "rates": {"marks": marks, "encode": 1e9 * whole / volume.samples - marks,
                      "decode": 1e9 * decode / volume.samples, "bits": bits}}
