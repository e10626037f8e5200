"""Laws of the sources: what each includes and names, which files an option touches, which functions a brick passes, and
that each room has tests."""

import functools
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAYERS = ("stages", "io", "pipeline", "tools")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)


def sources(*folders):
    """The C++ files of folders, with their names from the root."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".h", ".hpp", ".cpp", ".c"):
                yield path.relative_to(ROOT).as_posix(), path


def code(path):
    return COMMENT.sub("", path.read_text())


# Every source includes the large headers that it uses. Builds that precompile these headers do not notice if one is missing.

INCLUDE = re.compile(r'^#include ["<]([^">]+)[">]', re.M)
# A name of the header, and the headers that declare it.
HEADERS = {r"\bCLI::": {"CLI/CLI.hpp"},
           r"\bfmt::(?!format\(|format_string<|runtime\()": {"fmt/format.h"},
           r"\bfmt::": {"fmt/format.h", "fmt/core.h"},
           r"\bnlohmann::": {"nlohmann/json.hpp", "nlohmann/json_fwd.hpp"},
           r"\b(?:EXPECT|ASSERT)_[A-Z]+\(|\bTEST(?:_F|_P)?\(": {"gtest/gtest.h"},
           r"\brc::|\bRC_[A-Z]+": {"rapidcheck.h", "rapidcheck/gtest.h"}}


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
        found = [f"{name}: {' or '.join(sorted(names))}" for name, path in sources(*LAYERS, "tests", "python")
                 if path.suffix in (".h", ".cpp") for names in missing(code(path), includes(path))]
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_a_missing_one_is_found(self):
        self.assertEqual(missing("CLI::App app;", frozenset({"fmt/format.h"})), [{"CLI/CLI.hpp"}])
        self.assertEqual(missing("TEST_F(Room, Claim) {}", frozenset()), [{"gtest/gtest.h"}])
        # Through tools/options/shared_options.h.
        self.assertIn("CLI/CLI.hpp", includes(ROOT / "tools" / "commands" / "decode.cpp"))
        self.assertNotIn("CLI/CLI.hpp", includes(ROOT / "stages" / "grid" / "box.h"))


# Only io/system includes headers of the operating system, as docs/dev/design.md says.

# Headers of C and C++ that no other system lacks are not in here.
OF_SYSTEM = re.compile(
    r"^\s*#\s*include\s*<((?:sys|linux|netinet|arpa|net|asm|machine)/.*|(?:aio|cpio|dirent|dlfcn|err|execinfo|fcntl|fnmatch|"
    r"ftw|getopt|glob|grp|iconv|ifaddrs|langinfo|libgen|link|malloc|mqueue|netdb|nl_types|poll|pthread|pwd|regex|sched|"
    r"search|semaphore|signal|spawn|strings|sysexits|syslog|tar|termios|ucontext|unistd|utime|utmpx|wordexp|windows|"
    r"winsock2|io)\.h|csignal)>", re.MULTILINE)
# Folders and files that may, and why.
EXCEPTIONS = {
    "io/system": "is the room for it",
    "io/sandbox": "asks Linux to confine a program: other systems have nothing like it",
    "tools/research": "measures other programs; no user runs it",
    "python/extension": "builds alone, on the C interface of the library: it looks whether Python was forked",
}


class SystemRoom(unittest.TestCase):
    def found(self):
        """The sources that include headers of the system, by the exception that they belong to."""
        for name, path in sources("include", *LAYERS, "python"):
            for header in OF_SYSTEM.findall(path.read_text()):
                yield next((one for one in EXCEPTIONS if path.is_relative_to(ROOT / one)), None), f"{name}: <{header}>"

    def test_no_other_room_includes_headers_of_the_system(self):
        self.assertEqual([what for exception, what in self.found() if exception is None], [])

    def test_the_exceptions_are_needed(self):
        self.assertLessEqual(set(EXCEPTIONS), {exception for exception, _ in self.found()})


# Only io/text/paths asks std::filesystem what a path means: on Windows, it knows no shares.

OF_FILESYSTEM = re.compile(r"\b(?:fs|filesystem)::(?:absolute|canonical|weakly_canonical|relative|proximate)\(|\blexically_\w+\(|"
                           r"\.is_(?:absolute|relative)\(\)")
OF_ONE_SYSTEM = {"io/text/paths.cpp", "io/sandbox/posix_sandbox.cpp"}


class Paths(unittest.TestCase):
    def test_no_other_source_asks_the_standard_library_what_a_path_means(self):
        found = {name for name, path in sources("include", *LAYERS, "python") if OF_FILESYSTEM.search(code(path))}
        self.assertEqual(found, OF_ONE_SYSTEM)


# Layers below tools/ name no option of the command line, because users of the library read their string literals, too.
# Programs that read and write formats are not in the library: who reads their messages uses the command line.

FORMAT_PROGRAM = re.compile(r"^io/formats/(\w+/(reader|writer)|axes|slices|codecs)/")
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
        found = [f"{name}:{line}: {text}" for name, path in sources("include", "stages", "io", "pipeline")
                 if not FORMAT_PROGRAM.match(name) for line, text in options_in(path.read_text())]
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_an_option_is_found(self):
        for text in ("--max-error must be", "exists; give -f to", "-M", "leave out --dims", "is a file; tagrid decode it", "give -M {}M"):
            self.assertEqual(len(list(options_in(f'\n  throw UsageError("{text}");  // as\n'))), 1, text)
        for text in ("a-f", "1 - x", "-", "ulimit -n", "this tagrid reads", "byte skip -1"):
            self.assertEqual(list(options_in(f'f("{text}");')), [], text)
        self.assertEqual(list(options_in("// give \"-f\"\nint n = '\"'; --n; f(\"x\");")), [])


# An option of encoding touches the files that CONTRIBUTING.md lists, and no others: counted for one option.

# The stages that do what the option says, and the interface of the library, are not counted: the document says so.
NOT_COUNTED = ("stages/bound/", "stages/brick/", "stages/values/voxels/", "stages/values/wide/", "pipeline/library/")
MOST = 6


class OptionFiles(unittest.TestCase):
    def test_effort_is_in_the_files_of_the_list_alone(self):
        text = (ROOT / "CONTRIBUTING.md").read_text()
        section = text.partition("\n### To add an option of encoding\n")[2].partition("\n## ")[0]
        listed = set(re.findall(r"^\d+\. `([^`]+)`", section, re.M))  # the first file of each number
        found = {name for name, path in sources(*LAYERS) if re.search(r"\beffort\b", code(path))}
        self.assertEqual({name for name in found if not name.startswith(NOT_COUNTED)}, listed)
        self.assertLessEqual(len(listed), MOST)
        for folder in NOT_COUNTED:
            self.assertTrue(any(name.startswith(folder) for name in found), folder)


# The tables of "Follow one brick" in docs/dev/design.md name functions that are in their files, and counts that are right.

MOST_FUNCTIONS = 25
NAME = re.compile(r"`([^`]+)`")


def section():
    text = (ROOT / "docs" / "dev" / "design.md").read_text()
    return text.partition("\n## Follow one brick\n")[2].partition("\n## ")[0]


def tables(text):
    """Each table: the numbers of functions and of what is in between, as the line above it says, and its rows of cells."""
    for head, body in re.findall(r"^\*\*(?:In|Out): ([^*]+)\*\*\n\n((?:\|.*\n)+)", text, re.M):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in body.splitlines()[2:]]
        yield [int(number) for number in re.findall(r"\d+", head)], rows


@functools.cache
def names_in(path):
    """What is called or defined in a file: functions, nodes of a flow graph, and lambdas that have a name."""
    text = code(path) if path.is_file() else ""
    return set(re.findall(r"\b(\w+)(?:<[\w:, ]*>)?\(", text)) | set(re.findall(r"\b(\w+) = \[", text))


@functools.cache
def names_anywhere():
    return set().union(*(names_in(path) for _, path in sources(*LAYERS)))


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
            self.assertLessEqual(len(rows), MOST_FUNCTIONS)


# tests/ mirrors the rooms of the sources: each room has tests of its own, or other tests stand for it.

ROOM = re.compile(r"^\s*tagrid_room\(([a-z0-9_/]+)", re.M)
# Rooms that do what only their files show: formats, which other programs judge, and what commands do.
ELSEWHERE = {"io/formats/amira": ["tests/readers/amira_test.py", "tests/fuzz/other_volumes_target.cpp"],
             "io/formats/bmp": ["tests/readers/bmp_test.py", "tests/fuzz/bmp_target.cpp"],
             "io/formats/dicom": ["tests/readers/dicom_export_test.py", "tests/fuzz/dicom_target.cpp"],
             "io/formats/edf": ["tests/readers/edf_test.py", "tests/fuzz/other_volumes_target.cpp"],
             "io/formats/metaimage": ["tests/readers/metaimage_test.py", "tests/fuzz/metaimage_target.cpp"],
             "io/formats/mrc": ["tests/readers/mrc_test.py", "tests/fuzz/other_volumes_target.cpp"],
             "io/formats/nifti": ["tests/readers/nifti_test.py", "tests/fuzz/nifti_target.cpp"],
             "io/formats/npy": ["tests/readers/npy_test.py", "tests/fuzz/other_volumes_target.cpp"],
             "io/formats/png": ["tests/readers/png_test.py", "tests/fuzz/png_target.cpp"],
             "io/formats/tiff": ["tests/readers/tiff_test.py"],
             "io/formats/vendors": ["tests/readers/vendors_test.py", "tests/fuzz/vendors_target.cpp"],
             "io/formats/vti": ["tests/readers/written_test.py"],
             "io/formats/zarr": ["tests/readers/zarr_written_test.py"],
             "io/server": ["tests/tools/commands/view_test.py"],
             "io/tag": ["tests/fuzz/header_target.cpp", "tests/fuzz/index_target.cpp",
                        "tests/pipeline/decode/damage_test.cpp"],
             "io/parts": ["tests/fuzz/resume_target.cpp", "tests/tools/commands/resume_test.cpp"],
             "pipeline/phantom": ["tests/tools/commands/phantom_test.cpp"],
             "pipeline/progress": ["tests/tools/report/advice_test.cpp"],
             "pipeline/ranks/mpi": ["tests/tools/commands/mpi_test.cpp"],
             "pipeline/restore": ["tests/readers/restored_test.py"],
             "pipeline/serving": ["tests/tools/commands/view_test.py", "tests/tools/commands/serve_test.py"]}


def rooms():
    return [room for layer in LAYERS for room in ROOM.findall((ROOT / layer / "CMakeLists.txt").read_text())]


def tests_of(folder):
    return [*folder.glob("*_test.cpp"), *folder.glob("*_test.py")]


class Rooms(unittest.TestCase):
    def test_every_room_has_tests(self):
        self.assertGreater(len(rooms()), 40)
        without = [room for room in rooms() if room not in ELSEWHERE and not tests_of(ROOT / "tests" / room)]
        self.assertEqual(without, [])

    def test_tests_elsewhere_exist_and_are_needed(self):
        for room, tests in ELSEWHERE.items():
            self.assertIn(room, rooms())
            self.assertEqual(tests_of(ROOT / "tests" / room), [], f"{room} has tests of its own")
            for test in tests:
                self.assertTrue((ROOT / test).is_file(), test)

    def test_folders_of_tests_are_rooms(self):
        for layer in LAYERS:
            for folder in (ROOT / "tests" / layer).rglob("*"):
                if folder.is_dir() and tests_of(folder) and folder != ROOT / "tests" / layer:
                    room = folder.relative_to(ROOT / "tests").as_posix()
                    self.assertTrue(room in rooms() or room == "tools/research", f"tests/{room} mirrors no room")

    def test_a_folder_of_rooms_has_no_sources(self):
        # Whoever links such a room could include the headers of the rooms in it. pipeline/ranks/mpi is for main() alone.
        for room in rooms():
            for other in rooms():
                if other.startswith(room + "/"):
                    self.assertEqual((room, other), ("pipeline/ranks", "pipeline/ranks/mpi"))


if __name__ == "__main__":
    unittest.main()
