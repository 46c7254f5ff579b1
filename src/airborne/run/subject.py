"""What the loop of a run asks of what it tracks, a body or players."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Protocol, Self, TypeVar

from airborne.calibration.from_points import Calibration
from airborne.export.overlays import OverlaysAs
from airborne.motion import Motion, PlayersMotion
from airborne.tracking.tracker import Found
from airborne.trial.file import Trial
from airborne.types import Progress
from airborne.video import Frames, LiveRecording, Recording

AnyMotion = TypeVar("AnyMotion", Motion, PlayersMotion)


class Subject(Protocol[Found, AnyMotion]):
    """What is tracked: how its tracker begins, what it writes and draws at each time, and what a run of it leaves."""

    @property
    def trial(self) -> Trial:
        """The trial."""
        ...

    @property
    def recording(self) -> Recording | LiveRecording:
        """Its frames."""
        ...

    @property
    def calibration(self) -> Calibration | None:
        """How its cameras were found, if from control points."""
        ...

    @property
    def table(self) -> str:
        """The table that is written as the run goes."""
        ...

    @property
    def n_frames(self) -> int | None:
        """How many times to expect; None where that is unknown."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """The names that figures and videos show."""
        ...

    def read_done(self, folder: Path) -> Mapping[int, Found]:
        """Return what an earlier run found, by frames, where the tracker only learns."""
        ...

    def copy_inputs(self, folder: Path) -> None:
        """Write beside the results what other commands need."""
        ...

    def see(self, first: Frames) -> Self:
        """Return the subject with what the first frames show of it."""
        ...

    def track(
        self,
        frames: Iterable[Frames],
        write: Callable[[Found], None],
        done: Mapping[int, Found],
        tick: Callable[[int], None],
    ) -> Iterator[tuple[Frames, Found]]:
        """Yield each time's frames with what is found there, written; what is `done` is left as it is.

        `tick` takes how many times are done where the tracker goes over some of them before it yields.
        """
        ...

    def writer(self, folder: Path, *, resume: bool) -> AbstractContextManager[Any]:
        """Return what writes the table."""
        ...

    def write(self, writer: Any, estimate: Found) -> None:
        """Write one time."""
        ...

    def artists(self, folder: Path, drawn: OverlaysAs) -> Iterable[AbstractContextManager[Any]]:
        """Return what draws the frames while they are tracked; nothing where `finish` draws them."""
        ...

    def draw(self, artists: Sequence[Any], frames: Frames, estimate: Found) -> None:
        """Let the artists draw one time."""
        ...

    def keep(self, frames: Frames) -> None:
        """Keep what the end of the run needs of a time's frames."""
        ...

    def finish(
        self, folder: Path, drawn: OverlaysAs | None, progress_of: Callable[[str], Progress | None]
    ) -> tuple[AnyMotion, dict[str, Any]]:
        """Write the other tables, and draw what the artists left; return the motion and the summary's beginning.

        `progress_of` returns what a stage of that reports to.
        """
        ...

    def warnings(self) -> list[str]:
        """Return what a reader of the numbers must know."""
        ...

    def write_report(self, folder: Path, summary: dict[str, Any], motion: AnyMotion) -> None:
        """Draw the figures and write the report."""
        ...
