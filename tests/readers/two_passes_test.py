"""Bounds that follow from the samples are the same whatever the format, and whether the samples come from a file or a pipe.
"""

import gzip
import json
import os
import resource
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, h5py, main, nibabel, numpy, tifffile, unless_sanitized, zarr

SHAPE = (40, 50, 60)
RULES = (["--max-error", "noise:0.5"], ["--relative-error", "0.01"], ["--psnr", "45"], ["--ratio", "12"], ["--bits", "2"],
         ["--range", "auto"], ["--range", "auto", "--psnr", "50"])


def volume():
    """A ball in noise."""
    random = numpy.random.default_rng(5)
    z, y, x = numpy.indices(SHAPE)
    ball = (z - 20) ** 2 + (y - 25) ** 2 + (x - 30) ** 2 < 300
    return (1000 + 800 * ball + random.normal(0, 12, SHAPE)).astype("uint16")


class TwoPasses(ReaderTest):
    def setUp(self):
        super().setUp()
        self.samples = volume()
        head = "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 60 50 40\nencoding: raw\nendian: little\n\n"
        self.nrrd = head.encode() + self.samples.tobytes()
        (self.folder / "a.nrrd").write_bytes(self.nrrd)

    def others(self):
        """The same volume in formats that cannot be read row by row."""
        (self.folder / "gz.nrrd").write_bytes(self.nrrd.split(b"\n\n")[0].replace(b"raw", b"gzip") + b"\n\n" + gzip.compress(self.samples.tobytes()))
        yield "gz.nrrd", True
        if h5py:
            with h5py.File(self.folder / "a.h5", "w") as file:
                file.create_dataset("volume", data=self.samples, chunks=(16, 32, 32), compression="gzip", compression_opts=1)
            yield "a.h5", False
        if zarr:
            array = zarr.open(str(self.folder / "a.zarr"), mode="w", shape=SHAPE, chunks=(16, 32, 32), dtype="uint16")
            array[:] = self.samples
            yield "a.zarr", False
        if tifffile:
            tifffile.imwrite(self.folder / "a.tif", self.samples, photometric="minisblack", compression="zlib", metadata=None)
            yield "a.tif", False
        if nibabel:
            nibabel.save(nibabel.Nifti1Image(self.samples.T, numpy.eye(4)), self.folder / "a.nii.gz")
            yield "a.nii.gz", True

    def piped(self, *arguments, **options):
        return subprocess.run([PROGRAM, *arguments], cwd=self.folder, input=options.pop("input", self.nrrd), stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, **options)

    def decoded(self, name):
        """What the file says that follows from the samples, and the samples."""
        info = self.info(name)
        self.ok("decode", name, "-o", "x.raw", "-f", "--samples")
        return [info[key] for key in ("max_error", "range", "field_scale", "achieved", "levels")] + [(self.folder / "x.raw").read_bytes()]

    def test_every_format_has_the_bound_of_an_uncompressed_file(self):
        others = list(self.others())
        self.assertGreater(len(others), 1)
        for rule in RULES:
            self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", *rule)
            wanted = self.decoded("a.tag")
            for path, is_copied in others:
                with self.subTest(rule=rule, path=path):
                    run = self.ok("encode", path, "-o", "b.tag", "-f", *rule)
                    self.assertTrue(self.decoded("b.tag") == wanted)
                    needs_copy = is_copied and rule not in (["--relative-error", "0.01"], ["--range", "auto"])
                    self.assertEqual(run.stderr.count("first copied to"), needs_copy, run.stderr)
                    if "--psnr" in rule:
                        self.ok("encode", path, "-o", "c.tag", "-f", "--spool", self.folder, *rule)
                        self.assertTrue((self.folder / "b.tag").read_bytes() == (self.folder / "c.tag").read_bytes())
            for folder in (["--spool", self.folder], []):
                run = self.piped("encode", "-", "-o", "b.tag", "-f", *rule, *folder)
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertIn(b"standard input: is read more than once, so its samples (2", run.stderr)
                self.assertEqual(self.decoded("b.tag"), wanted, rule)
                self.assertEqual(self.piped("encode", "-", "-o", "b.tag", "-f", "-q", *rule, *folder).stderr, b"")
        self.assertEqual([name for name in os.listdir(self.folder) if "spool" in name], [])

    def test_estimates_are_those_of_an_uncompressed_file(self):
        def figures(*input, **options):
            run = self.piped("estimate", *input, "--errors", "0,4", "--psnr", "45", "--json", "e.json", "-f", **options)
            self.assertEqual(run.returncode, 0, run.stderr)
            found = json.loads((self.folder / "e.json").read_text())["settings"]
            return found["noise"], [(e["max_error"], e["transform_step"], round(e["rmse"], 9), round(e["bits_per_voxel"], 1)) for e in found["estimates"]]

        wanted = figures("a.nrrd")
        for path, _ in self.others():
            self.assertEqual(figures(path), wanted, path)
        self.assertEqual(figures("-"), wanted)

    def test_a_copy_that_cannot_be_made_is_an_error_of_the_world(self):
        rule = ["--psnr", "45"]
        for folder in ("/nowhere", "/proc"):
            run = self.piped("encode", "-", "-o", "b.tag", *rule, env={**os.environ, "TMPDIR": folder})
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn(folder.encode(), run.stderr)
        # More than any disk has room for.
        head = b"NRRD0004\ntype: uint16\ndimension: 3\nsizes: 1000 1000 20000000\nencoding: raw\nendian: little\n\n"
        run = self.piped("encode", "-", "-o", "b.tag", "--max-error", "noise:1", input=head)
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn(b"GB free; name another directory with --spool", run.stderr)
        # A disk that fills up: the limit on the size of files ends as one does.
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        run = self.piped("encode", "-", "-o", "b.tag", *rule, preexec_fn=limit)
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertFalse((self.folder / "b.tag").exists())

    def test_a_pipe_of_floats_needs_a_range_or_auto(self):
        floats = self.samples.astype("float32")
        head = b"NRRD0004\ntype: float\ndimension: 3\nsizes: 60 50 40\nencoding: raw\nendian: little\n\n"
        (self.folder / "f.nrrd").write_bytes(head + floats.tobytes())
        run = self.piped("encode", "-", "-o", "b.tag", "--max-error", "1", input=head + floats.tobytes())
        self.assertEqual(run.returncode, 64, run.stderr)
        run = self.piped("encode", "-", "-o", "b.tag", "--max-error", "1", "--range", "auto", input=head + floats.tobytes())
        self.assertEqual(run.returncode, 0, run.stderr)
        self.ok("encode", "f.nrrd", "-o", "a.tag", "--max-error", "1")
        self.assertEqual(self.decoded("b.tag"), self.decoded("a.tag"))

    @unless_sanitized
    @unittest.skipIf(h5py is None, "there is no h5py on this machine")
    def test_the_limit_on_memory_holds(self):
        large = numpy.tile(self.samples, (2, 5, 5))
        with h5py.File(self.folder / "large.h5", "w") as file:
            file.create_dataset("volume", data=large, chunks=(16, 64, 64), compression="gzip", compression_opts=1)
        for rule in (["--max-error", "noise:0.5"], ["--psnr", "40"]):
            run = self.tagrid("encode", "large.h5", "-o", "b.tag", "-f", "-M", "1M", *rule)
            self.assertEqual(run.returncode, 64, run.stderr)
            least = int(run.stderr.split("give -M ")[1].split("M")[0])
            self.ok("encode", "large.h5", "-o", "b.tag", "-f", "-M", f"{least}M", "--json", "r.json", *rule)
            peak = json.loads((self.folder / "r.json").read_text())["peak_memory"]
            self.assertLess(peak, least << 20)
            self.ok("encode", "large.h5", "-o", "c.tag", "-f", *rule)
            self.assertTrue((self.folder / "b.tag").read_bytes() == (self.folder / "c.tag").read_bytes())


if __name__ == "__main__":
    main()
