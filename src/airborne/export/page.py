"""Web pages from the templates in `templates/`, which need no network; a report also no file beside it."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

from airborne.errors import format_digits
from airborne.export.methods_text import describe_corrections
from airborne.export.palette import STATUS_RGB, hex_colour
from airborne.tracking import Status
from airborne.tracking.methods import UNREAD_SETTINGS

UNKNOWN_TEXT = "not known"
_MOST_DIGITS = 5  # chosen: after the point, of a number with a standard deviation
_UNITS = {"_m": "m", "_mm": "mm", "_s": "s", "_hz": "1/s", "_px": "px", "_deg": "°", "_rev": "turns"}


class HtmlTable(NamedTuple):
    """A table of a page: values that `format_value` formats, the first of each row names it."""

    rows: Sequence[Sequence[Any]]
    header: Sequence[str] = ()


def render_report(
    template: str,
    summary: Mapping[str, Any],
    *,
    alarms: Sequence[str],
    fine_text: str,
    definitions: Mapping[str, str],
    **values: Any,
) -> str:
    """Return a whole page from a template that extends `base.html.j2`; all text is escaped.

    `summary` is the content of summary.json; without `alarms` the page says `fine_text`. `values` are
    the template's own.
    """
    shares = [(str(status), summary[f"n_{status}"], hex_colour(STATUS_RGB[status])) for status in Status]
    shared = {"summary": summary, "alarms": alarms, "fine_text": fine_text, "definitions": definitions}
    shared["corrections"] = describe_corrections(summary)
    return _environment().get_template(template).render(shared | values, shares=shares)


def render_page(template: str, **values: Any) -> str:
    """Return a page from a template of its own; all text is escaped."""
    return _environment().get_template(template).render(values)


def label(key: str) -> str:
    """Turn a key such as `rate_hz` into words with its unit: "rate [1/s]"."""
    suffix = max((s for s in _UNITS if key.endswith(s)), key=len, default="")
    unit = f" [{_UNITS[suffix]}]" if suffix else ""
    return key.removesuffix(suffix).replace("_", " ") + unit


def format_value(value: Any) -> str:
    """Show a value of the summary as text: four digits for a fraction, None as "not known"."""
    if value is None:
        return UNKNOWN_TEXT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return format_digits(value, 4)
    if isinstance(value, list):
        return ", ".join(map(format_value, value))
    return str(value)


def format_with_sd(value: float | None, sd: float | None) -> str:
    """Show a value with its standard deviation, of which two digits count; of an unknown one two decimals."""
    if value is None:
        return UNKNOWN_TEXT
    if not sd or not math.isfinite(sd):
        return f"{value:.2f}".replace("-", "−")
    digits = min(max(1 - math.floor(math.log10(sd)), 0), _MOST_DIGITS)
    return f"{value:.{digits}f} ± {sd:.{digits}f}".replace("-", "−")


def _records_table(records: Sequence[Mapping[str, Any]]) -> HtmlTable:
    """Return dictionaries as the rows of a table."""
    keys = list(dict.fromkeys(key for record in records for key in record))
    return HtmlTable([[record.get(key, "") for key in keys] for record in records], [label(key) for key in keys])


def settings_table(values: Mapping[str, Any]) -> HtmlTable:
    """Return the settings of a method; those that are not set are left out."""
    unread = UNREAD_SETTINGS.get(values.get("method", ""), frozenset())
    return HtmlTable([(label(key), value) for key, value in values.items() if value is not None and key not in unread])


def _base64(path: Path) -> str:
    return base64.b64encode(path.read_bytes()).decode("ascii")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("airborne.export"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "text": format_value,
        "plain_script": lambda text: re.sub(r"^export ", "", text, flags=re.MULTILINE),  # one script, not modules
        "base64": _base64,
        "records_table": _records_table,
        "settings_table": settings_table,
    }
    return environment
