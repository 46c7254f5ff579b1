"""A trial's tables, and those of its session: what many trials share, filled in for one of them."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from airborne.errors import TrialError
from airborne.io.names import check_path
from airborne.io.text import read_toml

_LONGEST_WORD = 80  # characters of a label, which a session may repeat
_PLACE = re.compile(r"\{([^{}]*)\}")  # in a text of a session: {athlete}


class TrialTables(NamedTuple):
    """A trial's tables, joined with those of the session that it names."""

    tables: dict[str, Any]
    folder: Path  # that paths are relative to: the session's where there is one
    name: str  # of the files, for errors


def read_tables(path: Path) -> TrialTables:
    """Read a trial's tables; raises TrialError."""
    tables = _read_toml(path)
    if "session" not in tables:
        return TrialTables(tables, path.parent, path.name)
    session = _session_path(tables["session"], path)
    joined = _join_session(tables, _read_toml(session), path)
    return TrialTables(joined, session.parent, f"{path.name} with {session.name}")


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return read_toml(path)
    except OSError as error:
        raise TrialError(f"{path}: cannot be read ({error.strerror}); give the path of a trial's TOML file") from error
    except tomllib.TOMLDecodeError as error:
        raise TrialError(f"{path.name}: not a TOML file: {error}; correct it, or give a trial's TOML file") from error


def _session_path(name: Any, path: Path) -> Path:
    """Return the path of the session that the trial of a file `path` names, without the dots that it can do without.

    Raises TrialError where the name is none of a file.
    """
    try:
        session = path.parent / check_path(name)
    except (AttributeError, ValueError):
        raise TrialError(f"{path.name}: session: expected the path of a session's TOML file") from None
    plain = Path(os.path.normpath(session))  # names another file where a folder is a link
    return plain if plain.exists() and session.exists() and plain.samefile(session) else session


def _join_session(tables: dict[str, Any], session: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the tables of a trial that names a session: each the trial's own, else its athlete's, else the session's.

    The trial's name is that of its file `path` where it gives none. In the session's texts `{trial}` is the trial's
    name and `{athlete}`, or any other word in braces, the trial's label of that name. Raises TrialError where a trial
    lacks one, or has a label `trial` that is not its name.
    """
    tables = {"name": path.stem, **{key: value for key, value in tables.items() if key != "session"}}
    labels = tables.get("labels", {})
    labels = labels if isinstance(labels, dict) else {}
    words = {**labels, "trial": tables["name"]}
    if "trial" in labels and str(labels["trial"]) != str(tables["name"]):
        raise TrialError(
            f"{path.name}: the label trial is {str(labels['trial'])[:40]}, but {{trial}} in a session is the trial's "
            f"name, {str(tables['name'])[:40]}; rename the label"
        )
    athletes = session.get("athletes", {})
    long = [key for key, value in words.items() if len(str(value)) > _LONGEST_WORD]
    if long:
        raise TrialError(
            f"{path.name}: the label {str(long[0])[:40]} is too long; give it {_LONGEST_WORD} characters at most"
        )
    own = athletes.get(str(words.get("athlete")), {}) if isinstance(athletes, dict) else None
    if not isinstance(own, dict):
        raise TrialError(
            f"{path.name}: its session's athletes are no tables; expected [athletes.NAME.body] or the like"
        )
    shared = {key: value for key, value in session.items() if key != "athletes"} | own
    return {key: _fill(value, words, path) for key, value in shared.items() if key not in tables} | tables


def _fill(value: Any, words: Mapping[str, Any], path: Path) -> Any:
    """Return a value of a session with the words in braces filled in, at any depth."""
    if isinstance(value, dict):
        return {key: _fill(item, words, path) for key, item in value.items()}
    if isinstance(value, list):
        return [_fill(item, words, path) for item in value]
    if not isinstance(value, str):
        return value
    unknown = [word for word in _PLACE.findall(value) if word not in words]
    if unknown:
        raise TrialError(
            f"{path.name}: the session's '{value[:80]}' needs the label {unknown[0][:40]}; this trial has: "
            f"{', '.join(map(str, words))}; add it to its [labels]"
        )
    return _PLACE.sub(lambda found: str(words[found[1]]), value)
