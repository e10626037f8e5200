#!/usr/bin/python3
"""Compares how fast tagrid encodes the same volume from files of other formats.

    readers.py TAGRID [VOLUME.nhdr] [--rounds 9] [--threads 1,2] [--encode "--max-error 2"] [--only dicom,tiff]

Makes the volume (a phantom if none is given) in every format for which this machine has a program or a module of
Python, in /dev/shm, and prints a table in Markdown: the time of whole processes of `tagrid encode`, the reader's
included, relative to a detached NRRD file. Every round encodes all formats, one after the other; a ratio is the median
of those within a round, so that a machine that slows down for a while affects both of its times. "Decoding" is the
processor time that is added to that of NRRD, "encoding" the time of NRRD with as many threads. If both run beside each
other, the time is that of the longer one, but no less than all processor time divided by the number of processors.

Needs python3-numpy, and for some formats python3-h5py, -nibabel, -pil, -pydicom, -tifffile, dcmtk, libgdcm-tools,
libtiff-tools and libopenjp2-tools.
"""

import argparse
import gzip
import importlib
import json
import pathlib
import resource
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import numpy

TYPES = {'uint8': 'u1', 'int16': '<i2', 'uint16': '<u2'}


class Missing(Exception):
    """A program or a module is missing on this machine."""


def module(name):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise Missing(f'the module {name}') from error


def run(*command):
    if shutil.which(str(command[0])) is None:
        raise Missing(f'the program {command[0]}')
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)


class Volume:
    """An array [z, y, x] that becomes files of all kinds in a folder."""

    def __init__(self, samples, folder):
        self.samples, self.folder = samples, folder

    def path(self, name):
        return self.folder / name

    def slices(self, name):
        """A new folder, and for each slice its name without an extension, and its samples."""
        self.path(name).mkdir()
        return [(self.path(name) / f's{z:04}', slice_) for z, slice_ in enumerate(self.samples)]

    def nrrd(self, name='base', encoding='raw'):
        samples = self.samples
        data = samples.astype(samples.dtype.newbyteorder('<')).tobytes()
        self.path(f'{name}.data').write_bytes(gzip.compress(data, 6) if encoding == 'gzip' else data)
        self.path(f'{name}.nhdr').write_text(
            f'NRRD0004\ntype: {type_of(samples)}\ndimension: 3\nsizes: {" ".join(map(str, samples.shape[::-1]))}\n'
            f'encoding: {encoding}\nendian: little\ndata file: {name}.data\n')
        return self.path(f'{name}.nhdr')

    def nifti(self, name):
        nibabel = module('nibabel')
        nibabel.save(nibabel.Nifti1Image(self.samples.T, numpy.eye(4)), str(self.path(name)))
        return self.path(name)

    def metaimage(self, compressed):
        z, y, x = self.samples.shape
        kind = {'i2': 'MET_SHORT', 'u2': 'MET_USHORT', 'u1': 'MET_UCHAR'}[self.samples.dtype.str[1:]]
        data = self.samples.tobytes()
        if compressed:
            data = module('zlib').compress(data, 6)
        path = self.path('zlib.mha' if compressed else 'plain.mha')
        header = (f'ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n'
                  f'CompressedData = {compressed}\nDimSize = {x} {y} {z}\nElementType = {kind}\n'
                  f'ElementDataFile = LOCAL\n')
        path.write_bytes(header.encode() + data)
        return path

    def raw(self):
        self.path('plain.raw').write_bytes(self.samples.tobytes())
        return self.path('plain.raw')

    def dicom(self):
        if self.path('dicom').exists():
            return self.path('dicom')
        pydicom = module('pydicom')
        from pydicom.dataset import FileDataset, FileMetaDataset
        from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid
        series, study = generate_uid(), generate_uid()
        for z, (path, slice_) in enumerate(self.slices('dicom')):
            meta = FileMetaDataset()
            meta.TransferSyntaxUID = ExplicitVRLittleEndian
            meta.MediaStorageSOPClassUID = CTImageStorage
            meta.MediaStorageSOPInstanceUID = generate_uid()
            image = FileDataset(str(path), {}, file_meta=meta, preamble=bytes(128))
            image.is_little_endian, image.is_implicit_VR = True, False
            image.SOPClassUID, image.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
            image.SeriesInstanceUID, image.StudyInstanceUID = series, study
            image.PatientName, image.PatientID, image.StudyID = 'A^B', '1', '1'
            image.StudyDate, image.StudyTime, image.SeriesNumber = '20200101', '120000', '1'
            image.Modality, image.InstanceNumber = 'CT', z + 1
            image.ImagePositionPatient, image.ImageOrientationPatient = [0, 0, z], [1, 0, 0, 0, 1, 0]
            image.PixelSpacing, image.SliceThickness = [1, 1], 1
            image.Rows, image.Columns = slice_.shape
            image.BitsAllocated = image.BitsStored = 8 * slice_.itemsize
            image.HighBit = image.BitsStored - 1
            image.PixelRepresentation = int(slice_.dtype.kind == 'i')
            image.SamplesPerPixel, image.PhotometricInterpretation = 1, 'MONOCHROME2'
            image.PixelData = slice_.tobytes()
            image.save_as(f'{path}.dcm', write_like_original=False)
        return self.path('dicom')

    def compressed_dicom(self, name, *command):
        plain = self.dicom()
        self.path(name).mkdir()
        for file in sorted(plain.iterdir()):
            run(*command, file, self.path(name) / file.name)
        return self.path(name)

    def tiff(self):
        tifffile = module('tifffile')
        path = self.path('plain.tif')
        tifffile.imwrite(str(path), self.samples, photometric='minisblack')
        return path

    def compressed_tiff(self, compression):
        path = self.path(f'{compression}.tif')
        run('tiffcp', '-c', compression, self.tiff(), path)
        return path

    def tiff_folder(self):
        tifffile = module('tifffile')
        for path, slice_ in self.slices('tiffs'):
            tifffile.imwrite(f'{path}.tif', slice_, photometric='minisblack')
        return self.path('tiffs')

    def hdf5(self, name, **layout):
        h5py = module('h5py')
        with h5py.File(self.path(name), 'w') as file:
            file.create_dataset('volume', data=self.samples, **layout)
        return self.path(name)

    def bmp(self):
        pil = module('PIL.Image')
        for path, slice_ in self.slices('bmp'):
            pil.fromarray(slice_).save(f'{path}.bmp')
        return self.path('bmp')

    def jpeg_2000(self):
        z, y, x = self.samples.shape
        sign = 's' if self.samples.dtype.kind == 'i' else 'u'
        for path, slice_ in self.slices('jp2'):
            plain = self.path('slice.rawl')
            plain.write_bytes(slice_.tobytes())
            run('opj_compress', '-i', plain, '-o', f'{path}.jp2', '-F', f'{x},{y},1,{8 * slice_.itemsize},{sign}')
        return self.path('jp2')


def type_of(samples):
    return {code.lstrip('<'): name for name, code in TYPES.items()}[samples.dtype.str[1:]]


def described(samples):
    z, y, x = samples.shape
    return ['--dims', f'{x},{y},{z}', '--type', type_of(samples), '--endian', 'little']


def formats(volume, bytes_):
    """Name, is it plain, how the files are made, and which volume they hold."""
    return [
        ('NRRD, gzip', False, lambda: volume.nrrd('gz', encoding='gzip'), volume),
        ('NIfTI', True, lambda: volume.nifti('plain.nii'), volume),
        ('NIfTI, gzip', False, lambda: volume.nifti('gz.nii.gz'), volume),
        ('MetaImage', True, lambda: volume.metaimage(False), volume),
        ('MetaImage, zlib', False, lambda: volume.metaimage(True), volume),
        ('samples without a header', True, volume.raw, volume),
        ('TIFF, one file', True, volume.tiff, volume),
        ('TIFF, a file for each slice', True, volume.tiff_folder, volume),
        ('TIFF, LZW', False, lambda: volume.compressed_tiff('lzw'), volume),
        ('TIFF, deflate', False, lambda: volume.compressed_tiff('zip'), volume),
        ('HDF5, contiguous', True, lambda: volume.hdf5('plain.h5'), volume),
        ('HDF5, chunks of 16 x 64 x 64, gzip', False,
         lambda: volume.hdf5('gz.h5', chunks=(16, 64, 64), compression='gzip'), volume),
        ('DICOM, a file for each slice', True, volume.dicom, volume),
        ('DICOM, RLE', False, lambda: volume.compressed_dicom('rle', 'dcmcrle'), volume),
        ('DICOM, JPEG-LS', False, lambda: volume.compressed_dicom('jpls', 'dcmcjpls'), volume),
        ('DICOM, JPEG 2000', False, lambda: volume.compressed_dicom('j2k', 'gdcmconv', '--j2k'), volume),
        ('JPEG 2000, a file for each slice', False, volume.jpeg_2000, volume),
        ('BMP, a file for each slice', True, bytes_.bmp, bytes_),
    ]


class Usage:
    def __init__(self, command):
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        subprocess.run(command, check=True)
        self.wall = time.monotonic() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def median(values):
    return statistics.median(values)


def measure(given, inputs, threads):
    """All usages of each input, by its name."""
    output = inputs['NRRD'][0].parent / 'out.tag'
    usages = {name: [] for name in inputs}
    for number in range(given.rounds + 1):
        for name, (path, more, _, _) in inputs.items():
            usage = Usage([given.tagrid, 'encode', path, '-o', output, '-f', '-q', f'-T{threads}',
                           *shlex.split(given.encode), *more])
            if number > 0:  # the first round warms up
                usages[name].append(usage)
    return usages


def print_table(usages_of, inputs):
    heads = ''.join(f' T{t}: CPU | time | decoding, encoding |' for t in usages_of)
    print(f'| source | plain |{heads}\n|---|---|' + '---|' * (3 * len(usages_of)))
    for name, (_, _, is_plain, base) in inputs.items():
        row = f'| {name} | {"yes" if is_plain else "no"} |'
        for usages in usages_of.values():
            pairs = list(zip(usages[name], usages[base]))
            own, decoding = median([u.wall for u in usages[name]]), median([u.cpu - b.cpu for u, b in pairs])
            row += (f' {median([u.cpu / b.cpu for u, b in pairs]):.2f} | {median([u.wall / b.wall for u, b in pairs]):.2f}'
                    f' ({own:.2f} s) | {decoding:.2f}, {median([b.wall for _, b in pairs]):.2f} s |')
        print(row)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('tagrid')
    parser.add_argument('volume', nargs='?', help='a detached NRRD header of int16, uint16 or uint8')
    parser.add_argument('--rounds', type=int, default=9)
    parser.add_argument('--threads', default='1,2')
    parser.add_argument('--encode', default='--max-error 2', help='options of encode')
    parser.add_argument('--only', default='', help='formats whose names contain one of these words')
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir='/dev/shm') as name:
        folder = pathlib.Path(name)
        path = given.volume
        if path is None:
            path = folder / 'phantom.nhdr'
            subprocess.run([given.tagrid, 'phantom', '--dims', '512,512,150', '-q', '-o', path], check=True)
        subprocess.run([given.tagrid, 'encode', path, '-o', folder / 'v.tag', '-q'], check=True)
        subprocess.run([given.tagrid, 'decode', folder / 'v.tag', '-o', folder / 'v.raw', '-q'], check=True)
        info = json.loads(subprocess.run([given.tagrid, 'info', '--json', folder / 'v.tag'], check=True,
                                         stdout=subprocess.PIPE).stdout)
        samples = numpy.fromfile(folder / 'v.raw', TYPES[info['type']]).reshape(info['dims'][::-1])
        low = int(samples.min())
        eight = ((samples.astype(int) - low) * 255 // max(1, int(samples.max()) - low)).astype('u1')
        volume, bytes_ = Volume(samples, folder / 'v'), Volume(eight, folder / 'b')
        for one in (volume, bytes_):
            one.folder.mkdir()
        # Of each: where it is, options for it, whether samples lie plainly in it, and with what it is compared.
        inputs = {'NRRD': (volume.nrrd(), [], True, 'NRRD'),
                  'NRRD, 8 bits': (bytes_.nrrd('base'), [], True, 'NRRD, 8 bits')}
        for format_, is_plain, make, source in formats(volume, bytes_):
            if given.only and not any(word in format_.lower() for word in given.only.lower().split(',')):
                continue
            try:
                made = make()
            except Missing as error:
                print(f'{format_}: not measured, as {error} is missing', file=sys.stderr)
                continue
            inputs[format_] = (made, described(samples) if made.suffix == '.raw' else [], is_plain,
                               'NRRD' if source is volume else 'NRRD, 8 bits')
        print_table({threads: measure(given, inputs, int(threads)) for threads in given.threads.split(',')}, inputs)


if __name__ == '__main__':
    main()
