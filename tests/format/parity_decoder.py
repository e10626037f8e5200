"""Repairs a file by its parity, slowly. Written from section 3.6 of docs/dev/format.md alone."""

import struct

MAGIC = b"TAG PAR\n"
HEAD, FOOT = (1 << 32) - 2, (1 << 32) - 1

EXP, LOG = [0] * 510, [0] * 256
value = 1
for power in range(255):
    EXP[power] = EXP[power + 255] = value
    LOG[value] = power
    value = value << 1 ^ (0x11D if value & 0x80 else 0)


class Lost(Exception):
    """More is damaged than parity makes up for."""


def inverse(a):
    return EXP[255 - LOG[a]]


def scaled(block, factor):
    """Each byte times a factor."""
    if factor == 0:
        return bytes(len(block))
    return block.translate(bytes([0] + [EXP[LOG[a] + LOG[factor]] for a in range(1, 256)]))


def added(a, b):
    return (int.from_bytes(a, "little") ^ int.from_bytes(b, "little")).to_bytes(len(a), "little")


def ceil(a, b):
    return (a + b - 1) // b


class Numbers:
    """The fields of a description, and what follows from them."""

    def __init__(self, description, base):
        (self.f, self.id, self.s, self.number, _, log2, self.m, _) = struct.unpack_from("<QQIIIBBH", description, 8)
        self.same = description[:28]
        self.b = 1 << log2
        self.p = self.b - 48
        self.n = ceil(self.f, self.b)
        self.k = ceil(self.n, self.s)
        self.t = ceil(8 * (self.n + self.s * self.m), self.p)
        self.g = ceil(self.t, 127)
        self.kg = ceil(self.t, self.g)
        self.mg = max(self.kg, self.m)
        self.base = self.f if base is None else base
        self.u = self.b * ceil(self.base + 48, self.b)

    def page(self, number):
        return self.u + self.b * (number if number < self.t else number + self.s * self.m)

    def parity(self, number):
        return self.u + self.b * (self.t + number)


def solve(blocks, k, size):
    """Fills in the data blocks of a stripe that are None, by Gaussian elimination."""
    unknown = [c for c in range(k) if blocks[c] is None]
    rows = []
    for r in range(len(blocks) - k):
        if blocks[k + r] is None or len(rows) == len(unknown):
            continue
        right = blocks[k + r]
        for c in range(k):
            if blocks[c] is not None:
                right = added(right, scaled(blocks[c], inverse((k + r) ^ c)))
        rows.append(([inverse((k + r) ^ c) for c in unknown], right))
    if len(rows) < len(unknown):
        raise Lost
    for i in range(len(unknown)):
        pivot = next(j for j in range(i, len(rows)) if rows[j][0][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        factor = inverse(rows[i][0][i])
        rows[i] = (list(scaled(bytes(rows[i][0]), factor)), scaled(rows[i][1], factor))
        for j in range(len(rows)):
            if j != i and rows[j][0][i]:
                factor = rows[j][0][i]
                rows[j] = (list(added(bytes(rows[j][0]), scaled(bytes(rows[i][0]), factor))),
                           added(rows[j][1], scaled(rows[i][1], factor)))
    for c, (_, right) in zip(unknown, rows):
        blocks[c] = right


def at(data, begin, size):
    """Bytes of a file, and zeros where it ends."""
    return data[begin:begin + size].ljust(size, b"\0")


def find(data, xxh3, base):
    """The numbers of the first page that lies where it says it must."""
    for begin in range(0, len(data), 512):
        if data[begin:begin + 8] != MAGIC or len(data) < begin + 512:
            continue
        numbers = Numbers(data[begin:], base)
        page = data[begin:begin + numbers.b]
        if len(page) == numbers.b and xxh3(page[:-8]) == struct.unpack("<Q", page[-8:])[0] and \
                begin == numbers.page(numbers.number):
            return numbers
    raise Lost


def repaired(data, xxh3, beside=None):
    """The F bytes that were protected. `xxh3` is the checksum; `beside` the content of FILE.parity."""
    parity = data if beside is None else beside
    z = find(parity, xxh3, None if beside is None else 0)
    table = {}
    for group in range(z.g):
        numbers = [c * z.g + group for c in range(z.kg)] + [z.t + r * z.g + group for r in range(z.mg)]
        payloads = []
        for i, number in enumerate(numbers):
            if i < z.kg and number >= z.t:
                payloads.append(bytes(z.p))
                continue
            page = at(parity, z.page(number), z.b)
            right = page[:28] == z.same and page[28:32] == struct.pack("<I", number) and \
                xxh3(page[:-8]) == struct.unpack("<Q", page[-8:])[0]
            payloads.append(page[40:-8] if right else None)
        solve(payloads, z.kg, z.p)
        table.update({number: payload for number, payload in zip(numbers[:z.kg], payloads)})
    sums = b"".join(table[i] for i in range(z.t))[:8 * (z.n + z.s * z.m)]
    if xxh3(sums) != z.id:
        raise Lost
    sums = struct.unpack(f"<{len(sums) // 8}Q", sums)
    result = [None] * z.n
    for stripe in range(z.s):
        blocks = []
        for c in range(z.k):
            i = c * z.s + stripe
            block = at(data[:z.f], i * z.b, z.b) if i < z.n else bytes(z.b)
            blocks.append(block if i >= z.n or xxh3(block) == sums[i] else None)
        for r in range(z.m):
            j = r * z.s + (stripe - z.n) % z.s
            block = at(parity, z.parity(j), z.b)
            blocks.append(block if xxh3(block) == sums[z.n + j] else None)
        if None in blocks[:z.k]:
            solve(blocks, z.k, z.b)
        for c in range(z.k):
            if c * z.s + stripe < z.n:
                result[c * z.s + stripe] = blocks[c]
    return b"".join(result)[:z.f]
