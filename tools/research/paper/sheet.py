"""Flat pictures, drawn by PIL: panels beside each other with titles, and grids as they look from above."""

import functools
import pathlib

import numpy
from PIL import Image, ImageDraw, ImageFont

import colours
from mesh import unique_edges

FINER = 2  # flat drawings are made larger by this factor, then scaled down, so that lines are smooth
GAP = 16


@functools.cache
def font(size):
    """DejaVu if it is installed, otherwise what PIL brings."""
    path = pathlib.Path("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf")
    return ImageFont.truetype(str(path), size) if path.is_file() else ImageFont.load_default()


def blank(width, height):
    return Image.new("RGB", (width, height), colours.bytes_of(colours.PAPER))


def write(picture, place, text, size=14):
    ImageDraw.Draw(picture).text(place, text, fill=colours.bytes_of(colours.INK), font=font(size))


def fill(picture, triangles, colour):
    """Fills triangles [n, 3, 2], in pixels."""
    draw = ImageDraw.Draw(picture)
    for triangle in triangles.reshape(-1, 6).tolist():
        draw.polygon(triangle, fill=colours.bytes_of(colour))


def outline(picture, places, colour=colours.INK, width=3):
    """A line through places [n, 2], in pixels."""
    ImageDraw.Draw(picture).line([tuple(place) for place in numpy.asarray(places).tolist()], fill=colours.bytes_of(colour),
                                 width=width)


def beside(panels, titles, columns=None):
    """Pictures in rows, a title above each."""
    columns = columns or len(panels)
    rows = [range(i, min(i + columns, len(panels))) for i in range(0, len(panels), columns)]
    heights = [max(panels[i].height for i in row) + 30 for row in rows]
    widths = [max(panel.width, round(font(17).getlength(title))) for panel, title in zip(panels, titles)]
    width = max(sum(widths[i] + GAP for i in row) for row in rows) + GAP
    sheet = blank(width, sum(heights) + GAP * (len(rows) + 1))
    draw = ImageDraw.Draw(sheet)
    y = GAP
    for row, height in zip(rows, heights):
        x = GAP
        for i in row:
            draw.text((x, y), titles[i], fill=colours.bytes_of(colours.INK), font=font(17))
            sheet.paste(panels[i], (x, y + 30))
            x += widths[i] + GAP
        y += height + GAP
    return sheet


def segments(lines, size, scale, colour, width=1.0, background=None):
    """Lines [n, 4] (x0, y0, x1, y1; y upwards) in a rectangle of this size, as a picture with `scale` pixels a unit."""
    factor = scale * FINER
    margin = 2 * FINER
    picture = Image.new("RGB", (round(size[0] * factor) + 2 * margin, round(size[1] * factor) + 2 * margin),
                        colours.bytes_of(colours.PAPER))
    if background is not None:
        picture.paste(background.resize((round(size[0] * factor), round(size[1] * factor)), Image.BICUBIC), (margin, margin))
    draw = ImageDraw.Draw(picture)
    ends = numpy.asarray(lines, dtype=float) * factor + margin
    ends[:, [1, 3]] = picture.height - 1 - ends[:, [1, 3]]
    line = max(1, round(width * FINER))
    for row in ends.tolist():
        draw.line(row, fill=colours.bytes_of(colour), width=line)
    return picture.resize((picture.width // FINER, picture.height // FINER), Image.LANCZOS)


def projected_edges(mesh, axes):
    """All edges of a mesh as they look along the third axis, each once: [n, 4]."""
    pairs, _ = unique_edges(mesh.tetrahedra, len(mesh.points))
    ends = numpy.rint(2 * mesh.points[:, axes]).astype(numpy.int64)[pairs]
    keys = ends[..., 0] << 20 | ends[..., 1]
    keys = numpy.unique(numpy.sort(keys, axis=1)[keys[:, 0] != keys[:, 1]], axis=0)
    flat = numpy.stack([keys >> 20, keys & ((1 << 20) - 1)], axis=-1) / 2
    return flat.reshape(-1, 4)


def three_views(mesh, scale):
    """The grid projected on the planes XY, ZX (below) and YZ (beside), as in a drawing of three views."""
    extent = mesh.points.max(axis=0)
    panels = {}
    for axes in ((0, 1), (2, 1), (0, 2)):
        panels[axes] = segments(projected_edges(mesh, axes), extent[list(axes)], scale, colours.INK, 0.5)
    top, side, front = panels[0, 1], panels[2, 1], panels[0, 2]
    sheet = blank(top.width + GAP + side.width, top.height + GAP + front.height)
    sheet.paste(top, (0, 0))
    sheet.paste(side, (top.width + GAP, 0))
    sheet.paste(front, (0, top.height + GAP))
    draw = ImageDraw.Draw(sheet)
    draw.text((top.width + GAP + 4, top.height + GAP), "XY, YZ\nZX", fill=colours.bytes_of(colours.INK), font=font(14))
    return sheet


def edges_in_plane(mesh, axis, place):
    """The edges of all triangles that lie in a plane across an axis, along the two other axes: [n, 4]."""
    inside = mesh.points[:, axis] == place
    three = mesh.tetrahedra[inside[mesh.tetrahedra].sum(axis=1) == 3]
    triangles = three[inside[three]].reshape(-1, 3)
    pairs = numpy.unique(numpy.sort(triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1), axis=0)
    others = [other for other in range(3) if other != axis]
    return mesh.points[pairs][:, :, others].reshape(-1, 4)


def grey(plane, low, high):
    """Values [v, u] as a grey picture, v upwards."""
    shades = numpy.clip((plane.astype(float) - low) / (high - low), 0, 1) * 255
    return Image.fromarray(shades[::-1].astype(numpy.uint8)).convert("RGB")
