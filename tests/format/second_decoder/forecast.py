"""The forecast of the activity from decoded samples: section 6.6 of docs/format.md."""

import ctypes
import math

from .coding import clamp
from .grid import Box, base_edge, parents, passes


def f32(v):
    return ctypes.c_float(v).value


INVERSE_SQRT = [0.0, 1.0, f32(0.70710678), f32(0.57735027)]
SQRT_OVER_THREE = [0.0, f32(1 / 3), f32(0.47140452), f32(0.57735027)]
B, D, C = (1, 4, 1), (-1, 0, 1), (1, -2, 1)
# Stencils along x, y, z of the value, the gradient and the second derivatives, by axes.
STENCILS = {(): (B, B, B), (0,): (D, B, B), (1,): (B, D, B), (2,): (B, B, D), (0, 0): (C, B, B), (1, 1): (B, C, B),
            (2, 2): (B, B, C), (0, 1): (D, D, B), (0, 2): (D, B, D), (1, 2): (B, D, D)}


class Field:
    """The derivatives at the ends of base edges, of heights given by a function of the point."""

    def __init__(self, height, scale):
        self.height, self.known = height, {}
        self.rise_scale = f32(scale / 216)
        self.factors = [1.0, f32(scale / 72), f32(scale / 36), f32(scale / 24)]

    def at(self, q, axes):
        if (q, axes) not in self.known:
            x, y, z = STENCILS[axes]
            total = sum(x[i] * y[j] * z[k] * self.height((q[0] + i - 1, q[1] + j - 1, q[2] + k - 1))
                        for i in range(3) for j in range(3) for k in range(3) if x[i] * y[j] * z[k] != 0)
            factor = self.factors[3 if len(axes) == 2 and axes[0] != axes[1] else len(axes)]
            self.known[q, axes] = f32(f32(total) * factor)
        return self.known[q, axes]

    def slope(self, q, odd, sign):
        total = self.at(q, (odd[0],))
        for a in odd[1:]:
            total = f32(total + sign[a] * self.at(q, (a,)))
        return f32(total * INVERSE_SQRT[len(odd)])

    def bend(self, q, odd, sign):
        total = self.at(q, (odd[0], odd[0]))
        for a in odd[1:]:
            total = f32(total + self.at(q, (a, a)))
        if len(odd) == 1:
            return total
        mixed = sign[odd[1]] * self.at(q, (odd[0], odd[1]))
        if len(odd) == 3:
            mixed = f32(mixed + sign[2] * self.at(q, (0, 2)))
            mixed = f32(mixed + sign[1] * sign[2] * self.at(q, (1, 2)))
        return f32(f32(total + f32(2 * mixed)) * (0.5 if len(odd) == 2 else f32(1 / 3)))


def exceeded(field, left, right, odd, u, limit):
    """The number of thresholds that the base edge from left to right exceeds."""
    sign = {a: 1 if right[a] > left[a] else -1 for a in odd}
    chord = f32(f32(f32(field.at(right, ()) - field.at(left, ())) * field.rise_scale) * (INVERSE_SQRT[len(odd)] / (2 * u)))
    stretch = f32(1 + f32(chord * chord))
    sixth = SQRT_OVER_THREE[len(odd)] * u
    sl, sr = (f32(field.slope(q, odd, sign) - chord) for q in (left, right))
    bl, br = (f32(sixth * field.bend(q, odd, sign)) for q in (left, right))
    p, s, a, b = f32(sl - sr), f32(sl + sr), f32(br - bl), f32(bl + br)
    even = f32(f32(p * f32(f32(91 * p) + f32(106 * b))) + f32(39 * f32(b * b)))
    other = f32(f32(s * f32(f32(117 * s) - f32(166 * a))) + f32(73 * f32(a * a)))
    variance, bound = f32(even + other), f32(limit * f32(stretch * stretch))
    return (variance > f32(f32(0.6) * bound)) + (variance > bound) + (variance > f32(f32(1.6) * bound))


def height_of(sample, range_low, scale):
    """A sample of a wide type in voxels, a multiple of 2^-20."""
    if not math.isfinite(sample):
        return math.nan
    return math.floor(clamp((float(sample) - range_low) * scale, -2.0**20, 2.0**20) * 2.0**20 + 0.5) / 2.0**20


def forecast(samples, owned, closed, header):
    """The forecast by point; that of missing points is 0. samples: numbers of the owned box by point."""
    if header.type.is_wide:
        heights = {p: height_of(v, header.range_low, header.scale) for p, v in samples.items()}
        scale = 1.0
    else:
        heights, scale = samples, f32(header.scale)

    def height(p):
        return heights[tuple(clamp(p[a], owned.low[a], owned.high[a]) for a in range(3))]

    field, limit = Field(height, scale), f32(2369 / header.accuracy**2)
    volume = Box((0, 0, 0), tuple(n - 1 for n in header.dims))
    result = {}
    for u, odd, cycle, points in reversed(list(passes(closed, header.S))):
        for p in points:
            value = result.get(p, 0)
            if p in volume and 3 * cycle + 4 - len(odd) <= header.level_limit:
                value = max(value, exceeded(field, *base_edge(p, u, odd, header.S), odd, u, limit))
            if value > 0:
                result[p] = value
                for q in parents(p, u, odd, header.S):
                    if q in closed:
                        result[q] = max(result.get(q, 0), value)
    return result
