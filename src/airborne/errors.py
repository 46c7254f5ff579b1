"""Errors a user can cause. Each message says what was found, what was expected and what to do, in one line."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
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


class UndecidedError(TrialError):
    """The pictures do not decide where the body is; the command line exits with 3."""


class MistakesError(TrialError):
    """A trial file with mistakes: the message says the first and counts the others, `mistakes` has a line for each."""

    def __init__(self, where: str, mistakes: Sequence[str]) -> None:
        """Take where they are, a file or options of the command line, and what each is."""
        self.mistakes = tuple(f"{where}: {mistake}" for mistake in mistakes)
        super().__init__(f"{where}: {_count_others(mistakes)}")


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
    return _count_others(list_mistakes(error))


def list_mistakes(error: ValidationError, tags: Collection[str] = ()) -> list[str]:
    """List a pydantic error's complaints, a line for each place; `tags` tell kinds of one table apart."""
    by_place: dict[str, list[ErrorDetails]] = {}
    for one in error.errors(include_url=False):
        steps = [str(step)[:60] for step in one["loc"]]
        steps = [step for step in steps if not _KIND.fullmatch(step) and step not in tags]
        if one["type"] == "union_tag_invalid":
            steps.append(one.get("ctx", {})["discriminator"].strip("'"))
        by_place.setdefault(".".join(steps), []).append(one)
    places = [place for place in by_place if not any(other.startswith(f"{place}.") for other in by_place)]
    return [_describe_place(place, by_place[place]) for place in places]


def _describe_place(place: str, errors: Sequence[ErrorDetails]) -> str:
    said = ", or ".join(dict.fromkeys(map(_phrase, errors)))
    is_whole_table = isinstance(errors[0]["input"], dict) or errors[0]["type"] == "missing"
    given = "" if is_whole_table else f" (found {str(errors[0]['input'])[:60]!r})"
    return f"{place}{': ' if place else ''}{said}{given}"


def _count_others(mistakes: Sequence[str]) -> str:
    more = len(mistakes) - 1
    return mistakes[0] + (f"; and {more} more mistake{'s' * (more > 1)}" if more else "")


def _phrase(one: ErrorDetails) -> str:
    if one["type"] in ("too_short", "too_long"):
        limits = one.get("ctx", {})
        asked = limits.get("min_length", limits.get("max_length"))
        return f"holds {limits.get('actual_length')} values, expected {asked}"
    if one["type"] == "union_tag_invalid":
        limits = one.get("ctx", {})
        return f"expected {limits['expected_tags']} (found {limits['tag']!r})"
    said = one["msg"].removeprefix("Value error, ").replace("Input should be", "expected")
    return _PLAIN.get(one["type"], said)
