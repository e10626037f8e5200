"""Claims 7 and 8: neither the size of the root cubes nor the direction of the axes matters for the accuracy."""

import numpy

import drawing
from report import FAILS, HOLDS, PARTLY
from study import write

ALIKE = 2.0  # percent by which numbers of points may differ from their mean
# Axes of the array [z, y, x] between which the volume is turned.
TURNS = {"as it lies": None, "90° about z": (1, 2), "90° about y": (0, 2), "90° about x": (0, 1)}


def add_to(report, study):
    report.section("The size of root cubes, and the direction of the axes")
    claim_sizes(report, study)
    claim_turns(report, study)


class Measured:
    """A grid, and how near it comes to the volume."""

    def __init__(self, study, volume, *options):
        self.tag = study.tagrid.grid(volume, *options)
        info = study.tagrid.info(self.tag)
        self.active, self.rmse = info["levels"][-1]["active"], info["achieved"]["rmse"]
        _, counts = study.tagrid.surface(self.tag, volume.iso)
        self.area = counts["area"]

    def cells(self):
        return f"{self.active:,}", f"{self.rmse:.4f}", f"{self.area:,.0f}"


def spread(numbers):
    """By how many percent numbers differ from their mean at most."""
    mean = numpy.mean(numbers)
    return float(100 * numpy.abs(numpy.array(numbers) / mean - 1).max())


def spreads(measured):
    return {name: spread([getattr(one, name) for one in measured]) for name in ("active", "rmse", "area")}


def claim_sizes(report, study):
    sizes = (8, 16, 32) if study.quick else (8, 16, 32, 64)
    volume = study.lobster
    measured = [Measured(study, volume, "--cube", size) for size in sizes]
    report.table(f"Root cubes of several sizes: the {volume.name}, complete grids",
                 ["S", "active points", "rmse of the field", f"area of the isosurface {volume.iso:g}"],
                 [(size, *one.cells()) for size, one in zip(sizes, measured)])
    found = spreads(measured)
    report.claim(7, "the size of the root cubes does not matter for the accuracy of the result", verdict(found),
                 "For S = {sizes} on the {name}, numbers of active points differ from their mean by at most {active:.2f} %, "
                 "the root mean square errors of the field by {rmse:.2f} %, the areas of an isosurface by {area:.2f} %. (Up "
                 "to {alike:g} % count as alike. The criterion is a ratio of lengths, so the field may be further from a "
                 "longer edge; in smooth regions, edges are as long as root cubes allow.)",
                 sizes=", ".join(map(str, sizes)), name=volume.name, alike=ALIKE, **found)


def verdict(found):
    """The grid and the surface decide; the error of the field, which a few coarse leaves decide, may make an exception."""
    if max(found["active"], found["area"]) > ALIKE:
        return FAILS
    return HOLDS if found["rmse"] <= ALIKE else PARTLY


class Turned:
    """A volume turned by 90 degrees about each axis: the grids, and how much of them is at the same places."""

    def __init__(self, study, volume):
        samples = volume.samples()
        self.measured, self.common = [], []
        masks = []
        for number, axes in enumerate(TURNS.values()):
            turned = volume
            if axes:
                turned = write(study.directory, f"{volume.name}_{number}", numpy.rot90(samples, 1, axes), volume.low,
                                       volume.high, volume.iso)
            self.measured.append(Measured(study, turned))
            masks.append(active_points(study.tagrid.mesh(self.measured[-1].tag), turned.dims, axes))
        self.common = [100 * common(masks[0], mask) for mask in masks]
        # The comparison can fail: without turning back, other points are active.
        self.common_unturned = 100 * common(masks[0], numpy.rot90(masks[1], 2, (1, 2)))
        self.spreads = spreads(self.measured)


def claim_turns(report, study):
    volume = study.lobster
    whole = Turned(study, volume)
    # Without some samples at the end of each axis, turning moves the volume relative to the root cubes.
    part = write(study.directory, "cropped", volume.samples()[:-5, :-9, :-13], volume.low, volume.high, volume.iso)
    cropped = Turned(study, part)
    for name, one in ((volume.name, whole), (f"{volume.name} without some samples at its ends", cropped)):
        report.table(f"The {name}, turned",
                     ["turn", "active points", "rmse of the field", f"area of the isosurface {volume.iso:g}",
                      "active at the same places"],
                     [(turn, *measured.cells(), f"{same:.2f} %") for turn, measured, same in zip(TURNS, one.measured, one.common)])
    report.figure("turned", "A grid, and that of the turned volume", picture(study, volume),
                  "Limited runs at level 9, on XY. Right: the volume was turned by 90° about z, and the picture of its grid "
                  "was turned back.")
    verdicts = [verdict(one.spreads) for one in (whole, cropped)]
    report.claim(8, "the accuracy is absolute and does not depend on the direction of view: a turned volume gets the turned grid",
                 HOLDS if verdicts == [HOLDS, HOLDS] else FAILS if FAILS in verdicts else PARTLY,
                 "The {name} fills complete root cubes. Turned by 90° about each axis, its numbers of active points differ from "
                 "their mean by at most {active:.2f} %, the root mean square errors by {rmse:.2f} %, the areas of an "
                 "isosurface by {area:.2f} %; of the points that are active in one of two grids, at least {same:.2f} % are "
                 "active in both ({unturned:.0f} % if the volume is turned by 180° and not turned back). Without some "
                 "samples at its ends, it lies otherwise in the root cubes when it is turned: numbers of points differ by at "
                 "most {other_active:.2f} %, errors by {other_rmse:.2f} %, areas by {other_area:.2f} %, but of the points "
                 "only {other_same:.1f} % are at the same places in the worst case. (Up to {alike:g} % count as alike.)",
                 name=volume.name, same=min(whole.common), unturned=whole.common_unturned, other_active=cropped.spreads["active"],
                 other_rmse=cropped.spreads["rmse"], other_area=cropped.spreads["area"], other_same=min(cropped.common),
                 alike=ALIKE, **whole.spreads)


def active_points(mesh, dims, axes):
    """Which samples are points of the grid, turned back: booleans [z, y, x]."""
    places = mesh.points.astype(int)
    places = places[(places < dims).all(axis=1)]
    mask = numpy.zeros(dims[::-1], dtype=bool)
    mask[places[:, 2], places[:, 1], places[:, 0]] = True
    return numpy.rot90(mask, -1, axes) if axes else mask


def common(one, other):
    """The part of the points of both that both have."""
    return float((one & other).sum() / (one | other).sum())


def picture(study, volume):
    samples = volume.samples()
    turned = write(study.directory, "turned_flat", numpy.rot90(samples, 1, (1, 2)), volume.low, volume.high)
    panels = []
    for one in (volume, turned):
        mesh = study.tagrid.mesh(study.tagrid.grid(one, "--max-level", 9), padded=False)
        panels.append(drawing.projection(mesh, (0, 1), study.pixels(520) / mesh.points[:, :2].max()))
    # Turning rows that go upwards is turning a picture the other way.
    return drawing.beside([panels[0], panels[1].rotate(90, expand=True)], ["as it lies", "turned, and turned back"])
