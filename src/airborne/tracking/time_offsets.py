"""Time-offset compensation, for cameras that are not genlocked: views taken a little later are used as if in time.

A view that is late by s shows the body where it will be s later. A camera moved the other way would have taken
the same image in time: its camera_from_world is composed with the body's own motion over s. Exact for a rigid body; a
person's limbs are assumed to move with the root.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.body.chain import delta_between
from airborne.tracking.estimate import Estimate
from airborne.tracking.model_based.image_evidence import ImageEvidence
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.predictors import PoseHistory, turn_past
from airborne.types import Array
from airborne.video import Frames, View

_NEGLIGIBLE_S = 1e-5  # [s] in which nothing that is filmed moves by a pixel
_TOLERABLE_S = 2e-3  # [s] in which it moves a centimetre: accurate enough until its motion is known
_HISTORY = 5  # poses from which the motion within a frame is taken


@dataclass(frozen=True, slots=True)
class CompensatedState:
    """What the next frame needs."""

    inner: Any
    past: PoseHistory = ()  # the last estimated poses


class CompensatedTracker:
    """Any tracker, with the time offsets of its views compensated.

    Frames with late views are searched twice: with the motion up to now, then with the motion that ends in the first
    search's pose. Before there are two poses, views later than 2 ms are left out, if others remain.
    """

    def __init__(self, tracker: Any) -> None:
        self._tracker = tracker

    @property
    def moves_joints(self) -> bool:
        """Whether limbs are tracked, which may be lost."""
        return bool(getattr(self._tracker, "moves_joints", False))

    def init(self) -> CompensatedState:
        """Return the state before the first frame."""
        return CompensatedState(self._tracker.init())

    def search(self, state: CompensatedState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        compensated = compensate_offsets(frames, state.past, degree=1)
        estimate = self._tracker.search(state.inner, compensated)
        if compensated is frames or estimate.pose is None or not state.past:
            return estimate
        return self._tracker.search(state.inner, compensate_offsets(frames, _extend(state.past, frames, estimate.pose)))

    def learn(self, state: CompensatedState, frames: Frames, estimate: Estimate) -> CompensatedState:
        """Return the state after the frames, given their estimate."""
        past = state.past if estimate.pose is None else _extend(state.past, frames, estimate.pose)
        return CompensatedState(self._tracker.learn(state.inner, compensate_offsets(frames, past), estimate), past)

    def turn(self, state: CompensatedState, forward: Mapping[int, Estimate]) -> CompensatedState:
        """Return the state from which the body is tracked back in time, after the estimates `forward` by frame."""
        return CompensatedState(self._tracker.turn(state.inner, forward), turn_past(state.past))

    def weigh(self, state: CompensatedState, frames: Frames, poses: Sequence[Pose]) -> Array:
        """Return minus the log-likelihood of the images in each of several poses: (n,) [nat]."""
        return self._tracker.weigh(state.inner, compensate_offsets(frames, state.past), poses)

    def reduce_frames(self, frames: Frames) -> Frames:
        """Reduce the images of a body whose joints move, as they are looked at."""
        return self._tracker.reduce_frames(frames)

    def assess(self, state: CompensatedState, frames: Frames, past: PoseHistory) -> Estimate:
        """Return what the images say of the newest of the poses in `past`, which those of other times confirm."""
        return self._tracker.assess(state.inner, compensate_offsets(frames, past[-_HISTORY:]), past[-1][1])

    def linearise(
        self,
        state: CompensatedState,
        frames: Frames,
        past: PoseHistory,
        misfit: float | None = None,
        *,
        surface: RenderModel | None = None,
        shown: NDArray[np.bool_] | None = None,
    ) -> ImageEvidence:
        """Return what the images say about the newest of the poses in `past`, which is that of the frames."""
        compensated = compensate_offsets(frames, past[-_HISTORY:])
        return self._tracker.linearise(state.inner, compensated, past[-1][1], misfit, surface=surface, shown=shown)


def compensate_offsets(frames: Frames, past: PoseHistory, degree: int = 2) -> Frames:
    """Move the cameras of late views by the body's last motion; frames in time are returned as they are.

    The motion is a polynomial of time through the poses, of at most the given degree.
    """
    delay_s = [0.0 if view is None else abs(view.delay_s) for view in frames.views]
    if max(delay_s) < _NEGLIGIBLE_S:
        return frames
    if len(past) > 1:
        views = (view and _compensate_view(view, frames.time_s, past, degree) for view in frames.views)
        return replace(frames, views=tuple(views))
    prompt = [view if late < _TOLERABLE_S else None for view, late in zip(frames.views, delay_s, strict=True)]
    return replace(frames, views=tuple(prompt)) if any(prompt) else frames


def compensate_at_velocity(frames: Frames, velocity_m_s: Array) -> Frames:
    """Move the cameras of late views by the motion of a body with velocity (3,) [m/s] that does not rotate."""
    if all(view is None or abs(view.delay_s) < _NEGLIGIBLE_S for view in frames.views):
        return frames

    def compensate(view: View) -> View:
        ahead = RigidTransform.from_translation(view.delay_s * velocity_m_s)
        return replace(view, camera=replace(view.camera, camera_from_world=view.camera.camera_from_world * ahead))

    return replace(frames, views=tuple(view and compensate(view) for view in frames.views))


def _extend(past: PoseHistory, frames: Frames, pose: Pose) -> PoseHistory:
    return (*past, (frames.time_s, pose))[-_HISTORY:]


def _compensate_view(view: View, time_s: Fraction, past: PoseHistory, degree: int) -> View:
    """Move a view's camera by the body's motion between the frames' time and the view's."""
    if abs(view.delay_s) < _NEGLIGIBLE_S:
        return view
    (last_s, last), ago_s = past[-1], np.array([float(each - past[-1][0]) for each, _ in past])
    deltas = np.stack([delta_between(last, pose)[:6] for _, pose in past])
    curve = np.polynomial.polynomial.polyfit(ago_s, deltas, min(degree, len(past) - 1))
    ahead_s = float(time_s - last_s)
    now, then = (
        _world_from_moved_root(last, np.polynomial.polynomial.polyval(s, curve))
        for s in (ahead_s, ahead_s + view.delay_s)
    )
    camera = replace(view.camera, camera_from_world=view.camera.camera_from_world * then * now.inv())
    return replace(view, camera=camera)


def _world_from_moved_root(pose: Pose, delta: Any) -> RigidTransform:
    root = pose.world_from_root
    return RigidTransform.from_components(
        root.translation + delta[:3], Rotation.from_rotvec(delta[3:6]) * root.rotation
    )
