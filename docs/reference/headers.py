"""Writes the pages of the references of C and C++ from the headers: headers.py INCLUDE FOLDER

A page has the comment at the beginning of a header, and then what the header declares, in its order and its sections. The
words about each declaration are those that doxygen found.
"""

import pathlib
import re

# What a header declares, and the directive that shows it. Structs and classes need their members.
DECLARATIONS = {
    "c": [(r"^#define (TAGRID_[A-Z_]+) \d", "define"),
          (r"^typedef enum (\w+)", "enum"),
          (r"^typedef struct (\w+) \{", "struct"),
          (r"^typedef (?:struct \w+ |\w+ \(\*)(\w+)(?:;|\))", "typedef"),
          (r"^TAGRID_API [^;(]*\b(\w+)(?<!_init_sized)\(", "function"),
          (r"^static inline void (\w+)\(", "function")],
    "cpp": [(r"^class (\w+)", "class"),
            (r"^struct (\w+)", "struct"),
            (r"^using (\w+)", "typedef"),
            (r"^constexpr \w+ (\w+)\(", "function")],
}
SECTION = re.compile(r"^/\* -{10,} (.*) \*/$", re.M)


def declarations(text, language):
    """Directives and names, in the order of the header."""
    found = [(match.start(), directive, match[1]) for pattern, directive in DECLARATIONS[language]
             for match in re.finditer(pattern, text, re.M)]
    return [(directive, name) for _, directive, name in sorted(found)]


def heading(text, underline):
    return f"{text}\n{underline * len(text)}\n"


def sections(path, language):
    """The parts of a header: a title, and directives with names."""
    text = path.read_text()
    if language == "cpp":
        text = re.sub(r"^namespace detail \{.*?^\}  // namespace detail$", "", text, flags=re.M | re.S)
    parts = SECTION.split(text)
    yield "", declarations(parts[0], language)
    for title, part in zip(parts[1::2], parts[2::2]):
        yield title[0].upper() + title[1:], declarations(part, language)


def preamble(path):
    """The comment at the beginning, as reStructuredText: indented lines are code, or conventions."""
    text = path.read_text()
    if text.startswith("/*"):
        text = re.sub(r"^ \* ?", "", text[3:text.index("*/")].rstrip(), flags=re.M)
    else:
        text = re.sub(r"^// ?", "", re.match(r"(?://.*\n)+", text)[0], flags=re.M)
    made = []
    for part in text.split("\n\n"):
        if part.startswith("    "):
            part = f".. code-block:: {'cpp' if path.suffix == '.hpp' else 'c'}\n\n{part}"
        elif part.startswith("Conventions\n"):
            # A name is in front of its lines.
            names = ((line[2:14].strip(), line[14:]) for line in part.splitlines()[1:])
            part = "\n".join(f"{name}\n   {text}" if name else f"   {text}" for name, text in names)
            part = re.sub(r"tagrid_\.\.\._\w+\(\)", r"``\g<0>``", part)
        made.append(part)
    return "\n\n".join(made) + "\n"


def shown(directive, name, language):
    name = f"tagrid::{name}" if language == "cpp" else name
    members = "   :members:\n   :undoc-members:\n" if directive in ("struct", "class") else ""
    return f".. doxygen{directive}:: {name}\n   :project: {language}\n{members}"


def page(title, headers, language):
    made = [heading(title, "="), "Made from the headers, whose comments are the text.\n"]
    for path in headers:
        made += [heading(f"{path.parent.name}/{path.name}", "-"), preamble(path)]
        for section, found in sections(path, language):
            made += [heading(section, "~")] * bool(section and found)
            made += [shown(directive, name, language) for directive, name in found]
    return "\n".join(made)


def pages(include):
    """The pages by the names of their files."""
    folder = include / "tagrid"
    return {"c.rst": page("C reference", [folder / "tagrid.h", folder / "tagrid_blocks.h"], "c"),
            "cpp.rst": page("C++ reference", [folder / "tagrid.hpp"], "cpp")}


if __name__ == "__main__":
    import sys

    for name, text in pages(pathlib.Path(sys.argv[1])).items():
        (pathlib.Path(sys.argv[2]) / name).write_text(text)
