"""What a person sees on a terminal: bars, the lines above them, and one line about what was written."""

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import sys
import tempfile
import termios
import unittest
from pathlib import Path

TAGRID = os.path.abspath(sys.argv.pop(1))


class Screen:
    """The lines of a terminal that is `width` columns wide, as xterm shows them: all that have scrolled away, too."""

    def __init__(self, width):
        self.width, self.lines, self.column, self.bars = width, [""], 0, []

    def take(self, text):
        for part in re.findall(r"\x1b\[K|\r|\n|[^\x1b\r\n]|\x1b", text):
            line = self.lines[-1]
            if part == "\r":
                if line.startswith("["):
                    self.bars.append(line)
                self.column = 0
            elif part == "\n":
                self.lines.append("")
                self.column = 0
            elif part == "\x1b[K":
                self.lines[-1] = line[:self.column]
            else:
                assert part.isprintable() or part == "\t", repr(text)
                if self.column == self.width:  # it wraps
                    self.lines.append("")
                    self.column = 0
                line = self.lines[-1]
                self.lines[-1] = line[:self.column] + part + line[self.column + 1:]
                self.column += 1


class Terminal(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def plain(self, *arguments):
        run = subprocess.run([TAGRID, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stderr

    def seen(self, *arguments, width=100, code=0):
        """Runs the program with a terminal as standard error and standard output."""
        inside, outside = pty.openpty()[::-1]
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 25, width, 0, 0))
        process = subprocess.Popen([TAGRID, *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
                                   stdout=inside, stderr=inside)
        os.close(inside)
        screen = Screen(width)
        while True:
            select.select([outside], [], [])
            try:
                data = os.read(outside, 1 << 16)
            except OSError:  # the program has ended
                break
            screen.take(data.decode())
        os.close(outside)
        self.assertEqual(process.wait(), code, screen.lines)
        return screen

    def volumes(self, count, dims="160,150,140"):
        names = [f"v{i}.nrrd" for i in range(count)]
        for i, name in enumerate(names):
            self.plain("phantom", "--dims", dims, "--seed", i, "-qo", name)
        (self.folder / "list.tsv").write_text("".join(name + "\n" for name in names))
        return names

    def test_a_warning_stands_on_a_line_of_its_own_above_the_bar(self):
        names = self.volumes(4)
        warnings = [f"tagrid: warning: {name}: --max-error 0.5: samples are integers, so this is 0 (lossless)" for name in names]
        for width in (100, 50):
            screen = self.seen("convert", "--manifest", "list.tsv", "--output-dir", f"out{width}", "--max-error", "0.5", "-T1",
                               width=width)
            self.assertTrue(screen.bars)
            for bar in screen.bars:
                self.assertLess(len(bar), width, "a longer one would wrap")
                self.assertRegex(bar + " " * width, r"^\[#* *\] \d of 4 v")
            text = "\n".join(screen.lines)
            if width == 100:
                self.assertEqual(screen.lines[:-2], warnings)
                self.assertRegex(screen.lines[-2], r"^volumes: 4, 4 encoded; ")
                self.assertTrue(any(re.search(r"\d of 4 volumes, \d.* MB, \d.* MB/s, .* left", bar) for bar in screen.bars), screen.bars)
            self.assertNotIn("[#", text)
            self.assertEqual(screen.lines[-1], "")

    def test_success_says_one_line(self):
        (name,) = self.volumes(1)
        for command, line in ((["encode", name, "--max-error", "5"], r"6.72 MB -> .*, ratio \d+\.\d\d, .* bits per voxel, largest error 5"),
                              (["decode", "v0.tag", "-o", "back.nrrd"], r".* -> 6.72 MB, ratio .*, largest error 5"),
                              (["mesh", "v0.tag", "--level", "6", "-o", "a.vtu"], r"\d+ points, \d+ tetrahedra"),
                              (["surface", "v0.tag", "--iso", "500", "-o", "a.ply"], r"\d+ vertices, \d+ triangles")):
            lines = self.seen(*command, "-f").lines
            self.assertEqual(len(lines), 2, lines)
            self.assertRegex(lines[0], f"^{line}$")
            self.assertEqual(self.seen(*command, "-f", "-q").lines, [""])
            self.assertEqual(self.plain(*command, "-f"), "", "there is no terminal")
        self.plain("encode", name, "-fq")
        self.assertEqual(self.seen("restore", "v0.tag", "-o", "back").lines, ["1 file restored, byte for byte: all checksums agree", ""])

    def test_a_signal_clears_the_bar(self):
        (name,) = self.volumes(1, "400,400,300")
        inside, outside = pty.openpty()[::-1]
        process = subprocess.Popen([TAGRID, "encode", name, "--resume", "-T1", "--progress=bar"], cwd=self.folder, stderr=inside)
        os.close(inside)
        screen = Screen(1000)
        while "#" not in screen.lines[-1]:
            screen.take(os.read(outside, 1 << 16).decode())
        process.terminate()
        self.assertEqual(process.wait(), 75)
        try:
            while True:
                screen.take(os.read(outside, 1 << 16).decode())
        except OSError:
            os.close(outside)
        self.assertEqual(screen.lines, ["tagrid: interrupted; the same command continues from here", ""])

    def test_the_search_for_volumes_counts_them_while_the_list_goes_elsewhere(self):
        (name,) = self.volumes(1, "9,8,7")
        scans = self.folder / "scans"
        scans.mkdir()
        for i in range(200):
            (scans / f"{i:0200}.nrrd").write_bytes((self.folder / name).read_bytes())
        inside, outside = pty.openpty()[::-1]
        with subprocess.Popen([TAGRID, "convert", "--find", "scans", "--progress=bar"], cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=inside) as process:
            os.close(inside)
            screen = Screen(1000)
            # Nobody reads the list yet, so the program waits.
            while not re.search("^[1-9][0-9]* volumes found; .*/scans$", screen.lines[-1]):
                screen.take(os.read(outside, 1 << 16).decode())
            self.assertEqual(process.stdout.read().count(b"\toutput="), 200)
            try:
                while True:
                    screen.take(os.read(outside, 1 << 16).decode())
            except OSError:
                os.close(outside)
        self.assertEqual((process.returncode, screen.lines), (0, ["volumes: 200", ""]))

    def test_a_list_on_a_terminal_does_not_act_on_it_and_one_in_a_file_has_the_names(self):
        (name,) = self.volumes(1, "9,8,7")
        # A control character of C1, and one that turns the direction of writing.
        strange = "a\x9b31m\u202eb.nrrd"
        os.rename(self.folder / name, self.folder / strange)
        text = "\n".join(self.seen("convert", "--find", ".").lines)
        self.assertIn("a\\xc2\\x9b31m\\xe2\\x80\\xaeb.nrrd", text)
        run = subprocess.run([TAGRID, "convert", "--find", "."], cwd=self.folder, capture_output=True, text=True, check=True)
        lines = [line for line in run.stdout.splitlines() if not line.startswith("#")]
        self.assertTrue(lines[0].split("\t")[0].endswith(strange), lines)
        for line in run.stdout.split("\n"):
            self.assertTrue(not line.startswith("#") or line.isprintable(), repr(line))
        (self.folder / "list.tsv").write_text(run.stdout)
        self.plain("convert", "--manifest", "list.tsv", "--output-dir", "out")


if __name__ == "__main__":
    unittest.main()
