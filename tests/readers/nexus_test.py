"""NeXus: signals and axes of files that h5py writes.

    nexus_test.py PROGRAM
"""

import unittest

import other_readers
from other_readers import ReaderTest

numpy = other_readers.library("numpy", "python3-numpy")
h5py = other_readers.library("h5py", "python3-h5py")

SHAPE = (7, 20, 31)


def volume(type="i2", shape=SHAPE):
    return numpy.arange(numpy.prod(shape), dtype=type).reshape(shape)


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Nexus(ReaderTest):
    def write(self, axes=("z", "y", "x"), shape=SHAPE, units=None, names=None, default=True, **places):
        """Makes a.nxs, whose signal has axes with these places; `names` is what the attribute says."""
        truth = volume(shape=shape)
        with h5py.File(self.folder / "a.nxs", "w") as file:
            entry = file.create_group("entry")
            data = entry.create_group("data")
            if default:
                file.attrs["default"], entry.attrs["default"] = "entry", "data"
            entry.attrs["NX_class"], data.attrs["NX_class"] = "NXentry", "NXdata"
            data.attrs["signal"] = "counts"
            data.attrs["axes"] = list(axes) if names is None else names
            data.create_dataset("counts", data=truth)
            for axis, values in places.items():
                data.create_dataset(axis, data=values)
                if units:
                    data[axis].attrs["units"] = units if isinstance(units, str) else units[axis]
        return truth

    def geometry(self, truth=None):
        samples, info = self.encoded("a.nxs", "--range", "auto")
        if truth is not None:
            self.assert_same(samples, truth)
        self.pairs = info["source"]["pairs"]
        return info["geometry"]

    def test_even_axes_give_spacing_origin_and_units(self):
        for type in ("f8", "f4", ">f8"):
            truth = self.write(z=numpy.arange(7).astype(type) * 3 - 4, y=numpy.arange(20).astype(type) * 0.25 + 1, x=numpy.arange(31).astype(type) * 0.5,
                               units="mm")
            geometry = self.geometry(truth)
            self.assertEqual(geometry["spacing"], [0.5, 0.25, 3], type)
            self.assertEqual(geometry["origin"], [0, 1, -4])
            self.assertEqual(geometry["units"], ["mm"] * 3)
            self.assertIsNone(geometry["slice_positions"])
            self.assertEqual(self.messages, "")

    def test_integers_and_several_units(self):
        self.write(z=numpy.arange(7) * 3, y=numpy.arange(20, dtype="u1"), x=numpy.arange(31, dtype="i2") - 15, units={"z": "deg", "y": "um", "x": "mm"})
        geometry = self.geometry()
        self.assertEqual((geometry["spacing"], geometry["origin"]), ([1, 0.001, 3], [-15, 0, 0]))
        self.assertEqual(geometry["units"], ["mm", "mm", "deg"])
        self.assertIn("units that cannot be converted into each other (x mm, y um, z deg)", self.messages)

    def test_rounding_of_floats_is_no_unevenness(self):
        self.write(z=(1000 + numpy.arange(7) * 0.002).astype("f4"), y=numpy.linspace(0, 1, 20), x=numpy.round(numpy.arange(31) / 3, 3))
        geometry = self.geometry()
        numpy.testing.assert_allclose(geometry["spacing"], [1 / 3, 1 / 19, 0.002], rtol=2e-2)
        self.assertEqual(self.messages, "")

    def test_axes_that_run_down(self):
        self.write(z=-numpy.arange(7.) * 3, y=10 - numpy.arange(20.), x=numpy.arange(31.))
        geometry = self.geometry()
        self.assertEqual(geometry["directions"], [[1, 0, 0], [0, -1, 0], [0, 0, -3]])
        self.assertEqual(geometry["origin"], [0, 10, 0])

    def test_borders_of_samples(self):
        self.write(z=numpy.arange(8.) * 3, y=numpy.arange(21.), x=numpy.arange(31.))
        geometry = self.geometry()
        self.assertEqual((geometry["spacing"], geometry["origin"]), ([1, 1, 3], [0, 0.5, 1.5]))

    def test_uneven_slices_keep_their_places(self):
        z = numpy.array([0, 1, 2, 4, 7, 8, 9])
        for places in (z, -z):
            truth = self.write(z=places, y=numpy.arange(20.) + 2, x=numpy.arange(31.) * 0.5, units="mm")
            geometry = self.geometry(truth)
            self.assertEqual(geometry["slice_positions"], [[0, 2, p] for p in places])
            self.assertEqual(geometry["origin"], [0, 2, 0])
            numpy.testing.assert_allclose(numpy.abs(geometry["spacing"]), [0.5, 1, 1])
            self.assertIn("slices lie at unequal distances, from 1 to 3", self.messages)

    def test_uneven_columns_and_rows_are_a_warning(self):
        uneven = numpy.arange(31.) ** 2
        self.write(z=numpy.arange(7.), y=numpy.arange(20.), x=uneven)
        geometry = self.geometry()
        self.assertEqual((geometry["spacing"], geometry["origin"]), ([None, 1, 1], None))
        self.assertIn("samples along x lie at unequal distances (axis x)", self.messages)
        self.assertEqual([float(number) for number in self.pairs["hdf5_x"].split()], uneven.tolist())
        self.write(z=numpy.arange(7.), y=numpy.arange(20.) ** 3, x=numpy.arange(31.))
        self.assertEqual(self.geometry()["spacing"], [1, None, 1])
        self.assertIn("along y", self.messages)

    def test_slices_without_an_order_are_a_warning(self):
        for z in ([0, 1, 2, 2, 3, 4, 5], [0, 1, 2, 1, 3, 4, 5], [3.] * 7):
            self.write(z=numpy.array(z, "f8"), y=numpy.arange(20.), x=numpy.arange(31.))
            geometry = self.geometry()
            self.assertEqual(geometry["spacing"], [1, 1, None])
            self.assertIsNone(geometry["slice_positions"])
            self.assertIn("along z", self.messages)

    def test_axes_without_places(self):
        self.write(axes=("z", ".", "."), z=numpy.arange(7.) * 2)
        geometry = self.geometry()
        self.assertEqual((geometry["spacing"], geometry["origin"]), ([None, None, 2], None))
        self.assertEqual(self.messages, "")
        self.write(axes=("a", "b", "c"))
        self.assertIsNone(self.geometry()["spacing"])

    def test_axes_that_do_not_fit(self):
        for z in (numpy.arange(5.), numpy.zeros((7, 2)), numpy.array([0, 1, 2, numpy.nan, 4, 5, 6]), numpy.array([b"a"] * 7), 3.0,
                  numpy.zeros(0)):
            self.write(z=z, y=numpy.arange(20.), x=numpy.arange(31.))
            self.assertEqual(self.geometry()["spacing"], [1, 1, None], str(z))
            self.assertIn("the axis z is no list of 7 places", self.messages)
        self.write(names=["z", "x"], z=numpy.arange(7.), x=numpy.arange(31.))
        self.assertIsNone(self.geometry()["spacing"])

    def test_texts_of_every_kind_name_axes(self):
        even = dict(z=numpy.arange(7.) * 3, y=numpy.arange(20.) * 2, x=numpy.arange(31.))
        for names in (["z", "y", "x"], numpy.array([b"z", b"y", b"x"]), "z:y:x", "[z,y,x]", numpy.bytes_("z, y, x")):
            self.write(names=names, **even)
            self.assertEqual(self.geometry()["spacing"], [1, 2, 3], str(names))

    def test_older_files_name_axes_in_the_data_set(self):
        truth = volume()
        with h5py.File(self.folder / "a.nxs", "w") as file:
            data = file.create_group("entry/data")
            for name in ("counts", "errors"):
                data.create_dataset(name, data=truth)
            data["counts"].attrs.update({"signal": 1, "axes": "z:y:x"})
            for name, size, step in (("z", 7, 3), ("y", 20, 2), ("x", 31, 1)):
                data.create_dataset(name, data=numpy.arange(size) * step)
        geometry = self.geometry(truth)
        self.assertEqual(geometry["spacing"], [1, 2, 3])
        self.assertEqual(self.pairs["hdf5_dataset"], "/entry/data/counts")

    def test_the_only_signal_among_several_volumes(self):
        truth = self.write(default=False, x=numpy.arange(31.) * 2, axes=(".", ".", "x"))
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            file["other"] = volume("f4", (3, 4, 5))
        self.assertEqual(self.geometry(truth)["spacing"], [2, None, None])
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            file["second/counts"] = volume("f4", (3, 4, 5))
            file["second"].attrs["signal"] = "counts"
        self.assert_refused(64, "holds 3 volumes", "encode", "a.nxs")

    def test_axes_in_front_and_slices_alone(self):
        truth = self.write(axes=("time", "z", "y", "x"), shape=(1,) + SHAPE, time=[17.], z=numpy.arange(7.) * 3, y=numpy.arange(20.), x=numpy.arange(31.))
        self.assertEqual(self.geometry(truth[0])["spacing"], [1, 1, 3])
        truth = self.write(shape=(1, 20, 31), z=[4.5], y=numpy.arange(20.) * 2, x=numpy.arange(31.))
        geometry = self.geometry(truth)
        self.assertEqual((geometry["spacing"][:2], geometry["origin"]), ([1, 2], [0, 0, 4.5]))

    def test_attributes_of_the_data_set_count_more(self):
        self.write(z=numpy.arange(7.) * 3, y=numpy.arange(20.), x=numpy.arange(31.))
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            file["entry/data/counts"].attrs["spacing"] = [5., 6, 7]
        self.assertEqual(self.geometry()["spacing"], [5, 6, 7])

    def test_axes_elsewhere_are_not_read(self):
        (self.folder / "other").mkdir()
        with h5py.File(self.folder / "other" / "far.h5", "w") as file:
            file["z"] = numpy.arange(7.)
        for kind in ("link", "external", "virtual"):
            self.write(y=numpy.arange(20.), x=numpy.arange(31.))
            with h5py.File(self.folder / "a.nxs", "r+") as file:
                data = file["entry/data"]
                if kind == "link":
                    data["z"] = h5py.ExternalLink("other/far.h5", "/z")
                elif kind == "external":
                    data.create_dataset("z", (7,), "u1", external=[("/etc/passwd", 0, 7)])
                else:
                    layout = h5py.VirtualLayout((7,), "f8")
                    layout[:] = h5py.VirtualSource("other/far.h5", "z", (7,))
                    data.create_virtual_dataset("z", layout)
            self.assertEqual(self.geometry()["spacing"], [1, 1, None], kind)
            self.assertIn("the axis z is no list of 7 places", self.messages)

    def test_a_name_is_enough_and_none_is_written(self):
        truth = volume()
        with h5py.File(self.folder / "b.nxs", "w", userblock_size=512) as file:
            file["data"] = truth
        self.assert_same(self.encoded("b.nxs")[0], truth)
        self.assert_refused(64, "must end in", "decode", "out.tag", "-o", "c.nxs")

    def test_what_comes_back_after_decode(self):
        z = numpy.array([0, 1, 2, 4, 7, 8, 9])
        self.write(z=z, y=numpy.arange(20.), x=numpy.arange(31.), units="mm")
        before = self.geometry()
        self.assertEqual(self.tagrid("decode", "out.tag", "-o", "b.h5").returncode, 0)
        samples, info = self.encoded("b.h5")
        self.assert_same(samples, volume())
        self.assertEqual(info["geometry"], before)
        self.assertEqual(info["source"]["pairs"]["hdf5_dataset"], "/entry/data/counts")


if __name__ == "__main__":
    other_readers.main()
