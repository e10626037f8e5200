"""The forecast of the activity from decoded samples: section 6.6 of docs/dev/format.md."""

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


def quotient(a, b):
    """[a / b], also by zero."""
    if b == 0:
        return math.nan if a == 0 or a != a else math.copysign(math.inf, a)
    return f32(a / b)


def dot(a, b):
    return f32(f32(a[0] * b[0]) + f32(a[1] * b[1]))


def plus(a, b):
    return f32(a[0] + b[0]), f32(a[1] + b[1])


def minus(a, b):
    return f32(a[0] - b[0]), f32(a[1] - b[1])


def times(s, a):
    return f32(s * a[0]), f32(s * a[1])


def series(x, divisors):
    """1 - x/d0 (1 - x/d1 (1 - ...))"""
    value = 1.0
    for d in reversed(divisors):
        value = f32(1 - f32(f32(x * f32(1 / d)) * value))
    return value


def shares_of_legs():
    """The shares of three legs in each of the four pieces of a segment."""
    def shares(t):
        b0, b3 = (1 - t) * (1 - t) * (1 - t) / 6, t * t * t / 6
        return 1 - b0, (1 + 3 * t + 3 * t * t - 3 * t * t * t) / 6 + b3, b3
    return [[f32(to - start) for start, to in zip(shares(k / 4), shares((k + 1) / 4))] for k in range(4)]


SHARES = shares_of_legs()


class Criterion:
    def __init__(self, accuracy):
        half = math.pi / accuracy
        x = half * half
        d = x / 6 * (1 - x / 20 * (1 - x / 42 * (1 - x / 72 * (1 - x / 110 * (1 - x / 156)))))
        self.excesses = [f32(f * (d / (1 - d))) for f in (0.6, 1.0, 1.6)]
        self.turn = f32(2 * half)
        self.least = f32(1184.5 / accuracy**2)

    def around_end(self, slope, bend, longest):
        """The control points before and after an end, relative to it."""
        unit = quotient(1, f32(math.sqrt(f32(1 + f32(slope * slope)))))
        curvature = f32(abs(bend) * f32(f32(unit * unit) * unit))
        arc = quotient(self.turn, curvature)
        arc = arc if arc < longest else longest
        angle = f32(arc * curvature)
        square = f32(angle * angle)
        along = f32(arc * series(square, (6, 20, 42, 72, 110, 156)))
        inwards = f32(f32(arc * angle) * f32(0.5 * series(square, (12, 30, 56, 90, 132))))
        across = -inwards if bend < 0 else inwards
        tangent = unit, f32(slope * unit)
        centre = f32(-across * tangent[1]), f32(across * tangent[0])
        return minus(centre, times(along, tangent)), plus(centre, times(along, tangent))

    def exceeded(self, field, left, right, odd, u):
        """The number of excesses that the base edge from left to right exceeds."""
        sign = {a: 1 if right[a] > left[a] else -1 for a in odd}
        rise = f32(f32(field.at(right, ()) - field.at(left, ())) * field.rise_scale)
        slopes = [field.slope(q, odd, sign) for q in (left, right)]
        bends = [field.bend(q, odd, sign) for q in (left, right)]
        if not self.varies(rise, slopes, bends, len(odd), u):
            return 0
        end = f32(2 * u * [0, 1.0, f32(1.41421356), f32(1.73205081)][len(odd)]), rise
        third = f32(f32(math.sqrt(dot(end, end))) * f32(1 / 3))
        (l_before, l_after), (r_before, r_after) = (self.around_end(*e, third) for e in zip(slopes, bends))
        legs = [(-l_before[0], -l_before[1]), l_after, plus(end, minus(r_before, l_after)),
                (-r_before[0], -r_before[1]), r_after]
        line = plus(end, times(f32(1 / 6), minus(plus(r_before, r_after), plus(l_before, l_after))))
        distance = f32(math.sqrt(dot(line, line)))
        direction = times(quotient(1, distance), line)

        def piece(segment, k):
            w = SHARES[k]
            v = plus(plus(times(w[0], legs[segment]), times(w[1], legs[segment + 1])), times(w[2], legs[segment + 2]))
            forward, aside = dot(v, direction), f32(f32(v[0] * direction[1]) - f32(v[1] * direction[0]))
            both = f32(f32(math.sqrt(dot(v, v))) + abs(forward))
            return quotient(f32(aside * aside), both) if forward > 0 else both

        segments = [f32(f32(piece(s, 0) + piece(s, 1)) + f32(piece(s, 2) + piece(s, 3))) for s in range(3)]
        over = f32(f32(segments[0] + segments[1]) + segments[2])
        if not over < math.inf:
            return 0
        return sum(over > f32(e * distance) for e in self.excesses)

    def varies(self, rise, slopes, bends, k, u):
        chord = f32(rise * f32(INVERSE_SQRT[k] * (0.5 / u)))
        incline = f32(1 + f32(chord * chord))
        sixth = f32(SQRT_OVER_THREE[k] * u)
        sl, sr = (f32(v - chord) for v in slopes)
        bl, br = (f32(sixth * v) for v in bends)
        dl, sl_sr, db, bl_br = f32(sl - sr), f32(sl + sr), f32(br - bl), f32(bl + br)
        even_part = f32(f32(dl * f32(f32(91 * dl) + f32(106 * bl_br))) + f32(39 * f32(bl_br * bl_br)))
        odd_part = f32(f32(sl_sr * f32(f32(117 * sl_sr) - f32(166 * db))) + f32(73 * f32(db * db)))
        return f32(even_part + odd_part) > f32(self.least * f32(incline * incline))


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

    field, criterion = Field(height, scale), Criterion(header.accuracy)
    volume = Box(tuple(header.first), tuple(header.last))
    result = {p: 3 for p in closed.raster((header.S,) * 3)}
    for u, odd, cycle, points in reversed(list(passes(closed, header.S))):
        for p in points:
            value = result.get(p, 0)
            if p in volume and 3 * cycle + 4 - len(odd) <= header.level_limit:
                value = max(value, criterion.exceeded(field, *base_edge(p, u, odd, header.S), odd, u))
            if value > 0:
                result[p] = value
                for q in parents(p, u, odd, header.S):
                    if q in closed:
                        result[q] = max(result.get(q, 0), value)
    return result
