#!/usr/bin/env python3
"""tools/research/format_figures.py FOLDER

Draws the figures of docs/dev/format.md: the wavefront of lanes, the six tetrahedra of a root cube, and three bisections.
"""

import itertools
import pathlib
import sys

DONE, NOW, NEXT, INK, RED, FACE = "#d5d9de", "#3b7dd8", "#ffffff", "#30343a", "#c8372d", "#7fb0ea"


class Figure:
    def __init__(self, width, height):
        self.size, self.parts = (width, height), []

    def add(self, part):
        self.parts.append(part)

    def text(self, x, y, text, size=13, color=INK, anchor="middle"):
        self.add(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{color}" text-anchor="{anchor}">{text}</text>')

    def line(self, a, b, color=INK, width=1.2, dash=""):
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.add(f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" stroke="{color}" '
                 f'stroke-width="{width}" stroke-linecap="round"{dashed}/>')

    def dot(self, p, color=INK, radius=3.5):
        self.add(f'<circle cx="{p[0]:.1f}" cy="{p[1]:.1f}" r="{radius}" fill="{color}"/>')

    def box(self, x, y, width, height, fill, stroke=INK, stroke_width=0.8):
        self.add(f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}" stroke="{stroke}" '
                 f'stroke-width="{stroke_width}"/>')

    def polygon(self, points, fill, opacity):
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.add(f'<polygon points="{corners}" fill="{fill}" fill-opacity="{opacity}" stroke="none"/>')

    def write(self, path):
        width, height = self.size
        head = (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
                f'font-family="sans-serif">\n<rect width="{width}" height="{height}" fill="#ffffff"/>\n')
        path.write_text(head + "\n".join(self.parts) + "\n</svg>\n")


def wavefront():
    """Rows of a slice with the tick of each voxel; below, when groups of both halves are decoded."""
    cell, left, top, columns, rows, now = 34, 92, 66, 20, 6, 17
    figure = Figure(left + columns * cell + 24, top + rows * cell + 190)
    figure.text(left, 26, f"The tick of each voxel in slice 0, and what is decoded in tick {now} (blue)", 15, anchor="start")
    for x in range(columns):
        figure.text(left + (x + 0.5) * cell, top - 8, f"x = {x}" if x == 0 else x, 12)
    at = (now - 2 - 3 * 3, 3)  # a voxel of this tick, in lane 3
    neighbours = [(at[0] + dx, at[1] + dy) for dx, dy in
                  ((-1, 0), (-2, 0), (0, -1), (-1, -1), (1, -1), (2, -1), (-2, -1), (0, -2))]
    for y in range(rows):
        figure.text(left - 10, top + (y + 0.5) * cell + 5, f"lane {y}", 12, anchor="end")
        for x in range(columns):
            tick = 3 * y + x + 2
            fill = NOW if tick == now else DONE if tick < now else NEXT
            figure.box(left + x * cell, top + y * cell, cell, cell, fill)
            figure.text(left + (x + 0.5) * cell, top + (y + 0.5) * cell + 5, tick, 13, "#ffffff" if tick == now else INK)
    for x, y in neighbours:
        figure.box(left + x * cell + 2, top + y * cell + 2, cell - 4, cell - 4, "none", RED, 2.4)
    base = top + rows * cell + 26
    figure.text(left, base, "red: the neighbours of the blue voxel in lane 3 (7.1) in its slice; all were decoded in earlier ticks",
                13, RED, "start")
    figure.text(left, base + 34, "Groups of sixteen rows, one group a slice (my &lt;= 16): the odd slices follow 32 ticks later",
                15, anchor="start")
    width, lag, slope = 150, 72, 24
    for half in (0, 1):
        y = base + 50 + 44 * half
        figure.text(left - 10, y + 21, f"half {half}", 12, anchor="end")
        for n in range(4):
            x = left + n * width + lag * half
            points = [(x, y), (x + width - slope, y), (x + width, y + 32), (x + slope, y + 32)]
            figure.polygon(points, NOW if half == 0 else FACE, 0.35)
            for a, b in zip(points, points[1:] + points[:1]):
                figure.line(a, b)
            figure.text(x + width / 2, y + 21, f"z = {2 * n + half}", 12)
    figure.text(left + 4 * width + lag + 8, base + 150, "t →", 13, anchor="end")
    return figure


def projected(p, origin, scale):
    """Oblique: x to the right, z up, y away."""
    return origin[0] + scale * (p[0] + 0.5 * p[1]), origin[1] - scale * (p[2] + 0.34 * p[1])


def draw_cube(figure, origin, scale, dash="3,3"):
    for a in itertools.product((0, 1), repeat=3):
        for axis in range(3):
            if a[axis] == 0:
                b = tuple(1 if i == axis else a[i] for i in range(3))
                figure.line(projected(a, origin, scale), projected(b, origin, scale), "#9aa1a9", 1, dash)


def draw_tetrahedron(figure, v, origin, scale, base):
    corners = [projected(p, origin, scale) for p in v]
    for face in itertools.combinations(range(4), 3):
        figure.polygon([corners[i] for i in face], FACE, 0.28)
    for a, b in itertools.combinations(range(4), 2):
        is_base = (a, b) == base
        figure.line(corners[a], corners[b], RED if is_base else INK, 3 if is_base else 1.4)
    return corners


def path_of(order):
    path = [(0, 0, 0)]
    for axis in order:
        path.append(tuple(c + (i == axis) for i, c in enumerate(path[-1])))
    return path


def tetrahedra():
    figure = Figure(760, 550)
    figure.text(20, 26, "The six tetrahedra of a root cube, by the order of the axes",
                14, anchor="start")
    for i, order in enumerate(itertools.permutations(range(3))):
        origin = (50 + 245 * (i % 3), 240 + 235 * (i // 3))
        scale = 118
        draw_cube(figure, origin, scale)
        v = path_of(order)
        corners = draw_tetrahedron(figure, v, origin, scale, base=(0, 3))
        for a, b in zip(corners, corners[1:]):
            figure.line(a, b, "#14407c", 3)
        for number, (x, y) in enumerate(corners):
            figure.dot((x, y))
            moved = ((-15, 14), (0, 17), (18, 14), (17, -6))[number] if v[1] != (0, 0, 1) or number in (0, 3) else (-6, -9)
            figure.text(x + moved[0], y + moved[1], f"v[{number}]", 12)
        figure.text(origin[0] + 60, origin[1] + 38, ", ".join("xyz"[a] for a in order), 14)
    figure.text(20, 538, "blue: the path v[0], v[1], v[2], v[3]; red: the base edge from v[0] to v[3], which all six share", 13, anchor="start")
    return figure


def bisections():
    """A root tetrahedron and three cuts; the half that keeps v[0] is followed."""
    figure = Figure(920, 270)
    figure.text(20, 26, "Three cuts in a row (red: the base edge that is cut next; the half with v[0] is followed)", 14, anchor="start")
    v = path_of((0, 1, 2))
    names = ("a root tetrahedron", "cut at the cube centre", "cut at a face centre", "cut at an edge midpoint")
    for n in range(4):
        origin, scale = (40 + 225 * n, 215), 112
        draw_cube(figure, origin, scale)
        end = 3 - n % 3
        corners = draw_tetrahedron(figure, v, origin, scale, base=(0, end))
        middle = tuple((a + b) / 2 for a, b in zip(v[0], v[end]))
        figure.dot(projected(middle, origin, scale), RED, 5)
        moved = (-16, 13), (14, 15), (16, -2), (12, -9)
        for number, (x, y) in enumerate(corners):
            figure.dot((x, y))
            figure.text(x + moved[number][0], y + moved[number][1], f"v[{number}]", 12)
        figure.text(origin[0] + 84, 252, f"n = {n}: {names[n]}", 13)
        v = v[:end] + [middle] + v[end + 1:]
    return figure


def main():
    folder = pathlib.Path(sys.argv[1])
    for draw in (wavefront, tetrahedra, bisections):
        draw().write(folder / f"format_{draw.__name__}.svg")


if __name__ == "__main__":
    main()
