"""The code of docs/python.md works as it is shown, and so do the examples of docstrings."""

import contextlib
import doctest
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import tagrid

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TESTS / "support"), str(TESTS / "tools" / "commands")]
from versions import has_zarr_3
from web_server import WebServer

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.path.abspath(sys.argv[1])
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


class Tour(unittest.TestCase):
    def test_the_code_of_the_document_runs(self):
        # The example of README.md comes first.
        text = (ROOT / "README.md").read_text().split("## What it is not for")[0] + (ROOT / "docs/python.md").read_text()
        names, said = {}, io.StringIO()
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), WebServer({}) as server:
            subprocess.run([PROGRAM, "phantom", "--dims", "160,160,96", "-q", "-o", "p.nhdr"], check=True)
            subprocess.run([PROGRAM, "encode", "p.nhdr", "--max-error", "5", "-q", "-o", "scan.tag"], check=True)
            server.files["/scan.tag"] = pathlib.Path("scan.tag").read_bytes()
            for match in BLOCK.finditer(text):
                line = text[:match.start()].count("\n") + 2  # in both documents
                code = match[1].replace("http://localhost:8000", server.url)
                # Without installing there are no entry points.
                code = code.replace('engine="tagrid"', "engine=__import__('tagrid.xarray').xarray.TagridBackend")
                if has_zarr_3():  # as the document says
                    code = code.replace("compressor=", "zarr_format=2, compressor=")
                packages = set(re.findall(r"^(?:import|from) (\w+)", code, re.MULTILINE))
                if not all(map(importable, packages)):
                    continue
                with self.subTest(line=line), contextlib.redirect_stdout(said):
                    exec(compile("\n" * (line - 1) + code, "docs/python.md", "exec"), names)
        self.assertIn("<tagrid.Volume 'scan.tag' (96, 160, 160) int16, max_error 5>", said.getvalue())
        self.assertIn("(21, 90, 100)", said.getvalue())
        self.assertIn("100 %", said.getvalue())
        np.testing.assert_array_equal(names["everything"][48], names["slice_"])
        np.testing.assert_array_equal(names["box"], names["everything"][40:60, 10:74, 10:74])
        # The header and the index, and one brick.
        self.assertLess(len(server.requests), 8)

    def test_examples_of_docstrings_say_the_truth(self):
        failed, tried = doctest.testmod(tagrid)
        self.assertEqual(failed, 0)
        self.assertGreater(tried, 6)

    def test_everything_public_is_described(self):
        for name in tagrid.__all__:
            thing = getattr(tagrid, name)
            self.assertTrue(thing.__doc__, name)
            for member, value in vars(thing).items() if isinstance(thing, type) else ():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    self.assertTrue(value.__doc__, f"{name}.{member}")


def importable(name):
    try:
        __import__(name)
        return True
    except ImportError:
        return False


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
