"""The pages of the documentation, and what stands in their tables."""

import re

from tests.support.places import ROOT

DOCS = ROOT / "docs"
RESULTS = DOCS / "reference" / "results.md"
TRIAL = DOCS / "reference" / "trial.md"


def fences(text, language):
    """The fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def table_of(page, heading):
    """The rows below a heading, as lists of cells."""
    text = page.read_text(encoding="utf-8")
    found = re.search(rf"^#+ {re.escape(heading)}\n(.*?)(?=^#|\Z)", text, re.MULTILINE | re.DOTALL)
    assert found, f"{page.name} has no heading {heading}"
    rows = [line.strip().strip("|").split(" | ") for line in found[1].splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def named(cell):
    """The names in a table's cell, spans such as `r00` … `r22` written out by their ends."""
    return re.findall(r"`([^`]+)`", cell)
