"""Which trials a batch runs: those of a folder, a pattern of paths, or a table."""

from __future__ import annotations

import glob
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from airborne.errors import AirborneError, TrialError
from airborne.io.names import check_column, check_path, file_stem
from airborne.io.text import read_csv, read_toml
from airborne.trial.session import read_tables

TABLE = "trials.csv"
OWN_COLUMNS = ("trial", "status", "error", "folder")  # of the batch's table
_ALWAYS_TRIAL = "trial.toml"  # the name of a trial file that is named after its folder
_MEANT_AS_TRIAL = re.compile(r"^[ \t]*(\[\[camera|session[ \t]*=)", re.MULTILINE)
_OF_A_SESSION = {"calibration", "body", "athletes"}  # a file with labels and one of these may be what trials share
_ALIKE = 0.8  # of words; chosen between slips, as difflib measures them (cameras 0.92, camara 0.83), and cam1 (0.6)
_HEAD_BYTES = 100_000  # of a file that is no TOML, in which words of a trial are looked for
_TABLE_FORM = "a table of trials has a line of names, one of them trial, then a line for each trial"


@dataclass(frozen=True, slots=True)
class BatchTrial:
    """A trial of a batch: its name there, its file, and the labels that tell it apart."""

    name: str
    path: Path  # absolute, as every worker knows it
    labels: Mapping[str, str]


def list_trials(what: str) -> list[BatchTrial]:
    """Return the trials of a folder (those of its trials.csv, else every trial file in it), a pattern, or a table.

    Raises AirborneError where there are none, or two would have one name.
    """
    path = Path(what)
    if path.is_dir() and not (path / TABLE).is_file():
        files = [file for file in sorted(path.rglob("*.toml")) if _is_trial(file)]
        rows = [(file, {}) for file in files]
    elif path.is_dir() or path.suffix.lower() == ".csv":
        rows = _read_rows(path / TABLE if path.is_dir() else path)
    else:
        rows = [(Path(name), {}) for name in sorted(glob.glob(what, recursive=True))]
    if not rows:
        raise AirborneError(
            f"{what}: no trial found there; give a folder, a quoted pattern such as 'trials/*.toml', or a CSV"
        )
    trials = [_describe(file, labels) for file, labels in rows]
    by_name: dict[str, Path] = {}
    for trial in trials:
        if trial.name in by_name:
            raise AirborneError(
                f"two trials are called {trial.name}: {by_name[trial.name]} and {trial.path}; rename one of the files"
            )
        by_name[trial.name] = trial.path
    return trials


def _is_trial(path: Path) -> bool:
    """Tell whether a TOML file is a trial, or may be meant as one: one with a mistake is not passed over."""
    try:
        tables = read_toml(path)
    except OSError:
        return False
    except tomllib.TOMLDecodeError:
        return path.name == _ALWAYS_TRIAL or _MEANT_AS_TRIAL.search(_read_head(path)) is not None
    has_cameras, has_session = (get_close_matches(key, tables, cutoff=_ALIKE) for key in ("camera", "session"))
    is_labelled = "labels" in tables and not tables.keys() & _OF_A_SESSION
    return path.name == _ALWAYS_TRIAL or bool(has_session or is_labelled or ("name" in tables and has_cameras))


def _read_head(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_HEAD_BYTES).decode(errors="replace")


def _read_rows(path: Path) -> list[tuple[Path, dict[str, str]]]:
    """Return the trial files of a table, relative to it, and their labels: its other columns."""
    (_, names), *rows = read_csv(path, _TABLE_FORM, TrialError) or [(1, [""])]
    if "trial" not in names or len(set(names)) < len(names):
        if not any(names):
            raise TrialError(f"{path} is empty; {_TABLE_FORM}")
        meant = [name for name in names if name.strip().lower() == "trial"]
        mend = f"; write trial instead of {meant[0]!r}" if len(meant) == 1 and "trial" not in names else ""
        raise TrialError(f"{path}: columns {', '.join(names)[:200]}; {_TABLE_FORM}{mend}")
    found = []
    for line, cells in rows:
        if len(cells) != len(names):
            raise TrialError(f"{path}, row {line}: {len(cells)} cells, expected {len(names)}")
        labels = dict(zip(names, cells, strict=True))
        try:
            file = check_path(labels.pop("trial"))
        except ValueError as error:
            raise TrialError(f"{path}, row {line}: {error}") from None
        found.append((path.parent / (file if file.endswith(".toml") else f"{file}.toml"), labels))
    return found


def _describe(path: Path, labels: Mapping[str, str]) -> BatchTrial:
    path = path.absolute()
    try:
        name = check_column(file_stem(path.parent.name if path.name == _ALWAYS_TRIAL else path.stem))
        for label in labels:
            check_column(label)
    except ValueError as error:
        raise TrialError(f"{path}: {error}") from None
    labels = _own_labels(path) | dict(labels)
    own = [label for label in labels if label in OWN_COLUMNS]
    if own:
        raise TrialError(f"{path}: a label is called {own[0]}, as a column of the batch's table is; rename it")
    return BatchTrial(name, path, labels)


def _own_labels(path: Path) -> dict[str, str]:
    """Return the labels in a trial's file; none where it cannot be read: its task will say why."""
    try:
        labels: Any = read_tables(path).tables.get("labels", {})
    except AirborneError:
        return {}
    return {str(key): str(value) for key, value in labels.items()} if isinstance(labels, dict) else {}


def label_names(trials: Sequence[BatchTrial]) -> list[str]:
    """Return the names of all labels, athlete and condition first."""
    names = dict.fromkeys(name for trial in trials for name in trial.labels)
    return sorted(names, key=lambda name: (name not in ("athlete", "condition"), name != "athlete"))
