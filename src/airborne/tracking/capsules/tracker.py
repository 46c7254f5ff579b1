"""Tracking of one or several jumpers, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from airborne.tracking.capsules.dynamics import N_FREE, N_SLIDING, GaussianState, predict, state_at_rest, update
from airborne.tracking.capsules.equations import N_CAPSULES, N_LENGTHS, N_POINTS, pose_state
from airborne.tracking.capsules.first_frame import fit_first_frame, points_of, start_state
from airborne.tracking.capsules.fit import JumperFit, JumperPrior, fit_jumper
from airborne.tracking.capsules.jumper import CAPSULES, FOOT_HEIGHT_M, JOINTS, N_DOF, PELVIS, SKIN, SURFACE_CLASSES
from airborne.tracking.capsules.kernel_arguments import Capsules
from airborne.tracking.capsules.recovery import UNOCCLUDED, find_again, is_due
from airborne.tracking.capsules.surface_colours import (
    COLOUR_UPDATE_S,
    SurfaceColours,
    limit_occlusion,
    occlusion_chance,
    update_colours,
)
from airborne.tracking.capsules.track import Sighting, Track, evidence_per_px
from airborne.tracking.capsules.unseen_legs import LEAST_GAIN, find_unseen_legs, free_leg
from airborne.tracking.capsules.views import EvidenceTable, map_evidence, player_regions
from airborne.tracking.estimate import Status
from airborne.tracking.players import PlayerEstimate, PlayerStart, lost_player_estimate
from airborne.tracking.time_offsets import compensate_at_velocity
from airborne.types import Array
from airborne.video import Frames

# chosen by hand on synthetic blocks; without these the joints err by 18.6 to 19.0 mm, with them by 18.8:
# benchmarks/results/blocker_variants.csv, without other players, standing feet, flight, hidden views
_NEAR_M = 3.0  # jumpers further away do not occlude
_CONTACT_M, _SLIP_SD_M = 0.02, 0.02  # a foot this low is in contact with the floor; how far it slips in a frame
_AIRBORNE_M = 0.06  # both feet this far above their height in standing: airborne
_LEAST_SHARE, _LOST_SHARE = 0.5, 0.25  # of the reference evidence per pixel: uncertain, lost
_LEAST_EVIDENCE = 0.3  # per pixel [nat]; less counts as lost
_OCCLUDED = 0.45  # mean probability of occlusion, of all classes or of the legs', above which a view does not count
_REFERENCE_RATE = 0.05  # of the newest frame in the running reference
_UNCERTAIN_SD_M = 0.06  # a joint less certain than this makes the estimate uncertain
_LEAST_AREA_PX = 8.0  # of a class in a map, to judge its occlusion
_OCCLUSION_RATE, _OCCLUSION_STEP = 0.3, 0.08  # of the newest frame; a smaller change leaves the tables as they are
_SHAPE = np.arange(N_DOF + PELVIS, N_DOF + N_LENGTHS)  # the constant lengths in a state
_STEP_M = 1e-4  # of the finite differences
# (classes, halves of capsules)
_HALVES_OF_CLASS = (CAPSULES[:, :2].ravel() == np.arange(len(SURFACE_CLASSES))[:, None]).astype(float)


class Blocker:
    """Track jumpers by Gauss-Newton on evidence maps."""

    joints = JOINTS

    def __init__(self, starts: Sequence[PlayerStart]) -> None:
        """Take the players as they start; those with only a torso are left out."""
        self._starts = [start for start in starts if start.has_legs]

    def init(self) -> Mapping[str, Track]:
        """Return the state before the first frame: nobody."""
        return {}

    def step(
        self, state: Mapping[str, Track], frames: Frames
    ) -> tuple[Mapping[str, Track], tuple[PlayerEstimate, ...]]:
        """Track one time; raises TrialError where no image of the first frame shows a player."""
        if not state:
            return self._first(frames)
        expected = {name: _predict_track(track, frames.time_s) for name, track in state.items()}
        tracks, estimates = {}, []
        for name, track in state.items():
            others = [each for other, (_, each) in expected.items() if other != name and state[other].lost_s is None]
            occluders = occluding_capsules(expected[name][1], others)
            tracks[name], estimate = _track_player(name, track, frames, predicted=expected[name], occluders=occluders)
            estimates.append(estimate)
        return self._look_for_lost(tracks, {each.player: each for each in estimates}, frames)

    def _look_for_lost(
        self, tracks: dict[str, Track], estimates: dict[str, PlayerEstimate], frames: Frames
    ) -> tuple[dict[str, Track], tuple[PlayerEstimate, ...]]:
        """Look for the players who have been lost for a while."""
        sighting = Sighting(
            frames, tuple(tracks[name].state for name, each in estimates.items() if each.status is not Status.LOST)
        )
        for name, estimate in estimates.items():
            lost_s = (tracks[name].lost_s or frames.time_s) if estimate.status is Status.LOST else None
            tracks[name] = replace(tracks[name], lost_s=lost_s)
            if estimate.status is Status.TRACKED:
                tracks[name] = replace(tracks[name], sighting=sighting, bystanders=None)
        lost = {name: track for name, track in tracks.items() if track.lost_s is not None}
        if any(is_due(track, frames.time_s) for track in lost.values()):
            seen = [track.state for track in tracks.values() if track.lost_s is None]
            look = find_again(lost, seen, frames)
            for name, track in lost.items():
                is_unclear = name in look.unclear
                note = "not taken up again: two could be meant" if is_unclear and not track.is_unclear else ""
                tracks[name] = replace(
                    track, searched_s=frames.time_s, is_unclear=is_unclear, bystanders=look.bystanders
                )
                estimates[name] = replace(estimates[name], note=note)
                if name in look.fits:
                    tracks[name], estimates[name] = _take_up(name, tracks[name], look.fits[name], frames)
        return tracks, tuple(estimates.values())

    def _first(self, frames: Frames) -> tuple[dict[str, Track], tuple[PlayerEstimate, ...]]:
        tracks, estimates = {}, []
        starts = {start.name: start_state(start.name, start.joints_m) for start in self._starts}
        for start in self._starts:
            own = starts[start.name]
            occluders = occluding_capsules(own, [each for name, each in starts.items() if name != start.name])
            first = fit_first_frame(start.name, start.joints_m, frames, occluders)
            state, covariance = first.fit.state, np.linalg.inv(first.fit.information)
            tracks[start.name] = Track(
                frames.time_s,
                state_at_rest(state[:N_FREE], covariance[:N_FREE, :N_FREE]),
                state,
                state[N_DOF : N_DOF + N_SLIDING],
                covariance[np.ix_(_SHAPE, _SHAPE)],
                first.colours,
                frames.time_s,
                _tables(first.colours),
                first.scale,
                evidence_per_px(first.fit.owned),
            )
            n_views = _n_unoccluded(
                first.colours.occlusion, [v for v, view in enumerate(frames.views) if view is not None]
            )
            pose_fit = replace(
                first.fit,
                jacobian=first.fit.jacobian[:, :N_FREE],
                model_error_covariance=first.fit.model_error_covariance[:N_FREE, :N_FREE],
            )
            estimate = _estimate(start.name, frames, tracks[start.name], fitted=pose_fit, n_views=n_views)
            estimates.append(
                estimate if estimate.score > _LEAST_EVIDENCE else lost_player_estimate(start.name, frames, len(JOINTS))
            )
        return tracks, tuple(estimates)


def occluding_capsules(state: Array, others: Sequence[Array]) -> Capsules:
    """Return what may occlude a jumper: the capsules of others nearby.

    state (35,) is the jumper's, others (35,) each.
    """
    others = [other for other in others if np.linalg.norm(other[:3] - state[:3]) < _NEAR_M]
    ends, end_radii = np.empty((len(others), N_CAPSULES, 2, 3)), np.empty((len(others), N_CAPSULES, 2))
    for other, each_ends, each_radii in zip(others, ends, end_radii, strict=True):
        pose_state(other, np.empty((N_POINTS, 3)), each_ends, each_radii, np.empty(N_CAPSULES))
    return Capsules(ends.reshape(-1, 2, 3), end_radii.reshape(-1, 2))


def _predict_track(track: Track, time_s: Fraction) -> tuple[GaussianState, Array]:
    """Predict a player: the Gaussian, and the whole state (35,)."""
    is_airborne = bool(np.all(points_of(track.state)[6:8, 2] > FOOT_HEIGHT_M + _AIRBORNE_M))
    filtered = predict(track.filtered, float(time_s - track.time_s), track.sliding, is_airborne=is_airborne)
    return filtered, np.concatenate([filtered.free, track.state[N_FREE:]])


def _track_player(
    name: str,
    track: Track,
    frames: Frames,
    *,
    predicted: tuple[GaussianState, Array],
    occluders: Capsules,
) -> tuple[Track, PlayerEstimate]:
    """Fit a player from the prediction of `_predict_track`."""
    expected, state = predicted
    regions = player_regions(compensate_at_velocity(frames, expected.hips_velocity_m_s), state[:3])
    if not regions:
        return replace(track, filtered=expected, time_s=frames.time_s), lost_player_estimate(name, frames, len(JOINTS))
    region_maps = map_evidence(regions, [track.tables[region.view] for region in regions], track.scale)

    def fit(expected: GaussianState) -> JumperFit:
        information = np.linalg.inv(expected.covariance[:N_FREE, :N_FREE])
        prior = JumperPrior(expected.free, information, _contact_points(track.state), np.full(N_POINTS, _SLIP_SD_M))
        return fit_jumper(np.concatenate([expected.free, state[N_FREE:]]), prior, region_maps, occluders)

    fitted = fit(expected)
    evidence, reference = evidence_per_px(fitted.owned), track.reference_evidence
    if evidence < max(_LOST_SHARE * reference, _LEAST_EVIDENCE):
        return replace(track, filtered=expected, time_s=frames.time_s), lost_player_estimate(name, frames, len(JOINTS))
    for leg in find_unseen_legs(fitted.owned, reference):
        freed = free_leg(expected, fitted.state, leg)
        again = fit(freed)
        if again.nats > fitted.nats + LEAST_GAIN and leg not in find_unseen_legs(again.owned, reference):
            expected, fitted, evidence = freed, again, evidence_per_px(again.owned)
    filtered = update(expected, fitted.state[:N_FREE], np.linalg.inv(fitted.information))
    views = [region.view for region in regions]
    track = replace(track, time_s=frames.time_s, filtered=filtered, state=fitted.state)
    occlusion = _update_occlusion(track, fitted.owned, views)
    n_views = _n_unoccluded(occlusion, views)
    occlusion = limit_occlusion(occlusion, views)
    estimate = _estimate(name, frames, track, fitted=fitted, n_views=n_views)
    if evidence < _LEAST_SHARE * reference:
        estimate = replace(estimate, status=Status.UNCERTAIN)
    elif estimate.status is Status.TRACKED:
        track = replace(track, reference_evidence=reference + _REFERENCE_RATE * (evidence - reference))
        if frames.time_s - track.colours_updated_s >= COLOUR_UPDATE_S:
            colours = update_colours(replace(track.colours, occlusion=occlusion), track.state, regions, occluders)
            return replace(track, colours=colours, colours_updated_s=frames.time_s, tables=_tables(colours)), estimate
    return _with_occlusion(track, occlusion), estimate


def _take_up(name: str, track: Track, fitted: JumperFit, frames: Frames) -> tuple[Track, PlayerEstimate]:
    """Go on with a player who was found again."""
    away_s = float(frames.time_s - (track.lost_s or frames.time_s))
    filtered = state_at_rest(fitted.state[:N_FREE], np.linalg.inv(fitted.information))
    colours = replace(track.colours, occlusion=np.full_like(track.colours.occlusion, UNOCCLUDED))
    track = replace(track, filtered=filtered, state=fitted.state, colours=colours, tables=_tables(colours), lost_s=None)
    estimate = _estimate(name, frames, track, fitted=fitted, n_views=0)
    return track, replace(estimate, note=f"found again after {away_s:.2g} s")


def _contact_points(state: Array) -> Array:
    """Return the positions of feet on the floor, (9, 3) [m]; NaN elsewhere: a foot in contact stays until lifted."""
    points = points_of(state)
    anchors = np.full(points.shape, np.nan)
    for foot in (6, 7):
        if points[foot, 2] < FOOT_HEIGHT_M + _CONTACT_M:
            anchors[foot] = points[foot]
    return anchors


def _tables(colours: SurfaceColours) -> tuple[EvidenceTable, ...]:
    return tuple(colours.table(view) for view in range(len(colours.occlusion)))


def _with_occlusion(track: Track, occlusion: Array) -> Track:
    """Set the occlusion; a camera's table is recomputed only where that changes it."""
    colours = replace(track.colours, occlusion=occlusion)
    tables = tuple(
        colours.table(view) if np.abs(occlusion[view] - table.occlusion).max() > _OCCLUSION_STEP else table
        for view, table in enumerate(track.tables)
    )
    return replace(track, colours=colours, tables=tables)


def _update_occlusion(track: Track, owned: Array, views: Sequence[int]) -> Array:
    """Update which classes are occluded in which view, by the evidence of the fit there."""
    occlusion = track.colours.occlusion.copy()
    by_class = _HALVES_OF_CLASS @ owned.reshape(len(owned), -1, 2)  # (views, classes, 2)
    for view, (evidence, area) in zip(views, by_class.swapaxes(1, 2), strict=True):
        target = occlusion_chance(evidence / np.maximum(area, 1e-9), track.tables[view].expected)
        occlusion[view] += _OCCLUSION_RATE * np.where(area > _LEAST_AREA_PX, target - occlusion[view], 0)
    return occlusion


def _n_unoccluded(occlusion: Array, views: Sequence[int]) -> int:
    """Count the views in which neither the player nor the legs alone are occluded."""
    most = np.maximum(occlusion[views].mean(axis=1), occlusion[views, SKIN:].mean(axis=1))
    return int(np.sum(most < _OCCLUDED))


def _estimate(name: str, frames: Frames, track: Track, *, fitted: JumperFit, n_views: int) -> PlayerEstimate:
    jacobian = fitted.jacobian.reshape(N_POINTS, 3, -1)
    state_covariance = track.filtered.covariance[:N_FREE, :N_FREE] + fitted.model_error_covariance
    covariance = jacobian @ state_covariance @ jacobian.swapaxes(1, 2)
    length_jacobian = _length_jacobian(fitted.state)
    covariance += length_jacobian @ track.shape_covariance @ length_jacobian.swapaxes(1, 2)
    sd = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 3)
    is_certain = n_views >= 2 and sd[: len(JOINTS) - 3].max() < _UNCERTAIN_SD_M
    is_certain = is_certain and not len(find_unseen_legs(fitted.owned, track.reference_evidence))
    return PlayerEstimate(
        player=name,
        index=frames.index,
        time_s=frames.time_s,
        status=Status.TRACKED if is_certain else Status.UNCERTAIN,
        points=fitted.points,
        covariance=covariance,
        score=evidence_per_px(fitted.owned),
        n_views=n_views,
    )


def _length_jacobian(state: Array) -> Array:
    """Return the points' Jacobian by the constant lengths: (9, 3, 5)."""
    points = points_of(state)
    shifted = np.tile(state, (len(_SHAPE), 1))
    shifted[np.arange(len(_SHAPE)), _SHAPE] += _STEP_M
    return np.stack([(points_of(each) - points) / _STEP_M for each in shifted], axis=-1)
