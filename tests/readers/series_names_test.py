"""Names of volumes in one series or folder: each means the same volume, whatever else comes or goes."""

import itertools
import re
import shutil
import unittest

from other_readers import ReaderTest, main, numpy, pydicom, tifffile
from scans import data_set

UID = "1.2.840.99.7"


@unittest.skipIf(None in (numpy, pydicom, tifffile), "libraries are missing")
class SeriesNames(ReaderTest):
    def slices(self, folder, name, samples, first=0, **attributes):
        """Slices of the one series, with positions from `first` on."""
        (self.folder / folder).mkdir(exist_ok=True)
        for z, slice in enumerate(samples):
            given = {"number": z + 1, "position": (0, 0, first + z)} | attributes
            file = data_set(slice, series=UID, instance=f"{UID}.{name}.{z}", **given)
            file.save_as(self.folder / folder / f"{name}_{z}.dcm", write_like_original=False)

    def moments(self, folder="s", count=4):
        """Volumes at the same places, by their names in files."""
        truth = numpy.random.default_rng(1).integers(0, 4096, (count, 3, 5, 6))
        for i, samples in enumerate(truth):
            self.slices(folder, i + 1, samples, TemporalPositionIdentifier=i + 1)
        return {str(i + 1): samples for i, samples in enumerate(truth)}

    def scout_and_axial(self, folder="s"):
        truth = numpy.random.default_rng(2).integers(0, 4096, (4, 5, 6))
        kind = ["ORIGINAL", "PRIMARY"]
        self.slices(folder, 8, truth[:1], ImageType=[*kind, "LOCALIZER"], ImageOrientationPatient=[1, 0, 0, 0, 0, -1])
        self.slices(folder, 9, truth[1:], ImageType=[*kind, "AXIAL"])
        return {"8": truth[:1], "9": truth[1:]}

    def names(self, path="s"):
        """Those that are listed where one must be chosen."""
        run = self.tagrid("encode", path, "-o", "x.tag")
        self.assertEqual(run.returncode, 64, run.stderr)
        return re.findall(r"^ +\d+  (\S+)  ", run.stderr, re.MULTILINE)

    def decoded(self, tag):
        self.ok("decode", tag, "-o", "x.raw", "-f")
        return (self.folder / "x.raw").read_bytes()

    def which(self, tag, truth):
        """The volume that a .tag file holds, with -1024 added."""
        bytes = self.decoded(tag)
        return [name for name, samples in truth.items() if (samples - 1024).astype("<i2").tobytes() == bytes]

    def found(self, folder="s"):
        """The lines of the list, by the name of their volume."""
        run = self.search(folder)
        lines = [line for line in run.stdout.splitlines() if not line.startswith("#")]
        return {re.search(r"series=(\S+)", line)[1]: line for line in lines}

    def convert(self, *options):
        return self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q", *options)

    def write_list(self, lines):
        (self.folder / "list.tsv").write_text("".join(line + "\n" for line in lines))

    def test_each_name_means_its_volume_while_the_others_are_removed(self):
        for make, order in ((self.moments, (0, 1, 2, 3)), (self.moments, (2, 0, 3, 1)), (self.scout_and_axial, (0, 1)), (self.scout_and_axial, (1, 0))):
            truth = make()
            names = self.names()
            for i in order:
                self.ok("encode", "s", "--series", names[i], "--rm", "-o", f"{i}.tag", "-f")
            tags = [self.which(f"{i}.tag", truth) for i in range(len(names))]
            self.assertEqual(sorted(tags), [[name] for name in truth])
            if make == self.moments:
                self.assertEqual(tags, [[name] for name in truth])  # as they are listed
            self.assertEqual(list((self.folder / "s").iterdir()), [])

    def test_numbers_that_change_remove_nothing(self):
        truth = self.moments()
        names = self.names()
        for number in (2, 3):
            message = self.assert_refused(64, "changes when files come or go", "encode", "s", "--series", number, "--rm", "-o", "a.tag")
            self.assertTrue(message.endswith(f"give its name instead: {names[number - 1]}\n"), message)
        # Names that were counts are none.
        self.assert_refused(64, f"has no series {UID}:2", "encode", "s", "--series", f"{UID}:2", "--rm", "-o", "a.tag")
        self.assertFalse((self.folder / "a.tag").exists())
        self.assertEqual(len(list((self.folder / "s").iterdir())), 12)
        self.ok("encode", "s", "--series", "2", "-o", "a.tag")
        self.assertEqual(self.which("a.tag", truth), ["2"])
        # Nor do lists have them.
        self.write_list(["s\tseries=2\toutput=a"])
        self.assertEqual(self.convert().returncode, 65)
        self.assertIn(f"give its name instead: {names[1]}", self.records()[-1]["error"])
        self.assertFalse((self.folder / "out" / "a.tag").exists())
        # Slices of other formats have names of their own.
        (self.folder / "t").mkdir()
        for name, z in itertools.product("ab", range(3)):
            tifffile.imwrite(self.folder / "t" / f"{name}{z}.tif", truth["1"][z].astype("uint16"))
        self.assert_refused(64, "give its name instead: b#.tif", "encode", "t", "--series", 2, "--rm", "-o", "b.tag")
        for name in ("a#.tif", "b#.tif"):
            self.ok("encode", "t", "--series", name, "--rm", "-o", f"{name}.tag")

    def test_a_uid_alone_means_a_volume_only_while_it_has_no_other(self):
        truth = self.moments(count=2)
        names = self.names()
        message = self.assert_refused(64, "holds 2 volumes", "encode", "s", "--series", UID)
        for name in names:
            self.assertIn(name, message)
        for path in (self.folder / "s").glob("1_*"):
            path.unlink()
        self.assert_refused(64, f"has no series {names[0]}", "encode", "s", "--series", names[0])
        for series in (UID, names[1], "1"):
            self.ok("encode", "s", "--series", series, "-o", "a.tag", "-f")
            self.assertEqual(self.which("a.tag", truth), ["2"])

    def test_names_depend_on_no_other_volume(self):
        self.moments("all", 3)
        self.scout_and_axial("all")
        whole = self.found("all")
        self.assertEqual(len(whole), 5)
        files = {}
        for name in "12389":
            shutil.rmtree(self.folder / "one", ignore_errors=True)
            (self.folder / "one").mkdir()
            for path in (self.folder / "all").glob(f"{name}_*"):
                shutil.copy(path, self.folder / "one")
            files[name], = self.found("one")
        self.assertEqual(set(files.values()), set(whole))
        for some in itertools.combinations("12389", 3):
            shutil.rmtree(self.folder / "some", ignore_errors=True)
            (self.folder / "some").mkdir()
            for path in (self.folder / "all").iterdir():
                if path.name[0] in some:
                    shutil.copy(path, self.folder / "some")
            self.assertEqual(set(self.found("some")), {files[name] for name in some}, some)

    def test_a_volume_that_kept_others_apart_may_go_first(self):
        samples = numpy.random.default_rng(3).integers(0, 4096, (3, 6, 5, 6))
        truth = {}
        for i, first in enumerate((0, 3, 6)):
            self.slices("s", i + 1, samples[i], first=first, AcquisitionNumber=i + 1, number=None)
            truth[str(i + 1)] = samples[i]
        names = self.names()
        self.assertEqual(len(names), 3)
        for i in (1, 2, 0):
            self.ok("encode", "s", "--series", names[i], "--rm", "-o", f"{i}.tag")
            self.assertEqual(self.which(f"{i}.tag", truth), [str(i + 1)])

    def test_originals_are_removed_in_one_pass_whatever_their_order(self):
        for make, turn in itertools.product((self.moments, self.scout_and_axial), (1, -1)):
            shutil.rmtree(self.folder / "out", ignore_errors=True)
            truth = make()
            found = self.found()
            self.write_list(list(found.values())[::turn])
            self.assertEqual(self.convert().returncode, 0)
            tags = [self.which(f"out/{record['output']}", truth) for record in self.records()]
            self.assertEqual(sorted(tags), [[name] for name in truth])
            run = self.convert("--remove-verified")
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual([record["status"] for record in self.records()], ["ok"] * len(truth) + ["removed"] * len(truth))
            self.assertEqual(list((self.folder / "s").iterdir()), [])
            for options in (["--remove-verified"], ["--skip-done"], ["--skip-done", "-f"]):
                self.assertEqual(self.convert(*options).returncode, 0, options)
            self.ok("restore", "--records", "out")
            self.assertEqual(set(self.found()), set(found))
            shutil.rmtree(self.folder / "s")

    def test_volumes_that_come_later_change_no_names(self):
        self.moments(count=2)
        before = self.found()
        self.write_list(before.values())
        self.assertEqual(self.convert().returncode, 0)
        truth = self.moments(count=4) | self.scout_and_axial()
        after = self.found()
        self.assertEqual({name: after.get(name) for name in before}, before)
        self.write_list(after.values())
        self.assertEqual(len(after), 6)
        self.assertEqual(self.convert("--skip-done").returncode, 0)
        outputs = {record["output"] for record in self.records()}
        self.assertEqual(sorted(self.which(f"out/{output}", truth) for output in outputs), [[name] for name in sorted(truth)])

    def test_no_advice_replaces_a_volume_by_another_one(self):
        truth = self.moments(count=1)
        self.write_list([f"s\tseries={UID}\toutput=a"])
        self.assertEqual(self.convert().returncode, 0)
        before = (self.folder / "out" / "a.tag").read_bytes()
        truth |= self.moments(count=2)
        for options in (["--skip-done"], ["--skip-done", "-f"], ["--remove-verified"]):
            self.assertEqual(self.convert(*options).returncode, 65, options)
            self.assertIn("holds 2 volumes", self.records()[-1]["error"])
        for path in (self.folder / "s").glob("1_*"):
            path.unlink()
        for options in (["--skip-done"], ["--skip-done", "-f"]):
            self.assertEqual(self.convert(*options).returncode, 65, options)
            self.assertRegex(self.records()[-1]["error"], r"is another volume than the one that was encoded \(\S+/s/2_0.dcm instead of \S+/s/1_0.dcm\)")
        self.assertEqual((self.folder / "out" / "a.tag").read_bytes(), before)
        results = self.folder / "out" / "results.jsonl"
        results.write_text(results.read_text().splitlines()[0] + "\n")
        self.assertEqual(self.convert("--remove-verified").returncode, 65)
        self.assertIn("is another volume than the one that was encoded", self.records()[-1]["error"])
        self.assertNotIn("-f", self.records()[-1]["error"])
        self.assertEqual(len(list((self.folder / "s").iterdir())), 3)
        self.assertEqual(self.which("out/a.tag", truth), ["1"])

    def test_a_name_that_fits_several_volumes_is_refused(self):
        samples = numpy.random.default_rng(5).integers(0, 4096, (2, 5, 5, 6))
        for name, values in (("PatientPosition", ("HFS", "FFS")), ("FrameOfReferenceUID", ("1.2.8", "1.2.9"))):
            for numbers_go_on in (True, False):
                shutil.rmtree(self.folder / "s", ignore_errors=True)
                parts = {}
                for g in range(2):
                    for z in range(5):
                        number = z + 1 + (5 * g if numbers_go_on else 0)
                        self.slices("s", f"{g + 1}{z}", samples[g, z:z + 1], first=2 * z + g, number=number, **{name: values[g]})
                    parts[str(g)] = samples[g]
                names = self.names()
                # Without the attribute, all slices are one volume. Its name must not become that of a part.
                shutil.rmtree(self.folder / "t", ignore_errors=True)
                for g, z in itertools.product(range(2), range(5)):
                    self.slices("t", f"{g + 1}{z}", samples[g, z:z + 1], first=2 * z + g, number=z + 1 + (5 * g if numbers_go_on else 0),
                                **({} if name == "PatientPosition" else {name: values[0]}))
                whole, = self.found("t")
                self.assertNotIn(whole, names)
                message = self.assert_refused(64, f"has no series {whole}", "encode", "s", "--series", whole, "-o", "b.tag")
                for one in names:
                    self.assertIn(one, message)
                seen = []
                for one in names:
                    self.ok("encode", "s", "--series", one, "-o", "a.tag", "-f")
                    seen += self.which("a.tag", parts)
                self.assertEqual(sorted(seen), ["0", "1"], (name, names))

    def test_what_tells_volumes_of_one_series_apart_is_said(self):
        samples = numpy.random.default_rng(4).integers(0, 4096, (4, 5, 6))
        self.slices("s", 1, samples[:3], PixelSpacing=[0.5, 0.7])
        self.slices("s", 2, samples[3:], PixelSpacing=[0.5, 0.71], first=3)
        message = self.assert_refused(64, "holds 2 volumes", "encode", "s")
        self.assertIn("6 x 5 x 3, CT, 0.7 x 0.5 mm\n", message)
        self.assertIn("6 x 5 x 1, CT, 0.71 x 0.5 mm\n", message)


if __name__ == "__main__":
    main()
