"""What the tests of commands in Python share: the program, which is their argument, a directory, numpy and the second
decoder. Without numpy, a test says so and passes."""

import hashlib
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path[:0] = [str(Path(__file__).resolve().parents[2] / folder) for folder in ("format", "support")]

try:
    import numpy
except ImportError as missing:
    print(f"skipped: {missing} (python3-numpy)")
    sys.exit(0)

import decoder  # noqa: E402

__all__ = ["ProgramTest", "TAGRID", "decoder", "digests", "numpy"]

TAGRID = Path(sys.argv.pop(1)).resolve()


def digests(folder):
    """Those of all files below a directory, by name."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*")) if path.is_file()}


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def tagrid(self, *arguments, code=0, **options):
        """Runs the program in the directory of the test. It must end with this code."""
        run = subprocess.run([TAGRID, *map(str, arguments)], cwd=self.folder, capture_output=True, check=False,
                             **options)
        self.assertEqual(run.returncode, code, (arguments, run.stderr.decode(errors="replace")))
        return run

    def info(self, name):
        return json.loads(self.tagrid("info", name, "--json", "--no-levels").stdout)

    def statistics(self, name):
        """Those that --json wrote to a file."""
        return json.loads((self.folder / name).read_text())
