"""Voxels of the efforts default and fast: sections 7.1 to 7.9 of docs/dev/format.md."""

import collections
import functools
import itertools
import math
import struct

from .coding import Bits, Broken, Decoder, SymbolModel, clamp
from .voxels import Prediction, Surroundings, log_scale, read_parameters, thirds, trit, weighted_sum


def float32(v):
    return struct.unpack("<f", struct.pack("<f", v))[0]


@functools.cache
def start_of(least):
    """Mean and divisor of a model for energies whose logarithm is at least this value."""
    energy = next(v for v in itertools.count() if log_scale(1, v) >= least)
    return energy + 1, 16 << max(0, energy.bit_length() - 6)


class ExtraBits:
    def __init__(self, data):
        self.data, self.at, self.pending, self.count = data, 0, 0, 0

    def extra(self, n):
        while self.count < n:
            byte = self.data[self.at] if self.at < len(self.data) else 0
            self.at += 1
            self.pending |= byte << self.count
            self.count += 8
        value = self.pending & ((1 << n) - 1)
        self.pending >>= n
        self.count -= n
        return value

    def number(self):
        n = 2
        while n < 18 and self.extra(1):
            n += 1
        return self.extra(n) + (1 << n) - 4

    def finished(self):
        return self.at == len(self.data) and self.pending == 0


class States:
    """The states of all lanes, by half and lane, or one state that stands for all of them."""

    def __init__(self, data, one):
        if len(data) % 2 or len(data) < (4 if one else 128):
            raise Broken("words of the states are missing")
        self.one = one
        count = 1 if one else 32
        self.states = list(struct.unpack_from(f"<{count}I", data))
        self.words = struct.unpack_from(f"<{len(data) // 2 - 2 * count}H", data, 4 * count)
        self.taken = 0

    def index(self, half, lane):
        return 0 if self.one else 16 * half + lane

    def slot(self, half, lane):
        return self.states[self.index(half, lane)] & 65535

    def advance_lane(self, half, lane, start, length):
        i = self.index(half, lane)
        state = (self.states[i] >> 16) * length + (self.states[i] & 65535) - start
        if state < 65536:
            if self.taken == len(self.words):
                raise Broken("values end too soon")
            state = (state << 16) + self.words[self.taken]
            self.taken += 1
        self.states[i] = state

    def finished(self):
        return self.taken == len(self.words) and all(s >> 16 == 1 for s in self.states)

    def carried(self):
        return b"".join((s & 65535).to_bytes(2, "little") for s in self.states)


class Bias:
    def __init__(self):
        self.value = self.seen = self.sum = self.count = 0

    def learn(self):
        n = self.count + self.seen
        change = math.trunc(float32(float32(self.sum) / float32(n + 0.5)))
        self.value = clamp(self.value + change, -(1 << 27), 1 << 27)
        self.seen, self.sum, self.count = min(n, 64), 0, 0


class Voxel:
    """What is known of a voxel before its residual."""


class LanesDecoder(Surroundings):
    one_distribution = False
    carried = b""

    def __init__(self, data, size, sample_type, bound_at, _least_bound):
        kind, data = data[0], data[1:]
        if kind not in (1, 2, 4, 5):
            raise Broken("values of an unknown kind")
        self.carries = kind >= 4
        self.mx, self.my, self.mz = size
        self.bound_at = bound_at
        head, data = self.part(data)
        bits, data = self.part(data)
        coder = Decoder(head)
        self.low, self.high, self.reference, self.weights = read_parameters(coder, sample_type)
        self.read_quiet_rows(coder)
        self.extra, self.states = ExtraBits(bits), States(data, kind in (1, 4))
        self.grey_scale = 4194304 // (self.high - self.low + 1)
        self.values, self.residuals, self.models = {}, {}, {}
        self.biases = [Bias() for _ in range(192)]
        self.values_of_biases = [0] * 192

    @staticmethod
    def part(data):
        size, at = 0, 0
        while True:
            if at == len(data) or at == 9:
                raise Broken("values end too soon")
            size |= (data[at] & 127) << (7 * at)
            at += 1
            if data[at - 1] < 128:
                break
        if size > len(data) - at:
            raise Broken("values end too soon")
        return data[at:at + size], data[at + size:]

    def read_quiet_rows(self, coder):
        self.quiet, models = {}, Bits()
        for z in range(self.mz):
            for y in range(self.my):
                which = (self.quiet.get((y, z - 1), 1) + 2 * self.quiet.get((y - 1, z), 1) +
                         4 * self.quiet.get((y + 1, z - 1), 1))
                self.quiet[y, z] = coder.adaptive(models[which], 250)
        coder.check_end()

    def R(self, x, y, z):
        return self.residuals.get((x, 0, z - 1) if y < 0 else (x, y, z), 0)

    def ticks(self):
        """By tick and half: lanes and voxels, in the order of lanes."""
        groups = (self.my + 15) // 16
        period = max(self.mx + 4, 48)
        lag = 32 if groups == 1 else max(32, period - 43)
        voxels = collections.defaultdict(list)
        for z in range(self.mz):
            for y in range(self.my):
                begin = (z // 2 * groups + y // 16) * period + 3 * (y % 16) + 2 + lag * (z % 2)
                for x in range(self.mx):
                    voxels[begin + x, z % 2].append((y % 16, x, y, z))
        for of_tick in voxels.values():
            of_tick.sort()
        return voxels, max((t for t, _ in voxels), default=-1)

    def predict(self, x, y, z, biases):
        V, R, p = self.V, self.R, Prediction()
        p.E = self.bound_at(x, y, z)
        step = 2 * p.E + 1
        left, above = V(x - 1, y, z), V(x, y - 1, z)
        behind = V(x, y, z - 1) if z > 0 else above
        seen = [V(x - 1, y - 1, z), above, V(x + 1, y - 1, z)]
        if z > 0:
            seen += [behind, V(x + 1, y, z - 1), V(x, y + 1, z - 1)]
        high, low = max(seen), min(seen)
        p.k, p.flip = 0, False
        if high == left == low:
            p.flat, p.value, p.texture, p.grey = True, left, 1024, 1024
            return p
        exact = weighted_sum(self, x, y, z)
        n, nn = [abs(R(x + d, y - 1, z)) for d in (0, -1, 1)], abs(R(x, y - 2, z))
        before = 3 * n[0] + n[1] + n[2] + nn + 3 * abs(R(x, y, z - 1)) + abs(R(x + 1, y, z - 1)) + abs(R(x, y + 1, z - 1))
        if z == 0:
            before += 3 * n[0] + n[1] + n[2]
        plain = exact >> 11
        sign = trit(R(x - 1, y, z))
        bias = (24 * (min(before.bit_length(), 15) // 2) + (above > plain) + 2 * (left > plain) + 4 * (behind > plain) +
                8 * sign)
        p.bias = self.biases[bias]
        corrected = exact + biases[bias]
        rounded = (corrected + 1024) >> 11
        p.fraction = corrected - 2048 * rounded
        p.value = clamp(rounded, self.low, self.high)
        c = min(256 * step, 1 << 22)
        p.usual = min(min(before + 8, (1 << 22) // c + 1) * c, (1 << 23) - 1)

        energy = before + 4 * abs(R(x - 1, y, z)) + abs(R(x - 2, y, z))
        coarse = min(log_scale(1, energy), 15)
        p.k = max(0, energy.bit_length() - 6)
        top, bottom = max(high, left), min(low, left)
        grey = ((p.value - self.low) * self.grey_scale) >> 16
        outside = max(p.value - top, bottom - p.value)
        if p.E == 0:
            p.flip = 1024 * (2 * p.value - top - bottom) + p.fraction < 0
            rest = -p.fraction if p.flip else p.fraction
            place = min((rest + 1024) >> 9, 3) + 4 * (outside > 0)
        else:
            p.flip = 2 * p.value < top + bottom
            place = clamp(thirds(outside, step) + 4, 0, 7)
        side = 2 - sign if p.flip else sign
        unlike = min(log_scale(1, 4 * (top - bottom) // step) // 2, 7)
        p.texture = 64 * coarse + 8 * unlike + 2 * side + place // 4
        p.grey = 8 * (4 * (grey // 2) + coarse // 4) + place
        return p

    def model(self, kind, c):
        if (kind, c) not in self.models:
            if c == {"texture": 1024, "grey": 1024}[kind]:
                start = 1, 64
            else:
                start = start_of(c // 64 if kind == "texture" else c // 8 % 4 * 4 + 2)
            self.models[kind, c] = SymbolModel(*start)
        return self.models[kind, c]

    def models_of(self, p):
        texture = self.model("texture", p.texture)
        return texture, texture if self.one_distribution else self.model("grey", p.grey)

    def read_symbol(self, half, lane, p):
        a, b = self.models_of(p)
        begin = [0] + [a.below[i] + b.below[i] for i in range(1, 16)] + [65536]
        slot = self.states.slot(half, lane)
        s = max(i for i in range(16) if begin[i] <= slot)
        self.states.advance_lane(half, lane, begin[s], begin[s + 1] - begin[s])
        return s

    def learn(self, coded):
        """`coded`: lanes, predictions and symbols."""
        groups = [coded[i:i + 1] for i in range(len(coded))]
        if len(coded) > 6:
            groups = [[c for c in coded if c[0] < 8], [c for c in coded if c[0] >= 8]]
        for group in groups:
            learned = {}
            for _, p, s in group:
                for model in set(self.models_of(p)):
                    moved = SymbolModel.__new__(SymbolModel)
                    moved.below = list(model.below)
                    moved.learn(s)
                    learned[id(model)] = model, moved.below
            for model, below in learned.values():
                model.below = below

    def decode_residuals(self, half, voxels):
        """Of one tick of a half: lanes and predictions of voxels in rows that are not quiet."""
        symbols = [(lane, p, self.read_symbol(half, lane, p)) for lane, p in voxels]
        low_bits = {}
        for lane, p, _ in symbols:
            if p.k > 0:
                low_bits[lane] = self.states.slot(half, lane) >> (16 - p.k)
                self.states.advance_lane(half, lane, low_bits[lane] << (16 - p.k), 1 << (16 - p.k))
        self.learn(symbols)
        for lane, p, s in symbols:
            d = s - 7
            if s == 15:
                negative = self.extra.extra(1)
                d = 8 + self.extra.number()
                d = -d if negative else d
            d = (d << p.k) + low_bits.get(lane, 0)
            largest = (self.high - self.low) // (2 * p.E + 1) + 1
            d = clamp(d, -largest, largest)
            p.residual = -d if p.flip else d

    def run(self):
        voxels, last = self.ticks()
        before = [b.value for b in self.biases]
        for t in range(last + 1):
            now = [b.value for b in self.biases]
            for half in (0, 1):
                predictions = [(lane, (x, y, z), self.predict(x, y, z, now if half else before))
                               for lane, x, y, z in voxels.get((t, half), [])]
                for _, _, p in predictions:
                    p.residual = 0
                self.decode_residuals(half, [(lane, p) for lane, (_, y, z), p in predictions if not self.quiet[y, z]])
                for _, at, p in predictions:
                    v = clamp(p.value + p.residual * (2 * p.E + 1), self.low, self.high)
                    self.values[at] = v
                    self.residuals[at] = clamp(p.residual, -4095, 4095)
                    if not p.flat:
                        deviation = clamp((v - p.value) * 2048 - p.fraction, -p.usual, p.usual)
                        p.bias.sum += deviation
                        p.bias.count += 1
            before = now
            if t in (0, 1, 3, 7, 15, 31) or (t > 31 and t % 8 == 7):
                for b in self.biases:
                    if b.count:
                        b.learn()
        if not (self.extra.finished() and self.states.finished()):
            raise Broken("values that do not end")
        if self.carries:
            self.carried = self.states.carried()
        elif any(self.states.carried()):
            raise Broken("states that carry what nobody wants")
        return self.values


class FastDecoder(LanesDecoder):
    one_distribution = True
