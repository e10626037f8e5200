"""Files of formats that tagrid does not read: the refusal names the format, and what it advises is right.

    other_formats_test.py PROGRAM
"""

import io
import re
import struct
import unittest
import zipfile

from other_readers import ReaderTest, main, nibabel, numpy

OLE2 = bytes.fromhex("d0cf11e0a1b11ae1")


def at(offset, bytes_there, before=b""):
    return before.ljust(offset, b"\0") + bytes_there


def zip_of(name):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(name, b"x")
    return file.getvalue()


# Beginnings by names of files, and the word that the message must have.
KNOWN = {
    "a.txm": (OLE2, "TXM"), "a.txrm": (OLE2, "TXRM"), "a.bin": (OLE2, "OLE2"), "a.am": (b"# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\n", "Amira"),
    "b.am": (b"# Avizo BINARY-LITTLE-ENDIAN 2.1\n", "Avizo"), "a.mrc": (at(208, b"MAP DD\0\0"), "MRC"), "a.npy": (b"\x93NUMPY\1\0" + bytes(200), "NumPy"),
    "a.npz": (zip_of("arr_0.npy"), "NumPy"), "a.edf": (b"{\nHeaderID = EH:000001:000000:000000 ;\nDim_1 = 9 ;\n}\n".ljust(512), "EDF"),
    "attributes.json": (b'{"dimensions":[9,7,5],"blockSize":[9,7,5],"dataType":"uint16"}', "N5"), "a.vff": (b"ncaa\nrank=3;\nsize=9 7 5;\n\x0c\n", "VFF"),
    "a.fits": (b"SIMPLE  =                    T".ljust(2880), "FITS"), "a.vtk": (b"# vtk DataFile Version 3.0\nx\nBINARY\n", "VTK"),
    "a.vti": (b'<?xml version="1.0"?>\n<VTKFile type="ImageData">\n', "VTK"), "a.vtp": (b'<VTKFile type="PolyData">\n', "VTK"),
    "a.mgh": (struct.pack(">7i", 1, 9, 7, 5, 1, 4, 0) + bytes(256), "MGH"), "a.mgz": (b"\x1f\x8b\x08" + bytes(20), "MGZ"),
    "a.dm3": (struct.pack(">3i", 3, 100, 1) + bytes(100), "DM3"), "a.dm4": (struct.pack(">iqi", 4, 100, 1) + bytes(100), "DM4"),
    "a.aim": (struct.pack("<2i", 20, 140) + bytes(100), "AIM"), "b.aim": (b"AIMDATA_V030   \0" + bytes(100), "AIM"),
    "a.gipl": (at(252, bytes.fromhex("2ae389b8")), "GIPL"), "a.hv": (b"!INTERFILE  :=\n", "Interfile"), "a.v": (b"MATRIX72v\0", "ECAT"),
    "a.par": (b"# === DATA DESCRIPTION FILE ======\n", "PAR"), "method": (b"##TITLE=Parameter List, ParaVision\n", "ParaVision"),
    "a.mnc": (b"CDF\1" + bytes(50), "MINC 1"), "a.nc": (b"CDF\2" + bytes(50), "NetCDF"), "a.hdf": (b"\x0e\x03\x13\x01" + bytes(9), "HDF4"),
    "a.mat": (b"MATLAB 5.0 MAT-file" + bytes(100), "MATLAB"), "a.log": (b"[System]\r\nScanner=Skyscan1172\r\n", "SkyScan"),
    "a.xml": (b'<?xml version="1.0"?>\n<SpimData version="0.2">\n', "BigDataViewer"), "a.ics": (b"\t\nics_version\t1.0\n", "ICS"),
    "a.czi": (b"ZISRAWFILE" + bytes(50), "CZI"), "a.lif": (struct.pack("<2i", 0x70, 9) + b"\x2a" + bytes(50), "LIF"), "a.nd2": (b"\xda\xce\xbe\x0a" + bytes(50), "ND2"),
    "a.png": (b"\x89PNG\r\n\x1a\n" + bytes(50), "PNG"), "a.jpg": (b"\xff\xd8\xff\xe0\0\x10JFIF\0", "JPEG image"), "a.gif": (b"GIF89a" + bytes(50), "GIF"),
    "a.webp": (b"RIFF\x10\0\0\0WEBPVP8 ", "WebP"), "a.exr": (b"\x76\x2f\x31\x01" + bytes(50), "OpenEXR"), "a.pgm": (b"P5\n9 7\n255\n", "PGM"),
    "a.pdf": (b"%PDF-1.7\n", "PDF"), "a.gz": (b"\x1f\x8b\x08" + bytes(20), "gzip"), "a.zst": (b"\x28\xb5\x2f\xfd" + bytes(20), "zstd"),
    "a.xz": (b"\xfd7zXZ\0" + bytes(20), "xz"), "a.bz2": (b"BZh9" + bytes(20), "bzip2"), "a.lz4": (b"\x04\x22\x4d\x18" + bytes(20), "lz4"),
    "a.zip": (zip_of("a.tif"), "zip archive"), "a.tar": (at(257, b"ustar"), "tar archive"), "a.7z": (b"7z\xbc\xaf\x27\x1c" + bytes(20), "7z archive"),
    "a.rar": (b"Rar!\x1a\x07\0", "RAR"), "a.vgl": (b"anything", "VGStudio"), "a.rek": (b"anything", ".rek"), "a.pcr": (b"[VolumeData]\n", "phoenix"),
}


class OtherFormats(ReaderTest):
    def message(self, name, *options):
        run = self.tagrid("encode", name, "-o", "x.tag", *options)
        self.assertEqual(run.returncode, 65, (name, run.stderr))
        return run.stderr

    def test_each_is_named(self):
        for name, (content, word) in KNOWN.items():
            (self.folder / name).write_bytes(content)
            message = self.message(name)
            said = message.split(name, 1)[1]
            self.assertIn(word, said, name)
            self.assertNotIn("JPEG 2000", said, name)
            if "is compressed (" not in said or "lz4" in said:
                self.assertNotIn("--dims", said, name)
            # A wrong description does not hide it.
            self.assertIn(word, self.message(name, "--dims", "3,5,7", "--type", "uint8"), name)
            (self.folder / name).unlink()

    def test_search_names_them(self):
        for name in ("a.png", "a.npy", "a.am"):
            (self.folder / name).write_bytes(KNOWN[name][0])
        found = self.ok("convert", "--find", ".").stdout
        for word in ("is a PNG image", "is a NumPy array", "is an Amira"):
            self.assertIn(word, found)

    def test_directories_of_them_are_named(self):
        for folder, names, word in (("png", ("s1.png", "s2.png"), "PNG"), ("jpg", ("s1.jpg",), "JPEG image"), ("n5", ("attributes.json",), "N5 container")):
            (self.folder / folder).mkdir()
            for name in names:
                content = {"png": KNOWN["a.png"], "jpg": KNOWN["a.jpg"], "n5": KNOWN["attributes.json"]}[folder][0]
                (self.folder / folder / name).write_bytes(content)
            self.assertIn(word, self.message(folder))

    @unittest.skipIf(numpy is None, "there is no numpy on this machine")
    def test_the_description_in_the_message_is_that_of_the_samples(self):
        truth = numpy.random.default_rng(2).integers(-1000, 3000, (5, 7, 9), "int16")
        unsigned, floats = (truth + 1000).astype("uint16"), truth.astype("float32")

        def npy(array, version=(1, 0)):
            file = io.BytesIO()
            numpy.lib.format.write_array(file, array, version)
            return file.getvalue()

        def mrc(array, mode, order="<", extra=b""):
            head = bytearray(1024)
            struct.pack_into(order + "4i", head, 0, 9, 7, 5, mode)
            struct.pack_into(order + "3i", head, 64, 1, 2, 3)
            struct.pack_into(order + "i", head, 92, len(extra))
            head[208:216] = b"MAP " + (b"DD\0\0" if order == "<" else b"\x11\x11\0\0")
            return bytes(head) + extra + array.astype(array.dtype.newbyteorder(order)).tobytes()

        def fits(array, bits):
            cards = ("SIMPLE  =                    T", f"BITPIX  = {bits:20}", "NAXIS   =                    3", "NAXIS1  =                    9",
                     "NAXIS2  =                    7 / rows", "NAXIS3  =                    5", "END")
            return "".join(card.ljust(80) for card in cards).ljust(2880).encode() + array.astype(array.dtype.newbyteorder(">")).tobytes()

        edf = "{\nHeaderID = EH:000001:000000:000000 ;\nByteOrder = %s ;\nDataType = %s ;\nDim_1 = 9 ;\nDim_2 = 7 ;\nDim_3 = 5 ;\n"
        edf_file = lambda order, type: (edf % (order, type)).ljust(1022).encode() + b"}\n"
        vff = b"ncaa\nrank=3;\ntype=raster;\nformat=slice;\nsize=9 7 5;\nbits=16;\nbands=1;\n\x0c\n"
        files = {"1.npy": (npy(truth), truth), "2.npy": (npy(floats, (2, 0)), floats), "3.npy": (npy(unsigned, (3, 0)), unsigned),
                 "big.npy": (npy(truth.astype(">i2")), truth), "fortran.npy": (npy(numpy.asfortranarray(truth.T)), truth),
                 "slice.npy": (npy(truth[0]), truth[:1]),
                 "1.mrc": (mrc(truth, 1), truth), "2.mrc": (mrc(floats, 2, "<", b"x" * 80), floats), "6.mrc": (mrc(unsigned, 6, ">"), unsigned),
                 "1.fits": (fits(truth, 16), truth), "2.fits": (fits(floats, -32), floats),
                 "1.edf": (edf_file("LowByteFirst", "UnsignedShort") + unsigned.tobytes(), unsigned),
                 "2.edf": (edf_file("HighByteFirst", "FloatValue") + floats.astype(">f4").tobytes(), floats),
                 "1.vff": (vff + truth.astype(">i2").tobytes(), truth)}
        for name, (content, samples) in files.items():
            (self.folder / name).write_bytes(content)
            advice = re.search(r"describe its samples: (--.*)", self.message(name))
            self.assertIsNotNone(advice, name)
            self.encodes(samples, name, *advice.group(1).split(), what=name)
        if nibabel is not None:
            volume = numpy.asfortranarray(floats.T)
            nibabel.save(nibabel.MGHImage(volume, numpy.eye(4)), self.folder / "a.mgh")
            advice = re.search(r"describe its samples: (--.*)", self.message("a.mgh"))
            if advice is not None:  # without what nibabel writes after the samples
                self.encodes(floats, "a.mgh", *advice.group(1).split())
        # Other types, scales, sizes: there is nothing to describe.
        for name, content in (("half.npy", npy(floats.astype("f2"))), ("record.npy", npy(numpy.zeros(3, "u1,u2"))), ("four.npy", npy(numpy.zeros((2, 2, 2, 2), "u1"))),
                              ("cut.npy", npy(truth)[:-1]), ("padded.fits", fits(truth, 16).ljust(5760, b"\0")),
                              ("scaled.fits", fits(truth, 16).replace(b"END".ljust(80), b"BZERO   =                32768".ljust(80)).replace(b" " * 80, b"END".ljust(80), 1))):
            (self.folder / name).write_bytes(content)
            self.assertNotIn("--dims", self.message(name), name)


if __name__ == "__main__":
    main()
