"""dask and xarray read volumes lazily and in parallel. Skipped, with a message, where they are missing."""

import os
import pickle
import sys
import threading
import unittest
import warnings

import numpy as np
import tagrid

from volumes import blobs, module, temporary_folder

SHAPE = (70, 90, 150)


class Counting:
    """A file in memory that counts the reads and the threads at once."""

    def __init__(self, data):
        self.data, self.size, self.reads, self.now, self.most = data, len(data), 0, 0, 0
        self.lock = threading.Lock()

    def read_at(self, offset, size):
        with self.lock:
            self.reads += 1
            self.now += 1
            self.most = max(self.most, self.now)
        threading.Event().wait(0.005)
        with self.lock:
            self.now -= 1
        return self.data[offset:offset + size]


def have_dask():
    try:
        import dask.array  # noqa: F401
    except ImportError:
        return False
    return True


class Libraries(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.samples = blobs(SHAPE)
        cls.bytes = tagrid.encode(cls.samples, spacing=(2, 0.5, 0.25), cube=8, brick=4)
        cls.path = temporary_folder(cls) / "scan.tag"
        cls.path.write_bytes(cls.bytes)


class Dask(Libraries):
    def setUp(self):
        self.da = module("dask.array")

    def test_a_volume_is_an_array_of_chunks(self):
        volume = tagrid.open(self.path)
        array = self.da.from_array(volume)
        self.assertEqual((array.shape, array.dtype), (SHAPE, np.int16))
        np.testing.assert_array_equal(array.compute(), self.samples)
        self.assertEqual(array[3:9, ::2, -1].sum().compute(), self.samples[3:9, ::2, -1].sum())
        np.testing.assert_array_equal(self.da.from_array(volume, chunks=volume.chunks)[5].compute(), self.samples[5])
        np.testing.assert_array_equal(array[[3, 60, 5]].compute(), self.samples[[3, 60, 5]])

    def test_aligned_chunks_are_read_in_parallel_and_once(self):
        source = Counting(self.bytes)
        volume = tagrid.open(source, threads=1)
        # A chunk of the size of a brick is a brick.
        for chunks in (volume.aligned_chunks(1), volume.chunks):
            source.reads = source.most = 0
            array = self.da.from_array(volume, chunks=chunks)
            self.assertEqual(array.max(axis=0).compute(scheduler="threads", num_workers=4).max(), self.samples.max())
            self.assertEqual(source.reads, np.prod(volume.info["bricks"]))
            self.assertGreater(source.most, 1)

    def test_masked_chunks_are_refused(self):
        masked = self.da.ma.masked_less(self.da.from_array(self.samples, chunks=32), self.samples.max())
        self.assertRaisesRegex(TypeError, "are masked in part", tagrid.encode, masked)
        self.assertEqual(tagrid.encode(self.da.ma.filled(masked, -5)), tagrid.encode(np.where(
            self.samples < self.samples.max(), -5, self.samples).astype(np.int16)))

    def test_names_are_the_same_as_long_as_the_file_is(self):
        def name():
            return self.da.from_array(tagrid.open(self.path)).name

        first = name()
        self.assertEqual(name(), first)
        os.utime(self.path, ns=(1, 1))
        self.assertNotEqual(name(), first)

    def test_names_are_those_of_the_file_that_is_open(self):
        path = f"{self.path}.replaced.tag"
        tagrid.encode(self.samples, path)
        volume = tagrid.open(path)
        tagrid.encode(self.samples + 1, path)
        self.assertNotEqual(self.da.from_array(volume).name, self.da.from_array(tagrid.open(path)).name)
        # An id() is that of another object sooner or later.
        names = {self.da.from_array(tagrid.open(self.bytes)).name for _ in range(20)}
        self.assertEqual(len(names), 20)

    def test_another_process_does_not_take_another_file(self):
        path = f"{self.path}.other.tag"
        tagrid.encode(self.samples, path)
        pickled = pickle.dumps(tagrid.open(path))
        self.assertEqual(pickle.loads(pickled).shape, SHAPE)
        tagrid.encode(self.samples[::-1], path)
        self.assertRaisesRegex(tagrid.InputError, "not the one that was open", pickle.loads, pickled)

    def test_processes_open_the_file_themselves(self):
        array = self.da.from_array(tagrid.open(self.path))
        self.assertEqual(array.sum().compute(scheduler="processes", num_workers=1), self.samples.sum())


class Xarray(Libraries):
    def setUp(self):
        self.xarray = module("xarray")

    def open(self, data, **options):
        """As xarray.open_dataset() does by the entry point, which only an installed package has."""
        from tagrid.xarray import TagridBackend
        return self.xarray.open_dataset(data, engine=TagridBackend, **options)

    def test_it_has_coordinates_in_mm(self):
        with self.open(self.path) as data:
            self.assertEqual(data.volume.dims, ("z", "y", "x"))
            np.testing.assert_array_equal(data.z, 2.0 * np.arange(70))
            np.testing.assert_array_equal(data.x, 0.25 * np.arange(150))
            self.assertEqual((data.y.attrs["units"], data.volume.attrs["max_error"]), ("mm", 0))
            np.testing.assert_array_equal(data.volume, self.samples)
            np.testing.assert_array_equal(data.volume.sel(x=slice(10, 20), z=4), self.samples[2, :, 40:81])
            np.testing.assert_array_equal(data.volume.isel(z=[3, 1], y=slice(None, None, -2), x=[0, 5]),
                                          self.samples[[3, 1]][:, ::-2][:, :, [0, 5]])
            np.testing.assert_array_equal(data.volume.isel(z=-1, x=slice(3, 30, 4)), self.samples[-1, :, 3:30:4])

    def test_every_index_gives_what_numpy_gives(self):
        """Slices with any steps, integers, and arrays that are outer or vectorized, without and with chunks."""
        random = np.random.default_rng(3)

        def some_slice(size):
            ends = [None if random.random() < 0.3 else int(random.integers(-size - beyond, size + beyond)) for _ in range(2)]
            return slice(*ends, int(random.choice([-40, -7, -4, -3, -2, -1, 1, 2, 3, 5])))

        def some_index(size):
            kind = random.integers(4)
            if kind == 0:
                return int(random.integers(-size, size))
            return random.integers(-size, size, random.integers(0, 6)) if kind == 1 else some_slice(size)

        def check(found, expected, what):
            self.assertEqual(found.shape, expected.shape, what)
            np.testing.assert_array_equal(found.values, expected, str(what))

        def outer(samples, keys):
            for axis in reversed(range(3)):
                samples = samples[(slice(None),) * axis + (keys[axis],)]
            return samples

        samples = self.samples[:30, :40, :50]
        data = f"{self.path}.small.tag"
        tagrid.encode(samples, data, cube=8, brick=2, affine=np.diag([1, 1, 2, 1]))
        for chunks in (None, {}, {"z": 7, "y": 40, "x": 11}) if have_dask() else (None,):
            # dask itself takes a slice that begins before the array and runs down for one of one sample.
            beyond = 3 if chunks is None else 0
            with warnings.catch_warnings(), self.open(data, chunks=chunks) as opened:
                warnings.filterwarnings("ignore", "The specified Dask chunks separate")
                for _ in range(60 if chunks is None else 25):
                    keys = [some_index(size) for size in samples.shape]
                    if chunks is None or all(np.size(key) for key in keys):
                        found = opened.volume[tuple(keys)]
                        check(found, outer(samples, keys), keys)
                        np.testing.assert_array_equal(found.z, 2.0 * np.arange(30)[keys[0]])
                    # One index after the other is another path through xarray.
                    first, second = some_slice(30), some_slice(40)
                    check(opened.volume[first][:, second], samples[first][:, second], (first, second))
                    points = [random.integers(-size, size, (3, 2)) for size in samples.shape]
                    at = [self.xarray.DataArray(each, dims=("a", "b")) for each in points]
                    check(opened.volume[at[0], at[1], at[2]], samples[tuple(points)], points)
                    check(opened.volume.isel(y=at[1], x=at[2], z=first).transpose("z", "a", "b"),
                          samples[first][:, points[1], points[2]], (first, points))
                self.assertRaises(IndexError, lambda: opened.volume[30].values)
                self.assertRaises(IndexError, lambda: opened.volume[[0, -31], [3, 4]].values)

    def test_an_array_with_coordinates_is_encoded_where_it_is(self):
        placed = np.array([[0.25, 0, 0, 3], [0, 0.5, 0, -7], [0, 0, -2, 9], [0, 0, 0, 1.0]])
        with self.open(tagrid.encode(self.samples, affine=placed)) as data:
            part = data.volume.isel(z=slice(4, 60), y=slice(None, None, 2), x=slice(10, None))
            again = tagrid.open(tagrid.encode(part))
            np.testing.assert_allclose(again.affine, placed @ [[1, 0, 0, 10], [0, 2, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]])
            np.testing.assert_array_equal(again, self.samples[4:60, ::2, 10:])
            other = tagrid.open(tagrid.encode(part, spacing=(1, 2, 3)))
            self.assertEqual(other.spacing, (1, 2, 3))
            np.testing.assert_allclose(self.encoded(part.drop_vars("y"), r"position, directions .*are not").spacing, (2, np.nan, 0.25))
            # Another order of axes would be another volume, unless it is taken back, as the message says.
            swapped = part.transpose("x", "y", "z")
            self.assertRaisesRegex(tagrid.ArgumentError, r"transpose\('z', 'y', 'x'\)", tagrid.encode, swapped)
            self.assertRaises(tagrid.ArgumentError, tagrid.encode, swapped, spacing=(1, 2, 3))
            self.assertEqual(tagrid.encode(swapped.transpose("z", "y", "x")), tagrid.encode(part))
        with self.open(tagrid.encode(self.samples)) as data:
            self.assertTrue(np.isnan(tagrid.open(tagrid.encode(data.volume)).spacing).all())

    def test_an_oblique_scan_is_encoded_where_it_is(self):
        coronal = [[0.25, 0, 0, 3], [0, 0, 2, -7], [0, -0.5, 0, 9], [0, 0, 0, 1.0]]
        tilted = [[0.25, 0, 0, 3], [0, 0.5, 0.6, -7], [0, 0, 1.9, 9], [0, 0, 0, 1.0]]
        oblique = [[0.24, -0.1, 0.5, 3], [0.07, 0.4, 0.1, -7], [0.02, 0.1, 1.8, 9], [0, 0, 0, 1.0]]
        space = {"space": "left-posterior-superior"}
        for affine in map(np.array, (coronal, tilted, oblique)):
            with self.open(tagrid.encode(self.samples, affine=affine, metadata=space)) as data:
                whole = self.encoded(data.volume)
                np.testing.assert_allclose(whole.affine, affine, rtol=1e-12, atol=1e-12)
                self.assertEqual(whole.metadata, space)
                part = self.encoded(data.volume.isel(z=slice(60, 4, -2), y=slice(5, 20), x=slice(10, None, 3)))
                np.testing.assert_array_equal(part, self.samples[60:4:-2, 5:20, 10::3])
                np.testing.assert_allclose(part.affine, affine @ [[3, 0, 0, 10], [0, 1, 0, 5], [0, 0, -2, 60], [0, 0, 0, 1]], atol=1e-9)
                single = self.encoded(data.volume[7:8])
                np.testing.assert_allclose(single.affine[:3, 3], affine[:3] @ [0, 0, 7, 1], atol=1e-9)
                # What says where it is may have been lost on the way.
                bare = data.volume.copy()
                bare.attrs = space
                lost = self.encoded(bare, r"coordinate system \(affine, space\) are not.*affine=")
                np.testing.assert_allclose(lost.spacing, np.linalg.norm(affine[:3, 2::-1], axis=0))
                self.assertNotIn("space", lost.metadata)

    def test_an_oblique_scan_with_slices_at_unequal_distances_is_encoded_where_it_is(self):
        steps = np.array([0, 1, 2, 3, 4, 7, 8.5, 12])
        positions = np.array([3, -7, 9]) + steps[:, None] * [0, 0.6, 0.8]
        affine = np.array([[0.25, 0, 0, 3], [0, 0.4, 0.6, -7], [0, -0.3, 0.8, 9], [0, 0, 0, 1]])
        metadata = {"slice_positions": "; ".join(" ".join(map(str, place)) for place in positions)}
        with self.open(tagrid.encode(self.samples[:8], affine=affine, metadata=metadata)) as data:
            for part, z in ((data.volume, slice(None)), (data.volume[::-1], slice(None, None, -1)), (data.volume[2:, 4:], slice(2, None))):
                again = self.encoded(part, "unequal distances; the position of each slice is kept")
                first = 0 if part.shape[1] == SHAPE[1] else 4
                np.testing.assert_allclose(again.slice_positions, positions[z] + first * affine[:3, 1])
                np.testing.assert_allclose(again.affine[:3, 3], again.slice_positions[0])
            even = self.encoded(data.volume[1:4])
            self.assertIsNone(even.slice_positions)
            np.testing.assert_allclose(even.affine, affine + np.c_[np.zeros((4, 3)), [0, 0.6, 0.8, 0]])
            cut = data.volume.copy()
            del cut.attrs["slice_positions"]
            self.encoded(cut, "along z are left out: they are not at equal distances\n.*are not. Give affine=")

    def test_units_and_the_coordinate_system_are_kept_with_the_place(self):
        metadata = {"space": "left-posterior-superior", "space units": '"um" "um" "um"'}
        for affine in (np.diag([0.25, 0.5, 2, 1]), np.diag([0.25, 0.5, 2, 1])[:, [1, 0, 2, 3]]):
            with self.open(tagrid.encode(self.samples, affine=affine, metadata=metadata)) as data:
                self.assertEqual(data.z.attrs["units"], "um")
                again = tagrid.open(tagrid.encode(data.volume[2:]))
                self.assertEqual(again.metadata["space units"], metadata["space units"])
                self.assertEqual(again.metadata["space"], metadata["space"])
                # Without its units, it would be in mm.
                self.assertEqual(tagrid.open(tagrid.encode(data.volume, metadata={"a": "b"})).metadata,
                                 {"a": "b", **metadata})
        with self.open(tagrid.encode(self.samples, spacing=(1, 2, 3), metadata={"units": '"nm" "um" "mm"'})) as data:
            self.assertEqual([data[name].attrs["units"] for name in "zyx"], ["mm", "um", "nm"])

    def labelled(self, z, y=(0, 0.5, 1.0, 1.5), x=(7, 8, 9), **attributes):
        """A DataArray with these coordinates."""
        shape = len(z), len(y), len(x)
        samples = np.arange(np.prod(shape), dtype="i2").reshape(shape)
        return self.xarray.DataArray(samples, dims=("z", "y", "x"), coords={"z": list(z), "y": list(y), "x": list(x)}, attrs=attributes)

    def encoded(self, array, warning=None, **settings):
        """The volume, and whether a warning was given: none if it is None."""
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            volume = tagrid.open(tagrid.encode(array, **settings))
        self.assertEqual([], [str(each.message) for each in said if warning is None])
        if warning is not None:
            self.assertRegex("\n".join(str(each.message) for each in said), warning)
            self.assertTrue(all(each.filename == __file__ for each in said))
        return volume

    def test_attributes_are_kept_or_it_is_said(self):
        array = self.labelled((0, 1, 2), units="HU", sample="tooth 7", scale_factor=0.5, add_offset=-1000, range=[1, 2.5], number=np.int16(4))
        self.assertEqual(self.encoded(array.assign_coords(time=3.5)).metadata, {
            "sample units": "HU", "sample": "tooth 7", "rescale_slope": "0.5", "rescale_intercept": "-1000", "range": "1 2.5", "number": "4",
            "time": "3.5"})
        with self.open(tagrid.encode(array)) as data:
            self.assertEqual((data.volume.attrs["units"], data.z.attrs["units"]), ("HU", "mm"))
            again = self.encoded(data.volume[:, ::2])
            self.assertEqual(again.metadata, tagrid.open(tagrid.encode(array)).metadata)
        with self.open(tagrid.encode(array, max_error=2)) as data:
            self.assertEqual(self.encoded(data.volume).metadata["source_max_error"], "2.0")
        odd = self.labelled((0, 1, 2), table={"a": 1}, **{"a:b": "c"}, spacings="1 1 1", slice_slopes="1 2 3", good="x")
        odd = odd.assign_coords(mask=("y", [0, 1, 2, 3]))
        self.assertEqual(self.encoded(odd, "not taken from a DataArray: mask, table, a:b, spacings, slice_slopes").metadata,
                         {"good": "x"})

    def test_places_are_kept_or_it_is_said(self):
        uneven = self.encoded(self.labelled((0, 1, 2, 4, 7.5)), "unequal distances; the position of each slice is kept")
        np.testing.assert_array_equal(uneven.slice_positions, [[7, 0, z] for z in (0, 1, 2, 4, 7.5)])
        np.testing.assert_array_equal(uneven.affine, [[1, 0, 0, 7], [0, 0.5, 0, 0], [0, 0, 1.5, 0], [0, 0, 0, 1]])
        with self.open(tagrid.encode(uneven)) as data:
            np.testing.assert_array_equal(data.z, [0, 1, 2, 4, 7.5])
            # Positions of all slices are not those of some.
            part = self.encoded(data.volume[::-2], "unequal distances")
            np.testing.assert_array_equal(part.slice_positions[:, 2], [7.5, 2, 0])
            even = self.encoded(data.volume[:3])
            self.assertIsNone(even.slice_positions)
            self.assertEqual(even.spacing, (1, 0.5, 1))
        single = self.encoded(self.labelled((4,), space="left-posterior-superior"))
        np.testing.assert_array_equal(single.affine[:3, 3], [7, 0, 4])
        np.testing.assert_array_equal(single.spacing, (np.nan, 0.5, 1))
        self.assertEqual(single.metadata["space"], "left-posterior-superior")
        down = self.encoded(self.labelled((4,), y=(3, 2, 1, 0)), "along z is unknown, and is taken as 1")
        np.testing.assert_array_equal(down.affine, [[1, 0, 0, 7], [0, -1, 0, 3], [0, 0, 1, 4], [0, 0, 0, 1]])
        for array, words in ((self.labelled((0, 1), y=(0, 1, 2, 4)), "along y are left out: they are not at equal"),
                             (self.labelled((0, 1, 0)), "along z are left out: they are not at equal"),
                             (self.labelled((0, np.nan, 2)), "along z are left out: they are not finite")):
            self.assertEqual(np.isnan(self.encoded(array, words).spacing).sum(), 1)

    def test_values_may_be_opened_instead_of_samples(self):
        metadata = {"rescale_slope": "0.5", "rescale_intercept": "-1000", "rescale_units": "HU", "_FillValue": "-200", "who": "x"}
        data = tagrid.encode(self.samples, metadata=metadata, spacing=(1, 1, 1))
        with self.open(data, rescaled=True) as opened, self.open(data) as stored:
            np.testing.assert_array_equal(stored.volume, self.samples)
            np.testing.assert_array_equal(opened.volume, (0.5 * self.samples - 1000).astype("f4"))
            np.testing.assert_array_equal(opened.volume[::-3, [5, 2], 7], (0.5 * self.samples - 1000)[::-3, [5, 2], 7])
            attributes = opened.volume.attrs
            self.assertEqual((attributes["units"], attributes["_FillValue"], attributes["who"]), ("HU", -1100, "x"))
            self.assertNotIn("rescale_slope", attributes)
            # Nothing is applied twice.
            again = self.encoded(opened.volume)
            self.assertEqual(again.rescaled.dtype, np.float32)
            np.testing.assert_array_equal(again.rescaled, opened.volume)
            self.assertEqual((again.metadata["applied_slope"], again.metadata["applied_intercept"]), ("0.5", "-1000"))
        with self.open(tagrid.encode(self.samples, max_error=4, metadata={"rescale_slope": "-0.5"}), rescaled=True) as opened:
            self.assertEqual(opened.volume.attrs["max_error"], 2)
            self.assertLessEqual(opened.volume.attrs["achieved_max_error"], 2)

    def test_numbers_for_missing_samples_are_not_changed_by_a_bound(self):
        for name in ("_FillValue", "missing_value"):
            array = self.labelled((0, 1, 2), **{name: np.int16(-999)})
            self.assertRaisesRegex(tagrid.ArgumentError, f"{name} says that -999.*max_error=0", tagrid.encode, array, max_error=5)
            self.assertEqual(self.encoded(array).metadata, {name: "-999"})
            with self.open(tagrid.encode(array)) as data:
                self.assertRaisesRegex(tagrid.ArgumentError, "stands for missing", tagrid.encode, data.volume, max_error=5)
                self.assertEqual(data.volume.attrs[name], np.int16(-999))
            floats = array.astype("f4").where(array > 3)
            floats.attrs[name] = np.nan
            found = self.encoded(floats, max_error=5)
            np.testing.assert_array_equal(np.isnan(found), np.isnan(floats))
            del array.attrs[name]
            self.encoded(array, max_error=5)

    def test_a_number_for_missing_samples_that_no_sample_can_be_is_a_text(self):
        for text in ("nan", "1e20", "0.5", "-1", "none"):
            with self.open(tagrid.encode(self.samples[:3].astype("u1"), metadata={"_FillValue": text})) as data:
                self.assertEqual(data.volume.attrs["_FillValue"], text)

    def test_it_is_lazy(self):
        source = Counting(self.bytes)
        with self.open(source) as data:
            source.reads = 0
            part = data.volume.isel(z=slice(0, 5), y=slice(0, 5), x=slice(0, 5))
            self.assertEqual(source.reads, 0)
            np.testing.assert_array_equal(part, self.samples[:5, :5, :5])
            self.assertEqual(source.reads, 1)
        self.assertRaises(ValueError, lambda: data.volume.isel(y=3).values)

    def test_chunks_are_whole_bricks(self):
        module("dask.array")
        with self.open(self.path, chunks={}) as data:
            self.assertEqual(data.volume.chunks, tagrid.open(self.path).aligned_chunks())
            np.testing.assert_array_equal(data.volume.mean("z"), self.samples.mean(axis=0))

    def test_a_place_in_the_world_is_one_only_where_axes_agree(self):
        affine = np.array([[-0.5, 0, 0, 10], [0, 0.5, 0, 20], [0, 0, 2, 30], [0, 0, 0, 1]])
        samples = self.samples[:5, :6, :7]
        data = self.open(tagrid.encode(samples, affine=affine))
        np.testing.assert_array_equal(data.x, 10 - 0.5 * np.arange(7))
        np.testing.assert_array_equal(data.z, 30 + 2 * np.arange(5))
        turned = affine[[1, 0, 2, 3]]
        data = self.open(tagrid.encode(samples, affine=turned))
        np.testing.assert_array_equal(data.x, 0.5 * np.arange(7))
        np.testing.assert_array_equal(np.reshape(data.volume.attrs["affine"], (4, 4)), turned)
        data = self.open(tagrid.encode(samples), drop_variables="y")
        self.assertEqual((data.x.attrs["units"], "y" in data.coords), ("1", False))

    def test_slices_at_unequal_distances_are_where_they_are(self):
        samples, places = self.samples[:4, :6, :7], [0, 1, 2, 7]
        metadata = {"space": "left-posterior-superior", "slice_positions": "; ".join(f"5 6 {z}" for z in places)}
        data = self.open(tagrid.encode(samples, affine=np.diag([0.5, 0.5, 2, 1]), metadata=metadata))
        np.testing.assert_array_equal(data.z, places)
        np.testing.assert_array_equal(data.x, 0.5 * np.arange(7))
        self.assertEqual(data.z.attrs["long_name"], "position in the world")
        turned = np.array([[0, 0, 2, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])
        metadata["slice_positions"] = "; ".join(f"{10 + z} 6 8" for z in places)
        data = self.open(tagrid.encode(samples, affine=turned, metadata=metadata))
        np.testing.assert_array_equal(data.z, places)
        self.assertEqual(data.z.attrs["long_name"], "distance from the first sample")

    def test_files_are_known_by_their_name(self):
        from tagrid.xarray import TagridBackend
        backend = TagridBackend()
        self.assertEqual([backend.guess_can_open(name) for name in ("a.tag", self.path, "a.nc", b"x", 3)],
                         [True, True, False, False, False])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
