"""Pictures of things in space, drawn by VTK."""

import itertools

import numpy
from PIL import Image
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkPolyDataNormals, vtkTubeFilter
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import (vtkActor, vtkBillboardTextActor3D, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow,
                                         vtkWindowToImageFilter)
import vtkmodules.vtkRenderingFreeType  # noqa: F401  draws texts
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  draws

from drawing import FINER, INK, PAPER
from mesh import FACES
from vtk_data import image_of, lines_of, made_by, tetrahedra_of, triangles_of


def contour_of_samples(samples, iso):
    """The isosurface of samples [z, y, x], by marching cubes."""
    return made_by(vtkFlyingEdges3D(), image_of(samples), Value=(0, iso), ComputeScalars=False)


class Scene:
    """Things, and a camera that looks along `view` and sees all of them."""

    def __init__(self, width, height, view=(-0.45, 0.8, -0.4), up=(0, 0, 1), zoom=1.0):
        self._size, self._view, self._up, self._zoom = (width, height), view, up, zoom
        self._renderer = vtkRenderer()
        self._renderer.SetBackground(*PAPER)
        self._renderer.SetUseDepthPeeling(True)
        self._renderer.SetMaximumNumberOfPeels(8)

    def add(self, data, color, opacity=1.0, edges=None, smooth=False):
        """Triangles or lines; `edges` is the color of the triangles' edges."""
        if smooth:
            data = made_by(vtkPolyDataNormals(), data, Splitting=False)
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(data)
        mapper.ScalarVisibilityOff()
        actor = vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*color)
        look.SetOpacity(opacity)
        look.SetAmbient(0.25)
        look.SetDiffuse(0.75)
        if not smooth:
            look.SetInterpolationToFlat()
        if edges is not None:
            look.SetEdgeVisibility(True)
            look.SetEdgeColor(*edges)
        self._renderer.AddActor(actor)

    def add_tetrahedra(self, corners, color, shrink=1.0, opacity=1.0):
        """Tetrahedra [m, 4, 3], each shrunk towards its middle so that neighbors can be told apart."""
        middle = corners.mean(axis=1, keepdims=True)
        points = (middle + shrink * (corners - middle)).reshape(-1, 3)
        triangles = (4 * numpy.arange(len(corners))[:, None, None] + FACES).reshape(-1, 3)
        self.add(triangles_of(points, triangles), color, opacity, INK)

    def add_hull(self, corners, color, opacity=1.0, edges=None):
        """The surface of tetrahedra that fill a region together."""
        points, inverse = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        self.add(made_by(vtkGeometryFilter(), tetrahedra_of(points, inverse.reshape(-1, 4))), color, opacity, edges)

    def add_lines(self, pairs, color, radius):
        """Round lines between pairs of positions [n, 2, 3]."""
        pairs = numpy.asarray(pairs, dtype=float)
        lines = lines_of(pairs.reshape(-1, 3), numpy.arange(2 * len(pairs)).reshape(-1, 2))
        self.add(made_by(vtkTubeFilter(), lines, Radius=radius, NumberOfSides=12, Capping=True), color, smooth=True)

    def add_box(self, low, high, color, radius):
        corners = list(itertools.product(*zip(low, high)))
        pairs = [(a, b) for a, b in itertools.combinations(corners, 2) if sum(i != j for i, j in zip(a, b)) == 1]
        self.add_lines(pairs, color, radius)

    def add_balls(self, places, color, radius):
        for place in places:
            ball = made_by(vtkSphereSource(), Center=tuple(map(float, place)), Radius=radius, ThetaResolution=24, PhiResolution=16)
            self.add(ball, color, smooth=True)

    def add_text(self, place, text):
        actor = vtkBillboardTextActor3D()
        actor.SetInput(text)
        actor.SetPosition(*map(float, place))
        actor.SetDisplayOffset(6 * FINER, 6 * FINER)
        actor.GetTextProperty().SetFontSize(FINER * 18)
        actor.GetTextProperty().SetColor(*INK)
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
        self._renderer.ResetCamera()
        camera.Zoom(self._zoom)
        self._renderer.ResetCameraClippingRange()
        window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        image = made_by(grab)
        width, height, _ = image.GetDimensions()
        pixels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3]
        window.Finalize()
        return Image.fromarray(numpy.ascontiguousarray(pixels)).resize(self._size, Image.LANCZOS)
