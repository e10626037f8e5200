"""Entropy coder, adaptive bits, mixing, integers, symbols: section 5 of docs/dev/format.md."""

import math
import zlib


class Broken(Exception):
    """The bytes are not those of a .tag file, version 5."""


def clamp(v, low, high):
    return max(low, min(v, high))


def make_tables():
    squash = [clamp(math.floor(65536 / (1 + math.exp(-(i - 2048) / 256))), 1, 65535) for i in range(4096)]
    stretch, at = [], 1
    for i in range(4096):
        while at < 4095 and squash[at] < 16 * i + 8:
            at += 1
        stretch.append(at - 2048)
    rate = [131072 // (2 * i + 3) for i in range(1024)]
    for table, expected in ((squash, 0x4B0CE52D), (stretch, 0x549B78CB), (rate, 0x66BD27CF)):
        packed = b"".join((v & 0xFFFF).to_bytes(2, "little") for v in table)
        assert zlib.crc32(packed) == expected
    return squash, stretch, rate


SQUASH, STRETCH, RATE = make_tables()


class AdaptiveBit:
    __slots__ = ("state",)

    def __init__(self):
        self.state = 1 << 31

    def probability(self):
        return clamp(self.state >> 16, 1, 65535)

    def learn(self, bit, limit):
        seen = self.state & 1023
        target = 0xFFFFFC00 if bit else 0
        moved = ((target - (self.state - seen)) * RATE[seen]) >> 16
        self.state = ((self.state + moved) & ~1023) + seen + (seen < limit)


class Bits(dict):
    """Adaptive bits by any key, created when first used."""

    def __missing__(self, key):
        self[key] = AdaptiveBit()
        return self[key]


class IntegerModel:
    def __init__(self):
        self.longer, self.top = Bits(), Bits()


class SymbolModel:
    def __init__(self, mean, of):
        ratio = (mean * (mean + of) << 16) // (2 * of * of + 2 * mean * of + mean * mean)
        power = [65536]
        for _ in range(8):
            power.append(power[-1] * ratio >> 16)
        weight = [power[abs(s - 7)] for s in range(15)] + [(2 * power[8] << 16) // (65536 - ratio)]
        total = sum(weight)
        self.below = [18432] + [sum(weight[:s]) * 32640 // total + 8 * s for s in range(1, 16)]

    def learn(self, symbol):
        slowness = min(17 - (32767 - self.below[0]).bit_length(), 6)
        for i, v in enumerate(self.below):
            target = 32767 if i == 0 else 4 * i if i <= symbol else 32768 - 4 * (16 - i)
            self.below[i] = v + ((target - v) >> slowness)


class Decoder:
    """One stream."""

    def __init__(self, data):
        self.data, self.taken = data, 0
        self.state = self.take() + (self.take() << 16) + (self.take() << 32)
        if not 1 << 31 <= self.state < 1 << 47:
            raise Broken("a stream that no encoder begins")

    def take(self):
        word = int.from_bytes(self.data[self.taken:self.taken + 2].ljust(2, b"\0"), "little")
        self.taken += 2
        return word

    def slot(self):
        return self.state & 65535

    def advance(self, start, length):
        self.state = (self.state >> 16) * length + self.slot() - start
        if self.state < 1 << 31:
            self.state = (self.state << 16) + self.take()

    def decode(self, p):
        if self.slot() < p:
            self.advance(0, p)
            return 1
        self.advance(p, 65536 - p)
        return 0

    def raw(self, n):
        value = self.slot() >> (16 - n)
        self.advance(value << (16 - n), 1 << (16 - n))
        return value

    def adaptive(self, b, limit):
        bit = self.decode(b.probability())
        b.learn(bit, limit)
        return bit

    def mixed(self, bits, weights, limit):
        return self.mixed_several(bits, weights, limit, 1 << 31)

    def mixed_several(self, bits, weights, limit, largest=1 << 30):
        """Section 11.1: any number of adaptive bits, and weights that are limited."""
        s = [STRETCH[b.state >> 20] for b in bits]
        p = SQUASH[clamp(sum(a * w for a, w in zip(s, weights)) >> 16, -2047, 2047) + 2048]
        bit = self.decode(p)
        err = (65535 if bit else 0) - p
        for i, b in enumerate(bits):
            weights[i] = clamp(weights[i] + ((s[i] * err + 32768) >> 16), -largest, largest)
            b.learn(bit, limit)
        return bit

    def raw_bits(self, n):
        """Section 11.1: the upper bits first, 16 at a time."""
        value = 0
        while n > 0:
            now = min(n, 16)
            value, n = value << now | self.raw(now), n - now
        return value

    def integer(self, m):
        n = 0
        while n < 40 and self.adaptive(m.longer[n], 60):
            n += 1
        v = 1
        if n > 0:
            v = 2 * v + self.adaptive(m.top[n - 1], 60)
        for _ in range(n - 1):
            v = 2 * v + self.raw(1)
        return v - 1

    def signed(self, m):
        f = self.integer(m)
        return -(f + 1) // 2 if f % 2 else f // 2

    def check_exhausted(self):
        if self.taken > len(self.data):
            raise Broken("a stream ends too soon")

    def check_end(self):
        if self.taken != len(self.data) or self.state != 1 << 31:
            raise Broken("a stream has the wrong number of bytes")
