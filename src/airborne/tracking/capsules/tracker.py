"""Tracking of one or several jumpers, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from airborne.errors import count
from airborne.tracking.capsules.bystanders import (
    APART_M,
    FOLLOWED_EVERY_S,
    LOOK_S,
    find_bystanders,
    occluding_capsules,
)
from airborne.tracking.capsules.dynamics import (
    N_FREE,
    N_SLIDING,
    GaussianState,
    predict,
    predict_mean,
    state_at_rest,
    update,
)
from airborne.tracking.capsules.equations import N_POINTS
from airborne.tracking.capsules.first_frame import FirstFrameFit, fit_first_frame, points_of, start_state
from airborne.tracking.capsules.fit import JumperFit, JumperPrior, fit_jumper
from airborne.tracking.capsules.jumper import FOOT_HEIGHT_M, JOINTS, N_DOF
from airborne.tracking.capsules.kernel_arguments import Capsules
from airborne.tracking.capsules.occlusion import count_unoccluded, evidence_tables, update_occlusion, with_occlusion
from airborne.tracking.capsules.recovery import UNOCCLUDED, find_again, is_due
from airborne.tracking.capsules.registration import check_registration
from airborne.tracking.capsules.status import SHAPE, estimate_player, widen_estimate
from airborne.tracking.capsules.surface_colours import (
    COLOUR_UPDATE_S,
    limit_occlusion,
    update_colours,
)
from airborne.tracking.capsules.track import Everybody, Sighting, Track, evidence_per_px
from airborne.tracking.capsules.unseen_legs import LEAST_GAIN, find_unseen_legs, free_leg
from airborne.tracking.capsules.views import map_evidence, player_regions
from airborne.tracking.estimate import Status, worst_status
from airborne.tracking.players import PlayerEstimate, PlayerStart, lost_player_estimate
from airborne.tracking.time_offsets import compensate_at_velocity
from airborne.types import Array
from airborne.video import Frames

# chosen by hand on synthetic blocks; without these the joints err by 20.8 to 21.4 mm, with them by 20.9:
# benchmarks/results/blocker_variants.csv, without other players, standing feet, flight, hidden views
_CONTACT_M, _SLIP_SD_M = 0.02, 0.02  # a foot this low is in contact with the floor; how far it slips in a frame
_AIRBORNE_M = 0.06  # both feet this far above their height in standing: airborne
_LOST_SHARE = 0.25  # of the reference evidence per pixel; less counts as lost
_LEAST_EVIDENCE = 0.3  # per pixel [nat]; less counts as lost
_HIPS_AND_KNEES = 4  # the first joints: while these are tracked, colours and evidence are learned
_REFERENCE_RATE = 0.05  # of the newest frame in the running reference


class Blocker:
    """Track jumpers by Gauss-Newton on evidence maps."""

    joints = JOINTS

    def __init__(self, starts: Sequence[PlayerStart]) -> None:
        """Take the players as they start; those with only a torso are left out."""
        self._starts = [start for start in starts if start.has_legs]

    def init(self) -> Everybody:
        """Return the state before the first frame: nobody."""
        return Everybody({})

    def step(self, state: Everybody, frames: Frames) -> tuple[Everybody, tuple[PlayerEstimate, ...]]:
        """Track one time; raises TrialError where no image of the first frame shows a player.

        A camera that is clearly shifted is left out, and its image looked at again later.
        """
        after, estimates = self._follow(state, frames)
        registration = check_registration(state, after, estimates, frames)
        if registration.left_out != state.registration.left_out:
            after, estimates = self._follow(state._replace(registration=registration), frames)
        wide = registration.covariance
        widened = (widen_estimate(each, wide[each.player]) if each.player in wide else each for each in estimates)
        return after._replace(registration=registration), tuple(widened)

    def _follow(self, state: Everybody, frames: Frames) -> tuple[Everybody, tuple[PlayerEstimate, ...]]:
        """Track one time, without the camera that is left out."""
        left_out = state.registration.left_out
        frames = replace(frames, views=tuple(None if i == left_out else each for i, each in enumerate(frames.views)))
        if not state.players:
            return self._first(frames)
        tracks = [*state.players.values(), *state.bystanders]
        expected = [_predict_state(track, frames.time_s) for track in tracks]

        def follow(i: int, name: str) -> tuple[Track, PlayerEstimate]:
            others = [each for j, each in enumerate(expected) if j != i and tracks[j].lost_s is None]
            return _track_player(name, tracks[i], frames, occluders=occluding_capsules(expected[i], others))

        players, estimates = {}, {}
        for i, name in enumerate(state.players):
            players[name], estimates[name] = follow(i, name)
        bystanders = []
        for i, track in enumerate(state.bystanders, len(players)):
            is_due = frames.time_s - track.time_s >= FOLLOWED_EVERY_S
            track, estimate = follow(i, "bystander") if is_due else (track, None)
            is_lost = estimate is not None and estimate.status is Status.LOST
            hips_m = [np.linalg.norm(track.state[:3] - each.state[:3]) for each in players.values()]
            if not is_lost and min(hips_m) > APART_M:
                bystanders.append(track)
        followed = state._replace(players=players, bystanders=tuple(bystanders))
        return self._look_for_lost(look_for_others(followed, estimates, frames), estimates, frames)

    def _look_for_lost(
        self, state: Everybody, estimates: dict[str, PlayerEstimate], frames: Frames
    ) -> tuple[Everybody, tuple[PlayerEstimate, ...]]:
        """Look for the players who have been lost for a while."""
        tracks = {
            name: replace(
                track, lost_s=(track.lost_s or frames.time_s) if estimates[name].status is Status.LOST else None
            )
            for name, track in state.players.items()
        }
        seen = [track.state for track in (*tracks.values(), *state.bystanders) if track.lost_s is None]
        sighting = Sighting(frames, tuple(seen))
        for name, estimate in estimates.items():
            if estimate.joint_status[0] is Status.TRACKED:
                tracks[name] = replace(tracks[name], sighting=sighting, bystanders=None)
        lost = {name: track for name, track in tracks.items() if track.lost_s is not None}
        if any(is_due(track, frames.time_s) for track in lost.values()):
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
        return state._replace(players=tracks), tuple(estimates.values())

    def _first(self, frames: Frames) -> tuple[Everybody, tuple[PlayerEstimate, ...]]:
        tracks, estimates = {}, []
        starts = [start_state(start.name, start.joints_m) for start in self._starts]
        found = find_bystanders(starts, frames)
        fits = fit_starts(self._starts, starts, frames, [each.fit.state for each in found])
        for start, first in zip(self._starts, fits, strict=True):
            tracks[start.name] = _first_track(first, frames)
            n_views = count_unoccluded(
                first.colours.occlusion, [v for v, view in enumerate(frames.views) if view is not None]
            )
            pose_fit = replace(
                first.fit,
                jacobian=first.fit.jacobian[:, :N_FREE],
                model_error_covariance=first.fit.model_error_covariance[:N_FREE, :N_FREE],
            )
            estimate = estimate_player(start.name, frames, tracks[start.name], fitted=pose_fit, n_views=n_views)
            estimates.append(
                estimate if estimate.score > _LEAST_EVIDENCE else lost_player_estimate(start.name, frames, len(JOINTS))
            )
        if found:
            note = f"{count(len(found), 'bystander')} followed whom the start does not name: they may hide players"
            estimates[0] = replace(estimates[0], note=note)
        bystanders = tuple(_first_track(each, frames) for each in found)
        return Everybody(tracks, bystanders, frames.time_s), tuple(estimates)


def fit_starts(
    starts: Sequence[PlayerStart], states: Sequence[Array], frames: Frames, others: Sequence[Array] = ()
) -> list[FirstFrameFit]:
    """Fit players to the first frame, from states (35,) nearest to their starts; `others` (35,) stand there too.

    Raises TrialError where no image shows a player.
    """
    fits = []
    for i, (start, state) in enumerate(zip(starts, states, strict=True)):
        occluders = occluding_capsules(state, [*states[:i], *states[i + 1 :], *others])
        fits.append(fit_first_frame(start.name, start.joints_m, frames, occluders, start=state))
    return fits


def look_for_others(state: Everybody, estimates: Mapping[str, PlayerEstimate], frames: Frames) -> Everybody:
    """Look who came before the cameras since the last look, where a player is uncertain and none lost.

    Whoever is found might be the lost one.
    """
    statuses = {name: estimate.status for name, estimate in estimates.items()}
    players = [state.players[name].state for name, status in statuses.items() if status is Status.UNCERTAIN]
    if not players or Status.LOST in statuses.values() or frames.time_s - state.looked_s < LOOK_S:
        return state
    known = [track.state for track in (*state.players.values(), *state.bystanders)]
    found = find_bystanders(players, frames, known)
    bystanders = (*state.bystanders, *(_first_track(each, frames) for each in found))
    return state._replace(bystanders=bystanders, looked_s=frames.time_s)


def _first_track(first: FirstFrameFit, frames: Frames) -> Track:
    state, covariance = first.fit.state, np.asarray(np.linalg.inv(first.fit.information), float)
    return Track(
        frames.time_s,
        state_at_rest(state[:N_FREE], covariance[:N_FREE, :N_FREE]),
        state,
        state[N_DOF : N_DOF + N_SLIDING],
        covariance[np.ix_(SHAPE, SHAPE)],
        first.colours,
        frames.time_s,
        evidence_tables(first.colours),
        first.scale,
        evidence_per_px(first.fit.owned),
    )


def _predict_state(track: Track, time_s: Fraction) -> Array:
    """Return the state (35,) in which a player is expected."""
    mean = predict_mean(
        track.filtered, float(time_s - track.time_s), track.sliding, is_airborne=_is_airborne(track.state)
    )
    return np.concatenate([mean[:N_FREE], track.state[N_FREE:]])


def _is_airborne(state: Array) -> bool:
    return bool(np.all(points_of(state)[6:8, 2] > FOOT_HEIGHT_M + _AIRBORNE_M))


def _track_player(name: str, track: Track, frames: Frames, *, occluders: Capsules) -> tuple[Track, PlayerEstimate]:
    """Fit a player to images, from where the last estimate leads."""
    dt_s, is_airborne = float(frames.time_s - track.time_s), _is_airborne(track.state)
    expected = predict(track.filtered, dt_s, track.sliding, is_airborne=is_airborne)
    state = np.concatenate([expected.free, track.state[N_FREE:]])
    regions = player_regions(compensate_at_velocity(frames, expected.hips_velocity_m_s), state[:3])
    if not regions:
        return replace(track, filtered=expected, time_s=frames.time_s), lost_player_estimate(name, frames, len(JOINTS))
    region_maps = map_evidence(regions, [track.tables[region.view] for region in regions], track.scale)

    def fit(expected: GaussianState) -> JumperFit:
        information = np.asarray(np.linalg.inv(expected.covariance[:N_FREE, :N_FREE]), float)
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
    filtered = update(expected, fitted.state[:N_FREE], np.asarray(np.linalg.inv(fitted.information), float))
    views = [region.view for region in regions]
    track = replace(track, time_s=frames.time_s, filtered=filtered, state=fitted.state)
    occlusion = update_occlusion(track, fitted.owned, views)
    n_views = count_unoccluded(occlusion, views)
    occlusion = limit_occlusion(occlusion, views)
    estimate = estimate_player(name, frames, track, fitted=fitted, n_views=n_views)
    if worst_status(estimate.joint_status[:_HIPS_AND_KNEES]) is Status.TRACKED:
        track = replace(track, reference_evidence=reference + _REFERENCE_RATE * (evidence - reference))
        if frames.time_s - track.colours_updated_s >= COLOUR_UPDATE_S:
            colours = update_colours(replace(track.colours, occlusion=occlusion), track.state, regions, occluders)
            track = replace(track, colours=colours, colours_updated_s=frames.time_s, tables=evidence_tables(colours))
            return track, estimate
    return with_occlusion(track, occlusion), estimate


def _take_up(name: str, track: Track, fitted: JumperFit, frames: Frames) -> tuple[Track, PlayerEstimate]:
    """Go on with a player who was found again."""
    away_s = float(frames.time_s - (track.lost_s or frames.time_s))
    filtered = state_at_rest(fitted.state[:N_FREE], np.asarray(np.linalg.inv(fitted.information), float))
    colours = replace(track.colours, occlusion=np.full_like(track.colours.occlusion, UNOCCLUDED))
    track = replace(
        track, filtered=filtered, state=fitted.state, colours=colours, tables=evidence_tables(colours), lost_s=None
    )
    estimate = estimate_player(name, frames, track, fitted=fitted, n_views=0)
    return track, replace(estimate, note=f"found again after {away_s:.2g} s")


def _contact_points(state: Array) -> Array:
    """Return the positions of feet on the floor, (9, 3) [m]; NaN elsewhere: a foot in contact stays until lifted."""
    points = points_of(state)
    anchors = np.full(points.shape, np.nan)
    for foot in (6, 7):
        if points[foot, 2] < FOOT_HEIGHT_M + _CONTACT_M:
            anchors[foot] = points[foot]
    return anchors
