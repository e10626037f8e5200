"""A display in memory: Debian's VTK draws through an X server, and a report needs no screen."""

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess

from failure import WORLD, Failure


PR_SET_PDEATHSIG = 1  # of prctl(): a signal when the parent ends


def end_with_parent():
    """VTK aborts the process if a display fails; the server must not stay behind."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


@contextlib.contextmanager
def display():
    """Starts Xvfb on a free number, and stops it at the end."""
    if not shutil.which("Xvfb"):
        raise Failure(WORLD, "Xvfb is not installed (Debian: xvfb)")
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(command, pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              preexec_fn=end_with_parent)
    os.close(writing)
    before = os.environ.get("DISPLAY")
    try:
        number = os.read(reading, 20).decode().strip()
        if not number:
            raise Failure(WORLD, f"Xvfb does not start: {server.stderr.read().decode(errors='replace').strip()}")
        os.environ["DISPLAY"] = f":{number}"
        yield
    finally:
        os.close(reading)
        if before is None:
            os.environ.pop("DISPLAY", None)
        else:
            os.environ["DISPLAY"] = before
        server.terminate()
        server.wait()
        server.stderr.close()
