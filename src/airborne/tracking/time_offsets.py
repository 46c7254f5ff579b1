"""Cameras that are not locked to each other: views taken a little later than the others, seen as if taken with them.

A view that is late by s shows the body where it will be s later. That is the picture which a camera moved the other way
would have taken in time: its camera_from_world is followed by the body's own motion over s. Exact for a body in one
piece; of a person, limbs are taken to move with the root.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.body.chain import motion_between
from airborne.tracking.estimate import Estimate
from airborne.tracking.tracker import Tracker
from airborne.video import Frames, View

Array = NDArray[np.floating]
Past = tuple[tuple[Fraction, Pose], ...]  # oldest first

IN_TIME_S = 1e-5  # nothing that is filmed moves by a pixel in so little
_NEARLY_S = 2e-3  # in so little it moves a centimetre: good enough until its motion is known
_REMEMBERED = 5


@dataclass(frozen=True, slots=True)
class InTimeState:
    """What the next frame needs."""

    inner: Any
    past: Past = ()  # the last poses found


class InTime:
    """Any tracker, given every view as if taken at the frames' own time.

    Frames with late views are searched twice: with the motion up to now, then with the motion that the first pose found
    ends. Until two poses are known, views later than 2 ms are left out, if others are left.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker

    def init(self) -> InTimeState:
        """Return the state before the first frame."""
        return InTimeState(self._tracker.init())

    def search(self, state: InTimeState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        seen = in_time(frames, state.past, degree=1)
        estimate = self._tracker.search(state.inner, seen)
        if seen is frames or estimate.pose is None or not state.past:
            return estimate
        return self._tracker.search(state.inner, in_time(frames, _longer(state.past, frames, estimate.pose)))

    def learn(self, state: InTimeState, frames: Frames, estimate: Estimate) -> InTimeState:
        """Return the state after the frames, given where the body was found."""
        past = state.past if estimate.pose is None else _longer(state.past, frames, estimate.pose)
        return InTimeState(self._tracker.learn(state.inner, in_time(frames, past), estimate), past)


def in_time(frames: Frames, past: Past, degree: int = 2) -> Frames:
    """Move the cameras of late views as the last poses move; leave frames alone that are in time.

    The poses are followed by polynomials of time, of at most the given degree.
    """
    late_s = [0.0 if view is None else abs(view.late_s) for view in frames.views]
    if max(late_s) < IN_TIME_S:
        return frames
    if len(past) > 1:
        return replace(frames, views=tuple(view and _moved(view, frames.time_s, past, degree) for view in frames.views))
    prompt = [view if late < _NEARLY_S else None for view, late in zip(frames.views, late_s, strict=True)]
    return replace(frames, views=tuple(prompt)) if any(prompt) else frames


def carried(frames: Frames, velocity_m_s: Array) -> Frames:
    """Move the cameras of late views as a body moves that goes at a velocity (3,) [m/s] and does not turn."""
    if all(view is None or abs(view.late_s) < IN_TIME_S for view in frames.views):
        return frames

    def moved(view: View) -> View:
        ahead = RigidTransform.from_translation(view.late_s * velocity_m_s)
        return replace(view, camera=replace(view.camera, camera_from_world=view.camera.camera_from_world * ahead))

    return replace(frames, views=tuple(view and moved(view) for view in frames.views))


def _longer(past: Past, frames: Frames, pose: Pose) -> Past:
    return (*past, (frames.time_s, pose))[-_REMEMBERED:]


def _moved(view: View, time_s: Fraction, past: Past, degree: int) -> View:
    """Move a view's camera by the body's motion between the frames' time and the picture's."""
    if abs(view.late_s) < IN_TIME_S:
        return view
    (last_s, last), ago_s = past[-1], np.array([float(each - past[-1][0]) for each, _ in past])
    motions = np.stack([motion_between(last, pose)[:6] for _, pose in past])
    curve = np.polynomial.polynomial.polyfit(ago_s, motions, min(degree, len(past) - 1))
    ahead_s = float(time_s - last_s)
    now, then = (_placed(last, np.polynomial.polynomial.polyval(s, curve)) for s in (ahead_s, ahead_s + view.late_s))
    camera = replace(view.camera, camera_from_world=view.camera.camera_from_world * then * now.inv())
    return replace(view, camera=camera)


def _placed(pose: Pose, motion: Any) -> RigidTransform:
    root = pose.world_from_root
    return RigidTransform.from_components(
        root.translation + motion[:3], Rotation.from_rotvec(motion[3:6]) * root.rotation
    )
