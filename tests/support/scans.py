"""Files of volumes as tests write them: DICOM by pydicom, NRRD, NIfTI and MetaImage by the descriptions of the formats.
Arrays have the axes z, y, x."""

import struct

try:
    import numpy
    import pydicom
except ImportError:
    pydicom = None

LITTLE, IMPLICIT, BIG = "1.2.840.10008.1.2.1", "1.2.840.10008.1.2", "1.2.840.10008.1.2.2"
CT, ENHANCED_CT = "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.2.1"


def volume(bits=12, shape=(7, 20, 31), signed=False):
    """Noise."""
    random = numpy.random.default_rng(1)
    low = -(1 << (bits - 1)) if signed else 0
    return random.integers(low, low + (1 << bits), shape, "int64")


def data_set(samples, series="1.2.3", instance="1.2.3.1", number=1, position=(0, 0, 0), syntax=LITTLE, **attributes):
    """A file of one slice or, if `samples` has three axes, of many frames."""
    meta = pydicom.dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID, meta.TransferSyntaxUID = CT, instance, syntax
    file = pydicom.dataset.FileDataset("x", {}, file_meta=meta, preamble=b"\0" * 128)
    file.is_little_endian, file.is_implicit_VR = syntax != BIG, syntax == IMPLICIT
    file.SOPClassUID, file.SOPInstanceUID, file.SeriesInstanceUID, file.StudyInstanceUID = CT, instance, series, "1.2"
    file.Modality, file.PatientName, file.PatientID = "CT", "Doe^Jane", "4711"
    file.InstanceNumber, file.SamplesPerPixel, file.PhotometricInterpretation = number, 1, "MONOCHROME2"
    file.Rows, file.Columns = samples.shape[-2:]
    if samples.ndim == 3:
        file.NumberOfFrames, file.SpacingBetweenSlices = samples.shape[0], 3
    file.BitsAllocated, file.BitsStored, file.HighBit, file.PixelRepresentation = 16, 12, 11, 0
    file.RescaleSlope, file.RescaleIntercept, file.RescaleType = 1, -1024, "HU"
    if position is not None:
        file.ImagePositionPatient = list(position)
        file.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    file.PixelSpacing, file.SliceThickness = [0.5, 0.25], 3
    for name, value in attributes.items():
        if value is None:
            delattr(file, name)
        else:
            setattr(file, name, value)
    type = {8: "u1", 16: "u2", 32: "u4"}[file.BitsAllocated]
    file.PixelData = (samples & ((1 << file.BitsAllocated) - 1)).astype(("<" if syntax != BIG else ">") + type).tobytes()
    if syntax == BIG and type == "u1":  # bytes in words of two
        file.PixelData = numpy.frombuffer(file.PixelData, "<u2").astype(">u2").tobytes()
    if len(file.PixelData) % 2:
        file.PixelData += b"\0"
    file["PixelData"].VR = "OW"
    return file


def write_series(folder, samples, step=1, names="{}.dcm", series="1.2.3", first=1, **attributes):
    """A file for each slice; `step`: mm between them. Returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for z, slice in enumerate(samples):
        more = {"instance": f"{series}.{z + first}", "number": z + first, "position": (0, 0, step * z)} | attributes
        data_set(slice, series=series, **more).save_as(folder / names.format(z), write_like_original=False)
    return folder


def sequence(**attributes):
    """A sequence of one item."""
    item = pydicom.Dataset()
    for name, value in attributes.items():
        setattr(item, name, value)
    return pydicom.Sequence([item])


def enhanced(samples, frames, shared={}, thickness=1, SOPClassUID=ENHANCED_CT, **attributes):
    """A file of many frames, each with groups of its own: frames[i] and `shared` are sequences by their names."""
    file = data_set(samples, SOPClassUID=SOPClassUID, PixelSpacing=None, **attributes)
    measures = sequence(PixelSpacing=[0.5, 0.25], SliceThickness=thickness)
    file.SharedFunctionalGroupsSequence = sequence(PixelMeasuresSequence=measures, **shared)
    file.PerFrameFunctionalGroupsSequence = pydicom.Sequence([sequence(**groups)[0] for groups in frames])
    return file


def enhanced_ct(samples, order, **of_frame):
    """The same, of a CT scan whose frames lie in this order; all frames have the groups of_frame, too."""
    shared = {"PlaneOrientationSequence": sequence(ImageOrientationPatient=[1, 0, 0, 0, 1, 0]),
              "PixelValueTransformationSequence": sequence(RescaleSlope=1, RescaleIntercept=-1024, RescaleType="HU")}
    frames = [{"PlanePositionSequence": sequence(ImagePositionPatient=[1, 2, 3 + z * 1.5]),
               "FrameContentSequence": sequence(InStackPositionNumber=z + 1, StackID="1")} | of_frame for z in order]
    file = enhanced(samples, frames, shared, ImageOrientationPatient=None, ImagePositionPatient=None, RescaleSlope=None,
                    RescaleIntercept=None)
    file.file_meta.MediaStorageSOPClassUID = ENHANCED_CT
    return file


def claim(path, syntax):
    """Gives a file another transfer syntax, whatever that is."""
    content = path.read_bytes()
    data = content[144 + int.from_bytes(content[140:144], "little"):]
    meta = pydicom.dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID, meta.TransferSyntaxUID = CT, "1.2.3.1", syntax
    with open(path, "wb") as file:
        file.write(bytes(128) + b"DICM")
        pydicom.filewriter.write_file_meta_info(file, meta)
        file.write(data)


def nrrd(samples, fields=""):
    """An attached file with further lines in its header."""
    type = {"float32": "float", "float64": "double"}.get(str(samples.dtype), samples.dtype)
    sizes = " ".join(map(str, samples.shape[::-1]))
    header = f"NRRD0005\ntype: {type}\ndimension: 3\nsizes: {sizes}\nencoding: raw\nendian: little\n"
    fields = fields if isinstance(fields, bytes) else fields.encode()
    return header.encode() + fields + b"\n" + samples.tobytes()


def nifti(samples, spacing=(1, 1, 1)):
    """NIfTI-1; with four axes, the first one is that of volumes."""
    codes = {"uint8": 2, "int16": 4, "uint16": 512, "float32": 16}
    sizes = (*samples.shape[::-1], 1, 1, 1, 1)[:7]
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, samples.ndim, *sizes)
    struct.pack_into("<hh", header, 70, codes[str(samples.dtype)], 8 * samples.itemsize)
    struct.pack_into("<8f", header, 76, 1, *spacing, 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352)
    header[123] = 2  # mm
    header[344:348] = b"n+1\0"
    return bytes(header) + samples.tobytes()


def meta_image(samples, fields=""):
    """A .mha file with further lines in its header."""
    types = {"uint8": "UCHAR", "int16": "SHORT", "uint16": "USHORT", "float32": "FLOAT"}
    sizes = " ".join(map(str, samples.shape[::-1]))
    header = (f"ObjectType = Image\nNDims = {samples.ndim}\nDimSize = {sizes}\n{fields}"
              f"ElementType = MET_{types[str(samples.dtype)]}\nElementDataFile = LOCAL\n")
    return header.encode() + samples.tobytes()
