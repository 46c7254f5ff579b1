"""Who else stands between the players and the cameras: others are found and followed because they hide legs."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from airborne.tracking.capsules.equations import N_CAPSULES, N_POINTS, pose_state
from airborne.tracking.capsules.first_frame import STATURE_PER_LEG, FirstFrameFit, fit_first_frame, points_of
from airborne.tracking.capsules.floor_search import find_others, floor_grid
from airborne.tracking.capsules.jumper import JOINTS, N_DOF, SHANK, THIGH
from airborne.tracking.capsules.kernel_arguments import Capsules
from airborne.tracking.capsules.track import evidence_per_px
from airborne.types import Array
from airborne.video import Frames
from airborne.video.small import shrink

# chosen on synthetic blocks 7001 to 7006, but how often others are fitted on 7101 to 7104: at 0.1 s joints err by 27 mm
FOLLOWED_EVERY_S = Fraction(1, 20)  # others, for 21 mm; between, they are predicted
LOOK_S = Fraction(5)  # between looks for others, of which one takes 0.3 s at 1080p
APART_M = 0.3  # of the hips of two people at least: who is nearer to a player is that player
_NEAR_M = 3.0  # others further away do not occlude
_FARTHEST_M, _MARGIN_M = 4.0, 1.0  # from a player toward each camera, and beside that way: where others are looked for
_WIDTH_PX = 320  # of the pictures in which others are looked for
LEAST_EVIDENCE = 1.2  # [nat a pixel] of somebody's fit: fits to nobody on synthetic blocks had up to 1.06
_LOOSER = 3.0  # than joints set by hand
_HEAD_TOP, _HEAD_RADIUS = 0.136, 0.05  # over the chest, and of the head: shares of the stature (Drillis and Contini)
_N_OCCLUDING = N_CAPSULES + 1  # capsules of one person, with the head


def find_bystanders(players: Sequence[Array], frames: Frames, known: Sequence[Array] = ()) -> list[FirstFrameFit]:
    """Find and fit who stands between players and the cameras, beside those who are known: states (35,) each."""
    views = [shrink(view, _WIDTH_PX) for view in frames.views if view is not None]
    if len(views) < 2 or not players:
        return []
    zone, places = _between(
        np.array([state[:2] for state in players]), np.array([view.camera.centre[:2] for view in views])
    )
    nowhere = np.full((2, 2), np.nan)
    standers = find_others(views, [*players, *known], zone=zone, places=places, wanted=nowhere)
    states = [stander.states[0] for stander in standers]
    fits = [
        fit_stander(state, [*players, *known, *states[:i], *states[i + 1 :]], frames) for i, state in enumerate(states)
    ]
    return [each for each in fits if evidence_per_px(each.fit.owned) > LEAST_EVIDENCE]


def fit_stander(state: Array, others: Sequence[Array], frames: Frames) -> FirstFrameFit:
    """Fit somebody who was found standing, in a state (35,), beside others."""
    joints_m: dict[str, Array] = dict(zip(JOINTS, points_of(state), strict=True))
    return fit_first_frame("found", joints_m, frames, occluding_capsules(state, others), looser=_LOOSER)


def occluding_capsules(state: Array, others: Sequence[Array]) -> Capsules:
    """Return what may occlude a jumper: the capsules of others nearby, and their heads.

    state (35,) is the jumper's, others (35,) each.
    """
    others = [other for other in others if np.linalg.norm(other[:3] - state[:3]) < _NEAR_M]
    ends, end_radii = np.empty((len(others), _N_OCCLUDING, 2, 3)), np.empty((len(others), _N_OCCLUDING, 2))
    for other, each_ends, each_radii in zip(others, ends, end_radii, strict=True):
        pose_state(other, np.empty((N_POINTS, 3)), each_ends, each_radii, np.empty(N_CAPSULES))
        stature_m = STATURE_PER_LEG * (other[N_DOF + THIGH] + other[N_DOF + SHANK])
        waist, chest = each_ends[:2].mean(axis=0)
        up = (chest - waist) / np.linalg.norm(chest - waist)
        each_ends[-1] = chest, chest + (_HEAD_TOP - _HEAD_RADIUS) * stature_m * up
        each_radii[-1] = _HEAD_RADIUS * stature_m
    return Capsules(ends.reshape(-1, 2, 3), end_radii.reshape(-1, 2))


def _between(players: Array, cameras: Array) -> tuple[Array, Array]:
    """Return a zone (2, 2) of the floor, from and to x, y [m], and places (n, 2) in it between players and cameras.

    players (k, 2) and cameras (v, 2) as seen from above.
    """
    toward = (cameras[:, None] - players).reshape(-1, 2) + 1e-9  # a camera may hang right above a player
    toward *= np.minimum(1.0, _FARTHEST_M / np.linalg.norm(toward, axis=1))[:, None]
    origins = np.tile(players, (len(cameras), 1))
    points = np.vstack([players, origins + toward])
    zone = np.array([points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M])
    places = floor_grid(zone)
    off = places[:, None] - origins
    along = np.clip((off * toward).sum(axis=2) / (toward**2).sum(axis=1), 0.0, 1.0)
    off_line_m = np.linalg.norm(off - along[..., None] * toward, axis=2).min(axis=1)
    return zone, places[off_line_m < _MARGIN_M]
