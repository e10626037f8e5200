"""Thresholds: section 14 of docs/dev/format.md."""

import math
import struct

from .coding import SQUASH, AdaptiveBit, Broken, Decoder, IntegerModel

LOGITS = (-32, -97, -166, -240, -326, -432, -581, -879)
LARGEST_FLOATS = {4: (2 - 2.0 ** -23) * 2.0 ** 127, 8: (2 - 2.0 ** -52) * 2.0 ** 1023}


def bits_of(number, size):
    return int.from_bytes(struct.pack("<f" if size == 4 else "<d", number), "little")


def number_of(sample, sample_type):
    """Samples of floats are kept as their bits."""
    if not sample_type.is_float:
        return sample
    return struct.unpack("<f" if sample_type.size == 4 else "<d", sample.to_bytes(sample_type.size, "little"))[0]


def sample_of(number, sample_type):
    return bits_of(number, sample_type.size) if sample_type.is_float else int(number)


def below(threshold, sample_type):
    """The largest sample below a threshold."""
    if not sample_type.is_float:
        return threshold - 1
    if sample_type.size == 8:
        return math.nextafter(threshold, -math.inf)
    bits = bits_of(threshold, 4)
    if threshold == 0:
        return -2.0 ** -149
    return struct.unpack("<f", struct.pack("<I", bits - 1 if threshold > 0 else bits + 1))[0]


def check_thresholds(thresholds, sample_type):
    lowest = -LARGEST_FLOATS[sample_type.size] if sample_type.is_float else sample_type.limits[0]
    highest = -lowest if sample_type.is_float else sample_type.limits[1]
    for i, t in enumerate(thresholds):
        legal = lowest < t <= highest and (t == int(t) if not sample_type.is_float else
                                           sample_type.size == 8 or struct.unpack("<f", struct.pack("<f", t))[0] == t)
        if not legal or (i > 0 and t <= thresholds[i - 1]):
            raise Broken("impossible thresholds")


def split_sides(values):
    """The sides, b"" if there are none, and the values after them."""
    if values[:1] != b"\x0a":
        return b"", values
    if len(values) < 5:
        raise Broken("sides without a length")
    length = int.from_bytes(values[1:5], "little")
    if not 1 <= length <= len(values) - 5:
        raise Broken("sides with an impossible length")
    return values[5:5 + length], values[5 + length:]


def start(logit):
    b = AdaptiveBit()
    b.state = SQUASH[logit + 2048] * 65536 + 4
    return b


def apply_sides(data, samples, size, thresholds, sample_type):
    coder, model = Decoder(data), IntegerModel()
    reach, bits, beside = [], [], []
    for t in thresholds:
        if sample_type.is_float:
            reach.append([struct.unpack("<d", coder.raw_bits(64).to_bytes(8, "little"))[0] for _ in range(2)])
        else:
            reach.append([float(coder.integer(model) - 1) for _ in range(2)])
        bits.append([[start(v) for v in LOGITS] for _ in range(2)])
        beside.append((below(t, sample_type), t))
    for z in range(size[2]):
        for y in range(size[1]):
            for x in range(size[0]):
                number = float(number_of(samples[x, y, z], sample_type))
                for k, t in enumerate(thresholds):
                    s = int(number >= t)
                    d = abs(number - beside[k][s])
                    if not d <= reach[k][s]:
                        continue
                    i = sum(8 * d > j * reach[k][s] for j in range(1, 8))
                    if coder.adaptive(bits[k][s][i], 1000):
                        number = float(beside[k][1 - s])
                        samples[x, y, z] = sample_of(beside[k][1 - s], sample_type)
        coder.check_exhausted()
    coder.check_end()
