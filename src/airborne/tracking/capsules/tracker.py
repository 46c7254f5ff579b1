"""Tracking of one or several jumpers, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.capsules.dynamics import N_FREE, N_SLIDING, Filtered, begun, predicted, updated
from airborne.tracking.capsules.equations import N_CAPSULES, N_LENGTHS, N_POINTS, placed
from airborne.tracking.capsules.first_frame import first_look, points_of, start_state
from airborne.tracking.capsules.fit import Fit, Prior, fit
from airborne.tracking.capsules.jumper import BALL_HEIGHT_M, CAPSULES, JOINTS, KINDS, N_DOF, PELVIS, SKIN
from airborne.tracking.capsules.surface_colours import RENEWED_S, Colours, hidden_by, not_everywhere, renewed
from airborne.tracking.capsules.views import Scale, Table, regions_round, seen
from airborne.tracking.estimate import Status
from airborne.tracking.players import PlayerEstimate, PlayerStart, lost_player
from airborne.tracking.time_offsets import carried
from airborne.video import Frames

Array = NDArray[np.floating]

_NEAR_M = 3.0  # other jumpers further away hide nothing
_STANDING_M, _SLIP_SD_M = 0.02, 0.02  # a ball of the foot this low stands; how far it moves in a frame
_FLYING_M = 0.06  # both balls of the feet this far above their height in standing: in the air
_LEAST_SHARE, _LOST_SHARE = 0.5, 0.25  # of the usual evidence per pixel: suspect, lost
_LEAST_EVIDENCE = 0.3  # per pixel [nat]; less is as good as nothing
_HIDDEN = 0.45  # mean chance to be hidden, of all kinds or of those on the legs, from which a view does not count
_USUAL_RATE = 0.05
_UNCERTAIN_SD_M = 0.06
_LEAST_AREA_PX = 8.0  # of a kind in a map, to judge whether it is hidden
_HIDDEN_RATE, _HIDDEN_STEP = 0.3, 0.08
_SHAPE = np.arange(N_DOF + PELVIS, N_DOF + N_LENGTHS)  # lengths that stay the same, in a state
_STEP_M = 1e-4
_OF_KIND = (CAPSULES[:, :2].ravel() == np.arange(len(KINDS))[:, None]).astype(float)  # (kinds, halves of capsules)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What the next frame needs of one player."""

    time_s: Fraction
    filtered: Filtered
    state: Array  # (35,) as last found; its shape stays
    sliding: Array  # (4,) in the first frame
    shape_covariance: Array  # (5, 5) of the lengths that stay [m2]
    colours: Colours
    renewed_s: Fraction  # when its colours were looked at last
    tables: tuple[Table, ...]  # each camera's
    scale: Scale
    usual: float  # evidence per pixel [nat]


class Blocker:
    """Track jumpers by Gauss-Newton on evidence maps."""

    joints = JOINTS

    def __init__(self, starts: Sequence[PlayerStart]) -> None:
        """Take the players as they start; those with a torso only are left out."""
        self._starts = [start for start in starts if start.has_legs]

    def init(self) -> Mapping[str, Track]:
        """Return the state before the first frame: nobody."""
        return {}

    def step(
        self, state: Mapping[str, Track], frames: Frames
    ) -> tuple[Mapping[str, Track], tuple[PlayerEstimate, ...]]:
        """Track one time; raises TrialError where a player is in no picture of the first frame."""
        if not state:
            return self._first(frames)
        expected = {name: _expected(track, frames.time_s) for name, track in state.items()}
        tracks, estimates = {}, []
        for name, track in state.items():
            hiding = capsules(expected[name][1], [each for other, (_, each) in expected.items() if other != name])
            tracks[name], estimate = _followed(name, track, expected[name], hiding, frames)
            estimates.append(estimate)
        return tracks, tuple(estimates)

    def _first(self, frames: Frames) -> tuple[dict[str, Track], tuple[PlayerEstimate, ...]]:
        tracks, estimates = {}, []
        placed_by_hand = {start.name: start_state(start.name, start.joints_m) for start in self._starts}
        for start in self._starts:
            own = placed_by_hand[start.name]
            hiding = capsules(own, [each for name, each in placed_by_hand.items() if name != start.name])
            first = first_look(start.name, start.joints_m, frames, hiding)
            state, covariance = first.fit.state, np.linalg.inv(first.fit.information)
            tracks[start.name] = Track(
                frames.time_s,
                begun(state[:N_FREE], covariance[:N_FREE, :N_FREE]),
                state,
                state[N_DOF : N_DOF + N_SLIDING],
                covariance[np.ix_(_SHAPE, _SHAPE)],
                first.colours,
                frames.time_s,
                _tables(first.colours),
                first.scale,
                _per_px(first.fit.owned),
            )
            n_views = _n_free(first.colours.hidden, [v for v, view in enumerate(frames.views) if view is not None])
            free = replace(
                first.fit,
                by_state=first.fit.by_state[:, :N_FREE],
                by_shape=first.fit.by_shape[:N_FREE, :N_FREE],
            )
            found = _estimate(start.name, frames, tracks[start.name], free, n_views)
            estimates.append(found if found.score > _LEAST_EVIDENCE else lost_player(start.name, frames, len(JOINTS)))
        return tracks, tuple(estimates)


def capsules(state: Array, others: Sequence[Array]) -> tuple[Array, Array]:
    """Return what may hide a jumper: the capsules of other ones near by, ends (m, 2, 3) and radii (m, 2) [m].

    state (35,) is his own, others theirs.
    """
    others = [other for other in others if np.linalg.norm(other[:3] - state[:3]) < _NEAR_M]
    ends, balls = np.empty((len(others), N_CAPSULES, 2, 3)), np.empty((len(others), N_CAPSULES, 2))
    for other, each_ends, each_balls in zip(others, ends, balls, strict=True):
        placed(other, np.empty((N_POINTS, 3)), each_ends, each_balls, np.empty(N_CAPSULES))
    return ends.reshape(-1, 2, 3), balls.reshape(-1, 2)


def _expected(track: Track, time_s: Fraction) -> tuple[Filtered, Array]:
    """Predict a player: the Gaussian, and the whole state (35,)."""
    is_flying = bool(np.all(points_of(track.state)[6:8, 2] > BALL_HEIGHT_M + _FLYING_M))
    filtered = predicted(track.filtered, float(time_s - track.time_s), track.sliding, is_flying=is_flying)
    return filtered, np.concatenate([filtered.free, track.state[N_FREE:]])


def _followed(
    name: str, track: Track, predicted: tuple[Filtered, Array], hiding: tuple[Array, Array], frames: Frames
) -> tuple[Track, PlayerEstimate]:
    """Look for a player where `_expected` has him."""
    expected, state = predicted
    regions = regions_round(carried(frames, expected.hips_m_s), state[:3])
    if not regions:
        return replace(track, filtered=expected, time_s=frames.time_s), lost_player(name, frames, len(JOINTS))
    found = seen(regions, [track.tables[region.view] for region in regions], track.scale)
    information = np.linalg.inv(expected.covariance[:N_FREE, :N_FREE])
    prior = Prior(expected.free, information, _standing(track.state), np.full(N_POINTS, _SLIP_SD_M))
    fitted = fit(state, prior, found, hiding)
    evidence = _per_px(fitted.owned)
    if evidence < max(_LOST_SHARE * track.usual, _LEAST_EVIDENCE):
        return replace(track, filtered=expected, time_s=frames.time_s), lost_player(name, frames, len(JOINTS))
    filtered = updated(expected, fitted.state[:N_FREE], np.linalg.inv(fitted.information))
    views = [region.view for region in regions]
    track = replace(track, time_s=frames.time_s, filtered=filtered, state=fitted.state)
    hidden = _hidden(track, fitted.owned, views)
    n_views = _n_free(hidden, views)
    hidden = not_everywhere(hidden, views)
    estimate = _estimate(name, frames, track, fitted, n_views)
    if evidence < _LEAST_SHARE * track.usual:
        estimate = replace(estimate, status=Status.UNCERTAIN)
    elif estimate.status is Status.TRACKED:
        track = replace(track, usual=track.usual + _USUAL_RATE * (evidence - track.usual))
        if frames.time_s - track.renewed_s >= RENEWED_S:
            colours = renewed(replace(track.colours, hidden=hidden), track.state, regions, hiding)
            return replace(track, colours=colours, renewed_s=frames.time_s, tables=_tables(colours)), estimate
    return _with_hidden(track, hidden), estimate


def _standing(state: Array) -> Array:
    """Return where the balls of feet on the floor are, (9, 3) [m]; NaN elsewhere: a foot stays until it is lifted."""
    points = points_of(state)
    anchors = np.full(points.shape, np.nan)
    for ball in (6, 7):
        if points[ball, 2] < BALL_HEIGHT_M + _STANDING_M:
            anchors[ball] = points[ball]
    return anchors


def _tables(colours: Colours) -> tuple[Table, ...]:
    return tuple(colours.table(view) for view in range(len(colours.hidden)))


def _with_hidden(track: Track, hidden: Array) -> Track:
    """Take in what is hidden; a camera's table is made anew only when that changes it."""
    colours = replace(track.colours, hidden=hidden)
    tables = tuple(
        colours.table(view) if np.abs(hidden[view] - table.hidden).max() > _HIDDEN_STEP else table
        for view, table in enumerate(track.tables)
    )
    return replace(track, colours=colours, tables=tables)


def _hidden(track: Track, owned: Array, views: Sequence[int]) -> Array:
    """Say anew which kinds of surface are hidden in which view, by the evidence of what was fitted there."""
    hidden = track.colours.hidden.copy()
    by_kind = _OF_KIND @ owned.reshape(len(owned), -1, 2)  # (views, kinds, 2)
    for view, (evidence, area) in zip(views, by_kind.swapaxes(1, 2), strict=True):
        target = hidden_by(evidence / np.maximum(area, 1e-9), track.tables[view].usual)
        hidden[view] += _HIDDEN_RATE * np.where(area > _LEAST_AREA_PX, target - hidden[view], 0)
    return hidden


def _n_free(hidden: Array, views: Sequence[int]) -> int:
    """Count the views in which neither the player nor the legs alone are hidden."""
    most = np.maximum(hidden[views].mean(axis=1), hidden[views, SKIN:].mean(axis=1))
    return int(np.sum(most < _HIDDEN))


def _estimate(name: str, frames: Frames, track: Track, fitted: Fit, n_views: int) -> PlayerEstimate:
    by_state = fitted.by_state.reshape(N_POINTS, 3, -1)
    of_state = track.filtered.covariance[:N_FREE, :N_FREE] + fitted.by_shape
    covariance = by_state @ of_state @ by_state.swapaxes(1, 2)
    by_shape = _by_shape(fitted.state)
    covariance += by_shape @ track.shape_covariance @ by_shape.swapaxes(1, 2)
    sd = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 3)
    is_sure = n_views >= 2 and sd[: len(JOINTS) - 3].max() < _UNCERTAIN_SD_M
    return PlayerEstimate(
        player=name,
        index=frames.index,
        time_s=frames.time_s,
        status=Status.TRACKED if is_sure else Status.UNCERTAIN,
        points=fitted.points,
        covariance=covariance,
        score=_per_px(fitted.owned),
        n_views=n_views,
    )


def _by_shape(state: Array) -> Array:
    """Return how the points move with the lengths that stay: (9, 3, 5)."""
    points = points_of(state)
    moved = np.tile(state, (len(_SHAPE), 1))
    moved[np.arange(len(_SHAPE)), _SHAPE] += _STEP_M
    return np.stack([(points_of(each) - points) / _STEP_M for each in moved], axis=-1)


def _per_px(owned: Array) -> float:
    evidence, area = owned.sum(axis=(0, 1, 2))
    return float(evidence / area) if area > 0 else 0.0
