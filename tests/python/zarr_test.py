"""A .tag file is a Zarr store, and chunks of Zarr arrays are .tag files."""

import os
import pathlib
import json
import pickle
import sys
import tempfile
import unittest
import warnings

import numpy as np
import tagrid

import parts
from volumes import TYPES, Source, blobs, module

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from versions import has_zarr_3

try:
    import zarr
    from tagrid.numcodecs import Tagrid
    from tagrid.zarr import Store
    MISSING = False
    FORMAT = {"zarr_format": 2} if has_zarr_3() else {}
except ImportError:
    MISSING = True

SHAPE = (70, 90, 150)


@unittest.skipIf(MISSING, "there is no zarr")
class Stores(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.samples = blobs(SHAPE)
        cls.bytes = tagrid.encode(cls.samples, spacing=(2, 0.5, 0.25), cube=8, brick=4)
        cls.store = Store(cls.bytes, chunk=32)
        cls.group = zarr.open_group(cls.store, mode="r")

    def test_every_level_has_every_so_manieth_sample(self):
        self.assertEqual([name for name in self.group.array_keys() if name.isdigit()], ["0", "1", "2", "3"])
        for level in range(4):
            array, step = self.group[str(level)], 2**level
            np.testing.assert_array_equal(array[:], self.samples[::step, ::step, ::step])
            np.testing.assert_array_equal(array[3:8, ::2, 5], self.samples[::step, ::step, ::step][3:8, ::2, 5])
        self.assertEqual(self.group["0"].chunks, (32, 32, 32))
        self.assertLessEqual(max(self.group["3"].shape), 32)

    def test_levels_are_where_their_samples_are(self):
        for affine, scale, translation in (
                (np.array([[-0.5, 0, 0, 10], [0, 0.5, 0, 20], [0, 0, 2, 30], [0, 0, 0, 1]]), [2, 0.5, -0.5], [30, 20, 10]),
                (np.array([[0, 0.5, 0, 20], [-0.5, 0, 0, 10], [0, 0, 2, 30], [0, 0, 0, 1]]), [2, 0.5, 0.5], [0, 0, 0])):
            store = Store(tagrid.encode(self.samples[:40, :40, :40], affine=affine), chunk=16)
            (multiscales,) = zarr.open_group(store, mode="r").attrs["multiscales"]
            self.assertEqual([axis["name"] for axis in multiscales["axes"]], ["z", "y", "x"])
            self.assertEqual(len(multiscales["datasets"]), 3)
            for level, dataset in enumerate(multiscales["datasets"]):
                scales, translations = dataset["coordinateTransformations"]
                self.assertEqual((dataset["path"], scales["scale"], translations["translation"]),
                                 (str(level), [step * 2**level for step in scale], translation))

    def test_levels_are_the_overviews_of_a_file_that_has_some(self):
        path = pathlib.Path(__file__).parents[1] / "golden/1.0/lead_voxels_overviews_int16.tag"
        volume = tagrid.open(path)
        group = zarr.open_group(Store(path, chunk=8), mode="r")
        (multiscales,) = group.attrs["multiscales"]
        self.assertEqual(multiscales["type"], "mean")
        self.assertEqual(len(multiscales["datasets"]), 3)
        np.testing.assert_array_equal(group["0"][:], np.asarray(volume))
        for number, factor in ((1, 4), (2, 16)):
            overview = volume.overview(factor)
            np.testing.assert_array_equal(group[str(number)][:], np.asarray(overview))
            scale, translation = multiscales["datasets"][number]["coordinateTransformations"]
            self.assertEqual(scale["scale"], [factor] * 3)
            self.assertEqual(translation["translation"], [(factor - 1) / 2] * 3)

    def test_values_follow_from_samples_by_attributes(self):
        pairs = {"rescale_slope": "0.5", "rescale_intercept": "-1024", "rescale_units": "HU", "scanner": "A"}
        data = tagrid.encode(self.samples, metadata=pairs)
        group = zarr.open_group(Store(data), mode="r")
        for name in ("0", "1"):
            array = group[name]
            self.assertEqual({"scale_factor": 0.5, "add_offset": -1024.0, "units": "HU"},
                             {key: value for key, value in array.attrs.items() if key != "_ARRAY_DIMENSIONS"})
        np.testing.assert_array_equal(group["0"][:], self.samples)
        self.assertEqual(group.attrs["tagrid"], {"max_error": 0, "achieved_max_error": 0, "affine": np.eye(4).tolist(), "metadata": pairs})
        for none in ({}, {"rescale_slope": "1", "rescale_intercept": "0"}, {"slice_slopes": "1 2", "rescale_slope": "3"}):
            self.assertEqual(list(zarr.open_group(Store(tagrid.encode(self.samples, metadata=none)), mode="r")["0"].attrs), ["_ARRAY_DIMENSIONS"])
        # JSON has no number for a bound that does not exist.
        store = Store(tagrid.encode(self.samples, grid_only=True, max_error=None))
        self.assertIsNone(zarr.open_group(store, mode="r").attrs["tagrid"]["max_error"])
        xarray = module("xarray")
        values = 0.5 * self.samples - 1024
        with xarray.open_zarr(Store(data)) as opened:
            np.testing.assert_array_equal(opened["0"], values)
            np.testing.assert_array_equal(opened["1"], values[::2, ::2, ::2])
            self.assertEqual(opened["0"].attrs["units"], "HU")
        with xarray.open_zarr(Store(data), mask_and_scale=False) as opened:
            self.assertEqual(opened["0"].dtype, self.samples.dtype)
            np.testing.assert_array_equal(opened["0"], self.samples)

    def test_coordinates_say_where_samples_are_also_if_slices_lie_unevenly(self):
        places = np.cumsum(np.arange(70) % 3 + 1.5)
        metadata = {"slice_positions": "; ".join(f"5 6 {z}" for z in places)}
        affine = np.array([[0.5, 0, 0, 5], [0, -0.5, 0, 6], [0, 0, 2.5, 1.5], [0, 0, 0, 1]])
        store = Store(tagrid.encode(self.samples, affine=affine, metadata=metadata), chunk=32)
        group = zarr.open_group(store, mode="r")
        for level in range(2):
            np.testing.assert_array_equal(group[f"z_{level}" if level else "z"], places[::2**level])
            np.testing.assert_array_equal(group[f"y_{level}" if level else "y"], 6 - 0.5 * np.arange(SHAPE[1])[::2**level])
        self.assertEqual(group["z"].attrs["units"], "mm")
        self.assertEqual(group["z_1"].attrs["long_name"], "position in the world")
        with module("xarray").open_zarr(store) as opened:
            np.testing.assert_array_equal(opened["1"].coords["z_1"], places[::2])
            np.testing.assert_array_equal(opened["0"].sel(z=places[7]), self.samples[7])
            np.testing.assert_array_equal(opened["0"].coords["x"], 5 + 0.5 * np.arange(SHAPE[2]))

    def test_axes_have_the_units_of_the_file(self):
        def units(**options):
            (multiscales,) = json.loads(Store(tagrid.encode(self.samples, **options))[".zattrs"])["multiscales"]
            return [axis.get("unit") for axis in multiscales["axes"]]

        self.assertEqual(units(spacing=(1, 2, 3)), ["millimeter"] * 3)
        self.assertEqual(units(), [None] * 3)
        self.assertEqual(units(spacing=(1, 2, 3), metadata={"space": "scanner-xyz", "space units": '"um" "\u00b5m" "light year"'}),
                         [None, "micrometer", "micrometer"])

    def test_one_slice_has_chunks_of_one_slice(self):
        store = Store(tagrid.encode(self.samples[:1]), chunk=2**30)
        array = zarr.open_group(store, mode="r")["0"]
        self.assertEqual(array.chunks, (1, *SHAPE[1:]))
        np.testing.assert_array_equal(array[...], self.samples[:1])
        store.close()
        self.assertRaises(tagrid.ArgumentError, lambda: array[...])
        self.assertRaises(KeyError, lambda: store[5])
        for wrong, kind in ((-1, tagrid.ArgumentError), ("1G", TypeError)):
            self.assertRaises(kind, Store, self.bytes, cache_bytes=wrong)

    def test_a_codec_that_cannot_be_is_refused_when_it_is_made(self):
        for wrong in ({"max_error": -1}, {"max_error": np.inf}, {"effort": "most"}):
            self.assertRaises(tagrid.ArgumentError, Tagrid, **wrong)
        self.assertRaises(TypeError, Tagrid, threads="all")

    def test_it_is_a_mapping_that_cannot_be_changed(self):
        keys = list(self.store)
        self.assertEqual(len(keys), len(self.store))
        self.assertTrue(all(key in self.store for key in keys))
        for key in ("0/0/0/5", "4/0/0/0", "0/-1/0/0", "0/0/0", "a", "0/0/0/\u0660", 3, "0/0/0/0/0"):
            self.assertNotIn(key, self.store)
        self.assertRaises(KeyError, lambda: self.store["0/9/0/0"])
        self.assertRaises(PermissionError, self.store.update, {"0/0/0/0": b""})
        self.assertRaises(PermissionError, self.store.pop, "0/0/0/0")
        self.assertRaises(tagrid.ArgumentError, Store, self.bytes, chunk=0)

    def test_a_brick_is_decoded_once_although_chunks_have_other_borders(self):
        source = Source(self.bytes)
        store = Store(source, chunk=32)
        source.reads = 0
        np.testing.assert_array_equal(zarr.open_group(store, mode="r")["0"][:], self.samples)
        self.assertEqual(source.reads, np.prod(store.volume.info["bricks"]))
        small = Store(source, chunk=64, cache_bytes=0)
        np.testing.assert_array_equal(zarr.open_group(small, mode="r")["0"][:], self.samples)
        self.assertLessEqual(len(small._levels[0]._bricks._kept), 8)

    def test_dask_reads_it(self):
        da = module("dask.array")
        np.testing.assert_array_equal(da.from_zarr(self.group["1"]).compute(), self.samples[::2, ::2, ::2])

    def test_consolidated_metadata_and_xarray_have_the_samples(self):
        group = zarr.open_consolidated(self.store, mode="r")
        np.testing.assert_array_equal(group["2"][:], self.samples[::4, ::4, ::4])
        xarray = module("xarray")
        with_zeros = np.where(self.samples % 2 == 0, 0, self.samples)
        store = Store(tagrid.encode(with_zeros), chunk=64)
        for data in (xarray.open_zarr(store), xarray.open_zarr(store, consolidated=False), xarray.open_dataset(store, engine="zarr")):
            self.assertEqual(data["0"].dims, ("z", "y", "x"))
            for level in range(3):
                self.assertEqual(data[str(level)].dtype, with_zeros.dtype)
                np.testing.assert_array_equal(data[str(level)], with_zeros[::2**level, ::2**level, ::2**level])

    def test_a_store_says_what_it_is_and_is_closed_by_a_block(self):
        with Store(self.bytes) as store:
            self.assertRegex(repr(store), r"<tagrid.zarr.Store of <tagrid.Volume .*>, \d resolutions>")
            self.assertIn("0/.zarray", store)
        self.assertTrue(store.volume.closed)
        self.assertRaises(TypeError, Store, self.bytes, chunk="64")

    def test_other_processes_have_their_own_store(self):
        self.group["0"][:9]
        again = pickle.loads(pickle.dumps(self.group))
        np.testing.assert_array_equal(again["1"][:], self.samples[::2, ::2, ::2])
        np.testing.assert_array_equal(again["0"][:], self.samples)


@unittest.skipIf(MISSING, "there is no zarr")
class Codecs(unittest.TestCase):
    def test_arrays_of_every_type_and_order_come_back(self):
        for dtype in (*TYPES, ">i2", ">f4"):
            for order in "CF":
                samples = blobs((20, 30, 25), np.dtype(dtype).newbyteorder("=")).astype(dtype)
                array = zarr.array(samples, chunks=(16, 16, 16), order=order, compressor=Tagrid(), **FORMAT)
                np.testing.assert_array_equal(array[:], samples)
                self.assertEqual(array.dtype, samples.dtype)

    def test_axes_of_one_sample_do_not_count(self):
        samples = blobs((20, 30, 25)).reshape(1, 20, 30, 1, 25)
        np.testing.assert_array_equal(zarr.array(samples, chunks=(1, 16, 16, 1, 16), compressor=Tagrid(), **FORMAT)[:],
                                      samples)
        flat = blobs((1, 1, 100)).ravel()
        np.testing.assert_array_equal(zarr.array(flat, compressor=Tagrid(), **FORMAT)[:], flat)
        self.assertRaises(TypeError, zarr.array, np.ones((2, 2, 2, 2), "u1"), compressor=Tagrid(), **FORMAT)
        self.assertRaises(TypeError, zarr.array, np.ones((2, 2, 2), "i8"), compressor=Tagrid(), **FORMAT)

    def test_an_array_on_disk_is_read_by_its_metadata_and_keeps_the_bound(self):
        samples = blobs((40, 50, 60), "float32")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.zarr")
            coder = Tagrid(max_error=np.float32(0.5), effort="fast")
            zarr.array(samples, store=path, compressor=coder, chunks=(32, 32, 32), **FORMAT)
            again = zarr.open_array(path, mode="r")
            self.assertEqual(again.compressor, Tagrid(max_error=0.5, effort="fast"))
            self.assertLessEqual(abs(again[:] - samples).max(), 0.5)
            self.assertLess(sum(f.stat().st_size for f in pathlib.Path(path).iterdir()), samples.nbytes / 2)

    def test_the_bound_holds_however_a_chunk_is_written(self):
        for number, (samples, bound) in enumerate(parts.cases()):
            array = zarr.zeros(samples.shape, chunks=parts.CHUNKS, dtype=samples.dtype,
                               compressor=Tagrid(bound, effort="fast", threads=1), **FORMAT)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                parts.write_in_parts(array, samples, number)
            parts.check_within(self, array[:], samples, bound, f"{samples.dtype} within {bound}")

    def test_a_fill_value_is_kept_however_a_chunk_is_written(self):
        for number, (samples, bound) in enumerate(parts.cases()):
            samples, fill = parts.fill_of(samples, bound)
            array = zarr.full(samples.shape, fill, chunks=parts.CHUNKS, dtype=samples.dtype,
                              compressor=Tagrid(bound, threads=1, fill_value=fill), **FORMAT)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                array[:, 2] = samples[:, 2]
                self.assertTrue((array[:, 3] == fill).all())
                parts.write_in_parts(array, samples, number)
            parts.check_within(self, array[:], samples, bound, f"{samples.dtype} within {bound}")
            self.assertTrue((array[:][samples == fill] == fill).all(), f"{samples.dtype} within {bound}")
        self.assertEqual(array.compressor.get_config()["fill_value"], -9999.5)
        self.assertRaisesRegex(tagrid.ArgumentError, "cannot be the fill_value", Tagrid(1, fill_value=300).encode, np.zeros((4, 4, 4), "u1"))
        self.assertRaisesRegex(tagrid.ArgumentError, "give one of both", Tagrid, 1, fill_value=3, whole_chunks=True)

    def test_chunks_that_are_written_in_parts_are_told_of(self):
        samples = blobs((32, 32, 20))
        array = zarr.zeros(samples.shape, chunks=(16, 16, 10), dtype="i2", compressor=Tagrid(5), **FORMAT)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            array[:] = samples
            array[16:, :16] = samples[16:, :16]
        with self.assertWarnsRegex(UserWarning, r"a part of a chunk of 2560 samples .* array.rechunk\(target.chunks\)"):
            array[3] = samples[3]
        try:
            import dask.array as da
        except ImportError:
            return
        for chunks, says in (((10, 32, 20), True), (array.chunks, False)):
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                da.from_array(samples, chunks=chunks).store(array, scheduler="synchronous")
            self.assertEqual(any("a part of a chunk" in str(each.message) for each in said), says)
            self.assertLessEqual(abs(array[:] - samples).max(), 5)

    def test_whole_chunks_are_smaller_and_no_part_of_them_is_written(self):
        samples = blobs((64, 64, 64))
        sizes = [len(Tagrid(20, whole_chunks=whole).encode(samples)) for whole in (False, True)]
        self.assertLess(sizes[1], sizes[0])
        array = zarr.array(samples, chunks=(32, 32, 32), compressor=Tagrid(5, whole_chunks=True), **FORMAT)
        self.assertTrue(array.compressor.get_config()["whole_chunks"])
        stored = array[:]
        self.assertRaisesRegex(tagrid.ArgumentError, "Write whole chunks", array.__setitem__, 3, samples[3])
        np.testing.assert_array_equal(array[:], stored)
        self.assertRaises(TypeError, Tagrid, 5, whole_chunks=1)

    def test_damaged_chunks_are_an_error(self):
        data = Tagrid().encode(blobs((9, 9, 9)))
        self.assertRaises(tagrid.DamagedError, Tagrid().decode, data[:-3])
        self.assertRaises(TypeError, Tagrid, "5")
        self.assertRaises(tagrid.ArgumentError, Tagrid, effort="most")
        self.assertRaises(tagrid.ArgumentError, Tagrid, grid="none")
        out = np.empty(729, "i2")
        np.testing.assert_array_equal(Tagrid().decode(data, out), Tagrid().decode(data))


if __name__ == "__main__":
    unittest.main(argv=["zarr_test"])
