"""Whether the landmarks of a start have left and right exchanged: of the whole body, of both legs or of both arms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from airborne.body import BodyModel, with_segment_lengths
from airborne.body.inverse_kinematics import PoseFit, fit_lengths, fit_pose
from airborne.body.sides import other_side, without_side
from airborne.errors import BodyError
from airborne.types import Array

# chosen on 40 synthetic starts: the search's postures, 8 degrees off, points 15 mm off, segments 5 %. Right sides left
# 9 to 18 mm, one 27, and no exchange brought that below a share of 0.93, nor the one over 20 mm below 1.22. Exchanged
# arms or whole legs lie beyond both in 97 to 100 %; ankles or knees, of legs often side by side, in 82 to 93 %; all
# from the knees down, which turned thighs fit as well, in 35 %
_SUSPECT_M, _EXCHANGED_SHARE = 0.02, 0.7
# chosen on five people's starts: 12 points without head, hands and feet leave 0.99 to 1.24 times as much exchanged,
# with the head 1.05 to 1.43, with the feet 1.47 or more
_AS_WELL = 1.15
_KINDS = {  # what may be exchanged: in words, and the stems of the landmarks; single ones as slips of a table
    "": ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist", "hand"),
    " of the legs": ("hip", "knee", "ankle", "foot"),
    " of the legs from the knees down": ("knee", "ankle", "foot"),
    " of the ankles and feet": ("ankle", "foot"),
    " of the knees": ("knee",),
    " of the ankles": ("ankle",),
    " of the arms": ("shoulder", "elbow", "wrist", "hand"),
    " of the arms from the elbows down": ("elbow", "wrist", "hand"),
    " of the wrists and hands": ("wrist", "hand"),
    " of the elbows": ("elbow",),
    " of the wrists": ("wrist",),
}
_LONG = ("thigh", "shank", "upper_arm", "forearm")  # segments between joints, whose lengths people share
_LONG_SHARE = 0.08  # chosen: two sds of a segment's length at a known stature, about 4 % [Winter 2009]
_OTHER_SHARES = 0.45, 1.6  # chosen: of hands, feet and girdles, whose landmarks are defined less well


class Exchange(NamedTuple):
    """Landmarks that fit clearly better with left and right exchanged."""

    of: str  # which ones, in words; empty for all
    as_named_m: float  # how far off they are, RMS [m]
    exchanged_m: float  # and with left and right exchanged

    @property
    def sentence(self) -> str:
        """Say it."""
        return (
            f"left and right{self.of} look exchanged: landmarks {self.as_named_m * 1e3:.0f} mm off as named, "
            f"{self.exchanged_m * 1e3:.0f} mm the other way; check the points' names, and that no image is mirrored"
        )


def find_ambiguity(model: BodyModel, targets: Mapping[str, Array], weights: Mapping[str, float], fit: PoseFit) -> str:
    """Say that targets (3,) [m] fit as well with left and right exchanged; nothing where they do not.

    A body that faces the other way differs in its feet and in how knees and elbows bend. `fit` is as for
    `find_exchange`. About 0.3 s where no foot is given.
    """
    exchanged = _exchange(targets, _KINDS[""])
    if not (model.has_joints and exchanged) or any(without_side(name) == "foot" for name in targets):
        return ""
    other = fit_pose(model, exchanged, weights=weights)
    if other.rms_m > _AS_WELL * fit.rms_m:
        return ""
    return (
        f"these points fit about as well with left and right exchanged ({fit.rms_m * 1e3:.0f} and "
        f"{other.rms_m * 1e3:.0f} mm off), so which way the body faces rests on their names; points of foot_left and "
        "foot_right, the tips of the toes, would show it"
    )


def find_exchange(
    model: BodyModel, targets: Mapping[str, Array], weights: Mapping[str, float], fit: PoseFit
) -> Exchange | None:
    """Find which landmarks fit targets (3,) [m] clearly better with left and right exchanged; None where none do.

    `fit` is the pose that fits best as they are named. Each way the body has the targets' own lengths, as far as people
    have such. About 2 s where anything is tried.
    """
    if not model.has_joints or fit.rms_m <= _SUSPECT_M:
        return None
    as_named_m = _rms_m(model, targets, weights)
    if as_named_m <= _SUSPECT_M:
        return None
    tried = {}
    for words, stems in _KINDS.items():
        if exchanged := _exchange(targets, stems):
            tried[words] = _rms_m(model, exchanged, weights)
    best = min(tried, key=tried.__getitem__, default="")
    if not tried or tried[best] >= _EXCHANGED_SHARE * as_named_m:
        return None
    return Exchange(best, as_named_m, tried[best])


def _exchange(targets: Mapping[str, Array], stems: Sequence[str]) -> dict[str, Array]:
    """Return targets with left and right exchanged where a pair of these stems has both; {} where none has."""
    others = {name: other_side(name) for name in targets if without_side(name) in stems}
    pairs = {name: other for name, other in others.items() if other in targets}
    return {name: targets[pairs.get(name, name)] for name in targets} if pairs else {}


def _rms_m(model: BodyModel, targets: Mapping[str, Array], weights: Mapping[str, float]) -> float:
    """Return how far landmarks are off, RMS [m], on a body with their own lengths, as far as people have such."""
    places = np.array([targets.get(mark.name, np.full(3, np.nan)) for mark in model.landmarks])
    with suppress(BodyError):  # lengths of no person
        model = with_segment_lengths(model, _likely_lengths(fit_lengths(model, places[None])))
    try:
        return fit_pose(model, targets, weights=weights, n_restarts=0).rms_m
    except BodyError:  # points on a line
        return np.inf


def _likely_lengths(lengths: Mapping[str, float]) -> dict[str, float]:
    """Return relative lengths of segments, brought within what people of the size have that most of them say."""
    size = float(np.median([*lengths.values()])) if lengths else 1.0
    likely = {}
    for name, length in lengths.items():
        is_long = without_side(name) in _LONG
        least, most = (1 - _LONG_SHARE, 1 + _LONG_SHARE) if is_long else _OTHER_SHARES
        likely[name] = float(np.clip(length, least * size, most * size))
    return likely
