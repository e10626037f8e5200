"""HDF5 and VTKHDF that decode writes: h5py reads them, and tagrid reads them again.

    hdf5_written_test.py PROGRAM
"""

import json
import subprocess
import time
import unittest

from hdf5_files import FORMATS, MIRRORED, OBLIQUE, PLACES, SHEARED, Hdf5Test, placed
from other_readers import PROGRAM, h5py, main, numpy

TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Written(Hdf5Test):
    def test_every_type_and_odd_sizes(self):
        shapes = ((5, 19, 23), (3, 1, 7), (1, 5, 3), (2, 3, 1), (1, 1, 1))
        for type, name, shape in [(t, n, shapes[0]) for t in TYPES for n in FORMATS] + [("int16", n, s) for n in FORMATS for s in shapes]:
            what = f"{type} {name} {shape}"
            truth = self.encode(type, shape, placed(OBLIQUE))
            self.decode(name)
            data = self.dataset(name)
            self.assertEqual(data.dtype, numpy.dtype(type).newbyteorder("<"), what)
            self.assert_same(data[...].reshape(shape), truth, what)
            # In one piece, where tagrid reads it in place.
            self.assertIsNone(data.chunks, what)
            content, offset = (self.folder / name).read_bytes(), data.id.get_offset()
            self.assertEqual(content[offset:offset + truth.nbytes], truth.tobytes(), what)
            self.assert_comes_back(name, what)

    def test_what_somebody_changed_counts_and_the_rest_stays(self):
        self.encode(fields=placed([(0.5, 0, 0), (0, 0.5, 0), (0, 0, 2.5)]) + "rescale_slope:=2\nlossy source:=JPEG\n")
        for name, where, attribute, said in (("b.h5", "volume", "spacing", "the spacing along z is 3, but its direction is 2.5 long"),
                                             ("b.vtkhdf", "VTKHDF", "Spacing", "Origin, Spacing and Direction are not those that tagrid wrote")):
            self.decode(name, "--samples")
            with h5py.File(self.folder / name, "a") as file:
                file[where].attrs[attribute] = [0.5, 0.5, 3]
            info = self.encoded(name, says=said)[1]
            pairs = info["source"]["pairs"]
            self.assertEqual((pairs["rescale_slope"], pairs["lossy source"]), ("2", "JPEG"))
            self.assertEqual(info["geometry"]["spacing"], [0.5, 0.5, 2.5 if where == "volume" else 3])

    def test_samples_are_read_in_place(self):
        self.encode()
        for name in FORMATS:
            self.decode(name)
            reader = subprocess.Popen([PROGRAM.parent / "tagrid-read-hdf5"], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, text=True)
            request = {"request": "describe", "path": str(self.folder / name), "options": {}}
            answer = json.loads(reader.communicate(json.dumps(request) + "\n")[0].splitlines()[1])
            self.assertEqual([place["offset"] for place in answer["places"]], [self.dataset(name).id.get_offset()])

    def test_attributes_describe_the_volume(self):
        self.encode(fields=placed(OBLIQUE) + "rescale_slope:=2.5\nrescale_intercept:=-7\nrescale_units:=HU\nModality:=CT\n")
        for name in FORMATS:
            self.decode(name)
            attributes = dict(self.dataset(name).attrs)
            numpy.testing.assert_allclose(attributes["spacing"], [0.5, 0.5, 2.5])
            self.assertEqual(attributes["origin"].tolist(), [10, -20, 30.5])
            self.assertEqual(attributes["directions"].tolist(), [list(d) for d in OBLIQUE])
            self.assertEqual(attributes["space"], "left-posterior-superior")
            self.assertEqual(attributes["spacing_units"], "mm")
            self.assertEqual((attributes["rescale_slope"], attributes["rescale_intercept"]), (2.5, -7))
            self.assertEqual((attributes["rescale_units"], attributes["Modality"]), ("HU", "CT"))
        self.encode(fields='spacings: 0.5 0.25 nan\nunits: "um" "um" "s"\n')
        self.decode("b.h5")
        attributes = dict(self.dataset("b.h5").attrs)
        numpy.testing.assert_equal(attributes["spacing"], [0.5, 0.25, numpy.nan])
        self.assertEqual(attributes["spacing_units"], "um, um, s")
        self.assertNotIn("origin", attributes)
        self.encode()
        self.decode("b.h5")
        self.assertEqual(list(self.dataset("b.h5").attrs), ["nrrd_header"])

    def test_every_header_comes_back(self):
        long = "x" * 200000
        for fields in ("", placed(OBLIQUE), placed(SHEARED), placed(MIRRORED), placed(OBLIQUE, space=""), placed(SHEARED, space="RAS"),
                       "spacings: 0.5 0.25 3\n", 'spacings: 0.1 nan 3\nunits: "um" "" "s"\naxis mins: 1 2 3\n',
                       "# a remark, ä\ncontent: a scan\nkinds: domain domain domain\nspacings: 1 2 3\n",
                       "empty:=\nspacing:=not the spacing\nnrrd_header:=x\n two words:=\\n\\\\ \u00e4\u4e2d\nsame:=1\nsame:=2\n",
                       "hdf5_kV:=120\nhdf5_dataset:=/entry/data\nhdf5_:=x\nAttribute:=9\n", f"long:={long}\nslice_positions:=" + "1 2 3; " * 3000 + "\n",
                       "".join(f"key{i}:={i}\n" for i in range(1500)), "rescale_slope:=2.5\nrescale_intercept:=x\n"):
            self.encode(fields=fields)
            for name in FORMATS:
                self.decode(name)
                self.assert_comes_back(name, fields[:200], 'rescale_intercept is "x"' if "intercept:=x" in fields else "")

    def test_texts_in_latin_1_become_utf_8(self):
        self.encode(fields="name:=M\u00fcller\n".encode("latin-1"))
        for name in FORMATS:
            self.assertIn("Latin-1", self.decode(name))
            self.assertEqual(self.dataset(name).attrs["name"], "M\u00fcller")
            self.encodes(self.encode(fields="name:=M\u00fcller\n".encode("latin-1")), name, "--range", "auto")

    def test_a_changed_attribute_counts_more_than_the_header(self):
        self.encode(fields=placed(OBLIQUE) + "Modality:=CT\n")
        for name in FORMATS:
            self.decode(name)
            with h5py.File(self.folder / name, "r+") as file:
                file[PLACES[FORMATS[name]]].attrs["added"] = "later"
            info = self.encoded(name, "--range", "auto")[1]
            self.assertEqual((info["source"]["pairs"]["Modality"], info["source"]["pairs"]["hdf5_added"]), ("CT", "later"))
            self.assertEqual(info["geometry"]["directions"], [list(d) for d in OBLIQUE])
            with h5py.File(self.folder / name, "r+") as file:
                file[PLACES[FORMATS[name]]].attrs["directions"] = numpy.diag([1., 2, 3])
            info = self.encoded(name, "--range", "auto")[1]
            self.assertEqual(info["geometry"]["directions"], [[1, 0, 0], [0, 2, 0], [0, 0, 3]])
            self.assertEqual(info["source"]["pairs"]["hdf5_Modality"], "CT")

    def test_a_header_of_another_program_is_no_harm(self):
        for header in ("nonsense", "sizes: 1 2 3\n", "", "spacings: 0 0 0\n", "\x00", "data file: /etc/passwd\n", "spacings: 1 1 1"):
            with h5py.File(self.folder / "c.h5", "w") as file:
                data = file.create_dataset("x", data=numpy.arange(60, dtype="i2").reshape(3, 4, 5))
                data.attrs["nrrd_header"] = numpy.bytes_(header)
                data.attrs["spacing"] = [1., 1, 1]
            info = self.encodes(numpy.arange(60, dtype="i2").reshape(3, 4, 5), "c.h5", what=header)
            self.assertEqual(info["geometry"]["spacing"], [1, 1, 1], header)

    def test_a_header_cannot_say_how_samples_are_stored(self):
        for header in ("data file: /etc/passwd\n", "type: int16\n", "sizes: 1 2 3\n", "encoding: gzip\n", "line skip: 3\n"):
            with h5py.File(self.folder / "c.h5", "w") as file:
                file.create_dataset("x", data=numpy.zeros((3, 4, 5), "i2")).attrs["nrrd_header"] = header
            source = self.encoded("c.h5")[1]["source"]
            self.assertEqual((source["fields"], source["pairs"]), ({}, {"hdf5_dataset": "/x"}), header)

    def test_bounds_are_for_values(self):
        truth = self.encode(fields="rescale_slope:=0.5\nrescale_intercept:=3\n")
        self.decode("b.h5")
        self.ok("encode", "b.h5", "-o", "c.tag", "--max-error", "50", "--range", "auto")
        self.decode("c.raw", tag="c.tag")
        samples = numpy.fromfile(self.folder / "c.raw", "<i2").reshape(truth.shape).astype(int)
        error = numpy.abs(samples - truth).max()
        self.assertTrue(50 < error <= 100, error)

    def test_regions_and_steps(self):
        truth = self.encode(shape=(9, 19, 23), fields=placed(OBLIQUE))
        region = ("--region", "2:12,4:10,1:7", "--step", "2")
        self.decode("region.nrrd", *region)
        run = self.tagrid("encode", "region.nrrd", "-o", "region.tag", "--range", "auto")
        for name in FORMATS:
            self.decode(name, *region)
            info = self.encodes(truth[2:7:2, 4:10:2, 2:12:2], name, "--range", "auto", what=name)
            expected = self.info("region.tag")
            self.assertEqual(info["geometry"], expected["geometry"])

    def test_equal_volumes_give_equal_bytes(self):
        self.encode(fields=placed(OBLIQUE) + "Modality:=CT\n")
        for name, format in FORMATS.items():
            self.decode(name)
            content = (self.folder / name).read_bytes()
            time.sleep(1.1)
            for threads in ("1", "4"):
                self.decode("other-name-" + name, "-T", threads)
                self.assertEqual((self.folder / ("other-name-" + name)).read_bytes(), content, name)
            run = subprocess.run(f"{PROGRAM} decode - -o - --format {format} -q < a.tag | cmp - {name}", shell=True,
                                 cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual(run.returncode, 0, run.stdout)

    def test_old_libraries_can_read_it(self):
        """The format of files is that of HDF5 1.0 to 1.6, as the version of the superblock says."""
        self.encode()
        for name in FORMATS:
            self.decode(name)
            self.assertEqual((self.folder / name).read_bytes()[:9], b"\x89HDF\r\n\x1a\n\0")

    def test_what_is_lost_is_said(self):
        self.encode(fields="rescale_slope:=2\nrescale_intercept:=0\nslice_positions:=0 0 0; 0 0 1\n")
        self.assertEqual(self.decode("b.h5"), "")
        said = self.decode("b.vtkhdf")
        self.assertEqual(said.count("slope"), 1, said)
        self.assertIn("values are 2 * sample + 0, but VTK's image data has no place for slope and intercept; --values writes values", said)
        self.assertIn("slice_positions", said)
        self.encode(shape=(1, 5, 6))
        self.assertEqual(self.decode("b.h5"), "")
        self.assertIn("one sample along an axis", self.decode("b.vtkhdf"))
        self.encode(fields=placed(OBLIQUE))
        self.assertEqual(self.decode("b.h5"), "")
        self.assertIn("VTK 9.1 ignores the directions", self.decode("b.vtkhdf"))
        self.encode(fields=placed(((0.5, 0, 0), (0, 0.25, 0), (0, 0, 3))))
        self.assertEqual(self.decode("b.vtkhdf"), "")

    def test_formats_and_reports_name_the_program(self):
        self.encode()
        rows = {row["name"]: row for row in json.loads(self.tagrid("formats", "--json").stdout)["formats"]}
        for name in ("hdf5", "vtkhdf"):
            self.assertTrue(rows[name]["reads"] and rows[name]["writes"])
            self.assertTrue(rows[name]["writer"].endswith("/tagrid-write-hdf5"))
        self.decode("b.h5", "--json", "run.json")
        report = json.loads((self.folder / "run.json").read_text())
        self.assertEqual(report["settings"]["hdf5"], {"dataset": "/volume"})
        self.assertEqual(report["bytes_out"], (self.folder / "b.h5").stat().st_size)


if __name__ == "__main__":
    main()
