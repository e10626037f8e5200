"""An option of encoding touches the files that CONTRIBUTING.md lists, and no others: counted for one option."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
LAYERS = ("stages", "io", "pipeline", "tools")
# The stages that do what the option says, and the interface of the library, are not counted: the document says so.
NOT_COUNTED = ("stages/bound/", "stages/brick/", "stages/values/voxels/", "stages/values/wide/", "pipeline/library/")
MOST = 6


def listed():
    """The first file of each number in the list of CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    section = text.partition("\n### To add an option of encoding\n")[2].partition("\n## ")[0]
    return set(re.findall(r"^\d+\. `([^`]+)`", section, re.M))


def files_with(name):
    files = (path for layer in LAYERS for path in (ROOT / layer).rglob("*") if path.suffix in (".h", ".cpp"))
    with_name = (path for path in files if re.search(rf"\b{name}\b", COMMENT.sub("", path.read_text())))
    return {str(path.relative_to(ROOT)) for path in with_name}


class OptionFiles(unittest.TestCase):
    def test_effort_is_in_the_files_of_the_list_alone(self):
        found = {path for path in files_with("effort") if not path.startswith(NOT_COUNTED)}
        self.assertEqual(found, listed())
        self.assertLessEqual(len(found), MOST)

    def test_what_is_not_counted_is_there(self):
        found = files_with("effort")
        for folder in NOT_COUNTED:
            self.assertTrue(any(path.startswith(folder) for path in found), folder)


if __name__ == "__main__":
    unittest.main()
