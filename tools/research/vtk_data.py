"""Arrays as data of VTK, and what its filters make of them."""

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkImageData, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkContourFilter, vtkFeatureEdges
from vtkmodules.vtkIOPLY import vtkPLYReader


def made_by(algorithm, data=None, **settings):
    """Applies settings, such as NumberOfSides=12, to a filter or a source of VTK, and returns its output."""
    if data is not None:
        algorithm.SetInputData(data)
    for name, value in settings.items():
        getattr(algorithm, f"Set{name}")(*(value if isinstance(value, tuple) else (value,)))
    algorithm.Update()
    return algorithm.GetOutput()


def with_points(data, points):
    places = vtkPoints()
    places.SetData(numpy_to_vtk(numpy.ascontiguousarray(points, dtype=float), deep=1))
    data.SetPoints(places)
    return data


def cells_of(rows):
    rows = numpy.ascontiguousarray(rows, dtype=numpy.int64)
    cells = vtkCellArray()
    offsets = numpy.arange(0, rows.size + 1, rows.shape[1], dtype=numpy.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(rows.reshape(-1), deep=1))
    return cells


def triangles_of(points, triangles):
    """`triangles`: rows of indices of points."""
    data = with_points(vtkPolyData(), points)
    data.SetPolys(cells_of(triangles))
    return data


def lines_of(points, lines):
    data = with_points(vtkPolyData(), points)
    data.SetLines(cells_of(lines))
    return data


def tetrahedra_of(points, tetrahedra, values=None):
    grid = with_points(vtkUnstructuredGrid(), points)
    grid.SetCells(VTK_TETRA, cells_of(tetrahedra))
    if values is not None:
        grid.GetPointData().SetScalars(numpy_to_vtk(values.astype(float), deep=1))
    return grid


def image_of(samples, spacing=(1, 1, 1)):
    """`samples`: [z, y, x]; `spacing`: x, y, z."""
    image = vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.SetSpacing(*spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(numpy.ascontiguousarray(samples).reshape(-1), deep=1))
    return image


def contour_of(mesh, iso):
    """VTK's isosurface of a mesh."""
    grid = tetrahedra_of(mesh.points, mesh.tetrahedra, mesh.values)
    return made_by(vtkContourFilter(), grid, Value=(0, iso), ComputeScalars=False)


def read_ply(path):
    return made_by(vtkPLYReader(), FileName=str(path))


def points_of(data):
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float) if data.GetNumberOfPoints() else numpy.empty((0, 3))


def open_edges(surface):
    """The edges that only one triangle has: positions of their ends [n, 2, 3]."""
    lines = made_by(vtkFeatureEdges(), surface, BoundaryEdges=True, FeatureEdges=False, ManifoldEdges=False,
                    NonManifoldEdges=False, Coloring=False)
    if not lines.GetNumberOfLines():
        return numpy.empty((0, 2, 3))
    return points_of(lines)[vtk_to_numpy(lines.GetLines().GetConnectivityArray()).reshape(-1, 2)]


def part_of(surface, is_wanted):
    """The triangles for whose corners [n, 3, 3] the function is true."""
    points = points_of(surface)
    triangles = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return triangles_of(points, triangles[is_wanted(points[triangles])])
