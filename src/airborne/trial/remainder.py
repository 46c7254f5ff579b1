"""What is left of a trial file without its mistakes, so that all else in it can be checked too."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple

from airborne.errors import MistakesError
from airborne.trial.file import Trial
from airborne.trial.session import read_tables

_MOST_MISTAKES = 100  # after which nothing is left
_ANYBODY = {"preset": "human18", "stature_m": 1.75, "mass_kg": 70.0}  # chosen: any, for one that cannot be read


class Remainder(NamedTuple):
    """A trial without its mistakes; `has_body` says whether its body is what the file says."""

    trial: Trial
    has_body: bool


def parse_remainder(path: Path) -> Remainder | None:
    """Read a trial whose tables hold mistakes, without these: keys at their defaults, cameras left out.

    None where it cannot be read without them. Raises TrialError for a file without tables.
    """
    tables, folder, _ = deepcopy(read_tables(path))
    for _ in range(_MOST_MISTAKES):
        has_body = tables.setdefault("body", _ANYBODY) is not _ANYBODY
        try:
            trial = Trial(**tables)
        except MistakesError as error:
            if not any(_remove(tables, place) for place in error.places[:1]):
                return None
        else:
            trial._folder = folder
            return Remainder(trial, has_body)
    return None


def _remove(tables: dict[str, Any], place: Sequence[int | str]) -> bool:
    """Remove the innermost item on the way to a place; False where the way leads nowhere."""
    here: Any = tables
    holder: Any = None
    key: Any = None
    for step in place:
        items: Any = dict(enumerate(here)) if isinstance(here, list) else here
        if isinstance(items, dict) and step in items:
            holder, key, here = here, step, items[step]
    if holder is None:
        return False
    del holder[key]
    return True
