"""Players who are lost, looked for again: who stands there, and whose colours and place these are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import product

import numpy as np

from airborne.tracking.capsules.dynamics import N_FREE, N_SLIDING
from airborne.tracking.capsules.fit import JumperFit, JumperPrior, fit_jumper
from airborne.tracking.capsules.floor_search import Stander, find_standers
from airborne.tracking.capsules.jumper import N_DOF
from airborne.tracking.capsules.kernel_arguments import NOBODY
from airborne.tracking.capsules.standing import ColourViews
from airborne.tracking.capsules.track import Track, evidence_per_px
from airborne.tracking.capsules.views import map_evidence, player_regions
from airborne.types import Array
from airborne.video import Frames
from airborne.video.small import shrink

UNOCCLUDED = 0.05  # probability of a class to be occluded, of somebody of whom nothing is known
_LOST_S, _EVERY_S = Fraction(1, 4), Fraction(1, 5)  # how long a player is lost before a look, and between looks
_RARER = 4  # who is lost for long is looked for once in this share of the time: a look takes a second or two
_FARTHEST_M = 4.0  # from where a player was lost, along and across
_LEAST_SUPPORT = 1.1  # [nat m2] of somebody, see `tracking.first_pose.players`
_MOST_POSES = 3  # of each that are tried
# chosen by hand: of a player's usual evidence, what is as likely another's, and its logistic scale
_LIKENESS, _LIKENESS_SD = 0.7, 0.05
_PLACE_SD_M, _SPEED_SD_M_S = 0.5, 1.0  # how far a player is from where it was lost
_LEAST_PROBABILITY = 0.95  # of an identity that is taken
_POSE_SD = np.array([0.15] * 3 + [0.5] * 5 + [0.5, 0.4, 0.4, 0.5, 0.4] * 2 + [0.03] * N_SLIDING)  # [m, rad]


def is_due(track: Track, time_s: Fraction) -> bool:
    """Return whether a player should be looked for."""
    if track.lost_s is None or time_s - track.lost_s < _LOST_S:
        return False
    if track.searched_s is None or track.searched_s < track.lost_s:
        return True
    return time_s - track.searched_s >= max(_EVERY_S, (track.searched_s - track.lost_s) / _RARER)


def find_again(
    lost: Mapping[str, Track], seen: Sequence[Array], frames: Frames
) -> tuple[dict[str, JumperFit], set[str]]:
    """Look for lost players among those who stand there, without those who are `seen`, states (35,).

    Returns the fits of those who are found, and who may be there but could be two.
    """
    views = [shrink(view) for view in frames.views if view is not None]
    if len(views) < 2:
        return {}, set()
    places = np.array([track.state[:2] for track in lost.values()])
    zone = np.array([places.min(axis=0) - _FARTHEST_M, places.max(axis=0) + _FARTHEST_M])
    colours = ColourViews.of(views, zone)
    for state in seen:
        colours = colours.without(state)
    standers = [each for each in find_standers(colours, zone, zone) if each.support[0] > _LEAST_SUPPORT]
    fits = [[_fit(track, stander, frames) for stander in standers] for track in lost.values()]
    nats = np.array(
        [[_likeness(track, fit, frames.time_s) for fit in row] for track, row in zip(lost.values(), fits, strict=True)]
    ).reshape(len(lost), len(standers))
    probability = identity_probabilities(nats)
    found, unclear = {}, set()
    for i, name in enumerate(lost):
        if len(standers) and probability[i].max() >= _LEAST_PROBABILITY:
            found[name] = fits[i][int(probability[i].argmax())]
        elif probability[i].sum() >= _LEAST_PROBABILITY:
            unclear.add(name)
    return found, unclear


def identity_probabilities(nats: Array) -> Array:
    """Return the probability (lost, standers) that a lost player is a stander: nats (lost, standers), 0 nats for none.

    No two lost players are the same stander.
    """
    n_lost, n_standers = nats.shape
    choices = [chosen for chosen in product(range(-1, n_standers), repeat=n_lost) if _are_different(chosen)]
    scores = np.array([sum(nats[i, j] for i, j in enumerate(chosen) if j >= 0) for chosen in choices])
    weights = np.exp(scores - scores.max())
    probability = np.zeros((n_lost, n_standers))
    for chosen, weight in zip(choices, weights / weights.sum(), strict=True):
        for i, j in enumerate(chosen):
            if j >= 0:
                probability[i, j] += weight
    return probability


def _are_different(chosen: Sequence[int]) -> bool:
    taken = [j for j in chosen if j >= 0]
    return len(set(taken)) == len(taken)


def _likeness(track: Track, fit: JumperFit, time_s: Fraction) -> float:
    """Return by how much a fit is rather the lost player than another [nat]: its colours, and how far it is away."""
    away_m = float(np.linalg.norm(fit.state[:2] - track.state[:2]))
    sd_m = _PLACE_SD_M + _SPEED_SD_M_S * float(time_s - (track.lost_s or time_s))
    share = evidence_per_px(fit.owned) / track.reference_evidence
    return (share - _LIKENESS) / _LIKENESS_SD - 0.5 * (away_m / sd_m) ** 2


def _fit(track: Track, stander: Stander, frames: Frames) -> JumperFit:
    """Fit a lost player's own shape and colours to somebody who stands there."""
    fits = []
    for pose in stander.states[:_MOST_POSES, :N_DOF]:
        state = np.concatenate([pose, track.sliding, track.state[N_FREE:]])
        regions = player_regions(frames, state[:3])
        occlusion = np.full(track.colours.occlusion.shape[1], UNOCCLUDED)
        tables = [track.colours.table(region.view, occlusion) for region in regions]
        prior = JumperPrior(state[:N_FREE], np.diag(1 / _POSE_SD**2))
        fits.append(fit_jumper(state, prior, map_evidence(regions, tables, track.scale), NOBODY))
    return max(fits, key=lambda fit: fit.total)
