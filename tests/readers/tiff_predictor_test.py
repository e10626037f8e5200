"""Floats of TIFF files with a predictor, in both byte orders: read as the standard says, or refused.

tiffcp (libtiff) writes the files, and for little-endian ones its uncompressed copy is read by tifffile. An encoder here,
which follows Adobe's TIFF Technical Note 3, writes big-endian files as other programs do; libtiff 4.5 swaps their bytes."""

import shutil
import subprocess
import unittest
import zlib

from other_readers import ReaderTest, main, numpy, tifffile
from tiff_odd_test import LONG, SHORT, tiff

tiffcp = shutil.which("tiffcp")


def with_predictor(rows):
    """Rows of floats as bytes: the most significant bytes of a row first, and differences of neighbors."""
    bytes_of_rows = []
    for row in rows:
        planes = numpy.frombuffer(row.astype(row.dtype.newbyteorder(">")).tobytes(), "uint8").reshape(-1, row.dtype.itemsize).T.ravel()
        bytes_of_rows.append(numpy.diff(planes, prepend=numpy.uint8(0)).astype("uint8").tobytes())
    return b"".join(bytes_of_rows)


def file_of(samples, order):
    pages = []
    for page in samples:
        tags = {256: (LONG, [page.shape[1]]), 257: (LONG, [page.shape[0]]), 258: (SHORT, [8 * page.dtype.itemsize]), 259: (SHORT, [8]), 262: (SHORT, [1]),
                277: (SHORT, [1]), 278: (LONG, [5]), 317: (SHORT, [3]), 339: (SHORT, [3])}
        pages.append((tags, [zlib.compress(with_predictor(page[y:y + 5])) for y in range(0, page.shape[0], 5)]))
    return tiff(pages, order)


@unittest.skipIf(numpy is None or tifffile is None, "there is no tifffile on this machine")
class Predictor(ReaderTest):
    def volumes(self):
        rng = numpy.random.default_rng(4)
        noise = rng.standard_normal((3, 17, 23))
        with_nan = noise * 1000
        with_nan[:, :5] = numpy.nan
        empty_first = numpy.zeros((3, 17, 23))
        empty_first[2, 3:9] = 7
        for values in (noise, numpy.round(noise * 1000), with_nan, empty_first, noise * 1e-6):
            for type in ("float32", "float64"):
                yield values.astype(type)

    def test_files_of_the_standard_are_read_in_both_byte_orders(self):
        for samples in self.volumes():
            for order in "<>":
                (self.folder / "a.tif").write_bytes(file_of(samples, order))
                self.encodes(samples, "a.tif", what=(order, samples.dtype))
        if tiffcp is None:
            return
        subprocess.run([tiffcp, "-c", "none", "-L", "a.tif", "b.tif"], cwd=self.folder, check=True)
        self.assert_same(tifffile.imread(self.folder / "b.tif"), samples)

    def test_numbers_of_unusual_sizes_do_not_show_the_byte_order(self):
        noise = numpy.random.default_rng(6).uniform(1, 2, (3, 17, 23))
        said = "the bytes of its samples may be swapped"
        for scale in (1e24, 1e-24):
            samples = (noise * scale).astype("float32")
            for order in "<>":
                (self.folder / "a.tif").write_bytes(file_of(samples, order))
                self.encodes(samples, "a.tif", what=(order, scale), says=said if order == ">" else "")
            # As libtiff 4.5 writes it.
            (self.folder / "a.tif").write_bytes(file_of(samples.byteswap(), ">"))
            self.assertIn(said, self.ok("encode", "a.tif", "-o", "a.tag", "-f").stderr)
            self.assert_refused(64, said, "encode", "a.tif", "-o", "a.tag", "-f", "--relative-error", "0.01", "--rm")
            self.assertTrue((self.folder / "a.tif").exists())

    @unittest.skipIf(tiffcp is None, "there is no tiffcp on this machine (libtiff-tools)")
    def test_files_of_libtiff_are_read_or_refused(self):
        for samples in self.volumes():
            tifffile.imwrite(self.folder / "base.tif", samples, photometric="minisblack")
            for order, scheme, layout in (("-L", "zip:3", ()), ("-L", "lzw:3", ("-t", "-w", "16", "-l", "16")), ("-B", "zip:3", ("-s", "-r", "7")),
                                          ("-B", "lzw:3", ("-t", "-w", "16", "-l", "16")), ("-B", "zip:3", ())):
                subprocess.run([tiffcp, order, *layout, "-c", scheme, "base.tif", "a.tif"], cwd=self.folder, check=True)
                subprocess.run([tiffcp, "-s", "-L", "-c", "none", "a.tif", "b.tif"], cwd=self.folder, check=True)
                if numpy.array_equal(tifffile.imread(self.folder / "b.tif"), samples, equal_nan=True):  # also of a libtiff without the fault
                    self.encodes(samples, "a.tif", what=(order, scheme, samples.dtype))
                else:
                    self.assertEqual(order, "-B")
                    self.assert_refused(65, "the bytes of its samples are swapped", "encode", "a.tif")

    @unittest.skipIf(tiffcp is None, "there is no tiffcp on this machine (libtiff-tools)")
    def test_differences_of_integers_are_read_in_both_byte_orders(self):
        rng = numpy.random.default_rng(5)
        for type in ("uint8", "int16", "uint32", "float32"):
            samples = (rng.standard_normal((2, 17, 23)) * 100).astype(type)
            tifffile.imwrite(self.folder / "base.tif", samples, photometric="minisblack")
            for order in ("-L", "-B"):
                for scheme in ("zip:2", "lzw:2"):
                    subprocess.run([tiffcp, order, "-c", scheme, "base.tif", "a.tif"], cwd=self.folder, check=True)
                    self.encodes(samples, "a.tif", what=(order, scheme, type))


if __name__ == "__main__":
    main()
