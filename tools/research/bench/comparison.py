"""The comparison itself: every codec on every volume at every bound, in one run."""

import json
import math
import shlex
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

import numpy

from codec import Work
from running import WORLD, Failure, last_line, say

MOST_SETTINGS = 8  # number of settings that a codec may try


def judge(samples, decoded):
    """The largest error and the root mean square error of decoded samples."""
    if decoded.size != samples.size:
        raise Failure(WORLD, f"{decoded.size} samples were decoded, not {samples.size}")
    largest = squares = 0
    for one, other in zip(samples, decoded.reshape(samples.shape)):
        errors = numpy.abs(one.astype("i8") - other)
        largest = max(largest, int(errors.max()))
        squares += int((errors * errors).sum())
    return largest, math.sqrt(squares / samples.size)


def median_of(usages):
    return {part: statistics.median(usage[part] for usage in usages) for part in ("wall", "cpu", "peak_mb")}


class Comparison:
    """Runs codecs and collects rows. `measure`: the program that measures; `notes`: remarks for the reader."""

    def __init__(self, measure, codecs, threads, repetitions):
        if not measure.exists():
            raise Failure(WORLD, f"{measure} is missing: build with -DTAGRID_BENCHMARKS=ON")
        self.program, self.codecs = measure, codecs
        self.thread_counts = sorted({1, threads})
        self.repetitions = repetitions
        self.rows, self.concurrency, self.notes = [], [], []

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)
            say(text)

    def measure(self, command, directory):
        """Runs a command, a list or a line for the shell. Seconds by the clock and of the processors, and the resident
        memory of the largest process, in MB (10^6)."""
        arguments = ["sh", "-c", command] if isinstance(command, str) else [str(a) for a in command]
        result = directory / "usage.json"
        run = subprocess.run([self.program, result, *arguments], cwd=directory, stdin=subprocess.DEVNULL,
                             stderr=subprocess.PIPE, text=True, errors="replace")
        usage = json.loads(result.read_text()) if run.returncode == 0 else {"code": run.returncode}
        if usage["code"] != 0:
            raise Failure(WORLD, f"exit code {usage['code']} of: {shlex.join(arguments)}: {last_line(run.stderr)}")
        return {"wall": usage["wall"], "cpu": usage["user"] + usage["system"], "peak_mb": usage["peak_kb"] * 1024 / 1e6}

    def volume(self, volume, bounds, parent):
        """Compares on one volume, in a temporary directory in `parent`."""
        with tempfile.TemporaryDirectory(prefix=f"{volume.name}-", dir=parent) as name:
            samples = volume.samples()
            work = Work(volume, Path(name), int(samples.min()), int(samples.max()))
            for codec in self.codecs:
                (work.directory / codec.name).mkdir()
            for bound in bounds:
                self.bound(work, bound)
            self.threads_and_processes(work, next((bound for bound in bounds if bound > 0), bounds[0]))

    def bound(self, work, bound):
        """Runs all codecs at one bound. Each repetition runs all codecs in turn, so that a machine that slows down
        affects all of them."""
        taking_part, psnr = [], None
        for codec in self.codecs:
            row = self.first(work, codec, bound, psnr)
            if row is not None:
                taking_part.append((codec, row))
                if codec.name == "tagrid":
                    psnr = row["psnr"]
        for repetition in range(self.repetitions):
            for codec, row in taking_part:
                for threads in self.thread_counts:
                    known = row["usages"].setdefault(threads, {})
                    if not (known if repetition == 0 else codec.slow):
                        self.once(work, codec, row["setting"], threads, known)
        for codec, row in taking_part:
            usages = row.pop("usages")
            row["runs"] = {threads: {step: median_of(runs) for step, runs in steps.items()}
                           for threads, steps in usages.items() if steps}
            row["repetitions"] = len(usages[1]["encode"])
            self.rows.append(row)

    def once(self, work, codec, setting, threads, known):
        """Encodes and decodes, unless the codec does not use that many threads."""
        for step, command, in_parallel in (("encode", codec.encode, codec.encodes_in_parallel),
                                           ("decode", codec.decode, codec.decodes_in_parallel)):
            if threads == 1 or in_parallel:
                usage = self.measure(command(work, setting, threads), work.directory / codec.name)
                known.setdefault(step, []).append(usage)

    def first(self, work, codec, bound, psnr):
        """The first run of a codec at a bound, with a suitable setting; None if it cannot take part. The error is
        measured between the volume and the decoded file."""
        refusal = codec.refusal(work, bound)
        if not codec.keeps_bounds and psnr is None:
            refusal = refusal or "needs the PSNR of tagrid"
        if refusal:
            self.note(f"{codec.name}: {refusal}")
            return None
        name = work.volume.name
        try:
            codec.prepare(work, work.directory / codec.name)
            setting = codec.first_setting(bound, psnr)
            for _ in range(MOST_SETTINGS):
                usages = {}
                self.once(work, codec, setting, 1, usages)
                row = self.row_of(work, codec, bound, setting) | {"usages": {1: usages}}
                setting = codec.next_setting(row, psnr)
                if setting is None:
                    break
        except Failure as failure:
            self.note(f"{codec.name} failed on {name} at E = {bound}: {failure}")
            return None
        if codec.keeps_bounds and not row["kept"]:
            self.note(f"{codec.name} does not keep E = {bound} on {name}: "
                      f"largest error {row['max_error']} at its tightest setting")
        say(f"{name}, E = {bound}, {codec.name}: {row['bits']:.4f} bits per voxel, largest error {row['max_error']}")
        return row

    def row_of(self, work, codec, bound, setting):
        volume, directory = work.volume, work.directory / codec.name
        largest, rmse = judge(volume.samples(), codec.decoded(work, directory))
        size, peak = codec.size(directory), work.high - work.low
        return {
            "volume": volume.name, "codec": codec.name, "bound": bound, "setting": setting, "bytes": size,
            "bits": 8 * size / volume.voxels,
            "bits_of_parts": {part: 8 * count / volume.voxels for part, count in codec.parts(directory).items()},
            "max_error": largest, "rmse": rmse, "kept": largest <= bound,
            "psnr": 20 * math.log10(peak / rmse) if rmse and peak else None,
        }

    def threads_and_processes(self, work, bound):
        """tagrid on n threads, against n processes of one thread at the same time: voxels per second of the first over
        those of all of the second."""
        threads, tagrid = self.thread_counts[-1], next((c for c in self.codecs if c.name == "tagrid"), None)
        if threads == 1 or tagrid is None:
            return
        directory = work.directory / "at_once"
        copies = [directory / str(i) for i in range(threads)]
        for copy in copies:
            copy.mkdir(parents=True)
        row = {"volume": work.volume.name, "bound": bound, "threads": threads}
        for step, command in (("encode", tagrid.encode), ("decode", tagrid.decode)):
            together, apart = [], []
            for _ in range(self.repetitions):
                together.append(self.measure(command(work, bound, threads), copies[0])["wall"])
                if step == "encode":
                    for copy in copies[1:]:
                        shutil.copy(copies[0] / "coded", copy / "coded")
                apart.append(self.measure(at_once(command(work, bound, 1), copies), directory)["wall"])
            one, all_of_them = statistics.median(together), statistics.median(apart)
            row[step] = {"threads_wall": one, "processes_wall": all_of_them, "ratio": all_of_them / (threads * one)}
        self.concurrency.append(row)


def at_once(command, directories):
    """A line for the shell that runs a command in several directories at the same time."""
    words = shlex.join(str(word) for word in command)
    started = " ".join(f"(cd {shlex.quote(str(directory))} && exec {words}) & p{i}=$!;"
                       for i, directory in enumerate(directories))
    return started + " " + " && ".join(f"wait $p{i}" for i in range(len(directories)))
