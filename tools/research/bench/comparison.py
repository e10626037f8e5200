"""The comparison itself: every codec on every volume at every bound, in one run."""

import json
import math
import shlex
import shutil
import statistics
import tempfile
from pathlib import Path

from codec import Work
from failure import Failure

MOST_SETTINGS = 8  # number of settings that a codec may try
USUAL_BOUNDS = {1: (0, 1, 2, 4, 8), 2: (0, 2, 5, 10, 20, 50)}  # by bytes per sample


def median_of(usages):
    return {part: statistics.median(getattr(usage, part) for usage in usages) for part in ("wall", "cpu", "peak_mb")}


class Comparison:
    """Runs codecs and collects rows. `say` reports progress; `notes` collects remarks for the reader."""

    def __init__(self, programs, codecs, threads, repetitions, say):
        self.programs, self.codecs, self.say = programs, codecs, say
        self.thread_counts = sorted({1, threads})
        self.repetitions = repetitions
        self.rows, self.concurrency, self.notes = [], [], []

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)
            self.say(text)

    def volume(self, volume, bounds, parent):
        """Compares on one volume, in a temporary folder in `parent`."""
        with tempfile.TemporaryDirectory(prefix=f"{volume.name}-", dir=parent) as name:
            folder = Path(name)
            volume.copy_samples(folder / "samples.raw")
            low, high = map(int, self.programs.samples("range", volume.type, folder / "samples.raw").split())
            work = Work(volume, self.programs, folder, low, high)
            for codec in self.codecs:
                (folder / codec.name).mkdir()
            for bound in bounds:
                self.bound(work, bound)
            for bound in [b for b in bounds if b > 0][:1] or bounds[:1]:
                self.threads_and_processes(work, bound)

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
                    if repetition == 0 and known or repetition > 0 and codec.slow:
                        continue
                    if threads > 1 and not (codec.encodes_in_parallel or codec.decodes_in_parallel):
                        continue
                    self.once(work, codec, row, threads, known)
        for codec, row in taking_part:
            usages = row.pop("usages")
            row["runs"] = {threads: {step: median_of(runs) for step, runs in steps.items()}
                           for threads, steps in usages.items() if steps}
            row["repetitions"] = len(usages[1]["encode"])
            self.rows.append(row)

    def once(self, work, codec, row, threads, known):
        folder = work.folder / codec.name
        if threads == 1 or codec.encodes_in_parallel:
            encoding = self.programs.measure(codec.encode(work, row["setting"], threads), folder)
            known.setdefault("encode", []).append(encoding)
        if threads == 1 or codec.decodes_in_parallel:
            decoding = self.programs.measure(codec.decode(work, row["setting"], threads), folder)
            known.setdefault("decode", []).append(decoding)

    def first(self, work, codec, bound, psnr):
        """The first run of a codec at a bound, with a suitable setting; None if it cannot take part.
        The error is measured between the volume and the decoded file."""
        refusal = codec.refusal(work, bound)
        if not codec.keeps_bounds and psnr is None:
            refusal = refusal or "needs the PSNR of tagrid"
        if refusal:
            self.note(f"{codec.name}: {refusal}")
            return None
        folder, volume = work.folder / codec.name, work.volume
        try:
            codec.prepare(work, folder)
            setting = codec.first_setting(bound, psnr)
            for _ in range(MOST_SETTINGS):
                usages = {1: {}}
                self.once(work, codec, {"setting": setting}, 1, usages[1])
                codec.finish(work, folder)
                judged = json.loads(self.programs.samples("compare", volume.type, work.samples, folder / "decoded.raw"))
                row = dict(self.row_of(work, codec, bound, setting, judged), usages=usages)
                setting = codec.next_setting(row, psnr)
                if setting is None:
                    break
        except Failure as failure:
            self.note(f"{codec.name} failed on {volume.name} at E = {bound}: {failure}")
            return None
        if codec.keeps_bounds and not row["kept"]:
            self.note(f"{codec.name} does not keep E = {bound} on {volume.name}: "
                      f"largest error {row['max_error']} at its tightest setting")
        self.say(f"{volume.name}, E = {bound}, {codec.name}: {row['bits']:.4f} bits per voxel, "
                 f"largest error {row['max_error']}")
        return row

    def row_of(self, work, codec, bound, setting, judged):
        volume, folder = work.volume, work.folder / codec.name
        size, parts = codec.size(folder), codec.parts(folder)
        peak, rmse = work.high - work.low, judged["rmse"]
        return {
            "volume": volume.name, "codec": codec.name, "bound": bound, "setting": setting, "bytes": size,
            "bits": 8 * size / volume.voxels,
            "bits_of_parts": {part: 8 * count / volume.voxels for part, count in parts.items()},
            "max_error": judged["max_error"], "rmse": rmse, "kept": judged["max_error"] <= bound,
            "psnr": 20 * math.log10(peak / rmse) if rmse and peak else None,
        }

    def threads_and_processes(self, work, bound):
        """tagrid on n threads, against n processes of one thread at the same time: voxels a second of the first over
        those of all of the second."""
        threads, tagrid = self.thread_counts[-1], next((c for c in self.codecs if c.name == "tagrid"), None)
        if threads == 1 or tagrid is None:
            return
        folder = work.folder / "at_once"
        copies = [folder / str(i) for i in range(threads)]
        for copy in copies:
            copy.mkdir(parents=True)
        row = {"volume": work.volume.name, "bound": bound, "threads": threads}
        for step, command in (("encode", tagrid.encode), ("decode", tagrid.decode)):
            together, apart = [], []
            for _ in range(self.repetitions):
                many = self.programs.measure(command(work, bound, threads), copies[0])
                if step == "encode":
                    for copy in copies[1:]:
                        shutil.copy(copies[0] / "coded", copy / "coded")
                together.append(many.wall)
                apart.append(self.programs.measure(at_once(command(work, bound, 1), copies), folder).wall)
            one, all_of_them = statistics.median(together), statistics.median(apart)
            row[step] = {"threads_wall": one, "processes_wall": all_of_them, "ratio": all_of_them / (threads * one)}
        self.concurrency.append(row)


def at_once(command, folders):
    """A line for the shell that runs a command in several folders at the same time."""
    words = shlex.join(str(word) for word in command)
    started = " ".join(f"(cd {shlex.quote(str(folder))} && exec {words}) & p{i}=$!;"
                       for i, folder in enumerate(folders))
    return started + " " + " && ".join(f"wait $p{i}" for i in range(len(folders)))
