"""Marks the plain comments of a C header for doxygen, which runs this as a filter: mark_comments.py HEADER"""

import pathlib
import re
import sys

text = pathlib.Path(sys.argv[1]).read_text()
# The first one is about the file.
text = re.sub(r"\A/\* ", "/** @file\n * ", text)
# Before a declaration, but not the lines between sections.
text = re.sub(r"^( *)/\* (?=[^-])", r"\1/** ", text, flags=re.M)
# Beside a member.
text = re.sub(r"(?<=[^ /\n]) +/\* ", " /**< ", text)
text = text.replace("size_t struct_size;", "size_t struct_size; /**< set by the init function */")
for declared, comment in ((r"TAGRID_API void tagrid_\w+_init_sized", "For a struct of `size` bytes."),
                          (r"static inline void tagrid_\w+_init", "Sets the defaults.")):
    text = re.sub(f"^{declared}", rf"/** {comment} */\n\g<0>", text, flags=re.M)
# Members that are declared together have one comment, beside or before them.
text = re.sub(r"^( +/\*\*[^<].*\n)?  (\w+) (\w+(?:, \w+)+);( /\*\*<.*)?$",
              lambda found: "".join(f"{found[1] or ''}  {found[2]} {name};{found[4] or ''}\n"
                                    for name in found[3].split(", ")),
              text, flags=re.M)
print(text)
