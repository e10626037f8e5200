"""The results as plots: SVG, drawn by gnuplot."""

import re
import shutil
import subprocess

import rates
from running import WORLD, Failure, say

# Colors that the color-blind can tell apart (Okabe and Ito); tagrid is black, and thicker.
COLORS = {"tagrid": "#000000", "tagrid --grid derived": "#444444", "tagrid --psnr": "#666666", "JPEG-LS": "#0072B2",
          "SZ3": "#D55E00", "SPERR": "#009E73", "SPERR --psnr": "#56B4E9",
          "zfp": "#CC79A7", "JPEG XL": "#E69F00", "zstd -1": "#999999"}

PREAMBLE = """set encoding utf8
set border 3
set tics nomirror out
set grid ytics lt 1 lc rgb '#dddddd'
set key outside right center vertical samplen 1.5
"""


def file_name(text):
    return re.sub(r"[^A-Za-z0-9_.-]", "_", text)


def quoted(text):
    return "'" + text.replace("'", "''") + "'"


def block(name, points):
    lines = "\n".join(" ".join(str(value) for value in point) for point in points)
    return f"${name} << EOD\n{lines}\nEOD\n"


def lines_of(results, volume, x_of):
    """Data blocks and the plot command, with one line per codec."""
    blocks, curves = "", []
    for i, codec in enumerate(codec for codec in rates.codecs_of(results, volume) if codec in COLORS):
        points = [(x_of(row), row["bits"]) for row in rates.rows_of(results, volume, codec)]
        points = sorted(point for point in points if point[0] is not None)
        if points:
            blocks += block(f"codec{i}", points)
            width = 3 if codec.startswith("tagrid") else 1.5
            curves.append(f"$codec{i} using 1:2 with linespoints lw {width} pt 7 ps 0.4 lc rgb '{COLORS[codec]}' "
                          f"title {quoted(codec)}")
    return blocks, "plot " + ", ".join(curves) + "\n" if curves else ""


def rate_plot(results, volume):
    """Two panels: bits per voxel against the bound, and against PSNR. Empty if there is nothing to draw."""
    bounds = rates.bounds_of(results, volume)

    def position(row):
        return bounds.index(row["bound"]) if row["codec"] not in rates.OF_PSNR else None

    by_bound = lines_of(results, volume, position)
    by_psnr = lines_of(results, volume, lambda row: row["psnr"])
    if not by_bound[1]:
        return ""
    tics = ", ".join(f"'{bound}' {i}" for i, bound in enumerate(bounds))
    size = "1160,400" if by_psnr[1] else "580,400"
    text = f"set terminal svg size {size} font 'sans-serif,12' background 'white'\n" + PREAMBLE
    text += by_bound[0] + "set logscale y\nset ylabel 'bits per voxel'\n"
    if by_psnr[1]:
        text += "set multiplot layout 1,2\n"
    text += f"set title {quoted(volume + ': same largest error')} noenhanced\nset xlabel 'largest error E'\n"
    text += f"set xtics ({tics})\nset xrange [-0.3:{len(bounds) - 0.7}]\n" + by_bound[1]
    if by_psnr[1]:
        text += f"set title {quoted(volume + ': same PSNR')} noenhanced\nset xlabel 'PSNR, dB'\n"
        text += "set xtics autofreq\nset xrange [*:*]\n" + by_psnr[0] + by_psnr[1] + "unset multiplot\n"
    return text


def speed_plot(results, volume):
    """Bars: encoding and decoding, on one and on all threads, of every codec at one bound. Empty if there is none."""
    if not rates.rows_of(results, volume):
        return ""
    bound, threads = rates.speed_bound(results, volume), results["machine"]["threads"]
    rows = [row for row in rates.rows_of(results, volume, bound=bound) if row["codec"] not in ("copy", *rates.OF_PSNR)]
    bars = [("encode", 1, "#0072B2"), ("decode", 1, "#D55E00")]
    if threads > 1:
        bars = [("encode", 1, "#0072B2"), ("encode", threads, "#9ecae1"), ("decode", 1, "#D55E00"),
                ("decode", threads, "#fdbe85")]
    # gnuplot refuses columns without any value, as for numbers of threads that no codec uses.
    bars = [bar for bar in bars if any(rates.speed(results, row, *bar[:2]) for row in rows)]
    points = [[f'"{row["codec"]}"', *(rates.speed(results, row, step, n) or "NaN" for step, n, _ in bars)]
              for row in rows]
    if not rows:
        return ""
    columns = []
    for i, (step, n, color) in enumerate(bars):
        label = f"{step}, {n} thread{'s' if n > 1 else ''}"
        columns.append(f"$speeds using {i + 2}:xtic(1) lc rgb '{color}' title {quoted(label)}")
    text = "set terminal svg size 860,360 font 'sans-serif,12' background 'white'\n" + PREAMBLE + block("speeds", points)
    text += f"set title {quoted(f'{volume}, E = {bound}: speed by the clock')} noenhanced\n"
    text += "set ylabel 'million voxels a second'\nset yrange [0:*]\nset style data histogram\n"
    text += "set style histogram cluster gap 1\nset style fill solid 0.9 noborder\nset xtics noenhanced\n"
    return text + "plot " + ", ".join(columns) + "\n"


def draw(results, directory):
    """Writes the plots into the directory and returns their names."""
    if not shutil.which("gnuplot"):
        say("no plots are drawn: gnuplot is not on the PATH (Debian package: gnuplot-nox)")
        return []
    names = []
    for volume in results["volumes"]:
        for kind, script in (("rate", rate_plot(results, volume)), ("speed", speed_plot(results, volume))):
            if not script:
                continue
            name = f"{file_name(volume)}_{kind}.svg"
            run = subprocess.run(["gnuplot"], input=script, capture_output=True, text=True)
            if run.returncode != 0 or not run.stdout:
                raise Failure(WORLD, f"gnuplot failed on {name}: {run.stderr.strip()}")
            (directory / name).write_text(run.stdout)
            names.append(name)
    return names
