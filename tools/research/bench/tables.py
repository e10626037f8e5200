"""The results as Markdown."""

import textwrap

import rates
from markdown import table


def wrapped(paragraph):
    """In lines of 120 columns, as in other documents."""
    return "\n".join(textwrap.wrap(paragraph, 120, break_long_words=False, break_on_hyphens=False))


def number(value, digits):
    return "–" if value is None else f"{value:.{digits}f}"


def circumstances(results):
    machine, volumes = results["machine"], results["volumes"]
    dims = ", ".join(f"{name} ({' x '.join(map(str, v['dims']))}, {v['type']})" for name, v in volumes.items())
    count = results["repetitions"]
    repetitions = "one repetition" if count == 1 else f"medians of {count} repetitions (JPEG XL: 1)"
    lines = [
        f"{machine['date']}; {machine['processor']}, {machine['processors']} processors, {machine['memory_gb']} GB; "
        f"{machine['system']}; tagrid {machine['commit']}, {machine['build']}. One run of {machine['minutes']} minutes, "
        f"{repetitions}, "
        f"{'1 and ' if machine['threads'] > 1 else ''}{machine['threads']} threads, files on "
        f"{machine['file_system']}; load before and after: {machine['load_before']:.1f}, {machine['load_after']:.1f}.",
        f"Volumes: {dims}.",
        "Codecs: " + "; ".join(f"{name} ({version})" for name, version in results["codecs"].items()) + ".",
    ]
    lines += [f"Not measured: {name}, because {reason}." for name, reason in results["missing"].items()]
    notes = [note.rstrip(".") + "." for note in results["notes"]]
    return "\n\n".join(map(wrapped, lines)) + "\n" + "".join(f"\n- {note}" for note in notes) + ("\n" if notes else "")


def sizes(results):
    """Bits per voxel at every bound: one line for each volume and bound, a column for each codec."""
    codecs = [codec for codec in results["codecs"] if codec not in ("copy", *rates.OF_PSNR)]
    rows = []
    for volume in results["volumes"]:
        for bound in rates.bounds_of(results, volume):
            found = {row["codec"]: row for row in rates.rows_of(results, volume, bound=bound)}
            best = rates.best_other(results, volume, bound)
            cells = [f"{found[c]['bits']:.4f}{'' if found[c]['kept'] else ' (!)'}" if c in found else "–" for c in codecs]
            mine = found.get("tagrid")
            ratio = mine["bits"] / best["bits"] if mine and best else None
            activity = mine and mine["bits_of_parts"].get("activity")
            rows.append([volume, bound, *cells, number(activity, 4), number(ratio, 3)])
    means = "; ".join(f"{number(rates.geometric_mean(ratios), 3)} {where}" for ratios, where in (
        (rates.ratios_to_best(results, True), "for E = 0"), (rates.ratios_to_best(results, False), "for E > 0"))
        if ratios)
    text = table(["volume", "E", *codecs, "of it activity", "ratio to best other"], rows)
    return text + (f"\nGeometric mean of the ratios: {means}.\n" if means else "")


def equal_psnr(results):
    """Bits per voxel of other codecs at the PSNR that tagrid reaches at a bound."""
    others = [codec for codec in results["codecs"] if codec not in (*rates.BOUNDED, "copy", "JPEG XL", "zstd -1")]
    rows = []
    for volume in results["volumes"]:
        for mine in rates.rows_of(results, volume, "tagrid"):
            if mine["psnr"] is None:
                continue
            cells = []
            for other in others:
                if other in rates.OF_PSNR:
                    direct = rates.row_of(results, volume, other, mine["bound"])
                    cells.append(f"{direct['bits']:.4f} ({number(direct['psnr'], 1)} dB)" if direct else "–")
                else:
                    cells.append(number(rates.bits_at_psnr(results, volume, other, mine["psnr"]), 4))
            rows.append([volume, mine["bound"], f"{mine['psnr']:.2f}", f"{mine['bits']:.4f}", *cells])
    return table(["volume", "E of tagrid", "PSNR, dB", "tagrid", *others], rows) if rows else ""


def full_row(results, row, threads):
    mine = rates.row_of(results, row["volume"], "tagrid", row["bound"])
    cells = [row["volume"], row["bound"], row["codec"], f"{row['bits']:.4f}", number(row["psnr"], 2),
             f"{row['max_error']}{'' if row['kept'] else ' (!)'}"]
    for step in ("encode", "decode"):
        run = row["runs"]["1"][step]
        cells += [number(rates.speed(results, row, step), 1), number(run["cpu"], 2)]
        cells += [number(rates.speed(results, row, step, threads), 1)] if threads > 1 else []
        cells.append(f"{run['peak_mb']:.0f}")
        faster = run["cpu"] / mine["runs"]["1"][step]["cpu"] if mine and mine["runs"]["1"][step]["cpu"] else None
        cells.append(number(faster, 2))
    return cells


def full(results, rows):
    threads = results["machine"]["threads"]
    head = ["volume", "E", "codec", "bits per voxel", "PSNR, dB", "largest error"]
    for step in ("encode", "decode"):
        head += [f"{step} Mvoxel/s, 1 thread", "CPU s"] + [f"Mvoxel/s, {threads} threads"] * (threads > 1)
        head += ["MB", "tagrid is × as fast"]
    return table(head, [full_row(results, row, threads) for row in rows])


def speeds(results):
    """The rows at the bound of each volume at which speeds are shown, and at 0, where all codecs take part."""
    rows = []
    for volume in results["volumes"]:
        for bound in dict.fromkeys((0, rates.speed_bound(results, volume))):
            rows += [row for row in rates.rows_of(results, volume, bound=bound) if row["codec"] not in rates.OF_PSNR]
    return full(results, rows)


def concurrency(results):
    rows = []
    for row in results["concurrency"]:
        for step in ("encode", "decode"):
            part = row[step]
            rows.append([row["volume"], row["bound"], step, f"{part['threads_wall']:.3f}",
                         f"{part['processes_wall']:.3f}", f"{part['ratio']:.2f}"])
    if not rows:
        return ""
    n = results["concurrency"][0]["threads"]
    return table(["volume", "E", "step", f"one process, {n} threads: s", f"{n} processes of 1 thread at once: s",
                  "voxels a second, first over second"], rows)


SECTIONS = (
    ("Bits per voxel at the same largest error", sizes,
     "Entire files. (!): the bound was not kept. Best other: the smallest that keeps the bound."),
    ("Bits per voxel at the same PSNR", equal_psnr,
     "At the PSNR that tagrid reaches at E. Others: interpolated between the bounds that were measured (–: outside of "
     "them); tagrid --psnr and SPERR --psnr were asked for that PSNR, and have no bound."),
    ("Speed and memory", speeds,
     "Entire processes. Mvoxel/s by the clock; CPU s: user and system, 1 thread; MB: peak resident memory, 1 thread. "
     "× as fast: CPU seconds of the codec over those of tagrid."),
    ("Threads and processes", concurrency, "One volume on all threads, and as many volumes at once on one thread each."),
)


def summary(results, plots, directory=""):
    parts = [circumstances(results)]
    if plots:
        parts.append("\n".join(f"![{plot.rsplit('.', 1)[0]}]({directory}{plot})" for plot in plots) + "\n")
    for title, section, explanation in SECTIONS:
        text = section(results)
        if text:
            parts.append(f"### {title}\n\n{wrapped(explanation)}\n\n{text}")
    return "\n".join(parts)


def whole(results, plots):
    every = full(results, results["rows"])
    return f"# Benchmark\n\n{summary(results, plots)}\n### Every row\n\n{every}"
