"""Limits on the memory of programs that read and write formats: they keep to -M, and what messages advise helps."""

import json
import os
import re
import unittest

from other_readers import Image, ReaderTest, main, numpy, tifffile, unless_sanitized

# A reader that takes 200 MiB before it describes a volume of 4 x 3 x 5 samples in the file itself. A file that begins with
# "says" makes it say that it lacks memory; otherwise it dies of that.
READER = """#!/usr/bin/python3
import json, sys
print(json.dumps({"tagrid-reader": 1, "name": "greedy", "version": "1"}), flush=True)
for request in map(json.loads, sys.stdin):
    try:
        much = bytearray(200 << 20)
        answer = {"answer": "volume", "dims": [4, 3, 5], "type": "uint8", "places": [{"offset": 4, "slices": 5}]}
    except MemoryError:
        if not open(request["path"], "rb").read().startswith(b"says"):
            raise
        answer = {"answer": "error", "kind": "world", "option": "memory", "message": request["path"] + ": is too much for its reader"}
    print(json.dumps(answer), flush=True)
"""

# A writer that takes as much before it says how much it needs.
WRITER = """#!/usr/bin/python3
import json, sys
print(json.dumps({"tagrid-writer": 1, "name": "greedy", "version": "1"}), flush=True)
json.loads(sys.stdin.readline())
much = bytearray(200 << 20)
print(json.dumps({"answer": "ready", "memory": 50 << 20}), flush=True)
for request in map(json.loads, iter(sys.stdin.buffer.readline, b"")):
    if request["request"] == "slices":
        sys.stdin.buffer.read(12 * (request["to"] - request["from"]))
    else:
        print(json.dumps({"answer": "done"}), flush=True)
"""


# A reader that gives 70 slices of 512 x 256 samples, and writes down which ones.
COUNTING_READER = """#!/usr/bin/python3
import json, sys
out = sys.stdout.buffer
def say(answer):
    out.write(json.dumps(answer).encode() + b"\\n")
    out.flush()
say({"tagrid-reader": 1, "name": "counting", "version": "1"})
for request in map(json.loads, sys.stdin):
    if request["request"] == "describe":
        path = request["path"] + ".log"
        say({"answer": "volume", "dims": [512, 256, 70], "type": "uint8", "memory": 20 << 20})
        continue
    for z in range(request["from"], request["to"]):
        with open(path, "a") as file:
            file.write(f"{z}\\n")
        say({"answer": "slices", "from": z, "to": z + 1})
        out.write(bytes(z + y // 4 & 255 for y in range(256) for x in range(512)))
        out.flush()
"""


class Memory(ReaderTest):
    def setUp(self):
        super().setUp()
        for name, text in (("tagrid-read-greedy", READER), ("tagrid-write-greedy", WRITER), ("tagrid-read-counting", COUNTING_READER)):
            (self.folder / name).write_text(text)
            (self.folder / name).chmod(0o755)
        os.environ["TAGRID_READER_PATH"] = str(self.folder)
        self.addCleanup(os.environ.pop, "TAGRID_READER_PATH")

    def assert_advice_helps(self, message, *arguments):
        """The limit that a message advises is enough."""
        advised = re.findall(r"-M (\d+M)", message)[-1]
        self.ok(*arguments, "-M", advised)

    @unless_sanitized
    def test_a_reader_keeps_to_the_limit_while_it_describes(self):
        limit = "64 MiB"
        for begin, code, said in (("dies", 74, f"MemoryError; it may have exceeded its limit of {limit}"),
                                  ("says", 64, f"scan.greedy: is too much for its reader ({limit})")):
            (self.folder / "scan.greedy").write_bytes(begin.encode() + bytes(60))
            for command in (["encode", "scan.greedy", "-o", "a.tag", "-f"], ["estimate", "scan.greedy"]):
                run = self.tagrid(*command, "-M", "64M")
                self.assertEqual(run.returncode, code, run.stderr)
                self.assertIn(said + "; a larger -M raises its limit, up to -M 1036M\n", run.stderr)
                self.ok(*command, "-M", "512M")
                self.ok(*command)
                self.assert_advice_helps(run.stderr, *command)
            verify = ["verify", "a.tag", "--against", "scan.greedy"]
            self.assertEqual(self.tagrid(*verify, "-M", "64M").returncode, code)
            self.ok(*verify, "-M", "512M")

    @unless_sanitized
    def test_volumes_of_a_list_keep_to_the_limit(self):
        (self.folder / "scan.greedy").write_bytes(b"says" + bytes(60))
        (self.folder / "list").write_text("scan.greedy\n")
        for limit, code in (("64M", 65), ("512M", 0)):
            run = self.tagrid("convert", "--manifest", "list", "--output-dir", "out", "-M", limit)
            self.assertEqual(run.returncode, code, run.stderr)
            self.assertEqual("is too much for its reader (64 MiB); a larger -M" in run.stderr, limit == "64M", run.stderr)

    @unless_sanitized
    def test_a_writer_keeps_to_the_limit_before_it_says_what_it_needs(self):
        (self.folder / "a.raw").write_bytes(bytes(60))
        self.tagrid("encode", "a.raw", "--dims", "4,3,5", "--type", "uint8")
        decode = ["decode", "a.tag", "-o", "b.greedy", "-f"]
        run = self.tagrid(*decode, "-M", "100M")
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertIn("it may have exceeded its limit of 88 MiB; a larger -M", run.stderr)
        self.assertFalse((self.folder / "b.greedy").exists())
        self.ok(*decode, "-M", "512M")
        self.assert_advice_helps(run.stderr, *decode)

    @unless_sanitized
    def test_slices_are_kept_for_the_parts_of_a_run_as_far_as_the_limit_allows(self):
        def encoded(*options):
            (self.folder / "a.counting").write_text("x")
            (self.folder / "a.counting.log").write_text("")
            self.ok("encode", "a.counting", "-o", "a.tag", "-f", "-T", "1", "--strip", "--json", "run.json", *options)
            peak = json.loads((self.folder / "run.json").read_text())["peak_memory"]
            return len((self.folder / "a.counting.log").read_text().split()), peak, (self.folder / "a.tag").read_bytes()

        at_once, _, tag = encoded()
        self.assertEqual(at_once, 70)
        times, _, in_parts = encoded("--resume")
        self.assertEqual(in_parts, tag)
        self.assertLess(times, 2 * 70)  # and not for each of 8 parts
        refusal = self.tagrid("encode", "a.counting", "-o", "a.tag", "-f", "-T", "1", "--strip", "--resume", "-M", "1M")
        smallest = int(re.findall(r"-M (\d+)M", refusal.stderr)[-1])
        for limit, most in ((smallest, 8 * 70 + 20), (smallest + 8, 8 * 70)):
            times, peak, in_parts = encoded("--resume", "-M", f"{limit}M")
            self.assertEqual(in_parts, tag)
            self.assertLess(peak, limit << 20)
            self.assertTrue(2 * 70 < times < most, (limit, times))

    def small_volumes(self):
        """Files of 10 x 20 x 30 samples in the formats that programs read."""
        samples = numpy.arange(6000, dtype="u2").reshape(10, 20, 30) % 255
        samples.tofile(self.folder / "v.raw")
        for name in ("v.h5", "v.vdb", "v.tif", "v.vtkhdf"):
            self.tagrid("encode", "v.raw", "--dims", "30,20,10", "--type", "uint16", "-o", "v.tag", "-f")
            run = self.tagrid("decode", "v.tag", "-o", name)
            if run.returncode == 0:
                yield name
            else:
                self.assertIn("not installed", run.stderr)
        if tifffile is not None:
            tifffile.imwrite(self.folder / "deflate.tif", samples, photometric="minisblack", compression="zlib")
            yield "deflate.tif"
        if Image is not None:
            for name, extension in (("bmps", "bmp"), ("jp2s", "jp2"), ("pngs", "png")):
                (self.folder / name).mkdir()
                for z, slice in enumerate(samples.astype("u1")):
                    Image.fromarray(slice).save(self.folder / name / f"s{z}.{extension}")
                yield name

    @unittest.skipIf(numpy is None, "there is no numpy on this machine (python3-numpy)")
    @unless_sanitized
    def test_small_volumes_of_every_format_are_read_with_a_small_limit(self):
        for name in self.small_volumes():
            with self.subTest(name):
                encode = ["encode", name, "-o", "out.tag", "-f"]
                run = self.tagrid(*encode, "-M", "64M")
                if run.returncode != 0:  # a reader that stays says how much it takes
                    self.assertEqual(run.returncode, 64, run.stderr)
                    self.assertLess(int(re.findall(r"give -M (\d+)M", run.stderr)[0]), 256)
                    self.assert_advice_helps(run.stderr, *encode)


if __name__ == "__main__":
    main()
