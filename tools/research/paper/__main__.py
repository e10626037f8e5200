"""The paper's figures, table and claims, made again by the program. See --help."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True

from failure import USAGE, WORLD, Failure

SOURCES = Path(__file__).resolve().parents[3]
TITLE = "Tetrahedral Adaptive Grid for Parallel Hierarchical Tetrahedrization: the paper, and what tagrid makes of it"


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise Failure(USAGE, f"{message}; see --help")


def command_line(arguments):
    parser = Parser(prog="tools/research/paper", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("paper-report"), metavar="FOLDER",
                        help="where index.html, results.json and the pictures go (paper-report)")
    parser.add_argument("--data", type=Path, default=SOURCES.parent / "shared/data", metavar="FOLDER",
                        help="where lobster_321x321x33.nhdr and foot_161x321x129.nhdr are; phantoms stand in for a missing one")
    parser.add_argument("--quick", action="store_true", help="small phantoms and small pictures: a look at everything in seconds")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="chooses the phantoms (1)")
    parser.add_argument("--tagrid", type=Path, default=SOURCES / "build/release/tagrid", metavar="PROGRAM",
                        help="default: build/release/tagrid of these sources; tagrid-mpi is looked for beside it")
    return parser.parse_args(arguments)


def about(study):
    """What the report was made from."""
    lines = ["Figures and numbers of the paper are those of its text; the words here are ours. Everything else was made by this "
             "program when the report was written."]
    for volume in (study.lobster, study.foot):
        size = " x ".join(map(str, volume.dims))
        lines.append(f"{volume.name.capitalize()}: {volume.path.name}, {size}, resampled by us to the paper's size." if volume.is_real else
                     f"{volume.name.capitalize()}: the paper's volume is not here, and a phantom of {size} samples stands in "
                     "for it. "
                     "Its numbers cannot be compared with the paper's.")
    return lines


def run(arguments):
    options = command_line(arguments)
    if not options.tagrid.is_file():
        raise Failure(WORLD, f"{options.tagrid}: no such program; build it, or name it with --tagrid")
    # After --help and mistakes, since VTK takes a second.
    import criterion
    import cracks
    import discontinuities
    import grids
    import invariance
    import orientation
    import primitives
    import region
    import speed
    import volumes
    from display import display
    from program import Tagrid
    from report import Report
    from study import Study

    options.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="tagrid-paper-") as folder, display():
        folder = Path(folder)
        tagrid = Tagrid(options.tagrid.resolve(), folder)
        found = [volumes.find(wanted, options.data, folder, tagrid, options.quick,
                              options.seed) for wanted in (volumes.LOBSTER, volumes.FOOT)]
        report = Report(options.output, TITLE)
        study = Study(tagrid, report, folder, *found, options.quick)
        report.about(about(study))
        for chapter in (primitives, orientation, cracks, region, criterion, grids, discontinuities, invariance, speed):
            start = time.monotonic()
            chapter.add_to(report, study)
            say(f"{chapter.__name__}: {time.monotonic() - start:.1f} s")
        report.write()
    say(f"{options.output / 'index.html'} is written")


def say(text):
    print(text, file=sys.stderr, flush=True)


def main():
    try:
        run(sys.argv[1:])
    except Failure as failure:
        say(f"tools/research/paper: {failure}")
        return failure.code
    except OSError as error:
        say(f"tools/research/paper: {error.filename}: {error.strerror}" if error.filename else f"tools/research/paper: {error}")
        return WORLD
    except KeyboardInterrupt:
        return 130
    return 0


sys.exit(main())
