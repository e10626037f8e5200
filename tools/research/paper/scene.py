"""Pictures of things in space, drawn by VTK."""

import numpy
from PIL import Image
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkImageData, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkContourFilter, vtkFeatureEdges, vtkFlyingEdges3D, vtkPolyDataNormals, vtkTubeFilter
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOPLY import vtkPLYReader
from vtkmodules.vtkRenderingCore import (vtkActor, vtkBillboardTextActor3D, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow,
                                         vtkWindowToImageFilter)
import vtkmodules.vtkRenderingFreeType  # noqa: F401  the texts
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  what draws

import colours
from mesh import FACES

FINER = 2  # pictures are drawn larger by this factor


def poly(points, triangles=None, lines=None):
    """Triangles or lines, rows of indices of points, as VTK has them."""
    data = vtkPolyData()
    places = vtkPoints()
    places.SetData(numpy_to_vtk(numpy.ascontiguousarray(points, dtype=float), deep=1))
    data.SetPoints(places)
    for rows, take in ((triangles, data.SetPolys), (lines, data.SetLines)):
        if rows is not None:
            take(cells_of(rows))
    return data


def cells_of(rows):
    rows = numpy.ascontiguousarray(rows, dtype=numpy.int64)
    cells = vtkCellArray()
    offsets = numpy.arange(0, rows.size + 1, rows.shape[1], dtype=numpy.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(rows.reshape(-1), deep=1))
    return cells


def grid_of(mesh):
    """A Mesh as VTK has it, with the values of its points."""
    grid = vtkUnstructuredGrid()
    places = vtkPoints()
    places.SetData(numpy_to_vtk(numpy.ascontiguousarray(mesh.points), deep=1))
    grid.SetPoints(places)
    grid.SetCells(VTK_TETRA, cells_of(mesh.tetrahedra))
    grid.GetPointData().SetScalars(numpy_to_vtk(mesh.values.astype(float), deep=1))
    return grid


def contour_of(mesh, iso):
    """VTK's own isosurface of a mesh."""
    contour = vtkContourFilter()
    contour.SetInputData(grid_of(mesh))
    contour.SetValue(0, iso)
    contour.ComputeScalarsOff()
    contour.Update()
    return contour.GetOutput()


def contour_of_samples(samples, iso):
    """The isosurface of samples [z, y, x], by marching cubes."""
    image = vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(numpy.ascontiguousarray(samples).reshape(-1), deep=1))
    contour = vtkFlyingEdges3D()
    contour.SetInputData(image)
    contour.SetValue(0, iso)
    contour.ComputeScalarsOff()
    contour.Update()
    return contour.GetOutput()


def read_ply(path):
    reader = vtkPLYReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def points_of(data):
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float) if data.GetNumberOfPoints() else numpy.empty((0, 3))


def open_edges(surface):
    """The edges that only one triangle has: positions of their ends [n, 2, 3]."""
    edges = vtkFeatureEdges()
    edges.SetInputData(surface)
    edges.BoundaryEdgesOn()
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.NonManifoldEdgesOff()
    edges.ColoringOff()
    edges.Update()
    lines = edges.GetOutput()
    if not lines.GetNumberOfLines():
        return numpy.empty((0, 2, 3))
    return points_of(lines)[vtk_to_numpy(lines.GetLines().GetConnectivityArray()).reshape(-1, 2)]


def part_of(surface, is_wanted):
    """The triangles for whose corners [n, 3, 3] the function is true."""
    points = points_of(surface)
    triangles = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return poly(points, triangles=triangles[is_wanted(points[triangles])])


class Scene:
    """Things, and a camera that looks along `view` and sees all of them."""

    def __init__(self, width, height, view=(-0.45, 0.8, -0.4), up=(0, 0, 1), zoom=1.0, perspective=True):
        self._size, self._view, self._up, self._zoom, self._perspective = (width, height), view, up, zoom, perspective
        self._renderer = vtkRenderer()
        self._renderer.SetBackground(*colours.PAPER)
        self._renderer.SetUseDepthPeeling(True)
        self._renderer.SetMaximumNumberOfPeels(8)

    def add(self, data, colour, opacity=1.0, edges=None, smooth=False, light=True):
        """Triangles or lines; `edges` is the colour of the triangles' edges."""
        if smooth:
            normals = vtkPolyDataNormals()
            normals.SetInputData(data)
            normals.SplittingOff()
            normals.Update()
            data = normals.GetOutput()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(data)
        mapper.ScalarVisibilityOff()
        actor = vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*colour)
        look.SetOpacity(opacity)
        look.SetLighting(light)
        look.SetAmbient(0.25)
        look.SetDiffuse(0.75)
        if not smooth:
            look.SetInterpolationToFlat()
        if edges is not None:
            look.SetEdgeVisibility(True)
            look.SetEdgeColor(*edges)
        self._renderer.AddActor(actor)

    def add_tetrahedra(self, corners, colour, shrink=1.0, opacity=1.0, edges=colours.INK):
        """Tetrahedra [m, 4, 3], each shrunk towards its middle so that neighbours can be told apart."""
        middle = corners.mean(axis=1, keepdims=True)
        points = (middle + shrink * (corners - middle)).reshape(-1, 3)
        triangles = (4 * numpy.arange(len(corners))[:, None, None] + FACES).reshape(-1, 3)
        self.add(poly(points, triangles=triangles), colour, opacity, edges)

    def add_hull(self, corners, colour, opacity=1.0, edges=None):
        """What can be seen of tetrahedra that fill a region together."""
        points, inverse = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        grid = vtkUnstructuredGrid()
        places = vtkPoints()
        places.SetData(numpy_to_vtk(points.astype(float), deep=1))
        grid.SetPoints(places)
        grid.SetCells(VTK_TETRA, cells_of(inverse.reshape(-1, 4)))
        outside = vtkGeometryFilter()
        outside.SetInputData(grid)
        outside.Update()
        self.add(outside.GetOutput(), colour, opacity, edges)

    def add_lines(self, pairs, colour, radius):
        """Round lines between pairs of positions [n, 2, 3]."""
        pairs = numpy.asarray(pairs, dtype=float)
        tubes = vtkTubeFilter()
        tubes.SetInputData(poly(pairs.reshape(-1, 3), lines=numpy.arange(2 * len(pairs)).reshape(-1, 2)))
        tubes.SetRadius(radius)
        tubes.SetNumberOfSides(12)
        tubes.CappingOn()
        tubes.Update()
        self.add(tubes.GetOutput(), colour, smooth=True)

    def add_box(self, low, high, colour, radius):
        corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        place = [tuple((low, high)[bit][axis] for axis, bit in enumerate(corner)) for corner in corners]
        pairs = [(place[a],
                  place[b]) for a in range(8) for b in range(a) if sum(i != j for i, j in zip(corners[a], corners[b])) == 1]
        self.add_lines(pairs, colour, radius)

    def add_balls(self, places, colour, radius):
        for place in places:
            ball = vtkSphereSource()
            ball.SetCenter(*map(float, place))
            ball.SetRadius(radius)
            ball.SetThetaResolution(24)
            ball.SetPhiResolution(16)
            ball.Update()
            self.add(ball.GetOutput(), colour, smooth=True)

    def add_text(self, place, text, size=18, colour=colours.INK):
        actor = vtkBillboardTextActor3D()
        actor.SetInput(text)
        actor.SetPosition(*map(float, place))
        actor.SetDisplayOffset(6 * FINER, 6 * FINER)
        actor.GetTextProperty().SetFontSize(FINER * size)
        actor.GetTextProperty().SetColor(*colour)
        actor.GetTextProperty().SetBold(True)
        self._renderer.AddActor(actor)

    def picture(self):
        """The picture, as an image of PIL."""
        window = vtkRenderWindow()
        window.SetOffScreenRendering(True)
        # Transparent things need this; lines are smooth because pictures are drawn larger and scaled down.
        window.SetMultiSamples(0)
        window.SetAlphaBitPlanes(True)
        window.SetSize(*(FINER * size for size in self._size))
        window.AddRenderer(self._renderer)
        camera = self._renderer.GetActiveCamera()
        camera.SetFocalPoint(0, 0, 0)
        camera.SetPosition(*(-v for v in self._view))
        camera.SetViewUp(*self._up)
        camera.SetParallelProjection(not self._perspective)
        self._renderer.ResetCamera()
        camera.Zoom(self._zoom)
        self._renderer.ResetCameraClippingRange()
        window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        grab.Update()
        image = grab.GetOutput()
        width, height, _ = image.GetDimensions()
        pixels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3]
        window.Finalize()
        return Image.fromarray(numpy.ascontiguousarray(pixels)).resize(self._size, Image.LANCZOS)
