"""Puts the summary of a run into a document, between two marks, and the rest into a folder beside it."""

import shutil

import tables
from failure import BROKEN_INPUT, Failure

BEGIN, END = "<!-- begin: written by tools/research/bench -->\n", "<!-- end: written by tools/research/bench -->\n"


def check(path):
    """Raises Failure if the document has no place for a summary."""
    text = path.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise Failure(BROKEN_INPUT, f"{path}: needs the lines '{BEGIN.strip()}' and '{END.strip()}'")


def update(path, results, output, plots):
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    for plot in plots:
        shutil.copy(output / plot, folder / plot)
    (folder / "results.md").write_text(tables.whole(results, plots))
    text = path.read_text()
    before, after = text[:text.index(BEGIN)], text[text.index(END):]
    path.write_text(before + BEGIN + tables.summary(results, plots, folder.name + "/") + after)
