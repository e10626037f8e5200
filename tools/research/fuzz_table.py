#!/usr/bin/python3
"""python3 tools/research/fuzz_table.py CORPUS [PAGE]

Sums up the runs of the fuzzers that `tools/fuzz.sh --corpus CORPUS` recorded, as a table: executions of all runs, edges
that the last run reached, and runs that failed. With PAGE (docs/dev/reliability.md), the table replaces the one there
that begins with "| target |".
"""

import collections
import csv
import pathlib
import re
import sys

TARGETS = pathlib.Path(__file__).parents[2] / "tests/fuzz/targets.h"
COLUMNS = "date commit target seconds executions covered edges status".split()


def inputs():
    """What each target reads, in the words of targets.h and its order."""
    return dict((name, " ".join(text.split("/// ")).strip().split(";")[0].rstrip("."))
                for text, name in re.findall(r"((?:/// [^\n]*\n)*)void (\w+)\(Bytes bytes\);", TARGETS.read_text()))


def table_of(runs):
    """Lines of Markdown."""
    by_target = collections.defaultdict(list)
    for run in runs:
        by_target[run["target"]].append(run)
    hours = sum(int(run["seconds"]) for run in runs) / 3600
    total = sum(int(run["executions"]) for run in runs)
    yield "| target | input | executions | edges covered | failed runs |"
    yield "|---|---|---|---|---|"
    for target, text in inputs().items():
        of_target = by_target.pop(target, [])
        if not of_target:
            yield f"| {target} | {text} | none | | |"
            continue
        executions = sum(int(run["executions"]) for run in of_target)
        failed = sum(run["status"] != "0" for run in of_target)
        yield f"| {target} | {text} | {executions:,} | {int(of_target[-1]['covered']):,} | {failed} |"
    if by_target:
        sys.exit(f"{TARGETS} has no target {' '.join(by_target)}")
    days = sorted(run["date"] for run in runs)
    commits = len({run["commit"] for run in runs})
    yield (f"| **all** | {len(runs)} runs from {days[0]} to {days[-1]}, of {commits} commits "
           f"| **{total:,}** in {hours:.1f} h | | |")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    with open(pathlib.Path(sys.argv[1]) / "runs.tsv", newline="") as file:
        runs = list(csv.DictReader(file, COLUMNS, delimiter="\t"))
    table = "\n".join(table_of(runs)) + "\n"
    if len(sys.argv) == 2:
        print(table, end="")
        return
    page = pathlib.Path(sys.argv[2])
    old = page.read_text()
    new, count = re.subn(r"^\| target \|(?:.*\n)+?(?=\n)", lambda _: table, old, flags=re.M)
    if count != 1:
        sys.exit(f"{page} has {count} tables that begin with '| target |'")
    page.write_text(new)


main()
