"""What a person wears: colours, and the borders where a segment changes from one to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.model import WHOLE, Ellipsoid, Part
from airborne.errors import BodyError

Colour = tuple[float, float, float] | None  # sRGB 0..255; None: to be sampled from the video

_BACKWARD = Rotation.from_euler("x", -90, degrees=True)  # a part whose own z points backward


@dataclass(frozen=True, slots=True, kw_only=True)
class Outfit:
    """Colours of a person's surface, and how far along a segment each cover reaches (0: not at all, 1: all of it)."""

    skin: Colour
    hair: Colour
    shirt: Colour
    shorts: Colour
    socks: Colour
    shoes: Colour
    hair_share: float = 0.5  # of the head's depth, from the back
    sleeve_share: float = 0.5  # of the upper arm, from the shoulder
    shorts_share: float = 0.5  # of the thigh, from the hip
    socks_share: float = 0.3  # of the shank, from the ankle

    def __post_init__(self) -> None:
        for name in ("hair_share", "sleeve_share", "shorts_share", "socks_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise BodyError(f"{name} is {getattr(self, name):g}; expected 0 to 1, the share of the segment covered")

    def parts(
        self, segment: str, ellipsoid: Ellipsoid, centre_m: np.ndarray, span_m: tuple[float, float]
    ) -> list[Part]:
        """Cover a segment's ellipsoid: one part, or two cut from it where a border crosses.

        centre_m (3,): the ellipsoid's centre in the segment's frame, axes along it; span_m: the joints' heights there.
        """
        low, high = span_m[0] - centre_m[2], span_m[1] - centre_m[2]
        length = high - low
        kind = segment.removesuffix("_left").removesuffix("_right")
        if kind == "head":
            a, b, c = ellipsoid.semi_axes_m
            place = RigidTransform.from_components(centre_m, _BACKWARD)
            border = b - 2 * b * self.hair_share
            return _cut(
                segment, Ellipsoid(np.array([a, c, b])), place, border, ("face", self.skin), ("hair", self.hair)
            )
        place = RigidTransform.from_translation(centre_m)
        if kind == "upper_arm":
            border = high - length * self.sleeve_share
            return _cut(segment, ellipsoid, place, border, ("skin", self.skin), ("sleeve", self.shirt), (low, high))
        if kind == "thigh":
            border = high - length * self.shorts_share
            return _cut(segment, ellipsoid, place, border, ("skin", self.skin), ("shorts", self.shorts), (low, high))
        if kind == "shank":
            border = low + length * self.socks_share
            return _cut(segment, ellipsoid, place, border, ("sock", self.socks), ("skin", self.skin), (low, high))
        colours = {"pelvis": self.shorts, "foot": self.shoes, "forearm": self.skin, "hand": self.skin}
        return [Part(segment, ellipsoid, place, _array(colours.get(kind, self.shirt)))]


def _cut(
    segment: str,
    ellipsoid: Ellipsoid,
    place: RigidTransform,
    border: float,
    below: tuple[str, Colour],
    above: tuple[str, Colour],
    span: tuple[float, float] | None = None,
) -> list[Part]:
    """Cut at a height along the part's own z; a border at an end of the span leaves one part."""
    low, high = span or (-ellipsoid.semi_axes_m[2], ellipsoid.semi_axes_m[2])
    if border <= low:
        return [Part(segment, ellipsoid, place, _array(above[1]))]
    if border >= high:
        return [Part(segment, ellipsoid, place, _array(below[1]))]
    return [
        Part(f"{segment}_{below[0]}", ellipsoid, place, _array(below[1]), (WHOLE[0], float(border))),
        Part(f"{segment}_{above[0]}", ellipsoid, place, _array(above[1]), (float(border), WHOLE[1])),
    ]


def _array(colour: Colour) -> np.ndarray | None:
    return None if colour is None else np.array(colour, float)


ATHLETE = Outfit(
    skin=(214, 158, 128),
    hair=(58, 40, 30),
    shirt=(36, 92, 190),
    shorts=(196, 32, 44),
    socks=(238, 238, 232),
    shoes=(232, 190, 40),
)
SAMPLED = Outfit(
    skin=None,
    hair=None,
    shirt=None,
    shorts=None,
    socks=None,
    shoes=None,
    hair_share=0.0,
    sleeve_share=0.0,
    shorts_share=0.5,
    socks_share=0.0,
)
