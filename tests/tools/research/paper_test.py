"""Claims about tools/research/paper, on small phantoms: every figure and claim is there, pictures show something, numbers are measured.

    paper_test.py TAGRID
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
SOURCES = Path(__file__).resolve().parents[3]
PAPER = SOURCES / "tools/research/paper"
sys.path[:0] = [str(PAPER), str(PAPER.parent)]

try:
    import numpy
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
    from PIL import Image
except ImportError as missing:
    print(f"skipped: {missing} (python3-numpy, python3-pil, python3-vtk9)")
    sys.exit(0)

TAGRID = os.path.abspath(sys.argv.pop(1))
SEED = 3
FIGURES = {f"fig-{number:02}" for number in (3, 4, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 24, 25)}
FIGURES |= {"level-15", "cracks", "discontinuities", "turned", "speed-15"}
# Numbers in the text of evidence that are not measured: levels, angles.
CONSTANTS = {2.0, 3.0, 1.0, 6.0, 9.0, 15.0, 90.0, 180.0}


def paper(*arguments):
    command = [sys.executable, "-B", PAPER, "--tagrid", TAGRID, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


@unittest.skipUnless(shutil.which("Xvfb"), "Xvfb is not installed (xvfb)")
class QuickReport(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = Path(cls.temporary.name)
        cls.output = cls.folder / "report"
        done = paper("--quick", "--seed", SEED, "-o", cls.output)
        if done.returncode != 0:
            raise AssertionError(done.stderr)
        cls.results = json.loads((cls.output / "results.json").read_text())
        cls.page = (cls.output / "index.html").read_text()
        cls.claims = {claim["number"]: claim for claim in cls.results["claims"]}

    def test_every_figure_is_there(self):
        self.assertEqual(set(self.results["figures"]), FIGURES)
        for name in FIGURES:
            self.assertIn(f'<img src="{name}.png"', self.page)
        self.assertEqual({path.stem for path in self.output.glob("*.png")}, FIGURES)

    def test_every_picture_shows_something(self):
        for name in sorted(FIGURES):
            picture = Image.open(self.output / f"{name}.png").convert("RGB")
            colours = picture.getcolors(1 << 24)
            self.assertGreater(len(colours), 30, name)
            self.assertLess(max(count for count, _ in colours), 0.97 * picture.width * picture.height, name)

    def test_the_page_says_first_which_claims_do_not_hold_as_printed(self):
        self.assertEqual([self.claims[number]["verdict"] for number in (1, 2, 3, 4, 6, 9)], ["holds"] * 6)
        # The region of reference is larger than printed, wherever it is computed.
        self.assertEqual(self.claims[5]["verdict"], "holds in part")
        self.assertIn("claim 5 holds in part", self.page[: self.page.index('id="claim-1"')])

    def test_numbers_in_evidence_are_those_measured(self):
        for claim in self.claims.values():
            values = [float(value) for value in claim["numbers"].values() if not isinstance(value, str)]
            words = " ".join(value for value in claim["numbers"].values() if isinstance(value, str))
            for token in re.findall(r"(?<![\w√/.])\d[\d,]*(?:\.\d+)?(?!N)", claim["evidence"]):
                token = token.rstrip(",").replace(",", "")
                precision = 0.5000001 * 10 ** -len(token.partition(".")[2])
                known = any(abs(float(token) - value) <= precision for value in values) or re.search(rf"\b{token}\b", words)
                self.assertTrue(known or float(token) in CONSTANTS, f"claim {claim['number']}: {token}")


class Told:
    """What report.claim() is told."""

    def claim(self, number, says, verdict, evidence, **numbers):
        self.verdict = verdict
        self.evidence = evidence.format(**numbers)

    def table(self, *_):
        pass


class Altered:
    """A study whose meshes are altered before they are looked at."""

    def __init__(self, study, alter):
        self.tagrid, self._tagrid, self._alter = self, study, alter

    def mesh(self, *arguments, **options):
        return self._alter(self._tagrid.mesh(*arguments, **options))


class Contradictions(unittest.TestCase):
    """What is contrary to a claim is found."""

    @classmethod
    def setUpClass(cls):
        import primitives
        from study import Tagrid

        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.tagrid, cls.directory = Tagrid(Path(TAGRID), Path(cls.temporary.name)), Path(cls.temporary.name)
        cls.tag = primitives.uniform_grid(cls)

    def verdict(self, claim, alter=lambda mesh: mesh):
        told = Told()
        claim(told, Altered(self.tagrid, alter), self.tag)
        return told.verdict

    def test_claims_about_primitives_fail_for_other_meshes(self):
        import dataclasses

        import primitives

        def moved(mesh):
            points = mesh.points.copy()
            points[len(points) // 2] += (0, 0, 0.25)
            return dataclasses.replace(mesh, points=points)

        def without_one(mesh):
            return mesh.part(numpy.arange(len(mesh.tetrahedra)) != len(mesh.tetrahedra) // 2)

        for claim, alter in ((primitives.claim_roots, without_one), (primitives.claim_roots, moved),
                             (primitives.claim_primitives, moved),
                             (primitives.claim_diamonds, without_one)):
            self.assertEqual(self.verdict(claim), "holds")
            self.assertEqual(self.verdict(claim, alter), "does not hold", claim.__name__)

    def test_a_crack_is_found(self):
        from cracks import refined_apart
        from mesh import conformity

        coarse, fine = self.tagrid.mesh(self.tag, level=1), self.tagrid.mesh(self.tag, level=3)
        self.assertTrue(conformity(coarse).holds and conformity(fine).holds)
        apart = conformity(refined_apart(coarse, fine, 8))
        self.assertFalse(apart.holds)
        self.assertGreater(apart.cracks, 0)
        self.assertEqual(apart.missing_volume, 0)


if __name__ == "__main__":
    unittest.main()
