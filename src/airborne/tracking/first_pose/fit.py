"""The first pose of a body from angles, from positions of its landmarks, or from points in the cameras' images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose
from airborne.body.inverse_kinematics import fit_pose
from airborne.cameras import Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.detections import Detections, landmarks_from_points
from airborne.cameras.skeletons import LANDMARK_RECIPES, SKELETONS
from airborne.errors import BodyError, TrialError
from airborne.geometry.rotations import matrix_from_angles
from airborne.tracking.first_pose.body_size import WrongSize, find_wrong_size
from airborne.tracking.first_pose.click_mix_up import explain_misses
from airborne.tracking.first_pose.exchange import find_ambiguity, find_exchange
from airborne.types import Array

_ROUNDING_RAD = 1e-9  # an angle beyond its limit by less is at it
LEAST_VISIBILITY = 0.3  # detections with a lower confidence are ignored
LANDMARK_WEIGHTS = {  # of points that only lie near the landmark they stand for
    "head": 0.1,
    **dict.fromkeys(("hand_left", "hand_right", "foot_left", "foot_right"), 0.3),
}

_DOUBTFUL_RMS_M = 0.05  # chosen: good starts of two recorded people left 22 to 39 mm, a stature 11 % too small 59 mm
_FARTHEST_M = (
    0.31  # chosen as `body_fitting.landmark_places` has it of the head: no definition of a point is farther off
)


@dataclass(frozen=True, slots=True, eq=False)
class FirstPose:
    """The body's pose at the first frame."""

    pose: Pose
    notes: tuple[str, ...] = ()  # what the user should know, one line each
    doubts: tuple[str, ...] = ()  # those of the notes that say what may be wrong
    mistakes: tuple[str, ...] = ()  # points that cannot be right
    points: Mapping[str, Array] = field(default_factory=dict)  # landmark -> (3,) world [m], those that were given
    wrong_size: WrongSize | None = None  # of the body, by the points
    exchange: str = ""  # what says that left and right of the body, its legs or its arms are exchanged
    ambiguity: str = ""  # what says that the points do not tell which way the body faces

    @property
    def plain_notes(self) -> tuple[str, ...]:
        """The notes that are no doubts."""
        return tuple(note for note in self.notes if note not in self.doubts)

    @property
    def size_notes(self) -> tuple[str, ...]:
        """What says that the body is larger or smaller than the points, which the self-check of a run says too."""
        return () if self.wrong_size is None else (self.wrong_size.sentence,)


def pose_by_hand(
    model: BodyModel,
    world_from_root: RigidTransform,
    joint_angles_deg: Mapping[str, Sequence[float]],
    where: str = "start",
) -> FirstPose:
    """Return a pose set by hand: segment -> x, y, z [deg], other joints straight. Raises TrialError."""
    joints = [segment.name for segment in model.segments[1:]]
    angles = np.zeros((len(joints), 3))
    for name, xyz in joint_angles_deg.items():
        if name not in joints:
            raise TrialError(
                f"{where}.joint_angles_deg: body '{model.name}' has no joint '{name}'; "
                f"it has: {', '.join(joints) or 'none'}"
            )
        angles[joints.index(name)] = np.radians(xyz)
    is_out = np.any(np.abs(model.limits.excess(matrix_from_angles(angles))) > _ROUNDING_RAD, axis=1)
    beyond = [name for name, out in zip(joints, is_out, strict=True) if out and name in joint_angles_deg]
    note = f"{where}: {', '.join(beyond)} beyond the body's joint limits, within which the fit draws it"
    return FirstPose(Pose(world_from_root=world_from_root, joint_angles=angles), (note,) if beyond else ())


def fit_to_detections(model: BodyModel, rig: Rig, where: str, detections: Detections) -> FirstPose:
    """Fit to detections at one time, their only row; those of low confidence count as not seen. Raises TrialError."""
    confident = detections.above_visibility(LEAST_VISIBILITY)
    first = fit_to_pixels(
        model, rig, where, names=confident.points, px=confident.px[0], weights=confident.visibility[0]
    )
    return replace(first, notes=(*detections.notes, *first.notes))


def fit_to_pixels(
    model: BodyModel, rig: Rig, where: str, *, names: Sequence[str], px: Array, weights: Array
) -> FirstPose:
    """Fit to image points: px (points, cameras, 2) [px], NaN where missing; weights (points, cameras)."""
    needed = _points_to_find(model, where, names)
    names = [names[i] for i in needed]
    agreed = triangulate_consensus(rig, px[needed], weights[needed])
    is_left_out = np.isfinite(agreed.distance_px) & ~agreed.is_used & (weights[needed] > 0)
    left_out = [
        f"{where}: {camera} left out at {', '.join(name for name, is_out in zip(names, out, strict=True) if is_out)}, "
        f"up to {distance_px[out].max():.0f} px from where the other cameras see them"
        for camera, out, distance_px in zip(rig.names, is_left_out.T, agreed.distance_px.T, strict=True)
        if out.any()
    ]
    why = explain_misses(rig, px[needed], weights[needed])
    said = (f"{where}: {why}",) if why else ()
    try:
        first = fit_to_points(model, where, names, agreed.points)
    except TrialError as error:
        raise TrialError(said[0] if said else str(error)) from error
    return replace(first, notes=(*said, *left_out, *first.notes), doubts=(*said, *first.doubts))


def fit_to_points(model: BodyModel, where: str, names: Sequence[str], points: Array) -> FirstPose:
    """Fit to points (points, 3) [m] of these names."""
    needed = _points_to_find(model, where, names)
    landmarks = landmarks_from_points([names[i] for i in needed], points[needed])
    targets = {landmark.name: landmarks[landmark.name] for landmark in model.landmarks if landmark.name in landmarks}
    try:
        fit = fit_pose(model, targets, weights=LANDMARK_WEIGHTS)
    except BodyError as error:
        raise TrialError(f"{where}: {error}") from error
    off_m = {name: distance for name, distance in fit.residual_m.items() if np.isfinite(distance)}
    worst = max(off_m, key=off_m.__getitem__)
    missing = ", ".join(name for name, point in targets.items() if np.isnan(point).any())
    given = {name: point for name, point in targets.items() if np.isfinite(point).all()}
    found = find_exchange(model, given, LANDMARK_WEIGHTS, fit)
    exchange = f"{where}: {found.sentence}" if found else ""
    either_way = "" if found else find_ambiguity(model, given, LANDMARK_WEIGHTS, fit)
    ambiguity = f"{where}: {either_way}" if either_way else ""
    wrong_size = None if found else find_wrong_size(model, given, LANDMARK_WEIGHTS, fit)
    doubt = "; check the points and the body's size" if fit.rms_m > _DOUBTFUL_RMS_M else ""
    mistakes = [
        f"{where}: {name} lies {distance:.1f} m from where the body can have it; correct it, or the body's size"
        for name, distance in off_m.items()
        if distance > max(_FARTHEST_M, off_m[worst] / 2)  # one that is far off draws others along
    ]
    notes = [
        f"{where}: first pose found; landmarks are {fit.rms_m * 1e3:.0f} mm off (RMS), "
        f"the largest is {worst} with {off_m[worst] * 1e3:.0f} mm{doubt}",
        f"{where}: no place of {missing}; there the first pose is as near to straight as it can be" if missing else "",
        exchange,
        ambiguity,
    ]
    doubts = [note for note, is_doubt in zip(notes, (doubt, "", exchange, ""), strict=True) if is_doubt]
    said = tuple(note for note in notes if note)
    return FirstPose(fit.pose, said, tuple(doubts), tuple(mistakes), given, wrong_size, exchange, ambiguity)


def check_landmark_names(model: BodyModel, where: str, names: Sequence[str]) -> None:
    """Raise TrialError for a name that is neither a landmark of the body nor, of one with joints, a network's point."""
    landmarks = [landmark.name for landmark in model.landmarks]
    of_networks = {*chain.from_iterable(skeleton.points for skeleton in SKELETONS.values())}
    known = {*landmarks, *of_networks} if model.has_joints else {*landmarks}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise TrialError(
            f"{where}: body '{model.name}' has no landmark {', '.join(unknown)}; it has: {', '.join(landmarks)}"
        )


def _points_to_find(model: BodyModel, where: str, names: Sequence[str]) -> list[int]:
    """Return which points determine landmarks of the body; raises TrialError for an unknown name."""
    check_landmark_names(model, where, names)
    landmarks = [landmark.name for landmark in model.landmarks]
    recipes = chain.from_iterable(LANDMARK_RECIPES[landmark] for landmark in landmarks if landmark in LANDMARK_RECIPES)
    parts = {*landmarks, *chain.from_iterable(recipes)}
    return [i for i, name in enumerate(names) if name in parts]
