#!/usr/bin/python3
"""A slice of a volume as a picture, with the adaptive grid drawn over its right part.

    slice_and_grid.py VOLUME.nhdr MESH.vtu Z OUT.png

Reads int16 samples beside an .nhdr and a mesh that `tagrid mesh` wrote, both with a spacing of 1. Z must be a plane of
faces of root cubes (a multiple of their edge): there the tetrahedra meet the slice in whole triangles, which are drawn.
"""

import pathlib
import re
import sys

import numpy
from PIL import Image, ImageDraw

SCALE = 4  # pixels a sample
FINER = 3  # drawn larger by this factor, then scaled down, so that lines are smooth
WINDOW = (-1000, 1000)  # HU that become black and white
SPLIT = 0.46  # where the grid begins
LINE = (255, 150, 40)
GRAYS, OPACITIES = 42, 6


def read_slice(header, z):
    fields = dict(re.findall(r"^([\w ]+): *(.*)$", header.read_text(), re.MULTILINE))
    x, y, _ = map(int, fields["sizes"].split())
    samples = numpy.memmap(header.with_name(fields["data file"]), "<i2", "r")
    return numpy.array(samples[z * x * y : (z + 1) * x * y]).reshape(y, x)


def read_array(data, begin, head, name, dtype):
    """An array of a .vtu with appended raw data: at its offset the number of bytes, 64 bits, then the bytes."""
    offset = begin + int(re.search(rf'Name="{name}"[^>]*offset="(\d+)"', head)[1])
    size = int.from_bytes(data[offset : offset + 8], "little")
    return numpy.frombuffer(data, dtype, size // numpy.dtype(dtype).itemsize, offset + 8)


def edges_in_plane(mesh, z):
    """The edges of all triangles that lie in the plane, each once: rows of x0, y0, x1, y1."""
    data = mesh.read_bytes()
    begin = data.index(b'<AppendedData encoding="raw">')
    begin = data.index(b"_", begin) + 1
    head = data[:begin].decode("ascii")
    points = read_array(data, begin, head, "Points", "<f8").reshape(-1, 3)
    tetrahedra = read_array(data, begin, head, "connectivity", "<i8").reshape(-1, 4)
    inside = points[:, 2] == z
    three = tetrahedra[inside[tetrahedra].sum(axis=1) == 3]
    triangles = three[inside[three]].reshape(-1, 3)
    pairs = numpy.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
    pairs = numpy.unique(numpy.sort(pairs, axis=1), axis=0)
    return points[pairs][:, :, :2].reshape(-1, 4)


def save(gray, opacity, out):
    """A palette of all possible colours: GRAYS grays, each under lines of OPACITIES opacities."""
    grays, opacities = numpy.linspace(0, 255, GRAYS), numpy.linspace(0, 1, OPACITIES)
    palette = grays[None, :, None] + opacities[:, None, None] * (numpy.array(LINE) - grays[None, :, None])
    index = numpy.rint(opacity / 255 * (OPACITIES - 1)) * GRAYS + numpy.rint(gray / 255 * (GRAYS - 1))
    image = Image.fromarray(index.astype(numpy.uint8), "P")
    image.putpalette(numpy.rint(palette).astype(numpy.uint8).tobytes())
    image.save(out, optimize=True)


def main():
    header, mesh, z, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    samples = read_slice(header, z)
    low, high = WINDOW
    gray = numpy.clip((samples.astype(float) - low) / (high - low), 0, 1) * 255
    body = numpy.argwhere(samples > -500)
    (top, left), (bottom, right) = numpy.maximum(body.min(0) - 6, 0), numpy.minimum(body.max(0) + 7, samples.shape)
    factor = SCALE * FINER
    image = Image.fromarray(gray.astype(numpy.uint8))
    image = image.resize((samples.shape[1] * factor, samples.shape[0] * factor), Image.BICUBIC)

    split = int((left + SPLIT * (right - left)) * factor)
    lines = Image.new("L", image.size, 0)
    draw = ImageDraw.Draw(lines)
    for x0, y0, x1, y1 in edges_in_plane(mesh, z):
        # A sample is in the middle of its pixels.
        opacity = 220 if abs(x1 - x0) + abs(y1 - y0) > 3 else 130  # where the grid is finest, the scan shows through
        draw.line([((v + 0.5) * factor) for v in (x0, y0, x1, y1)], fill=opacity, width=FINER + 1)
    draw.rectangle((0, 0, split, lines.size[1]), fill=0)
    draw.line((split, 0, split, lines.size[1]), fill=255, width=2 * FINER)
    box = (left * factor, top * factor, right * factor, bottom * factor)
    size = ((right - left) * SCALE, (bottom - top) * SCALE)
    image, lines = (part.crop(box).resize(size, Image.LANCZOS) for part in (image, lines))
    save(numpy.asarray(image), numpy.asarray(lines), out)


if __name__ == "__main__":
    main()
