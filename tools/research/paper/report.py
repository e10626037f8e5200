"""The page: sections with pictures and tables, and the claims with what was found."""

import dataclasses
import html
import json

HOLDS, PARTLY, FAILS, UNKNOWN = "holds", "holds in part", "does not hold", "could not be judged here"

STYLE = """
body { font: 16px/1.5 sans-serif; color: #222; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
h1, h2, h3 { line-height: 1.2; } h2 { border-top: 1px solid #ccc; padding-top: 1em; margin-top: 2em; }
img { max-width: 100%; } figure { margin: 1.5em 0; } figcaption { color: #444; font-size: 15px; }
table { border-collapse: collapse; margin: 1em 0; } td, th { border: 1px solid #ccc; padding: 3px 10px; text-align: right; }
td:first-child, th:first-child { text-align: left; } caption { text-align: left; padding: 4px 0; font-weight: bold; }
.verdict { font-weight: bold; } .holds { color: #2c7a2c; } .part { color: #a86200; } .not { color: #b02020; }
.note { background: #f4f1e8; padding: 0.6em 1em; }
"""


@dataclasses.dataclass
class Claim:
    number: int
    says: str  # what the paper claims, in our words
    verdict: str
    evidence: str
    numbers: dict  # what was measured, as it stands in the evidence


class Report:
    def __init__(self, directory, title, about):
        """`about`: paragraphs for the top of the page."""
        self.directory, self._title, self._about = directory, title, about
        self._parts, self._claims, self._figures, self._departures = [], [], {}, []

    def section(self, title):
        self._parts.append(f"<h2>{html.escape(title)}</h2>")

    def text(self, text):
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def figure(self, name, title, picture, caption):
        """A picture under the name of the paper's figure, such as "fig-12"."""
        picture.save(self.directory / f"{name}.png")
        self._figures[name] = title
        self._parts.append(f'<figure id="{name}"><img src="{name}.png" alt="{html.escape(title)}" width="{picture.width}">'
                           f"<figcaption><b>{html.escape(title)}.</b> {html.escape(caption)}</figcaption></figure>")

    def table(self, caption, head, rows):
        cells = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
        lines = "".join("<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>\n" for row in rows)
        self._parts.append(f"<table><caption>{html.escape(caption)}</caption><tr>{cells}</tr>\n{lines}</table>")

    def claim(self, number, says, verdict, evidence, **numbers):
        """`evidence` names its numbers in braces, so that no number is in the report that was not measured."""
        self._claims.append(Claim(number, says, verdict, evidence.format(**numbers), numbers))

    def departure(self, text):
        """What is printed in the paper and was found to be different, besides the claims."""
        self._departures.append(text)

    def write(self):
        """index.html, and results.json with the same numbers."""
        claims = sorted(self._claims, key=lambda claim: claim.number)
        kind = {HOLDS: "holds", PARTLY: "part", FAILS: "not", UNKNOWN: "part"}
        lines = [f'<h3 id="claim-{claim.number}">Claim {claim.number}: {html.escape(claim.says)}</h3>\n<p>'
                 f'<span class="verdict {kind[claim.verdict]}">It {claim.verdict}.</span> {html.escape(claim.evidence)}</p>'
                 for claim in claims]
        against = [claim for claim in claims if claim.verdict != HOLDS]
        summary = "Every claim holds." if not against else "Not every claim holds as it is printed: " + "; ".join(
            f"claim {claim.number} {claim.verdict}" for claim in against) + "."
        departures = "".join(f"<li>{html.escape(text)}</li>" for text in self._departures)
        about = "".join(f'<p class="note">{html.escape(text)}</p>' for text in self._about)
        page = [f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(self._title)}</title>',
                f"<style>{STYLE}</style><h1>{html.escape(self._title)}</h1>{about}<h2>The claims</h2><p>{summary}</p>", *lines,
                f"<h3>What else differs from the paper</h3><ul>{departures}</ul>", *self._parts, "</html>"]
        (self.directory / "index.html").write_text("\n".join(page) + "\n")
        results = {"about": self._about, "figures": self._figures, "departures": self._departures,
                   "claims": [dataclasses.asdict(claim) for claim in claims]}
        (self.directory / "results.json").write_text(json.dumps(results, indent=1) + "\n")
