"""One sequence is recorded once; all trackers step over each frame as it comes, and nothing is kept but estimates."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.motion.players import PlayersMotion
from airborne.reproduction.block.plan import PARTS, Run
from airborne.synthetic import BlockScene, frames_of, joints_of, starts_of, torso_input
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.particle import GivenTorsos, LegsSettings, TorsoTracker, legs_tracker, torso_tracker
from airborne.tracking.players import PlayerEstimate, PlayerStart, PlayersTracker
from airborne.video import Frames

Array = NDArray[np.floating]

TRUE_JOINTS = (*PARTS, "foot_left", "foot_right", "torso")
_RESEEDED = 1_000_000  # added to a scene's seed for each seed of a run


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tracked:
    """What trackers made of one sequence."""

    motions: dict[Run, PlayersMotion]
    cpu_s: dict[Run, Array]  # (n,) time of this thread for each frame; with tracked torsos without them
    torsos: dict[int, Array]  # seed -> (n, blockers, 3) [m] as the torso tracker has them
    torso_cpu_s: Array  # (n,) mean over the seeds


@dataclass(slots=True, eq=False)
class _Stepped:
    """A tracker on its way."""

    tracker: PlayersTracker
    state: Any
    steps: list[tuple[PlayerEstimate, ...]]
    cpu_s: list[float]

    def step(self, frames: Frames) -> None:
        """Track one time."""
        begin_s = time.thread_time()
        self.state, estimates = self.tracker.step(self.state, frames)
        self.cpu_s.append(time.thread_time() - begin_s)
        self.steps.append(estimates)


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """A `TorsoInput` of torsos that are tracked once for several filters: (players, 3) [m] of each frame so far."""

    places: list[Array]

    def init(self) -> None:
        """Return the state before the first frame: none."""

    def step(self, state: None, frames: Frames) -> tuple[None, Array]:
        """Return the torsos of this frame."""
        return state, self.places[frames.index]


@dataclass(slots=True, eq=False)
class _Torsos:
    """The torso tracker of one seed on its way."""

    tracker: TorsoTracker
    state: Any
    told: Told
    cpu_s: list[float]

    def step(self, frames: Frames) -> None:
        """Track one time."""
        begin_s = time.thread_time()
        self.state, places = self.tracker.step(self.state, frames)
        self.cpu_s.append(time.thread_time() - begin_s)
        self.told.places.append(places)


def track_scene(scene: BlockScene, runs: Sequence[Run], progress: Callable[[], None]) -> Tracked:
    """Record a scene and track it with every run; progress is called after every frame, and may raise to stop."""
    starts = {seed: hand_set(scene, seed) for seed in sorted({run.seed for run in runs})}
    torsos = {seed: _torsos(scene, each, seed) for seed, each in starts.items()}
    stepped = {run: _started(_tracker(run, scene, starts[run.seed], torsos[run.seed].told)) for run in runs}
    for frames in frames_of(scene):
        for each in (*torsos.values(), *stepped.values()):
            each.step(frames)
        progress()
    n_blockers = len(scene.blockers)
    return Tracked(
        motions={run: _motion(each, float(scene.rate)) for run, each in stepped.items()},
        cpu_s={run: np.array(each.cpu_s) for run, each in stepped.items()},
        torsos={seed: np.array(each.told.places)[:, :n_blockers] for seed, each in torsos.items()},
        torso_cpu_s=np.mean([each.cpu_s for each in torsos.values()], axis=0),
    )


def hand_set(scene: BlockScene, seed: int) -> list[PlayerStart]:
    """Return the players as set by hand in the first frame; seed 0 is the scene's own, others have other errors."""
    return [PlayerStart(name=name, joints_m=joints) for name, joints in starts_of(_reseeded(scene, seed)).items()]


def true_motion(scene: BlockScene) -> PlayersMotion:
    """Return where the legs and torsos of all players are, blockers first."""
    joints = [joints_of(player, scene.times_s) for player in scene.players]
    points = np.stack([np.stack([each[name] for name in TRUE_JOINTS], axis=1) for each in joints], axis=1)
    shape = points.shape[:2]
    return PlayersMotion(
        index=np.arange(scene.n_frames),
        time_s=scene.times_s,
        rate=float(scene.rate),
        players=tuple(player.name for player in scene.players),
        joints=TRUE_JOINTS,
        points=points,
        covariance=np.broadcast_to(1e-6 * np.eye(3), (*points.shape, 3)),
        status=np.full(shape, Status.TRACKED.value),
        score=np.full(shape, np.nan),
        n_views=np.zeros(shape, np.int64),
    )


def _tracker(run: Run, scene: BlockScene, starts: list[PlayerStart], told: Told) -> PlayersTracker:
    if run.method == "blocker":
        return Blocker(starts)
    given = run.torsos == "given"
    torso = GivenTorsos(torso_input(_reseeded(scene, run.seed))) if given else told
    settings = LegsSettings(method=run.method, seed=run.seed, n_particles=run.n_particles, swing=run.swing)
    return legs_tracker(settings, scene.calibrated, starts, torso)


def _started(tracker: PlayersTracker) -> _Stepped:
    return _Stepped(tracker, tracker.init(), [], [])


def _torsos(scene: BlockScene, starts: list[PlayerStart], seed: int) -> _Torsos:
    tracker = torso_tracker(scene.calibrated, starts, seed)
    return _Torsos(tracker, tracker.init(), Told([]), [])


def _motion(each: _Stepped, rate: float) -> PlayersMotion:
    return PlayersMotion.collect(each.steps, each.tracker.joints, rate)


def _reseeded(scene: BlockScene, seed: int) -> BlockScene:
    """Return the scene with other errors of what is told by hand or by another tracker; its players stay."""
    return replace(scene, seed=scene.seed + _RESEEDED * seed)
