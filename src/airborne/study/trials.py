"""The trials of a study, read back from the table of a batch."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from airborne.batch.trials import TABLE
from airborne.cameras.finding import join_names
from airborne.errors import ResultError
from airborne.export.summary import MOST_UNTRACKED
from airborne.io.names import check_path
from airborne.io.text import read_csv

ATHLETE, CONDITION = "athlete", "condition"  # the labels that a study needs
LARGEST = 1e100  # no measurement is larger, and its square is still a number
_EMPTY = ("", "nan")  # cells without a number
_FORM = "the table of a batch has columns trial, athlete, condition, status, folder"
_MEASURED = re.compile(r"-?\d*\.\d{8,}(e[-+]\d+)?")  # chosen: of eight decimals no two recordings have the same
_NEEDED = {"trial", "status", "error", "folder", CONDITION}


@dataclass(frozen=True, slots=True)
class StudyTrial:
    """A trial whose run is finished: its place in the study, its run's folder, its row of the table."""

    name: str
    athlete: str
    condition: str
    folder: Path
    row: Mapping[str, str]

    def number(self, name: str) -> float | None:
        """Return a number of the row; None where there is none."""
        try:
            value = float(self.row[name])
        except (KeyError, ValueError):
            return None
        return value if abs(value) < LARGEST else None

    def require_number(self, name: str) -> float | None:
        """Return a number of the row; None where the cell is empty; raises ResultError for anything else."""
        value = self.number(name)
        cell = self.row.get(name, "")
        if value is None and cell.lower() not in _EMPTY:
            raise ResultError(
                f"{TABLE}, row of trial {self.name}, column {name}: expected a number or nothing "
                f"(found '{cell[:60]}'); correct it, or give the batch again"
            )
        return value


@dataclass(frozen=True, slots=True)
class Study:
    """Trials to be compared, and what was left out of them, a line each."""

    trials: tuple[StudyTrial, ...]
    conditions: tuple[str, ...]  # in the order in which they are compared
    left_out: tuple[str, ...]

    @property
    def columns(self) -> list[str]:
        """The columns of the table that hold numbers."""
        names = dict.fromkeys(name for trial in self.trials for name in trial.row)
        return [name for name in names if any(trial.number(name) is not None for trial in self.trials)]


def read_study(folder: Path, conditions: Sequence[str] = ()) -> Study:
    """Read the finished trials of a batch's folder, of some conditions, in their order, or of all.

    The athlete of a run of players is the one who jumped highest, where no label says it. Raises ResultError where the
    folder holds no table, or none of the trials can be compared.
    """
    if not folder.is_dir():
        found = "is a file" if folder.exists() else "does not exist"
        raise ResultError(f"{folder} {found}; give the folder of a batch")
    if not (folder / TABLE).exists():
        raise ResultError(f"{folder} has no {TABLE}; give the folder of a batch, which `airborne batch` has finished")
    (_, names), *lines = read_csv(folder / TABLE, _FORM, ResultError) or [(1, [""])]
    if not set(names) >= _NEEDED or len(set(names)) < len(names):
        raise ResultError(
            f"{folder / TABLE}: lacks {', '.join(sorted(_NEEDED - set(names))) or 'names of its own'}; {_FORM}"
        )
    trials, left_out, others = [], [], list[str]()
    for _, cells in lines:
        if len(cells) != len(names):
            raise ResultError(f"{folder / TABLE}: {len(cells)} cells in a row, expected {len(names)}; {_FORM}")
        row = dict(zip(names, cells, strict=True))
        athlete = row.get(ATHLETE) or row.get("player", "")
        if conditions and row[CONDITION] not in conditions:
            others += [row[CONDITION]] * bool(athlete and row[CONDITION] and row["status"] == "done")
            continue
        if row["status"] != "done":
            left_out.append(f"{row['trial']}: {row['status']}: {row['error']}")
        elif not athlete or not row[CONDITION]:
            left_out.append(f"{row['trial']}: has no label {CONDITION if athlete else ATHLETE}")
        else:
            trial = StudyTrial(row["trial"], athlete, row[CONDITION], _folder_of(folder, row), row)
            share = trial.number("share_tracked")
            if share is not None and share < MOST_UNTRACKED:
                left_out.append(f"{trial.name}: only {share:.0%} of its frames are tracked")
            else:
                trials.append(trial)
    if not trials and others and not left_out:
        there = ", ".join(dict.fromkeys(others))
        raise ResultError(f"{folder / TABLE}: no trial of condition {' or '.join(conditions)}; it has: {there}")
    if not trials:
        why = f"; {left_out[0]}" if left_out else ""
        raise ResultError(f"{folder / TABLE}: no finished trial with labels {ATHLETE} and {CONDITION}{why}")
    found = dict.fromkeys(trial.condition for trial in trials)
    missing = [name for name in conditions if name not in found]
    if missing:
        raise ResultError(f"{folder / TABLE}: no finished trial of condition {missing[0]}; it has: {', '.join(found)}")
    return Study(tuple(trials), tuple(conditions) or tuple(found), tuple(left_out))


def describe_alarms(trials: Sequence[StudyTrial]) -> list[str]:
    """Name the trials whose runs raised alarms, which are compared all the same."""
    return [f"{trial.name}: {trial.row['findings']}" for trial in trials if trial.row.get("findings")]


def describe_twins(trials: Sequence[StudyTrial]) -> list[str]:
    """Name the trials whose measurements are the same to the last digit, as of a recording that was given twice."""
    alike: dict[tuple[str, ...], list[str]] = {}
    for trial in trials:
        measured = tuple(cell for cell in trial.row.values() if _MEASURED.fullmatch(cell))
        if measured:
            alike.setdefault(measured, []).append(trial.name)
    return [
        f"{join_names(names)} have the same numbers to the last digit: are they one recording, given {len(names)} "
        "times? Then its spread says nothing"
        for names in alike.values()
        if len(names) > 1
    ]


def _folder_of(folder: Path, row: Mapping[str, str]) -> Path:
    """Return where a trial's run lies; raises ResultError where nothing can lie there."""
    try:
        return folder / check_path(row["folder"])
    except ValueError as error:
        raise ResultError(f"{folder / TABLE}, folder of {row['trial'][:80]}: {error}") from None
