"""Flat drawings in coordinates of their own: curves, dots, texts, and axes for plots."""

from PIL import Image, ImageDraw

import colours
import sheet
from sheet import FINER


class Drawing:
    """A picture of a box of the plane, y upwards, with a margin for texts."""

    def __init__(self, width, height, low, high, margin=50, equal=False):
        self._low, self._margin = low, margin
        scale = [(width - 2 * margin) / (high[0] - low[0]), (height - 2 * margin) / (high[1] - low[1])]
        self._scale = [min(scale)] * 2 if equal else scale
        self._image = sheet.blank(width * FINER, height * FINER)
        self._draw = ImageDraw.Draw(self._image)

    def _place(self, place):
        x, y = ((p - low) * scale + self._margin for p, low, scale in zip(place, self._low, self._scale))
        return x * FINER, self._image.height - y * FINER

    def line(self, places, colour, width=2.0):
        self._draw.line([self._place(place) for place in places], fill=colours.bytes_of(colour), width=round(width * FINER),
                        joint="curve")

    def dot(self, place, colour, radius=4.0):
        x, y = self._place(place)
        r = radius * FINER
        self._draw.ellipse((x - r, y - r, x + r, y + r), fill=colours.bytes_of(colour))

    def text(self, place, text, dx=0, dy=0, size=14, anchor="lm"):
        """A text at a place, moved by pixels to the right and upwards."""
        x, y = self._place(place)
        self._draw.text((x + dx * FINER, y - dy * FINER), text, fill=colours.bytes_of(colours.INK),
                        font=sheet.font(size * FINER), anchor=anchor)

    def axes(self, x_ticks, y_ticks, x_name, y_name):
        """Axes from the corner of the box, with their names and numbers."""
        x0, y0 = self._low
        self.line([(x0, y_ticks[-1]), (x0, y0), (x_ticks[-1], y0)], colours.INK, 1.5)
        for tick in x_ticks:
            self.text((tick, y0), f"{tick:g}", dy=-14, anchor="mm")
        for tick in y_ticks:
            self.line([(x0, tick), (x_ticks[-1], tick)], colours.FAINT, 0.5)
            self.text((x0, tick), f"{tick:g}", dx=-8, anchor="rm")
        self.text((x_ticks[-1], y0), x_name, dy=-32, anchor="rm")
        self.text((x0, y_ticks[-1]), y_name, dy=16, dx=-20)

    def picture(self):
        return self._image.resize((self._image.width // FINER, self._image.height // FINER), Image.LANCZOS)
