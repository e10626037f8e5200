"""Voxels of the best effort: section 7.10 of docs/dev/format.md."""

from .coding import SQUASH, STRETCH, AdaptiveBit, IntegerModel, clamp
from .voxels import TAPS, Bias, VoxelDecoder, log_scale, low_bits, thirds, trit

MORE_TAPS = ((-1, -2, 0), (1, -2, 0), (-2, 0, -1), (2, 0, -1), (0, 1, -2), (0, -1, -2))
FEATURES = range(24)


def toward_zero(a, b):
    return a // b if a >= 0 else -(-a // b)


class LeastSquares:
    def __init__(self, penalty):
        self.penalty = penalty
        self.weights, self.gradient = [0] * 24, [0] * 24
        self.products = [[0] * 24 for _ in FEATURES]
        self.batch, self.turn = [], 0

    def predict(self, f):
        self.predicted = sum(a * b for a, b in zip(f, self.weights))
        return self.predicted

    def learn(self, f, target):
        if not self.batch:
            self.gradient = [g - (g >> 5) for g in self.gradient]
        error = target * 65536 - self.predicted
        self.gradient = [g + error * v for g, v in zip(self.gradient, f)]
        self.batch.append(f)
        if len(self.batch) < 4:
            return
        for i in FEATURES:
            row = self.products[i]
            for j in FEATURES:
                row[j] += sum(b[i] * b[j] for b in self.batch) - (row[j] >> 5)
        self.batch = []
        for i in range(self.turn, 24, 2):
            row, old = self.products[i], self.weights[i]
            change = toward_zero(self.gradient[i] - self.penalty * old, row[i] + self.penalty)
            self.weights[i] = clamp(old + change, -524288, 524288)
            for j in FEATURES:
                self.gradient[j] -= row[j] * (self.weights[i] - old)
        self.turn = 1 - self.turn


class GradientDescent:
    def __init__(self, floor):
        self.floor, self.weights = floor, [0] * 24

    def predict(self, f):
        return sum(a * b for a, b in zip(f, self.weights))

    def learn(self, f, error):
        gain = toward_zero(error * 16777216, sum(v * v for v in f) + self.floor)
        self.weights = [clamp(w + (gain * v >> 8), -8388608, 8388608) for w, v in zip(self.weights, f)]


class MixedModel:
    """Events predicted in eight contexts. State is created when it is first used, with its initial value."""

    def __init__(self, coder):
        self.coder, self.bits, self.mixers, self.refined, self.far = coder, {}, {}, {}, IntegerModel()

    def event(self, event, contexts, energy, spread):
        bits = [self.bits.setdefault((i, c, event), AdaptiveBit()) for i, c in enumerate(contexts)]
        inputs = [STRETCH[b.state >> 20] for b in bits]
        weights = [self.mixers.setdefault(key, [10240] * 8) for key in ((0, energy, event), (1, spread, event))]
        mixed = [clamp(sum(a * (w >> 4) for a, w in zip(inputs, ws)) >> 12, -2047, 2047) for ws in weights]
        at, part = divmod((sum(mixed) >> 1) + 2048, 128)
        refined = self.refined.setdefault((energy, event), [SQUASH[min(128 * i, 4095)] for i in range(33)])
        second = (refined[at] * (128 - part) + refined[at + 1] * part) >> 7
        bit = self.coder.decode(clamp((SQUASH[128 * at + part] + second) >> 1, 1, 65535))
        target = 65535 if bit else 0
        nearer = at + (part > 64)
        refined[nearer] += (target - refined[nearer]) >> 6
        for ws, m in zip(weights, mixed):
            err = (target - SQUASH[m + 2048]) >> 1
            for i, a in enumerate(inputs):
                ws[i] = clamp(ws[i] + ((a * err * 3 + 16384) >> 15), -524288, 524288)
        for b in bits:
            b.learn(bit, 400)
        return bit

    def residual(self, k, largest, *context):
        if not self.event(0, *context):
            return 0
        negative = self.event(1, *context)
        upper = 0
        while upper < 14 and self.event(2 + upper, *context):
            upper += 1
        if upper == 14:
            upper += min(self.coder.integer(self.far), 1 << 18)
        magnitude, node = upper, 16 + 4 * min(upper, 3)
        if k > 0:
            top = self.event(node, *context)
            magnitude = 2 * magnitude + top
        if k > 1:
            magnitude = 2 * magnitude + self.event(node + 1 + top, *context)
        if k > 2:
            magnitude = (magnitude << k - 2) + self.coder.raw(k - 2)
        magnitude = min(magnitude + 1, largest)
        return -magnitude if negative else magnitude


class BestDecoder(VoxelDecoder):
    def __init__(self, data, size, sample_type, bound_at, least_bound):
        super().__init__(data, size, sample_type, bound_at, least_bound)
        self.fine = clamp(12 - (self.high - self.low).bit_length(), -3, 4)
        self.squares = LeastSquares(self.squared(1 + least_bound * (least_bound + 1) // 3))
        self.gradient = GradientDescent(self.squared(160))
        self.miss = {}
        self.sign_biases = [Bias() for _ in range(8 * 81)]
        self.mixed = MixedModel(self.coder)

    def squared(self, square):
        return 1 + (square >> -2 * self.fine if self.fine < 0 else square << 2 * self.fine)

    def features(self, x, y, z, fitted):
        def V(dx, dy, dz):
            return self.V(x + dx, y - 1, 0) if z == 0 and dz < 0 else self.V(x + dx, y + dy, z + dz)

        return [clamp((V(*tap) * 2048 - fitted) >> 11 - self.fine, -4095, 4095) for tap in TAPS + MORE_TAPS]

    def missed_around(self, x, y, z):
        sums = [0, 0, 0]
        for weight, dx, dy, dz in ((2, -1, 0, 0), (1, -2, 0, 0), (2, 0, -1, 0), (1, -1, -1, 0), (1, 1, -1, 0),
                                   (1, 0, -2, 0), (2, 0, 0, -1), (1, -1, 0, -1), (1, 1, 0, -1), (1, 0, 1, -1)):
            for c, m in enumerate(self.miss.get((x + dx, y + dy, z + dz), (0, 0, 0))):
                sums[c] += weight * m
        return sums

    def predict(self, x, y, z):
        p = super().predict(x, y, z)
        if p.flat:
            return p
        p.fitted = clamp(p.exact, self.low * 2048, self.high * 2048)
        p.features = self.features(x, y, z, p.fitted)
        p.gradient, p.squares = (
            clamp(p.fitted + (model.predict(p.features) >> bits - 11 + self.fine), self.low * 2048, self.high * 2048)
            for model, bits in ((self.gradient, 20), (self.squares, 16)))
        missed = self.missed_around(x, y, z)
        p.missed = missed[2]
        coarser = max(0, max(missed).bit_length() - 10)
        trust = [(1 << 34) // ((m >> coarser) + 4) ** 3 for m in missed]
        blended = p.fitted + toward_zero(
            trust[1] * (p.gradient - p.fitted) + trust[2] * (p.squares - p.fitted), sum(trust))
        p.texture = self.texture(x, y, z, blended >> 11)
        signs = self.trits(x, y, z, (1, -1, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0))
        p.signs = signs
        p.biases = self.biases[24 * p.size + p.texture], self.sign_biases[81 * p.size + signs]
        p.corrected = blended + (sum(b.value for b in p.biases) >> 1)
        p.value = clamp((p.corrected + 1024) >> 11, self.low, self.high)
        return p

    def trits(self, x, y, z, *places):
        number = 0
        for dx, dy, dz in places:
            number = 3 * number + trit(self.R(x + dx, y + dy, z + dz))
        return number

    def decode_other_residual(self, x, y, z, p, E):
        def R(dx, dy, dz):
            return abs(self.R(x + dx, y + dy, z + dz))

        step = 2 * E + 1
        left, above, behind = R(-1, 0, 0), R(0, -1, 0), R(0, 0, -1)
        energy = p.before + 4 * left + R(-2, 0, 0)
        mixer1, coarse, k = log_scale(2, energy), min(log_scale(1, energy), 15), low_bits(energy)
        here = self.V(x - 1, y, z)
        top, bottom = max(p.high, here), min(p.low, here)
        unlike = min(log_scale(1, 4 * (top - bottom) // step), 31)
        grey = ((p.value - self.low) * self.grey_scale) >> 16
        if E == 0:
            fraction = clamp(p.corrected - p.value * 2048, -1024, 1023)
            side, off = (fraction + 1024) >> 8, min(3, abs(fraction) >> 8)
        else:
            place = clamp(thirds(max(p.value - top, bottom - p.value), step) + 1, 0, 3)
            side = 3 - place if 2 * p.value < top + bottom else 4 + place
            off = side // 2
        reciprocal = (1 << 40) // step + 1

        def quarters(difference):
            return clamp(((difference >> 5) * reciprocal + (1 << 43)) >> 44, -7, 7) + 7

        def cap(v, most):
            return min(v >> k, most)

        pattern = cap(left, 3)
        for v in (above, behind, R(-1, -1, 0) + R(1, -1, 0), R(1, 0, -1) + R(0, 1, -1)):
            pattern = 3 * pattern + cap(v, 2)
        contexts = ((3 * mixer1 + trit(self.R(x - 1, y, z))) * 8 + side,
                    (8 * unlike + coarse // 2) * 8 + side,
                    (8 * grey + coarse // 2) * 4 + off,
                    8 * pattern + side,
                    (16 * p.texture + coarse) * 8 + side,
                    (quarters(p.squares - p.fitted) * 15 + quarters(p.gradient - p.fitted)) * 16 + coarse,
                    (8 * p.signs + coarse // 2) * 4 + side // 2,
                    8 * min(log_scale(2, 2 * p.missed // step >> 4), 63) + side)
        return self.mixed.residual(k, self.largest, contexts, mixer1, 8 * unlike + side)

    def learn(self, x, y, z, p, v, E):
        truth = v * 2048
        self.miss[x, y, z] = [min(abs(truth - c) >> 7, 65535) for c in (p.fitted, p.gradient, p.squares)]
        self.squares.learn(p.features, clamp((truth - p.fitted) >> 11 - self.fine, -4095, 4095))
        self.gradient.learn(p.features, (truth - p.gradient) >> 11 - self.fine)
        usual = (p.before + 8) * (2 * E + 1) * 256
        deviation = clamp(truth - p.corrected, -usual, usual)
        for bias in p.biases:
            bias.learn(deviation)
