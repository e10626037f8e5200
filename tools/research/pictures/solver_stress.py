"""Draws docs/images/solver_stress.png: the materials of a mesh, cut open, and the stresses in them.

    xvfb-run -a /usr/bin/python3 solver_stress.py stress.vtu solver_stress.png

stress.vtu is that of docs/solvers.md, with the cell data `material` and `mises`.
"""

import sys

import vtk
from PIL import Image


def half_of(grid):
    """The tetrahedra beyond a plane across x, uncut."""
    low, high = grid.GetBounds()[:2]
    plane = vtk.vtkPlane()
    plane.SetOrigin((low + high) / 2 - 0.5, 0, 0)
    plane.SetNormal(-1, 0, 0)
    half = vtk.vtkExtractGeometry()
    half.SetImplicitFunction(plane)
    half.SetInputData(grid)
    half.Update()
    return half.GetOutput()


def colors(points):
    function = vtk.vtkColorTransferFunction()
    for value, red, green, blue in points:
        function.AddRGBPoint(value, red, green, blue)
    return function


def scene(grid, array, table, viewport):
    mapper = vtk.vtkDataSetMapper()
    mapper.SetInputData(grid)
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray(array)
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().EdgeVisibilityOn()
    actor.GetProperty().SetLineWidth(0.5)
    actor.GetProperty().SetEdgeColor(0.2, 0.2, 0.2)
    actor.GetProperty().SetAmbient(0.4)
    actor.GetProperty().SetDiffuse(0.6)
    renderer = vtk.vtkRenderer()
    renderer.AddActor(actor)
    renderer.SetBackground(1, 1, 1)
    renderer.SetViewport(*viewport)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(-3, -0.8, 0.6)
    camera.SetViewUp(0, 0, 1)
    renderer.ResetCamera()
    camera.Zoom(1.12)
    return renderer


def main():
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(sys.argv[1])
    reader.Update()
    grid = half_of(reader.GetOutput())
    labels = grid.GetCellData().GetArray("material").GetRange()
    materials = colors([(labels[0], 0.85, 0.55, 0.5), (labels[1], 0.95, 0.92, 0.8)])
    stresses = colors([(0, 0.15, 0.25, 0.6), (0.1, 0.3, 0.75, 0.75), (0.25, 0.95, 0.9, 0.4), (0.6, 0.8, 0.1, 0.1)])
    left, right = scene(grid, "material", materials, (0, 0, 0.46, 1)), scene(grid, "mises", stresses, (0.46, 0, 1, 1))
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(stresses)
    bar.SetTitle("MPa")
    bar.SetNumberOfLabels(4)
    bar.SetLabelFormat("%.1f")
    bar.UnconstrainedFontSizeOn()
    for text in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        text.SetColor(0, 0, 0)
        text.SetFontSize(14)
        text.ItalicOff()
        text.BoldOff()
        text.ShadowOff()
    bar.SetPosition(0.85, 0.2)
    bar.SetWidth(0.12)
    bar.SetHeight(0.6)
    right.AddActor2D(bar)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(900, 480)
    for renderer in (left, right):
        window.AddRenderer(renderer)
    window.Render()
    image = vtk.vtkWindowToImageFilter()
    image.SetInput(window)
    writer = vtk.vtkPNGWriter()
    writer.SetInputConnection(image.GetOutputPort())
    writer.SetFileName(sys.argv[2])
    writer.Write()
    Image.open(sys.argv[2]).convert("RGB").quantize(64, dither=Image.Dither.NONE).save(sys.argv[2], optimize=True)


if __name__ == "__main__":
    main()
