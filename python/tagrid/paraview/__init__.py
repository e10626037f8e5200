"""Readers of .tag files for ParaView: the voxels as image data or as a structured grid, and the tetrahedra of the grid as an
unstructured grid.

In pvpython, or in the Python Shell of ParaView:

    import tagrid.paraview
    tagrid.paraview.load()

From then on, ParaView opens .tag files: File > Open asks which of the readers is wanted. In scripts they are
TagridImage, TagridStructuredGrid and TagridMesh of paraview.simple.

Debian 12 has ParaView 5.11.0 and Python 3.11, in which that ParaView loads no plugin that is written in Python: it imports
inspect.getargspec, which is gone. So its plugin manager fails there, and load() does not.
"""

import inspect
import pathlib

__all__ = ["load"]

# ParaView 5.11 only asks for the names of positional arguments, which both functions give.
if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec  # type: ignore[attr-defined]


def load(remote: bool = False) -> None:
    """Makes the readers known to ParaView: to this process or, with remote, to the server that it is connected to."""
    from paraview.simple import LoadPlugin

    # ParaView gives the module the name of the file, so that of a package would hide the package.
    LoadPlugin(str(pathlib.Path(__file__).with_name("tagrid_readers.py").resolve()), remote=remote)
