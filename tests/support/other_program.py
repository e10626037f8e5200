"""The program for another machine, beside the one of this: the same commands write the same bytes, and say the same."""

import os
import pathlib
import random
import shutil
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SIZES = {"uint8": 1, "int8": 1, "uint16": 2, "int16": 2, "uint32": 4, "int32": 4, "float32": 4, "float64": 8}


def volume(sample_type, count, generator):
    """Smooth samples with noise of a few bits; of floats, finite ones."""
    size = SIZES[sample_type]
    samples = bytearray()
    value = 0
    for _ in range(count):
        value = (value + generator.randrange(-3, 4)) % 120
        if sample_type.startswith("float"):
            samples += bytes([generator.randrange(256)] * (size - 2)) + bytes([value, 0x40])
        else:
            samples += value.to_bytes(size, "little")
    return bytes(samples)


class OtherProgram:
    """Tests of a class that has `program`, the path of the program here, and `command`, which starts the other one."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for name in ("here", "there"):
            (self.folder / name).mkdir()

    def here(self, *arguments, data=None, cwd="here"):
        return subprocess.run([str(self.program), *map(str, arguments)], cwd=self.folder / cwd, input=data,
                              capture_output=True, check=False)

    def there(self, *arguments, data=None, cwd="there"):
        return subprocess.run([*self.command, *map(str, arguments)], cwd=self.folder / cwd, input=data,
                              capture_output=True, check=False)

    def both(self, *arguments, data=None):
        """Runs both; they must say and end the same. Returns what they wrote to standard output."""
        here, there = self.here(*arguments, data=data), self.there(*arguments, data=data)
        self.assertEqual(there.returncode, here.returncode, (arguments, here.stderr, there.stderr))
        self.assertEqual(there.stdout, here.stdout, arguments)
        return there

    def files(self, name):
        return {str(path.relative_to(self.folder / name)): path.read_bytes()
                for path in (self.folder / name).rglob("*") if path.is_file()}

    def test_golden_files_decode_to_the_same_bytes(self):
        golden = sorted((ROOT / "tests/golden/1.0").glob("*.tag"))
        self.assertGreater(len(golden), 30)
        for path in golden:
            with self.subTest(path.name):
                # Files of several volumes are refused: then both end the same.
                done = self.both("decode", "-", "-o", "-", "-q", data=path.read_bytes())
                self.assertTrue(done.stdout or done.returncode)

    def test_odd_volumes_have_the_same_files(self):
        generator = random.Random(int(os.environ.get("TAGRID_SEED", "1")))
        for round_ in range(int(os.environ.get("TAGRID_OTHER_VOLUMES", "200"))):
            sample_type = generator.choice(sorted(SIZES))
            dims = [generator.choice((1, 2, 3, 7, 16, 17, 33, 40)) for _ in range(3)]
            options = generator.choice(([], ["--max-error", "2"], ["--grid-only"], ["--overviews", "auto"],
                                        ["--max-error", "1", "--grid", "derived"]))
            options = [*options, "--brick", generator.choice(("1", "2"))]
            data = volume(sample_type, dims[0] * dims[1] * dims[2], generator)
            raw = ["--dims", ",".join(map(str, dims)), "--type", sample_type]
            with self.subTest((round_, sample_type, dims, options)):
                for name in ("here", "there"):
                    (self.folder / name / "v.raw").write_bytes(data)
                done = self.both("encode", "v.raw", *raw, *options, "-q", "-f", "-o", "v.tag")
                if done.returncode == 0:
                    self.both("verify", "v.tag", "-q")
                    self.both("decode", "v.tag", "-q", "-f", "-o", "back.raw")
                self.assertEqual(self.files("there"), self.files("here"))

    def test_every_command_gives_the_same_files(self):
        for arguments in (("phantom", "--dims", "60,50,40", "-o", "p.nrrd"),
                          ("encode", "p.nrrd", "--max-error", "4", "-o", "p.tag"),
                          ("encode", "p.nrrd", "--overviews", "auto", "-o", "o.tag"),
                          ("mesh", "p.tag", "-o", "p.msh"), ("mesh", "p.tag", "-o", "p.vtu"),
                          ("mesh", "p.tag", "--materials", "bone=300:", "-o", "bone.inp"),
                          ("surface", "p.tag", "--iso", "300", "-o", "p.ply"),
                          ("preview", "p.tag", "-o", "p.png"), ("decode", "p.tag", "-o", "back.mha"),
                          ("decode", "o.tag", "--step", "2", "-o", "small.nrrd"),
                          ("restore", "o.tag", "-o", "restored"), ("protect", "p.tag", "--parity", "5%")):
            with self.subTest(arguments):
                self.assertEqual(self.both(*arguments, "-q").returncode, 0)
        self.assertEqual(self.files("there"), self.files("here"))

    def test_an_archive_has_the_same_files(self):
        for name in ("one", "two"):
            self.both("phantom", "--dims", "40,30,20" if name == "one" else "20,30,40", "-q", "-o", f"{name}.nrrd")
        lists = {}
        for name, run in (("here", self.here), ("there", self.there)):
            found = run("convert", "--find", ".", "-q")
            self.assertEqual(found.returncode, 0, found.stderr)
            # A list has whole paths; under Wine, drive Z is this system.
            lists[name] = found.stdout.replace(b"Z:", b"").replace(f"{self.folder}/{name}".encode(), b"")
            (self.folder / name / "list.tsv").write_bytes(found.stdout)
            for arguments in (("convert", "--manifest", "list.tsv", "--output-dir", "out"), ("archive", "check", "out"),
                              ("archive", "list", "out")):
                done = run(*arguments, "-q")
                self.assertEqual(done.returncode, 0, (name, arguments, done.stderr))
        self.assertEqual(lists["there"], lists["here"])
        tags = {name: {path: content for path, content in self.files(name).items() if path.endswith(".tag")}
                for name in ("here", "there")}
        self.assertEqual(len(tags["here"]), 2)
        self.assertEqual(tags["there"], tags["here"])
        # What is a record here is one there.
        shutil.move(self.folder / "there/out", self.folder / "here/moved")
        self.assertEqual(self.here("archive", "check", "moved", "-q").returncode, 0)
