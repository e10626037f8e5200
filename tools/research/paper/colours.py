"""The colours of all pictures: red, green and blue from 0 to 1."""

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

# Levels from coarse to fine.
COARSE, FINE = (0.16, 0.30, 0.62), (0.95, 0.62, 0.15)


def of_level(level, last):
    part = min(1.0, max(0.0, level / last))
    return tuple(a + part * (b - a) for a, b in zip(COARSE, FINE))


def bytes_of(colour):
    return tuple(round(255 * c) for c in colour)
