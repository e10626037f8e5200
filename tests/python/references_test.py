"""The bricks of a .tag file are the chunks of a Zarr array, by references to ranges of its bytes."""

import base64
import json
import pathlib
import pickle
import subprocess
import sys
import unittest

import numpy as np
import tagrid

from volumes import Source, blobs, in_threads, module, temporary_folder

ROOT = pathlib.Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests/golden/1.0"
sys.path.append(str(ROOT / "tests/support"))
from versions import has_zarr_3

try:
    import numcodecs
    import zarr
    from tagrid.references import TagridBrick, references
    MISSING = False
except ImportError:
    MISSING = True


def content_of(refs):
    """A store with what references name: without fsspec, for any zarr."""
    found = {}
    for key, value in refs["refs"].items():
        if isinstance(value, str):
            found[key] = base64.b64decode(value[7:]) if value.startswith("base64:") else value.encode()
        else:
            path, offset, size = value
            found[key] = pathlib.Path(path).read_bytes()[offset:offset + size]
    return found


def group_of(content):
    if not has_zarr_3():
        return zarr.open_group(content, mode="r")
    buffers = {key: zarr.core.buffer.cpu.Buffer.from_bytes(data) for key, data in content.items()}
    return zarr.open_group(zarr.storage.MemoryStore(buffers), mode="r", zarr_format=2)


@unittest.skipIf(MISSING, "there is no zarr")
class References(unittest.TestCase):
    def setUp(self):
        self.folder = temporary_folder(self)
        self.path = self.folder / "a.tag"

    def written(self, samples, **options):
        tagrid.encode(samples, self.path, **options)
        return self.path

    def test_samples_of_the_volume_and_its_overviews(self):
        samples = blobs((150, 140, 200))
        path = self.written(samples, overviews=(4, 16), spacing=(2, 1, 0.5),
                            metadata={"rescale_slope": "2", "rescale_intercept": "-5"})
        refs = json.loads(json.dumps(references(path)))
        self.assertEqual(refs["version"], 1)
        group = group_of(content_of(refs))
        self.assertEqual(group["0"].chunks, (64, 64, 64))
        np.testing.assert_array_equal(group["0"][...], samples)
        np.testing.assert_array_equal(group["0"][3:70, ::7, 199], samples[3:70, ::7, 199])
        with tagrid.open(path) as volume:
            for level, factor in ((1, 4), (2, 16)):
                np.testing.assert_array_equal(group[str(level)][...], volume.overview(factor)[...])
        np.testing.assert_array_equal(group["z"][...], 2 * np.arange(150))
        self.assertEqual(dict(group["0"].attrs)["scale_factor"], 2)
        (multiscales,) = group.attrs["multiscales"]
        self.assertEqual([dataset["path"] for dataset in multiscales["datasets"]], ["0", "1", "2"])

    def test_every_golden_file_whose_bricks_are_chunks(self):
        tried = 0
        for path in sorted(GOLDEN.glob("*.tag")):
            with tagrid.open(path) as volume:
                samples = volume[...]
                has_chunks = volume.volumes == 1 and (volume.info["lead"] == 1 or max(volume.info["bricks"]) == 1)
            if not has_chunks:
                self.assertRaises(tagrid.ArgumentError, references, path)
                continue
            tried += 1
            np.testing.assert_array_equal(group_of(content_of(references(path)))["0"][...], samples, path.name)
        self.assertGreater(tried, 5)

    def test_files_of_any_type_with_many_bricks_and_parity(self):
        for dtype in ("uint8", "int8", "float32", "float64", "uint32"):
            samples = blobs((50, 60, 70), dtype)
            refs = references(self.written(samples, cube=4, brick=4, overviews="none"))
            self.assertEqual(len([key for key in refs["refs"] if key.startswith("0/") and "." not in key]), 4 * 4 * 5)
            np.testing.assert_array_equal(group_of(content_of(refs))["0"][...], samples)
        subprocess.run([sys.argv[1], "protect", self.path, "--parity", "5%", "-q"], check=True)
        np.testing.assert_array_equal(group_of(content_of(references(self.path)))["0"][...], samples)

    def test_references_are_small_and_hold_no_bricks(self):
        path = self.written(np.random.default_rng(1).integers(0, 60000, (200, 200, 200)).astype("uint16"))
        refs = references(path)
        self.assertLess(len(json.dumps(refs)), path.stat().st_size / 500)
        source = Source(path.read_bytes())
        self.assertEqual(references(source, str(path)), refs)
        self.assertLess(source.bytes, 3 << 20)

    def test_chunks_that_are_not_those_of_the_file_are_an_error(self):
        refs = references(self.written(blobs((100, 64, 64))))
        content = content_of(refs)
        first = content["0/0/0/0"]
        for wrong in (first[:-1], first[1:], first[:-9] + b"x" + first[-8:], b"x" + first[1:], b"", content["0/1/0/0"][-40:]):
            with self.assertRaises(tagrid.DamagedError):
                group_of({**content, "0/0/0/0": wrong})["0"][...]
        other = content_of(references(self.written(blobs((100, 64, 64), seed=5))))
        with self.assertRaises(tagrid.DamagedError):
            group_of({**content, "0/0/0/0": other["0/0/0/0"]})["0"][...]

    def test_threads_and_other_processes_have_codecs(self):
        samples = blobs((100, 64, 64))
        content = content_of(references(self.written(samples)))
        codec = numcodecs.get_codec(json.loads(content["0/.zarray"])["compressor"])
        self.assertEqual(codec, pickle.loads(pickle.dumps(codec)))
        self.assertRaises(PermissionError, codec.encode, samples)
        out = np.empty((64, 64, 64), "int16")

        def work(seed):
            for _ in range(5):
                for part in range(2):
                    wanted = np.zeros((64, 64, 64), "int16")
                    rest = samples[64 * part:64 * part + 64]
                    wanted[:len(rest)] = rest
                    np.testing.assert_array_equal(codec.decode(content[f"0/{part}/0/0"]), wanted)

        in_threads(work, range(4))
        codec.decode(content["0/0/0/0"], out)
        np.testing.assert_array_equal(out, samples[:64])

    def test_what_has_no_references_is_refused(self):
        path = self.written(blobs((200, 64, 64)), lead=0)
        self.assertRaisesRegex(tagrid.ArgumentError, "lead=0", references, path)
        self.assertRaisesRegex(tagrid.ArgumentError, "url", references, Source(path.read_bytes()))
        self.assertRaisesRegex(tagrid.ArgumentError, "volumes", references, GOLDEN / "volumes_bounded_int16.tag")
        (self.folder / "text").write_text("text")
        self.assertRaises(tagrid.DamagedError, references, self.folder / "text")
        self.assertRaises(FileNotFoundError, references, self.folder / "none.tag")

    def test_the_command_writes_them(self):
        path = self.written(blobs((70, 64, 64)))
        out = self.folder / "refs.json"
        command = [sys.executable, "-B", "-m", "tagrid.references", path, "--url", "https://example.org/a.tag"]
        subprocess.run([*command, "-o", out], check=True)
        self.assertEqual(json.loads(out.read_text()), references(path, "https://example.org/a.tag"))

    @unittest.skipIf(has_zarr_3(), "zarr 3 wants a newer fsspec than Debian's")
    def test_fsspec_reads_only_the_ranges_of_chunks_that_are_used(self):
        fsspec = module("fsspec")
        samples = blobs((200, 64, 64))
        files = fsspec.filesystem("reference", fo=references(self.written(samples)))
        group = zarr.open_group(files.get_mapper(""), mode="r")
        damaged = bytearray(self.path.read_bytes())
        _, offset, _ = references(self.path)["refs"]["0/2/0/0"]
        damaged[offset + 100] ^= 1
        self.path.write_bytes(damaged)
        np.testing.assert_array_equal(group["0"][:128], samples[:128])
        with self.assertRaises(tagrid.DamagedError):
            group["0"][130]
        self.assertIsInstance(group["0"].compressor, TagridBrick)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
