"""Docstrings of the Python package as Sphinx wants them: parameters and errors become fields.

A docstring names them at the beginning of a line or of a sentence, "level: the grid up to this level. region: ...", or
"ArgumentError: level is too high."
"""

import inspect
import re

ERROR = re.compile(r"\w*(?:Error|Exception)")


def names_of(thing):
    """The parameters of a function, or of the constructor of a class."""
    try:
        return set(inspect.signature(thing).parameters)
    except (TypeError, ValueError):
        return set()


def as_fields(app, what, name, thing, options, lines):
    """For Sphinx's event autodoc-process-docstring: changes `lines` in place."""
    known = names_of(thing)
    made = []
    for paragraph in re.split(r"\n(?:[ \t]*\n)+", "\n".join(lines).strip("\n")):
        if paragraph.startswith(">>>"):
            made.append(paragraph)
            continue
        if paragraph.startswith(" "):
            made += ["::", paragraph]
            continue
        # Stars are those of Python.
        paragraph = re.sub(r"\*(?=\S)", r"\\*", paragraph)
        parts = re.split(r"(?:^|(?<=[.;]\s)|(?<=\n))(\w+(?:\(\w+(?:, \w+)*\))?(?:, \w+)*):\s", paragraph)
        text, fields = parts[0], []
        for names, said in zip(parts[1::2], parts[2::2]):
            words = re.split(r", ", re.sub(r"\(.*\)", "", names))
            said = " ".join(said.split())
            if all(ERROR.fullmatch(word) for word in words):
                fields += [f":raises {', '.join(words)}: {said}"]
            elif known.issuperset(words):
                fields += [f":param {words[0]}: {said}", *(f":param {word}: see `{words[0]}`." for word in words[1:])]
            elif fields:
                fields[-1] += f" {names}: {said}"
            else:
                text = f"{text.rstrip()} {names}: {said}"
        made += [part for part in (text.strip(), "\n".join(fields)) if part]
    lines[:] = "\n\n".join(made).split("\n") + [""]
