"""The results as Markdown."""

from markdown import table

HEAD = ["volume", "samples", "--brick", "nodes", "parts", "read", "written", "marks", "rows in a strip", "memory", "index",
        "encode", "cores busy", "decode"]


def human(size):
    for unit in ("B", "kB", "MB", "GB", "TB", "PB"):
        if size < 999.5 or unit == "PB":
            return f"{size:.3g} {unit}"
        size /= 1000


def duration(seconds):
    if seconds < 120:
        return f"{seconds:.0f} s"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 172800 else f"{seconds / 86400:.1f} days"


def row_of(volume, cluster, outcome):
    head = [human(volume.bytes), " × ".join(map(str, volume.dims)), volume.brick, cluster.nodes]
    if outcome is None:
        return head + [f"not within {human(cluster.memory)}"] + [""] * 9
    return head + [outcome.parts, f"{human(outcome.read)}, {outcome.read / volume.bytes:.2f} ×",
                   human(outcome.written), f"{outcome.marked:.2f} ×", f"{outcome.rows} of {volume.bricks(1)}",
                   human(outcome.memory), human(outcome.index), duration(outcome.encode),
                   f"{100 * outcome.busy:.0f} %", duration(outcome.decode)]


def markdown(rows, rates):
    cluster = rows[0][1]
    return (f"Nodes of {cluster.cores} cores, {human(cluster.memory)} a process, {human(cluster.node_bandwidth)}/s a "
            f"node, {human(cluster.file_system)}/s for all. Rates of one core: {rates['source']}: "
            + ", ".join(f"{name} {value:.3g}" for name, value in rates["rates"].items())
            + " (ns per sample, and bits per sample).\n\n" + table(HEAD, [row_of(*row) for row in rows]))
