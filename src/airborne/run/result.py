"""A run as a value: what lies in its folder, read when it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import xarray as xr
from matplotlib.figure import Figure

from airborne.body import BodyModel
from airborne.cameras import Rig, read_rig
from airborne.errors import AirborneError, ResultError, count, require_choice
from airborne.export.figures import flight_figure, joint_status_figure, joints_figure, pose_figure
from airborne.export.players_report import heights_figure
from airborne.io.names import to_path
from airborne.motion import Motion, PlayersMotion, measure_jumps, state_flight
from airborne.motion.labelled import label_angles, label_joints, label_jumps, label_players, label_root
from airborne.motion.run_folder import holds_players, holds_run, read_body_run, read_players_run, read_summary

_FIGURES = {"joints": joints_figure, "joint_status": joint_status_figure, "flight": flight_figure}


@dataclass(frozen=True, eq=False)
class Run:
    """A run of one body or of players, finished or not: what `airborne track` leaves in a folder.

    Tables are labelled arrays (xarray): time in seconds, joints and axes by name, units in the attributes, the standard
    deviation of `x` in `x_sd`, NaN where the body was lost. Raises ResultError, here for a folder without a run, later
    for files that are missing or damaged, and for what this run does not hold.

    >>> run = Run(Path("results"))
    >>> run.joints["position"].sel(joint="cross", space="z").attrs["units"]
    'm'
    """

    folder: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", to_path(self.folder))
        if not holds_run(self.folder):
            raise ResultError(f"{self.folder} holds no run; expected the output folder of a run")

    def __repr__(self) -> str:
        here = Path.cwd()
        folder = str(self.folder.relative_to(here) if self.folder.is_relative_to(here) else self.folder)
        try:
            return f"Run({folder!r}): {self._state()}"
        except AirborneError as error:
            return f"Run({folder!r}): {error}"

    def _state(self) -> str:
        if not (self.folder / "summary.json").is_file():
            n = len(self.players if self.has_players else self.motion)
            return f"not finished, {count(n, 'frame')}; standard deviations without what the self-check adds"
        summary = self.summary
        counts = ", ".join(f"{summary[f'n_{status}']} {status}" for status in ("tracked", "uncertain", "lost"))
        return f"{summary['name']}, {summary['n_frames']} frames: {counts}"

    @property
    def has_players(self) -> bool:
        """Whether this is a run of several players, and not of one body."""
        return holds_players(self.folder)

    @property
    def summary(self) -> dict[str, Any]:
        """What summary.json holds now: headline numbers, method, versions; and comparisons with references."""
        return read_summary(self.folder)

    @cached_property
    def motion(self) -> Motion:
        """The body's motion, with the full covariance: arrays in metres and radians."""
        return self._motion_and_body[0]

    @cached_property
    def players(self) -> PlayersMotion:
        """The players' motion, with the covariance of each joint: arrays in metres."""
        if not self.has_players:
            raise ResultError(f"{self.folder} holds a run of one body, not of players; use .motion")
        return read_players_run(self.folder)

    @property
    def body(self) -> BodyModel:
        """The body that was tracked."""
        return self._motion_and_body[1]

    @cached_property
    def rig(self) -> Rig:
        """The cameras of the run."""
        return read_rig(self.folder / "calib.toml")

    @cached_property
    def root(self) -> xr.Dataset:
        """The body's root: `position` (time, space) [m], `quaternion` (time, component), their sd, `score`."""
        return label_root(self.motion)

    @cached_property
    def joints(self) -> xr.Dataset:
        """The joints and other landmarks: `position` (time, joint, space) [m], `position_sd` (time, joint), `status`.

        Of players, `player` comes after `time`, and there is a `covariance`.
        """
        return label_players(self.players) if self.has_players else label_joints(self.motion, self.body)

    @cached_property
    def angles(self) -> xr.Dataset:
        """The body's angles [deg]: `somersault`, `tilt`, `twist` (time), `angle` (time, joint, axis), with `_sd`."""
        return label_angles(self.motion, self.body)

    @cached_property
    def flight(self) -> xr.Dataset:
        """The body in flight: `com` (time, space) [m], `angular_momentum` [kg m2/s], with `_sd`, and revolutions.

        Raises BodyError for a body without masses.
        """
        return state_flight(self.motion, self.body)[0]

    @cached_property
    def jumps(self) -> xr.Dataset:
        """The jumps of players (jump): the columns of jumps.csv; `x` has the 95 % interval `x_low`, `x_high`."""
        return label_jumps(measure_jumps(self.players))

    def plot(self, what: Literal["pose", "joints", "joint_status", "flight"] = "pose") -> Figure:
        """Draw curves over time with bands of two standard deviations, or the status of each joint.

        Of a body its pose, or the angles of its joints, or its flight; of players, as "pose" or "joints", the heights
        of hips, knees and ankles.
        """
        require_choice(what, ("pose", *_FIGURES), "figure")
        if self.has_players:
            require_choice(what, ("pose", "joints"), "figure of players")
            return heights_figure(self.players)
        return pose_figure(self.motion) if what == "pose" else _FIGURES[what](self.motion, self.body)

    @cached_property
    def _motion_and_body(self) -> tuple[Motion, BodyModel]:
        if self.has_players:
            raise ResultError(f"{self.folder} holds a run of players, not of one body; use .players, .joints or .jumps")
        return read_body_run(self.folder)
