"""HDF5 and VTKHDF that decode writes: h5py reads them, and tagrid reads them again."""

import itertools
import json
import os
import pathlib
import resource
import signal
import subprocess
import time
import unittest

from hdf5_files import FORMATS, MIRRORED, OBLIQUE, PLACES, SHEARED, Hdf5Test, placed
from other_readers import PROGRAM, ReaderTest, h5py, main, numpy, some, unless_sanitized, vtk_hdf

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
        """lost_test.py has what else is lost."""
        self.encode(fields="rescale_slope:=2\nrescale_intercept:=0\n", shape=(1, 5, 6))
        self.assertEqual(self.decode("b.h5"), "")
        said = self.decode("b.vtkhdf")
        self.assertIn("values are 2 * sample + 0, but VTK's image data has no place for slope and intercept; --values writes values", said)
        self.assertIn("one sample along an axis", said)

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


# VTKHDF: VTK reads what decode writes, and tagrid reads image data of others.


@unittest.skipIf(vtk_hdf is None or h5py is None, "there is no VTK on this machine")
class Vtk(Hdf5Test):
    def image(self, name):
        reader = vtk_hdf.vtkHDFReader()
        self.assertTrue(reader.CanReadFile(str(self.folder / name)))
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        return reader.GetOutput()

    def test_vtk_reads_samples_and_places(self):
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonDataModel import vtkImageData as vtk_image

        for type, directions in [(type, OBLIQUE) for type in TYPES] + [("int16", SHEARED), ("int16", MIRRORED)]:
            truth = self.encode(type, fields=placed(directions))
            self.decode("b.vtkhdf")
            image = self.image("b.vtkhdf")
            self.assertEqual((image.GetClassName(), image.GetDimensions()), ("vtkImageData", (23, 19, 5)))
            self.assertEqual(image.GetPointData().GetNumberOfArrays(), 1)
            array = image.GetPointData().GetArray("value")
            samples = vtk_to_numpy(array).reshape(truth.shape)
            self.assertEqual(samples.astype(type).tobytes(), truth.tobytes(), type)
            # VTK 9.1 reads the directions, but goes on with transforms without them.
            again = vtk_image()
            again.SetOrigin(image.GetOrigin())
            again.SetSpacing(image.GetSpacing())
            again.SetDirectionMatrix([image.GetDirectionMatrix().GetElement(row, column) for row in range(3) for column in range(3)])
            for index in ((0, 0, 0), (22, 0, 0), (0, 18, 0), (0, 0, 4), (7, 5, 3)):
                place = [0.0] * 3
                again.TransformContinuousIndexToPhysicalPoint(index, place)
                expected = numpy.array((10, -20, 30.5)) + numpy.array(index) @ numpy.array(directions)
                numpy.testing.assert_allclose(place, expected, atol=1e-9)

    def test_without_directions(self):
        self.encode(fields="spacings: 0.5 0.25 3\naxis mins: 1 2 3\ncenters: node node node\n")
        self.decode("b.vtkhdf")
        image = self.image("b.vtkhdf")
        self.assertEqual((image.GetSpacing(), image.GetOrigin()), ((0.5, 0.25, 3), (1, 2, 3)))


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class VtkhdfOfOthers(ReaderTest):
    def write(self, name="a.vtkhdf", type="ImageData", where="PointData", shape=(4, 5, 6), extent=(2, 7, 0, 4, -3, 0), arrays=("density",), **attributes):
        samples = numpy.arange(numpy.prod(shape), dtype="i2").reshape(shape)
        with h5py.File(self.folder / name, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = [1, 0]
            root.attrs["Type"] = numpy.bytes_(type)
            for key, value in dict(WholeExtent=extent, Origin=[1., 2, 3], Spacing=[0.5, 0.25, 2], Direction=[1., 0, 0, 0, 1, 0, 0, 0, 1]).items():
                root.attrs[key] = value
            for key, value in attributes.items():
                root.attrs[key] = value
            for array in arrays:
                root.create_dataset(f"{where}/{array}", data=samples, chunks=(2,) * len(shape))
        return samples

    def test_image_data_says_where_samples_lie(self):
        truth = self.write()
        info = self.encodes(truth, "a.vtkhdf")
        self.assertEqual(info["geometry"]["spacing"], [0.5, 0.25, 2])
        self.assertEqual(info["geometry"]["origin"], [1 + 2 * 0.5, 2, 3 - 3 * 2])
        self.assertEqual(info["source"]["pairs"]["hdf5_dataset"], "/VTKHDF/PointData/density")
        self.write(Direction=[0., -1, 0, 1, 0, 0, 0, 0, 1])
        info = self.encoded("a.vtkhdf")[1]
        self.assertEqual(info["geometry"]["directions"], [[0, 0.5, 0], [-0.25, 0, 0], [0, 0, 2]])
        self.assertEqual(info["geometry"]["origin"], [1, 2 + 2 * 0.5, -3])

    def test_cells_lie_between_points(self):
        self.write(where="CellData", extent=(0, 6, 0, 5, 0, 4))
        self.assertEqual(self.encoded("a.vtkhdf")[1]["geometry"]["origin"], [1.25, 2.125, 4])

    def test_one_of_several_arrays(self):
        truth = self.write(arrays=("a", "b"))
        self.assertIn("/VTKHDF/PointData/b", self.assert_refused(64, "holds 2 volumes", "encode", "a.vtkhdf"))
        info = self.encodes(truth, "a.vtkhdf", "--dataset", "VTKHDF/PointData/b")
        self.assertEqual(info["geometry"]["spacing"], [0.5, 0.25, 2])

    def test_a_mesh_is_no_volume(self):
        self.write(type="UnstructuredGrid", shape=(7,))
        self.assert_refused(65, 'holds "UnstructuredGrid", which is no volume', "encode", "a.vtkhdf")

    def test_what_makes_no_sense_gives_no_geometry(self):
        for attributes, text in ((dict(Spacing=[1., 0, 1]), ""), (dict(Spacing=[1., numpy.nan, 1]), ""),
                                 (dict(WholeExtent=[0, 1, 0, 1, 0, 1]), ""), (dict(Origin=[1.]), ""),
                                 (dict(Direction=[0.] * 9), ""), (dict(Spacing=numpy.bytes_("x")), ""),
                                 (dict(Direction=[1., 0, 0]), 'is "1 0 0", which is not 9 numbers'), (dict(Direction="up"), 'is "up"'),
                                 (dict(Direction=[numpy.nan] * 9), "is"), (dict(Spacing="a b c"), 'is "a b c"')):
            truth = self.write(**attributes)
            info = self.encodes(truth, "a.vtkhdf")
            self.assertIsNone(info["geometry"]["spacing"], attributes)
            self.assertIn(f"VTKHDF file: {next(iter(attributes))} {text}", self.messages)
        self.write(Spacing="0,5 0,25 2")
        self.assertEqual(self.encoded("a.vtkhdf")[1]["geometry"]["spacing"], [0.5, 0.25, 2])
        self.assertIn("decimal comma", self.messages)


# HDF5 and VTKHDF files that cannot be written, and damaged ones: an error message, and nothing is left.

@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Failures(Hdf5Test):
    def large(self, dims="300,200,90"):
        self.ok("phantom", "--dims", dims, "--type", "int16", "-o", "p.nrrd")
        self.ok("encode", "p.nrrd", "-o", "p.tag")
        (self.folder / "p.nrrd").unlink()

    def names(self):
        return sorted(file.name for file in self.folder.iterdir())

    def test_a_full_disk_leaves_nothing(self):
        """A file may not become larger than so many bytes: within the samples, and within what comes before them."""
        self.large()
        for name, limit in itertools.product(FORMATS, (1000, 3000, 1 << 20, 10 << 20)):
            run = subprocess.run([PROGRAM, "decode", "p.tag", "-o", name], cwd=self.folder, stderr=subprocess.PIPE,
                                 text=True,
                                 restore_signals=False, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
            self.assertEqual(run.returncode, 74, f"{name} {limit}: {run.stderr}")
            self.assertIn(f"{name}: cannot write: File too large", run.stderr)
            self.assertEqual(self.names(), ["p.tag"])
        run = self.tagrid("decode", "p.tag", "-f", "-o", "/dev/full", "--format", "hdf5")
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn("/dev/full: cannot write: No space left", run.stderr)

    def test_a_full_disk_for_temporary_files_is_named_as_such(self):
        self.large()
        (self.folder / "spool").mkdir()
        with open(self.folder / "out", "wb") as out:
            run = subprocess.run([PROGRAM, "decode", "p.tag", "-o", "-", "--format", "hdf5", "--spool", "spool"],
                                 cwd=self.folder, stdout=out,
                                 stderr=subprocess.PIPE, text=True, restore_signals=False, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20)))
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn("standard output (through a temporary file in spool): cannot write: File too large", run.stderr)
        self.assertEqual((self.folder / "out").stat().st_size, 0)

    def test_an_existing_file_stays(self):
        self.encode()
        for name in FORMATS:
            (self.folder / name).write_bytes(b"mine")
            self.assert_refused(64, "already exists", "decode", "a.tag", "-o", name)
            self.assertEqual((self.folder / name).read_bytes(), b"mine")
        self.assert_refused(74, "nowhere/b.h5", "decode", "a.tag", "-o", "nowhere/b.h5")
        (self.folder / "a.tag").write_bytes((self.folder / "a.tag").read_bytes()[:-20])
        before = self.names()
        self.assert_refused(65, "a.tag", "decode", "a.tag", "-o", "b.h5", "-f")
        self.assertEqual(self.names(), before)
        self.assertEqual((self.folder / "b.h5").read_bytes(), b"mine")

    def test_a_missing_program_is_named(self):
        self.encode()
        alone = self.folder / "bin"
        alone.mkdir()
        os.link(PROGRAM, alone / "tagrid") if PROGRAM.stat().st_dev == alone.stat().st_dev else \
            (alone / "tagrid").write_bytes(PROGRAM.read_bytes())
        (alone / "tagrid").chmod(0o755)
        for name in FORMATS:
            run = subprocess.run([alone / "tagrid", "decode", "a.tag", "-o", name], cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn("tagrid-write-hdf5, which is not installed", run.stderr)
            self.assertIn("install the package tagrid-readers", run.stderr)
            self.assertFalse((self.folder / name).exists())
        (self.folder / "series").mkdir()
        (self.folder / "series/1.dcm").write_bytes(bytes(128) + b"DICM")
        for name, what in (("series", "series: has DICOM files"), ("series/1.dcm", "series/1.dcm: is a DICOM file")):
            run = subprocess.run([alone / "tagrid", "encode", name], cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn(f"{what}, which tagrid-read-dicom reads; that program is not installed", run.stderr)
            self.assertIn("install the package tagrid-readers", run.stderr)
        (alone / "CMakeCache.txt").touch()  # a build directory
        run = subprocess.run([alone / "tagrid", "encode", "series"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertIn(f"run cmake in {alone} to build all of it\n", run.stderr)

    def test_signals_leave_nothing_and_nobody(self):
        """The rest of the input does not come, so that the run has surely not ended when the signal comes."""
        self.large()
        whole = (self.folder / "p.tag").read_bytes()
        for kind, name in itertools.product((signal.SIGTERM, signal.SIGINT, signal.SIGKILL), FORMATS):
            run = subprocess.Popen([PROGRAM, "decode", "-", "-o", name, "-T1", "-q"], cwd=self.folder,
                                   stdin=subprocess.PIPE)
            run.stdin.write(whole[:len(whole) * 2 // 3])
            run.stdin.flush()
            writers = []
            while not writers and run.poll() is None:
                writers = self.children(run.pid)
            time.sleep(0.1)
            run.send_signal(kind)
            self.assertEqual(run.wait(), -kind)
            run.stdin.close()
            self.assertFalse((self.folder / name).exists())
            if kind != signal.SIGKILL:
                self.assertEqual(self.names(), ["p.tag"])
            for _ in range(1000):
                if not any(pathlib.Path(f"/proc/{writer}").exists() for writer in writers):
                    break
                time.sleep(0.05)
            self.assertFalse([writer for writer in writers if self.is_running(writer)])
            for file in self.folder.glob(".*"):
                file.unlink()

    @staticmethod
    def is_running(process):
        try:
            return pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
        except OSError:
            return False

    @staticmethod
    def children(parent):
        try:
            texts = [path.read_text() for path in pathlib.Path(f"/proc/{parent}/task").glob("*/children")]
        except OSError:
            return []
        return [int(child) for text in texts for child in text.split()]

    @unless_sanitized
    def test_the_memory_of_the_writer_is_bounded_and_counts(self):
        """A volume of 192 MB in slices of 2 MB, within a limit far below; the writer's own limit is that of the system."""
        run = subprocess.run(f"head -c {96 * 1000 * 1000 * 2} /dev/zero | {PROGRAM} encode -q --dims 1000,1000,96 --type int16 - -o z.tag",
                             shell=True, cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        def smallest_for(name):
            said = self.assert_refused(64, "give -M ", "decode", "z.tag", "-o", name, "-M", "1M")
            return int(said.split("give -M ")[1].split("M")[0])

        for name in FORMATS:
            smallest = smallest_for(name)
            self.assertLess(smallest, smallest_for("b.nii.gz") + 64)
            self.assert_refused(64, "give -M ", "decode", "z.tag", "-o", name, "-M", f"{smallest - 1}M")
            self.decode(name, "-M", f"{smallest}M", tag="z.tag")
            self.assertGreater((self.folder / name).stat().st_size, 192 * 1000 * 1000)


@unittest.skipIf(h5py is None, "there is no h5py on this machine")
class Damage(Hdf5Test):
    def test_damaged_files_are_errors_that_name_them_or_other_samples(self):
        random = numpy.random.default_rng(7)
        self.encode(shape=(3, 5, 7), fields=placed(OBLIQUE) + "Modality:=CT\n")
        for name in FORMATS:
            self.decode(name)
            whole = (self.folder / name).read_bytes()
            for i in some(range(60), 3):
                broken = bytearray(whole[:random.integers(9, len(whole))] if i % 4 == 0 else whole)
                for _ in range(random.integers(0 if i % 4 == 0 else 1, 5)):
                    broken[random.integers(9, len(broken))] ^= 1 << random.integers(0, 8)
                (self.folder / "broken.h5").write_bytes(broken)
                started = time.monotonic()
                run = self.tagrid("encode", "broken.h5", "-o", "broken.tag", "-f", "-q")
                self.assertLess(time.monotonic() - started, 50, f"{name} {i}")
                # A library that crashes is a failure of the reader, 74.
                self.assertIn(run.returncode, (0, 64, 65, 74), f"{name} {i}: {run.stderr}")
                if run.returncode != 0:
                    self.assertIn("broken.h5", run.stderr)
                    self.assertFalse((self.folder / "broken.tag").exists())
                (self.folder / "broken.tag").unlink(missing_ok=True)


if __name__ == "__main__":
    main()
