"""Values that are few: section 12 of docs/dev/format.md. Floats are kept as their bits."""

import math
import struct

from .coding import SQUASH, AdaptiveBit, Bits, Broken, Decoder, clamp
from .wide import bits_from_key, bits_of, key_of

AFFINE, TABLE, LABELS = b"\6", b"\7", b"\x08"


class Gaps:
    """12.2."""

    def __init__(self, coder):
        self.coder, self.length, self.second = coder, Bits(), Bits()

    def number(self):
        node = 1
        for _ in range(7):
            node = 2 * node + self.coder.adaptive(self.length[node], 60)
        digits = min(node - 128, 64)
        if digits == 0:
            return 0
        if digits == 1:
            return 1
        upper = 2 + self.coder.adaptive(self.second[digits], 60)
        return upper << digits - 2 | self.coder.raw_bits(digits - 2)


def unfolded(f):
    return -(f + 1) // 2 if f % 2 else f // 2


def take(data, layout):
    size = struct.calcsize(layout)
    if len(data) < size:
        raise Broken("values end too soon")
    return struct.unpack_from(layout, data), data[size:]


def require(condition):
    if not condition:
        raise Broken("values with an impossible table")


def take_table(data, sample_type, samples):
    """The entries, as samples, and the bytes behind them: 12.3."""
    (count,), data = take(data, "<H")
    require(2 <= count + 1 <= min(65536, max(2, samples // 4)))
    step, origin, unit = 0.0, 0.0, 1
    if sample_type.is_float:
        (step,), data = take(data, "<d")
        require(math.isfinite(step) and math.copysign(1, step) > 0)
        if step != 0:
            (origin,), data = take(data, "<d")
            require(math.isfinite(origin))
    else:
        (unit,), data = take(data, "<I")
        require(unit > 0)
    (size,), data = take(data, "<I")
    if size > len(data):
        raise Broken("values end too soon")
    coder = Decoder(data[:size])
    gaps, steps, misses, alone = Gaps(coder), Gaps(coder), Gaps(coder), AdaptiveBit()
    half = 1 << (8 * sample_type.size - 1)
    lowest, highest = (-half, half - 1) if sample_type.is_float else sample_type.limits
    key, k, keys = lowest - 1, 0, []
    for i in range(count + 1):
        before = key
        if step == 0 or coder.adaptive(alone, 250):
            if i == 0:
                key = lowest + Gaps(coder).number()
            else:
                key = before + unit * (1 + gaps.number())
        else:
            k += steps.number()
            require(k <= 1 << 53)
            key = unfolded(misses.number()) + key_of(bits_of(origin + step * float(k), sample_type.size),
                                                     sample_type.size)
        require(before < key <= highest)
        coder.check_exhausted()
        keys.append(key)
    coder.check_end()
    entries = [bits_from_key(key, sample_type.size) if sample_type.is_float else key for key in keys]
    return entries, data[size:]


WEIGHTS = (4, 4, 4, 2, 2, 2, 2, 2, 2, 1, 1, 1)
AROUND = ((-1, 0, 0), (0, -1, 0), (0, 0, -1), (1, -1, 0), (1, 0, -1), (0, 1, -1), (-1, -1, 0), (-1, 0, -1), (0, -1, -1),
          (1, 1, -1), (-2, 0, 0), (0, -2, 0))
LEFT, ABOVE, BEHIND = range(3)


class LabelDecoder:
    """12.4."""

    def __init__(self, data, size, count):
        self.coder, self.size, self.count = Decoder(data), size, count
        self.labels = {}
        self.expected, self.bits = {}, Bits()

    def at(self, x, y, z, row):
        """The label of a neighbour of a voxel in row `row`."""
        mx, my, _ = self.size
        if z < 0:
            return 0
        if (y, z) == row and x < 0:
            return self.at(0, y - 1, z, row)
        x = clamp(x, 0, mx - 1)
        if y < 0:
            # Behind, or above in this slice: the first row behind.
            return self.at(x, 0, z if z < row[1] else z - 1, row)
        return self.labels[x, min(y, my - 1), z]

    def around(self, x, y, z):
        return [self.at(x + dx, y + dy, z + dz, (y, z)) for dx, dy, dz in AROUND]

    def calm(self, x, y, z):
        row = y, z
        here = self.at(x, y - 1, z, row)
        return all(here == self.at(x + dx, y + dy, z + dz, row)
                   for dx, dy, dz in ((0, 0, -1), (1, -1, 0), (1, 0, -1), (0, 1, -1)))

    def index(self):
        digits = (self.count - 1).bit_length()
        upper, node = min(digits, 8), 1
        for _ in range(upper):
            node = 2 * node + self.coder.adaptive(self.bits["index", node], 255)
        high = node - (1 << upper)
        return min(high << digits - upper | self.coder.raw_bits(digits - upper), self.count - 1)

    def one(self, x, y, z):
        around = self.around(x, y, z)
        e = around[ABOVE] if around[ABOVE] == around[BEHIND] else around[LEFT]
        context = tuple(n == e for n in around)
        if context not in self.expected:
            logit = (2 * sum(w for w, same in zip(WEIGHTS, context) if same) - 27) * 40
            bit = self.expected[context] = AdaptiveBit()
            bit.state = SQUASH[logit + 2048] << 16 | 2
        if self.coder.adaptive(self.expected[context], 255):
            return e
        if self.count == 2:
            return 1 - e
        others = []
        for n in (around[i] for i in (0, 2, 1, 3, 4, 5, 9)):
            if n != e and n not in others:
                others.append(n)
        if others and self.coder.adaptive(self.bits["other", tuple(n == others[0] for n in around[:6])], 255):
            return others[0]
        if len(others) > 1 and self.coder.adaptive(self.bits["third"], 255):
            return others[1]
        return self.index()

    def run(self):
        mx, my, mz = self.size
        for z in range(mz):
            for y in range(my):
                x = 0
                while x < mx:
                    usual, run = self.at(x, y - 1, z, (y, z)), 0
                    if self.at(x - 1, y, z, (y, z)) == usual:
                        end = min(mx, x // 64 * 64 + 64)
                        while x + run < end and self.calm(x + run, y, z):
                            run += 1
                    if run == 0:
                        self.labels[x, y, z] = self.one(x, y, z)
                        x += 1
                        continue
                    whole = self.coder.adaptive(self.bits["whole", run.bit_length()], 255)
                    same = run if whole else min(self.coder.raw_bits((run - 1).bit_length()), run - 1)
                    for _ in range(same):
                        self.labels[x, y, z] = usual
                        x += 1
                    if not whole:
                        self.labels[x, y, z] = self.index()
                        x += 1
                self.coder.check_exhausted()
        self.coder.check_end()
        return self.labels


def is_few(data):
    return data[:1] in (AFFINE, TABLE, LABELS)


def decode_few(data, size, sample_type, bounds, decode_numbers):
    """Samples by (x, y, z). `bounds` are two integers (not used if samples are floats), and `decode_numbers` decodes a
    brick of uint16 from bytes and both errors, or None if no voxel is an exception."""
    kind, data = data[:1], data[1:]
    if kind == AFFINE:
        if sample_type.is_float:
            raise Broken("values of an unknown kind")
        if len(data) < sample_type.size + 4:
            raise Broken("values end too soon")
        first = sample_type.from_bits(int.from_bytes(data[:sample_type.size], "little"))
        step = int.from_bytes(data[sample_type.size:sample_type.size + 4], "little")
        if step < 2:
            raise Broken("values with an impossible step")
        numbers = decode_numbers(data[sample_type.size + 4:], [b // step for b in bounds])
        return {at: min(first + step * n, sample_type.limits[1]) for at, n in numbers.items()}
    mx, my, mz = size
    entries, data = take_table(data, sample_type, mx * my * mz)
    if kind == LABELS:
        numbers = LabelDecoder(data, size, len(entries)).run()
    else:
        numbers = decode_numbers(data, None)
    return {at: entries[min(n, len(entries) - 1)] for at, n in numbers.items()}
