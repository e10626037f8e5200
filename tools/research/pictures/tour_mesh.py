"""Follows the ParaView step of docs/tour.md in pvpython: draws the lower half of a mesh, and prints how many tetrahedra it has.

    xvfb-run pvpython tools/research/pictures/tour_mesh.py MESH.vtu PICTURE.png
"""

import sys
from pathlib import Path

from paraview import simple

sys.path.insert(0, str(Path(__file__).resolve().parent))
from paraview_page import Picture, of

source = simple.OpenDataFile(sys.argv[1])
print(of(source).GetNumberOfCells(), "tetrahedra")
x0, x1, y0, y1, z0, z1 = of(source).GetBounds()
clip = simple.Clip(Input=source, ClipType="Plane", Crinkleclip=1)
clip.ClipType.Origin, clip.ClipType.Normal = [(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2], (0, 0, 1)
output = Path(sys.argv[2])
picture = Picture(output.parent, output.name)
picture.show(clip, "Surface With Edges", ("CELLS", "level"), "Viridis (matplotlib)", "level").EdgeColor = (0.15, 0.15, 0.2)
picture.save((0.25, 0.55, -1.0), zoom=1.1)
# ParaView 5.11 may crash when the interpreter ends with a view.
simple.Disconnect()
