#!/usr/bin/env python3
"""python3 tests/format/decoder_test.py TAGRID made|golden|broken|record

Compares decoder.py, which was written from docs/dev/format.md alone, with `tagrid decode`:
  made    files of small volumes of many kinds, encoded here
  golden  the files that every version must read. decoder.py takes minutes to decode them, so tests/golden/1.0/second_decoder.json
          holds the hashes of its results, which are those of `tagrid decode`. It fails where a file or decoder.py has changed
          since: then record them again.
  record  decodes all golden files with both, compares, and writes those hashes
  broken  streams damaged behind right checksums: both must refuse them, or give the same samples (hardly one can still
          be decoded: a stream has to end in the coder's first state)
"""

import gzip
import hashlib
import json
import math
import os
import pathlib
import random
import struct
import subprocess
import sys
import tempfile

import decoder
from second_decoder.coding import Broken

LIMITS = {"uint8": (0, 255), "int8": (-128, 127), "uint16": (0, 65535), "int16": (-32768, 32767),
          "uint32": (0, (1 << 32) - 1), "int32": (-(1 << 31), (1 << 31) - 1)}
FLOATS = {"float32": ("<f", 4), "float64": ("<d", 8)}

# type, what is in the volume, dims, options
MADE = [
    ("int16", "phantom", (20, 17, 19), ["--cube=8"]),
    ("int16", "phantom", (20, 17, 19), ["--cube=8", "--lead=0"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--max-error=5"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--max-error=5", "--lead=0"]),
    ("uint8", "phantom", (17, 2, 9), ["--cube=8", "--brick=1", "--grid-only", "--lead=0"]),
    ("int16", "phantom", (20, 17, 19), ["--cube=8", "--psnr=40"]),
    ("uint8", "phantom", (21, 12, 3), ["--cube=8", "--brick=2", "--psnr=35", "--max-error=10"]),
    ("int8", "phantom", (9, 30, 17), ["--cube=8", "--psnr=38", "--lead=0", "--grid=derived"]),
    ("uint16", "phantom", (33, 12, 9), ["--cube=32", "--psnr=30"]),
    ("int16", "phantom", (16, 8, 9), ["--cube=8", "--brick=1"]),
    ("int16", "phantom", (20, 17, 19), ["--cube=8", "--max-error=40", "--surface-error=3"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--max-error=4", "--mesh-error=60"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8", "--grid-only", "--mesh-error=60"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--grid-only", "--max-error=30"]),
    ("int16", "noise", (12, 9, 11), ["--cube=4", "--max-error=1000"]),
    ("int16", "constant", (20, 17, 19), ["--cube=8"]),
    ("uint8", "phantom", (14, 15, 13), ["--cube=8", "--grid-only"]),
    ("uint8", "noise", (9, 10, 11), ["--cube=8"]),
    ("uint8", "noise", (9, 10, 11), ["--cube=4", "--grid-only", "--max-error=3"]),
    ("uint8", "blocks", (130, 5, 2), ["--cube=32"]),  # rows of several segments
    ("uint8", "constant", (20, 17, 19), ["--cube=8", "--grid-only", "--max-error=2"]),
    ("int8", "phantom", (1, 30, 17), ["--cube=8", "--max-error=1"]),
    ("uint16", "noise", (5, 6, 7), ["--cube=16"]),
    ("uint16", "blocks", (20, 17, 1), ["--cube=4", "--max-error=99999"]),
    ("uint16", "phantom", (14, 15, 13), ["--cube=16", "--max-error=2"]),
    ("uint8", "sparse", (40, 10, 6), ["--cube=32"]),  # many flat neighbourhoods
    ("int8", "noise", (1, 1, 1), []),
    ("uint8", "phantom", (14, 15, 13), ["--cube=8", "--effort=fast"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--effort=fast", "--max-error=40", "--surface-error=3"]),
    ("uint8", "phantom", (14, 15, 13), ["--cube=8", "--effort=best"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--effort=best", "--max-error=5"]),
    ("uint16", "phantom", (14, 15, 13), ["--cube=8", "--effort=best", "--max-error=40", "--surface-error=1"]),
    ("int16", "noise", (12, 9, 11), ["--cube=4", "--effort=best", "--max-error=1"]),
    ("uint16", "noise", (12, 9, 11), ["--cube=16", "--effort=best"]),
    ("uint8", "blocks", (66, 5, 3), ["--cube=32", "--effort=best"]),
    ("int8", "sparse", (40, 10, 6), ["--cube=32", "--effort=best"]),
    ("uint16", "blocks", (20, 17, 1), ["--cube=4", "--effort=best"]),
    ("int32", "phantom", (9, 8, 7), ["--cube=8", "--effort=best"]),
    ("uint8", "phantom", (9, 8, 7), ["--cube=8", "--effort=best", "--grid-only"]),
    ("uint32", "phantom", (14, 15, 13), ["--cube=8"]),
    ("int32", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--max-error=5"]),
    ("int32", "phantom", (14, 15, 13), ["--cube=8", "--max-error=40", "--surface-error=3"]),
    ("int32", "noise", (9, 10, 11), ["--cube=8"]),
    ("uint32", "noise", (9, 10, 11), ["--cube=4", "--grid-only", "--max-error=1000000"]),
    ("int32", "phantom", (14, 15, 13), ["--cube=8", "--grid-only"]),
    ("uint32", "blocks", (20, 17, 9), ["--cube=8", "--max-error=3000000000"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8", "--max-error=2.5"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8", "--max-error=40", "--surface-error=0"]),
    ("float64", "phantom", (14, 15, 13), ["--cube=8", "--max-error=40", "--surface-error=0.01"]),
    ("float64", "phantom", (14, 15, 13), ["--cube=8", "--brick=1"]),
    ("float64", "phantom", (14, 15, 13), ["--cube=8", "--grid-only", "--max-error=20"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8", "--grid-only"]),
    ("float32", "odd", (13, 9, 8), ["--cube=4"]),
    ("float64", "odd", (13, 9, 8), ["--cube=4", "--max-error=0.5"]),
    ("float32", "odd", (13, 9, 8), ["--cube=4", "--grid-only", "--max-error=0.25"]),
    ("float64", "odd", (13, 9, 8), ["--cube=8", "--grid-only"]),
    ("float32", "whole", (13, 9, 8), ["--cube=8"]),
    ("float64", "bits", (7, 8, 9), ["--cube=4"]),
    ("float32", "bits", (7, 8, 9), ["--cube=4", "--grid-only", "--max-error=1e30"]),
    ("float32", "constant", (9, 9, 9), ["--cube=4", "--max-error=1"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8", "--effort=best", "--max-error=1"]),
    ("int32", "phantom", (14, 15, 13), ["--cube=8", "--effort=fast"]),
    ("float64", "odd", (13, 9, 8), ["--cube=4", "--max-error=90", "--surface-error=70"]),
    ("int16", "noise", (12, 9, 11), ["--cube=16", "--effort=fast"]),
    ("uint8", "phantom", (66, 18, 3), ["--cube=32", "--max-error=1"]),  # two groups of rows, long rows
    ("int16", "phantom", (20, 17, 9), ["--cube=8", "--accuracy=7", "--max-error=2"]),
    ("int16", "phantom", (20, 17, 9), ["--cube=8", "--max-level=7"]),
    ("float32", "phantom", (12, 17, 9), ["--cube=8", "--accuracy=100", "--field-scale=0.01", "--max-error=1"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--grid=derived", "--max-error=2"]),
    ("float32", "phantom", (9, 15, 13), ["--cube=8", "--brick=1", "--grid=derived", "--effort=fast"]),
    ("uint8", "phantom", (66, 6, 3), ["--cube=64"]),  # more than a word of points in a row
    ("uint16", "scaled", (14, 15, 13), ["--cube=8"]),
    ("int8", "scaled", (14, 15, 13), ["--cube=8", "--effort=best"]),
    ("uint16", "scaled", (14, 15, 13), ["--cube=8", "--max-error=500", "--surface-error=300"]),
    ("int32", "scaled", (14, 15, 13), ["--cube=8", "--effort=fast"]),
    ("uint16", "table", (14, 15, 13), ["--cube=8"]),
    ("int32", "table", (14, 15, 13), ["--cube=8", "--max-error=40", "--surface-error=1"]),
    ("uint32", "table", (14, 15, 13), ["--cube=8", "--effort=best", "--max-error=3"]),
    ("float32", "scaled", (14, 15, 13), ["--cube=8"]),
    ("float64", "scaled", (14, 15, 13), ["--cube=8", "--effort=best"]),
    ("float32", "table", (14, 15, 13), ["--cube=8", "--brick=1", "--grid=derived"]),
    ("uint8", "labels", (70, 9, 11), ["--cube=32"]),
    ("uint16", "labels", (34, 17, 13), ["--cube=16"]),
    ("uint32", "labels", (70, 9, 6), ["--cube=32", "--effort=best"]),
    ("float32", "labels", (34, 17, 3), ["--cube=16", "--max-error=0.5", "--surface-error=0"]),
    ("uint8", "phantom", (20, 17, 19), ["--cube=8", "--max-error=9", "--threshold=60"]),
    ("int16", "phantom", (20, 17, 19), ["--cube=8", "--psnr=30", "--threshold=-500,-20,0,300"]),
    ("int16", "phantom", (14, 15, 13), ["--cube=8", "--brick=1", "--max-error=90", "--surface-error=30", "--threshold=200"]),
    ("uint16", "phantom", (14, 15, 13), ["--cube=8", "--effort=best", "--ratio=6", "--threshold=1000"]),
    ("int32", "phantom", (14, 15, 13), ["--cube=8", "--max-error=400", "--threshold=-1000,100"]),
    ("float32", "phantom", (14, 15, 13), ["--cube=8", "--max-error=60.5", "--threshold=0,0.1,250"]),
    ("float64", "odd", (13, 9, 8), ["--cube=4", "--max-error=90", "--threshold=0,10"]),
    ("int8", "noise", (12, 9, 11), ["--cube=4", "--max-error=100", "--threshold=-100,-99,-1,0,1,127"]),
]


class Comparison:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)
        self.compared = self.refused = 0

    def run(self, *arguments):
        return subprocess.run([self.program, *map(str, arguments)], capture_output=True, check=False)

    def encode(self, sample_type, kind, dims, options):
        raw, tag = self.folder / "volume.raw", self.folder / "volume.tag"
        shape = ["--dims", ",".join(map(str, dims)), "--type", sample_type]
        if kind == "phantom":
            made = self.run("phantom", *shape, "-q", "-f", "-o", raw)
            assert made.returncode == 0, made.stderr
        else:
            raw.write_bytes(volume(sample_type, kind, dims))
        encoded = self.run("encode", raw, *shape, *options, "-q", "-f", "-o", tag)
        assert encoded.returncode == 0, encoded.stderr
        return tag.read_bytes()

    def decode(self, data):
        """Runs `tagrid decode` on a file with these bytes."""
        tag = self.folder / "compared.tag"
        tag.write_bytes(data)
        raw = self.folder / "decoded.raw"
        raw.unlink(missing_ok=True)
        volumes = struct.unpack_from("<I", data, 112)[0] if len(data) >= 116 else 1
        if not 1 < volumes <= 10000:
            return self.run("decode", tag, "-q", "-f", "-o", raw)
        samples = b""
        for number in range(volumes):
            status = self.run("decode", tag, "--volume", number, "-q", "-f", "-o", raw)
            if status.returncode != 0:
                return status
            samples += raw.read_bytes()
        raw.write_bytes(samples)
        return status

    def decoded(self):
        """The samples that the last run of decode() wrote."""
        return (self.folder / "decoded.raw").read_bytes()

    def compare(self, data, what, with_grid=True):
        """Checks that both decoders give the same samples, or both refuse. Returns whether they gave samples."""
        status = self.decode(data)
        assert status.returncode in (0, 65), (what, status.stderr)
        theirs = self.decoded() if status.returncode == 0 else None
        try:
            ours = decoder.decode(data, with_grid)
        except Broken:
            ours = None
        assert ours == theirs, f"{what}: the decoders differ; the program says {status.stderr or 'ok'}"
        self.compared += 1
        self.refused += ours is None
        return ours is not None

    def compare_activity(self, data, what):
        """Checks that a file whose activity decoder.py refuses is not good for the program either."""
        try:
            decoder.decode(data, True)
        except Broken:
            tag = self.folder / "compared.tag"
            tag.write_bytes(data)
            status = self.run("verify", tag, "-q")
            assert status.returncode == 65, (what, status.stderr)
            self.refused += 1
        self.compared += 1


def float_volume(sample_type, kind, dims):
    """odd: smooth, with holes that are not finite and zeros of both signs; whole: whole numbers; bits: any."""
    code, size = FLOATS[sample_type]
    chance = random.Random(7)
    out = bytearray()
    for z in range(dims[2]):
        for y in range(dims[1]):
            for x in range(dims[0]):
                value = 3 * math.sin(0.5 * x + 0.3 * y) + 0.2 * z
                if kind == "odd" and (x // 3 + y // 2 + z // 3) % 4 == 1:
                    value = chance.choice((math.nan, math.inf, -math.inf, -0.0, 0.0))
                if kind == "whole":
                    value = float(chance.randint(-20, 20) + 5 * x)
                if kind == "constant":
                    value = 0.1
                out += chance.randbytes(size) if kind == "bits" else struct.pack(code, value)
    return bytes(out)


FEW = ("scaled", "table", "labels")


def few_values(sample_type, kind, dims):
    """Samples of a few values: integers times a number, any values in order, or labels."""
    chance = random.Random(7)
    regions = [[chance.randrange(dims[a]) for a in range(3)] for _ in range(6)]
    levels = []
    for z in range(dims[2]):
        for y in range(dims[1]):
            for x in range(dims[0]):
                far = [sum((a - b) ** 2 for a, b in zip(c, (x, y, z))) for c in regions]
                levels.append(far.index(min(far)) if kind == "labels" else 9 + x + z // 2 + chance.randrange(4))
    if sample_type in FLOATS:
        values = [n * 0.1 - 0.5 if kind == "scaled" else chance.uniform(-9, 9) for n in range(64)]
        if kind == "labels":
            values[0] = math.nan
    else:
        low, high = LIMITS[sample_type]
        step = (high - low) // 63
        values = [low + n * step if kind == "scaled" else chance.randint(low, high) for n in range(64)]
    if kind == "table":
        values.sort()
    layout = FLOATS[sample_type][0] if sample_type in FLOATS else {1: "b", 2: "<h", 4: "<i"}[
        (high - low).bit_length() // 8]
    if sample_type.startswith("u"):
        layout = layout.upper()
    return b"".join(struct.pack(layout, values[n]) for n in levels)


def volume(sample_type, kind, dims):
    if kind in FEW:
        return few_values(sample_type, kind, dims)
    if sample_type in FLOATS:
        return float_volume(sample_type, kind, dims)
    low, high = LIMITS[sample_type]
    size = (high - low).bit_length() // 8
    chance = random.Random(7)
    samples = []
    for z in range(dims[2]):
        for y in range(dims[1]):
            for x in range(dims[0]):
                if kind == "noise":
                    samples.append(chance.randint(low, high))
                elif kind == "blocks":
                    samples.append(high if (x // 7 + y // 3 + z // 2) % 3 == 0 else low + 1)
                elif kind == "sparse" and chance.random() < 0.02:
                    samples.append(chance.randint(low, high))
                else:
                    samples.append(low + 3)
    return b"".join(v.to_bytes(size, "little", signed=low < 0) for v in samples)


def with_right_checksums(data):
    """A file with changed bricks and right checksums."""
    header = decoder.Header(data)
    out, at, last = bytearray(data[:header.size]), header.size, header.checksum
    for number in range(math.prod(header.bricks)):
        length = struct.unpack_from("<I", data, at)[0]
        brick = data[at:at + 4 + length]
        last = decoder.chained(struct.pack("<Q", number) + brick, last)
        out += brick + struct.pack("<Q", last)
        at += 12 + length
    # The blocks of the only page and of the envelope, and the directory.
    while at < len(data) - 24:
        marker, _, packed_size = struct.unpack_from("<III", data, at)
        end = at + 12 + packed_size if marker else len(data) - 32
        last = decoder.chained(data[at:end], last)
        out += data[at:end] + struct.pack("<Q", last)
        at = end + 8
    return bytes(out + data[-24:])


def compressed(comparison, *options):
    """An encoding of a file whose samples are compressed: the envelope has its plain form."""
    source, tag = comparison.folder / "volume.nrrd", comparison.folder / "volume.tag"
    head = b"NRRD0004\ntype: int16\ndimension: 3\nsizes: 9 8 7\nendian: big\nencoding: gzip\n\n"
    source.write_bytes(head + gzip.compress(volume("int16", "noise", (9, 8, 7))))
    encoded = comparison.run("encode", source, *options, "-q", "-f", "-o", tag)
    assert encoded.returncode == 0, encoded.stderr
    return tag.read_bytes()


def bottom_up(comparison):
    """An encoding of a bitmap, whose rows are filled up and lie from the lower one to the upper one."""
    source, tag = comparison.folder / "volume.bmp", comparison.folder / "volume.tag"
    rows = b"".join(bytes((x * y) % 251 for x in range(9)) + b"\1\2\3" for y in range(8))
    palette = b"".join(bytes([grey, grey, grey, 0]) for grey in range(256))
    source.write_bytes(struct.pack("<2sIII IiiHHIIiiII", b"BM", 54 + 1024 + len(rows), 0, 54 + 1024, 40, 9, 8, 1, 8, 0, len(rows), 0, 0, 256, 0) + palette + rows)
    encoded = comparison.run("encode", source, "-q", "-f", "-o", tag)
    assert encoded.returncode == 0, encoded.stderr
    return tag.read_bytes()


def several_volumes(comparison):
    """A NIfTI file of three volumes."""
    source, tag = comparison.folder / "volumes.nii", comparison.folder / "volumes.tag"
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 4, 9, 7, 5, 3, 1, 1, 1)
    struct.pack_into("<hh", header, 70, 4, 16)
    struct.pack_into("<f", header, 108, 352)
    header[344:348] = b"n+1\0"
    source.write_bytes(header + volume("int16", "noise", (9, 7, 15)))
    encoded = comparison.run("encode", source, "--cube=4", "--max-error=9", "--overviews=4", "-q", "-f", "-o", tag)
    assert encoded.returncode == 0, encoded.stderr
    return tag.read_bytes()


def test_made(comparison):
    # The golden files have every form; TAGRID_LONG=1 makes all of these, too.
    for case in MADE if "TAGRID_LONG" in os.environ else MADE[::2]:
        assert comparison.compare(comparison.encode(*case), case), (case, "is refused")
    for options in ([], ["--max-error=9"]):
        data = compressed(comparison, *options)
        assert comparison.compare(data, ("compressed", options)), (options, "is refused")
        assert decoder.compression_in(data) == b"gzip", options
    data = several_volumes(comparison)
    assert comparison.compare(data, "several volumes") and len(decoder.volumes_of(data)) == 2
    data = bottom_up(comparison)
    assert comparison.compare(data, "bottom up") and decoder.compression_in(data) == b""


GOLDEN = pathlib.Path(__file__).parents[1] / "golden" / "1.0"
RECORDS = GOLDEN / "second_decoder.json"


def sha256(*parts):
    return hashlib.sha256(b"".join(parts)).hexdigest()


def sources_of_decoder():
    folder = pathlib.Path(__file__).parent
    files = [folder / "decoder.py", *sorted((folder / "second_decoder").glob("*.py"))]
    return sha256(*(path.name.encode() + b"\n" + path.read_bytes() for path in files))


def golden_files():
    files = sorted(GOLDEN.glob("*.tag"))
    assert files, f"no golden files in {GOLDEN}"
    return files


def record_golden(comparison):
    samples = {}
    for path in golden_files():
        data = path.read_bytes()
        assert comparison.compare(data, path.name), (path.name, "is refused")
        samples[path.name] = {"file": sha256(data), "samples": sha256(comparison.decoded())}
    RECORDS.write_text(json.dumps({"decoder": sources_of_decoder(), "files": samples}, indent=1) + "\n")


def test_golden(comparison):
    records = json.loads(RECORDS.read_text())
    again = "changed since its samples were recorded: run `python3 tests/format/decoder_test.py build/release/tagrid record`"
    assert records["decoder"] == sources_of_decoder(), f"decoder.py {again}"
    for path in golden_files():
        data = path.read_bytes()
        record = records["files"].get(path.name, {})
        assert record.get("file") == sha256(data), f"{path.name} {again}"
        comparison.decode(data)
        assert sha256(comparison.decoded()) == record["samples"], f"{path.name}: the decoders differ"
        comparison.compared += 1


def test_broken(comparison):
    chance = random.Random(1)
    for case in (("uint8", "phantom", (10, 9, 11), ["--cube=8"]),
                 ("int16", "phantom", (10, 9, 11), ["--cube=4", "--max-error=9", "--surface-error=1"]),
                 ("int16", "noise", (6, 9, 5), ["--cube=4", "--grid-only"]),
                 ("int16", "phantom", (10, 9, 11), ["--effort=best"]),
                 ("int32", "phantom", (10, 9, 11), ["--cube=8"]),
                 ("float32", "odd", (10, 9, 11), ["--cube=4", "--max-error=1", "--surface-error=0"]),
                 ("float64", "odd", (6, 9, 5), ["--cube=4", "--grid-only", "--max-error=1"])):
        whole = comparison.encode(*case)
        first = decoder.Header(whole).size
        length, activity_size = struct.unpack_from("<II", whole, first)
        # The program ignores the activity if samples do not depend on it.
        start = first + 8 + (activity_size if len(case[3]) == 1 else 0)
        for i in range(10):
            data = bytearray(whole)
            # Damage late in a stream is found late.
            end = first + 4 + length
            data[chance.randrange(max(start, end - 6) if i % 2 else start, end)] ^= 1 << chance.randrange(8)
            comparison.compare(with_right_checksums(bytes(data)), case, with_grid=False)
        if activity_size > 8:
            # Of activity, too, and whatever it is coded with: `verify` looks at it.
            data = bytearray(whole)
            data[first + 8 + chance.randrange(activity_size)] ^= 1 << chance.randrange(8)
            comparison.compare_activity(with_right_checksums(bytes(data)), case)
        for _ in range(4):
            data = bytearray(whole)
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
            assert not comparison.compare(bytes(data), case), (case, "damage was not found")
        assert not comparison.compare(whole[:-1], case) and not comparison.compare(whole + b"\0", case)
    assert not comparison.compare(integers_that_escape(comparison), "integers that escape")


def integers_that_escape(comparison):
    """A grid of integers with `escapes`: it is the highest of the lowest 16 bits of the coder's first state, and no other event
    depends on it."""
    data = bytearray(comparison.encode("int32", "phantom", (6, 9, 5), ["--cube=4", "--grid-only"]))
    first = decoder.Header(data).size
    _, activity_size = struct.unpack_from("<II", data, first)
    data[first + 8 + activity_size + 1] ^= 0x80
    return with_right_checksums(bytes(data))


def main():
    program, what = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        comparison = Comparison(program, folder)
        {"made": test_made, "golden": test_golden, "broken": test_broken, "record": record_golden}[what](comparison)
    print(f"{comparison.compared} files, both decoders agree; both refuse {comparison.refused}")


if __name__ == "__main__":
    main()
