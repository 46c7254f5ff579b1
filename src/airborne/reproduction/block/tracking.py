"""One sequence is rendered once; all trackers step over each frame as it comes, and only estimates are stored."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airborne.motion.players import PlayersMotion
from airborne.reproduction.block.plan import PAPER_PARTS, BlockRun
from airborne.synthetic import BlockScene, block_frames, noisy_starts, torso_input, true_joints
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.particle import GivenTorsos, LegsSettings, TorsoTracker, legs_tracker, torso_tracker
from airborne.tracking.players import PlayerEstimate, PlayerStart, PlayersTracker
from airborne.types import Array
from airborne.video import Frames

_TRUE_JOINTS = (*PAPER_PARTS, "foot_left", "foot_right", "torso")
_SEED_STRIDE = 1_000_000  # added to a scene's seed for each seed of a run


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneEstimates:
    """The estimates of all trackers on one sequence."""

    motions: dict[BlockRun, PlayersMotion]
    cpu_s: dict[BlockRun, Array]  # (n,) CPU time of each frame, torso tracking excluded
    torsos: dict[int, Array]  # seed -> (n, blockers, 3) [m] by the torso tracker
    torso_cpu_s: Array  # (n,) mean over the seeds


@dataclass(slots=True, eq=False)
class _TrackerRun:
    """A tracker with its state and estimates so far."""

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
class SharedTorsos:
    """A `TorsoInput` of torsos that are tracked once for several filters: (players, 3) [m] of each frame so far."""

    positions: list[Array]

    def init(self) -> None:
        """Return the state before the first frame: none."""

    def step(self, state: None, frames: Frames) -> tuple[None, Array]:
        """Return the torsos of this frame."""
        return state, self.positions[frames.index]


@dataclass(slots=True, eq=False)
class _TorsoRun:
    """The torso tracker of one seed, with its state so far."""

    tracker: TorsoTracker
    state: Any
    shared: SharedTorsos
    cpu_s: list[float]

    def step(self, frames: Frames) -> None:
        """Track one time."""
        begin_s = time.thread_time()
        self.state, torsos = self.tracker.step(self.state, frames)
        self.cpu_s.append(time.thread_time() - begin_s)
        self.shared.positions.append(torsos)


def track_scene(scene: BlockScene, runs: Sequence[BlockRun], progress: Callable[[], None]) -> SceneEstimates:
    """Render a scene and track it with every run; progress is called after every frame, and may raise to stop."""
    starts = {seed: hand_set_starts(scene, seed) for seed in sorted({run.seed for run in runs})}
    torsos = {seed: _start_torsos(scene, each, seed) for seed, each in starts.items()}
    tracker_runs = {run: _start(_tracker(run, scene, starts[run.seed], torsos[run.seed].shared)) for run in runs}
    for frames in block_frames(scene):
        for each in (*torsos.values(), *tracker_runs.values()):
            each.step(frames)
        progress()
    n_blockers = len(scene.blockers)
    return SceneEstimates(
        motions={run: _motion(each, float(scene.rate)) for run, each in tracker_runs.items()},
        cpu_s={run: np.array(each.cpu_s) for run, each in tracker_runs.items()},
        torsos={seed: np.array(each.shared.positions)[:, :n_blockers] for seed, each in torsos.items()},
        torso_cpu_s=np.mean([each.cpu_s for each in torsos.values()], axis=0),
    )


def hand_set_starts(scene: BlockScene, seed: int) -> list[PlayerStart]:
    """Return the hand-set players of the first frame; seed 0 has the scene's own errors, other seeds draw others."""
    return [PlayerStart(name=name, joints_m=joints) for name, joints in noisy_starts(_with_seed(scene, seed)).items()]


def true_motion(scene: BlockScene) -> PlayersMotion:
    """Return the true legs and torsos of all players, blockers first."""
    joints = [true_joints(player, scene.times_s) for player in scene.players]
    points = np.stack([np.stack([each[name] for name in _TRUE_JOINTS], axis=1) for each in joints], axis=1)
    shape = points.shape[:2]
    return PlayersMotion(
        index=np.arange(scene.n_frames),
        time_s=scene.times_s,
        rate=float(scene.rate),
        players=tuple(player.name for player in scene.players),
        joints=_TRUE_JOINTS,
        points=points,
        covariance=np.broadcast_to(1e-6 * np.eye(3), (*points.shape, 3)),
        joint_status=np.full(points.shape[:3], Status.TRACKED.value),
        score=np.full(shape, np.nan),
        n_views=np.zeros(shape, np.int64),
    )


def _tracker(run: BlockRun, scene: BlockScene, starts: list[PlayerStart], shared: SharedTorsos) -> PlayersTracker:
    if run.method == "blocker":
        return Blocker(starts)
    torso = GivenTorsos(torso_input(_with_seed(scene, run.seed))) if run.torsos == "given" else shared
    settings = LegsSettings(method=run.method, seed=run.seed, n_particles=run.n_particles, swing=run.swing)
    return legs_tracker(settings, scene.calibrated_rig, starts, torso)


def _start(tracker: PlayersTracker) -> _TrackerRun:
    return _TrackerRun(tracker, tracker.init(), [], [])


def _start_torsos(scene: BlockScene, starts: list[PlayerStart], seed: int) -> _TorsoRun:
    tracker = torso_tracker(scene.calibrated_rig, starts, seed)
    return _TorsoRun(tracker, tracker.init(), SharedTorsos([]), [])


def _motion(each: _TrackerRun, rate: float) -> PlayersMotion:
    return PlayersMotion.collect(each.steps, each.tracker.joints, rate)


def _with_seed(scene: BlockScene, seed: int) -> BlockScene:
    """Return the scene with other errors of hand-set joints and given torsos, and the same players."""
    return replace(scene, seed=scene.seed + _SEED_STRIDE * seed)
