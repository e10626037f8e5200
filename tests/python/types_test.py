"""What mypy knows about the package: programs that use it rightly have no error, and others do."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

PROGRAM = '''
import numpy as np
import tagrid
import tagrid.hdf5
import tagrid.zarr

volume = tagrid.open("scan.tag")
reveal_type(volume.shape)  # tuple[builtins.int, builtins.int, builtins.int]
reveal_type(volume.spacing)  # tuple[builtins.float, builtins.float, builtins.float]
reveal_type(volume.achieved["max_error"])  # builtins.float
reveal_type(volume.affine)  # numpy.ndarray
reveal_type(volume.read(region=((0, 2), (0, None), (1, 3)), step=2))  # numpy.ndarray
reveal_type(volume.rescaled.read(step=2))  # numpy.ndarray
reveal_type(volume.mesh(level=3).cells)  # numpy.ndarray
reveal_type(volume.surface(3.5).triangles)  # numpy.ndarray
array = np.zeros((2, 3, 4), np.int16)
reveal_type(tagrid.encode(array, max_error=5))  # builtins.bytes
reveal_type(tagrid.encode(array, "a.tag", 5, (2, 1, 1)))  # Revealed type is "None"
reveal_type(tagrid.encode(array, open("a.tag", "wb")))  # Revealed type is "None"
tagrid.encode(array, 5)  # error:
with tagrid.Writer("a.tag", shape=array.shape, dtype="int16", max_error=5) as writer:
    writer.write(array)
points, triangles = volume.surface(3)
reveal_type(points)  # numpy.ndarray
print({**tagrid.hdf5.Filter(max_error=5)}, len(tagrid.zarr.Store("scan.tag")))
volume.read(region=5)  # error: Argument "region"
volume.mesh(level="all")  # error: No overload variant of "mesh"
tagrid.encode(array, max_error="noise:2")
tagrid.encode(array, max_error=[5])  # error:
volume.shpae  # error: "Volume" has no attribute "shpae"
'''


def main():
    mypy = shutil.which("mypy")
    if not mypy:
        print("skipped: there is no mypy on this machine (Debian: mypy)")
        return 0
    # mypy reports nothing about packages that Python itself finds.
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "program.py")
        path.write_text(PROGRAM)
        run = subprocess.run([mypy, "--strict", "--no-error-summary", "--cache-dir", pathlib.Path(folder, "cache"), "program.py"], cwd=folder,
                             env=environment | {"MYPYPATH": str(pathlib.Path(sys.argv[2], "python"))}, text=True,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    said = {}
    for line in run.stdout.splitlines():
        place = re.fullmatch(r"program\.py:(\d+): (.*)", line)
        if not place:
            raise AssertionError(f"mypy has something against the package itself:\n{run.stdout}")
        # Older versions of mypy say Tuple.
        said.setdefault(int(place[1]), []).append(place[2].replace("Tuple[", "tuple["))
    for number, line in enumerate(PROGRAM.splitlines(), 1):
        expected = line.partition("  # ")[2]
        found = " ".join(said.get(number, []))
        if expected not in found or bool(expected) != bool(found):
            raise AssertionError(f"{line}\nmypy says: {found or 'nothing'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
