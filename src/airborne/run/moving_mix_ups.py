"""Mix-ups of the videos of one body whose start is not known: what stands out in them is not one body's silhouettes.

Exchanged, mirrored or upside-down images are found as those without which the visual hull covers the silhouettes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from airborne.cameras import Camera
from airborne.errors import MistakesError
from airborne.run.mix_ups import MixUp, possible_mix_ups
from airborne.run.sample import look_at
from airborne.tracking.first_pose.moments import Moment, empty_scenes, look
from airborne.tracking.first_pose.places import MovingRegion, moving_regions
from airborne.tracking.first_pose.visual_hull import uncovered_share
from airborne.trial.file import Trial
from airborne.video import Recording

_MOST_IMAGES = 300  # chosen: of each camera that are looked at where no start is looked for, a few seconds' work
_N_MOMENTS = 6  # chosen: spread over those in which most cameras see something move
# Chosen on people 8000, 8001 and 8008 to 8013 and throws 8000 to 8008 of `benchmarks/accuracy/mix_ups.py`, of which one
# body's silhouettes were uncovered by up to 0.23. Shares of them: from which on a mix-up is looked for; below which
# they are one body's; from which on an odd camera is asked about
_LEAST_MIXED_UP, _MOST_UNCOVERED, _LEAST_ASKED = 0.1, 0.15, 0.3
# chosen there: how many times less than as they are, and than in any other way, they are without a mix-up that is
# refused, and without one, or a camera, that is asked about
_OF_MIX_UP, _OF_DOUBT = (3.0, 2.0), (2.0, 1.5)

_STILL = (
    "nothing is seen to move in the video of {camera}: does it show the body, and is it of this recording? Correct "
    "that, or leave it out (--cameras)"
)

_Seen = tuple[Moment, Sequence[Sequence[MovingRegion]]]  # a moment, and what moves in each of its views
_Regions = Sequence[MovingRegion | None]  # the largest of each camera, None where it is cut by the image or none is


class MovingSilhouettes(NamedTuple):
    """What the silhouettes of what moves say."""

    uncovered: float  # share of them that cannot be one body's; NaN where two cameras see nothing whole
    doubts: tuple[str, ...] = ()  # what seems wrong with the videos, one line each
    mix_up: str | None = None  # what is wrong with them, where without it they are one body's for sure

    @property
    def are_one_body(self) -> bool:
        """Whether they look like those of one body, in the cameras that show it."""
        return self.uncovered < _MOST_UNCOVERED


def look_at_silhouettes(trial: Trial, recording: Recording) -> MovingSilhouettes:
    """Return what the silhouettes of what moves in an opened recording say; looks at some of its images, small."""
    _, sample = look_at(trial, recording, _MOST_IMAGES)
    return compare_silhouettes(look(sample, empty_scenes(sample)))


def refuse_moving_mix_ups(silhouettes: MovingSilhouettes) -> None:
    """Raise MistakesError, naming the cameras, where silhouettes are those of one body only without a mix-up."""
    if silhouettes.mix_up is not None:
        raise MistakesError("the videos", [f"{silhouettes.mix_up}; if that is not so, calibrate anew, or give [start]"])


def compare_silhouettes(moments: Sequence[Moment]) -> MovingSilhouettes:
    """Return what the silhouettes of what moves say: compared with each other, as they are and without mix-ups."""
    seen = [(moment, moving_regions(moment)) for moment in moments]
    chosen, doubts = _choose(seen), [_STILL.format(camera=name) for name in _still_cameras(seen)]
    as_they_are = _median_uncovered(regions for _, regions in chosen)
    if not as_they_are >= _LEAST_MIXED_UP:
        return MovingSilhouettes(as_they_are, tuple(doubts))
    cameras = chosen[0][0]
    names = [camera.name for camera in cameras]
    mix_ups = [each for each in possible_mix_ups(len(names)) if len({cameras[i].size for i in each.cameras}) == 1]
    without = [_median_uncovered(_undo(mix_up, *each) for each in chosen) for mix_up in mix_ups]
    what = f"{as_they_are:.0%} of the silhouettes of what moves cannot be one body's"
    simple = without[: sum(not mix_up.is_in_turn for mix_up in mix_ups)]
    if (best := _clear_mix_up(without, simple, as_they_are, *_OF_DOUBT)) is not None:
        shows = f"{what}, and {without[best]:.0%} with {mix_ups[best].describe(names)}"
        if best == _clear_mix_up(without, simple, as_they_are, *_OF_MIX_UP):
            return MovingSilhouettes(as_they_are, tuple(doubts), mix_ups[best].finding(names, shows).sentence)
        doubts.append(f"{shows}: are these videos right?")
    elif as_they_are >= _LEAST_ASKED:
        left_out = [
            _median_uncovered([*regions[:i], *regions[i + 1 :]] for _, regions in chosen) for i in range(len(names))
        ]
        if (odd := _clear_minimum(left_out, as_they_are, *_OF_DOUBT)) is not None:
            doubts.append(
                f"{what}, but those without {names[odd]} can: is its video of this recording, does it begin with the "
                "others' (`airborne sync`), and was it moved or calibrated wrongly? Correct that, or leave it out "
                "(--cameras)"
            )
    return MovingSilhouettes(as_they_are, tuple(doubts))


def _still_cameras(seen: Sequence[_Seen]) -> list[str]:
    """Return the cameras in which nothing stands out at any moment, where something does in others."""
    moves: dict[str, bool] = {}
    for moment, regions in seen:
        for view, nats, own in zip(moment.frames.views, moment.evidence, regions, strict=True):
            if view is not None and nats is not None:
                moves[view.camera.name] = moves.get(view.camera.name, False) or bool(own)
    return [name for name, does in moves.items() if not does] if any(moves.values()) else []


def _clear_minimum(shares: Sequence[float], as_they_are: float, times: float, times_another: float) -> int | None:
    """Return which share is that of one body's silhouettes, so many times less than as they are and than any other."""
    best, another = np.argsort(shares)[:2]
    is_clear = shares[best] * times < as_they_are and shares[best] * times_another < shares[another]
    return int(best) if is_clear and shares[best] < _MOST_UNCOVERED else None


def _clear_mix_up(
    shares: Sequence[float], simple: Sequence[float], as_they_are: float, times: float, times_another: float
) -> int | None:
    """Return which share is clear among those of all mix-ups, else among the simple ones, which come first.

    Where two cameras see nearly the same, exchanging one of them is hardly another mix-up than passing on all three.
    """
    best = _clear_minimum(shares, as_they_are, times, times_another)
    return _clear_minimum(simple, as_they_are, times, times_another) if best is None else best


def _median_uncovered(moments: Iterable[_Regions]) -> float:
    """Return what the visual hull leaves of the silhouettes of some moments; NaN with fewer than two at each."""
    found = [[each for each in regions if each is not None] for regions in moments]
    shares = [uncovered_share(each) for each in found if len(each) > 1]
    return float(np.median(shares)) if shares else np.nan


def _choose(seen: Sequence[_Seen]) -> list[tuple[list[Camera], _Regions]]:
    """Return cameras and regions of some of the moments in which most of them see something move, two at least."""
    found = [
        (
            [view.camera for view in moment.frames.views if view is not None],
            [own[0] if own and not own[0].is_cut else None for own in regions],
        )
        for moment, regions in seen
        if None not in moment.frames.views
    ]
    most = max((_count(regions) for _, regions in found), default=0)
    best = [each for each in found if _count(each[1]) == most > 1]
    return [best[i] for i in np.unique(np.linspace(0, len(best) - 1, _N_MOMENTS).round().astype(int))] if best else []


def _count(regions: _Regions) -> int:
    return sum(region is not None for region in regions)


def _undo(mix_up: MixUp, cameras: Sequence[Camera], regions: _Regions) -> _Regions:
    """Return the regions as they would be without a mix-up."""
    i, right = mix_up.cameras[0], list(regions)
    if mix_up.is_exchange:
        for target, source in mix_up.order:
            region = regions[source]
            right[target] = None if region is None else replace(region, camera=cameras[target])
    elif (region := regions[i]) is not None:
        flipped = np.array(cameras[i].size) - region.mask.shape[::-1] - region.corner
        centre = np.array(cameras[i].size) - 1 - region.centre
        if mix_up.is_turned:
            right[i] = replace(region, corner=tuple(flipped.tolist()), centre=centre, mask=region.mask[::-1, ::-1])
        else:
            corner, centre = (int(flipped[0]), region.corner[1]), np.array([centre[0], region.centre[1]])
            right[i] = replace(region, corner=corner, centre=centre, mask=region.mask[:, ::-1])
    return right
