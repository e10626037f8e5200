#!/usr/bin/python3
"""Compares how fast tagrid encodes the same volume from files of other formats.

    readers.py [VOLUME.nhdr] [--rounds 9] [--threads 1,2] [--encode "--max-error 2"] [--only dicom,tiff]

Writes the volume (a phantom if none is given) in every format for which this machine has a program or a Python module,
in /dev/shm, and prints a table in Markdown: the time of entire processes of `tagrid encode`, including that of the
reader, relative to a detached NRRD file. Every round encodes all formats in turn. A ratio is the median of those within
a round, so that a machine that slows down for a while affects both of its times. "Decoding" is the processor time that
is added to that of NRRD, "encoding" the time of NRRD with as many threads. If both run concurrently, the time is that
of the longer one, but no less than all processor time divided by the number of processors.

Needs python3-numpy, and for some formats python3-h5py, -nibabel, -pil, -pydicom, -tifffile, dcmtk, libgdcm-tools,
libtiff-tools and libopenjp2-tools.
"""

import gzip
import importlib
import shlex
import shutil
import statistics
import tempfile
import zlib
from pathlib import Path

import numpy

import nrrd
from markdown import print_table
from running import Parser, checked, main, numbers, output_of, say, usage_of


class Missing(Exception):
    """A program or a module is missing on this machine."""


def module(name):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise Missing(f"the module {name}") from error


def run_program(*command):
    if shutil.which(command[0]) is None:
        raise Missing(f"the program {command[0]}")
    output_of(*command)


class Files:
    """Writes an array [z, y, x] as files of all formats into a directory."""

    def __init__(self, samples, directory):
        self.samples, self.directory = samples, directory
        directory.mkdir()

    def path(self, name):
        return self.directory / name

    def slices(self, name, ending):
        """Creates a directory. Yields a path in it for each slice, and its samples."""
        self.path(name).mkdir()
        for z, slice_ in enumerate(self.samples):
            yield self.path(name) / f"s{z:04}.{ending}", slice_

    def nrrd(self):
        return nrrd.write(self.path("base.nhdr"), self.samples)

    def compressed_nrrd(self):
        return nrrd.write(self.path("gz.nhdr"), self.samples, gzip.compress(self.samples.tobytes(), 6))

    def nifti(self, name):
        nibabel = module("nibabel")
        nibabel.save(nibabel.Nifti1Image(self.samples.T, numpy.eye(4)), str(self.path(name)))
        return self.path(name)

    def metaimage(self, compressed):
        z, y, x = self.samples.shape
        kind = {"i2": "MET_SHORT", "u2": "MET_USHORT", "u1": "MET_UCHAR"}[self.samples.dtype.str[1:]]
        data = self.samples.tobytes()
        path = self.path("zlib.mha" if compressed else "plain.mha")
        header = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
                  f"CompressedData = {compressed}\nDimSize = {x} {y} {z}\nElementType = {kind}\n"
                  f"ElementDataFile = LOCAL\n")
        path.write_bytes(header.encode() + (zlib.compress(data, 6) if compressed else data))
        return path

    def raw(self):
        self.path("plain.raw").write_bytes(self.samples.tobytes())
        return self.path("plain.raw")

    def dicom(self):
        if self.path("dicom").exists():
            return self.path("dicom")
        pydicom = module("pydicom")
        from pydicom.dataset import FileDataset, FileMetaDataset
        from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid
        series, study = generate_uid(), generate_uid()
        for z, (path, slice_) in enumerate(self.slices("dicom", "dcm")):
            meta = FileMetaDataset()
            meta.TransferSyntaxUID = ExplicitVRLittleEndian
            meta.MediaStorageSOPClassUID = CTImageStorage
            meta.MediaStorageSOPInstanceUID = generate_uid()
            image = FileDataset(str(path), {}, file_meta=meta, preamble=bytes(128))
            image.is_little_endian, image.is_implicit_VR = True, False
            image.SOPClassUID, image.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
            image.SeriesInstanceUID, image.StudyInstanceUID = series, study
            image.PatientName, image.PatientID, image.StudyID = "A^B", "1", "1"
            image.StudyDate, image.StudyTime, image.SeriesNumber = "20200101", "120000", "1"
            image.Modality, image.InstanceNumber = "CT", z + 1
            image.ImagePositionPatient, image.ImageOrientationPatient = [0, 0, z], [1, 0, 0, 0, 1, 0]
            image.PixelSpacing, image.SliceThickness = [1, 1], 1
            image.Rows, image.Columns = slice_.shape
            image.BitsAllocated = image.BitsStored = 8 * slice_.itemsize
            image.HighBit = image.BitsStored - 1
            image.PixelRepresentation = int(slice_.dtype.kind == "i")
            image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
            image.PixelData = slice_.tobytes()
            image.save_as(str(path), write_like_original=False)
        return self.path("dicom")

    def compressed_dicom(self, name, *command):
        plain = self.dicom()
        self.path(name).mkdir()
        for file in sorted(plain.iterdir()):
            run_program(*command, file, self.path(name) / file.name)
        return self.path(name)

    def tiff(self):
        path = self.path("plain.tif")
        module("tifffile").imwrite(str(path), self.samples, photometric="minisblack")
        return path

    def compressed_tiff(self, compression):
        path = self.path(f"{compression}.tif")
        run_program("tiffcp", "-c", compression, self.tiff(), path)
        return path

    def tiff_slices(self):
        tifffile = module("tifffile")
        for path, slice_ in self.slices("tiffs", "tif"):
            tifffile.imwrite(str(path), slice_, photometric="minisblack")
        return self.path("tiffs")

    def hdf5(self, name, **layout):
        with module("h5py").File(self.path(name), "w") as file:
            file.create_dataset("volume", data=self.samples, **layout)
        return self.path(name)

    def bmp(self):
        pil = module("PIL.Image")
        for path, slice_ in self.slices("bmp", "bmp"):
            pil.fromarray(slice_).save(path)
        return self.path("bmp")

    def jpeg_2000(self):
        z, y, x = self.samples.shape
        sign = "s" if self.samples.dtype.kind == "i" else "u"
        for path, slice_ in self.slices("jp2", "jp2"):
            plain = self.path("slice.rawl")
            plain.write_bytes(slice_.tobytes())
            run_program("opj_compress", "-i", plain, "-o", path, "-F", f"{x},{y},1,{8 * slice_.itemsize},{sign}")
        return self.path("jp2")

    def options(self, path):
        """Options of encode that describe a file without a header."""
        if path.suffix != ".raw":
            return []
        z, y, x = self.samples.shape
        return ["--dims", f"{x},{y},{z}", "--type", nrrd.type_of(self.samples), "--endian", "little"]


def formats(files, of_bytes):
    """Name, whether samples are stored plainly, how the files are written, and the volume that they hold."""
    return [
        ("NRRD", True, files.nrrd, files),
        ("NRRD, 8 bits", True, of_bytes.nrrd, of_bytes),
        ("NRRD, gzip", False, files.compressed_nrrd, files),
        ("NIfTI", True, lambda: files.nifti("plain.nii"), files),
        ("NIfTI, gzip", False, lambda: files.nifti("gz.nii.gz"), files),
        ("MetaImage", True, lambda: files.metaimage(False), files),
        ("MetaImage, zlib", False, lambda: files.metaimage(True), files),
        ("samples without a header", True, files.raw, files),
        ("TIFF, one file", True, files.tiff, files),
        ("TIFF, a file for each slice", True, files.tiff_slices, files),
        ("TIFF, LZW", False, lambda: files.compressed_tiff("lzw"), files),
        ("TIFF, deflate", False, lambda: files.compressed_tiff("zip"), files),
        ("HDF5, contiguous", True, lambda: files.hdf5("plain.h5"), files),
        ("HDF5, chunks of 16 x 64 x 64, gzip", False,
         lambda: files.hdf5("gz.h5", chunks=(16, 64, 64), compression="gzip"), files),
        ("DICOM, a file for each slice", True, files.dicom, files),
        ("DICOM, RLE", False, lambda: files.compressed_dicom("rle", "dcmcrle"), files),
        ("DICOM, JPEG-LS", False, lambda: files.compressed_dicom("jpls", "dcmcjpls"), files),
        ("DICOM, JPEG 2000", False, lambda: files.compressed_dicom("j2k", "gdcmconv", "--j2k"), files),
        ("JPEG 2000, a file for each slice", False, files.jpeg_2000, files),
        ("BMP, a file for each slice", True, of_bytes.bmp, of_bytes),
    ]


def measured(encode, inputs, rounds):
    """All usages of each input, by its name."""
    usages = {name: [] for name in inputs}
    for number in range(rounds + 1):
        for name, (path, options, _, _) in inputs.items():
            usage = usage_of(*encode, path, *options)
            if number > 0:  # the first round warms up
                usages[name].append(usage)
    return usages


def row_of(name, is_plain, base, usages_of):
    median, row = statistics.median, [name, "yes" if is_plain else "no"]
    for usages in usages_of.values():
        pairs = list(zip(usages[name], usages[base]))
        row += [f"{median(u.cpu / b.cpu for u, b in pairs):.2f}",
                f"{median(u.wall / b.wall for u, b in pairs):.2f} ({median(u.wall for u in usages[name]):.2f} s)",
                f"{median(u.cpu - b.cpu for u, b in pairs):.2f}, {median(b.wall for _, b in pairs):.2f} s"]
    return row


def run():
    parser = Parser(__doc__)
    parser.add_argument("volume", nargs="?", help="a detached NRRD header of int16, uint16 or uint8")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--threads", type=numbers, default=[1, 2])
    parser.add_argument("--encode", default="--max-error 2", help="options of encode")
    parser.add_argument("--only", default="", help="formats whose names contain one of these words")
    options = parser.parse_args()
    tagrid = checked(options.tagrid)
    with tempfile.TemporaryDirectory(dir="/dev/shm") as directory:
        directory = Path(directory)
        path = options.volume or directory / "phantom.nhdr"
        if not options.volume:
            output_of(tagrid, "phantom", "--dims", "512,512,150", "-q", "-o", path)
        output_of(tagrid, "encode", path, "-o", directory / "v.tag", "-q")
        samples = nrrd.decoded(tagrid, directory / "v.tag")[1]
        low = int(samples.min())
        eight = ((samples.astype(int) - low) * 255 // max(1, int(samples.max()) - low)).astype("u1")
        files, of_bytes = Files(samples, directory / "v"), Files(eight, directory / "b")
        inputs = {}
        for name, is_plain, write, source in formats(files, of_bytes):
            wanted = not options.only or any(word in name.lower() for word in options.only.lower().split(","))
            if not wanted and name not in ("NRRD", "NRRD, 8 bits"):
                continue
            try:
                path = write()
            except Missing as error:
                say(f"{name}: not measured, as {error} is missing")
                continue
            inputs[name] = path, source.options(path), is_plain, "NRRD" if source is files else "NRRD, 8 bits"
        encode = [tagrid, "encode", "-o", directory / "out.tag", "-f", "-q", *shlex.split(options.encode)]
        usages_of = {threads: measured([*encode, f"-T{threads}"], inputs, options.rounds) for threads in options.threads}
        heads = [head for threads in usages_of for head in (f"T{threads}: CPU", "time", "decoding, encoding")]
        print_table(["source", "plain", *heads],
                    (row_of(name, is_plain, base, usages_of) for name, (_, _, is_plain, base) in inputs.items()))


if __name__ == "__main__":
    main("readers.py", run)
