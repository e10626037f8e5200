"""3D Slicer opens .tag files: add the directory of this file under Edit, Application Settings, Modules, Additional
module paths.

The program `tagrid` decodes the file to a temporary file, which Slicer reads, and says where the samples are. It is
looked for in the environment variable TAGRID, then in PATH. Without the program, the package tagrid_reader decodes the
file, if it is installed in Slicer's Python.
"""

import json
import math
import os
import re
import shutil
import subprocess
import tempfile

from slicer.ScriptedLoadableModule import ScriptedLoadableModule

#: How a .tag file begins.
MAGIC = b"\x89TAG\r\n\x1a\n"
#: Millimeters, which all lengths in Slicer are: the program's table of units (io/metadata/lengths.cpp). A test compares them
#: (tests/plugins/units_test.py).
MILLIMETERS = {"fm": 1e-12, "pm": 1e-9, "angstrom": 1e-7, "nm": 1e-6, "um": 1e-3, "mm": 1, "cm": 10, "dm": 100, "m": 1e3, "dam": 1e4,
               "hm": 1e5, "km": 1e6, "mil": 0.0254, "inch": 25.4, "ft": 304.8, "yd": 914.4}
#: Other spellings, as they are.
SPELLINGS = {"\u00b5m": "um", "\u03bcm": "um", "\u00b5": "um", "\u03bc": "um", "\\u00B5m": "um", "\\u03BCm": "um",
             "\u00c5": "angstrom", "\u212b": "angstrom", "A": "angstrom", '"': "inch"}
#: Words in small letters, without the "s" of several; "metre" is "meter".
WORDS = {"femtometer": "fm", "picometer": "pm", "nanometer": "nm", "micron": "um", "micrometer": "um", "millimeter": "mm",
         "centimeter": "cm", "decimeter": "dm", "meter": "m", "kilometer": "km", "angstrom": "angstrom",
         "\u00e5ngstr\u00f6m": "angstrom", "ang": "angstrom", "mil": "mil", "thou": "mil", "inch": "inch", "inche": "inch",
         "in": "inch", "foot": "ft", "feet": "ft", "yard": "yd"}


def millimeters(unit):
    """The millimeters of a unit of length; 1 if the file has none. Prints that a unit is not known, and takes 1."""
    name = (unit or "").strip()
    if not name:
        return 1
    word = name.lower()
    # In a name in capitals only, M is not the prefix mega.
    in_capitals = word if name.isascii() and name.isalpha() and name.isupper() else None
    word = word[:-1] if word.endswith("s") else word
    word = word[:-2] + "er" if word.endswith("metre") else word
    usual = SPELLINGS.get(name) or (in_capitals if in_capitals in MILLIMETERS else WORDS.get(word, name))
    if usual not in MILLIMETERS:
        print(f"tagrid: the unit {unit!r} is not known; its lengths count as millimeters")
    return MILLIMETERS.get(usual, 1)


def ijk_to_ras(geometry):
    """The 4 x 4 matrix, as four rows, from the number of a sample (x, y, z, 1) to its place in Slicer: right, anterior,
    superior, in mm.

    geometry: that of `tagrid info --json`. What it does not give is 1 apart, from 0 on. Places in a system that is not
    known stay as they are, as those in NIfTI files of tagrid, and lengths without a unit count as mm.
    """
    spacing = [step if step else 1 for step in geometry["spacing"] or (1, 1, 1)]
    columns = geometry["directions"] or [[spacing[axis] if row == axis else 0 for row in range(3)] for axis in range(3)]
    origin = geometry["origin"] or (0, 0, 0)
    scale = [millimeters(unit) for unit in geometry["units"] or ("mm",) * 3]
    rows = [[scale[row] * column[row] for column in [*columns, origin]] for row in range(3)]
    turned = [[float(sign * number) for number in row] for sign, row in zip(signs_of(geometry["space"] or ""), rows)]
    return [*turned, [0.0, 0.0, 0.0, 1.0]]


def signs_of(space):
    """Of "left-posterior-superior" or "LPS": what turns x, y and z to right, anterior and superior."""
    words = list(space.lower()) if len(space) == 3 else space.lower().split("-")
    signs = [{there: 1, back: -1}.get(word[:1], 0) for (there, back), word in zip(("rl", "ap", "si"), words)]
    return signs if len(words) == 3 and all(signs) else [1, 1, 1]


def program():
    """The path of the program. FileNotFoundError: there is none."""
    found = shutil.which(os.environ.get("TAGRID", "tagrid"))
    if found is None:
        raise FileNotFoundError("the program tagrid was not found: install it, or set TAGRID to its path "
                                "before Slicer starts; or install the package tagrid_reader in Slicer's Python")
    return found


def package():
    """The package tagrid_reader, if there is no program; None otherwise."""
    if "TAGRID" in os.environ or shutil.which("tagrid"):
        return None
    try:
        import tagrid_reader
    except ImportError:
        return None
    return tagrid_reader


def geometry_of(volume):
    """As `tagrid info --json` gives it, of a volume of tagrid_reader."""
    info, metadata = volume.info, volume.metadata
    words = metadata.get("space units") or metadata.get("units") or ""
    units = re.findall(r'"([^"]*)"', words)
    spacing = [None if math.isnan(step) else step for step in info["spacing"]]
    return {"spacing": spacing if info["has_spacing"] else None,
            "directions": info["directions"] if info["has_directions"] else None,
            "origin": info["origin"] if info["has_origin"] else None,
            "space": metadata.get("space"), "units": units if len(units) == 3 else None}


def run(*arguments):
    """What the program prints. RuntimeError: what it says of an error."""
    try:
        # Slicer's own libraries are not for other programs.
        from slicer.util import startupEnvironment
        environment = startupEnvironment()
    except ImportError:
        environment = None
    done = subprocess.run([program(), *arguments], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, encoding="utf-8", errors="replace", check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


class TagridReader(ScriptedLoadableModule):
    """The module: it has nothing but the reader."""

    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "tagrid reader"
        parent.categories = ["Informatics"]
        parent.contributors = ["tagrid"]
        parent.helpText = "Opens .tag files, which the program tagrid writes."
        parent.hidden = True


class TagridReaderFileReader:
    """What Slicer calls. It finds the class by its name."""

    def __init__(self, parent):
        self.parent = parent

    def description(self):
        return "tagrid volume"

    def fileType(self):
        return "TagridFile"

    def extensions(self):
        return ["tagrid volume (*.tag)"]

    def canLoadFile(self, path):
        try:
            with open(path, "rb") as file:
                return file.read(len(MAGIC)) == MAGIC
        except OSError:
            return False

    def load(self, properties):
        """Loads volume 0 of the file properties["fileName"], with values, such as HU. properties["name"] may be the
        name of the node. Returns whether it did; otherwise it has shown why not."""
        import slicer
        import vtk
        path = properties["fileName"]
        name = properties.get("name") or os.path.splitext(os.path.basename(path))[0]
        try:
            reader = package()
            if reader is not None:
                with reader.open(path) as volume:
                    matrix = ijk_to_ras(geometry_of(volume))
                    node = slicer.util.addVolumeFromArray(volume.rescaled.read(), ijkToRAS=matrix, name=name)
                self.parent.loadedNodes = [node.GetID()]
                return True
            matrix = vtk.vtkMatrix4x4()
            geometry = json.loads(run("info", path, "--json", "--no-levels"))["geometry"]
            for row, numbers in enumerate(ijk_to_ras(geometry)):
                for column, number in enumerate(numbers):
                    matrix.SetElement(row, column, number)
            with tempfile.TemporaryDirectory(prefix="tagrid-") as folder:
                decoded = os.path.join(folder, "volume.nrrd")
                run("decode", path, "--volume", "0", "--values", "-q", "-o", decoded)
                node = slicer.util.loadVolume(decoded, {"name": name})
            node.SetIJKToRASMatrix(matrix)
            # The temporary file is gone, so that saving must not expect it.
            node.SetAndObserveStorageNodeID(None)
        except Exception as error:
            slicer.util.errorDisplay(f"{path}: {error}")
            return False
        self.parent.loadedNodes = [node.GetID()]
        return True
