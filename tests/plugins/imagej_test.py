"""ImageJ opens .tag files: the plugin is compiled, and run in ImageJ without a screen, and by its menu on a virtual
one.

    imagej_test.py PROGRAM

ImageJ is Debian's libij-java, or the jar that TAGRID_IMAGEJ names.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

try:
    import tifffile
except ImportError:
    tifffile = None

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCES = ROOT / "plugins/imagej"
GOLDEN = ROOT / "tests/golden/1.0"
JAR = pathlib.Path(os.environ.get("TAGRID_IMAGEJ", "/usr/share/java/ij.jar"))
#: The program's types of samples, and those of ImageJ's pixels.
PIXELS = {"uint8": "u1", "int8": "u2", "uint16": "u2", "int16": "u2", "uint32": "f4", "int32": "f4", "float32": "f4",
          "float64": "f4"}
#: Opens files as ImageJ's plugins do, says what ImageJ knows of them, and saves their pixels. ImageJ's own command for
#: that needs its menus, and so a screen.
HARNESS = """
import ij.*;
import ij.io.FileSaver;
import ij.measure.Calibration;
import java.nio.file.*;

public class Harness {
  public static void main(String[] arguments) throws Exception {
    for (String line : Files.readAllLines(Paths.get(arguments[0]))) {
      String[] parts = line.split("\\t");
      ImagePlus image = Tagrid_Reader.open(parts[0], 0);
      image.setSlice(2);
      Calibration place = image.getCalibration();
      image.getProcessor().setCalibrationTable(place.getCTable());
      String dims = image.getWidth() + " " + image.getHeight() + " " + image.getStackSize();
      String steps = place.pixelWidth + " " + place.pixelHeight + " " + place.pixelDepth + " " + place.getUnit();
      System.out.println(String.join("\\t", "FOUND", image.getTitle(), dims, "" + image.getBitDepth(), steps,
          "" + image.getProcessor().getPixelValue(3, 2), place.getValueUnit()));
      new FileSaver(image).saveAsTiffStack(parts[1]);
    }
  }
}
"""


def missing():
    gone = [tool for tool in ("java", "javac", "jar") if not shutil.which(tool)]
    if gone:
        return f"there is no {', '.join(gone)} (Debian: default-jdk-headless)"
    if tifffile is None:
        return "there is no tifffile (Debian: python3-tifffile)"
    return "" if JAR.exists() else f"there is no {JAR} (Debian: libij-java)"


class ImageJ(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        classes = cls.folder / "classes"
        classes.mkdir()
        (cls.folder / "plugins").mkdir()
        cls.javac(classes, SOURCES / "Tagrid_Reader.java")
        subprocess.run(["jar", "cf", cls.folder / "plugins/Tagrid_.jar", "-C", classes, ".", "-C", SOURCES, "plugins.config"],
                       check=True)

        (cls.folder / "Harness.java").write_text(HARNESS)
        cls.harness = cls.folder / "harness"
        cls.harness.mkdir()
        cls.javac(cls.harness, cls.folder / "Harness.java", SOURCES / "Tagrid_Reader.java")

    @staticmethod
    def javac(into, *sources):
        subprocess.run(["javac", "--release", "8", "-Werror", "-Xlint:all,-options", "-cp", JAR, "-d", into, *sources],
                       check=True)

    def imagej(self, macro, argument="", before=(), headless=True):
        path = self.folder / "macro.ijm"
        path.write_text(macro)
        mode = ["-Djava.awt.headless=true"] if headless else []
        done = subprocess.run([*before, "java", *mode, f"-Dplugins.dir={self.folder}", f"-Duser.home={self.folder}", "-cp", JAR,
                               "ij.ImageJ", "-batch", path, argument], text=True, stdout=subprocess.PIPE, timeout=300,
                              stderr=subprocess.STDOUT, env={**os.environ, "TAGRID": str(PROGRAM)})
        return done.stdout

    def opened(self, *paths):
        """What ImageJ says of files, and their pixels."""
        names = [self.folder / f"{number}.tif" for number in range(len(paths))]
        (self.folder / "list").write_text("".join(f"{path}\t{name}\n" for path, name in zip(paths, names)))
        path = f"{JAR}:{self.harness}"
        done = subprocess.run(["java", "-Djava.awt.headless=true", "-Dfile.encoding=UTF-8", "-cp", path, "Harness", self.folder / "list"],
                              encoding="utf-8", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={**os.environ, "TAGRID": str(PROGRAM)}, timeout=300)
        lines = [line.split("\t")[1:] for line in done.stdout.splitlines() if line.startswith("FOUND")]
        self.assertEqual(len(lines), len(paths), done.stdout)
        return [(line, tifffile.imread(name)) for line, name in zip(lines, names)]

    def samples_of(self, path):
        """As the program decodes them: (z, y, x)."""
        whole = subprocess.run([PROGRAM, "decode", path, "--volume", "0", "--samples", "--format", "npy", "-q", "-o",
                                self.folder / "samples.npy", "-f"], check=True)
        self.assertEqual(whole.returncode, 0)
        return np.load(self.folder / "samples.npy")

    def test_samples_of_every_golden_file(self):
        paths = sorted(GOLDEN.glob("*.tag"))
        for path, (said, pixels) in zip(paths, self.opened(*paths)):
            samples = self.samples_of(path)
            name, dims, bits, *_, value, _ = said
            self.assertEqual((name, dims), (path.name, " ".join(map(str, samples.shape[::-1]))))
            kind = PIXELS[samples.dtype.name]
            self.assertEqual(int(bits), 8 * np.dtype(kind).itemsize)
            expected = samples.astype(np.int64) + 32768 if samples.dtype.name in ("int8", "int16") else samples
            with np.errstate(over="ignore"):
                np.testing.assert_array_equal(pixels.reshape(samples.shape), expected.astype(kind), path.name)
            self.assertEqual(pixels.dtype.newbyteorder("="), np.dtype(kind))
            if np.isfinite(samples[1, 2, 3]):
                sample = float(samples[1, 2, 3])
                self.assertAlmostEqual(float(value), sample, delta=abs(sample) * 1e-4 + 1e-4, msg=path.name)

    def written(self, name, samples, fields):
        nrrd = self.folder / f"{name}.nrrd"
        kind = {"float32": "float", "float64": "double"}.get(samples.dtype.name, samples.dtype.name)
        lines = ["NRRD0004", f"type: {kind}", "dimension: 3", f"sizes: {' '.join(map(str, samples.shape[::-1]))}",
                 "encoding: raw", "endian: little", fields]
        nrrd.write_bytes("\n".join(lines).encode() + b"\n" + samples.tobytes())
        path = self.folder / f"{name}.tag"
        subprocess.run([PROGRAM, "encode", nrrd, "-o", path, "-q", "-f"], check=True)
        return path

    def test_values_distances_and_units(self):
        scale = "rescale_slope:=2\nrescale_intercept:=-100\nrescale_units:=HU\n"
        turned = 'space dimension: 3\nspace directions: (0,0.5,0) (0.25,0,0) (0,0,2)\nspace units: "um" "um" "um"\n'
        cases = [(dtype, fields, steps, values) for dtype in ("uint8", "int8", "int16", "uint16", "int32", "float32")
                 for fields, steps, values in (("", "1 1 1 pixel", (1, 0)),
                                               ("spacings: 0.5 0.25 2\n", "0.5 0.25 2 mm", (1, 0)),
                                               (turned + scale, "0.5 0.25 2 \u00b5m", (2, -100)))]
        paths = []
        for number, (dtype, fields, *_) in enumerate(cases):
            samples = (np.arange(4 * 5 * 6).reshape(4, 5, 6) - (60 if np.dtype(dtype).kind != "u" else 0)).astype(dtype)
            paths.append(self.written(f"case{number}", samples, fields))
        for path, (dtype, fields, steps, (slope, intercept)), (said, _) in zip(paths, cases, self.opened(*paths)):
            sample = 30 + 12 + 3 - (60 if np.dtype(dtype).kind != "u" else 0)
            found = [float(number) if number[0].isdigit() else number for number in said[3].split()]
            wanted = [float(number) if number[0].isdigit() else number for number in steps.split()]
            self.assertEqual((float(said[4]), found), (slope * sample + intercept, wanted), f"{dtype} {fields}")
            self.assertEqual(said[5] == "HU", slope == 2)

    def test_a_macro_opens_it_without_a_screen(self):
        path = GOLDEN / "voxels_bounded_int16.tag"
        said = self.imagej('setBatchMode(true); call("ij.IJ.runPlugIn", "Tagrid_Reader", getArgument()); setSlice(6); '
                           'print("title: " + getTitle() + " " + nSlices + " " + getValue(3, 4));', path)
        samples = self.samples_of(path)
        self.assertIn(f"title: {path.name} {samples.shape[0]} {samples[5, 4, 3]}", said)

    def test_errors_are_what_the_program_says(self):
        (self.folder / "text.tag").write_text("text")
        said = self.imagej('setBatchMode(true); call("ij.IJ.runPlugIn", "Tagrid_Reader", getArgument()); '
                           'print("images: " + nImages);', self.folder / "text.tag")
        self.assertIn("text.tag", said)
        self.assertNotIn("images: 1", said)

    @unittest.skipUnless(shutil.which("xvfb-run"), "there is no xvfb-run")
    def test_the_menu_has_it(self):
        path = GOLDEN / "volumes_bounded_int16.tag"
        said = self.imagej(f'run("tagrid...", "open=[{path}] volume=1"); print("title: " + getTitle() + " " + nSlices);',
                           before=("xvfb-run", "-a"), headless=False)
        self.assertIn("title: volumes_bounded_int16.tag 11", said)


if __name__ == "__main__":
    if missing():
        print(f"skipped: {missing()}")
        sys.exit(0)
    unittest.main(argv=sys.argv[:1])
