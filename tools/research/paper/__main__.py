"""The paper's figures, table and claims, reproduced with the program. See --help."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

from running import SOURCES, WORLD, Failure, Parser, checked, main, say

TITLE = "Tetrahedral Adaptive Grid for Parallel Hierarchical Tetrahedrization: the paper, and what tagrid makes of it"


def command_line():
    parser = Parser(__doc__, prog="tools/research/paper")
    parser.add_argument("-o", "--output", type=Path, default=Path("paper-report"), metavar="DIRECTORY",
                        help="where index.html, results.json and the pictures go (paper-report)")
    parser.add_argument("--data", type=Path, default=SOURCES.parent / "shared/data", metavar="DIRECTORY",
                        help="where lobster_321x321x33.nhdr and foot_161x321x129.nhdr are; phantoms replace a missing one")
    parser.add_argument("--quick", action="store_true", help="small phantoms and small pictures: everything in seconds")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="chooses the phantoms (1)")
    return parser.parse_args()


@contextlib.contextmanager
def display():
    """An X server in memory, on a free number: Debian's VTK draws through one, and a report needs no screen."""
    if not shutil.which("Xvfb"):
        raise Failure(WORLD, "Xvfb is not installed (Debian: xvfb)")
    reading, writing = os.pipe()
    # VTK aborts this process if a display fails; the server must not stay.
    command = ["setpriv", "--pdeathsig", "TERM", "Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24",
               "-nolisten", "tcp", "-noreset"]
    with subprocess.Popen(command, pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as server:
        os.close(writing)
        try:
            with open(reading) as number:
                os.environ["DISPLAY"] = f":{number.readline().strip()}"
            if os.environ["DISPLAY"] == ":":
                raise Failure(WORLD, f"Xvfb does not start: {server.stderr.read().strip()}")
            yield
        finally:
            server.terminate()


def about(volumes):
    """What the report was made from."""
    yield ("Figures and numbers of the paper are those of its text; the words here are ours. Everything else was made by this "
           "program when the report was written.")
    for volume in volumes:
        size, name = " x ".join(map(str, volume.dims)), volume.name.capitalize()
        if volume.is_real:
            yield f"{name}: {volume.path.name}, {size}, resampled by us to the paper's size."
        else:
            yield (f"{name}: the paper's volume is missing, and a phantom of {size} samples replaces it. "
                   "Its numbers cannot be compared with the paper's.")


def run():
    options = command_line()
    tagrid = checked(options.tagrid)
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
    from report import Report
    from study import FOOT, LOBSTER, Study, Tagrid, find

    options.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="tagrid-paper-") as directory, display():
        directory = Path(directory)
        tagrid = Tagrid(tagrid, directory)
        volumes = [find(wanted, options.data, tagrid, options.quick, options.seed) for wanted in (LOBSTER, FOOT)]
        report = Report(options.output, TITLE, list(about(volumes)))
        study = Study(tagrid, directory, *volumes, options.quick)
        for chapter in (primitives, orientation, cracks, region, criterion, grids, discontinuities, invariance, speed):
            start = time.monotonic()
            chapter.add_to(report, study)
            say(f"{chapter.__name__}: {time.monotonic() - start:.1f} s")
        report.write()
    say(f"{options.output / 'index.html'} is written")


main("paper", run)
