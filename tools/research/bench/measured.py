"""Measures the codecs on the volumes, and writes the results."""

import json
import os
import shutil
import tempfile
import time
from pathlib import Path

import compared_codecs
import machine
import nrrd
import plots
import tables
from comparison import Comparison
from markdown import Document
from running import USAGE, WORLD, Failure, checked, say

USUAL_BOUNDS = {"uint8": (0, 1, 2, 4, 8), "int8": (0, 1, 2, 4, 8), "uint16": (0, 2, 5, 10, 20, 50), "int16": (0, 2, 5, 10, 20, 50)}
MARKS = "<!-- begin: written by tools/research/bench -->", "<!-- end: written by tools/research/bench -->"


def temporary_directory(wanted, volumes):
    """A directory in memory rather than on a disk, because codecs are compared."""
    if wanted:
        if not wanted.is_dir():
            raise Failure(WORLD, f"{wanted}: no such directory")
        return wanted.resolve()
    memory, needed = Path("/dev/shm"), 16 * max(volume.bytes for volume in volumes)
    if memory.is_dir() and os.access(memory, os.W_OK) and shutil.disk_usage(memory).free > needed:
        return memory
    return Path(tempfile.gettempdir())


def compared(options, tagrid, codecs, missing, volumes):
    """Measures everything, and returns the results as in results.json."""
    parent, start = temporary_directory(options.temporary, volumes), time.monotonic()
    results = {"machine": machine.describe(tagrid, options.threads, parent),
               "codecs": {codec.name: compared_codecs.version_of(codec) for codec in codecs}, "missing": missing,
               "volumes": {v.name: {"dims": v.dims, "type": v.type, "voxels": v.voxels} for v in volumes}}
    comparison = Comparison(tagrid.parent / "bench/bench_measure", codecs, options.threads, options.repetitions)
    with tempfile.TemporaryDirectory(prefix="tagrid-bench-", dir=parent) as directory:
        for volume in volumes:
            comparison.volume(volume, options.errors or USUAL_BOUNDS[volume.type], directory)
    if not comparison.rows:
        raise Failure(WORLD, "nothing could be measured")
    results["machine"]["load_after"] = os.getloadavg()[0]
    results["machine"]["minutes"] = round((time.monotonic() - start) / 60, 1)
    return results | {"repetitions": options.repetitions, "rows": comparison.rows, "concurrency": comparison.concurrency,
                      "notes": comparison.notes}


def run(options):
    tagrid = checked(options.tagrid)
    document = Document(options.document, *MARKS) if options.document else None
    volumes = [nrrd.read(path) for path in options.volumes]
    if len({volume.name for volume in volumes}) != len(volumes):
        raise Failure(USAGE, "two volumes have the same name")
    names = options.codecs.split(",") if options.codecs else []
    unknown = set(names) - {codec.name for codec in compared_codecs.ALL}
    if unknown:
        raise Failure(USAGE, f"unknown codec {', '.join(sorted(unknown))}; there are {', '.join(codec.name for codec in compared_codecs.ALL)}")
    codecs, missing = compared_codecs.present(names, tagrid)
    for name, reason in missing.items():
        say(f"{name} does not take part: {reason}")
    if not codecs:
        raise Failure(WORLD, "none of these codecs is installed")
    options.output.mkdir(parents=True, exist_ok=True)
    for written in filter(None, (options.output, options.document)):
        if not os.access(written, os.W_OK):  # found now rather than after all measurements
            raise Failure(WORLD, f"{written}: cannot be written to")

    text = json.dumps(compared(options, tagrid, codecs, missing, volumes), indent=1) + "\n"
    (options.output / "results.json").write_text(text)
    results = json.loads(text)
    drawn = plots.draw(results, options.output)
    (options.output / "results.md").write_text(tables.whole(results, drawn))
    if document:
        beside = options.document.with_suffix("")
        beside.mkdir(exist_ok=True)
        for name in ("results.md", *drawn):
            shutil.copy(options.output / name, beside / name)
        document.replace(tables.summary(results, drawn, beside.name + "/"))
    say(f"{options.output}: results.json, results.md, {len(drawn)} plots")
