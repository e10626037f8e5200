"""HDF5: data sets that h5py writes."""

import itertools
import unittest

from other_readers import ReaderTest, h5py, main, numpy, random_samples, some

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]


def volume(type="i2", shape=(7, 20, 31)):
    return random_samples(type, shape)


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Hdf5(ReaderTest):
    def write(self, name, **datasets):
        with h5py.File(self.folder / name, "w") as file:
            for path, samples in datasets.items():
                file.create_dataset(path.replace("__", "/"), data=samples)
        return name

    def test_every_type_and_byte_order(self):
        for type, order in itertools.product(TYPES, "<>"):
            truth = volume(type)
            name = self.write("a.h5", data=truth.astype(order + type))
            self.encodes(truth, name, what=order + type)

    def test_chunks_and_filters(self):
        truth = volume()
        for options in ({"chunks": (3, 8, 8)}, {"chunks": (1, 20, 31)}, {"chunks": (7, 1, 31)}, {"chunks": (16, 32, 32), "maxshape": (None,) * 3},
                        {"compression": "gzip"}, {"compression": "gzip", "shuffle": True, "fletcher32": True, "chunks": (4, 20, 31)},
                        {"scaleoffset": 0}):
            # HDF5 1.14.5 cannot read what its scale-offset filter writes if values span their type.
            written = truth // 2 if "scaleoffset" in options else truth
            with h5py.File(self.folder / "a.h5", "w") as file:
                file.create_dataset("data", data=written, **options)
            self.encodes(written, "a.h5", what=str(options))

    def test_samples_that_lie_plainly_are_read_in_place(self):
        truth = volume()
        with h5py.File(self.folder / "a.h5", "w", userblock_size=512) as file:
            file.create_dataset("other", data=volume("f4"))
            file.create_dataset("data", data=truth)
            offset = file["data"].id.get_offset()
        content = (self.folder / "a.h5").read_bytes()
        self.assertEqual(content[offset:offset + truth.nbytes], truth.tobytes())
        self.encodes(truth, "a.h5", "--dataset", "data")

    def test_a_file_with_a_data_set_that_was_not_encoded_stays_and_that_is_named(self):
        self.write("a.h5", entry__a=volume(), entry__b=volume(shape=(40, 70, 71)), entry__c=volume(shape=(40, 70, 71)))
        self.assert_refused(64, "more than the", "encode", "a.h5", "--dataset", "entry/a", "-o", "a.tag", "--rm")
        self.assert_refused(64, "(the file also has /entry/b, /entry/c); leave out --rm", "encode", "a.h5", "--dataset", "/entry/a",
                            "-o", "a.tag", "--rm")
        (self.folder / "list.tsv").write_text("a.h5\tdataset=/entry/a\n")
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "tags")
        self.assert_refused(65, "(the file also has /entry/b, /entry/c); it is kept", "convert", "--manifest", "list.tsv",
                            "--output-dir", "tags", "--remove-verified")
        self.assertTrue((self.folder / "a.h5").exists())

    def test_matlab_files_of_version_7_3_are_hdf5_and_older_ones_are_refused_by_name(self):
        """The first index of an array A(i, j, k) in MATLAB counts fastest in a file: x, y, z = i - 1, j - 1, k - 1."""
        array = volume(shape=(20, 31, 7))
        with h5py.File(self.folder / "a.mat", "w", userblock_size=512) as file:
            file.create_dataset("A", data=array.transpose(), compression="gzip").attrs["MATLAB_class"] = numpy.bytes_("int16")
        with open(self.folder / "a.mat", "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\0\2IM")
        samples = self.encoded("a.mat")[0]
        self.assertEqual((samples[6, 30, 19], samples[1, 2, 3]), (array[19, 30, 6], array[3, 2, 1]))
        self.assert_same(samples, array.transpose())
        (self.folder / "b.mat").write_bytes(b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\1IM" + bytes(1000))
        self.assert_refused(65, "b.mat: is a MATLAB file of version 5 to 7; save it in MATLAB as version 7.3", "encode", "b.mat")

    def test_one_of_several_data_sets(self):
        one, two = volume(), volume("f4", (3, 9, 8))
        name = self.write("a.h5", x__one=one, two=two, table=numpy.zeros(9), flat=numpy.zeros((9, 9)))
        message = self.assert_refused(64, "holds 2 volumes", "encode", name)
        self.assertIn("/two  8 x 9 x 3 float32", message)
        self.assertIn("/x/one  31 x 20 x 7 int16", message)
        for dataset, truth in (("/x/one", one), ("x/one", one), ("2", one), ("two", two), ("1", two)):
            self.encodes(truth, name, "--dataset", dataset, what=dataset)
        self.encodes(numpy.zeros((1, 9, 9)), name, "--dataset", "flat")
        self.assert_refused(64, "has no dataset nothing", "encode", name, "--dataset", "nothing")
        self.assert_refused(65, "no volume", "encode", name, "--dataset", "table")

    def test_the_default_of_nexus(self):
        truth = volume()
        with h5py.File(self.folder / "a.nxs", "w") as file:
            file.attrs["default"] = "entry"
            entry = file.create_group("entry")
            entry.attrs["default"] = "data"
            data = entry.create_group("data")
            data.attrs["signal"] = numpy.bytes_("counts")
            data.create_dataset("counts", data=truth)
            data.create_dataset("errors", data=volume("f4"))
        info = self.encodes(truth, "a.nxs")
        self.assertEqual(info["source"]["pairs"]["hdf5_dataset"], "/entry/data/counts")

    def test_geometry_and_attributes(self):
        truth = volume()
        with h5py.File(self.folder / "a.h5", "w") as file:
            data = file.create_dataset("data", data=truth)
            data.attrs["element_size_um"] = [2, 0.5, 0.25]
            data.attrs["operator"] = "J. Doe"
            data.attrs["kV"] = 120
        info = self.encoded("a.h5")[1]
        self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, 2])
        self.assertEqual(info["geometry"]["units"], ["um"] * 3)
        self.assertEqual((info["source"]["pairs"]["hdf5_operator"], info["source"]["pairs"]["hdf5_kV"]), ("J. Doe", "120"))

    def test_axes_of_one_sample_in_front(self):
        truth = volume()
        self.encodes(truth, self.write("a.h5", data=truth[None, None]))
        with h5py.File(self.folder / "b.h5", "w") as file:
            file.create_dataset("data", data=truth[None], chunks=(1, 2, 20, 31))
        self.encodes(truth, "b.h5")

    def test_samples_that_were_never_written(self):
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("data", (5, 6, 7), "i2", fillvalue=-5)
        self.encodes(numpy.full((5, 6, 7), -5, "i2"), "a.h5")
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("data", (5, 6, 7), "i2", fillvalue=-5, chunks=(2, 2, 2))[3] = 9
        truth = numpy.full((5, 6, 7), -5, "i2")
        truth[3] = 9
        self.encodes(truth, "a.h5")

    def test_links_into_other_files(self):
        truth = volume()
        self.write("there.h5", data=truth)
        with h5py.File(self.folder / "a.h5", "w") as file:
            file["here"] = h5py.ExternalLink("there.h5", "/data")
        self.encodes(truth, "a.h5", "--dataset", "here")

    def test_what_is_no_volume_is_refused_by_name(self):
        for samples, text in ((numpy.zeros((3, 3, 3), "i8"), "/data has integers of 64 bits"), (numpy.zeros((3, 3, 3), "u8"), "/data has unsigned integers of 64 bits"),
                              (numpy.zeros((3, 3, 3), "f2"), "/data has floats of 16 bits"), (numpy.zeros((3, 3, 3), "c8"), "/data has complex numbers"),
                              (numpy.zeros((2, 3, 4, 5), "u1"), "/data has 4 axes (5 x 4 x 3 x 2)")):
            message = self.assert_refused(65, text, "encode", self.write("a.h5", data=samples))
            self.assertIn("has no data set with three axes of integers of 8, 16 or 32 bits, or floats of 32 or 64 bits", message)
        self.assert_refused(65, "data has integers of 64 bits, which are not supported", "encode", self.write("a.h5", data=numpy.zeros((3, 3, 3), "i8")), "--dataset", "data")
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("data", (3, 3, 3), "u1", external=[("/etc/passwd", 0, 27)])
        self.assert_refused(65, "other files", "encode", "a.h5")
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("data", (2, 1 << 38, 5), "u1")
        self.assert_refused(65, "/data has 5 x 274877906944 x 2 samples, which are no volume", "encode", "a.h5")
        self.write("a.h5", data=volume())
        whole = (self.folder / "a.h5").read_bytes()
        (self.folder / "short.h5").write_bytes(whole[:-10])
        self.assert_refused(65, "short.h5: ", "encode", "short.h5")

    def test_what_lies_elsewhere_is_refused(self):
        (self.folder / "other").mkdir()
        self.write("other/there.h5", data=volume())
        layout = h5py.VirtualLayout((7, 20, 31), "i2")
        layout[:] = h5py.VirtualSource("missing.h5", "data", (7, 20, 31))
        with h5py.File(self.folder / "a.h5", "w") as file:
            file["far"] = h5py.ExternalLink("other/there.h5", "/data")
            file.create_virtual_dataset("virtual", layout, fillvalue=-7)
        self.assert_refused(65, "virtual data set", "encode", "a.h5", "--dataset", "virtual")
        self.assert_refused(65, "in another directory", "encode", "a.h5", "--dataset", "far")

    def test_a_missing_filter_is_named(self):
        truth = volume()
        with h5py.File(self.folder / "a.h5", "w") as file:
            plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            plist.set_chunk((7, 20, 31))
            plist.set_filter(32099, h5py.h5z.FLAG_OPTIONAL, ())
            h5py.h5d.create(file.id, b"data", h5py.h5t.NATIVE_INT16, h5py.h5s.create_simple(truth.shape), plist)
        self.assert_refused(65, "the filter 32099", "encode", "a.h5")
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("data", data=truth, compression="lzf")
        self.assert_refused(65, "the filter 32000 (lzf)", "encode", "a.h5")

    def test_damaged_files_are_errors_or_other_samples_and_no_more(self):
        truth = volume()
        random = numpy.random.default_rng(1)
        for options in ({}, {"chunks": (3, 8, 8), "compression": "gzip"}):
            with h5py.File(self.folder / "a.h5", "w") as file:
                file.create_dataset("data", data=truth, **options)
            whole = (self.folder / "a.h5").read_bytes()
            for i in some(range(30), 3):
                broken = bytearray(whole[:random.integers(100, len(whole))] if i % 5 == 0 else whole)
                for _ in range(random.integers(1, 6)):
                    broken[random.integers(8, min(len(broken), 3000))] = random.integers(0, 256)
                (self.folder / "broken.h5").write_bytes(broken)
                run = self.tagrid("encode", "broken.h5", "-o", "broken.tag", "-f", "-q")
                # A library that crashes is a failure of the reader, 74.
                self.assertIn(run.returncode, (0, 64, 65, 74), f"{i}: {run.stderr}")


if __name__ == "__main__":
    main()
