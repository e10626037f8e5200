"""NeXus: signals and axes of files that h5py writes."""

import unittest

from other_readers import ReaderTest, h5py, main, numpy

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

    def test_indices_that_contradict_axes_are_said(self):
        for indices, is_said in ((0, False), ([0], False), (2, True), ([0, 1], True)):
            self.write(z=numpy.arange(7) * 3, y=numpy.arange(20) * 2, x=numpy.arange(31))
            with h5py.File(self.folder / "a.nxs", "a") as file:
                file["entry/data"].attrs.update({"z_indices": indices, "y_indices": 1})
            self.assertEqual(self.geometry()["spacing"], [1, 2, None if is_said else 3])
            self.assertEqual("z_indices is" in self.messages and "the positions of samples along z are unknown" in self.messages, is_said, indices)

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
            self.assertIn("the axis z is not a list of 7 positions", self.messages)

    def test_a_name_is_enough_and_none_is_written(self):
        truth = volume()
        with h5py.File(self.folder / "b.nxs", "w", userblock_size=512) as file:
            file["data"] = truth
        self.encodes(truth, "b.nxs")
        self.assert_refused(64, "must end in", "decode", "out.tag", "-o", "c.nxs")

    def test_a_signal_or_default_that_names_nothing_is_an_error(self):
        def nowhere(data):
            data["counts"] = h5py.SoftLink("/raw/gone")

        def elsewhere(data):
            data["counts"] = h5py.ExternalLink("gone.h5", "/scan/frames")

        def group(data):
            data.create_group("counts")

        for change, text in ((nowhere, "/entry/data/counts is a link to /raw/gone, which does not exist"),
                             (elsewhere, "/entry/data/counts is a link to /scan/frames in the file gone.h5, which does not exist"),
                             (group, "/entry/data/counts is no data set"), (None, "there is no /entry/data/counts")):
            for default in (True, False):
                self.write(default=default)
                with h5py.File(self.folder / "a.nxs", "r+") as file:
                    del file["entry/data/counts"]
                    file["other/mask"] = volume()
                    if change:
                        change(file["entry/data"])
                message = self.assert_refused(65, text, "encode", "a.nxs")
                self.assertFalse((self.folder / "a.tag").exists())
                self.assertIn("--dataset", message)
                self.encodes(volume(), "a.nxs", "--dataset", "/other/mask")
        for attribute, value, text in (("default", "nothing", "there is no /nothing"), ("signal", "", "it is empty"), ("signal", "other", "/other is no data set")):
            self.write()
            with h5py.File(self.folder / "a.nxs", "r+") as file:
                file["other/mask"] = volume()
                file.attrs[attribute] = value
            self.assertIn(f"the attribute {attribute} of /", self.assert_refused(65, text, "encode", "a.nxs"))

    def test_the_only_signal_that_is_there_is_read_and_the_other_one_is_said(self):
        truth = self.write(default=False)
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            file["a/counts"] = h5py.ExternalLink("gone.h5", "/data")
            file["a"].attrs["signal"], file["a"].attrs["NX_class"] = "counts", "NXdata"
            file["mask"] = volume()
        self.geometry(truth)
        self.assertIn("/entry/data/counts is read", self.messages)
        self.assertIn("/a/counts is a link to /data in the file gone.h5, which does not exist", self.messages)

    def test_a_text_called_signal_is_no_nexus(self):
        truth = volume()
        with h5py.File(self.folder / "a.nxs", "w") as file:
            file["scan/frames"] = truth
            file["scan"].attrs["signal"] = "T1 weighted"
        self.geometry(truth)

    def test_texts_of_fixed_length_may_have_blanks_behind(self):
        truth = self.write(z=numpy.arange(7.) * 3)
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            text = h5py.h5t.C_S1.copy()
            text.set_size(12)
            text.set_strpad(h5py.h5t.STR_SPACEPAD)
            data = file["entry/data"]
            del data.attrs["signal"]
            h5py.h5a.create(data.id, b"signal", text, h5py.h5s.create(h5py.h5s.SCALAR)).write(numpy.array(b"counts      "), mtype=text)
        self.assertEqual(self.geometry(truth)["spacing"], [None, None, 3])

    def test_a_default_may_be_the_data_set_itself(self):
        truth = self.write()
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            file["other"] = volume("f4")
            file.attrs["default"] = "entry/data/counts"
        self.geometry(truth)

    def test_a_signal_that_is_a_link_has_its_axes(self):
        even = dict(z=numpy.arange(7.) * 3, y=numpy.arange(20.) * 2, x=numpy.arange(31.))
        for kind in ("hard", "soft", "external"):
            truth = self.write(default=False, **even)
            with h5py.File(self.folder / "a.nxs", "r+") as file:
                file["detector/frames"] = file["entry/data/counts"]
                file["detector/dark"] = volume("f4")
                if kind == "soft":
                    del file["entry/data/counts"]
                    file["entry/data/counts"] = h5py.SoftLink("/detector/frames")
                if kind == "external":
                    del file["entry/data/counts"], file["detector/frames"]
                    file["entry/data/counts"] = h5py.ExternalLink("there.h5", "/frames")
                    with h5py.File(self.folder / "there.h5", "w") as other:
                        other["frames"] = truth
            self.assertEqual(self.geometry(truth)["spacing"], [1, 2, 3], kind)
            self.assertEqual(self.pairs["hdf5_dataset"], "/entry/data/counts")

    def test_units_of_length_become_one(self):
        """The table has what a unit is in meters."""
        meters = {"m": 1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "\u00b5m": 1e-6, "\u03bcm": 1e-6, "micron": 1e-6, "microns": 1e-6, "Micrometer": 1e-6, "micrometre": 1e-6,
                  "nm": 1e-9, "nanometers": 1e-9, "pm": 1e-12, "angstrom": 1e-10, "\u00c5": 1e-10, "\u212b": 1e-10, "A": 1e-10, "inch": 0.0254, "in": 0.0254, "millimeters": 1e-3,
                  "ft": 0.3048, "dm": 0.1, "km": 1000}
        for unit, meter in meters.items():
            z = numpy.arange(7.) * 2.5 / meter * 1e-3 + 1
            self.write(z=z, y=numpy.arange(20.) * 0.5, x=numpy.arange(31.) * 0.4, units={"z": unit, "y": "mm", "x": "mm"})
            self.assertEqual(self.tagrid("encode", "a.nxs", "-o", "out.tag", "-f").stderr, "", unit)
            geometry = self.info("out.tag")["geometry"]
            numpy.testing.assert_allclose(geometry["spacing"], [0.4, 0.5, 2.5], rtol=1e-9, err_msg=unit)
            numpy.testing.assert_allclose(geometry["origin"], [0, 0, z[0] * meter / 1e-3], rtol=1e-12, err_msg=unit)
            self.assertEqual(geometry["units"], ["mm"] * 3)
        self.write(z=numpy.arange(7) * 2500, y=numpy.arange(20) * 0.5, x=numpy.arange(31) * 0.4, units={"z": "um", "y": "mm", "x": "mm"})
        self.assertEqual(self.geometry()["spacing"], [0.4, 0.5, 2.5])
        z = numpy.array([0, 1, 2, 4, 7, 8, 9])
        self.write(z=z * 1000, y=numpy.arange(20.), x=numpy.arange(31.), units={"z": "um", "y": "mm", "x": "mm"})
        self.assertEqual([place[2] for place in self.geometry()["slice_positions"]], z.tolist())

    def test_units_that_differ_and_are_not_understood_are_said(self):
        for unit in ("deg", "", "pixel", "Mm"):
            self.write(z=numpy.arange(7.) * 3, y=numpy.arange(20.), x=numpy.arange(31.), units={"z": unit, "y": "mm", "x": "mm"})
            self.assertEqual(self.geometry()["spacing"], [1, 1, 3])
            self.assertIn(f"cannot be converted into each other (x mm, y mm, z {unit or 'none'})", self.messages)
        self.write(z=numpy.arange(7.) * 3, y=numpy.arange(20.), x=numpy.arange(31.), units="pixel")
        self.geometry()
        self.assertEqual(self.messages, "")

    def test_axes_that_are_not_read_are_said_with_the_reason(self):
        even = dict(y=numpy.arange(20.), x=numpy.arange(31.))
        for z, reason in ((numpy.arange(5.), "it has 5"), (numpy.zeros((7, 2)), "it has 2 axes"), (numpy.array([0, 1, numpy.inf, 3, 4, 5, 6]), "number 3 is inf"),
                          (numpy.array([0, 1, 2, numpy.nan, 4, 5, 6]), "number 4 is nan"), (numpy.zeros(0), "it has 0"),
                          (numpy.array([b"a"] * 7), "it has texts"), (3.0, "it is not a list"), (numpy.array([True] * 7), "it has booleans")):
            self.write(z=z, **even)
            self.assertEqual(self.geometry()["spacing"], [1, 1, None], reason)
            self.assertIn(f"the axis z is not a list of 7 positions ({reason})", self.messages)
        for link, reason in ((None, "there is no /entry/data/z"),
                             (h5py.SoftLink("/gone"), "/entry/data/z is a link to /gone, which does not exist"),
                             (h5py.ExternalLink("gone.h5", "z"),
                              "/entry/data/z is a link to z in the file gone.h5, which does not exist")):
            self.write(**even)
            if link:
                with h5py.File(self.folder / "a.nxs", "r+") as file:
                    file["entry/data/z"] = link
            self.assertEqual(self.geometry()["spacing"], [1, 1, None], reason)
            self.assertIn(reason, self.messages)
        self.write(z=numpy.arange(7), **even)
        with h5py.File(self.folder / "a.nxs", "r+") as file:
            file["entry/data/z"].attrs["scale_factor"] = 0.5
        self.assertIsNone(self.geometry()["spacing"][2])
        self.assertIn('its attribute scale_factor is "0.5"', self.messages)
        for names, text in ((["z", "x"], '"z, x"'), (5, '"5"'), ("z", '"z"')):
            self.write(names=names, z=numpy.arange(7.), **even)
            self.assertIsNone(self.geometry()["spacing"])
            self.assertIn(f"the attribute axes of /entry/data is {text}, which does not name 3 axes", self.messages)

    def test_factors_and_offsets_of_nexus_are_a_scale(self):
        for fields, scale in (({"scaling_factor": 0.5}, (0.5, 0)), ({"offset": [3.]}, (1, 3)), ({"counts_scaling_factor": 2, "counts_offset": 0}, (2, 0)),
                              ({"scaling_factor": 0.5, "offset": 3.}, None), ({"scaling_factor": "x"}, None), ({"scaling_factor": [1., 2]}, None), ({"offset": numpy.nan}, None)):
            self.write(**fields)
            self.geometry(volume())
            bounded = self.tagrid("encode", "a.nxs", "-o", "lossy.tag", "-f", "--max-error", "1")
            self.assertEqual(bounded.returncode == 0, scale is not None, fields)
            if scale:
                self.assertEqual((float(self.pairs["rescale_slope"]), float(self.pairs["rescale_intercept"])), scale)
            else:
                self.assertIn("/entry/data/" + next(iter(fields)), self.messages)
                self.assertIn("/entry/data/" + next(iter(fields)), bounded.stderr)

    def test_errors_and_masks_of_the_signal_are_said_and_no_lossy_copy_replaces_them(self):
        for name in ("counts_errors", "errors", "mask"):
            self.write(**{name: volume("f4")})
            self.geometry(volume())
            self.assertIn(f"/entry/data/{name} has ", self.messages)
            self.assert_refused(64, f"/entry/data/{name} has ", "encode", "a.nxs", "-o", "lossy.tag", "--max-error", "1", "--rm")
            self.assertTrue((self.folder / "a.nxs").exists())

    def test_what_comes_back_after_decode(self):
        z = numpy.array([0, 1, 2, 4, 7, 8, 9])
        self.write(z=z, y=numpy.arange(20.), x=numpy.arange(31.), units="mm")
        before = self.geometry()
        self.ok("decode", "out.tag", "-o", "b.h5")
        info = self.encodes(volume(), "b.h5")
        self.assertEqual(info["geometry"], before)
        self.assertEqual(info["source"]["pairs"]["hdf5_dataset"], "/entry/data/counts")


if __name__ == "__main__":
    main()
