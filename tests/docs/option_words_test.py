"""Layers below tools/ name no option of the command line, because users of the library read their string literals, too.
Programs that read and write formats are not in the library: who reads their messages uses the command line."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAYERS = ("include", "stages", "io", "pipeline")

PROGRAM = re.compile(r"^io/formats/(\w+/(reader|writer)|axes|slices|codecs)/")
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
TOKEN = re.compile(rf"{LITERAL.pattern}|//[^\n]*|/\*.*?\*/|'(?:[^'\\\n]|\\.)+'", re.S)
# --max-error, -M SIZE, tagrid encode; "ulimit -n" is another program's.
OPTION = re.compile(r"--[a-z]|(?:^|[\s(])(?<!ulimit )-[A-Za-z]\b|\btagrid (?:encode|decode|info|verify|mesh|convert|estimate|phantom)\b|\bcommand line\b")


def options_in(source):
    """The string literals of a source file that name an option, with their lines."""
    for token in TOKEN.finditer(source):
        if token[1] is not None and OPTION.search(token[1]):
            yield source.count("\n", 0, token.start()) + 1, token[0]


class OptionWords(unittest.TestCase):
    def test_layers_below_the_command_line_name_no_option(self):
        found = []
        for layer in LAYERS:
            for path in sorted((ROOT / layer).rglob("*")):
                name = path.relative_to(ROOT).as_posix()
                if path.suffix in (".h", ".hpp", ".cpp") and not PROGRAM.match(name):
                    found += [f"{name}:{line}: {text}" for line, text in options_in(path.read_text())]
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_an_option_is_found(self):
        for text in ("--max-error must be", "exists; give -f to", "-M", "leave out --dims", "is a file; tagrid decode it", "give -M {}M"):
            self.assertEqual(len(list(options_in(f'\n  throw UsageError("{text}");  // as\n'))), 1, text)
        for text in ("a-f", "1 - x", "-", "ulimit -n", "this tagrid reads", "byte skip -1"):
            self.assertEqual(list(options_in(f'f("{text}");')), [], text)
        self.assertEqual(list(options_in("// give \"-f\"\nint n = '\"'; --n; f(\"x\");")), [])


if __name__ == "__main__":
    unittest.main()
