"""tests/ mirrors the rooms of the sources: each room has tests of its own, or other tests stand for it."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAYERS = ("stages", "io", "pipeline", "tools")
ROOM = re.compile(r"^\s*tagrid_room\(([a-z0-9_/]+)", re.M)
# Rooms that do what only their files show: formats, which other programs judge, and what commands do.
ELSEWHERE = {"io/formats/bmp": ["tests/readers/bmp_test.py", "tests/fuzz/bmp_target.cpp"],
             "io/formats/metaimage": ["tests/readers/metaimage_test.py", "tests/fuzz/metaimage_target.cpp"],
             "io/formats/nifti": ["tests/readers/nifti_test.py", "tests/fuzz/nifti_target.cpp"],
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
