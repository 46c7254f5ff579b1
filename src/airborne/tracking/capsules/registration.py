"""Cameras that were moved, or whose calibration is wrong: one shows the players beside where the others see them.

Each camera in turn is left out, the players are fitted by the others, and the camera's image is searched for them. As
the others may be at fault, what fits best with one camera shifted is compared with what fits best with none.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import cv2
import numpy as np

from airborne.tracking.capsules.bystanders import occluding_capsules
from airborne.tracking.capsules.camera_evidence import WEAK_SD
from airborne.tracking.capsules.dynamics import N_FREE
from airborne.tracking.capsules.equations import N_CAPSULES, N_POINTS, classes_with, pose_state
from airborne.tracking.capsules.first_frame import points_of
from airborne.tracking.capsules.fit import JumperFit, JumperPrior, fit_jumper, pixel_weight, select_views
from airborne.tracking.capsules.jumper import SURFACE_CLASSES
from airborne.tracking.capsules.kernel_arguments import Capsules
from airborne.tracking.capsules.outlines import draw_labels, project_capsules
from airborne.tracking.capsules.recovery import UNOCCLUDED
from airborne.tracking.capsules.track import CameraShift, Everybody, Registration, Track
from airborne.tracking.capsules.views import RegionMaps, map_evidence, player_regions
from airborne.tracking.estimate import Status
from airborne.tracking.players import PlayerEstimate
from airborne.tracking.time_offsets import compensate_at_velocity
from airborne.types import Array
from airborne.video import Frames

_EVERY_S, _AT_LEAST_S = Fraction(1, 5), Fraction(1)  # chosen: between looks while a camera hides a player, and else
_FARTHEST_M, _LEAST_M = 0.5, 0.075  # chosen: of a shift, across at the players; less is a joint's usual error
# chosen on synthetic blocks 7301 to 7306, a player: with right cameras shifts gained 27 nats at most, 37 behind two
# team-mates, and mostly lost 30 to 65; of cameras shifted by 8 to 30 pixels, 0.08 to 0.3 m, most gained 35 to 150
_LEAST_GAIN = 45.0
_CLEARLY = 100.0  # chosen on the same: nats by which another camera explains less, where none was accused wrongly
_WORSE = 0.75  # chosen: share of a player's usual evidence, below which cameras are looked at
_MOVED_M = 0.05  # chosen: of the hips from frame to frame, 3 m/s at 60 Hz
_MOST_STEPS = 12  # chosen: of a fit without a camera


class _LeftOut(NamedTuple):
    """A player fitted without one camera, and sought in its image."""

    view: int
    points: Array  # (9, 3) [m]
    total: float  # of the fit [nat]
    evidence: Array  # (2n + 1, 2n + 1) [nat] of this image by how far down and right it shows the player
    step_px: int  # of that


class _Fits(NamedTuple):
    """A player as tracked, and fitted without each camera."""

    total: float  # as tracked [nat], without the image that says most against it
    left_out: Sequence[_LeftOut]


def check_registration(
    before: Everybody, everybody: Everybody, estimates: Sequence[PlayerEstimate], frames: Frames
) -> Registration:
    """Look whether a camera is shifted; what was said before stays until a look is due.

    One is due at once where a camera stops to show a player, or a player fits worse. Of fewer than three cameras none
    can be told from another.
    """
    last, n_views = before.registration, sum(view is not None for view in frames.views)
    found = {each.player: everybody.players[each.player] for each in estimates if each.status is not Status.LOST}
    n_doubts = sum(
        n_views - each.n_views + (each.score < _WORSE * found[each.player].reference_evidence)
        for each in estimates
        if each.player in found
    )
    wait_s = _EVERY_S if n_doubts or last.shift else _AT_LEAST_S
    is_due = last.looked_s is None or n_doubts > last.n_doubts or frames.time_s - last.looked_s >= wait_s
    if n_views < 3 or not is_due:
        return last
    tracks = [*found.values(), *everybody.bystanders]
    # what the last frame said is best where all cameras agreed then: a wrong one has moved the players since
    trusted = {} if last.shift else before.players
    each_out = {name: _leave_each_out(track, tracks, frames, trusted.get(name)) for name, track in found.items()}
    fits = {name: each for name, each in each_out.items() if each.left_out}
    if not fits:
        return last
    shift = _decide(last, _suspect(list(fits.values()), is_known=last.shift is not None), is_doubted=n_doubts > 0)
    if shift is None or shift.or_view is None:
        return Registration(frames.time_s, n_doubts, shift)
    covariance = {name: _disagreement(found[name], each.left_out, shift) for name, each in fits.items()}
    return Registration(frames.time_s, n_doubts, shift, covariance)


def _decide(last: Registration, suspect: CameraShift | None, *, is_doubted: bool) -> CameraShift | None:
    """Return the camera that counts as shifted, given what was said at the last look.

    A camera that is left out stays so until it agrees or another is clearly at fault. Where it was open which one it
    is, it stays open until all agree: players follow the wrong camera meanwhile, and the fits accuse others.
    """
    if last.shift is None:
        return suspect
    if not last.is_open:
        return last.shift if suspect is not None and suspect.or_view is not None else suspect
    if suspect is None:
        return last.shift if is_doubted else None
    if suspect.or_view is None:
        return suspect._replace(or_view=next(view for view in last.suspects if view != suspect.view))
    return suspect


def _leave_each_out(track: Track, tracks: Sequence[Track], frames: Frames, trusted: Track | None) -> _Fits:
    """Fit a player without each camera, near a state that is trusted, if any; not where fewer than three show him."""
    regions = player_regions(compensate_at_velocity(frames, track.filtered.hips_velocity_m_s), track.state[:3])
    if len(regions) < 3:
        return _Fits(0.0, ())
    unoccluded = np.full(len(SURFACE_CLASSES), UNOCCLUDED)
    maps = map_evidence(regions, [track.colours.table(each.view, unoccluded) for each in regions], track.scale)
    others = occluding_capsules(track.state, [each.state for each in tracks if each is not track])
    sd = np.full(N_FREE, WEAK_SD)
    if trusted is not None:
        sd[:3] = _MOVED_M
    prior = JumperPrior((trusted or track).state[:N_FREE], np.diag(1 / sd**2))

    def fit(kept: RegionMaps, most_steps: int) -> JumperFit:
        return fit_jumper(track.state, prior, kept, others, most_steps=most_steps)

    fits, as_tracked, reach = [], fit(maps, 0).total, round(_FARTHEST_M * maps.scale.px_per_m)
    for i, region in enumerate(regions):
        kept = select_views(maps, [j for j in range(len(regions)) if j != i])
        fitted, as_tracked = fit(kept, _MOST_STEPS), max(as_tracked, fit(kept, 0).total)
        evidence = pixel_weight(maps) * _evidence_by_shift(fitted.state, select_views(maps, [i]), others, reach)
        fits.append(_LeftOut(region.view, fitted.points, fitted.total, evidence, maps.scale.reduction))
    return _Fits(as_tracked, fits)


def _evidence_by_shift(state: Array, maps: RegionMaps, others: Capsules, reach: int) -> Array:
    """Sum the maps of one view under a state, shifted down and right by -reach to reach pixels: (2 reach + 1,) * 2."""
    n, (_, _, h, w) = N_CAPSULES + len(others.ends), maps.sums.shape
    ends, radii, share = np.empty((n, 2, 3)), np.empty((n, 2)), np.ones(n)
    ends[N_CAPSULES:], radii[N_CAPSULES:] = others
    pose_state(state, np.empty((N_POINTS, 3)), ends, radii, share)
    discs, depth, labels = np.empty((n, 2, 3)), np.empty(n), np.empty((h, w - 1), np.int8)
    project_capsules(ends, radii, maps.cameras[0], discs, depth)
    draw_labels(discs, depth, classes_with(others), share, labels)
    total = np.zeros((2 * reach + 1,) * 2)
    shown = np.argwhere((labels >= 0) & (labels < len(SURFACE_CLASSES)))
    if len(shown) == 0:
        return total
    (top, left), (bottom, right) = shown.min(axis=0), shown.max(axis=0) + 1
    for k, sums in enumerate(maps.sums[0, : len(SURFACE_CLASSES)]):
        mask = (labels[top:bottom, left:right] == k).astype(np.float32)
        padded = np.pad(np.diff(sums, axis=1), reach)
        total += cv2.matchTemplate(padded[top : bottom + 2 * reach, left : right + 2 * reach], mask, cv2.TM_CCORR)
    return total


def _suspect(players: Sequence[_Fits], *, is_known: bool) -> CameraShift | None:
    """Return the camera at fault; None where none is, or none is known and it might be chance.

    It shows the players elsewhere than the others do, or it shows none of them where the others do.
    """
    views = sorted({each.view for fits in players for each in fits.left_out})
    (gain, shift), *others = sorted((_gain_of(view, players) for view in views), key=lambda each: -each[0])
    if gain > (0.0 if is_known else _LEAST_GAIN * len(players)):
        rivals = [other.view for each, other in others if each > gain - _CLEARLY]
        return shift._replace(or_view=rivals[0] if rivals else None)
    (gain, view), (second, _), *_ = sorted(((_gain_alone(view, players), view) for view in views), reverse=True)
    return CameraShift(view, None, None) if gain > max(0.0, second + _CLEARLY) else None


def _gain_alone(view: int, players: Sequence[_Fits]) -> float:
    """Return how much better than as tracked all players are explained without a camera that shows none of them."""
    own = [(fits, each) for fits in players for each in fits.left_out if each.view == view]
    return sum(_total_as_calibrated(each) - fits.total for fits, each in own)


def _gain_of(view: int, players: Sequence[_Fits]) -> tuple[float, CameraShift]:
    """Return how much better a shift of one camera explains all players [nat] than that all are right, and which."""
    step_px = min(each.step_px for fits in players for each in fits.left_out)
    reach = min(len(each.evidence) // 2 * each.step_px for fits in players for each in fits.left_out) // step_px
    steps = np.arange(-reach, reach + 1)
    gain, least = np.zeros((len(steps),) * 2), 0.0
    for fits in players:
        own = next((each for each in fits.left_out if each.view == view), None)
        if own is not None:
            at = np.round(steps * step_px / own.step_px).astype(int) + len(own.evidence) // 2
            gain += own.total + own.evidence[np.ix_(at, at)] - max(map(_total_as_calibrated, fits.left_out))
            least = max(least, _LEAST_M / _FARTHEST_M * (len(own.evidence) // 2) * own.step_px)
    gain[np.hypot(*np.meshgrid(steps, steps)) * step_px < least] = -np.inf
    down, right = np.unravel_index(gain.argmax(), gain.shape)
    return float(gain.max()), CameraShift(view, (float(steps[right] * step_px), float(steps[down] * step_px)), None)


def _total_as_calibrated(fit: _LeftOut) -> float:
    """Return what a fit says if its camera is right, or shows nothing of the player."""
    centre = len(fit.evidence) // 2
    return fit.total + max(float(fit.evidence[centre, centre]), 0.0)


def _disagreement(track: Track, fits: Sequence[_LeftOut], shift: CameraShift) -> Array:
    """Return the covariance (9, 3, 3) [m²] of points that may lie where the cameras besides one of the suspects say.

    They may be as far off besides as the shift is long there; where a camera does not show the players, as the longest
    that is sought.
    """
    suspects = [each for each in fits if each.view in (shift.view, shift.or_view)]
    apart = np.stack([each.points for each in suspects or fits]) - points_of(track.state)
    farthest = np.linalg.norm(apart, axis=2).argmax(axis=0)
    off = apart[farthest, np.arange(N_POINTS)]
    farthest_px = len(fits[0].evidence) // 2 * fits[0].step_px
    shift_px = farthest_px if shift.right_down_px is None else np.hypot(*shift.right_down_px)
    shift_m = _FARTHEST_M / farthest_px * shift_px
    return off[:, :, None] * off[:, None, :] + shift_m**2 * np.eye(3)
