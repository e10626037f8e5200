"""What must hold between the modules of the package, and between texts that must be equal."""

import ast
import inspect
import pathlib
import sys
import unittest

import tagrid
from tagrid import _writing

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "python" / "tagrid"


def imports_of(path):
    """The modules of the package that a module imports anywhere, also for types alone."""
    froms = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom) and node.level == 1]
    return {name for node in froms for name in ([node.module] if node.module else [alias.name for alias in node.names])}


class Structure(unittest.TestCase):
    def test_no_modules_import_each_other(self):
        left = {path.stem: imports_of(path) for path in FOLDER.glob("*.py") if path.stem != "__init__"}
        self.assertIn("_errors", left["_volume"])
        while left:
            lowest = {name for name, needs in left.items() if not needs & left.keys()}
            self.assertTrue(lowest, f"these import each other: {left}")
            for name in lowest:
                del left[name]

    def test_encode_is_written_thrice_with_the_same_arguments(self):
        # Type checkers need one signature for bytes and one for None, and help() shows the third one.
        found = [node for node in ast.parse(inspect.getsource(_writing)).body
                 if isinstance(node, ast.FunctionDef) and node.name == "encode"]
        self.assertEqual(len(found), 3)
        for node in found:
            arguments = node.args
            arguments.args[1].annotation = None
            # In one of the overloads, `out` has no default.
            arguments.defaults = arguments.defaults[-len(arguments.args) + 2:]
        self.assertEqual(len({ast.dump(node.args) for node in found}), 1)

    def test_a_writer_has_the_arguments_of_encode(self):
        def of(function):
            return {name: (one.annotation, one.default) for name, one in inspect.signature(function).parameters.items()}
        encode, writer = of(tagrid.encode), of(tagrid.Writer)
        for name in ("shape", "dtype", "samples"):
            del writer[name]
        del encode["array_or_path"], encode["out"], writer["out"]
        self.assertEqual(encode, writer)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
