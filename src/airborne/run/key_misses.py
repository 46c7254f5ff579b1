"""How near a tracked body is to what a person said of it: in keys, set by hand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.body.chain import delta_between
from airborne.cameras import Rig
from airborne.motion import Motion
from airborne.run.keys import read_key
from airborne.tracking.evidence import PoseEvidence
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable
from airborne.trial.pose_forms import BY_HAND

_FAR_SDS = 4.0  # chosen, one sd an axis: of twenty points in the plane, normal errors put one farther once in 150 times


class KeyMiss(NamedTuple):
    """How far a pose is from a part of a key."""

    sds: float
    words: str

    @property
    def is_far(self) -> bool:
        """Whether it is too far for chance."""
        return self.sds > _FAR_SDS

    @property
    def advice(self) -> str:
        """What to do where it is too far for chance."""
        advice = ", as the pictures say otherwise: correct it in another camera too, or remove it"
        return advice if self.is_far else ""


def far_keys(trial: Trial, model: BodyModel, motion: Motion, rig: Rig) -> list[str]:
    """Return a sentence for each key by hand from which the tracked body is farther than chance takes it."""
    rows = {int(index): row for row, index in enumerate(motion.index) if motion.has_pose[row]}
    poses = [(key, motion.pose(rows[key.frame])) for key in trial.key if key.frame in rows]
    misses = [(key.frame, miss_by_hand(trial, key, model, pose, rig=rig)) for key, pose in poses]
    return [
        f"[[key]] of frame {frame}: {far.words}{far.advice}" for frame, far in misses if far is not None and far.is_far
    ]


def miss_by_hand(trial: Trial, key: KeyTable, model: BodyModel, pose: Pose, *, rig: Rig) -> KeyMiss | None:
    """Return how far a pose is from what was set by hand in a key, where it is farthest; None where nothing was."""
    if not key.model_fields_set & (BY_HAND | {"joints_m", "points_px"}):
        return None
    own = key.model_copy(update={"detections": None})
    return _farthest(read_key(trial, own, model, rig=rig, facts=()), pose, rig)


def _farthest(key: PoseEvidence, pose: Pose, rig: Rig) -> KeyMiss:
    """Return the part of a key from which a pose is farthest, in deviations."""
    points, found = key.model.with_pose(pose).landmarks, list[KeyMiss]()
    names = [_plain(landmark.name) for landmark in key.model.landmarks]
    for mark, P, px, sd_px in zip(key.clicked, key.P, key.px, key.px_sds, strict=True):
        camera = rig.cameras[int(np.flatnonzero((rig.P == P).all(axis=(1, 2)))[0])]
        off_px = float(np.linalg.norm(camera.undistort_px(camera.px_from_world(points[mark])) - px))
        found.append(_miss(f"the {names[mark]} is", off_px, "px", sd=sd_px, than=f"from its click in {camera.name}"))
    for mark, position, sd_m in zip(key.landmarks, key.positions, key.position_sds, strict=True):
        off_m = float(np.linalg.norm(points[mark] - position))
        found.append(_miss(f"the {names[mark]} is", 1e3 * off_m, "mm", sd=1e3 * sd_m, than="from its place in the key"))
    if key.pose is not None:
        delta = delta_between(key.pose, pose)
        if np.isfinite(key.pose_sds[0]):
            off_m, sd_m = float(np.linalg.norm(delta[:3])), key.pose_sds[0]
            found.append(_miss("the body is", 1e3 * off_m, "mm", sd=1e3 * sd_m, than="from its place in the key"))
        turns = np.degrees(np.linalg.norm(delta[3:].reshape(-1, 3), axis=1))
        for part, (turn, sd) in enumerate(zip(turns, np.degrees(key.pose_sds[3::3]), strict=True)):
            if np.isfinite(sd):
                what = "body" if part == 0 else _plain(key.model.segments[part].name)
                found.append(_miss(f"the {what} is turned", float(turn), "°", sd=sd, than="from its key"))
    return max(found, key=lambda each: each.sds)


def _miss(what: str, off: float, unit: str, *, sd: float, than: str) -> KeyMiss:
    space = "" if unit == "°" else " "
    return KeyMiss(off / sd, f"{what} {off:.1f}{space}{unit} {than} ({off / sd:.1f} sd)")


def _plain(name: str) -> str:
    """Return a part's name in words: left knee."""
    words = name.split("_")
    return " ".join([words[-1], *words[:-1]] if words[-1] in ("left", "right") else words)
