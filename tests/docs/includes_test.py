"""Every source includes the large headers that it uses. Builds that precompile these headers do not notice if one is missing."""

import functools
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
INCLUDE = re.compile(r'^#include ["<]([^">]+)[">]', re.M)
# A name of the header, and the headers that declare it.
HEADERS = {r"\bCLI::": {"CLI/CLI.hpp"},
           r"\bfmt::": {"fmt/format.h"},
           r"\bnlohmann::": {"nlohmann/json.hpp", "nlohmann/json_fwd.hpp"},
           r"\b(?:EXPECT|ASSERT)_[A-Z]+\(|\bTEST(?:_F|_P)?\(": {"gtest/gtest.h"},
           r"\brc::|\bRC_[A-Z]+": {"rapidcheck.h", "rapidcheck/gtest.h"}}


def code(path):
    return COMMENT.sub("", path.read_text())


@functools.cache
def includes(path):
    """All headers that a source includes, by itself or through headers of the project."""
    found = set(INCLUDE.findall(code(path)))
    for name in list(found):
        for folder in (ROOT, ROOT / "include", path.parent):
            if (folder / name).is_file():
                found |= includes(folder / name)
    return frozenset(found)


def missing(text, included):
    return [names for used, names in HEADERS.items() if re.search(used, text) and not names & included]


class Includes(unittest.TestCase):
    def test_large_headers_are_included_where_they_are_used(self):
        found = [f"{path.relative_to(ROOT)}: {' or '.join(sorted(names))}"
                 for layer in ("stages", "io", "pipeline", "tools", "tests", "python")
                 for path in sorted((ROOT / layer).rglob("*")) if path.suffix in (".h", ".cpp")
                 for names in missing(code(path), includes(path))]
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_a_missing_one_is_found(self):
        self.assertEqual(missing("CLI::App app;", frozenset({"fmt/format.h"})), [{"CLI/CLI.hpp"}])
        self.assertEqual(missing("TEST_F(Room, Claim) {}", frozenset()), [{"gtest/gtest.h"}])
        # Through tools/options/shared_options.h.
        self.assertIn("CLI/CLI.hpp", includes(ROOT / "tools" / "commands" / "decode.cpp"))
        self.assertNotIn("CLI/CLI.hpp", includes(ROOT / "stages" / "grid" / "box.h"))


if __name__ == "__main__":
    unittest.main()
