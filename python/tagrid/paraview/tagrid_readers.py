"""The readers, as ParaView loads a plugin; see tagrid.paraview."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np

import tagrid

from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smhint, smproperty, smproxy
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkPoints
from vtkmodules.vtkCommonDataModel import (VTK_TETRA, vtkCellArray, vtkDataObject, vtkImageData, vtkStructuredGrid,
                                           vtkUnstructuredGrid)
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm, vtkStreamingDemandDrivenPipeline as Pipeline


# ParaView ignores properties of a base class, so each reader gets functions of its own.


def _file_name(description: str) -> Any:
    """The property FileName."""
    @smproperty.stringvector(name="FileName", panel_visibility="never")
    @smdomain.filelist()
    @smhint.filechooser(extensions="tag", file_description=description)
    def SetFileName(self: _Reader, path: Any) -> None:
        if path != self._path:
            self._path, self._volume = path, None
            self.Modified()

    return SetFileName


def _step() -> Any:
    """The property Step."""
    @smproperty.intvector(name="Step", default_values=1)
    @smdomain.intrange(min=1, max=64)
    def SetStep(self: _Voxels, step: int) -> None:
        """Take every n-th sample of the level along each axis."""
        if step != self._step:
            self._step = step
            self.Modified()

    return SetStep


#: What the property Resolution offers: the edge of the blocks whose means are read, and its name. 0: see SetResolution().
_RESOLUTIONS = {0: "auto", 1: "full", **{4**n: f"1/{4**n}" for n in range(1, 6)}}


def _resolution() -> Any:
    """The property Resolution."""
    entries = "".join(f'<Entry value="{value}" text="{text}"/>' for value, text in _RESOLUTIONS.items())

    @smproperty.intvector(name="Resolution", default_values=0)
    @smdomain.xml(f'<EnumerationDomain name="enum">{entries}</EnumerationDomain>')
    def SetResolution(self: _Voxels, resolution: int) -> None:
        """Read all samples ("full"), or an overview that the file has: "1/4" reads the means of blocks of 4 x 4 x 4
        samples. If the file lacks it, the next finer one is read. "auto" reads the finest one of which the region
        is not too large; it is read in full where the file has no overviews."""
        if resolution != self._resolution:
            self._resolution = resolution
            self.Modified()

    return SetResolution


def _region() -> Any:
    """The property Region."""
    @smproperty.intvector(name="Region", number_of_elements=6, default_values=[0, -1, 0, -1, 0, -1])
    def SetRegion(self: _Voxels, *region: int) -> None:
        """Read only the samples from the first to the second number along x, from the third to the fourth along y, and so on,
        both included. Samples are those of the full volume, whatever the resolution; -1 is the last one. A small region
        has a finer resolution if that is "auto"."""
        if region != self._region:
            self._region = region
            self.Modified()

    return SetRegion


class _Reader(VTKPythonAlgorithmBase):
    """The base of the readers, which opens the file on demand."""

    def __init__(self, output: str):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType=output)
        self._path: Any = None
        self._volume: Any = None
        self._status: Any = None

    def volume(self) -> tagrid.Volume:
        if not self._path or self._path == "None":
            raise tagrid.ArgumentError("no file is chosen")
        # File > Reload Files must notice a replaced file.
        status = os.stat(self._path)
        status = status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
        if self._volume is None or status != self._status:
            self._volume, self._status = tagrid.open(self._path), status
        return self._volume


def _image_geometry(volume: tagrid.Volume) -> tuple[list[float], list[float], list[float]]:
    """Origin, spacing and direction (3 x 3, row by row) of the samples, along x, y and z.

    Image data has no shear, so slices of a sheared volume are shown straight.
    """
    directions, steps = np.linalg.qr(volume.affine[:3, :3])
    signs = np.where(np.diag(steps) < 0, -1, 1)
    return list(volume.affine[:3, 3]), list(np.abs(np.diag(steps))), list((directions * signs).ravel())


def _is_sheared(volume: tagrid.Volume) -> bool:
    directions = volume.affine[:3, :3] / np.linalg.norm(volume.affine[:3, :3], axis=0)
    return not np.allclose(directions.T @ directions, np.eye(3), atol=1e-4)


class _Voxels(_Reader):
    """The base of the voxel readers, which decode only the requested region."""

    #: With the resolution "auto", no more samples are read if the file has a coarser level.
    most_samples = 2**28

    def __init__(self, output: str):
        super().__init__(output)
        self._step = 1
        self._resolution = 0
        self._region: tuple[int, ...] = (0, -1) * 3
        self._overview: Any = None

    def extent(self, factor: int) -> list[int]:
        """The first and the last sample of the region along x, y and z, in a level and in steps."""
        extent = []
        for axis, count in enumerate(self.volume().shape[::-1]):
            low, high = (end if end >= 0 else count - 1 for end in self._region[2 * axis:2 * axis + 2])
            high = min(high, count - 1)
            if low > high:
                raise tagrid.ArgumentError(f"Region: {low} to {high} along {'xyz'[axis]} is empty; there are {count} samples")
            last = high // factor // self._step
            extent += [min(-(-(low // factor) // self._step), last), last]
        return extent

    def factor(self) -> int:
        """The edge of the blocks whose means are read; 1: all samples."""
        factors = [1, *self.volume().overviews]
        if self._resolution > 0:
            return max(factor for factor in factors if factor <= self._resolution)
        for factor in factors:
            ends = self.extent(factor)
            if math.prod(ends[i + 1] - ends[i] + 1 for i in (0, 2, 4)) <= self.most_samples:
                return factor
        return factors[-1]

    def level(self) -> tagrid.Volume:
        """The volume, or the overview of it, that is read."""
        volume, factor = self.volume(), self.factor()
        if factor == 1:
            return volume
        if self._overview is None or self._overview[0] is not volume or self._overview[1] != factor:
            self._overview = volume, factor, volume.overview(factor)
        return self._overview[2]

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        volume = self.volume()
        info = outputs.GetInformationObject(0)
        info.Set(Pipeline.WHOLE_EXTENT(), self.extent(self.factor()), 6)
        info.Set(vtkAlgorithm.CAN_PRODUCE_SUB_EXTENT(), 1)
        vtkDataObject.SetPointDataActiveScalarInfo(info, numpy_to_vtk(np.empty(0, volume.dtype)).GetDataType(), 1)
        return 1

    def decode(self, outputs: Any) -> tuple[list[int], Any]:
        """The requested extent, and its samples as the array "value"."""
        extent = outputs.GetInformationObject(0).Get(Pipeline.UPDATE_EXTENT())
        step = self._step
        samples = self.level().read([(step * extent[axis], step * extent[axis + 1] + 1) for axis in (4, 2, 0)], step)
        values = numpy_to_vtk(samples.ravel())
        values.SetName("value")
        return extent, values


@smproxy.reader(name="TagridImage", label="Tagrid Image", extensions="tag",
                file_description="tagrid: image of the voxels")
class TagridImage(_Voxels):
    """The samples as image data, in the point array "value". Decodes only the requested region. Image data
    has even spacing and right angles; a warning reports if the volume does not."""

    def __init__(self) -> None:
        super().__init__("vtkImageData")
        self._judged: Any = None

    SetFileName = _file_name("tagrid: image of the voxels")
    SetResolution = _resolution()
    SetRegion = _region()
    SetStep = _step()

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        super().RequestInformation(request, inputs, outputs)
        origin, spacing, direction = _image_geometry(self.level())
        info = outputs.GetInformationObject(0)
        info.Set(vtkDataObject.ORIGIN(), origin, 3)
        info.Set(vtkDataObject.SPACING(), [self._step * s for s in spacing], 3)
        info.Set(vtkDataObject.DIRECTION(), direction, 9)
        self._warn()
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        image = vtkImageData.GetData(outputs, 0)
        extent, values = self.decode(outputs)
        image.SetExtent(extent)
        origin, spacing, direction = _image_geometry(self.level())
        image.SetOrigin(origin)
        image.SetSpacing([self._step * s for s in spacing])
        image.SetDirectionMatrix(direction)
        image.GetPointData().SetScalars(values)
        return 1

    def _warn(self) -> None:
        """Warns once for each file about what image data cannot show."""
        volume = self.volume()
        if volume is self._judged:
            return
        self._judged = volume
        wrong = ["slices lie at unequal distances, and are shown at equal ones"] if volume.slice_positions is not None else []
        wrong += ["slices are shifted against each other (a tilted gantry), and are shown straight"] if _is_sheared(volume) else []
        if wrong:
            vtkOutputWindow.GetInstance().DisplayWarningText(
                f"{self._path}: {'; '.join(wrong)}. The reader \"tagrid: voxels at their true positions\" (TagridStructuredGrid) shows "
                "them where they are.\n")


@smproxy.reader(name="TagridStructuredGrid", label="Tagrid Structured Grid", extensions="tag",
                file_description="tagrid: voxels at their true positions")
class TagridStructuredGrid(_Voxels):
    """The samples as a structured grid, in the point array "value". Each sample has its own world position,
    even if slices are unevenly spaced or sheared. Positions take 24 bytes of memory per sample."""

    most_samples = 2**25

    def __init__(self) -> None:
        super().__init__("vtkStructuredGrid")

    SetFileName = _file_name("tagrid: voxels at their true positions")
    SetResolution = _resolution()
    SetRegion = _region()
    SetStep = _step()

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        grid = vtkStructuredGrid.GetData(outputs, 0)
        extent, values = self.decode(outputs)
        grid.SetExtent(extent)
        points = vtkPoints()
        points.SetData(numpy_to_vtk(self._places(extent)))
        grid.SetPoints(points)
        grid.GetPointData().SetScalars(values)
        return 1

    def _places(self, extent: list[int]) -> Any:
        """x, y, z of each sample of an extent, along x first."""
        affine, positions = self.level().affine, self.level().slice_positions
        x, y, z = (self._step * np.arange(extent[i], extent[i + 1] + 1) for i in (0, 2, 4))
        if positions is None:
            positions = affine[:3, 3] + np.arange(self.level().shape[0])[:, None] * affine[:3, 2]
        places = np.empty((len(z), len(y), len(x), 3))
        places[:] = positions[z][:, None, None]
        places += (y[:, None] * affine[:3, 1])[None, :, None]
        places += (x[:, None] * affine[:3, 0])[None, None]
        return places.reshape(-1, 3)


@smproxy.reader(name="TagridMesh", label="Tagrid Mesh", extensions="tag", file_description="tagrid: mesh of the grid")
class TagridMesh(_Reader):
    """The tetrahedra of the grid: the point array "value", and the cell array "level". Each process of a
    parallel server creates the tetrahedra of some layers of root cubes."""

    def __init__(self) -> None:
        super().__init__("vtkUnstructuredGrid")
        self._level = 9

    SetFileName = _file_name("tagrid: mesh of the grid")

    @smproperty.intvector(name="Level", default_values=9)
    @smdomain.intrange(min=0, max=24)
    def SetLevel(self, level: int) -> None:
        """The grid up to this level. The complete grid may be a hundred times as large as the file."""
        if level != self._level:
            self._level = level
            self.Modified()

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        outputs.GetInformationObject(0).Set(vtkAlgorithm.CAN_HANDLE_PIECE_REQUEST(), 1)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        info = outputs.GetInformationObject(0)
        grid = vtkUnstructuredGrid.GetData(outputs, 0)
        layers = _layers(self.volume(), info.Get(Pipeline.UPDATE_PIECE_NUMBER()),
                         info.Get(Pipeline.UPDATE_NUMBER_OF_PIECES()))
        if layers is not None:
            _fill(grid, _mesh_of(self.volume(), min(self._level, self.volume().levels), layers))
        return 1


def _layers(volume: tagrid.Volume, piece: int, pieces: int) -> tuple[int, int] | None:
    """The samples [low, high) along z of a piece's root cubes; None if the piece has none."""
    edge, samples = volume.info["cube"], volume.shape[0]
    lead = volume.info["lead"] if samples > 1 else 0
    cubes = max(1, -(-(samples - 1 + lead) // edge))
    low, high = cubes * piece // pieces, cubes * (piece + 1) // pieces
    return (max(low * edge - lead, 0), min(high * edge - lead + 1, samples)) if low < high else None


def _mesh_of(volume: tagrid.Volume, level: int, layers: tuple[int, int]) -> tagrid.Mesh:
    low, high = layers
    if (low, high) == (0, volume.shape[0]):
        return volume.mesh(level=level)
    mesh = volume.mesh(level=level, region=((low, high), (None, None), (None, None)))
    # Tetrahedra that only touch the layers belong to another piece: none crosses the border of a root cube.
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
    # Copies, because the cell array uses the memory, but does not keep the arrays that own it.
    offsets = numpy_to_vtkIdTypeArray(np.arange(0, 4 * len(mesh.cells) + 1, 4), deep=True)
    cells.SetData(offsets, numpy_to_vtkIdTypeArray(mesh.cells.ravel(), deep=True))
    grid.SetCells(VTK_TETRA, cells)
    values = numpy_to_vtk(mesh.values)
    values.SetName("value")
    grid.GetPointData().SetScalars(values)
    levels = numpy_to_vtk(mesh.levels)
    levels.SetName("level")
    grid.GetCellData().AddArray(levels)
