"""Flat pictures: colors, panels beside each other, grids seen from above, curves and axes."""

import functools
import pathlib

import numpy
from PIL import Image, ImageDraw, ImageFont

from mesh import unique_edges

# Red, green and blue from 0 to 1.
PAPER = (1.0, 1.0, 1.0)
INK = (0.13, 0.15, 0.18)
FAINT = (0.72, 0.74, 0.77)
BLUE = (0.22, 0.46, 0.72)
ORANGE = (0.93, 0.53, 0.16)
GREEN = (0.33, 0.63, 0.32)
RED = (0.80, 0.20, 0.18)
PURPLE = (0.55, 0.40, 0.68)
PRIMITIVES = (BLUE, ORANGE, GREEN)  # I, II, III
DIRECTIONS = (BLUE, ORANGE, GREEN, PURPLE)
SHELL = (0.86, 0.72, 0.58)

FINER = 2  # pictures are drawn larger by this factor, then scaled down, so that lines are smooth
GAP = 16


def of_level(level, last):
    """A color from coarse to fine."""
    part = min(1.0, max(0.0, level / last))
    return tuple(a + part * (b - a) for a, b in zip((0.16, 0.30, 0.62), (0.95, 0.62, 0.15)))


def bytes_of(color):
    return tuple(round(255 * c) for c in color)


@functools.cache
def font(size):
    """DejaVu if it is installed, otherwise that of PIL."""
    path = pathlib.Path("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf")
    return ImageFont.truetype(str(path), size) if path.is_file() else ImageFont.load_default()


def blank(width, height):
    return Image.new("RGB", (width, height), bytes_of(PAPER))


def scaled_down(picture):
    return picture.resize((picture.width // FINER, picture.height // FINER), Image.LANCZOS)


def write(picture, place, text, size=14, anchor=None):
    ImageDraw.Draw(picture).text(place, text, fill=bytes_of(INK), font=font(size), anchor=anchor)


def fill(picture, triangles, color):
    """Fills triangles [n, 3, 2], in pixels."""
    draw = ImageDraw.Draw(picture)
    for triangle in triangles.reshape(-1, 6).tolist():
        draw.polygon(triangle, fill=bytes_of(color))


def outline(picture, places, color=INK, width=3):
    """A line through places [n, 2], in pixels."""
    ImageDraw.Draw(picture).line([tuple(place) for place in numpy.asarray(places).tolist()], fill=bytes_of(color), width=width)


def beside(panels, titles, columns=None):
    """Pictures in rows, a title above each."""
    columns = columns or len(panels)
    rows = [range(i, min(i + columns, len(panels))) for i in range(0, len(panels), columns)]
    heights = [max(panels[i].height for i in row) + 30 for row in rows]
    widths = [max(panel.width, round(font(17).getlength(title))) for panel, title in zip(panels, titles)]
    width = max(sum(widths[i] + GAP for i in row) for row in rows) + GAP
    picture = blank(width, sum(heights) + GAP * (len(rows) + 1))
    y = GAP
    for row, height in zip(rows, heights):
        x = GAP
        for i in row:
            write(picture, (x, y), titles[i], 17)
            picture.paste(panels[i], (x, y + 30))
            x += widths[i] + GAP
        y += height + GAP
    return picture


def segments(lines, size, scale, width=0.5):
    """Lines [n, 4] (x0, y0, x1, y1; y upwards) in a rectangle of this size, as a picture with `scale` pixels a unit."""
    factor, margin = scale * FINER, 2 * FINER
    picture = blank(*(round(edge * factor) + 2 * margin for edge in size))
    draw = ImageDraw.Draw(picture)
    ends = numpy.asarray(lines, dtype=float) * factor + margin
    ends[:, [1, 3]] = picture.height - 1 - ends[:, [1, 3]]
    for row in ends.tolist():
        draw.line(row, fill=bytes_of(INK), width=max(1, round(width * FINER)))
    return scaled_down(picture)


def projection(mesh, axes, scale):
    """All edges of a mesh as they look along the third axis, each once."""
    pairs, _ = unique_edges(mesh.tetrahedra, len(mesh.points))
    ends = numpy.rint(2 * mesh.points[:, axes]).astype(numpy.int64)[pairs]
    keys = ends[..., 0] << 20 | ends[..., 1]
    keys = numpy.unique(numpy.sort(keys, axis=1)[keys[:, 0] != keys[:, 1]], axis=0)
    flat = numpy.stack([keys >> 20, keys & ((1 << 20) - 1)], axis=-1) / 2
    return segments(flat.reshape(-1, 4), mesh.points.max(axis=0)[list(axes)], scale)


def three_views(mesh, scale):
    """The grid projected on the planes XY, ZX (below) and YZ (beside), as in a drawing of three views."""
    top, side, front = (projection(mesh, axes, scale) for axes in ((0, 1), (2, 1), (0, 2)))
    picture = blank(top.width + GAP + side.width, top.height + GAP + front.height)
    picture.paste(top, (0, 0))
    picture.paste(side, (top.width + GAP, 0))
    picture.paste(front, (0, top.height + GAP))
    write(picture, (top.width + GAP + 4, top.height + GAP), "XY, YZ\nZX")
    return picture


def gray(plane, low, high):
    """Values [v, u] as a gray picture, v upwards."""
    shades = numpy.clip((plane.astype(float) - low) / (high - low), 0, 1) * 255
    return Image.fromarray(shades[::-1].astype(numpy.uint8)).convert("RGB")


class Drawing:
    """A picture of a box of the plane in its own coordinates, y upwards, with a margin for texts."""

    def __init__(self, width, height, low, high, margin=50, equal=False):
        self._low, self._margin = low, margin
        scale = [(width - 2 * margin) / (high[0] - low[0]), (height - 2 * margin) / (high[1] - low[1])]
        self._scale = [min(scale)] * 2 if equal else scale
        self._image = blank(width * FINER, height * FINER)

    def _place(self, place):
        x, y = ((p - low) * scale + self._margin for p, low, scale in zip(place, self._low, self._scale))
        return x * FINER, self._image.height - y * FINER

    def line(self, places, color, width=2.0):
        ImageDraw.Draw(self._image).line([self._place(place) for place in places], fill=bytes_of(color),
                                         width=round(width * FINER), joint="curve")

    def dot(self, place, color, radius=4.0):
        x, y = self._place(place)
        r = radius * FINER
        ImageDraw.Draw(self._image).ellipse((x - r, y - r, x + r, y + r), fill=bytes_of(color))

    def text(self, place, text, dx=0, dy=0, anchor="lm"):
        """A text at a place, moved by pixels to the right and upwards."""
        x, y = self._place(place)
        write(self._image, (x + dx * FINER, y - dy * FINER), text, 14 * FINER, anchor)

    def axes(self, x_ticks, y_ticks, x_name, y_name):
        """Axes from the corner of the box, with their names and numbers."""
        x0, y0 = self._low
        self.line([(x0, y_ticks[-1]), (x0, y0), (x_ticks[-1], y0)], INK, 1.5)
        for tick in x_ticks:
            self.text((tick, y0), f"{tick:g}", dy=-14, anchor="mm")
        for tick in y_ticks:
            self.line([(x0, tick), (x_ticks[-1], tick)], FAINT, 0.5)
            self.text((x0, tick), f"{tick:g}", dx=-8, anchor="rm")
        self.text((x_ticks[-1], y0), x_name, dy=-32, anchor="rm")
        self.text((x0, y_ticks[-1]), y_name, dy=16, dx=-20)

    def picture(self):
        return scaled_down(self._image)
