"""Files named in documents and comments exist: every path between backticks, every path and file name in a comment.
So do tests named in documents.

Links of documents that are installed lead to files that are installed, too.
"""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("include", "stages", "io", "pipeline", "tools", "tests", "docs", "cmake", "examples", "python", "packaging")
SOURCES = {".h", ".cpp", ".py", ".sh", ".cmake", ".sbatch", ".txt"}
ENDINGS = ("", ".h", ".cpp", ".py", ".md")

BACKTICKS = re.compile(r"`([^`\n]+)`")
COMMENT = re.compile(r"(?://|#(?!include|pragma|if|el|en|de|un))(.*)")
PATH = re.compile(rf"(?<![\w./~-])((?:{'|'.join(FOLDERS)})/[\w./*<>-]*[\w*>/])")
LINK = re.compile(r"\]\(([^)\s]+)\)")
TEST_NAME = re.compile(r"readers/[\w*{},]+|[A-Z]\w+\.[A-Z]\w+…?")
CAMEL_CASE = re.compile(r"[A-Z]\w*[a-z]\w*")
FILE_NAME = re.compile(r"(?<![\w./<-])([a-z]\w*\.(?:h|cpp))\b")


def all_files():
    folders = [ROOT / folder for folder in FOLDERS]
    files = [path for folder in folders for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return files + [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")]


NAMES = {path.name for path in all_files()}


def exists(path):
    """Also for a path without its ending (a unit), with * for several files, and with <name> for any name."""
    pattern = re.sub(r"<[^>]*>", "*", path.rstrip("/"))
    return any(True for ending in ENDINGS for _ in ROOT.glob(pattern + ending))


def wrong_names(text):
    """The names in `text` of files that do not exist."""
    wrong = [path for path in PATH.findall(text) if not exists(path)]
    return wrong + [name for name in FILE_NAME.findall(text) if name not in NAMES]


def sources_of_tests():
    files = [path for path in (ROOT / "tests").rglob("*") if path.suffix in (".cpp", ".py") or path.name == "CMakeLists.txt"]
    return " ".join(word for path in files for word in path.read_text().split())


def is_test(name, sources):
    """True for readers/<test>, also with {several,tests} and with *, for <suite>.<case>, and for any word of the tests."""
    if name.startswith("readers/"):
        tests = name.removeprefix("readers/").strip("{}").split(",")
        return all(any(True for _ in ROOT.glob(f"tests/readers/{test}_test.py")) for test in tests)
    suite, dot, case = name.rstrip("…").partition(".")
    return (f"({suite}, {case}" if dot else suite) in sources


def installed_documents():
    """The files that CMakeLists.txt installs in the directory of the documents, where they have the same relative paths."""
    top = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "CITATION.cff", "LICENSE")]
    folders = [path for folder in ("docs", "tools/slurm", "examples/readers") for path in (ROOT / folder).rglob("*")]
    # What only the site needs is not installed.
    site = ROOT / "docs" / "conf.py", ROOT / "docs" / "reference", ROOT / "docs" / "site"
    return {path for path in top + folders if path.suffix != ".in" and not any(map(path.is_relative_to, site))}


def dead_links(path, text, installed):
    """The links in `text`, the content of `path`, that lead nowhere where documents are installed."""
    links = [link.partition("#")[0] for link in LINK.findall(text) if not re.match(r"[a-z]+:", link)]
    return [link for link in links if link and (path.parent / link).resolve() not in installed]


def names_in(path):
    """The lines of a file, with the text in which names are searched."""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if path.suffix == ".md":
            # Commands are not paths.
            yield from ((number, name) for name in BACKTICKS.findall(line) if " " not in name)
        elif found := COMMENT.search(line):
            yield number, found[1]


class Paths(unittest.TestCase):
    def test_what_documents_and_comments_name_is_there(self):
        wrong = []
        for path in all_files():
            if path.suffix not in SOURCES | {".md"}:
                continue
            for number, text in names_in(path):
                wrong += [f"{path.relative_to(ROOT)}:{number}: there is no {name}" for name in wrong_names(text)]
        self.assertEqual(wrong, [], "\n" + "\n".join(wrong))

    def test_tests_that_documents_name_are_there(self):
        sources = sources_of_tests()
        wrong = []
        for path in all_files():
            if path.suffix == ".md":
                # Words alone are names of tests in one document.
                names = re.compile(f"{TEST_NAME.pattern}|{CAMEL_CASE.pattern}") if path.name == "reliability.md" else TEST_NAME
                wrong += [f"{path.relative_to(ROOT)}: there is no {name}" for name in BACKTICKS.findall(path.read_text())
                          if names.fullmatch(name) and not is_test(name, sources)]
        self.assertEqual(wrong, [], "\n" + "\n".join(wrong))

    def test_links_of_installed_documents_lead_to_installed_files(self):
        installed = installed_documents()
        dead = [f"{path.relative_to(ROOT)}: {link}" for path in sorted(installed) if path.suffix == ".md"
                for link in dead_links(path, path.read_text(), installed)]
        # library.md is also installed alone, for the package libtagrid-dev.
        library = ROOT / "docs" / "library.md"
        dead += [f"library.md, alone: {link}" for link in dead_links(library, library.read_text(), {library})]
        self.assertEqual(dead, [], "\n" + "\n".join(dead))


if __name__ == "__main__":
    unittest.main()
