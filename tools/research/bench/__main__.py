"""Compares tagrid with other codecs on any volumes. See --help, and docs/dev/benchmarks.md."""

import os
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

from running import Parser, main, numbers, positive


def command_line():
    parser = Parser(__doc__, prog="tools/research/bench", epilog="Volumes are never changed.")
    parser.add_argument("volumes", nargs="+", metavar="VOLUME", help="NRRD file (.nhdr, .nrrd), raw, 8 or 16 bits")
    parser.add_argument("--errors", type=numbers, metavar="E,E,...",
                        help="bounds of the largest error; default 0,1,2,4,8 (8 bits) or 0,2,5,10,20,50 (16 bits)")
    parser.add_argument("--repetitions", type=positive, default=3, metavar="N",
                        help="number of runs, of which the median counts (3); JPEG XL has one")
    parser.add_argument("--codecs", metavar="NAME,NAME,...", help="use only these (docs/dev/benchmarks.md lists them); default: all that are installed")
    parser.add_argument("--threads", type=positive, default=len(os.sched_getaffinity(0)), metavar="N",
                        help="threads, in addition to one; default: all processors that the process may run on")
    parser.add_argument("--output", type=Path, default=Path("benchmark"), metavar="DIRECTORY",
                        help="where results.json, results.md and the plots go (benchmark)")
    parser.add_argument("--document", type=Path, metavar="FILE",
                        help="also put the summary into FILE, between its marks, and the rest into a directory beside it")
    parser.add_argument("--temporary", type=Path, metavar="DIRECTORY",
                        help="for intermediate files, which are removed; default /dev/shm where it is large enough")
    return parser.parse_args()


def run():
    options = command_line()
    import measured  # which needs NumPy, as --help does not

    measured.run(options)


main("bench", run)
