#!/usr/bin/env python3
"""python3 tests/format/decoder.py FILE.tag OUT.raw

Decodes a .tag file of version 5 into samples, x fastest, little endian. It was written from docs/dev/format.md and
follows its sections; it shares nothing with the program. It is slow: a few thousand samples per second.
The exit code is 65 if the file is broken.
"""

import math
import shutil
import struct
import subprocess
import sys

from second_decoder.best import BestDecoder
from second_decoder.coding import Broken
from second_decoder.few import decode_few, is_few
from second_decoder.forecast import forecast
from second_decoder.grid import Box, decode_activity, decode_points, interpolate
from second_decoder.lanes import FastDecoder, LanesDecoder
from second_decoder.transform import TRANSFORMED, decode_transform
from second_decoder.voxels import decode_voxels
from second_decoder.wide import (decode_wide_as_narrow, decode_wide_points, decode_wide_voxels,
                                 interpolate_floats)
from second_decoder.sides import apply_sides, check_thresholds, split_sides
from second_decoder.xxh3 import xxh3


def require(condition, what):
    if not condition:
        raise Broken(what)


def chained(block, before):
    """The checksum that follows a block, from its bytes and the checksum before it: section 4.1."""
    return xxh3(struct.pack("<Q", xxh3(block)), before)


MEMBER = 0xFFFFFFFF  # the marker of a member


class SampleType:
    def __init__(self, number):
        require(1 <= number <= 8, "the sample type is not of version 5")
        self.number = number
        self.size = (1, 1, 2, 2, 4, 4, 4, 8)[number - 1]
        self.is_wide, self.is_float = number >= 5, number >= 7  # samples of floats are kept as their bits
        self.is_signed = number in (2, 4, 6)
        half = 1 << (8 * self.size - 1)
        self.limits = (-half, half - 1) if self.is_signed else (0, 2 * half - 1)

    def from_bits(self, bits):
        return bits - (1 << 8 * self.size) if bits > self.limits[1] else bits


class Header:
    def __init__(self, data):
        require(len(data) >= 16 and data[:8] == b"\x89TAG\r\n\x1a\n", "this is not a .tag file")
        version, self.size = struct.unpack_from("<II", data, 8)
        require(version == 5, "the version is not known")
        require(132 <= self.size <= 1 << 24 and self.size <= len(data), "the header's size is impossible")
        self.checksum = struct.unpack_from("<Q", data, self.size - 8)[0]
        require(self.checksum == xxh3(data[:self.size - 8]), "the header is damaged")
        (*self.dims, type_number, self.mode, self.S, self.B, self.level_limit, self.accuracy, self.effort, grid, lead,
         self.scale, self.range_low, high,
         max_error, surface_error, mesh_error, point_error, volumes, text_size, packed_size) = struct.unpack_from(
             "<QQQBBHHHIHBBdddddddIII", data, 16)
        besides = self.size - 132 - packed_size
        require(besides >= 0 and besides % 4 == 0 and text_size <= 1 << 24, "fields do not fit")
        self.step = None  # of samples
        self.filter = None
        if besides % 8 == 4:
            word = struct.unpack_from("<I", data, 124 + packed_size)[0]
            if word >> 31:
                require(besides >= 52, "fields do not fit")
                self.filter = struct.unpack_from("<24h", data, 128 + packed_size)
                require(any(self.filter) and all(-2047 <= w <= 2047 for w in self.filter), "an impossible filter")
            self.step = struct.unpack("<f" if type_number >= 7 else "<I", struct.pack("<I", word & 0x7FFFFFFF))[0]
            if type_number < 7:
                require(1 <= self.step < 1 << 23, "an impossible step")
                self.step /= 64
            require(2.0 ** -100 <= self.step <= 2.0 ** 100, "an impossible step")
        require(1 <= volumes <= 10000, "an impossible number of volumes")
        require(volumes == 1 or (volumes * self.dims[2] <= 1 << 31 and volumes * math.prod(self.dims) <= 1 << 58),
                "impossible sizes")
        self.volumes = volumes
        self.coding = data[16:112]  # what every volume of the file has
        begin = besides % 8 + 48 * (self.filter is not None)  # of the thresholds
        require((besides - begin) // 8 <= 8, "fields do not fit")
        self.thresholds = struct.unpack_from(f"<{(besides - begin) // 8}d", data, 124 + packed_size + begin)
        require(all(1 <= n <= 1 << 31 for n in self.dims) and math.prod(self.dims) <= 1 << 58, "impossible sizes")
        self.type = SampleType(type_number)
        require(self.mode in (0, 1), "the mode is unknown")
        require(not self.thresholds or self.mode == 0, "thresholds without voxels")
        check_thresholds(self.thresholds, self.type)
        require(self.effort in (0, 1, 2), "the effort is unknown")
        require(grid == 0 or (grid in (1, 2) and self.mode == 0 and surface_error < 0 and mesh_error < 0),
                "impossible grid")
        require(self.step is None or (self.mode == 0 and surface_error < 0
                                      and max_error >= (0 if self.type.is_float else 1) and max_error > 0),
                "a transform of what has none")
        self.grid = grid
        self.stores_grid = grid == 0
        require(lead in (0, 1), "impossible lead")
        self.first = [lead if n > 1 else 0 for n in self.dims]  # the lattice point of the first sample
        self.last = [first + n - 1 for first, n in zip(self.first, self.dims)]
        require(self.S in (4, 8, 16, 32, 64, 128, 256), "impossible root cubes")
        require(self.B >= 1 and self.B * self.S <= 512, "impossible bricks")
        self.K = self.S.bit_length() - 1
        require(self.level_limit <= 3 * self.K and 3 <= self.accuracy <= 1000000, "impossible accuracy")
        require(self.scale > 0 and all(map(math.isfinite, (self.scale, self.range_low, high))), "impossible range")
        require(self.range_low <= high, "impossible range")
        for e in (max_error, surface_error, mesh_error):
            require(e == -1 or (e >= 0 and math.isfinite(e)), "impossible bound")
        require(point_error >= 0 and math.isfinite(point_error), "impossible error of points")
        require(self.mode == 1 or max_error >= 0, "voxels without a bound")
        require(surface_error < 0 or (self.mode == 0 and surface_error < max_error), "impossible bound of active voxels")
        self.levels = 3 * self.K + 1 if grid != 1 else 0  # whose active points are counted
        self.volume_fields = 8 * self.levels + 72 + 8 * (mesh_error >= 0) + 16 * len(self.thresholds)  # bytes of a section of the index
        self.mesh_error, self.error_bound = mesh_error, max_error
        widest = (1 << 8 * self.type.size) - 1
        self.max_error, self.surface_error, self.point_error = (
            e if self.type.is_float else -1 if e < 0 else int(min(e, widest))
            for e in (max_error, surface_error, point_error))
        require(grid != 2 or self.max_error == 0, "an implied grid in a file with loss")
        unpack(data[124:124 + packed_size], text_size)
        self.cubes = [max(1, (last + self.S - 1) // self.S) for last in self.last]
        self.bricks = [(c + self.B - 1) // self.B for c in self.cubes]
        pages = -(-math.prod(self.bricks) // bricks_of_page(math.prod(self.bricks)))
        require(volumes == 1 or 24 * volumes + 32 * pages <= (1 << 18) - (1 << 13),
                "too many volumes of so many bricks")

    def boxes(self, number):
        """Closed box and owned box of a brick."""
        i, rest = number % self.bricks[0], number // self.bricks[0]
        position = (i, rest % self.bricks[1], rest // self.bricks[1])
        low = tuple(c * self.B * self.S for c in position)
        high = tuple(min(low[a] + self.B * self.S, self.cubes[a] * self.S) for a in range(3))
        return Box(low, high), Box(tuple(max(low[a] + (position[a] > 0), self.first[a]) for a in range(3)),
                                   tuple(min(high[a], self.last[a]) for a in range(3)))


def unpack(packed, size):
    """The content of one zstd frame, if the zstd program is installed."""
    if shutil.which("zstd") is None:
        return None
    run = subprocess.run(["zstd", "-dc"], input=packed, capture_output=True, check=False)
    require(run.returncode == 0 and len(run.stdout) == size, "zstd bytes are damaged")
    return run.stdout


def as_number(sample, sample_type):
    """A sample as a Python number; elsewhere floats are kept as bits."""
    if not sample_type.is_float:
        return sample
    return struct.unpack("<f" if sample_type.size == 4 else "<d", sample.to_bytes(sample_type.size, "little"))[0]


def decode_brick(header, number, activity, values, with_grid):
    """Samples of the owned box by lattice point, and the active points; None if they are not needed."""
    closed, owned = header.boxes(number)
    active = None
    require(header.stores_grid or not activity, "a brick has a grid that is not stored")
    with_grid = with_grid and header.stores_grid
    if header.mode == 1 or header.surface_error >= 0:
        active = decode_activity(activity, closed, header.S, header.level_limit)
    samples, carried = decode_samples(header, closed, owned, active, values)
    require(not carried or (active is None and header.stores_grid), "values carry bytes for no activity")
    if active is None and with_grid:
        activity = carried + activity
        numbers = {p: as_number(v, header.type) for p, v in samples.items()}
        active = decode_activity(activity, closed, header.S, header.level_limit,
                                 forecast(numbers, owned, closed, header))
    return samples, active


def decode_samples(header, closed, owned, active, values):
    """Samples by lattice point, and the bytes of the activity that the values carry."""
    if header.mode == 1 and header.type.is_wide:
        points = decode_wide_points(values, closed, active, header.S, header.point_error, header.type)
        interpolated = interpolate_floats if header.type.is_float else interpolate
        samples = interpolated(points, closed, header.S, *([header.type] if header.type.is_float else []))
        return {p: samples[p] for p in owned.raster()}, b""
    if header.mode == 1:
        points = decode_points(values, closed, active, header.S, header.point_error, header.type.limits)
        samples = interpolate(points, closed, header.S)
        return {p: samples[p] for p in owned.raster()}, b""
    x0, y0, z0 = owned.low
    two = header.surface_error >= 0

    def is_active(x, y, z):
        return two and (x0 + x, y0 + y, z0 + z) in active

    size = tuple(owned.high[a] - owned.low[a] + 1 for a in range(3))

    carried = bytearray()

    def decode_as_it_is(data, sample_type, bounds):
        return decode_voxels(data, size, sample_type, lambda *p: bounds[is_active(*p)], min(bounds[:1 + two]),
                             (LanesDecoder, FastDecoder, BestDecoder)[header.effort], carried)

    def decode_numbers(data, bounds):
        return decode_as_it_is(data, SampleType(3), bounds or (0, 0))

    def decode_narrow(data, sample_type, bounds, step=None):
        if step is not None:  # in 64ths
            if data[:1] == TRANSFORMED:
                return decode_transform(data[1:], size, sample_type, step, bounds[0], header.filter)
            bounds = 0, 0
        if is_few(data):
            return decode_few(data, size, sample_type, bounds, decode_numbers)
        return decode_as_it_is(data, sample_type, bounds)

    sides = b""
    if header.thresholds:
        sides, values = split_sides(values)
    bounds = header.max_error, header.surface_error if two else header.max_error
    if header.step is not None and header.type.is_wide and values[:1] != b"\2":
        half = header.step / 2 if header.type.is_float else math.floor(header.step / 2)
        bounds = (min(bounds[0], half),) * 2
    if not header.type.is_wide:
        samples = decode_narrow(values, header.type, bounds, header.step and int(header.step * 64))
    elif values[:1] == b"\2":
        def decode_narrow_numbers(data, bounds, exponent):
            step = header.step and max(1, min(math.floor(header.step * 64 * 2.0 ** -exponent), (1 << 23) - 1))
            return decode_narrow(data, SampleType(3), bounds, step)

        samples = decode_wide_as_narrow(values[1:], header.type, bounds, decode_narrow_numbers)
    elif is_few(values):
        samples = decode_few(values, size, header.type, bounds, decode_numbers)
    else:
        samples = decode_wide_voxels(values, size, header.type, two and is_active)
    if sides:
        apply_sides(sides, samples, size, header.thresholds, header.type)
    return {(x0 + x, y0 + y, z0 + z): v for (x, y, z), v in samples.items()}, bytes(carried)


def level_counts(header, number, active):
    """Active points that a brick owns, by level: those in (low, high] of its closed box."""
    counts = [0] * (3 * header.K + 1)
    closed, _ = header.boxes(number)
    for p in active:
        if all(p[a] > closed.low[a] or closed.low[a] == 0 for a in range(3)):
            unit = min((c & -c for c in p if c), default=header.S)
            odd = sum(c & unit != 0 for c in p)
            counts[0 if unit >= header.S else 3 * (header.K - unit.bit_length()) + 4 - odd] += 1
    return counts


def packed_block(data, at, last, marker, least, most, what):
    """The content of a packed block (None without zstd), where it ends, and its checksum."""
    require(len(data) >= at + 12, f"{what} is cut off")
    found, size, packed_size = struct.unpack_from("<III", data, at)
    require(found == marker and least <= size <= most and packed_size <= size + size // 128 + 1024,
            f"{what} has an impossible size")
    end = at + 12 + packed_size
    require(len(data) >= end + 8, f"{what} is cut off")
    checksum = struct.unpack_from("<Q", data, end)[0]
    require(checksum == chained(data[at:end], last), f"{what} is damaged")
    return unpack(data[at + 12:end], size), end + 8, checksum


def bricks_of_page(n):
    """How many bricks all pages have but the last one."""
    page = 4096
    while n > 6144 * page:
        page *= 2
    require(page <= 1 << 24, "no file has so many bricks")
    return page


def check_page(data, at, last, sizes):
    """Checks the page of bricks with these sizes. Returns where it ends, the checksum, and its fields in the directory."""
    n, start = len(sizes), at
    content, at, last = packed_block(data, at, last, 2, 8 * n, 8 * n, "a page of sizes")
    if content is not None:
        columns = struct.unpack(f"<{2 * n}I", content)
        require(list(zip(columns[:n], columns[n:])) == sizes, "a page has other sizes than its bricks")
    middle = at
    content, at, last = packed_block(data, at, last, 3, 24 * n, 24 * n, "a page of statistics")
    limits = (None, None)
    if content is not None:
        columns = struct.unpack(f"<{3 * n}d", content)
        limits = min(columns[:n]), max(columns[n:2 * n])
    return at, last, (middle - start, at - middle, sum(16 + a + v for a, v in sizes), *limits)


def check_envelope(data, at, header, last):
    """Checks all that the format says of the envelope. Returns where the directory begins, and the checksum before it."""
    content = b""
    while len(data) >= at + 4 and struct.unpack_from("<I", data, at)[0] == 1:
        block, at, last = packed_block(data, at, last, 1, 1, 1 << 20, "the envelope")
        content = None if block is None or content is None else content + block
    if content:
        check_source_files(content, header)
    return at, last


def check_members(data, at, header, last):
    """Section 3.6. Returns the members (kind, factor, offset, length), where the index begins, and the checksum before."""
    members, coarsest, volumes = [], 1, 1
    while len(data) >= at + 4 and struct.unpack_from("<I", data, at)[0] == MEMBER:
        require(len(data) >= at + 20, "a member is cut off")
        kind, factor, length = struct.unpack_from("<IIQ", data, at + 4)
        end = at + 20 + length
        require(len(data) >= end + 8, "a member is cut off")
        checksum = struct.unpack_from("<Q", data, end)[0]
        require(checksum == chained(data[at:end], last), "a member is damaged")
        members.append((kind, factor, at, length))
        require(len(members) <= 63 + header.volumes, "there are too many members")
        if volumes < header.volumes or kind == 2:
            require((kind, factor) == (2, volumes) and volumes < header.volumes,
                    "the volumes are not in order, or are too many")
            inner = Header(data[at + 20:end])
            require(inner.volumes == 1 and inner.coding == header.coding and inner.step == header.step
                    and inner.filter == header.filter,
                    "a volume is of another file")
            volumes += 1
        if kind == 1:
            require(factor > coarsest, "the overviews do not become coarser")
            coarsest = factor
            inner = Header(data[at + 20:end])
            require(inner.volumes == 1 and inner.mode == 0 and inner.grid == 1
                    and inner.type.number == header.type.number, "an overview is of another volume")
            require(inner.dims == [(n - 1) // factor + 1 for n in header.dims], "an overview has other sizes")
            check_end_of_overview(data[at + 20:end], inner)
        last, at = checksum, end + 8
    require(volumes == header.volumes, "a volume is missing")
    return members, at, last


def check_end_of_overview(data, header):
    """The directory and the footer, and that nothing lies between the last page and the directory."""
    require(len(data) >= header.size + 24, "an overview is cut off")
    start, = struct.unpack_from("<Q", data, len(data) - 24)
    require(header.size <= start <= len(data) - 24, "an overview has no footer")
    n = math.prod(header.bricks)
    count = -(-n // bricks_of_page(n))
    before, = struct.unpack_from("<Q", data, start - 8)
    sections = read_directory(data, start, header, before, count)
    if sections is None:
        return
    require(3 not in sections, "an overview has members")
    fields = struct.unpack_from(f"<{2 * count}I{count}Q", sections[2])
    require(header.size + sum(fields) == start, "an overview has other parts than bricks and pages")


def volumes_of(data):
    """The volumes of a file but the first one, as bytes of files of their own. The file must be whole."""
    return [data[offset + 20:offset + 20 + length] for kind, _, offset, length in members_of(data) if kind == 2]


def members_of(data):
    at = struct.unpack_from("<Q", data, len(data) - 24)[0]
    size, packed_size = struct.unpack_from("<QQ", data, at + 4)
    return struct.iter_unpack("<IIQQ", sections_of(unpack(data[at + 20:at + 20 + packed_size], size)).get(3, b""))


def overviews(data):
    """The factors of a file's overviews, and their bytes, which are files of their own. The file must be whole."""
    return {factor: data[offset + 20:offset + 20 + length] for kind, factor, offset, length in members_of(data)
            if kind == 1}


def compression_in(data):
    """How the samples of the source were compressed, as the first block of the envelope of a whole file says."""
    header = Header(data)
    at = header.size
    while struct.unpack_from("<I", data, at)[0] != 1:
        marker, _, packed_size = struct.unpack_from("<III", data, at)
        at += 12 + marker if marker > 3 else 20 + packed_size
    size, packed_size = struct.unpack_from("<II", data, at + 4)
    content = unpack(data[at + 12:at + 12 + packed_size], size)
    return content[10:10 + struct.unpack_from("<H", content, 8)[0]]


def check_source_files(content, header):
    position = 0

    def take(form):
        nonlocal position
        require(len(content) >= position + struct.calcsize(form), "the envelope ends too soon")
        fields = struct.unpack_from(form, content, position)
        position += struct.calcsize(form)
        return fields

    slices = header.dims[2] * header.volumes
    row_bytes = header.dims[0] * header.type.size
    slice_bytes = header.dims[1] * row_bytes
    places = [0] * slices
    files, = take("<Q")
    require(1 <= files <= slices + 1024, "an impossible number of source files")
    others_left = math.prod(header.dims) * header.volumes * header.type.size // 2 + (files << 16)
    length, = take("<H")
    require(length <= 1024, "the name of a compression is too long")
    compression, = take(f"<{length}s")
    names, changed = set(), 0
    for _ in range(files):
        length, = take("<H")
        name, = take(f"<{length}s")
        require(all(part not in (b"", b".", b"..") for part in name.split(b"/")) and b"\0" not in name, "a name is not allowed")
        require(length <= 4096 and name not in names, "a name is too long, or known")
        names.add(name)
        size, kind = take("<QB")
        require(size <= 1 << 62 and kind <= 3, "a file is impossible")
        allowed = (0,) if header.max_error != 0 else (1,) if kind < 2 else (0, 1)
        require(kind & 1 in allowed, "a file has no checksum, or one that it must not have")
        changed += kind >> 1
        take("<Q" if kind & 1 else "<")
        end, others, kept = 0, size, 0
        for _ in range(take("<I")[0]):
            first, count, offset, distance, flags, used, spare, add = take("<QQQQBBBi")
            row_distance, = take("<Q") if flags & 4 else (row_bytes,)
            span = (header.dims[1] - 1) * row_distance + row_bytes
            require(count >= 1 and first + count <= slices, "a slice does not exist")
            require(offset >= end and distance >= span and row_distance >= row_bytes, "slices overlap")
            require(flags <= 15 and flags & 12 != 8 and spare <= 2 and used <= 8 * header.type.size,
                    "samples are stored in an impossible way")
            require((used or not spare) and (not header.type.is_float or not used and not add), "impossible bits")
            end = offset + (count - 1) * distance + span
            for z in range(first, first + count):
                places[z] += 1
            others -= count * slice_bytes
            kept += count * slice_bytes if spare == 2 else 0
        require(end <= size, "a slice lies beyond the end of a file")
        others_left -= others
        require(others_left >= 0, "too many bytes that are not samples")
        take(f"<{others + kept}s")
    require(position == len(content), "bytes follow the last source file")
    require(all(n == 1 for n in places), "a slice has no place, or two")
    require((changed > 0) == (compression != b""), "a file is in its plain form without a reason, or none for a reason")


def sections_of(directory):
    """The sections of the directory by kind."""
    sections, at, last = {}, 0, 0
    while at < len(directory):
        require(len(directory) >= at + 12, "a section is cut off")
        kind, size = struct.unpack_from("<IQ", directory, at)
        require(last < kind and size <= len(directory) - at - 12, "a section is impossible")
        require(kind in (1, 2, 3) or kind >= 1 << 16, "a section is not known")
        sections[kind], last = directory[at + 12:at + 12 + size], kind
        at += 12 + size
    require(1 in sections and 2 in sections, "a section is missing")
    return sections


def read_directory(data, at, header, last, pages):
    """The sections of the directory, which the footer follows; None without zstd."""
    require(len(data) >= at + 20, "the index is missing")
    marker, size, packed_size = struct.unpack_from("<IQQ", data, at)
    require(marker == 0 and 24 + header.volume_fields + 32 * pages <= size <= (1 << 18) - (1 << 12),
            "the index has an impossible size")
    require(packed_size <= size + size // 128 + 1024, "the index has an impossible size")
    end = at + 20 + packed_size
    require(len(data) == end + 32, "the file is truncated, or bytes follow its end")
    checksum, start, header_checksum, magic = struct.unpack_from("<QQQ8s", data, end)
    require(checksum == chained(data[at:end], last), "the index is damaged, or the last block was exchanged")
    require((start, header_checksum, magic) == (at, header.checksum, b"TAG END\n"), "the footer is damaged")
    directory = unpack(data[at + 20:end], size)
    if directory is None:
        return None
    sections = sections_of(directory)
    fields = sections[1]
    require(len(fields) == header.volume_fields and len(sections[2]) == 32 * pages, "a section has an impossible size")
    errors = fields[8 * header.levels:]
    reached = struct.unpack_from("<d", errors)[0]
    require(reached >= 0 and (header.error_bound < 0 or reached <= header.error_bound), "the error is above the bound")
    errors = errors[8:]
    if header.mesh_error >= 0:
        require(0 <= struct.unpack_from("<d", errors)[0] <= header.mesh_error, "the mesh is too far off")
        errors = errors[8:]
    if header.type.is_float:
        squares, zero = struct.unpack_from("<dQ", errors)
        require(not math.isnan(squares) and zero == 0, "the index has bits that must be 0")
    require(not any(map(math.isnan, struct.unpack_from("<3d", errors, 16))), "a statistic is not a number")
    return sections


def check_index(data, at, header, last, sizes, pages, counts, members):
    sections = read_directory(data, at, header, last, len(pages))
    if sections is None:
        return
    fields, columns = sections[1], sections[2]
    stored_counts = struct.unpack_from(f"<{header.levels}Q", fields)
    require(counts is None or list(stored_counts) == counts, "the index has other active points than the bricks")
    after = len(fields) - 16 * len(header.thresholds)  # where the counts of thresholds begin
    require(struct.unpack_from("<2Q", fields, after - 16) == tuple(map(sum, zip(*sizes))),
            "the index has other sums of sizes")
    n = len(pages)
    stored = struct.unpack(f"<{2 * n}I{n}Q{2 * n}d", columns)
    require([stored[i::n] for i in range(n)] == pages, "the directory has other pages than the file")
    require(struct.unpack_from("<2d", fields, after - 48)
            == (min(page[3] for page in pages), max(page[4] for page in pages)), "the extremes are not those of the pages")
    table = sections.get(3)
    require(table is None or (table and len(table) % 24 == 0), "the table of members has an impossible size")
    require(list(struct.iter_unpack("<IIQQ", table or b"")) == members, "the directory has other members than the file")


def without_parity(data):
    """The file before its parity, as its foot says."""
    foot = data[-48:]
    if len(foot) < 48 or foot[:8] != b"TAG PAR\n" or xxh3(foot[:40]) != struct.unpack("<Q", foot[40:])[0]:
        return data
    return data[:struct.unpack_from("<Q", foot, 8)[0]]


def decode(data, with_grid=True):
    """All samples, volume after volume. with_grid: the activity is decoded even if samples do not depend on it."""
    data = without_parity(data)
    header = Header(data)
    with_grid = with_grid and header.stores_grid
    counts = [0] * header.levels
    volume = {}
    at, last, sizes, pages = header.size, header.checksum, [], []
    n = math.prod(header.bricks)
    in_page = bricks_of_page(n)
    for number in range(n):
        require(len(data) >= at + 16, "the file is truncated")
        length, activity_size = struct.unpack_from("<II", data, at)
        closed, _ = header.boxes(number)
        points = math.prod(closed.high[a] - closed.low[a] + 1 for a in range(3))
        require(4 <= length <= min((1 << 32) - 1, 65536 + points * (1 + 2 * header.type.size)), "impossible length")
        end = at + 4 + length
        require(len(data) >= end + 8, "the file is truncated")
        checksum = struct.unpack_from("<Q", data, end)[0]
        require(checksum == chained(struct.pack("<Q", number) + data[at:end], last), f"brick {number} is damaged")
        require(activity_size <= length - 4, f"brick {number} has an impossible activity")
        middle = at + 8 + activity_size
        samples, active = decode_brick(header, number, data[at + 8:middle], data[middle:end], with_grid)
        volume.update(samples)
        if with_grid:
            counts = [a + b for a, b in zip(counts, level_counts(header, number, active))]
        last = checksum
        sizes.append((activity_size, length - 4 - activity_size))
        at = end + 8
        if len(sizes) % in_page == 0 or len(sizes) == n:
            at, last, page = check_page(data, at, last, sizes[len(pages) * in_page:])
            pages.append(page)
    at, last = check_envelope(data, at, header, last)
    members, at, last = check_members(data, at, header, last)
    check_index(data, at, header, last, sizes, pages, counts if with_grid else None, members)
    whole = Box(tuple(header.first), tuple(header.last))
    samples = b"".join(volume[p].to_bytes(header.type.size, "little", signed=header.type.is_signed)
                       for p in whole.raster())
    for inner in volumes_of(data) if header.volumes > 1 else ():
        samples += decode(inner, with_grid)
    return samples


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as file:
        data = file.read()
    try:
        samples = decode(data)
    except Broken as broken:
        print(f"{sys.argv[1]}: {broken}", file=sys.stderr)
        sys.exit(65)
    with open(sys.argv[2], "wb") as file:
        file.write(samples)


if __name__ == "__main__":
    main()
