"""Figs. 19 and 20: computing time against the number of processes. Claim 10."""

import json
import os
import shutil
import statistics
import subprocess
import sys
import time

import drawing
from report import FAILS, HOLDS, PARTLY, UNKNOWN

LEVELS = {6: "fig-19", 9: "fig-20", 15: "speed-15"}
GOOD = 0.6  # speed-up divided by the number of processes
FREE = 0.9  # the part of the cores that must be free for a judgement


def add_to(report, study):
    report.section("Computing time (Figs. 19, 20)")
    cores = len(os.sched_getaffinity(0))
    processes = list(range(1, max(2, min(cores, 16)) + 1)) if not study.quick else [1, 2]
    mpi = study.tagrid.program.with_name("tagrid-mpi")
    uses_mpi = mpi.is_file() and shutil.which("mpirun") is not None
    what = "processes" if uses_mpi else "threads"
    free = free_cores(cores)

    def times_of(path, times_each):
        times = {}
        for level in LEVELS:
            for n in processes:
                command = ["mpirun", "-n", n, "--oversubscribe", mpi] if uses_mpi else None
                times[level, n] = measured(study, path, level, command, 1 if uses_mpi else n, times_each)
        return times

    times = times_of(study.foot.path, repetitions(study))
    # The foot takes a tenth of a second today.
    large = study.tagrid.directory / "large.nrrd"
    edge = 64 if study.quick else 512
    try:
        study.tagrid.run("phantom", "--dims", f"{edge},{edge},{edge}", "-q", "-f", "-o", large)
        free = min(free, free_cores(cores))
        times_of_large = times_of(large, min(3, repetitions(study)))
    finally:
        large.unlink(missing_ok=True)
    for level, name in LEVELS.items():
        number = f"Fig. {name[-2:]}: c" if name.startswith("fig") else "C"
        report.figure(name, f"{number}omputing time against the number of {what}, level {level}",
                      plot(study, times, level, processes, what),
                      f"The foot; limited runs, the median of {repetitions(study)}. Blue: the run itself. Grey: with the "
                      f"start of the program{' and of MPI' if uses_mpi else ''}. Dashed: the time of one, shared without "
                      "loss.")
    report.table(f"The {study.foot.name}, {study.foot.path.name}: seconds of the run itself (with the start of the program)",
                 [what, *(f"level {level}" for level in LEVELS)],
                 rows(times, processes))
    report.table(f"A phantom of {edge} x {edge} x {edge} samples (tagrid phantom), likewise",
                 [what, *(f"level {level}" for level in LEVELS)], rows(times_of_large, processes))
    claim(report, times, times_of_large, processes, what, cores, free)


def rows(times, processes):
    return [(n, *(f"{times[level, n][0]:.3f} ({times[level, n][1]:.3f})" for level in LEVELS)) for n in processes]


def free_cores(cores):
    """How many cores other programs leave: the processor time that as many busy processes get in a moment."""
    busy = "import time\nwhile time.monotonic() < {}: pass\nprint(time.process_time())"
    start = time.monotonic()
    end = start + 0.5
    begun = [subprocess.Popen([sys.executable, "-c", busy.format(end)], stdout=subprocess.PIPE, text=True) for _ in range(cores)]
    return sum(float(process.communicate()[0]) for process in begun) / (time.monotonic() - start)


def repetitions(study):
    return 1 if study.quick else 5


def measured(study, path, level, command, threads, times_each):
    """Median seconds of the run as the program measures them, and of the entire process."""
    runs, wholes = [], []
    for _ in range(times_each):
        start = time.monotonic()
        words = ["encode", path, "--grid-only", "--lead", 0, "--max-level", level, "-T", threads, "-q", "-f", "--json", "-",
                 "-o", study.tagrid.directory / "speed.tag"]
        runs.append(json.loads(study.tagrid.run(*words, program=command))["seconds"])
        wholes.append(time.monotonic() - start)
    return statistics.median(runs), statistics.median(wholes)


def plot(study, times, level, processes, what):
    top = max(max(times[level, n]) for n in processes)
    step = next(step for step in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if top / step <= 8)
    ticks = [step * i for i in range(int(top / step) + 2)]
    figure = drawing.Drawing(study.pixels(620), study.pixels(380), (processes[0] - 0.2, 0), (processes[-1] + 0.2, ticks[-1]), 60)
    figure.axes(processes, ticks, what, "seconds")
    first = times[level, processes[0]][0] * processes[0]
    for begin in range(0, 40, 2):
        places = [processes[0] + (processes[-1] - processes[0]) * i / 40 for i in (begin, begin + 1)]
        figure.line([(n, first / n) for n in places], drawing.ORANGE, 1.5)
    for part, color in ((1, drawing.FAINT), (0, drawing.BLUE)):
        figure.line([(n, times[level, n][part]) for n in processes], color, 2.5)
        for n in processes:
            figure.dot((n, times[level, n][part]), color)
    return figure.picture()


def claim(report, times, times_of_large, processes, what, cores, free):
    first, last = processes[0], processes[-1]

    def gains(of):
        return {level: of[level, first][0] / of[level, last][0] for level in LEVELS}

    foot, large = gains(times), gains(times_of_large)
    if cores < 2 or free < FREE * cores:
        verdict = UNKNOWN
    elif min(large.values()) >= GOOD * min(last, cores):
        verdict = HOLDS
    else:
        verdict = PARTLY if max(large.values()) > 1 else FAILS
    report.claim(10, "grids are made faster with more processors", verdict,
                 "This machine has {cores} cores, of which other programs left {free:.1f} just before times were measured. On the "
                 "phantom, by which this is judged, {last} {what} are {six:.2f} times as fast as one at level 6, {nine:.2f} times "
                 "at level 9 and {fifteen:.2f} times at level 15, the start of the program left out. The foot is small for today's "
                 "processors: {foot_six:.2f}, {foot_nine:.2f} and {foot_fifteen:.2f} times. With one of them, a run on the "
                 "foot from start to end takes {whole_six:.3f} s at level 6, {outside_six:.3f} s of them to start and to end; at level 9 "
                 "{whole_nine:.3f} s and {outside_nine:.3f} s.",
                 cores=cores, free=free, last=last, what=what, six=large[6], nine=large[9], fifteen=large[15],
                 foot_six=foot[6], foot_nine=foot[9], foot_fifteen=foot[15], whole_six=times[6, first][1],
                 whole_nine=times[9, first][1], outside_six=times[6, first][1] - times[6, first][0],
                 outside_nine=times[9, first][1] - times[9, first][0])
