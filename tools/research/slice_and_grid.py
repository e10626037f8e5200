#!/usr/bin/python3
"""Draws a slice of a volume, with the adaptive grid over its right part.

    slice_and_grid.py VOLUME.nhdr MESH.vtu Z OUT.png

MESH.vtu is of `tagrid mesh`, both files have a spacing of 1, and Z is a plane of faces of root cubes (a multiple of their
edge): the tetrahedra intersect the slice there in complete triangles, which are drawn.
"""

import sys
from pathlib import Path

import numpy
from PIL import Image, ImageDraw

import nrrd
from mesh import edges_in_plane, read_vtu

SCALE = 4  # pixels a sample
FINER = 3  # drawn larger by this factor, then scaled down, so that lines are smooth
WINDOW = (-1000, 1000)  # HU that become black and white
SPLIT = 0.46  # where the grid begins
LINE = (255, 150, 40)
GRAYS, OPACITIES = 42, 6


def save(gray, opacity, out):
    """A palette of all possible colors: GRAYS grays, each under lines of OPACITIES opacities."""
    grays, opacities = numpy.linspace(0, 255, GRAYS), numpy.linspace(0, 1, OPACITIES)
    palette = grays[None, :, None] + opacities[:, None, None] * (numpy.array(LINE) - grays[None, :, None])
    index = numpy.rint(opacity / 255 * (OPACITIES - 1)) * GRAYS + numpy.rint(gray / 255 * (GRAYS - 1))
    image = Image.fromarray(index.astype(numpy.uint8), "P")
    image.putpalette(numpy.rint(palette).astype(numpy.uint8).tobytes())
    image.save(out, optimize=True)


def main():
    header, mesh, z, out = sys.argv[1], read_vtu(Path(sys.argv[2])), int(sys.argv[3]), sys.argv[4]
    samples = numpy.array(nrrd.read(header).samples()[z])
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
