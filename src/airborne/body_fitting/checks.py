"""Can a person have a fitted body? Its lengths against the shares of the stature, its joints against the clicks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose, human18
from airborne.body.inverse_kinematics import CORE
from airborne.body.shaping import length_axis, total_mass_kg
from airborne.body_fitting.clothes import stem_of
from airborne.errors import BodyError
from airborne.types import Array

MOST_SHARE, UNUSUAL_SHARE = 0.30, 0.15  # of a length's share of the stature: refused, and warned of, beyond
MOST_OFF_M = 0.06  # RMS of a joint's distance from where it was seen; more is refused
_SUSPECT_OFF_M = 2 * MOST_OFF_M  # of one joint in one frame: warned of
_AVERAGE_M, _AVERAGE_KG, _STATURES = 1.80, 75.0, (0.6, 1.35)  # a person, and how much smaller or taller others are
# of a person's height from the stature's, chosen on two synthetic people: 5 % too small or tall a stature gives 0.05 to
# 0.06, 10 % 0.09 to 0.12, the right one 0.01
_WRONG_HEIGHT = 0.07
_WIDTHS = ("shoulder", "shoulder width", "hip width")  # of an average person these go with the root of the mass
_IN_POUNDS = (0.40, 0.52)  # chosen: shares of a mass about 1 / 2.2046
_SURE_WEIGHT = 1.0  # of a landmark whose place is a joint's; others are seen near by only

WhereToLook = Callable[[Sequence[str]], str]  # points -> which camera's clicks of them to check first, or ""


def person_of_shares(given: BodyModel) -> BodyModel:
    """Return the person of average shares, as tall and heavy as a body; the body itself where it is no `human18`."""
    average = human18(_AVERAGE_M, _AVERAGE_KG)
    if [segment.name for segment in given.segments] != [segment.name for segment in average.segments]:
        return given
    share = float(np.clip(height_ratio(given, average), *_STATURES))
    average_kg = share**3 * _AVERAGE_KG
    mass_kg = total_mass_kg(given) or average_kg
    return human18(share * _AVERAGE_M, float(np.clip(mass_kg, average_kg / 2, average_kg * 2)))


def check_lengths(
    ratios: Mapping[str, float], points: Mapping[str, Sequence[str]], look: WhereToLook, height: float
) -> list[str]:
    """Check segments' lengths, as ratios to the stature's shares by stem; return warnings, a line each.

    `points` are those that a length is measured by; `height` is the person's, relative to the stature's. Raises
    BodyError where a length is beyond MOST_SHARE.
    """
    unusual = {stem: ratio for stem, ratio in ratios.items() if abs(ratio - 1) > UNUSUAL_SHARE}
    wrong = {stem: ratio for stem, ratio in unusual.items() if abs(ratio - 1) > MOST_SHARE}
    causes, left = [], list(wrong or unusual)
    if abs(height - 1) > _WRONG_HEIGHT:
        causes.append(
            f"all of the person is about {height:.2f} times as tall as the stature says: check the stature, and the "
            "calibration's scale and unit"
        )
        left = [stem for stem in left if abs(ratios[stem] / height - 1) > UNUSUAL_SHARE]
    elif "shoulder width" in unusual and set(left) <= set(_WIDTHS):
        share = ratios["shoulder width"] ** 2
        pounds = ", as if it were given in pounds" if _IN_POUNDS[0] < share < _IN_POUNDS[1] else ""
        causes.append(f"widths go with the mass, of which about {share:.2f} would fit{pounds}: check the mass")
    if left:
        named = list(dict.fromkeys(point for stem in left for point in points[stem]))
        causes.append(f"{'then ' if causes else 'check '}the clicks of {', '.join(named)}{look(named)}")
    cause = ", ".join(causes)
    if wrong:
        raise BodyError(
            f"{_list(wrong)} of the length that the stature gives; expected {1 - MOST_SHARE:.2f} to "
            f"{1 + MOST_SHARE:.2f}; {cause}"
        )
    return [f"{_list(unusual)} of the length that the stature gives; {cause}"] if unusual else causes


def check_joints(
    model: BodyModel,
    poses: Sequence[Pose],
    landmarks: Sequence[Mapping[str, Array]],
    *,
    weights: Mapping[str, float],
    frames: Sequence[int],
    look: WhereToLook,
) -> list[str]:
    """Check how far the fitted body's joints lie from where they were seen; return warnings, a line each.

    Raises BodyError where a joint's RMS over the frames is more than MOST_OFF_M.
    """
    names = [mark.name for mark in model.landmarks if weights.get(mark.name, 1.0) >= _SURE_WEIGHT]
    columns = [i for i, mark in enumerate(model.landmarks) if mark.name in names]
    unknown = np.full(3, np.nan)
    seen = np.array([[each.get(name, unknown) for name in names] for each in landmarks])
    posed = np.array([model.with_pose(pose).landmarks[columns] for pose in poses])
    off_m = np.linalg.norm(posed - seen, axis=-1)  # (frames, joints)
    known = np.isfinite(off_m)
    rms_m = np.sqrt(np.where(known, off_m**2, 0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))
    wrong = {name: rms for name, rms in zip(names, rms_m, strict=True) if rms > MOST_OFF_M}
    if wrong:
        worst = max(wrong, key=wrong.__getitem__)
        frame = frames[int(np.nanargmax(off_m[:, names.index(worst)]))]
        listed = ", ".join(f"{name} {rms * 1e3:.0f} mm" for name, rms in wrong.items())
        clicks = f"check the clicks of {worst}, above all in frame {frame}{look([stem_of(worst)])}"
        raise BodyError(
            f"joints of the fitted body lie far from where they were seen: {listed} (RMS over the frames); expected "
            f"{MOST_OFF_M * 1e3:.0f} mm at most; {clicks}"
        )
    return [
        f"{names[joint]} lies {off_m[row, joint] * 1e3:.0f} mm from the fitted body's in frame {frames[row]}; "
        f"check its click{look([stem_of(names[joint])])}"
        for row, joint in np.argwhere(known & (off_m > _SUSPECT_OFF_M))
    ]


def height_ratio(model: BodyModel, reference: BodyModel) -> float:
    """Return how tall a body stands, by its landmarks, relative to another."""
    standing = Pose(world_from_root=RigidTransform.identity())
    own, other = (np.ptp(body.with_pose(standing).landmarks[:, 2]) for body in (model, reference))
    return float(own / other)


def length_ratios(model: BodyModel, reference: BodyModel) -> dict[str, float]:
    """Return the lengths of a body's segments relative to another's, by stem."""
    ratios = {}
    for segment in model.segments:
        own, other = (_length_m(body, segment.name) for body in (model, reference))
        if segment.parts and own > 0 and other > 0:
            ratios.setdefault(stem_of(segment.name), own / other)
    widths = joint_widths_m(model), joint_widths_m(reference)
    return ratios | {f"{joint} width": own / widths[1][joint] for joint, own in widths[0].items() if joint in widths[1]}


def joint_widths_m(model: BodyModel) -> dict[str, float]:
    """Return how far apart the hips are, and the shoulders, in the zero pose [m]."""
    posed = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    at = {mark.name: position for mark, position in zip(model.landmarks, posed.landmarks, strict=True)}
    return {
        joint: float(np.linalg.norm(at[f"{joint}_left"] - at[f"{joint}_right"]))
        for joint in ("hip", "shoulder")
        if {f"{joint}_left", f"{joint}_right"} <= set(at)
    }


def points_of_lengths(model: BodyModel) -> dict[str, list[str]]:
    """Return the landmarks, without their sides, that each segment's length is measured by, by stem."""
    points = {}
    for segment in model.segments:
        children = [each.name for each in model.segments if each.parent == segment.name]
        at_ends = [
            stem_of(mark.name)
            for mark in model.landmarks
            if mark.segment == segment.name or (mark.segment in children and mark.at_joint)
        ]
        is_limb = segment.name.endswith(("_left", "_right")) and len(at_ends) > 1
        ends = at_ends if is_limb or not children else map(stem_of, CORE)  # the trunk is measured as a whole
        points[stem_of(segment.name)] = [point for point in dict.fromkeys(ends) if point != "neck"]
    return points | {f"{joint} width": [joint] for joint in joint_widths_m(model)}


def _length_m(model: BodyModel, name: str) -> float:
    """Return how far a segment's farthest joint or landmark lies along its length [m]."""
    along = length_axis(model, name)
    ends = [child.joint_m for child in model.segments if child.parent == name]
    ends += [mark.position_m for mark in model.landmarks if mark.segment == name]
    return max((abs(float(end[along])) for end in ends), default=0.0)


def _list(ratios: Mapping[str, float]) -> str:
    return ", ".join(f"{stem} {ratio:.2f}" for stem, ratio in ratios.items())
