"""A run of several players, from files or live: their tracker, their tables and videos, their summary."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from airborne.calibration.from_points import Calibration
from airborne.export.overlays import OverlaysAs
from airborne.export.players_overlay import PlayersOverlayVideos
from airborne.motion import PlayersMotion, PlayersWriter, read_players, write_players_parquet
from airborne.motion.jumps.gravity import find_wrong_gravity
from airborne.motion.jumps.heights import LEAST_RATE_HZ, describe_slow_falls, measure_jumps
from airborne.motion.jumps.table import jump_row, write_jumps
from airborne.motion.players import write_players
from airborne.motion.players_doubts import describe_player_doubts
from airborne.motion.run_folder import JOINTS, JUMPS, figures_of, tables_of, videos_of
from airborne.motion.untracked_players import has_untracked_player, without_untracked
from airborne.run.opening import Opened
from airborne.run.players_cameras import CameraCheck
from airborne.run.players_tracker import doubt_starts, player_starts, players_tracker_of, start_notes
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.status import UNCERTAIN_SD_M as BLOCKER_SD_M
from airborne.tracking.particle.tracker import UNCERTAIN_SD_M as PARTICLE_SD_M
from airborne.tracking.players import PlayersStep, PlayerStart, PlayersTracker, StepTracker
from airborne.tracking.tracker import track_frames
from airborne.trial.file import Trial
from airborne.trial.settings import BodySettings
from airborne.types import Progress
from airborne.video import Frames, LiveRecording, Recording

_UNCERTAINTY = (
    "Standard deviations include what the method itself leaves uncertain, joint by joint. They do not include joints "
    "that were set wrongly at the start, or errors of the cameras' calibration or times."
)
_SLOW = (
    "images come {rate:.4g} times a second: legs move so far between them that they can be lost, so no joint is called "
    "tracked and no jump is measured; track {least:g} images a second or more"
)
_OVERCONFIDENT = (
    "the standard deviations are only the spread of the particles of {method} and far too small: in trials with a "
    "known truth, their 95 % regions held 30 to 70 % of it"
)


@dataclass(frozen=True, slots=True, eq=False)
class PlayersRun:
    """The players of a trial; a `Subject`. Their tracker's state is in no table, so nothing is resumed."""

    trial: Trial
    recording: Recording | LiveRecording
    calibration: Calibration | None
    players: PlayersTracker
    starts: tuple[PlayerStart, ...]
    cameras: CameraCheck = field(default_factory=CameraCheck)  # grows while the run is tracked
    start_doubts: Mapping[str, str] = field(default_factory=dict)  # by the players whose starts cannot be believed

    table = JOINTS

    @classmethod
    def open(cls, trial: Trial, opened: Opened[Recording | LiveRecording]) -> PlayersRun:
        """Make the tracker, which checks the players' starts against the cameras."""
        rig = opened.recording.rig
        tracker, starts = players_tracker_of(trial, rig), player_starts(trial, rig)
        opened.recording.events.extend(start_notes(starts))
        return cls(trial, opened.recording, opened.calibration, tracker, starts)

    @property
    def n_frames(self) -> int | None:
        """How many times to expect by the files' stated durations; None where they are unknown."""
        return self.recording.n_frames

    @property
    def names(self) -> tuple[str, ...]:
        """The names that figures and videos show."""
        return tuple(start.name for start in self.starts)

    def read_done(self, folder: Path) -> dict[int, PlayersStep]:
        """Return nothing: a killed run is tracked again from its start, to the same result."""
        return {}

    def copy_inputs(self, folder: Path) -> None:
        """Write nothing: players have no body file."""

    def see(self, first: Frames) -> PlayersRun:
        """Return the players with doubts of their starts; their trackers learn from the first frames themselves."""
        is_live = not isinstance(self.recording, Recording)  # then frames do not wait
        return replace(self, start_doubts=doubt_starts(self.starts, None if is_live else first))

    def track(
        self,
        frames: Iterable[Frames],
        write: Callable[[PlayersStep], None],
        done: Mapping[int, PlayersStep],
        tick: Callable[[int], None],
    ) -> Iterator[tuple[Frames, PlayersStep]]:
        """Yield each time's frames with the players' step there, written."""
        for observed, step in track_frames(StepTracker(self.players, self._is_slow), frames, write, done):
            if isinstance(self.players, Blocker) and isinstance(self.recording, Recording):
                self.cameras.add(observed, step)
            yield observed, step

    def writer(self, folder: Path, *, resume: bool) -> PlayersWriter:
        """Return what writes the estimates; rows that are there already stay, but not where they may be revised."""
        path = folder / self.table
        return PlayersWriter(path, self.players.joints, resume=resume and not has_untracked_player(path))

    def write(self, writer: PlayersWriter, estimate: PlayersStep) -> None:
        """Write one time's estimates; what there is to say of them becomes an event of the recording."""
        writer.append(estimate.players)
        notes = (f"{each.player}, frame {each.index}: {each.note}" for each in estimate.players if each.note)
        self.recording.events.extend(notes)

    def artists(self, folder: Path, drawn: OverlaysAs) -> Iterator[AbstractContextManager[Any]]:
        """Return what draws the frames while they are tracked."""
        recording, track = self.recording, self.trial.track
        folder_of = videos_of if drawn == "videos" else figures_of
        assert not isinstance(track, BodySettings), "checked with the trial"
        yield PlayersOverlayVideos(
            folder_of(folder),
            recording.rig,
            recording.rate,
            style=track.overlay,
            starts=self.starts,
            drawn=drawn,
        )

    def draw(self, artists: Sequence[Any], frames: Frames, estimate: PlayersStep) -> None:
        """Let the artists draw one time."""
        for artist in artists:
            artist.write(frames, self.players.joints, estimate.players)

    def finish(
        self, folder: Path, drawn: OverlaysAs | None, progress_of: Callable[[str], Progress | None]
    ) -> tuple[PlayersMotion, dict[str, Any]]:
        """Write the tables; return the motion and the beginning of the summary."""
        written = read_players(folder / self.table)
        tracked = written.without_tracked(tuple(self.start_doubts))
        motion = without_untracked(tracked)
        wrong = find_wrong_gravity(motion)
        if wrong is not None:
            motion = motion.without_tracked()
        if not np.array_equal(motion.joint_status, written.joint_status):
            write_players(folder / self.table, motion)
        write_players_parquet(tables_of(folder) / "joints.parquet", folder / self.table)
        jumps = measure_jumps(motion)
        self.recording.events.extend(describe_slow_falls(motion))
        write_jumps(folder / JUMPS, jumps)
        said = [] if wrong or self._is_slow else motion.players  # of a wrong world or rate, which makes all uncertain
        doubts = {name: self._doubts(written, name) for name in said}
        summary = {
            **self._summary(tracked if wrong is None else motion, doubts),
            "jumps": [jump_row(jump) for jump in jumps],
        }
        return motion, summary if wrong is None else summary | {"self_check": [wrong.to_dict()]}

    def write_report(self, folder: Path, summary: dict[str, Any], motion: PlayersMotion) -> None:
        """Write the report."""
        from airborne.export.players_report import write_players_report

        write_players_report(folder, summary, motion)

    def _summary(self, motion: PlayersMotion, doubts: Mapping[str, list[str]]) -> dict[str, Any]:
        is_tracked, is_lost = (motion.status == status.value for status in (Status.TRACKED, Status.LOST))
        n_tracked, n_lost = int(is_tracked.all(axis=1).sum()), int(is_lost.all(axis=1).sum())
        recording = self.recording
        return {
            "name": self.trial.name,
            "n_frames": len(motion),
            "n_tracked": n_tracked,
            "n_uncertain": len(motion) - n_tracked - n_lost,
            "n_lost": n_lost,
            "start_s": float(motion.time_s[0]),
            "duration_s": float(motion.time_s[-1] - motion.time_s[0]),
            "rate_hz": round(float(recording.rate), 6),
            "players": {
                name: {**_player(motion, k, len(recording.rig)), "doubts": doubts.get(name, [])}
                | ({"start_doubt": self.start_doubts[name]} if name in self.start_doubts else {})
                for k, name in enumerate(motion.players)
            },
            "bystanders": [start.name for start in self.starts if not start.has_legs],
            "uncertainty": _UNCERTAINTY,
        }

    def _doubts(self, motion: PlayersMotion, name: str) -> list[str]:
        """Say which joints are uncertain, and why."""
        is_blocker = isinstance(self.players, Blocker)
        most_sd_m = BLOCKER_SD_M if is_blocker else PARTICLE_SD_M
        return list(describe_player_doubts(motion, name, most_sd_m=most_sd_m, is_joint_alone=is_blocker))

    def keep(self, frames: Frames) -> None:
        """Keep nothing: players are not checked at the end."""

    def warnings(self) -> list[str]:
        """Return what a reader of the numbers must know."""
        method = self.trial.track.method
        slow = [_SLOW.format(rate=float(self.recording.rate), least=LEAST_RATE_HZ)] if self._is_slow else []
        said = [] if method == "blocker" else [_OVERCONFIDENT.format(method=method)]
        return [*slow, *said, *self.cameras.describe(self.recording.rig.names)]

    @property
    def _is_slow(self) -> bool:
        return self.recording.rate < LEAST_RATE_HZ


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
