#!/usr/bin/python3
"""Draws the pictures of docs/python.md with matplotlib.

    python_tour.py VOLUME.tag DIRECTORY      PYTHONPATH names the Python package, such as build/release/python
"""

import sys

import matplotlib
import numpy as np
import tagrid

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: E402


def draw_slices(scan, path):
    """The middle slice along each axis, with lengths in mm."""
    middle = [n // 2 for n in scan.shape]
    dz, dy, dx = scan.spacing
    z, y, x = (n * step for n, step in zip(scan.shape, scan.spacing))
    figure, axes = plt.subplots(1, 3, figsize=(10, 4), width_ratios=(x, x, y), layout="constrained")
    for ax, samples, extent, title, names in (
            (axes[0], scan[middle[0]], (0, x, y, 0), f"scan[{middle[0]}]", "xy"),
            (axes[1], scan[:, middle[1]], (0, x, z, 0), f"scan[:, {middle[1]}]", "xz"),
            (axes[2], scan[:, :, middle[2]], (0, y, z, 0), f"scan[:, :, {middle[2]}]", "yz")):
        ax.imshow(samples, cmap="gray", extent=extent, vmin=-1000, vmax=1500)
        ax.set(title=title, xlabel=f"{names[0]} (mm)", ylabel=f"{names[1]} (mm)")
    figure.savefig(path, dpi=80)


def draw_surface(scan, path, iso):
    """The surface of a value, lit from the viewer's side."""
    points, triangles = scan.surface(iso, close=True)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    light = normals @ (np.array([0.4, -0.8, 0.45])) / np.where(lengths > 0, lengths, 1)
    shades = 0.35 + 0.6 * np.clip(light, 0, 1)
    figure = plt.figure(figsize=(6, 5), layout="constrained")
    ax = figure.add_subplot(projection="3d")
    colors = plt.cm.bone(shades)
    ax.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors=colors, linewidths=0.2))
    low, high = points.min(axis=0), points.max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_axis_off()
    ax.set_box_aspect(high - low, zoom=1.4)
    ax.view_init(25, -60)
    figure.savefig(path, dpi=80)


def main():
    path, directory = sys.argv[1:]
    with tagrid.open(path) as scan:
        draw_slices(scan, f"{directory}/python_slices.png")
        draw_surface(scan, f"{directory}/python_surface.png", 300)


if __name__ == "__main__":
    main()
