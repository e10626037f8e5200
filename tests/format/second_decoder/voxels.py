"""Values of voxels: section 7 of docs/dev/format.md."""

from .coding import RATE, Bits, Broken, Decoder, IntegerModel, clamp

TAPS = ((-1, 0, 0), (-2, 0, 0), (0, -1, 0), (-1, -1, 0), (1, -1, 0), (2, -1, 0), (-2, -1, 0), (0, -2, 0),
        (0, 0, -1), (-1, 0, -1), (1, 0, -1), (0, -1, -1), (0, 1, -1), (-1, -1, -1), (1, -1, -1), (-1, 1, -1),
        (1, 1, -1), (0, 0, -2))


def trit(v):
    return (v > 0) - (v < 0) + 1


def log_scale(m, v):
    e = (2 * v + 1).bit_length() - 1
    return max(0, (e - 1 << m) + ((2 * v + 1 << m) >> e) - (1 << m))


def thirds(v, step):
    """The integer nearest to 3 v / step, which is never halfway, as the step is odd."""
    return (6 * v + step) // (2 * step)


def low_bits(energy):
    return max(0, (energy >> 4).bit_length() - 2)


class Bias:
    def __init__(self):
        self.value = self.seen = 0

    def learn(self, deviation):
        self.value = clamp(self.value + ((deviation * RATE[self.seen]) >> 16), -(1 << 27), 1 << 27)
        self.seen += self.seen < 128


class Prediction:
    value = fraction = before = low = high = exact = size = 0
    flat = False


class Surroundings:
    """The values outside the brick for a decoder of voxels with its `values` and sizes mx, my, mz."""

    def V(self, x, y, z):
        if z == 0 and y < 0:
            return self.reference
        if z == -1:
            return self.V(x, y, 0)
        if y < 0:
            return self.V(x, 0, z - 1)
        if y >= self.my:
            return self.V(x, self.my - 1, z)
        if x < 0:
            if y > 0:
                return self.V(0, y - 1, z)
            return self.V(0, 0, z - 1) if z > 0 else self.reference
        return self.values[min(x, self.mx - 1), y, z]


def read_parameters(coder, sample_type):
    """low, high, reference, and the weights of the first slice and of the others."""
    low, high, reference = (sample_type.from_bits(coder.raw(8 * sample_type.size)) for _ in range(3))
    model = IntegerModel()
    both = []
    for count in (8, 18):
        weights = [0] * 18
        for t in range(count):
            weights[t] = (1024 if t in (0, 2) else 0) + clamp(coder.signed(model), -65536, 65536)
        both.append(weights)
    if low >= high or not low <= reference <= high or any(sum(map(abs, w)) > 16384 for w in both):
        raise Broken("values with impossible parameters")
    return low, high, reference, both


def weighted_sum(brick, x, y, z):
    """The exact prediction of a voxel, in 2^-11."""
    weights = brick.weights[z > 0]
    return brick.reference * (2048 - sum(weights)) + sum(
        w * brick.V(x + dx, y + dy, z + dz) for w, (dx, dy, dz) in zip(weights, TAPS) if w != 0)


class VoxelDecoder(Surroundings):
    """What the best effort is based on. `bound_at(x, y, z)` is the bound of a voxel, `least_bound` the
    smallest that the header allows."""

    carried = b""

    def __init__(self, data, size, sample_type, bound_at, least_bound):
        if data[:1] != b"\1":
            raise Broken("values of an unknown kind")
        self.coder = Decoder(data[1:])
        self.mx, self.my, self.mz = size
        self.bound_at = bound_at
        self.low, self.high, self.reference, self.weights = read_parameters(self.coder, sample_type)
        self.largest = (self.high - self.low) // (2 * least_bound + 1) + 1
        self.grey_scale = 4194304 // (self.high - self.low + 1)
        self.values, self.residuals = {}, {}
        self.biases = [Bias() for _ in range(8 * 24)]
        self.bits = Bits()
        self.flat_magnitude = IntegerModel()

    def R(self, x, y, z):
        return self.residuals.get((x, y, z), 0)

    def predict(self, x, y, z):
        V, R, p = self.V, self.R, Prediction()
        left, above = V(x - 1, y, z), V(x, y - 1, z)
        behind = V(x, y, z - 1) if z > 0 else above
        seen = [V(x - 1, y - 1, z), above, V(x + 1, y - 1, z)]
        if z > 0:
            seen += [behind, V(x + 1, y, z - 1), V(x, y + 1, z - 1)]
        p.high, p.low = max(seen), min(seen)
        if p.high == left == p.low:
            p.flat, p.value = True, left
            return p
        exact = p.exact = weighted_sum(self, x, y, z)

        def row(dy, d):
            return abs(R(x + d, y + dy, z) if y > 0 else R(x + d, y, z - 1))

        p.before = (3 * row(-1, 0) + row(-1, -1) + row(-1, 1) + row(-2, 0) + 3 * abs(R(x, y, z - 1)) +
                    abs(R(x + 1, y, z - 1)) + abs(R(x, y + 1, z - 1)))
        if z == 0:
            p.before += 3 * row(-1, 0) + row(-1, -1) + row(-1, 1)
        p.size = min(p.before.bit_length(), 15) // 2
        p.bias = self.biases[24 * p.size + self.texture(x, y, z, exact >> 11)]
        corrected = exact + p.bias.value
        rounded = (corrected + 1024) >> 11
        p.fraction = corrected - 2048 * rounded
        p.value = clamp(rounded, self.low, self.high)
        return p

    def texture(self, x, y, z, plain):
        behind = self.V(x, y, z - 1) if z > 0 else self.V(x, y - 1, z)
        return ((self.V(x, y - 1, z) > plain) + 2 * (self.V(x - 1, y, z) > plain) + 4 * (behind > plain) +
                8 * trit(self.R(x - 1, y, z)))

    def decode_flat_residual(self):
        coder, bits = self.coder, self.bits
        if not coder.adaptive(bits["flat zero"], 1000):
            return 0
        a = min(1 + coder.integer(self.flat_magnitude), self.largest)
        return -a if coder.adaptive(bits["flat sign"], 250) else a

    def decode_voxel(self, x, y, z, quiet):
        E = self.bound_at(x, y, z)
        step = 2 * E + 1
        p = self.predict(x, y, z)
        r = (0 if quiet else self.decode_flat_residual() if p.flat else
             self.decode_other_residual(x, y, z, p, E))
        v = clamp(p.value + r * step, self.low, self.high)
        self.values[x, y, z] = v
        self.residuals[x, y, z] = clamp(r, -4095, 4095)
        if not p.flat:
            self.learn(x, y, z, p, v, E)

    def run(self):
        was_quiet = {}
        for z in range(self.mz):
            for y in range(self.my):
                for s in range((self.mx + 63) // 64):
                    which = (was_quiet.get((s, y, z - 1), 1) + 2 * was_quiet.get((s, y - 1, z), 1) +
                             4 * was_quiet.get((s - 1, y, z), 1))
                    quiet = self.coder.adaptive(self.bits["quiet", which], 250)
                    was_quiet[s, y, z] = quiet
                    for x in range(64 * s, min(64 * s + 64, self.mx)):
                        self.decode_voxel(x, y, z, quiet)
                self.coder.check_exhausted()
        self.coder.check_end()
        return self.values


def decode_voxels(data, size, sample_type, bound_at, least_bound, decoder, carried):
    """Samples by (x, y, z), counted from 0 in the owned box. Bytes that the states carry are appended to `carried`."""
    if data[:1] == b"\0":
        if len(data) != 1 + sample_type.size:
            raise Broken("a constant brick of the wrong size")
        value = sample_type.from_bits(int.from_bytes(data[1:], "little"))
        mx, my, mz = size
        return {(x, y, z): value for z in range(mz) for y in range(my) for x in range(mx)}
    if not data:
        raise Broken("values are missing")
    if data[:1] == b"\3":
        mx, my, mz = size
        if len(data) != 1 + sample_type.size * mx * my * mz:
            raise Broken("a raw brick of the wrong size")
        samples = (sample_type.from_bits(int.from_bytes(data[i:i + sample_type.size], "little"))
                   for i in range(1, len(data), sample_type.size))
        return {(x, y, z): next(samples) for z in range(mz) for y in range(my) for x in range(mx)}
    brick = decoder(data, size, sample_type, bound_at, least_bound)
    samples = brick.run()
    carried += brick.carried
    return samples
