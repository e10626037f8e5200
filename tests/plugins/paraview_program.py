"""ParaView's Python, installed or unpacked."""

import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def pvpython(unpacked):
    """The program and "", or None and the reason why there is none. It is unpacked into a directory if it is not installed."""
    installed = shutil.which("pvpython")
    if installed:
        return installed, ""
    if not shutil.which("apt-get"):
        return None, "there is no pvpython, and no apt-get to download it"
    done = subprocess.run([ROOT / "tools/research/unpack_paraview.sh", unpacked], text=True, capture_output=True)
    if done.returncode != 0:
        said = (done.stderr.strip() or "no message").splitlines()[-1]
        return None, "there is no pvpython, and its packages cannot be downloaded: " + said
    return str(pathlib.Path(unpacked) / "pvpython"), ""
