"""Tables in Markdown, and documents that contain them."""

from running import BROKEN_INPUT, Failure


def rows_of(head, rows):
    """The lines of a table, one by one as `rows` yields them."""
    for line in (head, ["---"] * len(head)):
        yield "| " + " | ".join(line) + " |"
    for row in rows:
        yield "| " + " | ".join(map(str, row)) + " |"


def table(head, rows):
    return "\n".join(rows_of(head, rows)) + "\n"


def print_table(head, rows):
    """Prints each row of a table as soon as it is known."""
    for line in rows_of(head, rows):
        print(line, flush=True)


class Document:
    """The part of a document between two lines, which is replaced. Raises Failure if a line is missing."""

    def __init__(self, path, begin, end):
        self.path, text = path, path.read_text()
        if text.count(begin + "\n") != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
            raise Failure(BROKEN_INPUT, f"{path}: needs the lines '{begin}' and '{end}'")
        self._before, self._after = text[:text.index(begin)] + begin + "\n", text[text.index(end):]

    def replace(self, text):
        self.path.write_text(self._before + text + self._after)
