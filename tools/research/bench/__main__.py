"""Compares tagrid with other codecs on any volumes. See --help, and docs/benchmarks.md."""

import argparse
import json
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True

import coders
import document
import machine
import plots
import tables
from comparison import USUAL_BOUNDS, Comparison
from failure import USAGE, WORLD, Failure
from measuring import Programs
from volume import BYTES, read_header

SOURCES = Path(__file__).resolve().parents[3]


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise Failure(USAGE, f"{message}; see --help")


def list_of_bounds(text):
    bounds = sorted({int(bound) for bound in text.split(",")})
    if bounds[0] < 0:
        raise ValueError
    return bounds


def positive(text):
    if int(text) < 1:
        raise ValueError
    return int(text)


def command_line(arguments):
    names = ", ".join(codec.name for codec in coders.ALL)
    parser = Parser(prog="tools/research/bench", description=__doc__, epilog=f"Codecs: {names}. Volumes are never changed.")
    parser.add_argument("volumes", nargs="+", metavar="VOLUME", help="NRRD file (.nhdr, .nrrd), raw, 8 or 16 bits")
    parser.add_argument("--errors", type=list_of_bounds, metavar="E,E,...",
                        help="bounds of the largest error; default 0,1,2,4,8 (8 bits) or 0,2,5,10,20,50 (16 bits)")
    parser.add_argument("--repetitions", type=positive, default=3, metavar="N",
                        help="number of runs, of which the median counts (3); JPEG XL has one")
    parser.add_argument("--codecs", metavar="NAME,NAME,...", help="use only these; default: all that are installed")
    parser.add_argument("--threads", type=positive, default=len(os.sched_getaffinity(0)), metavar="N",
                        help="threads, in addition to one; default: all processors that the process may run on")
    parser.add_argument("--output", type=Path, default=Path("benchmark"), metavar="FOLDER",
                        help="where results.json, results.md and the plots go (benchmark)")
    parser.add_argument("--document", type=Path, metavar="FILE",
                        help="also put the summary into FILE, between its marks, and the rest into a folder beside it")
    parser.add_argument("--temporary", type=Path, metavar="FOLDER",
                        help="for intermediate files, which are removed; default /dev/shm where it is large enough")
    parser.add_argument("--tagrid", type=Path, default=SOURCES / "build/release/tagrid", metavar="PROGRAM",
                        help="default: build/release/tagrid of these sources")
    return parser.parse_args(arguments)


def temporary_folder(wanted, volumes):
    """A folder in memory rather than on a disk, because codecs are compared."""
    if wanted:
        if not wanted.is_dir():
            raise Failure(WORLD, f"{wanted}: no such folder")
        return wanted.resolve()
    memory, needed = Path("/dev/shm"), 16 * max(volume.bytes for volume in volumes)
    if memory.is_dir() and os.access(memory, os.W_OK) and shutil.disk_usage(memory).free > needed:
        return memory
    return Path(tempfile.gettempdir())


def say(text):
    print(text, file=sys.stderr, flush=True)


def run(arguments):
    options = command_line(arguments)
    if not options.tagrid.is_file():
        raise Failure(WORLD, f"{options.tagrid}: no such program; build it, or name it with --tagrid")
    if options.document:
        document.check(options.document)
    volumes = [read_header(path) for path in options.volumes]
    if len({volume.name for volume in volumes}) != len(volumes):
        raise Failure(USAGE, "two volumes have the same name")
    programs = Programs(options.tagrid.resolve())
    names = options.codecs.split(",") if options.codecs else []
    unknown = set(names) - {codec.name for codec in coders.ALL}
    if unknown:
        raise Failure(USAGE, f"unknown codec {', '.join(sorted(unknown))}; see --help")
    taking_part, missing = coders.present(names, programs)
    for name, reason in missing.items():
        say(f"{name} does not take part: {reason}")
    if not taking_part:
        raise Failure(WORLD, "none of these codecs is installed")
    options.output.mkdir(parents=True, exist_ok=True)
    for written in filter(None, (options.output, options.document)):
        if not os.access(written, os.W_OK):  # found now rather than after all measurements
            raise Failure(WORLD, f"{written}: cannot be written to")
    parent = temporary_folder(options.temporary, volumes)

    start = time.monotonic()
    results = {"machine": machine.describe(programs.tagrid, SOURCES, options.threads, parent),
               "codecs": coders.versions(taking_part, programs), "missing": missing,
               "volumes": {v.name: {"dims": v.dims, "type": v.type, "voxels": v.voxels} for v in volumes}}
    comparison = Comparison(programs, taking_part, options.threads, options.repetitions, say)
    with tempfile.TemporaryDirectory(prefix="tagrid-bench-", dir=parent) as folder:
        for volume in volumes:
            bounds = options.errors or USUAL_BOUNDS[BYTES[volume.type]]
            comparison.volume(volume, bounds, folder)
    if not comparison.rows:
        raise Failure(WORLD, "nothing could be measured")
    results["machine"]["load_after"] = os.getloadavg()[0]
    results["machine"]["minutes"] = round((time.monotonic() - start) / 60, 1)
    results.update(repetitions=options.repetitions, rows=comparison.rows, concurrency=comparison.concurrency,
                   notes=comparison.notes)

    (options.output / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    results = json.loads((options.output / "results.json").read_text())
    drawn = plots.draw(results, options.output, say)
    (options.output / "results.md").write_text(tables.whole(results, drawn))
    if options.document:
        document.update(options.document, results, options.output, drawn)
    say(f"{options.output}: results.json, results.md, {len(drawn)} plots")


def main():
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that temporary folders are removed
    try:
        run(sys.argv[1:])
    except Failure as failure:
        say(f"tools/research/bench: {failure}")
        return failure.code
    except OSError as error:
        say(f"tools/research/bench: {error.filename}: {error.strerror}" if error.filename else f"tools/research/bench: {error}")
        return WORLD
    except KeyboardInterrupt:
        return 130
    return 0


sys.exit(main())
