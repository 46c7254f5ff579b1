"""From 95 measurements to the mass, volume and inertia of 18 segments, with Yeadon's solids and Dempster's densities.

Yeadon (1990-II) builds a person of solids between measured levels. Here they are combined into the segments of
`human18`, with palms facing the thighs and level soles in the zero pose (Yeadon's person stands with the palms
forward and the toes pointed down).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.body.inertia import combine_inertias, transform_inertia
from airborne.body.measurements import STATURE_SHARES, Measurements, check_measurements
from airborne.body.model import Inertia
from airborne.body.stadia import SolidProperties, Stadium, circle, dome, half_solid, solid, stadium
from airborne.errors import BodyError
from airborne.types import Array

# the line from the ankle to the ball of the foot falls by this when the sole is level
FOOT_SLOPE_RAD = np.radians(22.0)
_DENSITIES = {  # [kg/m^3], Dempster's, as in Yeadon (1990-II)
    "head": 1110.0,
    "shoulders": 1040.0,
    "thorax": 920.0,
    "abdomen": 1010.0,
    "upper_arm": 1070.0,
    "forearm": 1130.0,
    "hand": 1160.0,
    "thigh": 1050.0,
    "shank": 1090.0,
    "foot": 1100.0,
}
# plausible statures [m], masses [kg] and girths relative to the average
_STATURES_M, _MASSES_KG, _GIRTHS = (0.8, 2.5), (10.0, 300.0), (0.6, 1.7)
_ACROMION_PER_SHOULDER = 0.57  # depth of the trunk at the acromia over that at the shoulder joints (Yeadon's program)
_PALM_INWARD = Rotation.from_euler("z", 90, degrees=True).as_matrix()
_SOLE_LEVEL = Rotation.from_euler("x", FOOT_SLOPE_RAD - np.pi / 2).as_matrix()


def require_athlete(stature_m: float, mass_kg: float) -> None:
    """Raise BodyError for a stature or a mass that no athlete has, or both."""
    wrong = []
    for value, (low, high), name, unit in (
        (stature_m, _STATURES_M, "stature_m", "metres"),
        (mass_kg, _MASSES_KG, "mass_kg", "kilograms"),
    ):
        if not low <= value <= high:
            smaller, factor = ("centimetres", 100) if unit == "metres" else ("grams", 1000)
            is_meant = low <= value / factor <= high
            hint = f": is it in {smaller}? give {value / factor:g}" if is_meant else ""
            wrong.append(f"{name} is {value:g}; expected {low:g} to {high:g} {unit}{hint}")
    if wrong:
        raise BodyError("; ".join(wrong))


def measurements_of(stature_m: float, mass_kg: float) -> Measurements:
    """Make the measurements of a person of our own proportions.

    Lengths are fixed shares of the stature; one factor on all girths, widths and depths gives the mass (it goes with
    the factor's square). Raises BodyError for a stature or a mass that no athlete has.
    """
    require_athlete(stature_m, mass_kg)
    girth = float(np.sqrt(mass_kg / (_mass_per_cubic_stature() * stature_m**3)))
    if not _GIRTHS[0] <= girth <= _GIRTHS[1]:
        raise BodyError(
            f"{mass_kg:g} kg at {stature_m:g} m means girths {girth:.2f} times the average; expected {_GIRTHS[0]:g} to "
            f"{_GIRTHS[1]:g}; check both numbers"
        )
    values = {key: share * stature_m * (1 if key[-1] == "L" else girth) for key, share in STATURE_SHARES.items()}
    return Measurements(f"{stature_m:g} m, {mass_kg:g} kg", values, mass_kg)


def sternoclavicular_m(values_m: Mapping[str, float], sign: float) -> Array:
    """Return the sternoclavicular joint, about which the shoulder girdle turns: (3,) from mid-shoulder [m].

    sign: +1 left, -1 right. Near the midline, in front of it, half way up to the acromia: our own choice.
    """
    rise = (values_m["Ls5L"] - values_m["Ls4L"]) / 2
    return np.array([sign * 0.07 * values_m["Ls4w"], -0.2 * values_m["Ls4d"], rise])


def segment_properties(measurements: Measurements) -> dict[str, SolidProperties]:
    """Compute each segment's inertia and volume, in the segments' own frames; raises BodyError as `check_measurements`.

    With a measured mass, one factor on all densities gives it.
    """
    v = check_measurements(measurements).values_m
    segments = _trunk(v)
    for side, arm, leg in (("left", "a", "j"), ("right", "b", "k")):
        segments |= {f"{name}_{side}": properties for name, properties in {**_arm(v, arm), **_leg(v, leg)}.items()}
    if measurements.mass_kg is None:
        return segments
    share = measurements.mass_kg / sum(each.inertia.mass_kg for each in segments.values())
    return {name: each._replace(inertia=_scale_density(each.inertia, share)) for name, each in segments.items()}


def _trunk(v: Mapping[str, float]) -> dict[str, SolidProperties]:
    sections = [stadium(v[f"Ls{i}p"], v[f"Ls{i}w"]) for i in range(4)]
    radius = v["Ls4d"] / 2
    shoulders = Stadium(v["Ls4w"] / 2 - radius, radius)
    acromia = Stadium(v["Ls4w"] / 2 - _ACROMION_PER_SHOULDER * radius, _ACROMION_PER_SHOULDER * radius)
    neck, nose, ear = (circle(v[f"Ls{i}p"]) for i in (5, 6, 7))
    heights = np.diff([0.0, *(v[f"Ls{i}L"] for i in range(1, 6))])
    segments = {
        "pelvis": _shift(_stack(sections[:3], heights[:2], "abdomen"), -v["Ls2L"]),
        "torso": solid(sections[2], sections[3], heights[2], _DENSITIES["thorax"]),
        "chest": solid(sections[3], shoulders, heights[3], _DENSITIES["thorax"]),
        "head": _join(
            [
                _stack([neck, nose, ear], [v["Ls6L"], v["Ls7L"] - v["Ls6L"]], "head"),
                _shift(dome(v["Ls7p"], v["Ls8L"] - v["Ls7L"], _DENSITIES["head"]), v["Ls7L"]),
            ]
        ),
    }
    for side, sign in (("left", 1.0), ("right", -1.0)):
        half = half_solid(shoulders, acromia, heights[4], _DENSITIES["shoulders"], sign=sign)
        inertia = transform_inertia(half.inertia, np.eye(3), -sternoclavicular_m(v, sign))
        segments[f"shoulder_{side}"] = half._replace(inertia=inertia)
    return segments


def _arm(v: Mapping[str, float], arm: str) -> dict[str, SolidProperties]:
    rounds = [circle(v[f"L{arm}{i}p"]) for i in range(4)]
    flats = [stadium(v[f"L{arm}{i}p"], v[f"L{arm}{i}w"]) for i in range(4, 8)]
    elbow, widest, wrist = (v[f"L{arm}{i}L"] for i in (2, 3, 4))
    hand = np.diff([0.0, *(v[f"L{arm}{i}L"] for i in (5, 6, 7))])
    return {
        "upper_arm": _stack(rounds[:3], [-elbow / 2, -elbow / 2], "upper_arm"),
        "forearm": _rotate(_stack([*rounds[2:], flats[0]], [elbow - widest, widest - wrist], "forearm"), _PALM_INWARD),
        "hand": _rotate(_stack(flats, -hand, "hand"), _PALM_INWARD),
    }


def _leg(v: Mapping[str, float], leg: str) -> dict[str, SolidProperties]:
    hips = stadium(v["Ls0p"], v["Ls0w"])
    top = Stadium(0.0, np.sqrt(hips.radius_m * (hips.radius_m + hips.flat_m) / 2))  # as Yeadon's program has it
    rounds = [top, *(circle(v[f"L{leg}{i}p"]) for i in range(1, 6))]
    crotch, knee, calf, ankle = (v[f"L{leg}{i}L"] for i in (1, 3, 4, 5))
    heel, ball, toes = (v[f"L{leg}{i}L"] for i in (6, 8, 9))
    thigh = [crotch, (knee - crotch) / 2, (knee - crotch) / 2]
    arch = circle(v[f"L{leg}7p"])
    front = [stadium(v[f"L{leg}{i}p"], v[f"L{leg}{i}w"]) for i in (8, 9)]
    back = [rounds[5], stadium(v[f"L{leg}6p"], v[f"L{leg}6d"]), arch]  # the heel is wide from front to back
    instep = (heel + ball) / 2
    foot = [
        _stack(back, [-heel, heel - instep], "foot", is_turned=True),
        _shift(_stack([arch, *front], [instep - ball, ball - toes], "foot"), -instep),
    ]
    return {
        "thigh": _stack(rounds[:4], -np.array(thigh), "thigh"),
        "shank": _stack(rounds[3:], [knee - calf, calf - ankle], "shank"),
        "foot": _rotate(_join(foot), _SOLE_LEVEL),
    }


def _stack(
    sections: Sequence[Stadium], heights_m: Sequence[float] | Array, kind: str, *, is_turned: bool = False
) -> SolidProperties:
    """Stack the solids between successive sections, the first at z = 0; heights below zero [m] go down."""
    pieces, z = [], 0.0
    for near, far, height in zip(sections, sections[1:], heights_m, strict=False):
        low, high = (near, far) if height > 0 else (far, near)
        piece = solid(low, high, abs(height), _DENSITIES[kind], is_turned=is_turned)
        pieces.append(_shift(piece, min(z, z + height)))
        z += height
    return _join(pieces)


def _join(pieces: Sequence[SolidProperties]) -> SolidProperties:
    return SolidProperties(
        combine_inertias([piece.inertia for piece in pieces]), sum(piece.volume_m3 for piece in pieces)
    )


def _shift(properties: SolidProperties, z_m: float) -> SolidProperties:
    return properties._replace(inertia=transform_inertia(properties.inertia, np.eye(3), np.array([0.0, 0.0, z_m])))


def _rotate(properties: SolidProperties, R: Array) -> SolidProperties:
    return properties._replace(inertia=transform_inertia(properties.inertia, R, np.zeros(3)))


def _scale_density(inertia: Inertia, share: float) -> Inertia:
    return replace(inertia, mass_kg=inertia.mass_kg * share, tensor_kg_m2=inertia.tensor_kg_m2 * share)


@lru_cache(maxsize=1)
def _mass_per_cubic_stature() -> float:
    """Return the mass of a person of our proportions over the cube of the stature [kg/m^3]."""
    stature_m = 1.75  # of an average person, so that the check of units passes
    values = {key: share * stature_m for key, share in STATURE_SHARES.items()}
    return (
        sum(each.inertia.mass_kg for each in segment_properties(Measurements("average", values)).values())
        / stature_m**3
    )
