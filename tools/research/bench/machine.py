"""The machine and the program of a run."""

import datetime
import os
import re
from pathlib import Path

from failure import Failure
from measuring import output_of


def processor():
    found = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return found.group(1) if found else os.uname().machine


def build_of(tagrid):
    """Build type and compiler, from the build folder in which the program lies."""
    cache = tagrid.parent / "CMakeCache.txt"
    if not cache.exists():
        return "unknown"
    entries = dict(re.findall(r"^(CMAKE_BUILD_TYPE|CMAKE_CXX_COMPILER):\w+=(.*)$", cache.read_text(), re.MULTILINE))
    try:
        compiler = output_of(entries["CMAKE_CXX_COMPILER"], "--version").split("\n")[0]
    except (KeyError, Failure, OSError):
        compiler = "unknown compiler"
    return f"{entries.get('CMAKE_BUILD_TYPE') or 'no build type'}, {compiler}"


def commit_of(sources):
    try:
        return output_of("git", "-C", sources, "describe", "--always", "--dirty", "--tags").strip()
    except (Failure, OSError):
        return "unknown"


def file_system_of(folder):
    try:
        return output_of("stat", "-f", "-c", "%T", folder).strip()
    except Failure:
        return "unknown"


def describe(tagrid, sources, threads, temporary):
    return {
        "date": datetime.date.today().isoformat(),
        "processor": processor(),
        "processors": os.cpu_count(),
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1),
        "system": f"{os.uname().sysname} {os.uname().release}",
        "build": build_of(tagrid),
        "commit": commit_of(sources),
        "threads": threads,
        "file_system": file_system_of(temporary),
        "load_before": os.getloadavg()[0],
    }
