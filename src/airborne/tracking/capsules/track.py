"""What is kept of a player from frame to frame, and the evidence of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from airborne.tracking.capsules.dynamics import GaussianState
from airborne.tracking.capsules.surface_colours import SurfaceColours
from airborne.tracking.capsules.views import EvidenceTable, MapScale
from airborne.types import Array
from airborne.video import Frames


class Sighting(NamedTuple):
    """A time at which players were tracked."""

    frames: Frames
    states: tuple[Array, ...]  # (35,) of each


class Bystander(NamedTuple):
    """Somebody who is none of the lost players."""

    floor_m: Array  # (2,) where he was last
    time_s: Fraction


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What the next frame needs of one player."""

    time_s: Fraction
    filtered: GaussianState
    state: Array  # (35,) the last estimate; its shape is constant
    sliding: Array  # (4,) in the first frame
    shape_covariance: Array  # (5, 5) of the constant lengths [m2]
    colours: SurfaceColours
    colours_updated_s: Fraction  # of the last update of its colours
    tables: tuple[EvidenceTable, ...]  # of each camera
    scale: MapScale
    reference_evidence: float  # running reference of the evidence per pixel [nat]
    lost_s: Fraction | None = None  # since when the player is lost
    sighting: Sighting | None = None  # the last in which the player was tracked
    searched_s: Fraction | None = None  # of the last look for a lost player
    bystanders: tuple[Bystander, ...] | None = None  # known since a look for a lost player
    is_unclear: bool = False  # that look left open who is meant, which was said


class CameraShift(NamedTuple):
    """A camera that shows the players beside where the other cameras see them, or does not show them."""

    view: int
    right_down_px: tuple[float, float] | None  # None: it shows none of them where the others do
    or_view: int | None  # another camera that may be at fault instead


class Registration(NamedTuple):
    """What the last look at the cameras said."""

    looked_s: Fraction | None = None
    n_doubts: int = 0  # images that did not show a player then, and players who fitted badly
    shift: CameraShift | None = None
    covariance: Mapping[str, Array] = {}  # of each player's points (9, 3, 3) [m²], where it is open who is at fault

    @property
    def is_open(self) -> bool:
        """Whether a camera is shifted of which it is not known which it is."""
        return self.shift is not None and self.shift.or_view is not None

    @property
    def suspects(self) -> tuple[int | None, ...]:
        """The cameras that may be shifted."""
        return () if self.shift is None else (self.shift.view, self.shift.or_view)

    @property
    def left_out(self) -> int | None:
        """The camera that is left out: one that is clearly shifted."""
        return None if self.shift is None or self.is_open else self.shift.view


class Everybody(NamedTuple):
    """Who is followed: the players, by name, and others who may hide them."""

    players: Mapping[str, Track]
    bystanders: tuple[Track, ...] = ()
    looked_s: Fraction = Fraction(0)  # when others were looked for
    registration: Registration = Registration()  # of the cameras


def evidence_per_px(owned: Array) -> float:
    """Return the mean evidence of the pixels that capsules own (views, capsules, 2, 2): [nat]."""
    evidence, area = owned.sum(axis=(0, 1, 2))
    return float(evidence / area) if area > 0 else 0.0
