"""The commands that documents show."""

import os
import re
import subprocess


def blocks(text):
    """The text between ``` and ```, or between .Bd and .Ed in the manual page."""
    found = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return found + re.findall(r"^\.Bd[^\n]*\n(.*?)^\.Ed", text, re.MULTILINE | re.DOTALL)


def sessions(text):
    """The blocks that are sessions, each as a list of [command, its output]."""
    for block in blocks(text):
        if not block.startswith("$ "):
            continue
        session = []
        complete = True
        for line in block.splitlines():
            if line.startswith("$ "):
                session.append([line[2:], ""])
                complete = is_complete(line[2:])
            elif not complete:
                session[-1][0] += "\n" + line
                complete = is_complete(session[-1][0])
            else:
                session[-1][1] += line + "\n"
        yield session


def is_complete(command):
    # Bash only warns of a here-document without an end.
    run = subprocess.run(["bash", "-n", "-c", command], capture_output=True, env=dict(os.environ, LC_ALL="C"))
    return run.returncode == 0 and b"here-document" not in run.stderr


def without_memory(text):
    """Removes the memory that a run took, which is different each time."""
    return re.sub(r"[\d.]+ MiB", "# MiB", text)
