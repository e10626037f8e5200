"""N5: containers of zarr-python's N5Store, and those of a writer by the specification (https://github.com/saalfeldlab/n5).
"""

import gzip
import itertools
import json
import struct
import unittest

from other_readers import ReaderTest, main, numcodecs, numpy, random_samples, tifffile

try:
    import zarr
except ImportError:
    zarr = None

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")


def compressed(data, kind):
    if kind == "raw":
        return data
    if kind == "gzip":
        return gzip.compress(data)
    return bytes({"zstd": numcodecs.Zstd(3), "blosc": numcodecs.Blosc(cname="lz4")}[kind].encode(data))


def write_n5(folder, samples, block, kind="gzip", mode=0, whole=False, skip=lambda numbers: False, **attributes):
    """An array. `block` and the numbers of files have the fastest axis first, as samples.T has. Blocks at the end are
    smaller, or, with `whole`, filled up."""
    folder.mkdir(parents=True, exist_ok=True)
    compression = attributes.pop("compression", {"type": kind} | ({"useZlib": False, "level": 5} if kind == "gzip" else {}))
    facts = {"dimensions": list(samples.shape[::-1]), "blockSize": list(block), "dataType": str(samples.dtype), "compression": compression} | attributes
    (folder / "attributes.json").write_text(json.dumps({name: value for name, value in facts.items() if value is not None}))
    fast = samples.T
    for numbers in itertools.product(*(range(-(-n // s)) for n, s in zip(fast.shape, block))):
        if skip(numbers):
            continue
        part = fast[tuple(slice(i * s, (i + 1) * s) for i, s in zip(numbers, block))]
        if whole:
            part = numpy.pad(part, [(0, s - n) for s, n in zip(block, part.shape)])
        head = struct.pack(">HH", mode, part.ndim) + b"".join(struct.pack(">I", n) for n in part.shape)
        if mode == 1:
            head += struct.pack(">I", part.size)
        path = folder.joinpath(*map(str, numbers))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(head + compressed(part.T.astype(part.dtype.newbyteorder(">")).tobytes(), kind))


@unittest.skipIf(None in (numpy, numcodecs), "libraries are missing")
class N5(ReaderTest):
    def setUp(self):
        super().setUp()
        self.number = 0

    def container(self):
        """A new one, as files of an older one would be in the way."""
        self.number += 1
        folder = self.folder / f"c{self.number}.n5"
        folder.mkdir()
        (folder / "attributes.json").write_text('{"n5": "2.5.1"}')
        return folder

    def test_every_type_and_compression(self):
        for i, type in enumerate(TYPES):
            truth = random_samples(type, (9, 7, 11))
            for kind in ("raw", "gzip", "zstd", "blosc")[i % 2::2] if i > 1 else ("raw", "gzip", "zstd", "blosc"):
                folder = self.container()
                write_n5(folder / "volumes" / "raw", truth, (4, 3, 5), kind, mode=i % 2, whole=i % 3 == 0)
                info = self.encodes(truth, folder.name, what=(type, kind))
                self.assertEqual((self.messages, info["source"]["pairs"]["zarr_dataset"]), ("", "/volumes/raw"))
                self.encodes(truth, f"{folder.name}/volumes/raw", what="the array itself")

    @unittest.skipIf(zarr is None or not hasattr(zarr, "N5Store"), "there is no zarr.N5Store on this machine (python3-zarr)")
    def test_containers_of_zarr_python(self):
        for type in ("uint16", "float32"):
            truth = random_samples(type, (9, 7, 11))
            for compressor in (None, numcodecs.GZip(5), numcodecs.Zstd(3), numcodecs.Blosc()):
                folder = self.container()
                store = zarr.N5Store(str(folder))
                array = zarr.open_group(store, mode="a").create_dataset("a", shape=truth.shape, chunks=(4, 3, 5), dtype=type, compressor=compressor)
                array[:] = truth
                self.encodes(truth, folder.name, what=(type, compressor))
                # Ours are read by it.
                write_n5(folder / "b", truth, (5, 3, 4), "gzip", whole=True)
                numpy.testing.assert_array_equal(zarr.open_group(zarr.N5Store(str(folder)), mode="r")["b"][:], truth)

    def test_missing_blocks_are_zeros(self):
        truth = random_samples("uint16", (9, 7, 11))
        folder = self.container()
        write_n5(folder / "a", truth, (4, 3, 5), skip=lambda numbers: numbers in ((0, 1, 0), (2, 2, 1)))
        truth[:5, 3:6, :4] = truth[5:, 6:, 8:] = 0
        self.encodes(truth, folder.name, says="2 of 18 chunks are missing; their samples are the fill value")

    def test_the_voxel_size(self):
        truth = random_samples("uint8", (9, 7, 11))
        for attributes, spacing, unit in (({"resolution": [4, 5, 40], "units": ["nm", "nm", "nm"]}, [4, 5, 40], "nm"), ({"resolution": [0.5, 0.5, 2], "units": "um"}, [0.5, 0.5, 2], "um"),
                                          ({"pixelResolution": {"unit": "um", "dimensions": [0.1, 0.2, 0.3]}}, [0.1, 0.2, 0.3], "um"),
                                          ({"pixelResolution": [1, 2, 3], "units": ["mm"] * 3, "downsamplingFactors": [2, 2, 1]}, [2, 4, 3], "mm"),
                                          ({"pixelResolution": {"unit": "pixel", "dimensions": [1, 1, 1]}}, None, None), ({}, None, None)):
            folder = self.container()
            write_n5(folder / "a", truth, (4, 3, 5), **attributes)
            info = self.encodes(truth, folder.name, what=attributes)
            self.assertEqual(info["geometry"]["spacing"], spacing, attributes)
            if spacing:
                self.assertEqual(info["geometry"]["units"], [unit] * 3, attributes)
                self.assertEqual(self.messages, "")
        folder = self.container()  # levels of n5-viewer
        (folder / "g").mkdir()
        (folder / "g" / "attributes.json").write_text('{"pixelResolution": {"unit": "um", "dimensions": [1, 2, 3]}}')
        for level in range(2):
            write_n5(folder / "g" / f"s{level}", truth, (4, 3, 5), **({"downsamplingFactors": [2, 2, 2]} if level else {}))
        self.assert_refused(64, "g/s1", "encode", folder.name)
        for level in range(2):
            self.assertEqual(self.encodes(truth, folder.name, "--dataset", f"g/s{level}")["geometry"]["spacing"], [1 + level, 2 + 2 * level, 3 + 3 * level])
        folder = self.container()  # levels of neuroglancer and others
        (folder / "data").mkdir()
        (folder / "data" / "attributes.json").write_text('{"resolution": [4, 4, 40], "units": ["nm", "nm", "nm"]}')
        for level in range(3):
            write_n5(folder / "data" / f"s{level}", truth, (4, 3, 5), **({"downsamplingFactors": [2 * level, 2 * level, 2]} if level else {}))
        for level, spacing in enumerate(([4, 4, 40], [8, 8, 80], [16, 16, 80])):
            info = self.encodes(truth, folder.name, "--dataset", f"data/s{level}")
            self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"], self.messages), (spacing, ["nm"] * 3, ""))
        for factors, spacing in (([1, 1, 1], [4, 4, 40]), ([2, 2, 2], None), ([2, 2], None), ("x", None)):  # whose resolution is it?
            folder = self.container()
            write_n5(folder / "a", truth, (4, 3, 5), resolution=[4, 4, 40], downsamplingFactors=factors)
            info = self.encodes(truth, folder.name, says="it has both resolution and downsamplingFactors" if spacing is None else "")
            self.assertEqual((info["geometry"]["spacing"], "not understood" in info["source"]["pairs"]), (spacing, spacing is None), factors)
        for attributes in ({"resolution": [1, 2]}, {"resolution": [1, 0, 2]}, {"resolution": "x"}, {"pixelResolution": [1, 2, 3], "downsamplingFactors": "x"}):
            folder = self.container()
            write_n5(folder / "a", truth, (4, 3, 5), **attributes)
            self.assertIsNone(self.encodes(truth, folder.name, says="N5: a: its ")["geometry"]["spacing"], attributes)

    def test_channels_are_volumes_of_their_own(self):
        truth = random_samples("uint16", (2, 9, 7, 11))
        folder = self.container()
        write_n5(folder / "a", truth, (4, 3, 5, 1), axes=["x", "y", "z", "c"])
        for channel in range(2):
            self.encodes(truth[channel], folder.name, "--series", f"c{channel + 1}")

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine (python3-tifffile)")
    def test_slices_beside_attributes_of_another_program_are_found(self):
        truth = random_samples("uint8", (3, 7, 11))

        def found():
            lines = self.search("d").stdout.splitlines()
            return sorted(line.replace(str(self.folder), "").split("\t")[:-1] for line in lines if not line.startswith("#"))

        for attributes, is_n5 in (('{"blockSize":3}', False), ('{"n5": 5}', False), ('{"a": {"n5": "2.0.0"}}', False), ('{"dimensions": [3], "blockSize": [3]}', False), ('["n5"]', False),
                                  ('{"n5": "2.5.1"}', True), ('{"dimensions": [3], "dataType": "uint8", "blockSize": [3], "compression": {"type": "raw"}}', True), ('{"n5": "9.0.0"}', True)):
            folder = self.folder / "d" / "slices"
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "attributes.json").write_text(attributes)
            for z, slice in enumerate(truth):
                tifffile.imwrite(folder / f"s{z}.tif", slice)
            self.assertEqual(found(), [["/d/slices", *(["from=tiff"] if is_n5 else []), "series=s#.tif"]], attributes)
            if is_n5:
                self.assertIn(": N5: ", self.assert_refused(65, "; if the slices of TIFF beside it are meant, give --from tiff", "encode", "d/slices"))
            self.encodes(truth, "d/slices", *(["--from", "tiff"] if is_n5 else []), what=attributes)
        # A container with a volume has its files for itself.
        (folder / "attributes.json").write_text(' {"n5": "2.5.1", "x": [[[1]]]}')
        write_n5(folder / "a", truth, (4, 3, 5))
        self.assertEqual([line[0] for line in found()], ["/d/slices"])
        self.assertNotIn("from=tiff", found()[0])
        self.encodes(truth, "d/slices")

    def test_other_versions_are_refused(self):
        truth = random_samples("uint8", (9, 7, 11))
        for version, is_known in (("1.0.0", True), ("2.5.1-SNAPSHOT", True), ("4.0.0", True), ("9.0.0", False), ("5", False), ("", False), ("40.1", False)):
            folder = self.container()
            write_n5(folder / "a", truth, (4, 3, 5))
            (folder / "attributes.json").write_text(json.dumps({"n5": version}))
            if is_known:
                self.encodes(truth, folder.name, what=version)
            else:
                self.assert_refused(65, f'attributes.json: N5: is of the version "{version}", which is not supported; 1 to 4 are', "encode", folder.name)

    def test_what_is_not_supported_is_refused(self):
        truth = random_samples("uint16", (9, 7, 11))
        for attributes, said in (({"compression": {"type": "lz4", "blockSize": 65536}}, 'its codec "lz4" is not supported'), ({"compression": {"type": "jpeg"}}, "jpeg"),
                                 ({"compression": None}, "its compression is"), ({"dataType": "uint64"}, "has uint64 samples"), ({"dataType": "string"}, "string"),
                                 ({"blockSize": [4, 3]}, "not of one number of axes"), ({"blockSize": [4, 0, 5]}, "its blockSize is"), ({"dimensions": [11, -7, 9]}, "its dimensions is"),
                                 ({"blockSize": [1 << 20, 1 << 20, 1 << 20]}, "are too large"), ({"dimensions": [1 << 40, 1 << 40, 9]}, "which are no volume")):
            folder = self.container()
            write_n5(folder / "a", truth, (4, 3, 5), "raw", **attributes)
            message = self.assert_refused(65, said, "encode", f"{folder.name}", "-o", "a.tag", "--dataset", "a")
            self.assertIn("c", message)
            self.assertFalse((self.folder / "a.tag").exists())
        (folder / "attributes.json").write_text("{")
        self.assert_refused(65, "attributes.json: is not JSON", "encode", folder.name)

    def test_damaged_blocks_are_refused(self):
        truth = random_samples("uint16", (9, 7, 11))
        for kind in ("raw", "gzip", "zstd", "blosc"):
            folder = self.container()
            write_n5(folder / "a", truth, (4, 3, 5), kind)
            path = folder / "a" / "1" / "1" / "0"
            good = path.read_bytes()
            for broken, said in ((b"", "is truncated"), (good[:3], "is truncated"), (good[:15], "is truncated"), (good[:-3], ""), (good + bytes(300), ""),
                                 (struct.pack(">HHIII", 2, 3, 4, 3, 5) + good[16:], "of the mode 2"), (struct.pack(">HHIII", 0, 2, 4, 3, 5) + good[16:], "has 2 axes"),
                                 (struct.pack(">HHIII", 0, 3, 4, 3, 4) + good[16:], "4 x 3 x 4 samples"), (struct.pack(">HHIII", 0, 3, 2**32 - 1, 2**32 - 1, 2**32 - 1) + good[16:], "samples, but"),
                                 (struct.pack(">HHIIII", 1, 3, 4, 3, 5, 61) + good[16:], "another number of samples")):
                if kind == "gzip" and broken == good + bytes(300):
                    continue  # which its reader ignores, as gzip does
                path.write_bytes(broken)
                message = self.assert_refused(65, said, "encode", folder.name, "-o", "a.tag")
                self.assertIn("a/1/1/0", message, (kind, said))
                self.assertFalse((self.folder / "a.tag").exists())


if __name__ == "__main__":
    main()
