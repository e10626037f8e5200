#!/usr/bin/env python3
"""Plots the time of an encoding against the number of processes, for runs limited to some levels of the grid.

Figs. 19 and 20 of "Tetrahedral Adaptive Grid for Parallel Hierarchical Tetrahedrization" show the same for a PC
cluster. Every run is `mpirun -n N tagrid-mpi encode VOLUME --grid-only --max-level L -T 1`; medians are drawn.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

from markdown import Document, table
from running import SOURCES, WORLD, Failure, main, numbers, usage_of

MARKS = "<!-- tools/research/speedup.py begins -->", "<!-- tools/research/speedup.py ends -->"


def command_line():
    cores = len(os.sched_getaffinity(0))
    parser = argparse.ArgumentParser(prog="tools/research/speedup.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("volume", help="any volume that tagrid reads")
    parser.add_argument("--processes", type=numbers, default=list(range(1, cores + 1)), metavar="N,N,...",
                        help="default: 1 to the number of cores")
    parser.add_argument("--levels", type=numbers, default=[6, 9, 15], metavar="L,L,...", help="levels of the grid (6,9,15)")
    parser.add_argument("--repetitions", type=int, default=5, metavar="N", help="runs of each kind (5)")
    parser.add_argument("--tagrid-mpi", type=Path, default=SOURCES / "build/release/tagrid-mpi", metavar="PROGRAM")
    parser.add_argument("--plot", type=Path, metavar="FILE.svg", help="draw a plot with gnuplot")
    parser.add_argument("--document", type=Path, metavar="FILE", help="put the table between its marks")
    return parser.parse_args()


def seconds_of(options, processes, level, directory):
    command = ("mpirun", "-n", processes, "--oversubscribe", options.tagrid_mpi, "encode", options.volume,
               "-o", Path(directory) / "grid.tag", "-f", "--grid-only", "--lead", 0, "--max-level", level, "-T", 1, "-q")
    return statistics.median(usage_of(*command).wall for _ in range(options.repetitions))


def table_of(options, times):
    head = [head for level in options.levels for head in (f"level {level}: s", "speed-up")]
    first = options.processes[0]
    rows = [[n, *(cell for level in options.levels
                  for cell in (f"{times[n, level]:.3f}", f"{times[first, level] / times[n, level]:.2f}"))]
            for n in options.processes]
    return table(["processes", *head], rows)


def draw(options, times):
    data = "\n".join(" ".join([str(n)] + [f"{times[n, level]:.6f}" for level in options.levels])
                     for n in options.processes)
    curves = [f"$d using 1:{i + 2} with linespoints lw 2 pt 7 title 'level {level}'"
              for i, level in enumerate(options.levels)]
    # The time if the work were shared without loss.
    curves += [f"$d using 1:({times[options.processes[0], level] * options.processes[0]}/$1) with lines dt 2 lc rgb "
               f"'gray' {'title' if i == 0 else 'notitle'} 'shared without loss'"
               for i, level in enumerate(options.levels)]
    script = (f"set terminal svg size 640,420\nset output '{options.plot}'\n$d << EOD\n{data}\nEOD\n"
              f"set title '{Path(options.volume).stem}' noenhanced\nset xlabel 'processes'\nset ylabel 'seconds'\n"
              f"set yrange [0:]\nset xtics 1\nset key top right\nplot {', '.join(curves)}\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)


def run():
    options = command_line()
    document = Document(options.document, *MARKS) if options.document else None
    for program in ["mpirun"] + (["gnuplot"] if options.plot else []):
        if not shutil.which(program):
            raise Failure(WORLD, f"{program} is not installed")
    with tempfile.TemporaryDirectory() as directory:
        times = {(n, level): seconds_of(options, n, level, directory) for level in options.levels for n in options.processes}
    text = table_of(options, times)
    print(text, end="")
    if options.plot:
        draw(options, times)
    if document:
        document.replace(text)


if __name__ == "__main__":
    main("speedup.py", run)
