"""The half of the library that reads, as a library of its own: what it exports, and where its programs for Windows run."""

import contextlib
import pathlib
import re
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
WINE = shutil.which("wine") or shutil.which("wine64")
# Debian's wine64 alone has its loader here.
if WINE is None and pathlib.Path("/usr/lib/wine/wine64").exists():
    WINE = "/usr/lib/wine/wine64"


@contextlib.contextmanager
def wine_kept_running(program):
    """Wine's own processes, until the end of the block. If a command had to start them, they would keep its pipes open, and
    whoever reads the pipes would wait for them."""
    server = shutil.which("wineserver") or pathlib.Path(WINE).with_name("wineserver")
    subprocess.run([server, "-p"], check=True)
    try:
        subprocess.run([WINE, program, "--version"], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
        yield
    finally:
        subprocess.run([server, "-k"], check=False)


def exported():
    """The names that its headers declare, and nothing else."""
    header = (ROOT / "include/tagrid/tagrid_blocks.h").read_text()
    declared = set(re.findall(r"^TAGRID_API [^(]*\b(tagrid_\w+)\(", header, re.MULTILINE))
    return declared | {"tagrid_version", "tagrid_status_text", "tagrid_info_init_sized"}
