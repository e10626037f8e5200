"""The installed library: the examples are built with it, also after it was moved, and packages contain its files."""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

from served_page import served_page

BUILD = pathlib.Path(sys.argv.pop(1))
# Calls that only the program may make: it writes to streams, handles signals, and ends the process.
FORBIDDEN = {"getenv", "secure_getenv", "setenv", "putenv", "signal", "sigaction", "sigprocmask", "raise", "kill", "exit",
             "_exit", "quick_exit", "stderr", "stdout", "printf", "fprintf", "puts", "perror", "setlocale", "abort",
             "__assert_fail", "atexit", "environ", "setrlimit", "mallopt"}


def run(*command, cwd=None, **environment):
    done = subprocess.run([str(part) for part in command], cwd=cwd, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, env=os.environ | environment)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\n{done.stdout}")
    return done.stdout


class InstalledLibrary(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="tagrid-installed-"))
        cls.prefix = cls.folder / "first place"
        for component in ("libtagrid", "libtagrid-dev"):
            run("cmake", "--install", BUILD, "--prefix", cls.prefix, "--component", component)
        cls.library = next(cls.prefix.rglob("libtagrid.so")).parent

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def use(self, programs, library):
        """Encodes, reads a box and looks at the file with the examples."""
        where = {"LD_LIBRARY_PATH": str(library)}
        file = self.folder / "ball.tag"
        self.assertIn("100% done", run(programs / "encode_slices", file, **where))
        # Samples of the ball are 40, and each is within 2 of that.
        self.assertRegex(run(programs / "read_region", file, *"43 35 27 53 45 37".split(), **where),
                         r"1000 samples, mean (38|39|40|41|42)\b")
        said = run(programs / "info", file, **where)
        self.assertIn("96 x 80 x 64 samples of 2 bytes", said)
        self.assertIn("verified", said)
        self.assertIn("tetrahedra", said)
        outside = subprocess.run([programs / "info", ROOT / "README.md"], env=os.environ | where, text=True,
                                 stderr=subprocess.PIPE)
        self.assertEqual(outside.returncode, 1)
        self.assertIn("README.md", outside.stderr)

    def build_with_cmake(self, prefix, library, target, name):
        build = self.folder / name
        run("cmake", "-S", ROOT / "examples", "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}", f"-DTAGRID_TARGET={target}",
            "-DCMAKE_BUILD_TYPE=Debug")
        run("cmake", "--build", build)
        self.use(build, library)

    def build_with_pkg_config(self, library, name, static):
        build = self.folder / name
        build.mkdir()
        where = {"PKG_CONFIG_PATH": str(library / "pkgconfig")}
        flags = shlex.split(run("pkg-config", "--cflags", "--libs", *["--static"] * static, "tagrid", **where))
        if static:
            flags = ["-l:libtagrid.a" if flag == "-ltagrid" else flag for flag in flags]
        for source in ("read_region.c", "encode_slices.c", "info.cpp"):
            compiler = ("c++", "-std=c++20") if source.endswith("cpp") else ("cc", "-std=c11")
            run(*compiler, ROOT / "examples" / source, *flags, "-o", build / source.split(".")[0])
        self.use(build, "" if static else library)

    def build_all(self, prefix, library, name):
        self.build_with_cmake(prefix, library, "tagrid::tagrid", f"{name}-cmake-shared")
        self.build_with_cmake(prefix, "", "tagrid::static", f"{name}-cmake-static")
        self.build_with_pkg_config(library, f"{name}-pkg-config-shared", False)
        self.build_with_pkg_config(library, f"{name}-pkg-config-static", True)

    def test_examples_are_built_and_run_with_it_also_where_it_was_moved(self):
        # A copy, so that the other tests find the original.
        first = self.folder / "another place"
        shutil.copytree(self.prefix, first, symlinks=True)
        library = self.library.relative_to(self.prefix)
        if "TAGRID_LONG" in os.environ:
            self.build_all(first, first / library, "first")
        else:
            self.build_with_cmake(first, first / library, "tagrid::tagrid", "first-cmake-shared")
        moved = self.folder / "deeper" / "moved"
        moved.parent.mkdir()
        first.rename(moved)
        self.build_all(moved, moved / library, "moved")

    def test_programs_are_built_as_the_document_prints_it(self):
        # The commands are for a prefix without blanks.
        prefix = self.folder / "documented"
        shutil.copytree(self.prefix, prefix, symlinks=True)
        library = self.library.relative_to(self.prefix)
        text = (ROOT / "docs/library.md").read_text()
        text = text.replace("/where/you/want/lib/x86_64-linux-gnu", str(prefix / library)).replace("/where/you/want", str(prefix))
        blocks = re.findall(r"^```\w*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
        project = next(block for block in blocks if block.startswith("cmake_minimum_required"))
        folder = self.folder / "as printed"
        folder.mkdir()
        shutil.copy(ROOT / "examples/read_region.c", folder / "program.c")
        shutil.copy(ROOT / "examples/info.cpp", folder / "program.cpp")
        (folder / "CMakeLists.txt").write_text(project)
        commands = [line for block in blocks for line in block.splitlines()
                    if line.startswith(("cmake -B", "cc ", "c++ "))]
        self.assertEqual(len(commands), 4, commands)
        exports = [line for block in blocks for line in block.splitlines() if line.startswith("export ")]
        for command in commands:
            program = folder / ("build/program" if command.startswith("cmake") else "program")
            with self.subTest(command):
                run("bash", "-euc", "\n".join([*exports, command]), cwd=folder)
                # Neither program accepts this file, but both begin, so the loader found the library.
                begun = subprocess.run([program, ROOT / "README.md"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                self.assertRegex(begun.stdout, "README.md|usage: ")
                linked = run("readelf", "-d", program)
                self.assertEqual("libtagrid.so" in linked, "--static" not in command)
                program.unlink()

    def test_the_programs_of_the_document_run(self):
        text = (ROOT / "docs/library.md").read_text()
        where = {"PKG_CONFIG_PATH": str(self.library / "pkgconfig")}
        flags = shlex.split(run("pkg-config", "--cflags", "--libs", "tagrid", **where))
        programs = re.findall(r"^```(c|cpp)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
        self.assertEqual([language for language, _ in programs], ["cpp", "c", "cpp"])
        file, said = self.folder / "of the document.tag", []
        # The last one writes the file that the others read.
        for number, (language, code) in reversed([*enumerate(programs)]):
            source, program = self.folder / f"program{number}.{language}", self.folder / f"program{number}"
            source.write_text(code)
            compiler = ("c++", "-std=c++20") if language == "cpp" else ("cc", "-std=c11")
            run(*compiler, "-Wall", "-Wextra", "-Werror", source, *flags, "-o", program)
            said.append(run(program, file, LD_LIBRARY_PATH=str(self.library)))
        self.assertRegex(said[0], r"^\d+ bytes\n$")
        self.assertEqual(said[1:], ["", "no error above 2\n800 samples\n"])

    @unittest.skipUnless((BUILD / "hdf5_plugins").exists(), "built without TAGRID_HDF5")
    def test_the_hdf5_plugin_finds_the_library_also_where_it_was_moved(self):
        prefix = self.folder / "with plugin"
        shutil.copytree(self.prefix, prefix, symlinks=True)
        run("cmake", "--install", BUILD, "--prefix", prefix, "--component", "tagrid-hdf5")
        moved = self.folder / "deeper still" / "plugin"
        moved.parent.mkdir()
        prefix.rename(moved)
        plugin = next(moved.rglob("libtagrid_hdf5.so"))
        library = moved / self.library.relative_to(self.prefix) / "libtagrid.so.1"
        found = re.search(r"libtagrid\.so\.1 => (.*) \(0x", run("ldd", plugin, LD_LIBRARY_PATH=""))
        self.assertEqual(pathlib.Path(found[1]).resolve(), library.resolve())

    def test_an_older_standard_is_refused_by_name(self):
        source = self.folder / "older.cpp"
        source.write_text("#include <tagrid/tagrid.hpp>\n")
        done = subprocess.run(["c++", "-std=c++17", "-fsyntax-only", f"-I{ROOT / 'include'}", source], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("#error \"tagrid.hpp needs C++20\"", done.stdout)

    def test_it_exports_its_interface_and_nothing_else(self):
        shared = self.library / "libtagrid.so"
        names = [line.split()[-1] for line in run("nm", "-D", "--defined-only", shared).splitlines()]
        headers = "".join(header.read_text() for header in (ROOT / "include/tagrid").glob("*.h"))
        declared = {name for name in re.findall(r"\b(tagrid_\w+)\(", headers)
                    if re.search(rf"TAGRID_API [^;]*\b{name}\(", headers)}
        self.assertEqual(set(names), declared)
        self.assertIn("Library soname: [libtagrid.so.1]", run("readelf", "-d", shared))

    def test_it_does_not_touch_the_process(self):
        shared = self.library / "libtagrid.so"
        used = {line.split()[-1].split("@")[0] for line in run("nm", "-D", "--undefined-only", shared).splitlines()}
        self.assertEqual(used & FORBIDDEN, set())

    def test_no_installed_file_names_the_place_of_the_build_or_of_the_prefix(self):
        for file in self.prefix.rglob("*"):
            if file.suffix in (".pc", ".cmake", ".h", ".hpp"):
                text = file.read_text()
                self.assertNotIn(str(self.prefix), text, file)
                self.assertNotIn(str(ROOT), text, file)

    @unittest.skipUnless(shutil.which("dpkg-deb") and shutil.which("dpkg-shlibdeps"), "there are no tools for Debian packages")
    def test_there_are_debian_packages(self):
        folder = self.folder / "packages"
        run(ROOT / "tools/packages.sh", folder, TAGRID_BUILD=str(BUILD))
        packages = {file.name.split("_")[0]: file for file in folder.glob("*.deb")}
        plugins = {"tagrid-hdf5"} if (BUILD / "hdf5_plugins").exists() else set()
        with_python = {"python3-tagrid"} if next(BUILD.glob("python/tagrid/_tagrid.*.so"), None) else set()
        self.assertEqual(set(packages), {"tagrid", "tagrid-readers", "tagrid-openvdb", "libtagrid", "libtagrid-dev"} | plugins | with_python)
        content = {name: run("dpkg-deb", "--contents", file) for name, file in packages.items()}
        field = {name: run("dpkg-deb", "--field", file) for name, file in packages.items()}
        for path in ("/usr/bin/tagrid\n", "man1/tagrid.1", "bash-completion/completions/tagrid", "/usr/share/mime/packages/tagrid.xml\n",
                     "/usr/share/tagrid/magic\n", "/usr/share/doc/tagrid/tagrid.spdx.json\n"):
            self.assertIn(path, content["tagrid"])
        # The page of `tagrid view`, which an installed program finds.
        with_page = "TAGRID_WEB:BOOL=ON" in (BUILD / "CMakeCache.txt").read_text()
        self.assertEqual("./usr/share/tagrid/viewer/index.html\n" in content["tagrid"], with_page)
        if with_page:
            run("dpkg-deb", "-x", packages["tagrid"], self.folder / "unpacked")
            page, decoder = served_page(self.folder / "unpacked/usr/bin/tagrid",
                                        ROOT / "tests/golden/1.0/voxels_lossless_int16.tag")
            self.assertIn(b"viewer.js", page)
            self.assertEqual(decoder[:4], b"\0asm")
        for format in ("bmp", "dicom", "hdf5", "jp2", "png", "tiff", "zarr"):
            self.assertIn(f"/usr/libexec/tagrid/tagrid-read-{format}\n", content["tagrid-readers"])
        self.assertIn("/usr/libexec/tagrid/tagrid-write-hdf5\n", content["tagrid-readers"])
        for program in ("tagrid-read-vdb", "tagrid-write-vdb"):
            self.assertIn(f"/usr/libexec/tagrid/{program}\n", content["tagrid-openvdb"])
        self.assertNotIn("tagrid-read-tiff", content["tagrid"])
        self.assertRegex(field["tagrid-readers"], r"Depends: .*libtiff")
        self.assertRegex(field["tagrid-openvdb"], r"Depends: .*libopenvdb")
        self.assertNotRegex(field["tagrid"], r"Depends: .*(libtiff|libopenvdb)")
        self.assertNotIn("libopenvdb", field["tagrid-readers"])
        self.assertIn("libtagrid.so.1 ->", content["libtagrid"])
        for path in ("include/tagrid/tagrid.h\n", "include/tagrid/tagrid.hpp", "libtagrid.so ->", "libtagrid.a", "tagrid.pc",
                     "tagridConfig.cmake", "examples/read_region.c"):
            self.assertIn(path, content["libtagrid-dev"])
            self.assertNotIn(path, content["libtagrid"])
            self.assertNotIn(path, content["tagrid"])
        self.assertNotIn("libtagrid.so.1", content["libtagrid-dev"].replace("-> libtagrid.so.1", ""))
        for name in ("tagrid", "libtagrid"):
            self.assertRegex(field[name], r"Depends: .*libtbb")
        self.assertRegex(field["libtagrid-dev"], r"Depends: .*libtagrid \(= ")
        for package in with_python:
            for path in ("/tagrid/__init__.py\n", "/tagrid/_tagrid.cpython", "/tagrid/py.typed\n", ".dist-info/entry_points.txt\n"):
                self.assertIn(path, content[package])
            self.assertRegex(field[package], r"Depends: .*libtagrid \(= .*python3-numpy")
        architecture = run("dpkg-architecture", "-qDEB_HOST_MULTIARCH").strip()
        self.assertIn(f"./usr/lib/{architecture}/libtagrid.so.1 ->", content["libtagrid"])
        for path in ("libtagrid.a", "pkgconfig/tagrid.pc", "cmake/tagrid/tagridConfig.cmake"):
            self.assertIn(f"./usr/lib/{architecture}/{path}\n", content["libtagrid-dev"])
        if plugins:
            self.assertIn(f"./usr/lib/{architecture}/hdf5/serial/plugins/libtagrid_hdf5.so\n", content["tagrid-hdf5"])
            self.assertRegex(field["tagrid-hdf5"], r"Depends: .*libhdf5")
            self.assertRegex(field["tagrid-hdf5"], r"Depends: .*libtagrid \(= ")
        for name in packages:
            self.assertRegex(field[name], r"Maintainer: [^<@]+ <[^@\s]+@[^@\s]+>")
            self.assertNotIn("tagrid@localhost", field[name])
        # As docs/tour.md says, and with nothing that Debian does not have.
        if shutil.which("apt-get"):
            said = run("apt-get", "install", "-s", "-y", *packages.values())
            self.assertEqual(set(re.findall(r"^Inst (\S*tagrid\S*) ", said, re.MULTILINE)), set(packages))
            self.assertIn("Description: CT volumes as one file", field[name])


if __name__ == "__main__":
    unittest.main()
