"""The folder of the extension for 3D Slicer is what Slicer's build and its index of extensions expect.

CMake configures it with a mock of Slicer, which checks what it is told.
"""

import json
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "plugins/slicer"
NAME = "Tagrid"
MOCK = """
set(Slicer_USE_FILE ${CMAKE_CURRENT_LIST_DIR}/use.cmake)
foreach(name IN ITEMS GENERATE_CONFIG CPACK)
  set(Slicer_EXTENSION_${name} ${CMAKE_CURRENT_LIST_DIR}/${name}.cmake)
endforeach()
set(Slicer_FOUND TRUE)
"""
MACRO = """
function(slicerMacroBuildScriptedModule)
  cmake_parse_arguments(module "WITH_GENERIC_TESTS;WITH_SUBDIR" "NAME" "SCRIPTS;RESOURCES" ${ARGN})
  if(module_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "unknown: ${module_UNPARSED_ARGUMENTS}")
  endif()
  foreach(file IN LISTS module_SCRIPTS module_RESOURCES)
    if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
      message(FATAL_ERROR "there is no ${file}")
    endif()
    message(STATUS "file ${file}")
  endforeach()
  message(STATUS "module ${module_NAME}")
endfunction()
"""
REQUIRED = """
foreach(name IN ITEMS HOMEPAGE CATEGORY CONTRIBUTORS DESCRIPTION ICONURL SCREENSHOTURLS DEPENDS)
  message(STATUS "${name} ${EXTENSION_${name}}")
endforeach()
message(STATUS "project ${PROJECT_NAME}")
"""


class Extension(unittest.TestCase):
    def setUp(self):
        self.cmake = (FOLDER / "CMakeLists.txt").read_text()
        self.entry = json.loads((FOLDER / f"{NAME}.json").read_text())

    @unittest.skipUnless(shutil.which("cmake"), "there is no cmake")
    def test_cmake_configures_it(self):
        with tempfile.TemporaryDirectory() as folder:
            mock = pathlib.Path(folder, "mock")
            mock.mkdir()
            for name, text in (("SlicerConfig", MOCK), ("use", MACRO), ("GENERATE_CONFIG", ""), ("CPACK", REQUIRED)):
                (mock / f"{name}.cmake").write_text(text)
            done = subprocess.run(["cmake", "-S", FOLDER, "-B", pathlib.Path(folder, "build"), f"-DSlicer_DIR={mock}"],
                                  text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(done.returncode, 0, done.stdout)
        said = dict(re.findall(r"^-- (\w+) (.+)$", done.stdout, re.MULTILINE))
        self.assertEqual((said["project"], said["module"]), (NAME, "TagridReader"))
        self.assertEqual(said["CATEGORY"], self.entry["category"])
        for name in ("HOMEPAGE", "CONTRIBUTORS", "DESCRIPTION", "ICONURL", "SCREENSHOTURLS"):
            self.assertTrue(said[name], name)
        self.assertEqual((said["DEPENDS"], self.entry["build_dependencies"]), ("NA", []))

    def test_the_entry_has_the_keys_of_the_schema(self):
        self.assertLessEqual({"$schema", "category", "scm_url"}, set(self.entry))
        known = "$schema category scm_url scm_revision scm_type build_dependencies build_subdirectory enabled tier"
        self.assertLessEqual(set(self.entry), set(known.split()))
        self.assertEqual(self.entry["scm_url"].rpartition("/")[2], f"Slicer{NAME}")
        self.assertEqual(self.entry["tier"], 1)

    def test_pictures_are_where_the_addresses_will_be(self):
        for variable in ("ICONURL", "SCREENSHOTURLS"):
            address = re.search(rf'set\(EXTENSION_{variable} "([^"]+)"\)', self.cmake)[1]
            self.assertTrue((ROOT / address.split("ADDRESS_OF_RAW_FILES/")[1]).is_file(), address)
        for name, size in (("Tagrid.png", 128), ("Resources/Icons/TagridReader.png", 64)):
            data = (FOLDER / name).read_bytes()
            self.assertEqual((data[:8], struct.unpack(">II", data[16:24])), (b"\x89PNG\r\n\x1a\n", (size, size)))

    def test_the_license_is_that_of_the_project(self):
        self.assertEqual((FOLDER / "LICENSE.txt").read_text(), (ROOT / "LICENSE").read_text())
        page = (FOLDER / "README.md").read_text()
        for said in ("Apache-2.0", "TagridReader", f"# {NAME}", "![", "Nothing has been sent"):
            self.assertIn(said, page)


if __name__ == "__main__":
    unittest.main(argv=["slicer_extension_test"])
