"""Several players, from files or live, to results: frames -> joints of every player -> tables, videos, report."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from airborne.calibration.from_points import Calibration
from airborne.cameras import write_pose2sim
from airborne.errors import ResultError
from airborne.export import PlayersOverlayVideos, write_json, write_players_report
from airborne.motion import PlayersMotion, PlayersWriter, read_players, write_players_parquet
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.jumps.table import jump_row, write_jumps
from airborne.run.opening import (
    list_tables,
    open_live,
    open_trial,
    past_the_end_error,
    prepare_folder,
    provenance,
    run_identity,
)
from airborne.run.players_tracker import compile_kernels, players_tracker_of
from airborne.tracking import Status
from airborne.trial.file import Trial
from airborne.types import Progress
from airborne.video import LiveRecording, Outages, Recording

_TABLE = "joints.csv"
_UNCERTAINTY = (
    "Standard deviations hold what the method itself leaves open, joint by joint. They do not hold joints that were "
    "set wrongly at the start, nor errors of the cameras' calibration or times."
)
_OVERCONFIDENT = (
    "the standard deviations are only the spread of the particles of {method} and far too small: in trials with a "
    "known truth, their 95 % regions held 30 to 70 % of it"
)


@dataclass(frozen=True, slots=True, eq=False)
class PlayersRun:
    """The results of a finished run of players; its folder holds the same."""

    motion: PlayersMotion
    summary: dict[str, Any]


def track_players(
    trial: Trial,
    folder: Path,
    *,
    resume: bool = False,
    live: bool = False,
    pictures: bool = True,
    progress: Progress | None = None,
) -> PlayersRun:
    """Track the players of a trial and write the results into a folder.

    With `resume` a run that was killed is tracked again from its start, to the same result; existing rows
    stay. `live` reads pipes, capture devices, or files at their own speed, drops frames rather than fall behind, and
    ends with them or with KeyboardInterrupt. `pictures=False` leaves out videos and report. Raises an AirborneError for
    input that cannot be used, and for a folder that holds another run.
    """
    if live and resume:
        raise ResultError("a live run cannot be resumed: its frames are gone; track into a new folder")
    started_s = time.monotonic()
    with ExitStack() as stack:
        if live:
            compile_kernels(trial)
            waiting = (lambda: None) if progress is None else (lambda: progress(0, None))
            recording, calibration = stack.enter_context(open_live(trial, waiting))
        else:
            recording, calibration = open_trial(trial)
        identity = run_identity(trial, live=live)
        goes_on = prepare_folder(folder, identity, _TABLE, resume=resume)
        write_pose2sim(folder / "calib.toml", recording.rig)
        read_s = time.monotonic()
        delays_s = _track_frames(trial, recording, folder, resume=goes_on, pictures=pictures, progress=progress)
    tracked_s = time.monotonic()
    motion = read_players(folder / _TABLE)
    write_players_parquet(folder / "joints.parquet", folder / _TABLE)
    found_jumps = measure_jumps(motion)
    write_jumps(folder / "jumps.csv", found_jumps)
    summary = _summary(trial, calibration, recording, motion=motion, inputs=identity["inputs"])
    summary["jumps"] = [jump_row(jump) for jump in found_jumps]
    summary["tables"] = list_tables(folder)
    if isinstance(recording, LiveRecording):
        summary["live"] = {
            "cameras": recording.image_counts(),
            "median_delay_s": float(np.median(delays_s)),
            "largest_delay_s": max(delays_s),
        }
    summary["timings_s"] = {
        "opening": read_s - started_s,
        "tracking": tracked_s - read_s,
        "writing": time.monotonic() - tracked_s,
        "tracking_a_frame": (tracked_s - read_s) / len(motion),
    }
    write_json(folder / "summary.json", summary)
    if pictures:
        write_players_report(folder, summary, motion)
    return PlayersRun(motion, summary)


def _track_frames(
    trial: Trial,
    recording: Recording | LiveRecording,
    folder: Path,
    *,
    resume: bool,
    pictures: bool,
    progress: Progress | None,
) -> list[float]:
    """Track every frame and write its estimates at once; return the delays of live frames until then [s]."""
    delays_s, n_frames = [], 0
    with ExitStack() as stack:
        frames = stack.enter_context(closing(iter(recording)))
        first = next(frames, None)
        if first is None:
            raise past_the_end_error(trial)
        tracker = players_tracker_of(trial, recording.rig)
        writer = stack.enter_context(PlayersWriter(folder / _TABLE, tracker.joints, resume=resume))
        artists = [stack.enter_context(artist) for artist in _artists(trial, folder, recording, pictures)]
        state, outages = tracker.init(), Outages(recording.rig.names)
        try:
            for n_frames, observed in enumerate(chain([first], frames), start=1):
                state, estimates = tracker.step(state, observed)
                writer.append(estimates)
                if isinstance(recording, LiveRecording):
                    delays_s.append(time.monotonic() - recording.arrival_s)
                outages.add(observed)
                for artist in artists:
                    artist.write(observed, tracker.joints, estimates)
                if progress is not None:
                    progress(n_frames, recording.n_frames)
        except KeyboardInterrupt:
            if not delays_s:  # only a live run ends like this
                raise
        recording.events.extend(outages.describe())
    return delays_s


def _artists(
    trial: Trial, folder: Path, recording: Recording | LiveRecording, pictures: bool
) -> Iterator[PlayersOverlayVideos]:
    if pictures:
        yield PlayersOverlayVideos(
            folder, recording.rig, recording.rate, style=trial.track.overlay, starts=trial.players
        )


def _summary(
    trial: Trial,
    calibration: Calibration | None,
    recording: Recording | LiveRecording,
    *,
    motion: PlayersMotion,
    inputs: dict[str, str],
) -> dict[str, Any]:
    is_tracked, is_lost = (motion.status == status.value for status in (Status.TRACKED, Status.LOST))
    shared = provenance(trial, calibration, recording, inputs)
    if trial.track.method != "blocker":
        shared["warnings"].append(_OVERCONFIDENT.format(method=trial.track.method))
    n_tracked, n_lost = int(is_tracked.all(axis=1).sum()), int(is_lost.all(axis=1).sum())
    return {
        "name": trial.name,
        "n_frames": len(motion),
        "n_tracked": n_tracked,
        "n_uncertain": len(motion) - n_tracked - n_lost,
        "n_lost": n_lost,
        "start_s": float(motion.time_s[0]),
        "duration_s": float(motion.time_s[-1] - motion.time_s[0]),
        "rate_hz": round(float(recording.rate), 6),
        "players": {name: _player(motion, k, len(recording.rig)) for k, name in enumerate(motion.players)},
        "bystanders": [start.name for start in trial.players if not start.has_legs],
        "uncertainty": _UNCERTAINTY,
        **shared,
    }


def _player(motion: PlayersMotion, k: int, n_cameras: int) -> dict[str, Any]:
    """Reduce one player's motion to its headline numbers."""
    is_found = motion.status[:, k] != Status.LOST.value
    sd, score = motion.sd[is_found, k], motion.score[is_found, k]
    return {
        **{f"n_{status}": motion.count(motion.players[k], status) for status in Status},
        "median_sd_mm": 1e3 * float(np.nanmedian(sd)) if np.isfinite(sd).any() else None,
        "median_score": float(np.nanmedian(score)) if np.isfinite(score).any() else None,
        "n_fewer_cameras": int((motion.n_views[:, k] < n_cameras).sum()),
        "n_below_two_cameras": int((motion.n_views[:, k] < 2).sum()),
    }
