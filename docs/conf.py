"""The site of the documents, built by tools/site.sh with Sphinx: its navigation, its look, and the references in it.

A page that is added or renamed needs one line in NAVIGATION. Pages are Markdown, as on other sites: only the pages in
docs/reference/ use what Sphinx has beyond it.
"""

import inspect
import os
import pathlib
import re
import sys

from docutils import nodes
from sphinx import addnodes
from sphinx.ext.autodoc.mock import mock
from sphinx.transforms.post_transforms import SphinxPostTransform

# The repository, or the copy of it that tools/site.sh builds from.
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "docs")]
from reference.docstrings import as_fields

# By goal. An entry is a path from the root without its ending, or "Title <path>" if the heading is too long.
NAVIGATION = {
    "To begin": ["Install <docs/install>", "Tour <docs/tour>", "docs/howto", "docs/faq", "docs/comparison"],
    "Every detail": ["docs/manual", "Options <docs/options>", "docs/formats", "docs/glossary"],
    "To view, solve and keep": [
        "Viewing <docs/viewing>",
        "Meshes for solvers <docs/solvers>",
        "Archives and clusters <docs/archives>",
        "Servers and browsers <docs/web>",
    ],
    "To program": [
        "Python <docs/python>",
        "C and C++ <docs/library>",
        "HDF5 <docs/hdf5>",
        "Python reference <docs/reference/python>",
        "C reference <docs/reference/c>",
        "C++ reference <docs/reference/cpp>",
        "JavaScript reference <docs/reference/javascript>",
    ],
    "For developers": [
        "Contributing <CONTRIBUTING>",
        "Design <docs/dev/design>",
        "Decisions <docs/dev/decisions/README>",
        "File format <docs/dev/format>",
        "Benchmarks <docs/dev/benchmarks>",
        "Scale <docs/dev/scale>",
        "docs/dev/reliability",
        "Packages <docs/dev/packages>",
        "Doors <docs/dev/doors>",
        "Adding a format <docs/dev/readers>",
        "How formats are read <docs/dev/reading>",
        "Programs for browsers <docs/dev/web>",
        "Terms <docs/dev/terms>",
    ],
    "About": ["All documents <docs/README>", "Changes <CHANGELOG>", "Security <SECURITY>"],
}
# Pages below a page of the navigation: all in the same folder.
FOLDERS = {"docs/dev/decisions/README": "[0-9]*", "docs/dev/benchmarks": "benchmarks/*"}

project = "tagrid"
copyright = "the authors of tagrid"
root_doc = "README"
html_title = "tagrid"
html_theme = "furo"
html_theme_options = {"sidebar_hide_name": False}
html_static_path = ["site"]
html_css_files = ["site.css"]
html_copy_source = html_show_sourcelink = html_show_sphinx = False
# Excerpts are fetched, which browsers do not do without a server.
html_show_search_summary = False

extensions = ["myst_parser", "sphinx.ext.autodoc", "breathe"]
# tools/site.sh puts nothing else there.
exclude_patterns = sorted(name for name in os.listdir(ROOT) if name != "docs" and not name.endswith(".md"))
# Anchors of headings, as other sites make them from their text.
myst_heading_anchors = 6
suppress_warnings = ["myst.header"]
highlight_language = "none"
default_role = "code"
# Options begin with two hyphens.
smartquotes = False

# The extension of the package need not be built, nor other libraries be there.
autodoc_mock_imports = ["tagrid._tagrid", "h5py", "numcodecs", "xarray"]
autodoc_member_order = "bysource"
# Signatures have names and defaults; docstrings say what may be passed.
autodoc_typehints = "none"
autodoc_preserve_defaults = True
add_module_names = False
python_use_unqualified_type_names = True

# What doxygen read in the headers.
breathe_projects = {name: os.environ.get(f"TAGRID_{name.upper()}_XML", "") for name in ("c", "cpp")}
breathe_default_project = "c"
breathe_default_members = ("members",)
breathe_show_include = False
breathe_domain_by_extension = {"h": "c", "hpp": "cpp"}
c_id_attributes = ["TAGRID_API"]


def restore_modules():
    """Classes of the package name the module that users import. Sphinx finds comments on members in the source."""
    with mock(autodoc_mock_imports):
        import tagrid
    modules = [module for name, module in sys.modules.items() if name.startswith("tagrid._") and hasattr(module, "__file__")]
    for name in tagrid.__all__:
        thing = getattr(tagrid, name)
        for module in modules:
            if vars(module).get(name) is thing and re.search(rf"^(class|def) {name}\b", inspect.getsource(module), re.M):
                thing.__module__ = module.__name__


def toctree(caption, entries, options=()):
    lines = ["```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else []), *options, "", *entries, "```"]
    return "\n\n" + "\n".join(lines) + "\n"


def add_navigation(app, name, source):
    """Appends the navigation to the first page, and the pages of a folder to the page that lists them."""
    if name == root_doc:
        source[0] += "".join(toctree(caption, [re.sub(r"(.*<)?(docs|[A-Z])", r"\1/\2", entry, 1) for entry in entries])
                             for caption, entries in NAVIGATION.items())
    elif name in FOLDERS:
        source[0] += toctree("", [FOLDERS[name]], [":glob:"])


class ForReaders(SphinxPostTransform):
    """Links show the title of a page in place of the name of its file, and parameters are followed by dashes."""

    default_priority = 20  # after links are resolved

    def run(self, **_):
        for link in self.document.findall(nodes.reference):
            text = link.astext()
            if re.fullmatch(r"[\w./-]+\.md", text) and link.get("internal"):
                pages = [page for page in self.env.titles if f"/{page}.md".endswith("/" + text.removeprefix("../"))]
                if len(pages) == 1:
                    link.children = [nodes.Text(self.env.titles[pages[0]].astext())]
        for text in list(self.document.findall(nodes.Text)):
            if text == " -- ":
                text.parent.replace(text, nodes.Text(" – "))


class LinkCodeToReference(SphinxPostTransform):
    """Makes links of calls and types between backticks: `tagrid_reader_open()`, `tagrid.open()`, and in the guide for Python
    also `Volume.mesh()`."""

    default_priority = 5
    NAME = re.compile(r"(?:tagrid\.)?(tagrid_\w+|(?:\w+\.)*\w+)(?:\(\))?")

    def run(self, **_):
        if self.env.docname.startswith("docs/dev/decisions/") or self.env.docname == "CHANGELOG":
            return
        known = self.env.get_domain("c").get_objects(), self.env.get_domain("py").get_objects()
        where = {name: (page, anchor) for objects in known for name, _, _, page, anchor, _ in objects}
        for literal in list(self.document.findall(nodes.literal)):
            found = self.NAME.fullmatch(literal.astext())
            inside = isinstance(literal.parent, (nodes.reference, addnodes.pending_xref, nodes.title))
            target = self.target(found, where) if found and not inside else None
            if target and target[0] != self.env.docname:
                uri = self.app.builder.get_relative_uri(self.env.docname, target[0]) + "#" + target[1]
                literal.replace_self(nodes.reference("", "", literal.deepcopy(), refuri=uri, internal=True))

    def target(self, found, where):
        """The page and the anchor of a name, or None."""
        text, name = found[0], found[1]
        if name.startswith("tagrid_"):
            return where.get(name)
        # A word alone may be anything, also in this guide.
        python = text.startswith("tagrid.") or self.env.docname == "docs/python" and text != name
        return where.get(f"tagrid.{name}") if python else None


def setup(app):
    restore_modules()
    app.connect("source-read", add_navigation)
    app.connect("autodoc-process-docstring", as_fields)
    app.add_post_transform(ForReaders)
    app.add_post_transform(LinkCodeToReference)
