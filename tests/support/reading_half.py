"""The half of the library that reads, as a library of its own: what it exports, and where its programs for Windows run."""

import pathlib
import re
import shutil

ROOT = pathlib.Path(__file__).resolve().parents[2]
WINE = shutil.which("wine") or shutil.which("wine64")
# Debian's wine64 alone has its loader here.
if WINE is None and pathlib.Path("/usr/lib/wine/wine64").exists():
    WINE = "/usr/lib/wine/wine64"


def exported():
    """The names that its headers declare, and nothing else."""
    header = (ROOT / "include/tagrid/tagrid_blocks.h").read_text()
    declared = set(re.findall(r"^TAGRID_API .*\b(tagrid_\w+)\(", header, re.MULTILINE))
    return declared | {"tagrid_version", "tagrid_status_text", "tagrid_info_init_sized"}
