"""The size of the house: counts that may only become smaller. Run alone, this prints them as a table."""

import pathlib
import re
import statistics
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRODUCT = ("stages", "io", "pipeline", "tools", "include", "python", "plugins", "web")
# The only places that may name the text of NRRD headers: an attribute of OpenVDB files has this name.
NRRD_FIELDS = {"io/formats/vdb/placement.h"}
# What is counted, and the most that there may be. Lower a number when it has become smaller.
MOST = {
    "functions that only pass a brick on, in": 37,
    "functions that only pass a brick on, out": 22,
    "std::function in the product": 85,
    "files that name nrrd_fields": 1,
    "C++ files of the product": 874,
    "C++ files longer than 600 lines": 0,
    "lines of the product in C++": 112006,
}


def sources():
    """Paths and texts of the product's C++ files, but for measurements and what was built."""
    for folder in PRODUCT:
        for path in sorted((ROOT / folder).rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            is_product = not re.search(r"^tools/research/|/(build|dist|node_modules)/", name)
            if path.suffix in (".h", ".cpp", ".hpp") and is_product:
                yield name, path.read_text()


def brick():
    text = (ROOT / "docs" / "dev" / "design.md").read_text().partition("\n## Follow one brick\n")[2]
    return [int(number) for number in re.findall(r"^\*\*(?:In|Out): \d+ functions, and (\d+)", text, re.M)]


def counts():
    files = dict(sources())
    lines = {name: text.count("\n") for name, text in files.items()}
    way_in, way_out = brick()
    return {
        "functions that only pass a brick on, in": way_in,
        "functions that only pass a brick on, out": way_out,
        "std::function in the product": sum(text.count("std::function") for text in files.values()),
        "files that name nrrd_fields": sum("nrrd_fields" in text for text in files.values()),
        "C++ files of the product": len(files),
        "C++ files longer than 600 lines": sum(count > 600 for count in lines.values()),
        "lines of the product in C++": sum(lines.values()),
    }


class House(unittest.TestCase):
    def test_no_count_grows(self):
        found = counts()
        self.assertEqual(list(found), list(MOST))
        for what, count in found.items():
            self.assertLessEqual(count, MOST[what], what)

    def test_only_files_of_openvdb_name_the_text_of_nrrd(self):
        self.assertEqual({name for name, text in sources() if "nrrd_fields" in text}, NRRD_FIELDS)


if __name__ == "__main__":
    for what, count in counts().items():
        print(f"{count:7}  {what}")
    lengths = sorted(text.count("\n") for _, text in sources())
    print(f"{statistics.median(lengths):7.0f}  median lines of a C++ file")
    unittest.main()
