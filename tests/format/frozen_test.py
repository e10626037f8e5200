"""The golden files of a version of the format are those that were published with it: all of them, and no others."""

import hashlib
import pathlib
import unittest

GOLDEN = pathlib.Path(__file__).resolve().parents[1] / "golden"


class Frozen(unittest.TestCase):
    def test_golden_files_never_change(self):
        versions = [folder for folder in GOLDEN.iterdir() if folder.is_dir()]
        self.assertIn(GOLDEN / "1.0", versions)
        for version in versions:
            lines = (version / "SHA256SUMS").read_text().splitlines()
            sums = {name: digest for digest, name in (line.split() for line in lines)}
            files = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in version.glob("*.tag")}
            self.assertEqual(files, sums, f"{version.name}: a new kind of file belongs to a new version")


unittest.main()
