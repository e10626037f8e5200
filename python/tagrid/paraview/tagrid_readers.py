"""The readers, as ParaView loads a plugin; see tagrid.paraview."""

from __future__ import annotations

from typing import Any

import numpy as np

import tagrid

from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smhint, smproperty, smproxy
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkDataObject, vtkImageData, vtkUnstructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm, vtkStreamingDemandDrivenPipeline as Pipeline


class _Reader(VTKPythonAlgorithmBase):
    """What both readers share: the file, which is opened when something is asked for."""

    def __init__(self, output: str):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType=output)
        self._path: Any = None
        self._volume: Any = None

    def set_path(self, path: Any) -> None:
        if path != self._path:
            self._path, self._volume = path, None
            self.Modified()

    def volume(self) -> tagrid.Volume:
        if self._volume is None:
            if not self._path or self._path == "None":
                raise tagrid.ArgumentError("no file is chosen")
            self._volume = tagrid.open(self._path)
        return self._volume


def _image_geometry(volume: tagrid.Volume) -> tuple[list[float], list[float], list[float]]:
    """Origin, spacing and direction (3 x 3, row by row) of the samples, along x, y and z."""
    vectors, origin = volume.affine[:3, :3], volume.affine[:3, 3]
    spacing = np.linalg.norm(vectors, axis=0)
    direction = vectors / spacing
    if not np.allclose(direction.T @ direction, np.eye(3), atol=1e-4):
        # Image data has no shear: what a tilted gantry makes. The mesh has it.
        direction = np.eye(3)
    return list(origin), list(spacing), list(direction.ravel())


@smproxy.reader(name="TagridImage", label="Tagrid Image", extensions="tag", file_description="tagrid: image of the voxels")
class TagridImage(_Reader):
    """The samples as image data, in the point array "value". Only what is asked for is decoded."""

    def __init__(self) -> None:
        super().__init__("vtkImageData")
        self._step = 1

    @smproperty.stringvector(name="FileName", panel_visibility="never")
    @smdomain.filelist()
    @smhint.filechooser(extensions="tag", file_description="tagrid: image of the voxels")
    def SetFileName(self, path: Any) -> None:
        self.set_path(path)

    @smproperty.intvector(name="Step", default_values=1)
    @smdomain.intrange(min=1, max=64)
    def SetStep(self, step: int) -> None:
        """Every how many samples along each axis."""
        if step != self._step:
            self._step = step
            self.Modified()

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        volume, step = self.volume(), self._step
        origin, spacing, direction = _image_geometry(volume)
        info = outputs.GetInformationObject(0)
        extent = [end for n in volume.shape[::-1] for end in (0, (n - 1) // step)]
        info.Set(Pipeline.WHOLE_EXTENT(), extent, 6)
        info.Set(vtkDataObject.ORIGIN(), origin, 3)
        info.Set(vtkDataObject.SPACING(), [step * s for s in spacing], 3)
        info.Set(vtkDataObject.DIRECTION(), direction, 9)
        info.Set(vtkAlgorithm.CAN_PRODUCE_SUB_EXTENT(), 1)
        vtkDataObject.SetPointDataActiveScalarInfo(info, numpy_to_vtk(np.empty(0, volume.dtype)).GetDataType(), 1)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        info = outputs.GetInformationObject(0)
        extent = info.Get(Pipeline.UPDATE_EXTENT())
        volume, step = self.volume(), self._step
        image = vtkImageData.GetData(outputs, 0)
        image.SetExtent(extent)
        origin, spacing, direction = _image_geometry(volume)
        image.SetOrigin(origin)
        image.SetSpacing([step * s for s in spacing])
        image.SetDirectionMatrix(direction)
        region = [(step * extent[axis], step * extent[axis + 1] + 1) for axis in (4, 2, 0)]
        samples = volume.read(region, step)
        values = numpy_to_vtk(samples.ravel())
        values.SetName("value")
        image.GetPointData().SetScalars(values)
        return 1


@smproxy.reader(name="TagridMesh", label="Tagrid Mesh", extensions="tag", file_description="tagrid: mesh of the grid")
class TagridMesh(_Reader):
    """The tetrahedra of the grid: the point array "value", and the cell array "level". Each process of a parallel server
    makes those of some layers of root cubes."""

    def __init__(self) -> None:
        super().__init__("vtkUnstructuredGrid")
        self._level = 9

    @smproperty.stringvector(name="FileName", panel_visibility="never")
    @smdomain.filelist()
    @smhint.filechooser(extensions="tag", file_description="tagrid: mesh of the grid")
    def SetFileName(self, path: Any) -> None:
        self.set_path(path)

    @smproperty.intvector(name="Level", default_values=9)
    @smdomain.intrange(min=0, max=24)
    def SetLevel(self, level: int) -> None:
        """The grid up to this level. All of it may be a hundred times as large as the file."""
        if level != self._level:
            self._level = level
            self.Modified()

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        outputs.GetInformationObject(0).Set(vtkAlgorithm.CAN_HANDLE_PIECE_REQUEST(), 1)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        info = outputs.GetInformationObject(0)
        grid = vtkUnstructuredGrid.GetData(outputs, 0)
        layers = _layers(self.volume(), info.Get(Pipeline.UPDATE_PIECE_NUMBER()), info.Get(Pipeline.UPDATE_NUMBER_OF_PIECES()))
        if layers is not None:
            _fill(grid, _mesh_of(self.volume(), min(self._level, self.volume().levels), layers))
        return 1


def _layers(volume: tagrid.Volume, piece: int, pieces: int) -> tuple[int, int] | None:
    """The samples [low, high) along z of the root cubes that belong to a piece; none if there are fewer than pieces."""
    edge = volume.info["cube"]
    cubes = -(-(volume.shape[0] - 1) // edge)
    low, high = cubes * piece // pieces, cubes * (piece + 1) // pieces
    return (low * edge, min(high * edge + 1, volume.shape[0])) if low < high else None


def _mesh_of(volume: tagrid.Volume, level: int, layers: tuple[int, int]) -> tagrid.Mesh:
    low, high = layers
    if (low, high) == (0, volume.shape[0]):
        return volume.mesh(level=level)
    mesh = volume.mesh(level=level, region=((low, high), (None, None), (None, None)))
    # What meets the layers from outside belongs to another piece: no tetrahedron crosses the border of a root cube.
    to_samples = np.linalg.inv(volume.affine)
    z = (mesh.points @ to_samples[2, :3] + to_samples[2, 3])[mesh.cells].mean(axis=1)
    inside = (low < z) & (z < high - 1)
    used, cells = np.unique(mesh.cells[inside], return_inverse=True)
    return tagrid.Mesh(mesh.points[used], cells.reshape(-1, 4), mesh.values[used], mesh.levels[inside])


def _fill(grid: Any, mesh: tagrid.Mesh) -> None:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(mesh.points))
    grid.SetPoints(points)
    cells = vtkCellArray()
    # Copies: the array of cells takes the memory, but not the arrays that own it.
    offsets = numpy_to_vtkIdTypeArray(np.arange(0, 4 * len(mesh.cells) + 1, 4), deep=True)
    cells.SetData(offsets, numpy_to_vtkIdTypeArray(mesh.cells.ravel(), deep=True))
    grid.SetCells(VTK_TETRA, cells)
    values = numpy_to_vtk(mesh.values)
    values.SetName("value")
    grid.GetPointData().SetScalars(values)
    levels = numpy_to_vtk(mesh.levels)
    levels.SetName("level")
    grid.GetCellData().AddArray(levels)
