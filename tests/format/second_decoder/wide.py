"""Values of 32-bit integers and floats: section 11 of docs/dev/format.md. A float is kept as its bits."""

import math
import struct

from .coding import RATE, Bits, Broken, Decoder, IntegerModel, clamp
from .grid import add, along, base_edge, guess_of, passes
from .voxels import TAPS, Surroundings, trit

LARGEST_FIXED = 1 << 46


def log_steps(m, v):
    if v < 2 << m:
        return v
    octave = v.bit_length() - (m + 1)
    return (octave << m) + (v >> octave)


class Prediction:
    value = fraction = texture = spread = before = 0
    biases = ()


def float_of(bits, size):
    return struct.unpack("<f" if size == 4 else "<d", bits.to_bytes(size, "little"))[0]


def bits_of(value, size):
    """The bits of a double, rounded to the type."""
    try:
        packed = struct.pack("<f" if size == 4 else "<d", value)
    except OverflowError:
        packed = struct.pack("<f", math.copysign(math.inf, value))
    return int.from_bytes(packed, "little")


def key_of(bits, size):
    half = 1 << (8 * size - 1)
    return bits if bits < half else half - 1 - bits


def bits_from_key(key, size):
    half = 1 << (8 * size - 1)
    return key if key >= 0 else half - 1 - key


class ResidualModel:
    """Section 11.2."""

    def __init__(self, coder):
        self.coder, self.bits, self.weights = coder, Bits(), {}

    def mixed(self, bits, mixer):
        weights = self.weights.setdefault(mixer, [98304 // len(bits)] * len(bits))
        return self.coder.mixed_several(bits, weights, 255)

    def more(self, which, energy, views):
        keys = [("energy", which, energy)] + [("view", i, which, v) for i, v in enumerate(views)]
        return self.mixed([self.bits[key] for key in keys], (which, energy // 8))

    def decode(self, energy, views=(0, 0, 0), signs=(0, 0)):
        if not self.more(0, energy, views):
            return 0
        magnitude = 1
        if self.more(1, energy, views):
            path = 1
            for _ in range(6):
                path = 2 * path + self.coder.adaptive(self.bits["length", energy // 2, path], 255)
            digits, likely = path - 64, energy // 4
            place = 0 if digits + 4 < likely else 2 if digits + 3 > likely else 1
            left, node = digits, 1
            while left > 0 and node < 8:
                bit = self.coder.adaptive(self.bits["digit", digits, place, node], 255)
                node, magnitude, left = 2 * node + bit, 2 * magnitude + bit, left - 1
            if left > 0:
                magnitude = magnitude << left | self.coder.raw_bits(left)
        negative = self.mixed([self.bits["sign", i, s] for i, s in enumerate(signs)], "sign")
        return -magnitude if negative else magnitude


class Bias:
    def __init__(self):
        self.value = self.seen = 0

    def learn(self, deviation):
        self.value = clamp(self.value + ((deviation * RATE[self.seen]) >> 16), -(1 << 40), 1 << 40)
        self.seen += self.seen < 128


class WideVoxelDecoder(Surroundings):
    """`active(x, y, z)` selects the second bound; None if the header has only one."""

    def __init__(self, data, size, sample_type, active):
        self.coder, self.type, self.active = Decoder(data), sample_type, active
        self.mx, self.my, self.mz = size
        self.read_parameters()
        self.values, self.residuals, self.escaped = {}, {}, {}
        self.texture_biases = [Bias() for _ in range(8 * 24)]
        self.sign_biases = [Bias() for _ in range(8 * 81)]
        self.model, self.correction = ResidualModel(self.coder), ResidualModel(self.coder)
        self.bits = Bits()
        self.last_escaped = self.last_correction = 0

    def read_parameters(self):
        coder, two = self.coder, self.active is not None
        self.fixed = self.escapes = self.corrected = 0
        self.exponent = 0
        if self.type.is_float:
            self.fixed = coder.raw(1)
            if self.fixed:
                self.exponent = coder.raw(11) - 1000
            self.escapes, self.corrected = coder.raw(1), coder.raw(1)
            half = 1 << (8 * self.type.size - 1)
            least, most = (-LARGEST_FIXED, LARGEST_FIXED) if self.fixed else (-half, half - 1)
        else:
            least, most = self.type.limits
        impossible = self.exponent > 960 or (self.corrected and not (self.fixed and two))
        if impossible:
            raise Broken("values with impossible parameters")
        self.E = [coder.raw_bits(48) for _ in range(1 + two)]
        self.low, self.high, self.reference = (
            (v ^ 1 << 63) - (1 << 63) for v in (coder.raw_bits(64) for _ in range(3)))
        model, self.weights = IntegerModel(), []
        for count in (8, 18):
            weights = [0] * 18
            for t in range(18):
                weights[t] = 1024 if t in (0, 2) else 0
                if t < count:
                    weights[t] += clamp(coder.signed(model), -65536, 65536)
            self.weights.append(weights)
        if (self.low < least or self.high > most or not self.low <= self.reference <= self.high or
                max(self.E) > LARGEST_FIXED or any(sum(map(abs, w)) > 16384 for w in self.weights)):
            raise Broken("values with impossible parameters")

    def predict(self, x, y, z):
        p = Prediction()
        V = self.V

        def R(dx, dy, dz):
            return self.residuals.get((x + dx, y + dy, z + dz), 0)

        p.before = (3 * abs(R(0, -1, 0)) + abs(R(-1, -1, 0)) + abs(R(1, -1, 0)) + 3 * abs(R(0, 0, -1)) +
                    abs(R(1, 0, -1)) + abs(R(0, 1, -1)))
        left, above = V(x - 1, y, z), V(x, y - 1, z)
        behind = V(x, y, z - 1) if z > 0 else above
        seen = [left, V(x - 1, y - 1, z), above, V(x + 1, y - 1, z)]
        if z > 0:
            seen += [behind, V(x + 1, y, z - 1), V(x, y + 1, z - 1)]
        p.spread = max(seen) - min(seen)
        if p.spread == 0:
            p.value, p.texture = left, 0
            return p
        count = 18 if z > 0 else 8
        exact = 2048 * self.reference + sum(
            self.weights[z > 0][t] * (V(x + dx, y + dy, z + dz) - self.reference)
            for t, (dx, dy, dz) in enumerate(TAPS[:count]))
        plain, s = exact >> 11, trit(R(-1, 0, 0))
        p.texture = (above > plain) + 2 * (left > plain) + 4 * (behind > plain) + 8 * s
        size = min(log_steps(0, p.before), 15) // 2
        signs = 81 * size + 27 * trit(R(1, -1, 0)) + 9 * trit(R(0, -1, 0)) + 3 * trit(R(0, 0, -1)) + s
        p.biases = self.texture_biases[24 * size + p.texture], self.sign_biases[signs]
        corrected = exact + p.biases[0].value + p.biases[1].value
        rounded = (corrected + 1024) >> 11
        p.value, p.fraction = clamp(rounded, self.low, self.high), corrected - 2048 * rounded
        return p

    def contexts(self, x, y, z, p, E):
        def R(dx, dy, dz):
            return self.residuals.get((x + dx, y + dy, z + dz), 0)

        energy = p.before + 4 * abs(R(-1, 0, 0)) + abs(R(-2, 0, 0))
        k = max(0, (energy >> 4).bit_length() - 2)

        def cap(most, *offsets):
            return min(sum(abs(R(*d)) for d in offsets) >> k, most)

        centre = min(3 * abs(p.fraction) >> 10, 2) if E == 0 else 0
        views = (3 * log_steps(1, p.spread // (E + 1)) + centre,
                 (((cap(3, (-1, 0, 0)) * 3 + cap(2, (0, -1, 0))) * 3 + cap(2, (0, 0, -1))) * 3 +
                  cap(2, (-1, -1, 0), (1, -1, 0))) * 3 + cap(2, (1, 0, -1), (0, 1, -1)),
                 16 * p.texture + min(log_steps(0, energy), 15))
        signs = (((trit(R(-1, 0, 0)) * 3 + trit(R(0, -1, 0))) * 3 + trit(R(0, 0, -1))) * 8 + ((p.fraction + 1024) >> 8),
                 ((trit(R(-1, -1, 0)) * 3 + trit(R(1, -1, 0))) * 3 + trit(R(1, 0, -1))) * 8 + p.texture % 8)
        return log_steps(2, energy), views, signs

    def escaped_sample(self):
        if not self.coder.adaptive(self.bits["repeats"], 250):
            self.last_escaped = self.coder.raw_bits(8 * self.type.size)
        return self.last_escaped

    def sample_of(self, number):
        if not self.type.is_float:
            return number
        if not self.fixed:
            return bits_from_key(number, self.type.size)
        return bits_of(number * math.ldexp(1.0, self.exponent), self.type.size)

    def corrected_sample(self, lattice):
        size = self.type.size
        d = self.correction.decode(log_steps(2, self.last_correction))
        self.last_correction = abs(d)
        half = 1 << (8 * size - 1)
        return bits_from_key(clamp(key_of(lattice, size) + d, -half, half - 1), size)

    def decode_voxel(self, x, y, z):
        p = self.predict(x, y, z)
        if self.escapes:
            around = (self.escaped.get((x - 1, y, z), 0) + 2 * self.escaped.get((x, y - 1, z), 0) +
                      4 * self.escaped.get((x, y, z - 1), 0))
            if self.coder.adaptive(self.bits["escape", around], 1000):
                self.escaped[x, y, z] = 1
                self.values[x, y, z] = p.value
                return self.escaped_sample()
        active = self.active is not None and self.active(x, y, z)
        E = self.E[active]
        step = 2 * E + 1
        r = self.model.decode(*self.contexts(x, y, z, p, E))
        largest = min((self.high - self.low) // step + 1, (1 << 64) - 1)
        v = clamp(p.value + clamp(r, -largest, largest) * step, self.low, self.high)
        self.values[x, y, z] = v
        self.residuals[x, y, z] = clamp(r, -(1 << 58), 1 << 58)
        if p.spread > 0 and p.before < 1 << 13:
            usual = min((p.before + 8) * step * 256, 1 << 40)
            deviation = clamp((v - p.value) * 2048 - p.fraction, -usual, usual)
            for bias in p.biases:
                bias.learn(deviation)
        sample = self.sample_of(v)
        return self.corrected_sample(sample) if self.corrected and active else sample

    def run(self):
        samples = {}
        for z in range(self.mz):
            for y in range(self.my):
                for x in range(self.mx):
                    samples[x, y, z] = self.decode_voxel(x, y, z)
                self.coder.check_exhausted()
        self.coder.check_end()
        return samples


def decode_wide_voxels(data, size, sample_type, active):
    """Samples by (x, y, z), counted from 0 in the owned box."""
    if data[:1] == b"\0":
        if len(data) != 1 + sample_type.size:
            raise Broken("a constant brick of the wrong size")
        value = sample_type.from_bits(int.from_bytes(data[1:], "little"))
        mx, my, mz = size
        return {(x, y, z): value for z in range(mz) for y in range(my) for x in range(mx)}
    if data[:1] != b"\1":
        raise Broken("values of an unknown kind, or none")
    return WideVoxelDecoder(data[1:], size, sample_type, active or None).run()


def decode_wide_as_narrow(data, sample_type, bounds, decode_narrow):
    """11.3, kind 2. `decode_narrow` decodes samples of uint16, from bytes, both bounds and the exponent."""
    if len(data) < (14 if sample_type.is_float else 8):
        raise Broken("values end too soon")
    low, = struct.unpack_from("<q", data)
    if not sample_type.is_float:
        if not sample_type.limits[0] <= low <= sample_type.limits[1]:
            raise Broken("values with impossible parameters")
        numbers = decode_narrow(data[8:], [min(b, 65535) for b in bounds], 0)
        return {at: min(low + n, sample_type.limits[1]) for at, n in numbers.items()}
    exponent, *bounds_of_numbers = struct.unpack_from("<hHH", data, 8)
    if not -1000 <= exponent <= 960 or abs(low) > LARGEST_FIXED:
        raise Broken("values with impossible parameters")
    unit = math.ldexp(1.0, exponent)
    return {at: bits_of((low + n) * unit, sample_type.size)
            for at, n in decode_narrow(data[14:], bounds_of_numbers, exponent).items()}


def decode_wide_points(data, box, active, S, point_error, sample_type):
    """Values of the active points, by point."""
    coder, size = Decoder(data), sample_type.size
    escapes = coder.raw(1)
    if escapes and not sample_type.is_float:
        raise Broken("values of integers that escape")
    models = [ResidualModel(coder) for _ in range(7)]
    escape_bits, repeats = Bits(), Bits()
    numbers, values = {}, {}
    was_escape = last_escaped = 0
    half = 1 << (8 * size - 1)
    if not sample_type.is_float:
        most = (1 << 32) // (2 * point_error + 1) + 1
        least = -most
    elif point_error > 0:
        least, most = -LARGEST_FIXED, LARGEST_FIXED
    else:
        least, most = -half, half - 1

    def value_of(number):
        if not sample_type.is_float:
            return clamp(number * (2 * point_error + 1), *sample_type.limits)
        return bits_of(number * (2 * point_error), size) if point_error > 0 else bits_from_key(number, size)

    def decode_value(p, guess, kind, spread):
        nonlocal was_escape, last_escaped
        if escapes and coder.adaptive(escape_bits[was_escape], 250):
            was_escape = 1
            numbers[p] = guess
            if not coder.adaptive(repeats[0], 250):
                last_escaped = coder.raw_bits(8 * size)
            values[p] = last_escaped
            return
        was_escape = 0
        numbers[p] = clamp(guess + models[kind].decode(log_steps(2, spread)), least, most)
        values[p] = value_of(numbers[p])

    for p in box.raster((S, S, S)):
        before = [q for q in (add(p, along(a, -S)) for a in range(3)) if q in box]
        decode_value(p, numbers[before[0]] if before else 0, 0, 0)
    for u, odd, _, points in passes(box, S):
        for p in points:
            if p not in active:
                continue
            guess, spread = guess_of(p, u, odd, box, numbers)
            decode_value(p, guess, 4 - len(odd) + (3 if u == 1 else 0), spread)
        coder.check_exhausted()
    coder.check_end()
    return values


def mean(a, b):
    if math.isfinite(a + b):
        return (a + b) * 0.5
    if math.isfinite(a):
        return a * 0.5 + b * 0.5 if math.isfinite(b) else a
    return b if math.isfinite(b) else math.nan


def interpolate_floats(points, box, S, sample_type):
    """The bits of the sample of every point of the box."""
    size = sample_type.size
    numbers = {p: float_of(bits, size) for p, bits in points.items()}
    samples = dict(points)
    for u, odd, _, in_pass in passes(box, S):
        for p in in_pass:
            if p in points:
                continue
            left, right = base_edge(p, u, odd, S)
            numbers[p] = mean(numbers[left], numbers[right])
            nan = 0x7FC00000 if size == 4 else 0x7FF8 << 48
            samples[p] = nan if math.isnan(numbers[p]) else bits_of(numbers[p], size)
    return samples
