"""Table 1 with its foot, Figs. 11 to 18: the two volumes and their grids. Claim 9: levels of approximation."""

import math
import time

import numpy

import drawing
from report import FAILS, HOLDS
from scene import Scene, contour_of_samples
from vtk_data import read_ply

# What the paper prints: Table 1, and the text below it. Level: seconds, points of the complete grid, active points, percent.
PRINTED_LOBSTER = {3: (0.044664, 1323, 416, 31.4), 6: (0.084752, 8405, 1983, 23.60), 9: (0.394752, 59049, 11937, 20.2),
                   12: (3.08826, 440657, 42475, 9.3902), 15: (18.7092, 3400353, 298892, 8.79)}
PRINTED_FOOT = {9: 15.2063, 12: 10.3186}


def add_to(report, study):
    report.section("The volumes and their grids (Table 1, Figs. 11 to 18)")
    lobster = limited_runs(study, study.lobster, (3, 6, 9, 12, 15))
    foot = limited_runs(study, study.foot, (9, 12))
    tables(report, study, lobster, foot)
    report.figure("fig-11", "Fig. 11: the lobster", picture_of_samples(study, study.lobster), about_input(study.lobster))
    for level, name in ((6, "fig-12"), (9, "fig-13"), (12, "fig-14"), (15, "level-15")):
        title = f"Fig. {name[-2:]}: the grid of the lobster at level {level}" if level < 15 else "The grid of the lobster at level 15"
        mesh = study.tagrid.mesh(lobster[level].tag, padded=False)
        report.figure(name, title, drawing.three_views(mesh, study.pixels(900) / study.lobster.dims[0]),
                      f"All edges of the limited run's tetrahedra, projected on XY, YZ and ZX: {lobster[level].active:,} points." +
                      (" The paper has no picture of this level." if level == 15 else ""))
    report.figure("fig-15", "Fig. 15: the foot", picture_of_samples(study, study.foot), about_input(study.foot))
    picture, triangles = picture_of_surface(study, study.foot)
    report.figure("fig-16", "Fig. 16: the result of the foot", picture,
                  f"The isosurface {study.foot.iso:g} of the piecewise linear field on the complete grid: {triangles:,} "
                  "triangles, and a part of it with their edges.")
    for level, name in ((9, "fig-17"), (12, "fig-18")):
        mesh = study.tagrid.mesh(foot[level].tag, padded=False)
        report.figure(name, f"Fig. {name[-2:]}: the grid of the foot at level {level}, projected on XY",
                      drawing.projection(mesh, (0, 1), study.pixels(900) / study.foot.dims[1]),
                      f"All edges of the limited run's tetrahedra: {foot[level].active:,} points.")
    claim_levels(report, study)


class Run:
    """A run that marks up to a level only, as those of the paper's tables."""

    def __init__(self, study, volume, level):
        start = time.monotonic()
        self.tag = study.tagrid.grid(volume, "--max-level", level)
        self.seconds = time.monotonic() - start
        found = study.tagrid.info(self.tag)["levels"][level]
        self.points, self.active = found["points"], found["active"]
        self.per_cent = 100 * self.active / self.points


def limited_runs(study, volume, levels):
    return {level: Run(study, volume, level) for level in levels}


def tables(report, study, lobster, foot):
    rows = []
    for level, (seconds, points, active, per_cent) in PRINTED_LOBSTER.items():
        run = lobster[level]
        rows.append((level, f"{seconds:.3f}", f"{run.seconds:.3f}", f"{points:,}", f"{run.points:,}", f"{active:,}",
                     f"{run.active:,}",
                     f"{per_cent:.2f}", f"{run.per_cent:.2f}"))
    report.table("Table 1: the lobster",
                 ["level", "paper: s", "here: s", "paper: all points", "here", "paper: active points", "here", "paper: %",
                  "here: %"], rows)
    rows = [(level, f"{per_cent:.4f}", f"{foot[level].per_cent:.4f}", f"{foot[level].points:,}", f"{foot[level].active:,}")
            for level, per_cent in PRINTED_FOOT.items()]
    report.table("Below Table 1: the foot", ["level", "paper: %", "here: %", "here: all points", "here: active points"], rows)
    report.text("The paper's seconds are those of 14 processors of 2.8 GHz; ours are those of one process, from its start to its end. "
                "How the authors brought the volumes to these sizes is not known, and the criterion is printed with gaps; so "
                "points can be expected to be similar, not equal.")
    different = [level for level, row in PRINTED_LOBSTER.items() if abs(100 * row[2] / row[1] - row[3]) > 0.1]
    for level in different:
        _, points, active, per_cent = PRINTED_LOBSTER[level]
        report.departure(f"Table 1, level {level}: {active:,} of {points:,} points are {100 * active / points:.2f} %, not {per_cent:g} % as printed.")
    if study.lobster.is_real:
        coarsest = lobster[3]
        roots = study.tagrid.info(coarsest.tag)["levels"][0]["active"]
        report.departure(f"Table 1, level 3: the paper has 31.4 % active points, we have {coarsest.per_cent:.1f} %. "
                         f"{roots} of our {coarsest.active} active points are corners of root cubes: on edges as long as a "
                         "root cube our reading of the criterion "
                         "finds no violation, and the authors' did.")
        for name, runs, printed in (("lobster", lobster, {level: row[3] for level, row in PRINTED_LOBSTER.items()}),
                                    ("foot", foot, PRINTED_FOOT)):
            ratios = ", ".join(f"{runs[level].per_cent / per_cent:.2f} at level {level}" for level, per_cent in printed.items())
            report.departure(f"The {name}: active points, ours divided by the paper's: {ratios}.")


def about_input(volume):
    return f"{' x '.join(map(str, volume.dims))} samples. The isosurface {volume.iso:g} of all samples (marching cubes), and the slice in the middle."


def view_of(volume):
    """A direction from which the volume fills a picture."""
    return dict(view=(0.15, 0.5, -0.85), up=(0, 1, 0)) if volume.name == "lobster" else dict(view=(-0.75, 0.3, -0.45), up=(0, 0, 1))


def picture_of_samples(study, volume):
    samples = volume.samples()
    scene = Scene(study.pixels(620), study.pixels(520), zoom=1.25, **view_of(volume))
    scene.add(contour_of_samples(samples, volume.iso), drawing.SHELL, smooth=True)
    middle = drawing.gray(samples[samples.shape[0] // 2], volume.low, volume.low + (volume.high - volume.low) * 0.6)
    height = study.pixels(440)
    middle = middle.resize((round(height * middle.width / middle.height), height))
    return drawing.beside([scene.picture(), middle], ["isosurface", f"slice z = {samples.shape[0] // 2}"])


def picture_of_surface(study, volume):
    ply, counts = study.tagrid.surface(study.tagrid.grid(volume), volume.iso)
    surface = read_ply(ply)
    panels = []
    for zoom, edges in ((1.0, None), (5.0, (0.45, 0.34, 0.25))):
        scene = Scene(study.pixels(520), study.pixels(520), zoom=zoom, **view_of(volume))
        scene.add(surface, drawing.SHELL, smooth=edges is None, edges=edges)
        panels.append(scene.picture())
    return drawing.beside(panels, ["whole", "a part, with edges"]), counts["triangles"]


def claim_levels(report, study):
    """Points level by level, against those of the cubes that an octree would have: every third level."""
    levels = study.tagrid.info(study.tagrid.grid(study.lobster))["levels"]
    rows, factors, octree_factors = [], [], []
    for i, level in enumerate(levels):
        factor = level["active"] / levels[i - 1]["active"] if i else math.nan
        third = level["active"] / levels[i - 3]["active"] if i and i % 3 == 0 else math.nan
        factors += [factor] if i else []
        octree_factors += [third] if not math.isnan(third) else []
        rows.append((level["level"], f"{level['points']:,}", f"{level['active']:,}", f"{factor:.2f}" if i else "",
                     f"{third:.2f}" if i and i % 3 == 0 else ""))
    report.table(f"The complete grid of the {study.lobster.name} ({study.lobster.path.name}), level by level",
                 ["level", "all points", "active points", "times those of the level before",
                  "times those three levels before: an octree's step"], rows)
    octree = len(levels) // 3 + 1
    mean, octree_mean = float(numpy.exp(numpy.log(factors).mean())), float(numpy.exp(numpy.log(octree_factors).mean()))
    report.claim(9, "bisection gives more levels of approximation than an octree",
                 HOLDS if len(levels) > octree and max(factors) < max(octree_factors) else FAILS,
                 "There are {levels} levels where an octree of the same cubes has {octree}. From one level to the next, "
                 "points become {mean:.2f} times as many on average and {most:.2f} times at most; with the steps of an "
                 "octree {octree_mean:.2f} times, {octree_most:.2f} at most.",
                 levels=len(levels), octree=octree, mean=mean, most=max(factors), octree_mean=octree_mean,
                 octree_most=max(octree_factors))
