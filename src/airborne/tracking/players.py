"""The estimates of several players at one time, the protocol of their trackers, and these as a `Tracker`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple, Protocol

import numpy as np

from airborne.body.legs import LEG_POINTS
from airborne.tracking.estimate import Status, worst_status
from airborne.types import Array
from airborne.video import Frames


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlayerStart:
    """Where a player is at the first frame, set by hand: joint -> (3,) [m]. A bystander has a torso only."""

    name: str
    joints_m: dict[str, Array]

    @property
    def has_legs(self) -> bool:
        """Whether the player is tracked, and no bystander."""
        return set(self.joints_m) != {"torso"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlayerEstimate:
    """One player's joints at one time, in the order of the tracker's `joints`; NaN where unknown."""

    player: str
    index: int
    time_s: Fraction
    joint_status: tuple[Status, ...]  # of each joint
    points: Array  # (joints, 3) [m], world
    covariance: Array  # (joints, 3, 3) [m²], of each joint for itself
    score: float  # mean log-likelihood of the estimate [nat]; NaN when lost
    n_views: int  # cameras that were used and in which the player was not occluded
    note: str = ""  # what the user should know of this time, in one line

    @property
    def status(self) -> Status:
        """The worst of hips, knees and ankles, which every tracker's joints begin with."""
        return worst_status(self.joint_status[: len(LEG_POINTS)])


def lost_player_estimate(player: str, frames: Frames, n_joints: int) -> PlayerEstimate:
    """Return the estimate of a player who was not found."""
    return PlayerEstimate(
        player=player,
        index=frames.index,
        time_s=frames.time_s,
        joint_status=(Status.LOST,) * n_joints,
        points=np.full((n_joints, 3), np.nan),
        covariance=np.full((n_joints, 3, 3), np.nan),
        score=np.nan,
        n_views=0,
    )


def _doubt(estimate: PlayerEstimate) -> PlayerEstimate:
    """Return an estimate of which no joint is tracked."""
    status = tuple(worst_status([each, Status.UNCERTAIN]) for each in estimate.joint_status)
    return replace(estimate, joint_status=status)


class PlayersTracker(Protocol):
    """Tracks all its players together. Everything random comes from a seed, so that a run can be repeated."""

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints of every estimate."""
        ...

    def init(self) -> Any:
        """Return the state before the first frame."""
        ...

    def step(self, state: Any, frames: Frames) -> tuple[Any, tuple[PlayerEstimate, ...]]:
        """Track one time; one estimate for each player with legs, in the order of the start."""
        ...


class PlayersStep(NamedTuple):
    """One time's step of a players' tracker: what it found, and its state after it, which no table holds."""

    state: Any
    players: tuple[PlayerEstimate, ...]


@dataclass(frozen=True, slots=True)
class StepTracker:
    """A players' tracker, which searches and learns at once, as a `Tracker`."""

    tracker: PlayersTracker
    is_slow: bool = False  # the images come so rarely that legs may be lost between them: no joint is tracked

    def init(self) -> Any:
        """Return the state before the first frame."""
        return self.tracker.init()

    def search(self, state: Any, frames: Frames) -> PlayersStep:
        """Take the step."""
        step = PlayersStep(*self.tracker.step(state, frames))
        return step._replace(players=tuple(map(_doubt, step.players))) if self.is_slow else step

    def learn(self, state: Any, frames: Frames, estimate: PlayersStep) -> Any:
        """Return the state after the step."""
        return estimate.state
