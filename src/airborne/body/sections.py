"""Cross-sections of a person's skin: stadia along each segment, from Yeadon's measurements (1990-II).

Measured girths and widths hold exactly. Between them, and where nothing is measured, the shape is our own choice: how
much deeper than wide a limb is, where a calf, a seat or a face stands out, how a foot rises to the ankle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from airborne.body.stadia import Stadium, stadium
from airborne.types import Array

Values = Mapping[str, float]  # measurements [m]

_SECTIONS = 9  # between the ends of a segment
_CAP_RAD = np.radians([60.0, 30.0])  # sections of a rounded end, besides its tip

# the loft's axes as rows, in the segment's frame: x along the straight sides, y across them, z along the segment
_WIDE, _DEEP = np.eye(3), np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
# likewise, for feet and their soles
_SIDEWAYS, _FORWARD = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]), np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])

# of an oval section: length along its straight sides over width across
_THIGH, _KNEE, _CALF, _UPPER_ARM, _ELBOW, _FOREARM, _NECK, _SKULL = 1.06, 1.06, 1.08, 1.10, 1.04, 1.12, 1.06, 1.27
_FOOT = (  # share of the way from heel to toe; half width over the ball's; height over the ankle's
    (0.10, 0.62, 0.75),
    (0.30, 0.72, 1.02),
    (0.45, 0.80, 0.82),
    (0.60, 0.92, 0.62),
    (0.75, 1.00, 0.50),
    (0.90, 0.86, 0.36),
)


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """A segment's sections in its loft's frame, one after the other, and how far its rounded ends reach beyond them.

    Trunk, arm and leg are each one profile, cut into segments at the joints, so that the body is smooth across them.
    """

    axes: Array  # (3, 3) rows: the loft's axes in the segment's frame
    levels: Array  # (n, 5) position along z, half the straight side, radius, centre in x and y [m]
    caps_m: tuple[float, float]

    def piece(self, low_m: float, high_m: float, origin_m: float, caps_m: tuple[float, float]) -> Profile:
        """Cut out the piece between two levels, measured from `origin_m`, with its own rounded ends."""
        along = np.linspace(low_m, high_m, _SECTIONS)
        levels = self._sections_at(along)
        levels[:, 0] = along - origin_m
        return Profile(self.axes, levels, caps_m)

    def stations(self, first: float, last: float) -> Array:
        """Return a loft's sections (n, 5), girths times `first` at one end, `last` at the other, linear between."""
        along = np.linspace(self.levels[0, 0], self.levels[-1, 0], _SECTIONS)
        body = self._sections_at(along)
        body[:, 1:3] *= np.linspace(first, last, _SECTIONS)[:, None]
        ends = []
        for end, cap, angles in ((body[0], -self.caps_m[0], _CAP_RAD), (body[-1], self.caps_m[1], _CAP_RAD[::-1])):
            ring = np.tile(end, (len(angles), 1))
            ring[:, 0] += cap * np.sin(angles)
            ring[:, 1:3] *= np.cos(angles)[:, None]
            tip = end + np.array([cap, 0, 0, 0, 0])
            tip[1:3] = 0
            ends.append((tip, ring))
        (low_tip, low), (high_tip, high) = ends
        return np.vstack([low_tip, low, body, high, high_tip])

    def _sections_at(self, along: Array) -> Array:
        """Interpolate the sections between the levels; no girth overshoots its neighbours."""
        return PchipInterpolator(self.levels[:, 0], self.levels)(along)


def trunk_profile(kind: str, v: Values) -> Profile:
    """Give the sections of the pelvis, torso, chest or head."""
    if kind != "head":
        hip, navel, rib, nipple = (stadium(v[f"Ls{i}p"], v[f"Ls{i}w"]) for i in range(4))
        top = Stadium((v["Ls4w"] - v["Ls4d"]) / 2, v["Ls4d"] / 2)
        seat, crotch = 0.05 * hip.radius_m, -v["Lj1L"]
        levels = [(crotch, hip, 0, seat), (0, hip, 0, seat), (v["Ls1L"], navel), (v["Ls2L"], rib), (v["Ls3L"], nipple)]
        trunk = _profile(_WIDE, [*levels, (v["Ls4L"], top)])
        if kind == "pelvis":
            return trunk.piece(0, v["Ls2L"], v["Ls2L"], (-crotch, 0.5 * rib.radius_m))
        if kind == "torso":
            return trunk.piece(v["Ls2L"], v["Ls3L"], v["Ls2L"], (0.5 * rib.radius_m, 0.5 * nipple.radius_m))
        caps = 0.5 * nipple.radius_m, 1.7 * (v["Ls5L"] - v["Ls4L"])
        return trunk.piece(v["Ls3L"], v["Ls4L"], v["Ls3L"], caps)
    neck, face, skull = _oval(v["Ls5p"], _NECK), _oval(v["Ls6p"], _SKULL), _oval(v["Ls7p"], _SKULL)
    jaw = _oval(0.45 * v["Ls5p"] + 0.55 * v["Ls6p"], (_NECK + _SKULL) / 2)
    back, front = 0.1 * neck.radius_m, -0.1 * skull.radius_m
    levels = [
        (0, neck, back),
        (0.5 * v["Ls6L"], _oval(0.97 * v["Ls5p"], _NECK), back),
        (0.75 * v["Ls6L"], jaw, front / 2),
        (v["Ls6L"], face, front),
        (v["Ls7L"], skull, 0),
    ]
    return replace(_profile(_DEEP, levels), caps_m=(0.5 * neck.radius_m, v["Ls8L"] - v["Ls7L"]))


def shoulder_profile(v: Values, joint_m: Array, arm_joint_m: Array) -> Profile:
    """Give the sections of the left shoulder, from beside the breastbone to past the joint with the arm.

    joint_m (3,): the shoulder in the chest; arm_joint_m (3,): the arm in the shoulder.
    """
    x, y, z = arm_joint_m
    ball, height = v["La0p"] / (2 * np.pi), v["Ls5L"] - v["Ls4L"]
    levels = [
        (-joint_m[0] / 2, Stadium(0.30 * v["Ls4d"] - 0.6 * height, 0.6 * height), y, z + 0.5 * height),
        ((x - joint_m[0]) / 2, Stadium(0.36 * v["Ls4d"] - 0.8 * height, 0.8 * height), y, z + 0.3 * height),
        (x, Stadium(0.15 * ball, ball), y, z),
    ]
    return replace(_profile(_SIDEWAYS, levels), caps_m=(0.3 * height, 0.8 * ball))


def arm_profile(kind: str, v: Values) -> Profile:
    """Give the sections of the left upper arm, forearm or hand, from below."""
    elbow, wrist = _oval(v["La2p"], _ELBOW), stadium(v["La4p"], v["La4w"])
    if kind == "hand":
        palm = [(-v[f"La{i}L"], stadium(v[f"La{i}p"], v[f"La{i}w"])) for i in (7, 6, 5)]
        tips = palm[0][1]
        hand = _profile(_DEEP, [(tips.radius_m - v["La7L"], tips), *palm[1:], (0, wrist)])
        return replace(hand, caps_m=(tips.radius_m, 0.8 * wrist.radius_m))
    levels = [
        (-v["La4L"], wrist),
        (-v["La3L"], _oval(v["La3p"], _FOREARM)),
        (-v["La2L"], elbow),
        (-v["La2L"] / 2, _oval(v["La1p"], _UPPER_ARM)),
        (0, _oval(v["La0p"], _UPPER_ARM)),
    ]
    arm, round_elbow = _profile(_DEEP, levels), 0.9 * elbow.radius_m
    if kind == "upper_arm":
        return arm.piece(-v["La2L"], 0, 0, (round_elbow, 0.9 * levels[-1][1].radius_m))
    return arm.piece(-v["La4L"], -v["La2L"], -v["La2L"], (0.8 * wrist.radius_m, round_elbow))


def leg_profile(kind: str, v: Values) -> Profile:
    """Give the sections of the left thigh or shank, from below."""
    knee, calf, ankle = _oval(v["Lj3p"], _KNEE), _oval(v["Lj4p"], _CALF), _oval(v["Lj5p"], _CALF)
    hip, seat = v["Ls0w"] / 4, stadium(v["Ls0p"], v["Ls0w"]).radius_m
    levels = [
        (-v["Lj5L"], ankle),
        (-v["Lj4L"], calf, 0.1 * calf.radius_m),
        (-0.65 * v["Lj3L"] - 0.35 * v["Lj4L"], _oval(0.95 * min(v["Lj3p"], v["Lj4p"]), _CALF), 0.05 * calf.radius_m),
        (-v["Lj3L"], knee),
        (-(v["Lj1L"] + v["Lj3L"]) / 2, _oval(v["Lj2p"], _THIGH)),
        (-v["Lj1L"], _oval(v["Lj1p"], _THIGH)),
        (0, Stadium(max(0.88 * seat - hip, 0.02 * hip), hip)),
    ]
    leg = _profile(_DEEP, levels)
    if kind == "thigh":
        return leg.piece(-v["Lj3L"], 0, 0, (knee.radius_m, hip))
    return leg.piece(-v["Lj5L"], -v["Lj3L"], -v["Lj3L"], (ankle.radius_m, knee.radius_m))


def foot_profile(v: Values, heel_m: float, toe_m: float, sole_m: float) -> Profile:
    """Give the sections of the left foot from heel to toe; positions in front of the ankle and below it [m]."""
    half, rise = v["Lj8w"] / 2, -sole_m / 2
    levels = []
    for share, width, height in _FOOT:
        radius = min(height * rise, 0.98 * width * half)
        levels.append((heel_m + share * (toe_m - heel_m), Stadium(width * half - radius, radius), 0, sole_m + radius))
    return replace(_profile(_FORWARD, levels), caps_m=(levels[0][0] - heel_m, toe_m - levels[-1][0]))


def _oval(perimeter: float, ratio: float) -> Stadium:
    """Make the section of a perimeter, `ratio` times as long along its straight sides as across."""
    radius = perimeter / (2 * np.pi + 4 * (ratio - 1))
    return Stadium((ratio - 1) * radius, radius)


def _profile(axes: Array, levels: list[tuple]) -> Profile:
    """Make a profile of levels (position, section, shift along x, shift along y), shifts 0 by default; no caps yet."""
    rows = [(at, section.flat_m, section.radius_m, *shift, *[0.0] * (2 - len(shift))) for at, section, *shift in levels]
    return Profile(axes, np.array(rows, float), (0.0, 0.0))
