"""Modules that run without the library have a copy of its table of lengths: that of 3D Slicer, and of NiiVue and the
viewer. All have the units and the spellings of io/metadata/lengths.cpp."""

import ast
import pathlib
import re
import sys
import types
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "plugins/slicer"))
sys.dont_write_bytecode = True


class Slicer:
    """What Slicer would offer. Nothing here calls it."""

    ScriptedLoadableModule = object


sys.modules.update({"slicer": types.ModuleType("slicer"), "slicer.ScriptedLoadableModule": Slicer})
import TagridReader  # noqa: E402

STRING = r'"((?:[^"\\]|\\.)*)"'


def text_of(literal):
    """The characters of the inside of a C string; None if its bytes are no UTF-8, which text of the program never has."""
    try:
        return ast.literal_eval(f'b"{literal}"').decode()
    except UnicodeDecodeError:
        return None


def tables_of_the_program():
    code = (ROOT / "io/metadata/lengths.cpp").read_text()

    def rows(name, value):
        table = re.search(rf"{name}\[\] = (\{{.*?\}});", code, re.DOTALL)[1]
        return [(text_of(text), found) for text, found in re.findall(rf"\{{{STRING},\s*{value}\}}", table)]

    lengths = {name: float(femtometers) / 1e12 for name, femtometers in rows("all_units", r"(\w+)")}
    return lengths, *({text: name for text, name in rows(table, STRING) if text is not None}
                      for table in ("short_spellings", "word_spellings"))


def tables_of_javascript():
    code = (ROOT / "web/niivue/places.js").read_text()

    def table(name, value):
        inside = re.search(rf"const {name} = new Map\(Object.entries\(\{{(.*?)\}}\)\);", code, re.DOTALL)[1]
        rows = re.findall(rf"""(\w+|"[^"]*"|'[^']*'): {value}""", inside)
        return {ast.literal_eval(key) if key[0] in "\"'" else key: found for key, found in rows}

    lengths = {name: float(number) for name, number in table("lengths", r"([\w.-]+)").items()}
    return lengths, table("spellings", STRING), table("words", STRING)


class Units(unittest.TestCase):
    def test_3d_slicer(self):
        self.assertEqual((TagridReader.MILLIMETERS, TagridReader.SPELLINGS, TagridReader.WORDS), tables_of_the_program())

    def test_niivue_and_the_viewer(self):
        self.assertEqual(tables_of_javascript(), tables_of_the_program())

    def test_the_tables_were_found(self):
        lengths, spellings, words = tables_of_the_program()
        self.assertEqual((lengths["inch"], spellings["\u00b5m"], words["feet"]), (25.4, "um", "ft"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
