"""Links in the documents lead to files and headings that exist, the navigation of the site has every page, and
tools/documents/check_links.py, which checks the site, finds what is broken."""

import pathlib
import re
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools" / "documents"))
from check_links import faults

LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.*?) *#*$", re.M)
ANCHOR = re.compile(r"""<a (?:id|name)=["']([^"']+)""")


def pages():
    """The pages of the site: all Markdown in docs/, and that of the root."""
    return sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def anchors(text):
    """The anchors of a page, as GitHub and the site make them of headings."""
    found = set(ANCHOR.findall(text))
    for heading in HEADING.findall(re.sub(r"^(```).*?^\1", "", text, flags=re.M | re.S)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        name = re.sub(r"[^\w\- ]", "", words).strip().replace(" ", "-")
        number = 0
        while (name if not number else f"{name}-{number}") in found:
            number += 1
        found.add(name if not number else f"{name}-{number}")
    return found


def broken(path):
    """The links of a page that lead nowhere."""
    text = path.read_text()
    for link in LINK.findall(re.sub(r"^(```).*?^\1", "", text, flags=re.M | re.S)):
        if re.match(r"[a-z]+:", link):
            continue
        file, _, anchor = link.partition("#")
        target = path.parent / file if file else path
        if not target.exists() or anchor and target.suffix == ".md" and anchor not in anchors(target.read_text()):
            yield f"{path.relative_to(ROOT)}: {link}"


class Documents(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        found = [link for path in pages() for link in broken(path)]
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_anchors_are_those_of_github(self):
        text = "# A `code` and [link](x.md), twice\n```\n# no heading\n```\n## Twice\n## Twice\n"
        self.assertEqual(anchors(text), {"a-code-and-link-twice", "twice", "twice-1"})

    def test_the_navigation_has_every_page(self):
        text = (ROOT / "docs" / "conf.py").read_text()
        navigation = text.partition("NAVIGATION = {")[2].partition("\n}\n")[0]
        listed = re.findall(r'"(?:[^"<]*<)?([\w./-]+)>?"[,\]]', navigation)
        self.assertEqual(len(set(listed)), len(listed))
        made = {f"docs/reference/{name}" for name in ("c", "cpp", "javascript", "python")}
        below = ("docs/dev/decisions/0", "docs/dev/benchmarks/")
        there = {path.relative_to(ROOT).with_suffix("").as_posix() for path in pages()} - {"README"}
        self.assertEqual(set(listed) - made, {name for name in there if not name.startswith(below)})


class CheckedSite(unittest.TestCase):
    def faults_of(self, html):
        with tempfile.TemporaryDirectory() as folder:
            site = pathlib.Path(folder) / "site"
            site.mkdir()
            (site / "other.html").write_text('<h1 id="there">Other</h1>')
            (pathlib.Path(folder) / "outside.html").write_text("")
            (site / "index.html").write_text(html)
            return faults(site)[0]

    def test_good_links_are_good(self):
        good = ('<a name="here"></a><a href="other.html">1</a><a href="other.html#there">2</a><a href="#here">3</a>'
                '<a href="https://example.org/x">4</a><a href="mailto:a@example.org">5</a>'
                '<img src="data:image/png;base64,AA">')
        self.assertEqual(self.faults_of(good), [])

    def test_each_kind_of_broken_link_is_found(self):
        for link in ('<a href="missing.html">', '<a href="other.html#missing">', '<a href="#missing">',
                     '<img src="missing.png">', '<a href="../outside.html">', '<a href="/absolute.html">',
                     '<a href="./">', '<script src="https://example.org/x.js">', '<link href="//example.org/x.css">'):
            with self.subTest(link):
                self.assertEqual(len(self.faults_of(link)), 1)


if __name__ == "__main__":
    unittest.main()
