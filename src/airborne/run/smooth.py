"""Smoothing a finished run: new tables beside the raw ones, and the figure of the residual analysis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from airborne import __version__
from airborne.errors import ResultError
from airborne.export import write_json
from airborne.export.analysis_figures import write_residuals
from airborne.motion import known_landmarks
from airborne.motion.flight.phases import Event, body_events, player_events
from airborne.motion.run_folder import (
    SMOOTH_JOINTS,
    SMOOTH_RECORD,
    figures_of,
    holds_players,
    read_body_run,
    read_players_run,
    tables_of,
)
from airborne.motion.smoothing import ResidualAnalysis, is_evenly_sampled, residual_analysis
from airborne.motion.smoothing.segments import MIN_FRAMES, finite_rows, segment_numbers, stretches
from airborne.motion.smoothing.settings import Smoothing
from airborne.motion.smoothing.smoother import (
    smooth_joint_angles,
    smooth_landmarks,
    smooth_players,
    smooth_root,
)
from airborne.motion.smoothing.tables import (
    write_smooth_events,
    write_smooth_joint_angles,
    write_smooth_joints,
    write_smooth_motion,
)
from airborne.run.folder import open_results
from airborne.types import Array, Progress

Events = dict[str, tuple[Event, ...]]  # by player; of one body under ""

MOTION = "tables/smooth_motion.csv"
ANGLES, EVENTS = "tables/smooth_joint_angles.csv", "tables/smooth_events.csv"
RESIDUALS_FIGURE = "figures/residuals.png"


@dataclass(frozen=True, slots=True, eq=False)
class SmoothRun:
    """What was done, and the files that it added to the folder."""

    smoothing: Smoothing
    events: Events
    analysis: ResidualAnalysis | None  # None where times are not even, or no stretch is long enough
    tables: dict[str, xr.Dataset]  # "joints"; of a body also "root" and, if it has joints, "angles"
    folder: Path
    files: tuple[str, ...]  # in it

    @property
    def history(self) -> list[str]:
        """What was done, one step each."""
        return next(iter(self.tables.values())).attrs["history"]

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers for a JSON file."""
        analysis = self.analysis
        return {
            "method": self.smoothing.method,
            "cutoff_hz": self.smoothing.cutoff_hz,
            "resample_hz": self.smoothing.resample_hz,
            "fill_s": self.smoothing.fill_s,
            "events": {name: [event._asdict() for event in events] for name, events in self.events.items()},
            "history": self.history,
            "residual_analysis": None
            if analysis is None
            else {
                "chosen_hz": analysis.chosen_hz,
                "whitest_hz": analysis.whitest_hz,
                "noise_mm": 1e3 * analysis.noise,
                "cutoff_hz": analysis.cutoff_hz,
                "residual_mm": 1e3 * analysis.residual,
            },
            "files": list(self.files),
            "version": __version__,
        }

    def describe(self) -> str:
        """Return what was done in a few plain lines."""
        lines = list(self.history)
        if self.analysis is not None:
            a = self.analysis
            lines.append(
                f"residual analysis: cut-off {a.chosen_hz:.1f} Hz (Winter), {a.whitest_hz:.1f} Hz (whitest residuals, "
                f"Challis); white noise {1e3 * a.noise:.1f} mm an axis"
            )
        return "\n".join([*lines, f"wrote into {self.folder}: {', '.join(self.files)}"])


def smooth_run(
    folder: Path,
    smoothing: Smoothing,
    *,
    events_s: Sequence[float] | None = None,
    out: Path | None = None,
    progress: Progress | None = None,
) -> SmoothRun:
    """Smooth the run in a folder, and write new tables and residuals.png there, or into `out`; raw tables stay.

    A Butterworth filter without a cut-off gets that of the residual analysis. `events_s` are the times at which
    segments end, for every player; None takes the take-offs and landings that the motion shows. Raises ResultError
    where the folder holds no run, and for what cannot be smoothed so.
    """
    run = _players_run(folder) if holds_players(folder) else _body_run(folder)
    events = _events(run, events_s)
    boundaries = {name: [event.time_s for event in each] for name, each in events.items()}
    analysis = None
    if is_evenly_sampled(run.time_s):
        own = [boundaries[owner] for owner in run.owners]
        analysis = residual_analysis(run.time_s, run.paths, boundaries_s=own)
        analysis = analysis if analysis.n_values else None
    if smoothing.lacks_cutoff:
        smoothing = replace(smoothing, cutoff_hz=_choose_cutoff(analysis))
    if not _has_stretch(run, boundaries, smoothing.fill_s):
        raise ResultError(
            f"{folder}: nothing can be smoothed, as no stretch has {MIN_FRAMES} frames with a pose (the run has "
            f"{len(run.time_s)} frames); track more, fill gaps, or set fewer events"
        )
    out = folder if out is None else out
    with open_results(out):
        tables_of(out)
        tables, files = run.write(out, smoothing, events, progress)
        if analysis is not None:
            figures_of(out)
            write_residuals(out / RESIDUALS_FIGURE, analysis, smoothing.cutoff_hz)
            files = (*files, RESIDUALS_FIGURE)
        result = SmoothRun(smoothing, events, analysis, tables, out, (*files, SMOOTH_RECORD))
        write_json(out / SMOOTH_RECORD, result.to_dict())
    return result


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """What smoothing needs of a run, be it of a body or of players."""

    time_s: Array  # (n,)
    paths: Array  # (n, paths, 3) [m], those that the residual analysis looks at
    owners: tuple[str, ...]  # of each path
    find: Callable[[], Events]
    write: Callable[[Path, Smoothing, Events, Progress | None], tuple[dict[str, xr.Dataset], tuple[str, ...]]]


def _players_run(folder: Path) -> _Run:
    motion = read_players_run(folder)

    def write(
        out: Path, smoothing: Smoothing, events: Events, progress: Progress | None
    ) -> tuple[dict[str, xr.Dataset], tuple[str, ...]]:
        times = {name: [event.time_s for event in events[name]] for name in motion.players}
        joints = smooth_players(motion, smoothing, times, progress)
        write_smooth_joints(out / SMOOTH_JOINTS, joints)
        write_smooth_events(out / EVENTS, events, joints)
        return {"joints": joints}, (SMOOTH_JOINTS, EVENTS)

    paths = motion.points.reshape(len(motion), -1, 3)
    owners = tuple(name for name in motion.players for _ in motion.joints)
    return _Run(motion.time_s, paths, owners, lambda: player_events(motion), write)


def _body_run(folder: Path) -> _Run:
    motion, model = read_body_run(folder)

    def write(
        out: Path, smoothing: Smoothing, events: Events, progress: Progress | None
    ) -> tuple[dict[str, xr.Dataset], tuple[str, ...]]:
        times = [event.time_s for event in events[""]]
        root = smooth_root(motion, model, smoothing, times)
        joints = smooth_landmarks(motion, model, smoothing, times, progress=progress)
        write_smooth_motion(out / MOTION, root)
        write_smooth_joints(out / SMOOTH_JOINTS, joints)
        write_smooth_events(out / EVENTS, events, joints)
        tables, files = {"root": root, "joints": joints}, (MOTION, SMOOTH_JOINTS, EVENTS)
        if motion.joints:
            tables["angles"] = smooth_joint_angles(motion, model, smoothing, times)
            write_smooth_joint_angles(out / ANGLES, tables["angles"])
            files = (MOTION, SMOOTH_JOINTS, ANGLES, EVENTS)
        return tables, files

    points, *_ = known_landmarks(motion, model)
    return _Run(motion.time_s, points, ("",) * points.shape[1], lambda: {"": body_events(motion, model)}, write)


def _has_stretch(run: _Run, boundaries_s: dict[str, list[float]], fill_s: float) -> bool:
    """Say whether any path has a stretch that is long enough to be smoothed."""
    return any(
        any(stretches(run.time_s, finite_rows(path), segment_numbers(run.time_s, boundaries_s[owner]), fill_s))
        for owner, path in zip(run.owners, run.paths.transpose(1, 0, 2), strict=True)
    )


def _events(run: _Run, times_s: Sequence[float] | None) -> Events:
    if times_s is not None:
        outside = [time for time in times_s if not run.time_s[0] < time < run.time_s[-1]]
        if outside:
            raise ResultError(
                f"no event can be at {outside[0]:g} s: events lie between the run's ends, {run.time_s[0]:.3f} and "
                f"{run.time_s[-1]:.3f} s, and are separated by commas, as 0.31,0.92"
            )
        given = tuple(Event("given", time) for time in sorted(set(times_s)))
        return dict.fromkeys(run.owners, given)
    try:
        return run.find()
    except ResultError as error:
        raise ResultError(f"events cannot be found ({error}); say when they are, or that there are none") from None


def _choose_cutoff(analysis: ResidualAnalysis | None) -> float:
    if analysis is None:
        raise ResultError("frames are not even in time, or too few, so that no cut-off can be chosen; give one in Hz")
    if not np.isfinite(analysis.chosen_hz):
        raise ResultError("the residuals choose no cut-off: the motion is too short or too smooth; give one in Hz")
    return analysis.chosen_hz
