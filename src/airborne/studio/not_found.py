"""The page for an address that is none: it looks as the others do, and leads back to the steps."""

from __future__ import annotations

from html import escape
from itertools import starmap
from pathlib import Path

from airborne.studio.project import StudioStep, steps
from airborne.studio.session import Session

_STYLE = Path(__file__).with_name("studio.css")
_OWN = "* { box-sizing: border-box; } body { margin: 0; } .body { height: calc(100vh - 44px); }"  # as Quasar has it


def not_found_html(session: Session, address: str) -> str:
    """Return the whole page."""
    rail = "".join(starmap(_link, enumerate(steps(session.project()), start=1)))
    where = escape(f"{session.folder.name}/{session.path.name}")
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Airborne: no such page</title>
<style>{_STYLE.read_text("utf-8")}{_OWN}</style></head><body>
<div class="bar"><span class="name">Airborne</span><span class="path small">{where}</span></div>
<div class="body"><nav class="rail" aria-label="steps">{rail}</nav><main class="main">
<h1>There is no page {escape(address[:80])}</h1>
<p class="help">Go on with one of the steps at the left, or with the first: <a class="plain" href="/">Videos</a>.</p>
</main></div></body></html>
"""


def _link(number: int, step: StudioStep) -> str:
    spans = f'<span class="title">{escape(step.name)}</span><span class="says">{escape(step.says)}</span>'
    mark = "✓" if step.state == "ready" else number
    state = step.state.partition(" ")[0]
    return f'<a href="{step.address}" class="{state}"><span class="number">{mark}</span>{spans}</a>'
