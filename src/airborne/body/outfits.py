"""Outfits: colours of clothes and skin, and the borders where a segment changes from one to another."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.model import WHOLE, BodyModel, Ellipsoid, Part, Segment
from airborne.body.shaping import length_axis
from airborne.errors import BodyError

Colour = tuple[float, float, float] | None  # sRGB 0..255; None: to be sampled from the video

_BACKWARD = Rotation.from_euler("x", -90, degrees=True)  # a part whose own z points backward
_TOWARD = (Rotation.from_euler("y", 90, degrees=True), _BACKWARD, Rotation.identity())  # own z points along x, y, z
_ALIGNED = 1e-9  # rounding of axes and of solids


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
            segment_from_part = RigidTransform.from_components(centre_m, _BACKWARD)
            border = b - 2 * b * self.hair_share
            return _cut(
                segment,
                Ellipsoid(np.array([a, c, b])),
                segment_from_part,
                border,
                below=("face", self.skin),
                above=("hair", self.hair),
            )
        segment_from_part = RigidTransform.from_translation(centre_m)
        if kind == "upper_arm":
            border = high - length * self.sleeve_share
            return _cut(
                segment,
                ellipsoid,
                segment_from_part,
                border,
                below=("skin", self.skin),
                above=("sleeve", self.shirt),
                span=(low, high),
            )
        if kind == "thigh":
            border = high - length * self.shorts_share
            return _cut(
                segment,
                ellipsoid,
                segment_from_part,
                border,
                below=("skin", self.skin),
                above=("shorts", self.shorts),
                span=(low, high),
            )
        if kind == "shank":
            border = low + length * self.socks_share
            return _cut(
                segment,
                ellipsoid,
                segment_from_part,
                border,
                below=("sock", self.socks),
                above=("skin", self.skin),
                span=(low, high),
            )
        colours = {"pelvis": self.shorts, "foot": self.shoes, "forearm": self.skin, "hand": self.skin}
        return [Part(segment, ellipsoid, segment_from_part, _array(colours.get(kind, self.shirt)))]


@dataclass(frozen=True, slots=True)
class Border:
    """Where a segment changes colour: at a share of its extent along one of its axes."""

    share: float  # along the length axis from the segment's joint to its end; along another from its low side
    axis: int | None = None  # 0, 1, 2: x, y, z; None: the length axis


def with_borders(model: BodyModel, borders: Mapping[str, Border | None]) -> BodyModel:
    """Return the body with other borders on its segments; None: a segment of one colour.

    A name without its side ("thigh") stands for both. A segment already cut along the same axis keeps its two parts'
    names and colours; a newly cut one has its colour on both sides. Raises BodyError for an unknown segment,
    a share outside 0..1, and a segment that is not one ellipsoid.
    """
    names = {segment.name for segment in model.segments}
    border_of: dict[str, Border | None] = {}
    for name, border in borders.items():
        sides = [name] if name in names else [f"{name}_{side}" for side in ("left", "right")]
        if not {*sides} <= names:
            model.index_of(name)
        if border is not None and not 0 < border.share < 1:
            raise BodyError(f"segment '{name}': the border's share is {border.share:g}; expected between 0 and 1")
        border_of |= dict.fromkeys(sides, border)
    segments = tuple(
        replace(segment, parts=_cut_at_border(model, segment, border_of[segment.name]))
        if segment.name in border_of
        else segment
        for segment in model.segments
    )
    return replace(model, segments=segments)


def extent_m(model: BodyModel, segment: str, axis: int | None = None) -> tuple[float, float]:
    """Return where a `Border`'s shares 0 and 1 lie along an axis of the segment's frame [m].

    Along the length axis: its joint, and the farthest joint of its children, or the end of its surface.
    """
    ellipsoid, centre = ellipsoid_of(model, segment)
    length = length_axis(model, segment)
    if axis is None or axis == length:
        ends = [child.joint_m[length] for child in model.segments if child.parent == segment]
        far = max(ends, key=abs, default=0.0)
        if not far:
            far = centre[length] + np.copysign(ellipsoid.semi_axes_m[length], centre[length])
        return 0.0, float(far)
    return float(centre[axis] - ellipsoid.semi_axes_m[axis]), float(centre[axis] + ellipsoid.semi_axes_m[axis])


def ellipsoid_of(model: BodyModel, segment: str) -> tuple[Ellipsoid, np.ndarray]:
    """Return the ellipsoid that a segment's parts are cut from, its axes along the segment's, and its centre (3,) [m].

    Raises BodyError for a segment that is not one ellipsoid.
    """
    solids = []
    for part in model.segments[model.index_of(segment)].parts:
        axes = np.abs(part.segment_from_part.rotation.as_matrix())
        if isinstance(part.shape, Ellipsoid) and np.abs(axes - axes.round()).max() < _ALIGNED:
            solids.append((axes.round() @ part.shape.semi_axes_m, part.segment_from_part.translation))
        else:
            solids.append((np.full(3, np.nan), np.full(3, np.nan)))
    if not solids or not np.allclose(solids, solids[0], rtol=0, atol=_ALIGNED):
        raise BodyError(f"segment '{segment}' is not one ellipsoid along its axes, so it cannot be cut; leave it whole")
    return Ellipsoid(solids[0][0]), solids[0][1]


def _cut_at_border(model: BodyModel, segment: Segment, border: Border | None) -> tuple[Part, ...]:
    ellipsoid, centre = ellipsoid_of(model, segment.name)
    old = sorted(segment.parts, key=lambda part: part.slab_m)
    if border is None:
        largest = max(old, key=lambda part: _height_m(part))
        return (Part(segment.name, ellipsoid, RigidTransform.from_translation(centre), largest.colour),)
    axis = length_axis(model, segment.name) if border.axis is None else border.axis
    start, end = extent_m(model, segment.name, axis)
    height = start + border.share * (end - start) - centre[axis]
    own = Ellipsoid(np.abs(_TOWARD[axis].as_matrix()).round().T @ ellipsoid.semi_axes_m)
    segment_from_part = RigidTransform.from_components(centre, _TOWARD[axis])
    is_cut_so = len(old) == 2 and np.allclose(old[0].segment_from_part.rotation.apply([0, 0, 1]), np.eye(3)[axis])
    names = [f"{segment.name}_low", f"{segment.name}_high"]
    below, above = old if is_cut_so else (replace(old[0], name=name) for name in names)
    return (
        Part(below.name, own, segment_from_part, below.colour, (WHOLE[0], float(height))),
        Part(above.name, own, segment_from_part, above.colour, (float(height), WHOLE[1])),
    )


def _height_m(part: Part) -> float:
    """Return how much of a part's ellipsoid its slab keeps, along its own z [m]."""
    top = part.shape.semi_axes_m[2] if isinstance(part.shape, Ellipsoid) else 0.0
    return float(np.diff(np.clip(part.slab_m, -top, top))[0])


def _cut(
    segment: str,
    ellipsoid: Ellipsoid,
    segment_from_part: RigidTransform,
    border: float,
    *,
    below: tuple[str, Colour],
    above: tuple[str, Colour],
    span: tuple[float, float] | None = None,
) -> list[Part]:
    """Cut at a height along the part's own z; a border at an end of the span leaves one part."""
    low, high = span or (-ellipsoid.semi_axes_m[2], ellipsoid.semi_axes_m[2])
    if border <= low:
        return [Part(segment, ellipsoid, segment_from_part, _array(above[1]))]
    if border >= high:
        return [Part(segment, ellipsoid, segment_from_part, _array(below[1]))]
    return [
        Part(f"{segment}_{below[0]}", ellipsoid, segment_from_part, _array(below[1]), (WHOLE[0], float(border))),
        Part(f"{segment}_{above[0]}", ellipsoid, segment_from_part, _array(above[1]), (float(border), WHOLE[1])),
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

# Hue [deg], saturation, value. The hue goes once round the body, so that left and right differ and neighbours look
# alike; the trunk is grey. No channel is above 200: light of up to 1.27 leaves every colour below white.
_HUES = {
    "pelvis": (0, 0.0, 0.45),
    "torso": (0, 0.0, 0.57),
    "chest": (0, 0.0, 0.70),
    "head": (90, 0.8, 0.78),
    "shoulder_left": (0, 0.8, 0.78),
    "upper_arm_left": (15, 0.8, 0.78),
    "forearm_left": (30, 0.8, 0.78),
    "hand_left": (45, 0.8, 0.78),
    "shoulder_right": (210, 0.8, 0.78),
    "upper_arm_right": (225, 0.8, 0.78),
    "forearm_right": (240, 0.8, 0.78),
    "hand_right": (255, 0.8, 0.78),
    "thigh_left": (320, 0.8, 0.78),
    "shank_left": (305, 0.8, 0.78),
    "foot_left": (290, 0.8, 0.78),
    "thigh_right": (140, 0.8, 0.70),
    "shank_right": (160, 0.8, 0.70),
    "foot_right": (180, 0.8, 0.70),
}
PALETTE = {
    name: tuple(round(255 * share) for share in colorsys.hsv_to_rgb(hue / 360, saturation, value))
    for name, (hue, saturation, value) in _HUES.items()
}  # sRGB


def with_flat_colours(model: BodyModel, colours: Mapping[str, tuple[float, ...]] = PALETTE) -> BodyModel:
    """Give each segment one uniform colour, sRGB 0..255, as paper B's models have; by default those of `PALETTE`.

    Raises BodyError for a segment without a colour, and one that is not one ellipsoid.
    """
    missing = [segment.name for segment in model.segments if segment.name not in colours]
    if missing:
        raise BodyError(f"no colour for segment '{missing[0]}'; there are colours for {', '.join(colours)}")
    whole = with_borders(model, {segment.name: None for segment in model.segments})
    segments = tuple(
        replace(segment, parts=(replace(segment.parts[0], colour=np.array(colours[segment.name], float)),))
        for segment in whole.segments
    )
    return replace(whole, segments=segments)
