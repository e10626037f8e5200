"""Points of a closed box, activity, values of points: sections 6 and 8 of docs/format.md."""

from itertools import product

from .coding import Bits, Decoder, IntegerModel, Mixers, clamp


def add(p, v):
    return (p[0] + v[0], p[1] + v[1], p[2] + v[2])


def along(a, length):
    return tuple(length if axis == a else 0 for axis in range(3))


class Box:
    """Points low .. high, both included."""

    def __init__(self, low, high):
        self.low, self.high = low, high

    def __contains__(self, p):
        return all(self.low[a] <= p[a] <= self.high[a] for a in range(3))

    def raster(self, step=(1, 1, 1), first=(0, 0, 0)):
        x, y, z = (range(self.low[a] + first[a], self.high[a] + 1, step[a]) for a in range(3))
        return ((i, j, k) for k in z for j in y for i in x)


def passes(box, S):
    """(u, odd axes, cycle, points) in the order of section 6.1, without a level limit."""
    u, cycle = S // 2, 0
    while u >= 1:
        for odd_count in (3, 2, 1):
            for axes in range(1, 8):
                odd = [a for a in range(3) if axes >> a & 1]
                if len(odd) == odd_count:
                    first = tuple(u if a in odd else 0 for a in range(3))
                    yield u, odd, cycle, list(box.raster((2 * u,) * 3, first))
        u, cycle = u // 2, cycle + 1


def parents(p, u, odd, S):
    if len(odd) < 3:
        return [add(p, along(a, d)) for a in range(3) if a not in odd for d in (-u, u)]
    if u == S // 2:
        return []
    c = [p[a] + u if p[a] & 2 * u else p[a] - u for a in range(3)]
    return [tuple(2 * p[b] - c[b] if b == a else c[b] for b in range(3)) for a in range(3)]


def offsets(u, odd):
    """AROUND and BESIDE of section 6.3."""
    around, beside = [], []

    def vectors(*lengths):  # of (axis, length), all signs
        for signs in product((-1, 1), repeat=len(lengths)):
            v = (0, 0, 0)
            for sign, (axis, length) in zip(signs, lengths):
                v = add(v, along(axis, sign * length))
            yield v

    if len(odd) == 3:
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            around += vectors((a, 3 * u), (b, u), (c, u))
            beside += vectors((b, 2 * u), (c, 2 * u))
    elif len(odd) == 2:
        a = 3 - sum(odd)
        for f in odd:
            around += vectors((a, u), (f, 2 * u))
            beside += vectors((a, u), (f, u))
    else:
        a = odd[0]
        b, c = (a + 1) % 3, (a + 2) % 3
        around += vectors((a, u), (b, u), (c, u))
        around += vectors((b, 2 * u), (c, u))
        around += vectors((b, u), (c, 2 * u))
        beside += vectors((a, u), (b, u))
        beside += vectors((a, u), (c, u))
    return around, beside


def decode_activity(data, box, S, level_limit, forecast=None):
    """The set of active points. forecast: numbers 0 .. 3 by point, or None if there is none."""
    coder = Decoder(data)
    active = set(box.raster((S, S, S)))
    models, mixers = Bits(), Mixers()
    for u, odd, cycle, points in passes(box, S):
        if 3 * cycle + 4 - len(odd) > level_limit:
            break
        candidates = {p for p in points if all(q in active for q in parents(p, u, odd, S) if q in box)}
        around_offsets, beside_offsets = offsets(u, odd)
        for p in points:
            if p not in candidates:
                continue
            on = off = ahead = directed = forecasts = surprises = 0
            for a in range(3):
                q, r = add(p, along(a, -2 * u)), add(p, along(a, 2 * u))
                state = 2 if q in active else 1 if q in candidates else 0
                following = 1 if r in candidates else 0
                on, off, ahead = on + (state == 2), off + (state == 1), ahead + following
                directed = 6 * directed + 2 * state + following
                if forecast is not None:
                    before = forecast.get(q, 0)
                    forecasts += before + forecast.get(r, 0)
                    surprises = 3 * surprises + (0 if state == 0 else 1 if (state == 2) == (before >= 2) else 2)
            around = sum(add(p, v) in active for v in around_offsets)
            beside = sum(add(p, v) in active for v in beside_offsets)
            if forecast is None:
                neighbours = 16 * on + 4 * off + ahead
                contexts = (neighbours + 64 * min((around + 1) // 2, 12), directed, 32 * around + beside,
                            64 * (beside // 2) + neighbours)
            else:
                border = any(p[a] in (box.low[a], box.high[a]) for a in range(3))
                own = 2 * forecast.get(p, 0) + border
                contexts = (16 * (19 * own + forecasts) + 4 * on + off, 27 * own + surprises, 216 * own + directed,
                            13 * (13 * own + beside) + min((around + 1) // 2, 12))
            bits = [models[cycle, len(odd), i, contexts[i]] for i in range(4)]
            if coder.mixed(bits, mixers[cycle, len(odd)], 255):
                active.add(p)
        coder.check_exhausted()
    coder.check_end()
    return active


def base_edge(p, u, odd, S):
    k = {a: 0 if u == S // 2 else ((p[a] - u) & 2 * u) != 0 for a in odd}
    r = tuple(0 if a not in odd else u if k[a] == k[odd[0]] else -u for a in range(3))
    return add(p, tuple(-v for v in r)), add(p, r)


def steps(v, s):
    return (2 * v + s) // (2 * s)


def guess_of(p, u, odd, box, values):
    """The prediction of a point from the vertices of its diamond, and the spread of their values."""
    corners = []
    for signs in product((-u, u), repeat=len(odd)):
        q = p
        for a, d in zip(odd, signs):
            q = add(q, along(a, d))
        corners.append(values.get(q, 0))
    sides = [values.get(q, 0) for a in range(3) if a not in odd
             for q in (add(p, along(a, -u)), add(p, along(a, u))) if q in box]
    cs, ss, ns = sum(corners), sum(sides), len(sides)
    guess = (steps(cs, 8), steps(cs * ns + 8 * ss, 12 * ns) if ns else 0,
             steps(cs + ss, 2 + ns))[3 - len(odd)]
    return guess, max(corners + sides) - min(corners + sides)


def decode_points(data, box, active, S, point_error, limits):
    """Values of the active points, by point."""
    coder = Decoder(data)
    step = 2 * point_error + 1
    models = {}
    values = {}

    def decode_value(guess, kind, context):
        r = coder.signed(models.setdefault((kind, context), IntegerModel()))
        return clamp((steps(guess, step) + r) * step, *limits)

    for p in box.raster((S, S, S)):
        guess = 0
        for a in range(3):
            if add(p, along(a, -S)) in box:
                guess = values[add(p, along(a, -S))]
                break
        values[p] = decode_value(guess, 0, 0)
    for u, odd, _, points in passes(box, S):
        for p in points:
            if p not in active:
                continue
            guess, spread = guess_of(p, u, odd, box, values)
            context = min((4 * spread // step).bit_length(), 23)
            values[p] = decode_value(guess, 4 - len(odd) + (3 if u == 1 else 0), context)
        coder.check_exhausted()
    coder.check_end()
    return values


def interpolate(values, box, S):
    """The sample of every point of the box."""
    numbers = {p: v * S for p, v in values.items()}
    for u, odd, _, points in passes(box, S):
        for p in points:
            if p not in numbers:
                left, right = base_edge(p, u, odd, S)
                numbers[p] = (numbers[left] + numbers[right]) >> 1
    return {p: (v + S // 2) >> (S.bit_length() - 1) for p, v in numbers.items()}
