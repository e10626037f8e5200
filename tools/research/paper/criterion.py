"""Figs. 10 and 25: the accuracy criterion, and the curve that it measures."""

import math

import numpy

import drawing

M = 20  # the accuracy of the paper's experiments, and of ours
PIECES = 4  # straight pieces with which each B-spline segment is measured


def add_to(report, study):
    report.section("The accuracy criterion (Figs. 10, 25)")
    printed = M / math.pi * math.sin(math.pi / M)
    arc, chord = arc_and_chord(M)
    report.figure("fig-10", "Fig. 10: a circle, and the regular polygon that stands for it", picture_of_polygons(study),
                  f"R is an arc, D its chord. For m = {M}, R/D is {arc / chord:.5f}.")
    report.departure(f"Eq. 7: (m/π) sin(π/m) is {printed:.5f} for m = {M}. No curve is shorter than its chord, so Eq. 8 would be violated "
                     f"everywhere. The caption of Fig. 10 has the reciprocal, {1 / printed:.5f}, which is also what an arc "
                     f"and its chord give: {arc / chord:.5f}. The program uses that.")
    curve = Curve(16.0, (1.0, 1.3, -0.35), (3.0, -0.9, -0.25))
    report.figure("fig-25", "Fig. 25: the curve of field values along an edge", picture_of_curve(study, curve),
                  "An example. The osculating circles at both ends give six control points, and these give three B-spline "
                  f"segments. Their length R is {curve.length:.3f}, the distance C of their ends {curve.chord:.3f}; R/C = "
                  f"{curve.length / curve.chord:.4f} is {'above' if curve.length / curve.chord > arc / chord else 'below'} "
                  f"{arc / chord:.5f}, so the edge is {'bisected' if curve.length / curve.chord > arc / chord else 'kept'}.")


def arc_and_chord(m):
    """An edge of the regular polygon with m corners, and the arc above it, measured in a thousand pieces."""
    angle = numpy.linspace(0, 2 * math.pi / m, 1001)
    places = numpy.stack([numpy.cos(angle), numpy.sin(angle)], axis=1)
    return length_of(places), math.dist(places[0], places[-1])


def length_of(places):
    return float(numpy.sqrt((numpy.diff(places, axis=0) ** 2).sum(axis=1)).sum())


class Curve:
    """The curve over an edge of length D; at each end a height, a slope and a second derivative, all in voxels."""

    def __init__(self, distance, left, right):
        self.ends = numpy.array([(0, left[0]), (distance, right[0])], dtype=float)
        self.circles, self.control = [], []
        limit = float(numpy.linalg.norm(self.ends[1] - self.ends[0])) / 3
        for place, (_, slope, second) in zip(self.ends, (left, right)):
            curvature = second / (1 + slope**2) ** 1.5
            normal = numpy.array([-slope, 1]) / math.hypot(slope, 1)
            center = place + normal / curvature
            self.circles.append((center, abs(1 / curvature)))
            angle = min(2 * math.pi / M / abs(curvature), limit) * curvature
            self.control += [center + turned(place - center, -angle), place, center + turned(place - center, angle)]
        self.segments = [self._segment(i, 40) for i in range(3)]
        measured = [self._segment(i, PIECES) for i in range(3)]
        self.length = sum(map(length_of, measured))
        self.chord = math.dist(measured[0][0], measured[-1][-1])

    def _segment(self, first, pieces):
        """A segment of the uniform cubic B-spline."""
        t = numpy.linspace(0, 1, pieces + 1)[:, None]
        weights = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
        return sum(weight * self.control[first + i] for i, weight in enumerate(weights)) / 6


def turned(vector, angle):
    c, s = math.cos(angle), math.sin(angle)
    return numpy.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def circle(center, radius, begin=0.0, end=2 * math.pi):
    return [(center[0] + radius * math.cos(a), center[1] + radius * math.sin(a)) for a in numpy.linspace(begin, end, 121)]


def picture_of_polygons(study):
    panels = []
    for m in (6, M):
        figure = drawing.Drawing(study.pixels(420), study.pixels(420), (-1, -1), (1, 1), 20, equal=True)
        corners = [(math.cos(2 * math.pi * i / m), math.sin(2 * math.pi * i / m)) for i in range(m + 1)]
        figure.line(circle((0, 0), 1), drawing.FAINT, 2)
        figure.line(corners, drawing.BLUE, 1.5)
        figure.line([corners[0], (0, 0), corners[1]], drawing.FAINT, 1)
        figure.line(circle((0, 0), 1, 0, 2 * math.pi / m), drawing.RED, 3)
        figure.line(corners[:2], drawing.INK, 3)
        figure.text((0.12, 0.03), f"2π/{m}", dx=10, dy=8)
        panels.append(figure.picture())
    return drawing.beside(panels, [f"m = {m}: arc / chord = {arc_and_chord(m)[0] / arc_and_chord(m)[1]:.5f}" for m in (6, M)])


def picture_of_curve(study, curve):
    figure = drawing.Drawing(study.pixels(760), study.pixels(330), (-6, -4), (22, 7), 20, equal=True)
    for center, radius in curve.circles:
        figure.line(circle(center, radius), drawing.FAINT, 1)
    figure.line([(-6, 0), (22, 0)], drawing.INK, 1)
    for end in curve.ends:
        figure.line([(end[0], 0), end], drawing.FAINT, 1)
    figure.line(curve.ends, drawing.INK, 1.5)
    for segment, color in zip(curve.segments, ((0.86, 0.45, 0.62), drawing.GREEN, drawing.RED)):
        figure.line(segment, color, 3)
    for i, place in enumerate(curve.control):
        figure.dot(place, drawing.PURPLE if i < 3 else drawing.ORANGE, 4)
    for name, end in zip(("Pₗ", "Pᵣ"), curve.ends):
        figure.text((end[0], 0), name, dy=-14, anchor="mm")
    return figure.picture()
