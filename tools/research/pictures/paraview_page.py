"""Follows docs/viewing.md in ParaView, checks what it shows, and draws the pictures of that page.

    tools/research/paraview.sh [--tagrid PROGRAM] [--output DIRECTORY]

Runs in pvpython, ParaView's own Python (Debian: python3-paraview, python3-pil), and needs a display. Ends with exit code 1
if anything is not as the program and the page say, and leaves the pictures that are in DIRECTORY as they are.
"""

import argparse
import array
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

from paraview import simple
from PIL import Image

SOURCES = Path(__file__).resolve().parents[3]
DIMS = (128, 128, 64)
SPACING = (0.7, 0.7, 1.5)
ISO = 300.5
SIZE = (760, 520)
LARGEST = 200_000  # bytes of a picture
FLOATS = 1e-4  # ParaView's contours and PLY files have 32-bit floats


class Different(Exception):
    """ParaView shows something else than it should."""


def expect(what, found, expected, tolerance=0.0):
    """Compares numbers, or tuples of numbers."""
    pairs = zip(found, expected) if isinstance(expected, (tuple, list)) else [(found, expected)]
    if any(not math.isclose(a, b, rel_tol=tolerance, abs_tol=tolerance) for a, b in pairs):
        raise Different(f"{what}: {found}, expected: {expected}")
    print(f"{what}: {found}")


class Files:
    """The files that the page makes, and what tagrid reports about them."""

    def __init__(self, program, directory):
        self._program, self.directory = program, directory
        self._run("phantom", "--dims", ",".join(map(str, DIMS)), "-o", "scan.nhdr")
        header = directory / "scan.nhdr"
        header.write_text(header.read_text().replace("spacings: 1 1 1", f"spacings: {' '.join(map(str, SPACING))}"))
        self._run("encode", "scan.nhdr", "--max-error", "5")
        self.mesh = self._settings_of("mesh", "scan.tag", "--level", "12", "-o", "scan.vtu")
        self._run("decode", "scan.tag", "-o", "scan.vti")
        self._run("decode", "scan.tag", "--format", "vtkhdf", "-o", "scan.hdf")
        self._run("decode", "scan.tag", "-o", "scan.vtkhdf")
        self._run("decode", "scan.tag", "-o", "scan.raw", "-f")
        self.level_surface = self._settings_of("surface", "scan.tag", "--iso", str(ISO), "--level", "12", "-o", "level.ply")
        self.surface = self._settings_of("surface", "scan.tag", "--iso", str(ISO), "-o", "bone.ply")

    def _run(self, *words):
        done = subprocess.run([str(self._program), *words, "-q"], cwd=self.directory, capture_output=True, text=True)
        if done.returncode != 0:
            raise Different(f"tagrid {' '.join(words)}: {done.stderr.strip()}")
        return done.stdout

    def _settings_of(self, *words):
        return json.loads(self._run(*words, "--json", "-"))["settings"]

    def turn(self):
        """The same samples with axes that are turned by 90 degrees about z."""
        x, y, z = SPACING
        header = (self.directory / "scan.nhdr").read_text().replace("dimension: 3\n", "dimension: 3\nspace: right-anterior-superior\n")
        spacings = f"spacings: {' '.join(map(str, SPACING))}"
        placed = f"space directions: (0,{x},0) (-{y},0,0) (0,0,{z})\nspace origin: (0,0,0)"
        (self.directory / "turned.nhdr").write_text(header.replace(spacings, placed))
        self._run("encode", "turned.nhdr")
        self._run("mesh", "turned.tag", "--level", "9", "-o", "turned.vtu")
        self._run("decode", "turned.tag", "-o", "turned.vti")
        self._run("decode", "turned.tag", "--format", "vtkhdf", "-o", "turned.hdf")

    def range_of_samples(self):
        samples = array.array("h", (self.directory / "scan.raw").read_bytes())
        return float(min(samples)), float(max(samples))

    def open(self, name):
        source = simple.OpenDataFile(str(self.directory / name))
        if source is None:
            raise Different(f"{name}: ParaView finds no reader")
        source.UpdatePipeline()
        return source


def of(source):
    source.UpdatePipeline()
    return source.GetDataInformation()


def bounds():
    return tuple(limit for n, spacing in zip(DIMS, SPACING) for limit in (0.0, (n - 1) * spacing))


def area_of(surface):
    """What the filter Integrate Variables says."""
    integral = simple.IntegrateVariables(Input=surface)
    integral.UpdatePipeline()
    return integral.CellData.GetArray("Area").GetRange()[0]


class Picture:
    """What one view shows, saved as PNG. All pictures have the same view."""

    def __init__(self, directory, name):
        self._path = directory / name
        self.view = simple.GetActiveViewOrCreate("RenderView")
        simple.HideAll(self.view)
        simple.HideUnusedScalarBars(self.view)
        self.view.ViewSize = SIZE
        self.view.UseColorPaletteForBackground = 0
        self.view.Background = (1, 1, 1)
        self.view.OrientationAxesVisibility = 0

    def show(self, source, representation, by=None, palette=None, title=None):
        display = simple.Show(source, self.view)
        display.SetRepresentationType(representation)
        if by:
            simple.ColorBy(display, by, separate=True)
            display.RescaleTransferFunctionToDataRange(False, True)
            table = simple.GetColorTransferFunction(by[1], display, separate=True)
            if palette:
                table.ApplyPreset(palette, True)
            if title:
                bar = simple.GetScalarBar(table, self.view)
                bar.Title, bar.ComponentTitle = title, ""
                bar.AutomaticLabelFormat, bar.LabelFormat, bar.RangeLabelFormat = 0, "%g", "%g"
                bar.TitleColor = bar.LabelColor = (0, 0, 0)
                display.SetScalarBarVisibility(self.view, True)
        else:
            display.ColorArrayName = [None, ""]
            display.AmbientColor = display.DiffuseColor = (0.86, 0.72, 0.58)
        return display

    def save(self, direction, zoom=1.0):
        camera = self.view.GetActiveCamera()
        camera.SetFocalPoint(0, 0, 0)
        camera.SetPosition(*(-d for d in direction))
        camera.SetViewUp(0, 0, 1)
        if abs(direction[2]) > 0.99:
            camera.SetViewUp(0, 1, 0)
        simple.ResetCamera(self.view)
        camera.Zoom(zoom)
        simple.SaveScreenshot(str(self._path), self.view, ImageResolution=SIZE)
        # As large as a page needs: with a palette.
        Image.open(self._path).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(self._path, optimize=True)
        size = self._path.stat().st_size
        if size > LARGEST:
            raise Different(f"{self._path.name}: {size} bytes, expected: {LARGEST} at most")


def volumes(files, output):
    """The decoded samples, in all three files that ParaView opens; a slice of them."""
    expected = files.range_of_samples()
    vtkhdf = simple.VTKHDFReader(FileName=str(files.directory / "scan.vtkhdf"))
    for name, source in (("scan.vti", files.open("scan.vti")), ("scan.hdf", files.open("scan.hdf")),
                         ("scan.vtkhdf, VTKHDF Reader", vtkhdf)):
        expect(f"{name}: points", of(source).GetNumberOfPoints(), math.prod(DIMS))
        expect(f"{name}: cells", of(source).GetNumberOfCells(), math.prod(n - 1 for n in DIMS))
        expect(f"{name}: bounds", of(source).GetBounds(), bounds(), 1e-6)
        expect(f"{name}: range of value", source.PointData.GetArray("value").GetRange(), expected)
    try:
        is_found = simple.OpenDataFile(str(files.directory / "scan.vtkhdf")) is not None
    except RuntimeError:
        is_found = False
    expect("scan.vtkhdf: a reader is found by its name", is_found,
           simple.servermanager.vtkSMProxyManager.GetVersionMinor() >= 13)
    source = files.open("scan.hdf")
    slice = simple.Slice(Input=source, SliceType="Plane")
    slice.SliceType.Origin = [(n - 1) * spacing / 2 for n, spacing in zip(DIMS, SPACING)]
    slice.SliceType.Normal = (0, 0, 1)
    expect("slice: points", of(slice).GetNumberOfPoints(), DIMS[0] * DIMS[1])
    picture = Picture(output, "volume.png")
    picture.show(slice, "Surface", ("POINTS", "value"), "Grayscale", "value")
    outline = picture.show(source, "Outline")
    outline.AmbientColor = outline.DiffuseColor = (0, 0, 0)
    picture.save((0.45, 0.8, -0.9))


def mesh(files, output):
    """The tetrahedra: clipped and colored by level; the contour of their values."""
    source = files.open("scan.vtu")
    expect("scan.vtu: tetrahedra", of(source).GetNumberOfCells(), files.mesh["tetrahedra"])
    expect("scan.vtu: points", of(source).GetNumberOfPoints(), files.mesh["points"])
    expect("scan.vtu: bounds", of(source).GetBounds(), bounds(), 1e-6)
    low, high = source.CellData.GetArray("level").GetRange()
    if not 0 <= low < high == 12:
        raise Different(f"scan.vtu: levels {low:g} to {high:g}, expected: up to 12")
    clip = simple.Clip(Input=source, ClipType="Plane", Crinkleclip=1)
    clip.ClipType.Origin = [(n - 1) * spacing / 2 for n, spacing in zip(DIMS, SPACING)]
    clip.ClipType.Normal = (0, 0, 1)
    other = simple.Clip(Input=source, ClipType="Plane", Crinkleclip=1, Invert=0)
    other.ClipType.Origin, other.ClipType.Normal = clip.ClipType.Origin, (0, 0, 1)
    both = of(clip).GetNumberOfCells() + of(other).GetNumberOfCells()
    if not files.mesh["tetrahedra"] <= both < 1.2 * files.mesh["tetrahedra"]:
        raise Different(f"both sides of the clip have {both} tetrahedra, the mesh {files.mesh['tetrahedra']}")
    print(f"clip: {of(clip).GetNumberOfCells()} tetrahedra")
    picture = Picture(output, "levels.png")
    picture.show(clip, "Surface With Edges", ("CELLS", "level"), "Viridis (matplotlib)", "level").EdgeColor = (0.15, 0.15, 0.2)
    picture.save((0.25, 0.55, -1.0), zoom=1.1)

    contour = simple.Contour(Input=source, ContourBy=["POINTS", "value"], Isosurfaces=[ISO])
    expect("contour of scan.vtu: area", area_of(contour), files.level_surface["area"], FLOATS)
    picture = Picture(output, "contour.png")
    picture.show(contour, "Surface")
    picture.save((0.5, 0.85, -0.2))


def surface(files, output):
    """The triangles that tagrid made."""
    source = files.open("bone.ply")
    expect("bone.ply: triangles", of(source).GetNumberOfCells(), files.surface["triangles"])
    expect("bone.ply: vertices", of(source).GetNumberOfPoints(), files.surface["vertices"])
    expect("bone.ply: area", area_of(source), files.surface["area"], FLOATS)
    picture = Picture(output, "surface.png")
    picture.show(source, "Surface")
    picture.save((0.5, 0.85, -0.2))


def readers(files, output):
    """The .tag file itself: a slice of its voxels beside its tetrahedra."""
    import tagrid.paraview

    tagrid.paraview.load()
    path = str(files.directory / "scan.tag")
    image, grid = simple.TagridImage(FileName=path), simple.TagridMesh(FileName=path, Level=12)
    for name, source in (("image", image), ("structured grid", simple.TagridStructuredGrid(FileName=path))):
        expect(f"scan.tag, {name}: points", of(source).GetNumberOfPoints(), math.prod(DIMS))
        expect(f"scan.tag, {name}: bounds", of(source).GetBounds(), bounds(), 1e-6)
        expect(f"scan.tag, {name}: range of value", source.PointData.GetArray("value").GetRange(), files.range_of_samples())
    expect("scan.tag, mesh: tetrahedra", of(grid).GetNumberOfCells(), files.mesh["tetrahedra"])
    expect("scan.tag, mesh: points", of(grid).GetNumberOfPoints(), files.mesh["points"])
    middle = [(n - 1) * spacing / 2 for n, spacing in zip(DIMS, SPACING)]
    slice = simple.Slice(Input=image, SliceType="Plane")
    slice.SliceType.Origin, slice.SliceType.Normal = middle, (0, 0, 1)
    half = grid
    for normal in ((0, 0, 1), (-1, 0, 0)):
        half = simple.Clip(Input=half, ClipType="Plane", Crinkleclip=1)
        half.ClipType.Origin, half.ClipType.Normal = middle, normal
    picture = Picture(output, "reader.png")
    picture.show(slice, "Surface", ("POINTS", "value"), "Grayscale")
    picture.show(half, "Surface With Edges", ("CELLS", "level"), "Viridis (matplotlib)", "level").EdgeColor = (0.15, 0.15, 0.2)
    picture.save((0.25, 0.55, -1.0), zoom=1.1)


def directions(files):
    """A volume that is turned by 90 degrees about z: what lies where it should, and what the page warns of."""
    files.turn()
    turned = (-bounds()[3], 0.0, *bounds()[:2], *bounds()[4:])
    vti, vtu = files.open("turned.vti"), files.open("turned.vtu")
    expect("turned.vti: bounds", of(vti).GetBounds(), turned, 1e-6)
    expect("turned.vtu: bounds", of(vtu).GetBounds(), turned, 1e-6)
    expect("turned.hdf: bounds, not turned", of(files.open("turned.hdf")).GetBounds(), bounds(), 1e-6)
    for name, source, is_turned in (("turned.vti", vti, False), ("turned.vtu", vtu, True)):
        contour = simple.Contour(Input=source, ContourBy=["POINTS", "value"], Isosurfaces=[ISO])
        if (of(contour).GetBounds()[1] < 0) != is_turned:
            raise Different(f"contour of {name}: {of(contour).GetBounds()}, expected: {'' if is_turned else 'not '}turned")
        print(f"contour of {name}: {'' if is_turned else 'not '}turned, as the page says")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tagrid", type=Path, default=SOURCES / "build/release/tagrid", metavar="PROGRAM")
    parser.add_argument("--output", type=Path, default=SOURCES / "docs/paraview", metavar="DIRECTORY")
    options = parser.parse_args()
    # The Python package is beside the program where it was built with -DTAGRID_PYTHON=ON.
    sys.path.append(str(options.tagrid.resolve().parent / "python"))
    with tempfile.TemporaryDirectory() as directory, tempfile.TemporaryDirectory() as drawn:
        try:
            files = Files(options.tagrid.resolve(), Path(directory))
            for step in (volumes, mesh, surface, readers):
                step(files, Path(drawn))
            directions(files)
            # ParaView 5.11 may crash when the interpreter ends with a view.
            simple.Disconnect()
        except Different as different:
            print(f"{Path(__file__).name}: {different}", file=sys.stderr)
            return 1
        options.output.mkdir(parents=True, exist_ok=True)
        for picture in sorted(Path(drawn).iterdir()):
            (options.output / picture.name).write_bytes(picture.read_bytes())
    return 0


if __name__ == "__main__":
    sys.exit(main())
