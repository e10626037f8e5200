"""An installed wheel of tagrid-reader reads the golden files, on whatever system this runs:

    python wheel_reads_golden.py
        fails if the samples of a file are not those that the second decoder found.
"""

import hashlib
import json
import pathlib
import sys

import numpy
import tagrid_reader

GOLDEN = pathlib.Path(__file__).resolve().parents[1] / "golden/1.0"
files = json.loads((GOLDEN / "second_decoder.json").read_text())["files"]
wrong = []
for name, expected in sorted(files.items()):
    found = hashlib.sha256()
    with tagrid_reader.open(GOLDEN / name) as scan:
        for i in range(scan.volumes):
            samples = numpy.ascontiguousarray(scan.volume(i)[...])
            found.update(samples.astype(samples.dtype.newbyteorder("<")).tobytes())
    if found.hexdigest() != expected["samples"]:
        wrong.append(name)
print(f"{sys.platform}: {len(files) - len(wrong)} of {len(files)} files as expected", *wrong)
sys.exit(1 if wrong or len(files) < 30 else 0)
