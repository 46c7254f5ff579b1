"""The preset `human18`: 18 segments after paper B, sizes and masses after Yeadon (1990-II).

Zero pose: upright, arms hanging with the palms toward the thighs, soles level, toes toward -y. Joint angles are
successive rotations about the segment's x, y and z axes (Yeadon 1990-I). With x to the left, y backward, z headward:

- flexion: trunk and neck forward +x; hip -x, knee +x, ankle (plantar) +x; shoulder -x, elbow -x
- sideways: the left thigh and arm go outward with -y, the right ones with +y; the left wrist flexes (to the thigh) +y
- axial rotation: the left thigh and arm outward with +z, the right ones with -z; trunk and head to the left with +z

Yeadon's configuration angles are the same numbers at the same joints (pelvis - thorax: torso; thorax - chest: chest);
his palms and toes point in other directions, which is 90 degrees of z at our forearm and 68 of x at our ankle.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np

from airborne.body.anthropometry import FOOT_SLOPE_RAD, measurements_of, segment_properties, sternoclavicular_m
from airborne.body.limits import FREE, JointLimits
from airborne.body.measurements import Measurements, check_measurements, read_measurements
from airborne.body.model import BodyModel, Ellipsoid, Landmark, Segment
from airborne.body.outfits import ATHLETE, Outfit
from airborne.body.stadia import SolidProperties
from airborne.geometry.rotations import matrix_from_angles
from airborne.types import Array

PARENTS = {
    "pelvis": None,
    "torso": "pelvis",
    "chest": "torso",
    "head": "chest",
    "shoulder_left": "chest",
    "upper_arm_left": "shoulder_left",
    "forearm_left": "upper_arm_left",
    "hand_left": "forearm_left",
    "shoulder_right": "chest",
    "upper_arm_right": "shoulder_right",
    "forearm_right": "upper_arm_right",
    "hand_right": "forearm_right",
    "thigh_left": "pelvis",
    "shank_left": "thigh_left",
    "foot_left": "shank_left",
    "thigh_right": "pelvis",
    "shank_right": "thigh_right",
    "foot_right": "shank_right",
}
# Limits of the middle and the left [deg], see `JointLimits`: the centre as x-y-z angles, then how far the segment
# swings about the centre's x and y and twists about its z, to either side; the right mirrors y and z. Hip, knee, ankle,
# shoulder and elbow hold the ranges of healthy adults (AAOS, Joint Motion, 1965; Norkin & White, Measurement of Joint
# Motion): hip flexion 120 and extension 30, abduction 45, rotation 45 each; shoulder flexion and abduction 180,
# extension 60, horizontal flexion 135 and extension 45, rotation 70 and 90; elbow 0 to 150; knee 0 to 140; ankle 30 and
# 50. The shoulder's cone is about the directions in which these end, its centre forward, outward and a little down.
# Knee and elbow are hinges with 5 deg to spare, and the forearm's twist is pronation. Trunk, neck, shoulder girdle and
# wrist: plausible ranges of ours.
BALL_LIMITS_DEG = {
    "torso": ((17.5, 0, 0), (42.5, 25, 20)),
    "chest": ((7.5, 0, 0), (27.5, 15, 35)),
    "head": ((-5, 0, 0), (55, 40, 75)),
    "shoulder_left": ((0, -12.5, -2.5), (10, 22.5, 22.5)),  # raised, forward
    "upper_arm_left": ((-62, -39, -24), (118, 118, 110)),
    "thigh_left": ((-50, -10, 5), (85, 45, 55)),
}
HINGE_LIMITS_DEG = {  # and saddles
    "forearm_left": ((-72.5, 0, 0), (77.5, 6, 90)),
    "hand_left": ((7.5, 5, 0), (27.5, 75, 5)),
    "shank_left": ((67.5, 0, 0), (72.5, 5, 12)),
    "foot_left": ((10, 5, 0), (40, 20, 20)),
}
_JOINT_LANDMARKS = {  # named for the joint at a segment's origin
    "hip": "thigh",
    "knee": "shank",
    "ankle": "foot",
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "hand",
}
_LIMB_LANDMARKS = ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist", "hand")
_ROUNDING = 0.5  # an ellipsoid reaches beyond its joints by this share of the segment's mean radius
_HEAD_WIDTH_PER_DEPTH = 0.79  # of the head's ellipsoid
_SOLE_PER_BALL = 0.039 / 0.0735  # depth of the sole below the ankle, over the distance from the ankle to the ball
_HEEL_PER_TOE = 0.42  # how far the heel reaches behind the ankle, over how far the toes reach in front of it


@lru_cache(maxsize=64)
def human18(stature_m: float = 1.80, mass_kg: float = 75.0, *, outfit: Outfit = ATHLETE) -> BodyModel:
    """Make a person of our own proportions, of a stature [m] and a mass [kg]; raises BodyError for impossible ones."""
    return human18_from_measurements(measurements_of(stature_m, mass_kg), outfit=outfit)


def human18_from_measurements(
    source: Path | str | Measurements, *, outfit: Outfit = ATHLETE, symmetric: bool = True
) -> BodyModel:
    """Make a person from Yeadon's 95 measurements, or a file of them; raises BodyError for unusable ones.

    Joint centres, masses and inertias are Yeadon's: the trunk bends at the lowest rib (pelvis - torso) and at the
    nipples (torso - chest), and the layer between the shoulder joints and the acromia is halved into the two shoulders.
    Unless `symmetric` is False, left and right limbs get the mean of both sides' measurements, as in Yeadon's own.
    """
    measurements = check_measurements(source) if isinstance(source, Measurements) else read_measurements(Path(source))
    person = measurements.symmetrise() if symmetric else measurements
    values, properties = person.values_m, segment_properties(person)
    joints = _joints(values)
    segments = []
    for name, parent in PARENTS.items():
        ellipsoid, centre, span = _ellipsoid(name, properties[name], values, joints)
        parts = tuple(outfit.parts(name, ellipsoid, centre, span))
        segments.append(Segment(name, parent, joints[name], parts, limits_of(name), properties[name].inertia))
    return BodyModel("human18", tuple(segments), _landmarks(values))


def _joints(v: Mapping[str, float]) -> dict[str, Array]:
    """Return each segment's joint in its parent's frame [m]."""
    chest, shoulders = v["Ls4L"] - v["Ls3L"], v["Ls5L"] - v["Ls4L"]
    joints = {
        "pelvis": np.zeros(3),
        "torso": np.zeros(3),
        "chest": np.array([0, 0, v["Ls3L"] - v["Ls2L"]]),
        "head": np.array([0, 0, chest + shoulders]),
    }
    for side, arm, leg, sign in (("left", "a", "j", 1.0), ("right", "b", "k", -1.0)):
        sternoclavicular = np.array([0, 0, chest]) + sternoclavicular_m(v, sign)
        joints[f"shoulder_{side}"] = sternoclavicular
        joints[f"upper_arm_{side}"] = np.array([sign * v["Ls4w"] / 2, 0, chest]) - sternoclavicular
        joints[f"forearm_{side}"] = np.array([0, 0, -v[f"L{arm}2L"]])
        joints[f"hand_{side}"] = np.array([0, 0, v[f"L{arm}2L"] - v[f"L{arm}4L"]])
        joints[f"thigh_{side}"] = np.array([sign * v["Ls0w"] / 4, 0, -v["Ls2L"]])
        joints[f"shank_{side}"] = np.array([0, 0, -v[f"L{leg}3L"]])
        joints[f"foot_{side}"] = np.array([0, 0, v[f"L{leg}3L"] - v[f"L{leg}5L"]])
    return joints


def _ellipsoid(
    name: str, properties: SolidProperties, v: Mapping[str, float], joints: dict[str, Array]
) -> tuple[Ellipsoid, Array, tuple[float, float]]:
    """Make a segment's ellipsoid, with its centre and the heights of the segment's ends in the segment's frame [m].

    Along the segment it spans the joints and a little more, so that joints leave no gap; its widths give the segment's
    volume between the joints, in the ratio of the solids' second moments.
    """
    kind, _, side = name.rpartition("_") if name.endswith(("_left", "_right")) else (name, "", "")
    arm, leg = ("a", "j") if side == "left" else ("b", "k")
    if kind == "shoulder":
        return _shoulder(properties, v, joints[name], joints[f"upper_arm_{side}"])
    if kind == "foot":
        return _foot(properties, v, leg)
    low, high = {
        "pelvis": (-v["Ls2L"], 0.0),
        "torso": (0.0, v["Ls3L"] - v["Ls2L"]),
        "chest": (0.0, v["Ls4L"] - v["Ls3L"]),
        "head": (0.0, v["Ls8L"]),
        "upper_arm": (-v[f"L{arm}2L"], 0.0),
        "forearm": (v[f"L{arm}2L"] - v[f"L{arm}4L"], 0.0),
        "hand": (-v[f"L{arm}7L"], 0.0),
        "thigh": (-v[f"L{leg}3L"], 0.0),
        "shank": (v[f"L{leg}3L"] - v[f"L{leg}5L"], 0.0),
    }[kind]
    beyond = _ROUNDING * np.sqrt(properties.volume_m3 / (np.pi * (high - low)))
    bottom = low if kind in ("head", "hand") else low - beyond
    top = high if kind == "head" else high + beyond
    centre, half = (top + bottom) / 2, (top - bottom) / 2
    ends = (np.array([low, high]) - centre) / half
    unit_volume = half * (np.diff(ends) - np.diff(ends**3) / 3).item()  # of an ellipsoid of unit section
    moments = _second_moments(properties.inertia.tensor_kg_m2)
    ratio = _HEAD_WIDTH_PER_DEPTH if kind == "head" else np.sqrt(moments[0] / moments[1])
    depth = np.sqrt(properties.volume_m3 / (np.pi * unit_volume * ratio))
    return Ellipsoid(np.array([ratio * depth, depth, half])), np.array([0, 0, centre]), (low, high)


def _shoulder(
    properties: SolidProperties, v: Mapping[str, float], joint: Array, arm: Array
) -> tuple[Ellipsoid, Array, tuple[float, float]]:
    """Span from the breastbone to beyond the shoulder joint."""
    side = np.sign(arm[0])
    inner, outer = -joint[0] / 2, arm[0] + side * 0.15 * v["Ls4w"] / 2
    half = abs(outer - inner) / 2
    depth = np.sqrt(properties.volume_m3 / (4 / 3 * np.pi * half * 0.6))
    centre = np.array([(inner + outer) / 2, arm[1], arm[2] + 0.4 * (v["Ls5L"] - v["Ls4L"])])
    return Ellipsoid(np.array([half, depth, 0.6 * depth])), centre, (centre[2] - 0.6 * depth, centre[2] + 0.6 * depth)


def _foot(
    properties: SolidProperties, v: Mapping[str, float], leg: str
) -> tuple[Ellipsoid, Array, tuple[float, float]]:
    """Span from the heel to the toes, resting on the sole, as wide as the ball."""
    toe = v[f"L{leg}9L"] * np.cos(FOOT_SLOPE_RAD)
    length, width = (1 + _HEEL_PER_TOE) * toe / 2, v[f"L{leg}8w"] / 2
    height = properties.volume_m3 / (4 / 3 * np.pi * length * width)
    sole = -_SOLE_PER_BALL * v[f"L{leg}8L"]
    centre = np.array([0, length - toe, sole + height])
    return Ellipsoid(np.array([width, length, height])), centre, (sole, sole + 2 * height)


def _second_moments(tensor: Array) -> Array:
    """Return the integrals of x^2, y^2 and z^2 dm, from an inertia tensor."""
    return np.trace(tensor) / 2 - np.diag(tensor)


def _landmarks(v: Mapping[str, float]) -> tuple[Landmark, ...]:
    limbs, ears = [], (v["Ls6L"] + v["Ls7L"]) / 2  # half way from beneath the nose to above the ears
    for side, arm, leg in (("left", "a", "j"), ("right", "b", "k")):
        ball = v[f"L{leg}8L"] * np.array([0, -np.cos(FOOT_SLOPE_RAD), -np.sin(FOOT_SLOPE_RAD)])
        positions = {name: (segment, np.zeros(3)) for name, segment in _JOINT_LANDMARKS.items()}
        positions |= {"foot": ("foot", ball), "hand": ("hand", np.array([0, 0, -v[f"L{arm}7L"] / 2]))}
        limbs += [
            Landmark(f"{name}_{side}", f"{positions[name][0]}_{side}", positions[name][1]) for name in _LIMB_LANDMARKS
        ]
    return (
        *limbs,
        Landmark("pelvis", "pelvis", np.array([0, 0, -v["Ls2L"]])),
        Landmark("torso", "torso", np.zeros(3)),
        Landmark("neck", "head", np.zeros(3)),
        Landmark("head", "head", np.array([0, 0, ears])),
    )


def limits_of(name: str) -> JointLimits:
    """Return the limits of a segment's joint; those of the root are free."""
    left = name.replace("_right", "_left")
    limits = BALL_LIMITS_DEG | HINGE_LIMITS_DEG
    if left not in limits:
        return FREE
    centre, half = np.radians(limits[left])
    mirror = np.array([1, 1, 1]) if left == name else np.array([1, -1, -1])
    return JointLimits(matrix_from_angles(mirror * centre), half, np.asarray(left in BALL_LIMITS_DEG))
