"""Range coder, adaptive bits, mixing, integers: section 5 of docs/format.md."""

import math
import zlib


class Broken(Exception):
    """The bytes are not those of a .tag file, version 1."""


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
    """Adaptive bits by any key, made when first asked for."""

    def __missing__(self, key):
        self[key] = AdaptiveBit()
        return self[key]


class Mixers(dict):
    def __missing__(self, key):
        self[key] = [24576] * 4
        return self[key]


class IntegerModel:
    def __init__(self):
        self.longer, self.top = Bits(), Bits()


class Decoder:
    """One stream."""

    def __init__(self, data):
        self.data, self.taken = data, 0
        self.range = (1 << 64) - 1
        self.word = self.take() << 32
        self.word += self.take()

    def take(self):
        word = int.from_bytes(self.data[self.taken:self.taken + 4].ljust(4, b"\0"), "big")
        self.taken += 4
        return word

    def renormalize(self):
        if self.range < 1 << 32:
            self.word = (self.word << 32 & (1 << 64) - 1) + self.take()
            self.range <<= 32

    def decode(self, p):
        bound = (self.range >> 16) * p
        bit = self.word < bound
        if bit:
            self.range = bound
        else:
            self.word -= bound
            self.range -= bound
        self.renormalize()
        return int(bit)

    def raw(self, n):
        self.range >>= n
        value = min(self.word // self.range, (1 << n) - 1)
        self.word -= value * self.range
        self.renormalize()
        return value

    def adaptive(self, b, limit):
        bit = self.decode(b.probability())
        b.learn(bit, limit)
        return bit

    def mixed(self, bits, weights, limit):
        s = [STRETCH[b.state >> 20] for b in bits]
        p = SQUASH[clamp(sum(a * w for a, w in zip(s, weights)) >> 16, -2047, 2047) + 2048]
        bit = self.decode(p)
        error = (65535 if bit else 0) - p
        for i in range(4):
            weights[i] += (s[i] * error + 32768) >> 16
            bits[i].learn(bit, limit)
        return bit

    def mixed_several(self, bits, weights, limit):
        """Section 11.1: any number of adaptive bits."""
        s = [STRETCH[b.state >> 20] for b in bits]
        p = SQUASH[clamp(sum(a * w for a, w in zip(s, weights)) >> 16, -2047, 2047) + 2048]
        bit = self.decode(p)
        error = (65535 if bit else 0) - p
        for i, b in enumerate(bits):
            weights[i] = clamp(weights[i] + ((s[i] * error + 32768) >> 16), -(1 << 30), 1 << 30)
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
        if self.taken > len(self.data) + 4:
            raise Broken("a stream ends too soon")

    def check_end(self):
        if self.taken != len(self.data) + 4:
            raise Broken("a stream has the wrong number of bytes")
