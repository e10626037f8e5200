"""Readers of .tag files for ParaView: voxels as image data or as a structured grid, and the tetrahedra of the
grid as an unstructured grid.

In pvpython, or in ParaView's Python Shell:

    import tagrid.paraview
    tagrid.paraview.load()

ParaView then opens .tag files, and File > Open lets you choose a reader. In scripts, they are TagridImage,
TagridStructuredGrid and TagridMesh of paraview.simple.

Debian 12 has ParaView 5.11.0, which imports inspect.getargspec to load plugins written in Python. Python 3.11
has removed that function. The plugin manager therefore fails there, but load() works.
"""

import inspect
import pathlib

__all__ = ["load"]

# ParaView 5.11 only needs the names of positional arguments, which both functions return.
if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec  # type: ignore[attr-defined]


def load(remote: bool = False) -> None:
    """Registers the readers in this ParaView process or, with remote, on the connected server."""
    from paraview.simple import LoadPlugin

    # ParaView names the module after the file, so a file named like the package would hide the package.
    LoadPlugin(str(pathlib.Path(__file__).with_name("tagrid_readers.py").resolve()), remote=remote)
