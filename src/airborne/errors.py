"""Errors a user can cause. Each message says what was found, what was expected and what to do, in one line."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails


_LONGEST = 1200  # characters of a message


class AirborneError(Exception):
    """Base of every error that Airborne raises on purpose; the command line prints it and exits with 2."""

    def __str__(self) -> str:
        """Return the message in one line, however much of a file it quotes."""
        text = " ".join(super().__str__().splitlines())
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 4 :]}"


class CalibrationError(AirborneError):
    """Cameras cannot be found from what was given."""


class VideoError(AirborneError):
    """A video cannot be read, or does not fit the others."""


class BodyError(AirborneError):
    """A body file or shape is unusable."""


class TrialError(AirborneError):
    """A trial file is unusable."""


class ResultError(AirborneError):
    """A run folder or truth file is unusable."""


_PLAIN = {
    "missing": "is missing",
    "extra_forbidden": "unknown key",
    "float_parsing": "expected a number",
    "int_parsing": "expected a whole number",
}


_KIND = re.compile(r"(literal|dict|list|constrained|function)\W.*|str|int|float|bool")  # a step to one of several kinds


def one_line(error: ValidationError) -> str:
    """Say a pydantic error's first complaint in one line: where, what, what was given."""
    by_place: dict[str, list[ErrorDetails]] = {}
    for one in error.errors(include_url=False):
        steps = [str(step)[:60] for step in one["loc"]]
        by_place.setdefault(".".join(step for step in steps if not _KIND.fullmatch(step)), []).append(one)
    places = [place for place in by_place if not any(other.startswith(f"{place}.") for other in by_place)]
    place, more = places[0], len(places) - 1
    first, said = by_place[place][0], ", or ".join(dict.fromkeys(map(_phrase, by_place[place])))
    is_whole_table = isinstance(first["input"], dict) or first["type"] == "missing"
    given = "" if is_whole_table else f" (found {str(first['input'])[:60]!r})"
    others = f"; and {more} more mistake{'s' * (more > 1)}" if more else ""
    return f"{place}{': ' if place else ''}{said}{given}{others}"


def _phrase(one: ErrorDetails) -> str:
    if one["type"] in ("too_short", "too_long"):
        limits = one.get("ctx", {})
        asked = limits.get("min_length", limits.get("max_length"))
        return f"holds {limits.get('actual_length')} values, expected {asked}"
    said = one["msg"].removeprefix("Value error, ").replace("Input should be", "expected")
    return _PLAIN.get(one["type"], said)
