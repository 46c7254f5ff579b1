"""The elements of a self-contained web page: no script, no font, no file beside it."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from airborne.tracking.methods import UNREAD_SETTINGS

UNKNOWN_TEXT = "not known"
_UNITS = {"_m": "m", "_mm": "mm", "_s": "s", "_hz": "1/s", "_px": "px", "_deg": "°", "_rev": "turns"}

_STYLE = """
:root { color: #222; background: #f4f4f2; font: 16px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
body { max-width: 62rem; margin: 2rem auto; padding: 2.5rem 3rem; background: #fff; box-shadow: 0 0 1rem #0001; }
h1 { font-size: 1.8rem; line-height: 1.2; margin: 0 0 1.5rem; }
h2 { font-size: 1.15rem; margin: 2.5rem 0 .75rem; padding-bottom: .25rem; border-bottom: 1px solid #ddd; }
.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(12.5rem, 1fr)); gap: 1rem; margin: 1.25rem 0; }
.tile { border: 1px solid #ddd; border-radius: .4rem; padding: .75rem 1rem; }
.tile b { display: block; font-size: 1.35rem; line-height: 1.3; font-weight: 600; }
.tile span, figcaption { color: #555; font-size: .85rem; }
.bar { display: flex; height: .7rem; border-radius: .35rem; overflow: hidden; background: #eee; }
.warnings { border-left: .3rem solid #d55e00; background: #fdf3ec; padding: .75rem 1.25rem; margin: 1.25rem 0; }
.fine { border-left: .3rem solid #009e73; background: #eef7f4; padding: .75rem 1.25rem; margin: 1.25rem 0; }
ul { margin: .25rem 0; padding-left: 1.2rem; }
figure { margin: 1.5rem 0; break-inside: avoid; }
figure img { display: block; width: 100%; height: auto; }
table { border-collapse: collapse; margin: .75rem 0; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: .3rem 1.2rem .3rem 0; border-bottom: 1px solid #e5e5e5; }
th { font-weight: 600; }
td { overflow-wrap: anywhere; }
dt { font-weight: 600; margin-top: .75rem; }
dd { margin: 0; }
@page { margin: 15mm; }
@media print {
  :root { background: #fff; font-size: 10.5pt; }
  body { max-width: none; margin: 0; padding: 0; box-shadow: none; }
  .tiles { grid-template-columns: repeat(4, 1fr); gap: .6rem; }
  .tile, .warnings, .fine, table, dt, dd { break-inside: avoid; }
  h2 { break-after: avoid; }
  .bar, .warnings, .fine { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""


def document(title: str, body: Iterable[str]) -> str:
    """Return a whole page; `title` is plain text, the elements of `body` are HTML."""
    head = (
        '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style>"
    )
    pieces = "\n".join(body)
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{pieces}\n</body></html>\n'


def heading(text: str, level: int = 2) -> str:
    """Return a heading of plain text."""
    return f"<h{level}>{escape(text)}</h{level}>"


def bullets(texts: Iterable[str]) -> str:
    """Return a list of plain texts."""
    return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in texts) + "</ul>"


def box(kind: str, content: str) -> str:
    """Return HTML in a box of the page's style `kind`: "warnings", "fine" or "tiles"."""
    return f'<div class="{kind}">{content}</div>'


def tile(value: str, name: str) -> str:
    """Return one headline number, plain text, with what it is below it."""
    return f'<div class="tile"><b>{escape(value)}</b><span>{escape(name)}</span></div>'


def table(rows: Iterable[Sequence[Any]], header: Sequence[str] = ()) -> str:
    """Return a table of values, each formatted by `format_value`; the first column names the row."""
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    lines = [f"<tr>{head}</tr>"] if header else []
    for first, *rest in rows:
        cells = "".join(f"<td>{escape(format_value(value))}</td>" for value in rest)
        lines.append(f"<tr><th>{escape(format_value(first))}</th>{cells}</tr>")
    return "<table>" + "".join(lines) + "</table>"


def definitions(terms: Mapping[str, str]) -> str:
    """Return a list of terms with their meanings, plain texts."""
    return "<dl>" + "".join(f"<dt>{escape(t)}</dt><dd>{escape(m)}</dd>" for t, m in terms.items()) + "</dl>"


def figure(path: Path, caption: str) -> str:
    """Return a PNG file, whole, as a figure with its caption."""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    text = escape(caption)
    return f'<figure><img src="data:image/png;base64,{data}" alt="{text}"><figcaption>{text}</figcaption></figure>'


def label(key: str) -> str:
    """Turn a key such as `rate_hz` into words with its unit: "rate [1/s]"."""
    suffix = max((s for s in _UNITS if key.endswith(s)), key=len, default="")
    unit = f" [{_UNITS[suffix]}]" if suffix else ""
    return key.removesuffix(suffix).replace("_", " ") + unit


def settings(values: Mapping[str, Any]) -> str:
    """Show the settings of a method; those that are not set, or that it makes no use of, are left out."""
    unread = UNREAD_SETTINGS.get(values.get("method", ""), frozenset())
    return table((label(key), value) for key, value in values.items() if value is not None and key not in unread)


def format_value(value: Any) -> str:
    """Show a value of the summary as text: four digits for a fraction, None as "not known"."""
    if value is None:
        return UNKNOWN_TEXT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(map(format_value, value))
    return str(value)
