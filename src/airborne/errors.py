"""Errors a user can cause. Each message says what was found, what was expected and what to do, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


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


_PLAIN = {"missing": "is missing", "extra_forbidden": "unknown key"}


def one_line(error: ValidationError) -> str:
    """Say a pydantic error's first complaint in one line: where, what, what was given."""
    first = error.errors(include_url=False)[0]
    place = ".".join(str(step)[:60] for step in first["loc"]) or "the file"
    said = _PLAIN.get(first["type"], first["msg"].removeprefix("Value error, "))
    is_whole_table = isinstance(first["input"], dict) or first["type"] == "missing"
    given = "" if is_whole_table else f" (found {str(first['input'])[:60]!r})"
    more = f"; and {error.error_count() - 1} more mistakes" if error.error_count() > 1 else ""
    return f"{place}: {said}{given}{more}"
