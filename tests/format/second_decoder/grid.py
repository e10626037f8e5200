"""Points of a closed box, activity, values of points: sections 6 and 8 of docs/dev/format.md."""

from itertools import product

from .coding import SQUASH, AdaptiveBit, Decoder, IntegerModel, clamp


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


# Of points with the forecast 0 .. 3, not at the border and there.
FIRST_LOGIT = [[-830, -249, 719, 1484], [-526, -121, 452, 993]]
SECOND_LOGIT = [[-16, 354, 1040, 982], [76, 329, 631, 668]]


def new_bit(logit):
    bit = AdaptiveBit()
    bit.state = SQUASH[clamp(logit, -2047, 2047) + 2048] << 16 | 2
    return bit


class Activity:
    """What is known while the activity of a box is decoded."""

    def __init__(self, box, S, forecast):
        self.box, self.forecast = box, forecast
        self.active, self.candidates = set(box.raster((S, S, S))), set()
        self.models, self.mixers = {}, {}

    def expected(self, p):
        return self.forecast.get(p, 0) >= 2

    def with_forecast(self, p, u, odd, around, beside):
        on = off = surprise = forecasts = 0
        for a in range(3):
            q, r = add(p, along(a, -2 * u)), add(p, along(a, 2 * u))
            forecasts += self.forecast.get(q, 0) + self.forecast.get(r, 0)
            if q in self.candidates:
                on, off = on + (q in self.active), off + (q not in self.active)
                surprise += (q in self.active) - self.expected(q)

        def balance(points, off_is_known):
            more = sum(q in self.active and not self.expected(q) for q in points)
            less = sum(q not in self.active and self.expected(q) and off_is_known(q) for q in points)
            return min(more, 2) - min(less, 2)

        d = balance([add(p, v) for v in beside], lambda q: q in self.candidates)
        e = balance([add(p, v) for v in around], lambda q: True)
        border = any(p[a] in (self.box.low[a], self.box.high[a]) for a in range(3))
        own = self.forecast.get(p, 0)
        return ((0, len(odd), own, border, surprise, d, e), FIRST_LOGIT[border][own] + 400 * surprise + 64 * d + 96 * e,
                (1, len(odd), own, border, on, off, forecasts // 2),
                SECOND_LOGIT[border][own] + 160 * on - 320 * off - 80 * (forecasts // 2), own)

    def without_forecast(self, p, u, odd, around, beside):
        on = directed = 0
        for a in range(3):
            q, r = add(p, along(a, -2 * u)), add(p, along(a, 2 * u))
            state = 2 if q in self.active else 1 if q in self.candidates else 0
            on += state == 2
            directed = 6 * directed + 2 * state + (r in self.candidates)
        n = (sum(add(p, v) in self.active for v in around) + 1) // 2
        m = sum(add(p, v) in self.active for v in beside)
        return (0, len(odd), n, on, m), 0, (1, len(odd), directed, n), 0, len(odd)

    def decode_point(self, coder, p, u, odd, around, beside):
        view = self.without_forecast if self.forecast is None else self.with_forecast
        first, first_logit, second, second_logit, mixer = view(p, u, odd, around, beside)
        make = new_bit if self.forecast is not None else lambda logit: AdaptiveBit()
        for context, logit in ((first, first_logit), (second, second_logit)):
            if context not in self.models:
                self.models[context] = make(logit)
        weights = self.mixers.setdefault(mixer, [36864, 36864])
        if coder.mixed([self.models[first], self.models[second]], weights, 255):
            self.active.add(p)


def decode_activity(data, box, S, level_limit, forecast=None):
    """The set of active points. forecast: numbers 0 .. 3 by point, or None if there is none."""
    coder = Decoder(data)
    state = Activity(box, S, forecast)
    for u, odd, cycle, points in passes(box, S):
        if 3 * cycle + 4 - len(odd) > level_limit:
            break
        around, beside = offsets(u, odd)
        found = [p for p in points if all(q in state.active for q in parents(p, u, odd, S) if q in box)]
        state.candidates.update(found)
        for p in found:
            state.decode_point(coder, p, u, odd, around, beside)
        coder.check_exhausted()
    coder.check_end()
    return state.active


def base_edge(p, u, odd, S):
    k = {a: 0 if u == S // 2 else ((p[a] - u) & 2 * u) != 0 for a in odd}
    r = tuple(0 if a not in odd else u if k[a] == k[odd[0]] else -u for a in range(3))
    return add(p, tuple(-v for v in r)), add(p, r)


def rounded(v, s):
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
    guess = (rounded(cs, 8), rounded(cs * ns + 8 * ss, 12 * ns) if ns else 0,
             rounded(cs + ss, 2 + ns))[3 - len(odd)]
    return guess, max(corners + sides) - min(corners + sides)


def decode_points(data, box, active, S, point_error, limits):
    """Values of the active points, by point."""
    coder = Decoder(data)
    width = 2 * point_error + 1
    models = {}
    values = {}

    def decode_value(guess, kind, context):
        r = coder.signed(models.setdefault((kind, context), IntegerModel()))
        return clamp((rounded(guess, width) + r) * width, *limits)

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
            context = min((4 * spread // width).bit_length(), 23)
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
