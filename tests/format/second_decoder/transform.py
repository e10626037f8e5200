"""The transform: section 13 of docs/dev/format.md."""

from .coding import SQUASH, STRETCH, AdaptiveBit, Broken, Decoder, IntegerModel, clamp
from .transform_tables import BAND, BLOCK, EXPECTED, FAR_SIGN, NEAR, SIGN, WEIGHTS
from .voxels import log_scale

TRANSFORMED = b"\x09"
NORM = ((1024, 1167, 1374, 1596, 1840, 2117, 2434), (1024, 909, 1007, 1200, 1403, 1621, 1866))
LIFTING = ((1, -103949), (0, -3472), (1, 57863), (0, 29066))
LARGEST = 1 << 24
NEAR_CLASS = [0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 6] + [7] * 4 + [8] * 7 + [9] * 12 + [10] * 26 + [11] * 4
OWN = ((-1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, -1, 0), (1, -1, 0), (-1, 0, -1), (1, 0, -1), (0, -1, -1), (0, 1, -1),
       (-2, 0, 0), (0, -2, 0), (0, 0, -2), (-1, -1, -1), (1, -1, -1), (-1, 1, -1), (1, 1, -1))


def int32(v):
    return (v + (1 << 31)) % (1 << 32) - (1 << 31)


def started(logit, seen):
    """An adaptive bit with a start of its own."""
    bit = AdaptiveBit()
    bit.state = SQUASH[clamp(16 * logit, -2047, 2047) + 2048] << 16 | seen
    return bit


class Band:
    def __init__(self, lengths, highs, splits, level, step):
        self.low, self.size, norm = [], [], 1
        for axis in range(3):
            n, of = splits[axis], lengths[axis]
            self.low.append(of[n] if highs[axis] else 0)
            self.size.append(of[n - 1] - of[n] if highs[axis] else of[n])
            norm *= NORM[highs[axis]][n]
        self.orientation = highs[0] + 2 * highs[1] + 4 * highs[2]
        self.level = max(level, 1)
        self.step = max((step + norm // 2) // norm, 1)
        self.fine_axes = [axis for axis in range(3) if highs[axis] and splits[axis] <= 2]
        self.parent, self.parent_shift, self.siblings = None, (0, 0, 0), []
        self.magnitudes, self.signs, self.sums, self.is_zero = {}, {}, {}, True

    def step_at(self, place):
        step = self.step
        for axis in self.fine_axes:
            if place[axis] in (0, self.size[axis] - 1):
                step = 3 * step + 2 >> 2
        return step


def axis_lengths(size, split):
    lengths = []
    for axis in range(3):
        most = 6 if axis < 2 or split == 0 else (1, 2, 4)[split - 1]
        of = [size[axis]]
        while of[-1] >= 4 and len(of) <= most:
            of.append((of[-1] + 1) // 2)
        lengths.append(of)
    return lengths


def add_siblings(band, here):
    for common in (True, False):
        for other in reversed(here):
            if bool(other.orientation & band.orientation) == common and len(band.siblings) < 3:
                band.siblings.append((other, 0))


def make_bands(size, split, step, fraction):
    """13.2."""
    lengths = axis_lengths(size, split)
    counts = [len(of) - 1 for of in lengths]
    scaled = step << fraction + 32
    bands = []

    def add(orientation, splits, level):
        band = Band(lengths, [orientation >> a & 1 for a in range(3)], splits, level, scaled)
        if 0 in band.size:
            return None
        bands.append(band)
        return band

    def splits_of(level, orientation, axis):
        return level if orientation >> axis & 1 else min(level, counts[axis])

    if split == 0:
        levels, parents = max(counts), {}
        add(0, [splits_of(levels, 0, a) for a in range(3)], levels)
        for level in range(levels, 0, -1):
            here = []
            for o in (1, 2, 4, 3, 5, 6, 7):
                if any(o >> a & 1 and counts[a] < level for a in range(3)):
                    continue
                band = add(o, [splits_of(level, o, a) for a in range(3)], level)
                if band is None:
                    continue
                band.parent = parents.get(o)
                band.parent_shift = [level + 1 <= counts[a] for a in range(3)]
                add_siblings(band, here)
                here.append(band)
            parents = {band.orientation: band for band in here}
        return lengths, bands
    levels, parts = max(counts[:2]), counts[2] + 1

    def along_z(part):
        return (4, parts - part) if part else (0, parts - 1)

    for part in range(parts):
        high, n = along_z(part)
        add(high, [splits_of(levels, 0, 0), splits_of(levels, 0, 1), n], levels)
    parents = [{} for _ in range(parts)]
    for level in range(levels, 0, -1):
        before = {}
        for part in range(parts):
            high, n = along_z(part)
            here, now = [], {}
            for o in (1, 2, 3):
                if any(o >> a & 1 and counts[a] < level for a in range(2)):
                    continue
                band = add(o | high, [splits_of(level, o, 0), splits_of(level, o, 1), n], level)
                if band is None:
                    continue
                band.parent = parents[part].get(o)
                band.parent_shift = [level + 1 <= counts[0], level + 1 <= counts[1], 0]
                if o in before:
                    band.siblings.append((before[o], int(part >= 2)))
                add_siblings(band, here)
                here.append(band)
                now[o] = band
            before, parents[part] = now, now
    return lengths, bands


class Refinement:
    def __init__(self):
        self.step = [SQUASH[min(128 * i, 4095)] for i in range(33)]


class Coefficients:
    """13.3."""

    def __init__(self, coder, bands):
        self.coder, self.bands = coder, bands
        self.near = [[started(v, 12) for v in row] for row in NEAR]
        self.expected = [[started(row[i // 8], 24) for i in range(256)] for row in EXPECTED]
        self.weights = [[[32768, 32768] for _ in range(12)] for _ in range(16)]
        self.refined = [[Refinement() for _ in range(16)] for _ in range(16)]
        self.sign = [started(v, 12) for v in SIGN]
        self.far_sign = [started(v, 12) for v in FAR_SIGN]
        self.sign_weights = [[32768, 32768] for _ in range(8)]
        self.zero_band = [started(v, 20) for v in BAND]
        self.active_block = [started(v, 20) for v in BLOCK]
        self.means, self.far = IntegerModel(), IntegerModel()
        self.values = {}

    def run(self):
        self.decode_means(self.bands[0])
        for band in self.bands[1:]:
            self.decode_band(band)
        return self.values

    def put(self, band, x, y, z, level):
        place = band.low[0] + x, band.low[1] + y, band.low[2] + z
        self.values[place] = int32(level * band.step_at((x, y, z)) + 128 >> 8)

    def decode_means(self, band):
        levels = {}
        for z in range(band.size[2]):
            for y in range(band.size[1]):
                for x in range(band.size[0]):
                    before = [levels[p] for p in ((x - 1, y, z), (x, y - 1, z), (x, y, z - 1)) if p in levels]
                    predicted = (0, sum(before), sum(before) >> 1, sum(before) * 21846 >> 16)[len(before)]
                    level = clamp(predicted + self.coder.signed(self.means), -LARGEST, LARGEST)
                    levels[x, y, z] = level
                    self.put(band, x, y, z, level)

    def decode_band(self, band):
        siblings = sum(not other.is_zero for other, _ in band.siblings)
        parent = band.parent is not None and not band.parent.is_zero
        band.is_zero = self.coder.adaptive(self.zero_band[8 * min(band.level, 6) + 2 * siblings + parent], 255)
        if band.is_zero:
            return
        blocks = [(n + 3) // 4 for n in band.size]
        active = self.decode_blocks(band, blocks)
        for z in range(band.size[2]):
            for y in range(band.size[1]):
                for x in range(band.size[0]):
                    if active[x // 4, y // 4, z // 4]:
                        self.decode_coefficient(band, x, y, z)

    def decode_blocks(self, band, blocks):
        active = {}
        for z in range(blocks[2]):
            for y in range(blocks[1]):
                for x in range(blocks[0]):
                    if blocks == [1, 1, 1]:
                        return {(0, 0, 0): 1}
                    neighbours = sum(active.get(p, 0) for p in ((x - 1, y, z), (x, y - 1, z), (x, y, z - 1)))
                    of_parent = 0
                    if band.parent is not None:
                        first = [4 * c >> s for c, s in zip((x, y, z), band.parent_shift)]
                        edge = [4 >> s for s in band.parent_shift]
                        of_parent = sum(band.parent.magnitudes.get((first[0] + i, first[1] + j, first[2] + k), 0)
                                        for k in range(edge[2]) for j in range(edge[1]) for i in range(edge[0]))
                    of_siblings = sum(other.sums.get((x, y, z >> shift), 0) for other, shift in band.siblings)
                    context = ((6 * neighbours + block_class(of_parent)) * 6 + block_class(of_siblings)) * 2
                    active[x, y, z] = self.coder.adaptive(self.active_block[context + (band.level == 1)], 255)
        return active

    def decode_coefficient(self, band, x, y, z):
        m = [band.magnitudes.get((x + i, y + j, z + k), 0) for i, j, k in OWN]
        near = 2 * sum(m[:3]) + sum(m[3:])
        of_parent, features = 0, m + [0] * 10
        if band.parent is not None:
            p = [c >> s for c, s in zip((x, y, z), band.parent_shift)]

            def parent(i, j, k):
                return band.parent.magnitudes.get((p[0] + i, p[1] + j, p[2] + k), 0)

            features[16:20] = (parent(0, 0, 0), parent(-1, 0, 0) + parent(1, 0, 0),
                               parent(0, -1, 0) + parent(0, 1, 0), parent(0, 0, -1) + parent(0, 0, 1))
            of_parent = 2 * features[16] + sum(features[17:20])
        for i, (other, shift) in enumerate(band.siblings):
            at = x, y, z >> shift
            features[20 + i] = other.magnitudes.get(at, 0)
            features[23 + i] = sum(other.magnitudes.get((at[0] + dx, at[1] + dy, at[2] + dz), 0) for dx, dy, dz in
                                   ((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)))
        weights = WEIGHTS[band.orientation + 8 * (band.level > 1)]
        finer = 256 * band.step // band.step_at((x, y, z))
        e = clamp(sum(w * f for w, f in zip(weights, features)) * finer >> 8, 0, (1 << 22) - 1)
        e_class = min(log_scale(1, e), 31)
        context = (12 * NEAR_CLASS[min(near, 63)] + NEAR_CLASS[min(of_parent, 63)], 8 * e_class + band.orientation,
                   3 * min(band.level - 1, 3) + (0 if e_class == 0 else 1 if e_class < 16 else 2), e_class // 2)
        magnitude = 0
        while magnitude < 16 and self.mixed(self.near[magnitude][context[0]], self.expected[magnitude][context[1]],
                                            self.weights[magnitude][context[2]], self.refined[magnitude][context[3]].step):
            magnitude += 1
        if magnitude == 16:
            magnitude = min(16 + self.coder.integer(self.far), LARGEST)
        if magnitude == 0:
            return
        s = [band.signs.get((x + i, y + j, z + k), 1) for i, j, k in OWN]
        near = (27 * band.orientation + 9 * s[0] + 3 * s[1] + s[2]) * 2 + (band.level == 1)
        far = 81 * band.orientation + 27 * s[9] + 9 * s[10] + 3 * s[11] + s[8]
        negative = self.mixed(self.sign[near], self.far_sign[far], self.sign_weights[band.orientation], None)
        band.signs[x, y, z] = 0 if negative else 2
        band.magnitudes[x, y, z] = min(magnitude, 255)
        block = x // 4, y // 4, z // 4
        band.sums[block] = band.sums.get(block, 0) + min(magnitude, 255)
        self.put(band, x, y, z, -magnitude if negative else magnitude)

    def mixed(self, first, second, weights, refinement):
        s = STRETCH[first.state >> 20], STRETCH[second.state >> 20]
        t = clamp(s[0] * (weights[0] >> 4) + s[1] * (weights[1] >> 4) >> 12, -2047, 2047) + 2048
        p = refined = SQUASH[t]
        i, part = t >> 7, t & 127
        if refinement is not None:
            refined = refinement[i] * (128 - part) + refinement[i + 1] * part >> 7
        bit = self.coder.decode(clamp(p + refined >> 1, 32, 65504))
        target = 65535 if bit else 0
        if refinement is not None:
            i += part > 64
            refinement[i] += target - refinement[i] >> 6
        for k, b in enumerate((first, second)):
            weights[k] = clamp(weights[k] + (s[k] * (target - p) + 8192 >> 14), -(1 << 18), 1 << 18)
            b.learn(bit, 255)
        return bit


def block_class(total):
    return total if total < 3 else 3 if total < 6 else 4 if total < 15 else 5


def join(line):
    """One level of a line: 13.4."""
    n, low = len(line), (len(line) + 1) // 2
    x = [line[i // 2] if i % 2 == 0 else line[low + i // 2] for i in range(n)]
    for first, factor in reversed(LIFTING):
        for i in range(first, n, 2):
            left, right = x[i - 1 if i > 0 else i + 1], x[i + 1 if i + 1 < n else i - 1]
            x[i] = int32(x[i] - (factor * int32(left + right) + 32768 >> 16))
    return x


def transform_back(values, size, lengths, split):
    def join_axis(part, axis):
        others = [a for a in range(3) if a != axis]
        for j in range(part[others[1]]):
            for i in range(part[others[0]]):
                place = [0, 0, 0]
                place[others[0]], place[others[1]] = i, j
                places = []
                for n in range(part[axis]):
                    place[axis] = n
                    places.append(tuple(place))
                for p, v in zip(places, join([values.get(p, 0) for p in places])):
                    values[p] = v

    axes = 3
    if split > 0:
        axes = 2
        for level in reversed(range(len(lengths[2]) - 1)):
            join_axis((*size[:2], lengths[2][level]), 2)
    for level in reversed(range(max(len(of) - 1 for of in lengths[:axes]))):
        part = [lengths[a][min(level, len(lengths[a]) - 1)] if a < axes else size[a] for a in range(3)]
        for axis in reversed(range(axes)):
            if level < len(lengths[axis]) - 1:
                join_axis(part, axis)


# Of each difference there is the opposite one.
NEIGHBOURS = (((1, 0, 0),), ((0, 1, 0),), ((0, 0, 1),), ((1, 1, 0), (-1, 1, 0)),
              ((1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)), ((2, 0, 0), (0, 2, 0)), ((0, 0, 2),),
              ((2, 2, 0), (-2, 2, 0)))


def filtered(values, places, size, step, fraction, weights):
    """13.5."""
    of_values = step << fraction >> 6
    shift = max(0, of_values.bit_length() - 7)
    unit = of_values >> shift
    limits = 4095, max(1, unit // 4), max(1, unit // 12)
    numbers = {p: clamp(values.get(p, 0) + (1 << shift >> 1) >> shift, -8191, 8191) for p in places}
    result = {}
    for place in places:
        total = 512
        for g, offsets in enumerate(NEIGHBOURS):
            for offset in offsets:
                for sign in (1, -1):
                    at = tuple(clamp(c + sign * o, 0, n - 1) for c, o, n in zip(place, offset, size))
                    d = numbers[at] - numbers[place]
                    total += sum(weights[8 * k + g] * clamp(d, -limit, limit) for k, limit in enumerate(limits))
        result[place] = int32(values.get(place, 0) + (clamp(total >> 10, -unit, unit) << shift))
    return result


def decode_transform(data, size, sample_type, step, bound, weights):
    """13. Samples by their place in the brick."""
    coder = Decoder(data)
    split = coder.raw(2)
    low, high = sample_type.limits
    center = low + coder.raw(8 * sample_type.size)
    fraction = 6 if sample_type.size == 1 else 4
    lengths, bands = make_bands(size, split, step, fraction)
    values = Coefficients(coder, bands).run()
    transform_back(values, size, lengths, split)
    places = [(x, y, z) for z in range(size[2]) for y in range(size[1]) for x in range(size[0])]
    if weights and coder.raw(1):
        values = filtered(values, places, size, step, fraction, weights)
    samples = {p: clamp(center + (values.get(p, 0) + (1 << fraction - 1) >> fraction), low, high) for p in places}
    number, gap, multiple = IntegerModel(), IntegerModel(), IntegerModel()
    left, at = coder.integer(number), 0
    while left > 0:
        at += coder.integer(gap)
        if at >= len(places) or coder.taken > len(data):
            raise Broken("a correction where no sample is")
        q = coder.signed(multiple)
        q = clamp(q + (q >= 0), -65536, 65536)
        samples[places[at]] = clamp(samples[places[at]] + q * (2 * bound + 1), low, high)
        at, left = at + 1, left - 1
    if coder.taken != len(data) or coder.state != 1 << 31:
        raise Broken("values are followed by other bytes, or end too soon")
    return samples
