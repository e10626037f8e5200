#!/usr/bin/env python3
"""python3 tests/format/example_test.py TAGRID [rewrite]

The examples and test vectors in docs/dev/format.md are what a file says: the parts between "made by example_test.py" and "end"
are made here from tests/golden/1.0/example_int16.tag and the other golden files, by the second decoder. Fails if the document
says something else, or if the file is no longer what TAGRID writes. `rewrite` writes the file and these parts anew.

The functions of the second decoder are watched while they return; their local variables have the names that the document uses.
"""

import ctypes
import ctypes.util
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

import decoder
from second_decoder import transform_tables
from second_decoder.forecast import SHARES, Criterion, f32
from second_decoder.grid import add, along, base_edge, new_bit
from second_decoder.xxh3 import xxh3

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs" / "dev" / "format.md"
GOLDEN = ROOT / "tests" / "golden" / "1.0"
EXAMPLE = GOLDEN / "example_int16.tag"
DIMS = (8, 6, 2)
OPTIONS = ["--cube=4", "--max-error=2"]
FORMULA = "1000 + 9·x + 6·y + 4·z + (3·x·x + 7·x·y + 11·z) mod 6, and 700 more where x >= 3 and y <= 2"
MARK = re.compile(r"(<!-- made by example_test\.py: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def sample(x, y, z):
    return 1000 + 9 * x + 6 * y + 4 * z + (3 * x * x + 7 * x * y + 11 * z) % 6 + (700 if x >= 3 and y <= 2 else 0)


def volume():
    return [sample(x, y, z) for z in range(DIMS[2]) for y in range(DIMS[1]) for x in range(DIMS[0])]


def encode(program):
    """The file that the program makes of the example."""
    with tempfile.TemporaryDirectory() as folder:
        raw, tag = pathlib.Path(folder) / "example.raw", pathlib.Path(folder) / "example.tag"
        raw.write_bytes(struct.pack(f"<{len(volume())}h", *volume()))
        shape = ["--dims", ",".join(map(str, DIMS)), "--type", "int16"]
        subprocess.run([program, "encode", raw, *shape, *OPTIONS, "-q", "-o", tag], check=True)
        return tag.read_bytes()


class Watch:
    """What functions of the second decoder return, and their local variables then: by name, in the order of the returns."""

    def __init__(self, *names):
        self.names, self.returns = names, []

    def __enter__(self):
        sys.setprofile(self.see)
        return self

    def __exit__(self, *_):
        sys.setprofile(None)

    def see(self, frame, event, result):
        name = frame.f_code.co_name
        if event == "return" and name in self.names and "second_decoder" in frame.f_code.co_filename:
            kept = dict(frame.f_locals, returned=result)
            if name in ("decode", "raw") and "self" in kept:
                kept["state"] = kept["self"].state
            self.returns.append((name, kept))

    def of(self, name):
        return [kept for of_name, kept in self.returns if of_name == name]


def hexes(data):
    return data.hex(" ").upper()


def hex64(v):
    return f"{v:016X}"


def hex32(v):
    """The bits of a binary32, and the number."""
    return f"{bits_of(v)}  {v:.9g}"


def dump(offset, data, what):
    """Lines of a dump: where, the bytes, what they are."""
    lines = [data[i:i + 16] for i in range(0, len(data), 16)] or [b""]
    return [f"{offset + 16 * i:4}  {hexes(line):47}  {what if i == 0 else ''}".rstrip() for i, line in enumerate(lines)]


def header_rows(document):
    """Offset, size, type and name of each field, as the table of section 3.1 says."""
    section = document[document.index("### 3.1 "):document.index("### 3.2 ")]
    return [tuple(cell.strip() for cell in row) for row in
            re.findall(r"^\| ([0-9+P]+) \| ([0-9P]+) \| (\w+) \| ([^|\n]+) \|", section, re.MULTILINE)]


def describe_header(data, document):
    lines, packed, next_offset = [], 0, 0
    for offset, size, kind, name in header_rows(document):
        at, bytes_of = (sum(packed if part == "P" else int(part) for part in text.split("+"))
                        for text in (offset, size))
        assert at == next_offset, f"the table of the header leaves a gap before {name}"
        next_offset = at + bytes_of
        field = data[at:next_offset]
        if name.startswith("P,"):
            packed = int.from_bytes(field, "little")
        value = struct.unpack("<d", field)[0] if kind == "f64" else int.from_bytes(field, "little")
        shown = "" if kind == "bytes" or "checksum" in name else f" = {value:g}" if kind == "f64" else f" = {value}"
        lines += dump(at, field, name.split(",")[0].replace("`", "").replace("the source's", "source's") + shown)
    return lines, next_offset


def one_brick(data, start):
    length, activity = struct.unpack_from("<II", data, start)
    values = start + 8 + activity
    end = start + 4 + length
    kind = data[values]
    assert kind in (1, 2, 4, 5), f"the example's brick has values of the kind {kind}: change its volume, so that lanes code it"
    return activity, values, end, kind


def describe_brick(data, start):
    activity, values, end, kind = one_brick(data, start)
    lines = dump(start, data[start:start + 4], f"L = {end - start - 4}")
    lines += dump(start + 4, data[start + 4:start + 8], f"A = {activity}")
    lines += dump(start + 8, data[start + 8:values], "activity, without what the values carry")
    lines += dump(values, data[values:values + 1], f"values: kind {kind}")
    at = values + 1
    for what in ("parameters and quiet rows", "extra bits"):
        size = data[at]
        assert size < 128
        lines += dump(at, data[at:at + 1], f"a number of bytes, {size}")
        lines += dump(at + 1, data[at + 1:at + 1 + size], what) if size else []
        at += 1 + size
    states = 4 if kind in (1, 4) else 128
    lines += dump(at, data[at:at + states], "state" if states == 4 else "states")
    lines += dump(at + states, data[at + states:end], "words")
    return lines + dump(end, data[end:end + 8], "checksum"), end + 8


def describe_checksum(data, start, before, number):
    _, _, end, _ = one_brick(data, start)
    own = xxh3(struct.pack("<Q", number) + data[start:end])
    chained = xxh3(struct.pack("<Q", own), before)
    assert struct.pack("<Q", chained) == data[end:end + 8]
    return [f"before = {hex64(before)}                        # of the header, as a number",
            f"own    = XXH3(00 00 00 00 00 00 00 00, then bytes {start} .. {end - 1}, seed 0) = {hex64(own)}",
            f"result = XXH3({hexes(struct.pack('<Q', own))}, seed before) = {hex64(chained)}"]


def describe_parameters(watch):
    """The first events of the stream of parameters, and what comes out."""
    made = watch.of("read_parameters")[0]
    low, high, reference, (first, others) = made["returned"]
    lines = ["event            interval       result  state after"]
    events = [(name, kept) for name, kept in watch.returns if name in ("decode", "raw")
              and kept["self"] is made["coder"]]
    for name, kept in events[:10]:
        if name == "raw":
            value, shift = kept["value"], 16 - kept["n"]
            lines.append(f"raw({kept['n']:2})        {value << shift:5} + {1 << shift:5}  {value:6}  {kept['state']:012X}")
        else:
            p, bit = kept["p"], kept["returned"]
            lines.append(f"decode({p:5})    {0 if bit else p:5} + {p if bit else 65536 - p:5}  {bit:6}  {kept['state']:012X}")
    lines += ["...", f"low = {low}, high = {high}, reference = {reference}",
              f"first_weight[0 .. 7]  = {', '.join(map(str, first[:8]))}",
              f"other_weight[0 .. 17] = {', '.join(map(str, others))}"]
    quiet = watch.of("read_quiet_rows")[0]["self"].quiet
    return lines + ["quiet rows (y, z): " + (", ".join(str(row) for row, is_quiet in quiet.items() if is_quiet)
                                             or "none")]


def describe_voxels(watch, count):
    """The first voxels, in the order in which they are decoded."""
    lines = ["  t h  i  (x,y,z)  pred. fract. energy  k  texture  grey  state mod 65536   s  interval       v     r     V"]
    symbols = {id(kept["p"]): kept for kept in watch.of("read_symbol")}
    run = watch.of("run")[0]["self"]
    ticks, last = run.ticks()
    predictions = {(kept["x"], kept["y"], kept["z"]): kept for kept in watch.of("predict")}
    places = [(t, h, *place) for t in range(last + 1) for h in (0, 1) for place in ticks.get((t, h), [])]
    for t, h, lane, x, y, z in places[:count]:
        kept = predictions[x, y, z]
        p = kept["returned"]
        begin = f"{t:3} {h} {lane:2}  ({x},{y},{z})  {p.value:5}"
        begin += "   flat      -" if p.flat else f"  {p.fraction:5}  {kept['energy']:5}"
        begin += f" {p.k:2}  {p.texture:7} {p.grey:5}"
        if id(p) in symbols:
            s, at = symbols[id(p)]["s"], symbols[id(p)]["begin"]
            begin += f"  {symbols[id(p)]['slot']:15}  {s:2}  {at[s]:5} + {at[s + 1] - at[s]:5}"
        else:
            begin += f"  {'quiet row':>15}  {'':2}  {'':13}"
        d = -p.residual if p.flip else p.residual
        low = f"{d & ((1 << p.k) - 1):5}" if p.k else "    -"
        lines.append(f"{begin}  {low} {p.residual:5} {run.values[x, y, z]:5}")
    lines += ["...", "", "decoded samples, z = 0:"]
    lines += [" ".join(f"{run.values[x, y, 0]:5}" for x in range(DIMS[0])) for y in range(DIMS[1])]
    return lines


def describe_activity(watch, forecast, active, carried):
    lines = [f"the values carry {len(carried)} bytes of it: {hexes(carried)}" if carried
             else "the values carry none of it",
             "point      F  context[0], adaptive bit    context[1], adaptive bit    p      bit"]
    for point, mixed in list(zip(watch.of("decode_point"), watch.of("mixed_several")))[:12]:
        names = [",".join(str(int(v)) for v in point[key][1:]) for key in ("first", "second")]
        p = point["p"]
        lines.append("({},{},{})    {}  {:27} {:27} {:5}  {}".format(*p, forecast.get(p, 0), *(
            f"({name}) {bit:5}" for name, bit in zip(names, mixed_states(point))), mixed["p"], mixed["bit"]))
    return lines + ["...", f"{len(active)} points of the closed box are active, its root corners included"]


def mixed_states(point):
    """Where both adaptive bits of a candidate begin, as a probability in 2^-16, if it is the first one in its context."""
    return [new_bit(point[key]).probability() for key in ("first_logit", "second_logit")]


def describe_edge(watch):
    """The numbers of the base edge of the first point whose edge exceeds something."""
    exceeded = [kept for kept in watch.of("exceeded") if "over" in kept]
    kept = next((kept for kept in exceeded if 0 < kept["returned"] < 3), exceeded[0])
    at = watch.returns.index(("exceeded", kept))
    inner = {}
    for name, of in reversed(watch.returns[:at]):
        inner.setdefault(name, []).append(of)
        if name == "varies":
            break
    varies = inner["varies"][0]
    right, left = inner["around_end"][:2]
    odd, u = kept["odd"], kept["u"]
    middle = tuple((a + b) // 2 for a, b in zip(kept["left"], kept["right"]))
    lines = [f"p = {middle}, u = {u}, odd axes: {', '.join('xyz'[a] for a in odd)}, m = {header_of_example().accuracy}",
             f"l = {kept['left']}, r = {kept['right']}"]
    field = kept["field"]
    numbers = [("value(l)", field.at(kept["left"], ())), ("value(r)", field.at(kept["right"], ())),
               ("rise", kept["rise"])]
    numbers += [(f"{name}({end})", v) for name in ("slope", "bend") for end, v in zip("lr", kept[name + "s"])]
    numbers += [(name, varies[name]) for name in ("chord", "incline", "sl", "sr", "bl", "br", "even_part", "odd_part")]
    numbers += [("least", kept["self"].least), ("length", kept["end"][0]), ("third", kept["third"])]
    for end, name in ((left, "left"), (right, "right")):
        numbers += [(f"{name}: {key}", end[key]) for key in ("unit", "curvature", "arc", "angle", "along", "inwards")]
        numbers += [(f"{name}.{place}.{axis}", v) for place, p in zip(("before", "after"), end["returned"])
                    for axis, v in zip("xy", p)]
    numbers += [(f"line.{axis}", v) for axis, v in zip("xy", kept["line"])] + [("distance", kept["distance"])]
    numbers += [(f"direction.{axis}", v) for axis, v in zip("xy", kept["direction"])]
    pieces = [piece["returned"] for piece in reversed(inner["piece"])]
    numbers += [(f"piece({i // 4}, {i % 4})", v) for i, v in enumerate(pieces)]
    numbers += [(f"segment({i})", v) for i, v in enumerate(kept["segments"])] + [("over", kept["over"])]
    numbers += [(f"[excess[{i}]·distance]", f32(e * kept["distance"])) for i, e in enumerate(kept["self"].excesses)]
    cells = [f"{name:24}{hex32(v)}" for name, v in numbers]
    half = (len(cells) + 1) // 2
    lines += [f"{a:58}{b}".rstrip() for a, b in zip(cells[:half], cells[half:] + [""])]
    return lines + [f"exceeded(p) = {kept['returned']}"]


def header_of_example():
    return decoder.Header(EXAMPLE.read_bytes())


def leaves(v, n, K, active, cuts):
    """The leaves below a tetrahedron: section 6.7. `cuts`: its middle, both ends of the edge that is cut, and n."""
    end = 3 - n % 3
    if n < 3 * K:
        middle = tuple((a + b) // 2 for a, b in zip(v[0], v[end]))
        if middle in active:
            cuts.append((middle, v[0], v[end], n))
            yield from leaves(v[:end] + [middle] + v[end + 1:], n + 1, K, active, cuts)
            yield from leaves(v[1:end + 1] + [middle] + v[end + 1:], n + 1, K, active, cuts)
            return
    yield v


def six_volumes(v):
    a, b, c = ([v[i][axis] - v[0][axis] for axis in range(3)] for i in (1, 2, 3))
    return abs(a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]))


def check_tetrahedra(active, box, S):
    """What section 6.7 says: leaves fill the box, the points of the grid are their vertices, and cuts are in the middle of base
    edges."""
    found, cuts, K = [], [], S.bit_length() - 1
    cubes = type(box)(box.low, tuple(h - 1 for h in box.high))
    for q in cubes.raster((S, S, S)):
        for a, b in ((0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)):
            path = [q]
            for axis in (a, b, 3 - a - b):
                path.append(add(path[-1], along(axis, S)))
            found += leaves(path, 0, K, active, cuts)
    size = [h - low for h, low in zip(box.high, box.low)]
    assert sum(map(six_volumes, found)) == 6 * size[0] * size[1] * size[2]
    assert {p for v in found for p in v} == active
    for middle, left, right, n in cuts:
        u = min(c & -c for c in middle if c)
        odd = [a for a in range(3) if middle[a] & u]
        assert {left, right} == set(base_edge(middle, u, odd, S)), middle
        assert n + 1 == 3 * (K - u.bit_length()) + 4 - len(odd), middle


CONSTANTS = {"1/√2": 0.70710678, "√2": 1.41421356, "1/√3": 0.57735027, "√3": 1.73205081, "√2/3": 0.47140452}


def check_constants(document):
    """The tables of binary32 numbers in section 6.6."""
    section = document[document.index("### 6.6 "):document.index("### 6.7 ")]
    pairs = re.findall(r"(?<=\| )(1/√?[0-9]+|√[0-9](?:/3)?) \| ([0-9A-F]{8})(?= \|)", section)
    for name, bits in pairs:
        assert bits == bits_of(CONSTANTS[name] if "√" in name else 1 / int(name[2:])), name
    assert len(pairs) == 17, pairs
    rows = re.findall(r"^\| (\d+) \|((?: [0-9A-F]{8} \|)+)$", section, re.MULTILINE)
    for first, rest in rows:
        criterion = Criterion(max(3, int(first)))
        of_accuracy = [criterion.turn, criterion.least, *criterion.excesses]
        numbers = SHARES[int(first)] if rest.count("|") == 3 else of_accuracy
        assert [cell.strip() for cell in rest.split("|")[:-1]] == [bits_of(v) for v in numbers], first
    assert len(rows) == 9


def bits_of(v):
    return struct.pack(">f", v).hex().upper()


def block(lines):
    return "```\n" + "\n".join(lines) + "\n```\n"


def made_of_example(document):
    """The parts `example` and `edge` of the document."""
    data = EXAMPLE.read_bytes()
    header = decoder.Header(data)
    in_header, start = describe_header(data, document)
    in_brick, end = describe_brick(data, start)
    activity, values, last, _ = one_brick(data, start)
    closed, owned = header.boxes(0)
    names = ("read_parameters", "decode", "raw", "read_quiet_rows", "predict", "read_symbol", "run")
    with Watch(*names) as of_values:
        samples, carried = decoder.decode_samples(header, closed, owned, None, data[values:last])
    names = ("exceeded", "varies", "around_end", "piece", "decode_point", "mixed_several", "with_forecast")
    with Watch(*names) as of_activity:
        forecast = decoder.forecast(samples, owned, closed, header)
        active = decoder.decode_activity(carried + data[start + 8:values], closed, header.S, header.level_limit,
                                         forecast)
    check_tetrahedra(active, closed, header.S)
    check_tetrahedra(set(closed.raster()), closed, header.S)
    decoded = struct.unpack(f"<{len(volume())}h", decoder.decode(data))
    assert all(abs(v - original) <= header.max_error for v, original in zip(decoded, volume()))
    command = f"tagrid encode example.raw --dims {','.join(map(str, DIMS))} --type int16 {' '.join(OPTIONS)}"
    example = [
        f"The volume has {DIMS[0]} × {DIMS[1]} × {DIMS[2]} samples of int16:\n{FORMULA}.\n"
        f"The file is `tests/golden/1.0/{EXAMPLE.name}`, {len(data)} bytes, made by\n`{command}`.\n",
        "**The header** (3.1):\n", block(in_header),
        "**The only brick** (3.2, 7.5):\n", block(in_brick), "**Its checksum** (4.1):\n",
        block(describe_checksum(data, start, header.checksum, 0)),
        f"**What follows** ({len(data) - end} bytes: 3.3 to 3.5):\n", block(dump(end, data[end:], "")),
        "**Parameters and quiet rows** (7.1, 7.5). The interval of an event is its start and its length (5.1):\n",
        block(describe_parameters(of_values)),
        "**The first voxels** (7.3 to 7.6), in the order in which they are decoded:\n",
        block(describe_voxels(of_values, 24)),
        "**The activity** (6), with a forecast. The first candidates: their contexts, with the probability in 2^-16 with which an\n"
        "adaptive bit of this context starts, the mixed probability p, and the bit:\n",
        block(describe_activity(of_activity, forecast, active, carried))]
    edge = ["**One base edge**, of the example in appendix A: the bits of all numbers as binary32, and their decimal values.\n",
            block(describe_edge(of_activity))]
    return {"example": "\n".join(example), "edge": "\n".join(edge)}


def made_of_golden_files(program):
    rows = ["| file | bytes | XXH3 of the file | XXH3 of its samples |", "|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        raw = pathlib.Path(folder) / "samples.raw"
        for path in sorted(GOLDEN.glob("*.tag")):
            data, samples = path.read_bytes(), b""
            for number in range(decoder.Header(data).volumes):
                subprocess.run([program, "decode", path, "--volume", str(number), "-q", "-f", "-o", raw], check=True)
                samples += raw.read_bytes()
            rows.append(f"| {path.name} | {len(data)} | {hex64(xxh3(data))} | {hex64(xxh3(samples))} |")
    return {"golden": "\n".join(rows) + "\n"}


def made_of_transform():
    """The tables of section 13.7, as the second decoder has them."""
    lines = []
    for name, table in (("near", sum(transform_tables.NEAR, [])), ("expected", sum(transform_tables.EXPECTED, [])),
                        ("zero_band", transform_tables.BAND), ("active_block", transform_tables.BLOCK),
                        ("sign", transform_tables.SIGN), ("far_sign", transform_tables.FAR_SIGN)):
        data = bytes(v % 256 for v in table)
        rows = [data[i:i + 56].hex().upper() for i in range(0, len(data), 56)]
        lines += [f"`{name}`, {len(data)} bytes:\n", block(rows), ""]
    weights = [f"{i:2}  " + " ".join(f"{w:3}" for w in row) for i, row in enumerate(transform_tables.WEIGHTS)]
    lines += ["`weight[orientation + 8·(level of the band > 1)]`:\n", block(weights)]
    return {"transform": "\n".join(lines) + "\n"}


def made_of_checksums():
    seed = 0x0123456789ABCDEF
    rows = ["| n | seed 0 | seed 0123456789ABCDEF |", "|---|---|---|"]
    for n in (0, 1, 3, 4, 8, 9, 16, 17, 128, 129, 240, 241, 1024, 1025, 5000):
        data = bytes((7 * i + 1) % 256 for i in range(n))
        rows.append(f"| {n} | {hex64(xxh3(data))} | {hex64(xxh3(data, seed))} |")
        check_with_library(data, seed)
    return {"checksums": "\n".join(rows) + "\n"}


def check_with_library(data, seed):
    """The library says the same, where it is installed."""
    name = ctypes.util.find_library("xxhash")
    if name is None:
        return
    function = ctypes.CDLL(name).XXH3_64bits_withSeed
    function.restype, function.argtypes = ctypes.c_uint64, (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64)
    for s in (0, seed):
        assert function(data, len(data), s) == xxh3(data, s), (len(data), s)


def main():
    program, rewrite = sys.argv[1], sys.argv[2:] == ["rewrite"]
    written = encode(program)
    if rewrite:
        EXAMPLE.write_bytes(written)
    again = f"run `python3 tests/format/example_test.py {program} rewrite`, then `decoder_test.py {program} record`"
    assert EXAMPLE.read_bytes() == written, f"{EXAMPLE} is no longer what is written: {again}"
    document = DOCUMENT.read_text()
    check_constants(document)
    made = {**made_of_example(document), **made_of_transform(), **made_of_golden_files(program), **made_of_checksums()}
    found = [match[1] for match in MARK.findall(document)]
    assert sorted(found) == sorted(made), f"{DOCUMENT} has the parts {found} instead of {sorted(made)}"
    right = MARK.sub(lambda match: match[1] + "\n" + made[match[2]] + "\n" + match[3], document)
    if rewrite:
        DOCUMENT.write_text(right)
    for of_document, of_file in zip(document.splitlines(), right.splitlines()):
        assert rewrite or of_document == of_file, f"{DOCUMENT}: it says\n{of_document}\ninstead of\n{of_file}\n{again}"
    assert rewrite or document == right, again
    print(f"{len(made)} parts of {DOCUMENT.name} are what the files say")


if __name__ == "__main__":
    main()
