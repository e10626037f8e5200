"""What all measurements share: the command line, errors, and running programs."""

import argparse
import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[2]
USAGE, BROKEN_INPUT, WORLD = 64, 65, 74  # exit codes, as those of tagrid


class Failure(Exception):
    """Ends the program with one line and an exit code."""

    def __init__(self, code, text):
        super().__init__(text)
        self.code = code


class Parser(argparse.ArgumentParser):
    """A command line with the option --tagrid."""

    def __init__(self, description, **options):
        super().__init__(description=description, formatter_class=argparse.RawDescriptionHelpFormatter, **options)
        self.add_argument("--tagrid", type=Path, default=SOURCES / "build/release/tagrid", metavar="PROGRAM",
                          help="default: build/release/tagrid of these sources")

    def error(self, message):
        raise Failure(USAGE, f"{message}; see --help")


def checked(program):
    """The absolute path of a program."""
    if not program.is_file():
        raise Failure(WORLD, f"{program}: no such program; build it, or name it with --tagrid")
    return program.resolve()


def positive(text):
    if int(text) < 1:
        raise ValueError
    return int(text)


def numbers(text):
    """Numbers of at least 0, in ascending order."""
    found = sorted({int(number) for number in text.split(",")})
    if found[0] < 0:
        raise ValueError
    return found


def say(text):
    print(text, file=sys.stderr, flush=True)


def main(name, run):
    """Runs a program, and ends the process. Errors are reported in one line."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that temporary directories are removed
    code = 0
    try:
        run()
    except Failure as failure:
        say(f"tools/research/{name}: {failure}")
        code = failure.code
    except OSError as error:
        say(f"tools/research/{name}: " + (f"{error.filename}: {error.strerror}" if error.filename else str(error)))
        code = WORLD
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)


def output_of(*command):
    """Runs a command, and returns its standard output. Raises Failure if the command fails."""
    environment = dict(os.environ)
    if os.geteuid() == 0:  # as in a container; Open MPI asks for both
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    words = [str(word) for word in command]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        raise Failure(WORLD, f"exit code {done.returncode} of {' '.join(words)}: {last_line(done.stderr)}")
    return done.stdout


def last_line(text):
    return (text.strip().splitlines() or ["no message"])[-1]


@dataclass(frozen=True)
class Usage:
    """Seconds of a command: by the clock, and of the processors."""

    wall: float
    cpu: float


def usage_of(*command):
    """Runs a command, and returns its Usage."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    output_of(*command)
    wall, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Usage(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def info_of(tagrid, tag):
    """The output of `tagrid info --json`."""
    return json.loads(output_of(tagrid, "info", "--json", tag))


def processor():
    found = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return found.group(1) if found else os.uname().machine
