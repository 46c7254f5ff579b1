"""Errors a user can cause. Each message says what was found, what was expected and what to do, in one line."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from decimal import Decimal
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, get_args

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError
    from pydantic_core import ErrorDetails


# exit codes of the command line beside 2: of a run of which hardly a frame is tracked, an UndecidedError, Ctrl-C
UNTRACKED, UNDECIDED, STOPPED = 1, 3, 130
_LONGEST = 1200  # characters of a message
_OTHER_WORDS = {"end": ("stop",), "last": ("stop",), "first": ("frame",), "step": ("every",), "path": ("file", "video")}
MOST_SAID = 5  # mistakes of one file in a line


class AirborneError(Exception):
    """Base of every error that Airborne raises on purpose; the command line prints it and exits with 2."""

    def __str__(self) -> str:
        """Return the message in one line, however much of a file it quotes, and whatever would steer a terminal."""
        text = " ".join(super().__str__().splitlines())
        text = "".join(letter if letter.isprintable() else "?" for letter in text)
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

    def __init__(
        self, where: str, mistakes: Sequence[str], places: Sequence[tuple[int | str, ...]] = (), most_said: int = 1
    ) -> None:
        """Take where they are, a file or options of the command line, and what each is; their places in its tables.

        The message says the first `most_said`.
        """
        self.plain, self.places = tuple(mistakes), tuple(places)
        self.mistakes = tuple(f"{where}: {mistake}" for mistake in mistakes)
        super().__init__(f"{where}: {_count_others(mistakes, most_said)}")


class ResultError(AirborneError):
    """A run folder or truth file is unusable."""


class RunThereError(ResultError):
    """A folder already holds a run, and nothing was said of going on with it or replacing it."""


INSTALL_EXTRA = "which is not installed; in Airborne's folder: pip install -c constraints.txt '.[{}]'"


def count(n: int, noun: str) -> str:
    """Return a number with its noun, as 1 camera or 2 cameras."""
    return f"{n} {noun if n == 1 else f'{noun}s'}"


def count_of(n: int, total: int, noun: str) -> str:
    """Return a part of a number with its noun and verb, as 1 of 3 frames is, 2 of 3 frames are."""
    return f"{n} of {count(total, noun)} {'is' if n == 1 else 'are'}"


def format_digits(value: float, digits: int) -> str:
    """Return a number with so many digits that count, as 150 or 0.034 with two: never as a power of ten."""
    return format(Decimal(f"{value:.{digits}g}"), "f") if math.isfinite(value) else str(value)


def require_choice(value: str, choices: Collection[str], what: str) -> None:
    """Raise AirborneError, listing the choices, where a value is none of them; `what` says what it is."""
    if value not in choices:
        raise AirborneError(f"{what} '{str(value)[:60]}' is not known; choose {' or '.join(choices)}")


_PLAIN = {
    "model_type": "expected a table",
    "dict_type": "expected a table",
    "extra_forbidden": "unknown key",
    "float_parsing": "expected a number",
    "float_type": "expected a number",
    "int_from_float": "expected a whole number",
    "int_parsing": "expected a whole number",
    "int_type": "expected a whole number",
    "bool_type": "expected true or false",
}
_BOUNDS = {  # pydantic's kinds of error: where it keeps the bound, and how it is said
    "greater_than_equal": ("ge", "expected {:g} or more"),
    "greater_than": ("gt", "expected more than {:g}"),
    "less_than_equal": ("le", "expected {:g} or less"),
    "less_than": ("lt", "expected less than {:g}"),
}


_KIND = re.compile(r"(literal|dict|list|constrained|function)\W.*|str|int|float|bool")  # a step to one of several kinds


def one_line(error: ValidationError, document: Any, model: type[BaseModel]) -> str:
    """Say a pydantic error's complaints in one line: where, what, what was given; see `list_mistakes`."""
    mistakes = list_mistakes(error, (), document, model)
    return _count_others(mistakes, MOST_SAID)


def list_mistakes(error: ValidationError, tags: Collection[str], document: Any, model: type[BaseModel]) -> list[str]:
    """List a pydantic error's complaints, a line for each place; `tags` tell kinds of one table apart.

    Tables of a list are named as the `document` names them, and the keys of `model` are suggested for unknown ones.
    """
    by_place: dict[tuple[str, ...], list[ErrorDetails]] = {}
    found = error.errors(include_url=False)
    for one in [each for each in found if each["type"] != "union_tag_not_found"] or found:
        by_place.setdefault(_name_steps(one, tags, document), []).append(one)
    places = [
        place for place in by_place if not any(other[: len(place)] == place for other in by_place if other != place)
    ]
    return [_describe_place(place, by_place[place], model) for place in places]


def _name_steps(one: ErrorDetails, tags: Collection[str], document: Any) -> tuple[str, ...]:
    """Return the way to an error's place, tables of a list by their names: start, frame; camera 'cam2', video."""
    steps: list[str] = []
    for step in one["loc"]:
        text = str(step)[:60]
        if _KIND.fullmatch(text) or text in tags:
            continue
        document = _item(document, step)
        if isinstance(step, int) and isinstance(document, dict) and steps:
            name = document.get("name")
            steps[-1] += f" '{name[:60]}':" if name and isinstance(name, str) else f" {step + 1}:"
        elif isinstance(step, int) and steps:
            steps[-1] += f", value {step + 1}"
        else:
            steps.append(text)
    if one["type"] == "union_tag_invalid":
        steps.append(one.get("ctx", {})["discriminator"].strip("'"))
    return tuple(steps)


def _item(document: Any, step: int | str) -> Any:
    """Return an item of a table or a list of them, None where there is none."""
    if isinstance(document, list):
        return document[step] if isinstance(step, int) and step < len(document) else None
    return document.get(step) if isinstance(document, dict) else None


def _describe_place(place: tuple[str, ...], errors: Sequence[ErrorDetails], model: type[BaseModel]) -> str:
    where = ".".join(place).replace(":.", ": ").removesuffix(":")
    first = errors[0]
    if first["type"] == "missing":
        return f"{where} is missing"
    if first["type"] == "extra_forbidden":
        keys = _list_keys(model, first["loc"])
        alike = get_close_matches(place[-1], keys, 1) or [key for key in _OTHER_WORDS.get(place[-1], ()) if key in keys]
        if alike:
            return f"{where}: unknown key; did you mean {alike[0]}?"
    if first["type"] == "list_type" and isinstance(first["input"], dict):
        return f"{where}: found one table, expected a list of tables; write [{{...}}], in a file the head [[{where}]]"
    said = ", or ".join(dict.fromkeys(map(_phrase, errors)))
    given = "" if isinstance(first["input"], dict) else f" (found {_quote(first['input'])})"
    return f"{where}{': ' if where else ''}{said}{given}"


def _quote(value: Any) -> str:
    return str(value)[:60] if isinstance(value, int | float) else repr(str(value)[:60])


def _list_keys(model: type[BaseModel], loc: Sequence[int | str]) -> list[str]:
    """Return the keys of the tables in which an error's place lies."""
    models = [model]
    for step in loc[:-1]:
        fields = [each.model_fields[step] for each in models if step in each.model_fields]
        models = [each for field in fields for each in _models_in(field.annotation)] or models
    return [key for each in models for key in each.model_fields]


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if hasattr(annotation, "model_fields"):
        return [annotation]
    return [model for each in get_args(annotation) for model in _models_in(each)]


def _count_others(mistakes: Sequence[str], most_said: int) -> str:
    more = len(mistakes) - most_said
    return "; ".join(mistakes[:most_said]) + (f"; and {count(more, 'more mistake')}" if more > 0 else "")


def _phrase(one: ErrorDetails) -> str:
    if one["type"] in ("too_short", "too_long"):
        limits = one.get("ctx", {})
        asked = limits.get("min_length", limits.get("max_length"))
        return f"holds {limits.get('actual_length')} values, expected {asked}"
    if one["type"] == "union_tag_invalid":
        limits = one.get("ctx", {})
        return f"expected {limits['expected_tags']} (found {limits['tag']!r})"
    if one["type"] in _BOUNDS:
        name, words = _BOUNDS[one["type"]]
        return words.format(one.get("ctx", {})[name])
    said = one["msg"].removeprefix("Value error, ").replace("Input should be", "expected")
    return _PLAIN.get(one["type"], said)
