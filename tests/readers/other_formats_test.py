"""Files of formats that tagrid does not read: the refusal names the format, and what it advises is right."""

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
    "a.bin": (OLE2, "OLE2"), "a.surf": (b"# HyperSurface 0.1 BINARY\n", "Amira"),
    "a.npz": (zip_of("arr_0.npy"), "NumPy"), "attributes.json": (b'{"dimensions":[9,7,5],"blockSize":[9,7,5],"dataType":"uint16"}', "N5"),
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
        for name in ("a.png", "a.npz", "a.surf"):
            (self.folder / name).write_bytes(KNOWN[name][0])
        found = self.search(".").stdout
        for word in ("is a PNG image", "is a NumPy archive", "is a surface of Amira"):
            self.assertIn(word, found)

    def test_a_search_survives_every_beginning_of_them(self):
        for name, (content, _) in KNOWN.items():
            for length in range(min(len(content), 64)):
                (self.folder / f"{length}{name}").write_bytes(content[:length])
        self.search(".")

    def test_directories_of_them_are_named(self):
        for folder, names, word in (("png", ("s1.png", "s2.png"), "PNG"), ("jpg", ("s1.jpg",), "JPEG image")):
            (self.folder / folder).mkdir()
            for name in names:
                content = {"png": KNOWN["a.png"], "jpg": KNOWN["a.jpg"]}[folder][0]
                (self.folder / folder / name).write_bytes(content)
            self.assertIn(word, self.message(folder))

    @unittest.skipIf(numpy is None, "there is no numpy on this machine")
    def test_the_description_in_the_message_is_that_of_the_samples(self):
        truth = numpy.random.default_rng(2).integers(-1000, 3000, (5, 7, 9), "int16")
        floats = truth.astype("float32")

        def fits(array, bits):
            cards = ("SIMPLE  =                    T", f"BITPIX  = {bits:20}", "NAXIS   =                    3", "NAXIS1  =                    9",
                     "NAXIS2  =                    7 / rows", "NAXIS3  =                    5", "END")
            return "".join(card.ljust(80) for card in cards).ljust(2880).encode() + array.astype(array.dtype.newbyteorder(">")).tobytes()

        files = {"1.fits": (fits(truth, 16), truth), "2.fits": (fits(floats, -32), floats)}
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
        for name, content in (("cut.fits", fits(truth, 16)[:-1]), ("padded.fits", fits(truth, 16).ljust(5760, b"\0")),
                              ("scaled.fits", fits(truth, 16).replace(b"END".ljust(80), b"BZERO   =                32768".ljust(80)).replace(b" " * 80, b"END".ljust(80), 1))):
            (self.folder / name).write_bytes(content)
            self.assertNotIn("--dims", self.message(name), name)


if __name__ == "__main__":
    main()
