"""The machine and the program of a run."""

import datetime
import os
import re

from running import SOURCES, Failure, output_of, processor


def line_of(*command):
    """The first line that a command prints, or "unknown"."""
    try:
        return output_of(*command).split("\n")[0].strip()
    except (Failure, OSError):
        return "unknown"


def build_of(tagrid):
    """Build type and compiler, from the build directory in which the program lies."""
    cache = tagrid.parent / "CMakeCache.txt"
    if not cache.exists():
        return "unknown"
    entries = dict(re.findall(r"^(CMAKE_BUILD_TYPE|CMAKE_CXX_COMPILER):\w+=(.*)$", cache.read_text(), re.MULTILINE))
    compiler = line_of(entries.get("CMAKE_CXX_COMPILER", "c++"), "--version")
    return f"{entries.get('CMAKE_BUILD_TYPE') or 'no build type'}, {compiler}"


def describe(tagrid, threads, temporary):
    return {
        "date": datetime.date.today().isoformat(),
        "processor": processor(),
        "processors": os.cpu_count(),
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1),
        "system": f"{os.uname().sysname} {os.uname().release}",
        "build": build_of(tagrid),
        "commit": line_of("git", "-C", SOURCES, "describe", "--always", "--dirty", "--tags"),
        "threads": threads,
        "file_system": line_of("stat", "-f", "-c", "%T", temporary),
        "load_before": os.getloadavg()[0],
    }
