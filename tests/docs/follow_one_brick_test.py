"""The tables of "Follow one brick" in docs/design.md name functions that are in their files, and counts that are right."""

import functools
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOST = 25
LAYERS = ("stages", "io", "pipeline", "tools")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
NAME = re.compile(r"`([^`]+)`")


def section():
    text = (ROOT / "docs" / "design.md").read_text()
    return text.partition("\n## Follow one brick\n")[2].partition("\n## ")[0]


def tables(text):
    """Each table: the numbers of functions and of what is in between, as the line above it says, and its rows of cells."""
    for head, body in re.findall(r"^\*\*(?:In|Out): ([^*]+)\*\*\n\n((?:\|.*\n)+)", text, re.M):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in body.splitlines()[2:]]
        yield [int(number) for number in re.findall(r"\d+", head)], rows


@functools.cache
def names_in(path):
    """What is called or defined in a file: functions, nodes of a flow graph, and lambdas that have a name."""
    code = COMMENT.sub("", path.read_text()) if path.is_file() else ""
    return set(re.findall(r"\b(\w+)(?:<[\w:, ]*>)?\(", code)) | set(re.findall(r"\b(\w+) = \[", code))


@functools.cache
def names_anywhere():
    files = (path for layer in LAYERS for path in (ROOT / layer).rglob("*") if path.suffix in (".h", ".cpp"))
    return set().union(*map(names_in, files))


def wrong_rows(rows):
    wrong = []
    for function, file, _, through in rows:
        name, path = NAME.findall(function)[0], NAME.findall(file)[0]
        if name not in names_in(ROOT / path):
            wrong.append(f"{name} is not in {path}")
        wrong += [f"{other}, before {name}, is nowhere" for other in NAME.findall(through)
                  if other not in names_anywhere()]
    return wrong


class FollowOneBrick(unittest.TestCase):
    def test_every_function_is_in_its_file(self):
        found = list(tables(section()))
        self.assertEqual(len(found), 2)
        for _, rows in found:
            self.assertEqual(wrong_rows(rows), [])

    def test_the_counts_are_those_of_the_tables(self):
        for counts, rows in tables(section()):
            between = sum(len(row[3].split(",")) for row in rows if row[3])
            self.assertEqual(counts, [len(rows), between])
            self.assertLessEqual(len(rows), MOST)

    def test_a_wrong_row_is_found(self):
        main = ["`main`", "`tools/commands/main.cpp`", "", ""]
        self.assertEqual(wrong_rows([main]), [])
        for wrong in (["`mian`", *main[1:]], ["`main`", "`tools/commands/encode.cpp`", "", ""],
                      [*main[:3], "node `nothing_at_all`"]):
            self.assertEqual(len(wrong_rows([wrong])), 1, wrong)


if __name__ == "__main__":
    unittest.main()
