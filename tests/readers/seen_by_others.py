"""The values that a person sees in other people's programs: numbers of a file, with the slope and intercept that these programs
apply by themselves, and nothing else."""

import subprocess

from other_readers import h5py, nibabel, numpy, tifffile, vtk_image, vtk_numpy, vtk_xml

# Formats whose readers apply slope and intercept, and the others.
SCALED = ("b.nii", "b.nii.gz", "b.h5")
PLAIN = ("b.nrrd", "b.nhdr", "b.mha", "b.mhd", "b.tif", "b.vti", "b.vtkhdf", "b.raw")


def by_vtk(reader, path):
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    return vtk_numpy.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[::-1])


def by_teem(path):
    """NRRD as its own library writes it as text."""
    run = subprocess.run(["teem-unu", "save", "-f", "nrrd", "-e", "ascii", "-i", path.name, "-o", "-"], cwd=path.parent, check=True,
                         stdout=subprocess.PIPE)
    header, numbers = run.stdout.split(b"\n\n", 1)
    sizes = next(line for line in header.decode().splitlines() if line.startswith("sizes:"))[6:].split()
    return numpy.array(numbers.split(), float).reshape([int(n) for n in reversed(sizes)])


def by_plastimatch(path):
    """Through ITK."""
    subprocess.run(["plastimatch", "convert", "--input", path.name, "--output-img", "itk.nrrd"], cwd=path.parent, check=True,
                   stdout=subprocess.DEVNULL)
    return by_teem(path.parent / "itk.nrrd")


def by_h5py(path):
    with h5py.File(path) as file:
        if path.suffix == ".vtkhdf":
            return file["VTKHDF/PointData/value"][...]
        data = file["volume"]
        return data[...] * data.attrs.get("rescale_slope", 1) + data.attrs.get("rescale_intercept", 0)


def seen(path, type=None):
    """Values [z, y, x]. Raw files do not say their type and size: `type` is an empty array of both."""
    if path.suffix in (".nii", ".gz"):
        return nibabel.load(path).get_fdata().transpose(2, 1, 0)
    if path.suffix == ".tif":
        return tifffile.imread(path)
    if path.suffix in (".h5", ".vtkhdf"):
        return by_h5py(path)
    if path.suffix == ".raw":
        return numpy.fromfile(path, type.dtype).reshape(type.shape)
    readers = {".nrrd": vtk_image.vtkNrrdReader, ".nhdr": vtk_image.vtkNrrdReader, ".mha": vtk_image.vtkMetaImageReader,
               ".mhd": vtk_image.vtkMetaImageReader, ".vti": vtk_xml.vtkXMLImageDataReader}
    return by_vtk(readers[path.suffix](), path)
