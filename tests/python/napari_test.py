"""napari's reader, without napari: what it gives has the right samples and places, and is read when it is used.

The manifest is compared with what napari documents. Where npe2 is installed, which reads manifests for napari, it
reads this one.
"""

import pathlib
import subprocess
import sys
import unittest
import warnings

import numpy as np
import tagrid
import tagrid.napari

from volumes import blobs, module, temporary_folder

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import scans

PROGRAM = pathlib.Path(sys.argv[1])
try:
    import dask.array as da
except ImportError:
    da = None


class Reader(unittest.TestCase):
    def setUp(self):
        self.folder = temporary_folder(self)

    def written(self, samples, **options):
        path = str(self.folder / "my scan.tag")
        tagrid.encode(samples, path, **options)
        return path

    def one_layer(self, path):
        layer, = tagrid.napari.get_reader(path)(path)
        data, options, kind = layer
        self.assertEqual((kind, options["name"]), ("image", "my scan"))
        return data, options

    def test_it_takes_tag_files_only(self):
        self.assertIsNotNone(tagrid.napari.get_reader("a.tag"))
        self.assertIsNotNone(tagrid.napari.get_reader("A.TAG"))
        for path in ("a.tif", "tag", ["a.tag", "b.tag"], pathlib.Path("a")):
            self.assertIsNone(tagrid.napari.get_reader(path))
        (self.folder / "a.tag").write_text("text")
        with self.assertRaises(tagrid.DamagedError):
            tagrid.napari.read(str(self.folder / "a.tag"))

    def test_samples_place_and_units(self):
        samples = blobs((20, 30, 40))
        affine = np.diag([0.25, 0.5, 2, 1])
        affine[:3, 3] = (7, 8, 9)
        data, options = self.one_layer(self.written(samples, affine=affine, metadata={"space units": '"um" "um" "um"'}))
        np.testing.assert_array_equal(np.asarray(data), samples)
        self.assertEqual((options["scale"], options["translate"]), ([2, 0.5, 0.25], [9, 8, 7]))
        self.assertEqual(options["units"], ["micrometer"] * 3)
        self.assertNotIn("multiscale", options)
        self.assertEqual(options["metadata"]["max_error"], 0)

    def test_values(self):
        samples = blobs((5, 6, 7), "uint16")
        path = self.written(samples, metadata={"rescale_slope": "1", "rescale_intercept": "-1024"})
        data, options = self.one_layer(path)
        np.testing.assert_array_equal(np.asarray(data), samples.astype(int) - 1024)
        self.assertEqual(options["contrast_limits"], [int(samples.min()) - 1024, int(samples.max()) - 1024])

    def test_contrast_limits_are_two_different_numbers_or_none(self):
        self.assertNotIn("contrast_limits", self.one_layer(self.written(np.zeros((4, 5, 6), "u1")))[1])
        samples = blobs((4, 5, 6), "float32")
        samples[1, 2, 3] = np.inf
        limits = self.one_layer(self.written(samples))[1].get("contrast_limits", [0, 1])
        self.assertTrue(np.isfinite(limits).all() and limits[0] < limits[1])
        path = self.written(blobs((4, 5, 6)), metadata={"slice_slopes": "1 2 3 4", "slice_intercepts": "0 0 0 0"})
        self.assertNotIn("contrast_limits", self.one_layer(path)[1])

    def test_the_bound_is_that_of_the_values(self):
        metadata = {"rescale_slope": "-2", "max_error": "0", "author": "nobody"}
        path = self.written(blobs((5, 6, 7), "int16"), max_error=3, metadata=metadata)
        self.assertEqual(self.one_layer(path)[1]["metadata"], {**metadata, "max_error": 6})

    def test_an_oblique_scan_has_a_matrix(self):
        turned = np.array([[0, 0, 3, 5], [0, -2, 0, 6], [1, 0, 0, 7], [0, 0, 0, 1.0]])
        data, options = self.one_layer(self.written(blobs((4, 5, 6)), affine=turned))
        self.assertNotIn("scale", options)
        x, y, z = 5, 4, 3
        np.testing.assert_allclose((options["affine"] @ (z, y, x, 1))[:3], (turned @ (x, y, z, 1))[2::-1])

    def test_overviews_are_levels(self):
        path = self.written(blobs((70, 90, 150)), overviews=(4, 16), spacing=(2, 1, 1))
        data, options = self.one_layer(path)
        self.assertTrue(options["multiscale"])
        self.assertEqual([level.shape for level in data], [(70, 90, 150), (18, 23, 38), (5, 6, 10)])
        with tagrid.open(path) as scan:
            for level, volume in zip(data, (scan, scan.overview(4), scan.overview(16))):
                np.testing.assert_array_equal(np.asarray(level), volume[...])
        self.assertEqual(options["scale"], [2, 1, 1])

    @unittest.skipUnless(da, "there is no dask")
    def test_only_what_is_shown_is_decoded(self):
        samples = blobs((130, 70, 130))
        path = self.written(samples)
        data = pathlib.Path(path).read_bytes()
        damaged = bytearray(data)
        damaged[len(data) // 2] ^= 1
        pathlib.Path(path).write_bytes(damaged)
        shown, _ = self.one_layer(path)
        self.assertEqual(shown.chunks, ((64, 64, 2), (64, 6), (64, 64, 2)))
        np.testing.assert_array_equal(shown[5, :40, 10:30].compute(), samples[5, :40, 10:30])
        with self.assertRaises(tagrid.DamagedError):
            shown.compute()

    def test_several_volumes_are_stacked(self):
        series = np.stack([blobs((4, 5, 6), seed=seed) for seed in range(3)])
        (self.folder / "a.nii").write_bytes(scans.nifti(series, (0.5, 1, 2)))
        path = str(self.folder / "my scan.tag")
        subprocess.run([PROGRAM, "encode", self.folder / "a.nii", "-o", path, "-q"], check=True)
        data, options = self.one_layer(path)
        np.testing.assert_array_equal(np.asarray(data), series)
        if "scale" in options:
            self.assertEqual(options["scale"], [1, 2, 1, 0.5])
        else:
            self.assertEqual(options["affine"].shape, (5, 5))
        self.assertEqual(options["units"][0], "pixel")

    def test_uneven_slices_are_said(self):
        positions = "; ".join(f"0 0 {z}" for z in (0, 1, 5))
        path = self.written(blobs((3, 4, 5)), spacing=(1, 1, 1), metadata={"slice_positions": positions})
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            tagrid.napari.read(path)
        self.assertIn("unequally spaced", str(said[0].message))

    def test_without_dask_it_is_numpy(self):
        samples = blobs((5, 6, 7))
        path = self.written(samples)
        code = ("import sys; sys.modules['dask'] = None; import numpy, tagrid.napari; (data, options, kind), = tagrid.napari.read(sys.argv[1]); "
                "assert type(data) is numpy.ndarray and int(data.sum()) == int(sys.argv[2])")
        subprocess.run([sys.executable, "-B", "-c", code, path, str(int(samples.sum(dtype=int)))], check=True)


class Writer(unittest.TestCase):
    """Layers are those that napari hands to writers: data, and the attributes of a layer."""

    def setUp(self):
        self.folder = temporary_folder(self)
        self.path = str(self.folder / "a.tag")

    def written(self, data, **attributes):
        self.assertEqual(tagrid.napari.write(self.path, data, attributes), [self.path])
        return tagrid.open(self.path)

    def test_what_is_read_is_written_as_it_is(self):
        samples = blobs((20, 30, 40), "uint16")
        affine = np.diag([0.25, 0.5, 2, 1])
        affine[:3, 3] = (7, 8, 9)
        turned = np.array([[0, 0, 3, 5], [0, -2, 0, 6], [1, 0, 0, 7], [0, 0, 0, 1.0]])
        pairs = {"rescale_slope": "1", "rescale_intercept": "-1024", "scanner": "A", "space units": '"um" "um" "um"'}
        for matrix in (affine, turned):
            tagrid.encode(samples, self.path, affine=matrix, metadata=pairs, overviews=(4,))
            (data, options, _), = tagrid.napari.read(self.path)
            self.assertTrue(options["multiscale"])
            with self.written([np.asarray(level) for level in data], **options) as again:
                np.testing.assert_array_equal(again[...], samples.astype(int) - 1024)
                np.testing.assert_allclose(again.affine, matrix)
                self.assertEqual((again.metadata["scanner"], again.metadata["space units"]), ("A", pairs["space units"]))
                self.assertEqual((again.max_error, "rescale_slope" in again.metadata), (0, False))

    def test_a_layer_is_where_napari_shows_it(self):
        angle = np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
        moved = np.eye(4)
        moved[:3, 3] = (100, 0, 0)
        attributes = {"scale": [2, 1, 0.5], "translate": [7, 8, 9], "rotate": angle.tolist(), "shear": [0.1, 0.2, 0.3],
                      "affine": moved, "units": ("millimeter",) * 3, "metadata": {"odd": 5}}
        with self.written(blobs((4, 5, 6)), **attributes) as volume:
            sheared = np.array([[1, 0.1, 0.2], [0, 1, 0.3], [0, 0, 1]])
            z, y, x = angle @ sheared @ np.diag([2, 1, 0.5]) @ (1, 2, 3) + (107, 8, 9)
            np.testing.assert_allclose((volume.affine @ (3, 2, 1, 1))[:3], (x, y, z))
            self.assertEqual(volume.metadata, {"space units": '"mm" "mm" "mm"'})

    def test_a_slice_is_a_volume_and_a_layer_without_units_has_no_spacing(self):
        with self.written(blobs((1, 30, 40))[0], scale=[1, 1], units=("pixel", "pixel")) as volume:
            self.assertEqual(volume.shape, (1, 30, 40))
            self.assertTrue(np.isnan(volume.spacing).all())
        with self.written(blobs((1, 30, 40))[0], scale=[3, 2], translate=[5, 4]) as volume:
            np.testing.assert_array_equal(volume.affine, [[2, 0, 0, 4], [0, 3, 0, 5], [0, 0, 1, 0], [0, 0, 0, 1]])

    def test_what_cannot_be_written_is_refused(self):
        for data, attributes, kind in ((np.zeros((4, 5, 3), "u1"), {"rgb": True}, tagrid.ArgumentError),
                                       (np.zeros((2, 3, 4, 5), "u1"), {}, tagrid.ArgumentError),
                                       (np.zeros((3, 4, 5), bool), {}, TypeError)):
            self.assertRaises(kind, tagrid.napari.write, self.path, data, attributes)
        self.assertFalse(pathlib.Path(self.path).exists())


class Manifest(unittest.TestCase):
    path = pathlib.Path(tagrid.__file__).parent / "napari.yaml"

    def test_it_has_what_napari_documents(self):
        manifest = module("yaml").safe_load(self.path.read_text())
        self.assertEqual(set(manifest), {"name", "display_name", "schema_version", "contributions"})
        self.assertEqual(manifest["name"], "tagrid")  # that of the package
        self.assertGreaterEqual(len(manifest["display_name"]), 3)
        reader, writer = manifest["contributions"]["commands"]
        for command, wanted in ((reader, tagrid.napari.get_reader), (writer, tagrid.napari.write)):
            self.assertTrue(command["id"].startswith("tagrid."))
            place, _, function = command["python_name"].partition(":")
            self.assertIs(getattr(sys.modules[place], function), wanted)
        self.assertEqual(manifest["contributions"]["readers"],
                         [{"command": reader["id"], "filename_patterns": ["*.tag"], "accepts_directories": False}])
        self.assertEqual(manifest["contributions"]["writers"],
                         [{"command": writer["id"], "layer_types": ["image"], "filename_extensions": [".tag"],
                           "display_name": "lossless"}])

    def test_the_package_says_that_it_is_for_napari(self):
        root = pathlib.Path(__file__).resolve().parents[2]
        for file in ("python/setup.py", "python/CMakeLists.txt"):
            self.assertIn("Framework :: napari", (root / file).read_text())
        self.assertIn("[napari.manifest]\ntagrid = tagrid:napari.yaml\n", (root / "python/entry_points.txt").read_text())

    def test_npe2_reads_it(self):
        manifest = module("npe2").PluginManifest.from_file(self.path)
        manifest.validate_imports()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
