"""What may be given to the public functions: paths, runs, times, progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from os import PathLike
from pathlib import Path
from typing import ParamSpec, TypeVar

from airborne.errors import AirborneError
from airborne.io.names import to_path
from airborne.io.terminal import Stages
from airborne.io.terminal import progress as progress_bar
from airborne.io.writing import describe_path_error
from airborne.run.result import Run
from airborne.types import Progress, StageProgress

FilePath = str | PathLike[str]
_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")


def explain_paths(function: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
    """Let a function raise an AirborneError, in one line, for a path that cannot be read or written."""

    @wraps(function)
    def call(*args: _Given.args, **kwargs: _Given.kwargs) -> _Found:
        try:
            return function(*args, **kwargs)
        except OSError as error:
            raise AirborneError(describe_path_error(error)) from error

    return call


def as_list(given: FilePath | Run | Sequence[FilePath | Run]) -> Sequence[FilePath | Run]:
    """Return one thing as a list of it, and several as they are."""
    return [given] if isinstance(given, str | PathLike | Run) else given


def to_times(events_s: Sequence[float] | None) -> list[float] | None:
    """Return times [s], or None for None; raises AirborneError for anything else."""
    try:
        if not isinstance(events_s, str):
            return None if events_s is None else [float(time_s) for time_s in events_s]
    except (TypeError, ValueError):
        pass
    raise AirborneError(
        f"events_s is {events_s!r}; expected times in seconds such as [0.31, 0.92], [] for none, None for those found"
    )


def folder_of(run: Run | FilePath) -> Path:
    """Return the folder of a run; raises AirborneError for what is neither a run nor a path."""
    return run.folder if isinstance(run, Run) else to_path(run)


@contextmanager
def report_progress(progress: bool | Progress, what: str) -> Iterator[Progress | None]:
    """Yield what is told of each step: a bar for True, nothing for False, or the function given."""
    if progress is True:
        with progress_bar(what) as bar:
            yield bar
    else:
        yield progress or None


@contextmanager
def report_stages(progress: bool | StageProgress) -> Iterator[StageProgress]:
    """Yield what is told of each step of each stage: bars for True, nothing for False, or the function given."""
    if progress is True:
        with Stages() as bars:
            yield bars
    else:
        yield progress or (lambda what, done, total: None)
