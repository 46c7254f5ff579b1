"""Players who are lost, looked for again: who stands there, and whose colours and place these are.

Team-mates wear the same, so that places decide most: who stood elsewhere while the player was still tracked is a
bystander, and stays one from look to look.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import logsumexp

from airborne.tracking.capsules.dynamics import N_FREE, N_SLIDING
from airborne.tracking.capsules.fit import JumperFit, JumperPrior, fit_jumper
from airborne.tracking.capsules.floor_search import Stander, find_others, floor_grid
from airborne.tracking.capsules.jumper import N_DOF
from airborne.tracking.capsules.kernel_arguments import NOBODY
from airborne.tracking.capsules.track import Bystander, Track, evidence_per_px
from airborne.tracking.capsules.unseen_legs import LEG_SD_RAD
from airborne.tracking.capsules.views import map_evidence, player_regions
from airborne.types import Array
from airborne.video import Frames
from airborne.video.small import shrink

UNOCCLUDED = 0.05  # probability of a class to be occluded, of somebody of whom nothing is known
_LOST_S, _EVERY_S = Fraction(1, 4), Fraction(1, 5)  # how long a player is lost before a look, and between looks
_RARER = 4  # who is lost for long is looked for once in this share of the time: a look takes a second or two
_FARTHEST_M = 4.0  # from where a player was lost, along and across
_MOST_POSES = 3  # of each that are tried
# of a player's usual evidence, what is as likely another's, and its logistic scale; chosen on synthetic blocks 6100 to
# 6102: players themselves have 0.65 or more, team-mates in the same dress 0.1 to 0.4 less, opponents less than zero
_LIKENESS, _LIKENESS_SD = 0.6, 0.15
# of a difference of two players' fits to one stander. Of 26 pairs of synthetic blocks 6200 to 6225 right fits had 178
# nats more than exchanged ones, sd 105, of which 33 from look to look: 2 * 178 / 105^2, of normal distributions
_WHO_PER_NAT = 0.032
# how far people are from where they were: of synthetic blocks 6200 to 6229 players move 0.17 m a second (root mean
# square, each axis); 0.3 is more, as who leaves walks
_PLACE_SD_M, _SPEED_SD_M_S, _MOST_SD_M = 0.3, 0.3, 2.0
_NEWCOMERS_PER_M2 = 0.001  # that a look shows: one in ten looks over 8 m x 8 m has one, and half of those lost are back
_LEAST_PROBABILITY = 0.95  # of an identity that is taken
_BYSTANDER = 0.5  # probability to be a lost player, below which somebody is a bystander
_REMEMBERED_S = 2  # how long a bystander who is not seen is remembered
_MOST_NATS = 6.0  # against a place, beyond which nobody is tried
_POSE_SD = np.array([0.15] * 3 + [0.5] * 5 + [*LEG_SD_RAD] * 2 + [0.03] * N_SLIDING)  # [m, rad]


def is_due(track: Track, time_s: Fraction) -> bool:
    """Return whether a player should be looked for."""
    if track.lost_s is None or time_s - track.lost_s < _LOST_S:
        return False
    if track.searched_s is None or track.searched_s < track.lost_s:
        return True
    return time_s - track.searched_s >= max(_EVERY_S, (track.searched_s - track.lost_s) / _RARER)


class Recovery(NamedTuple):
    """What a look for lost players shows."""

    fits: dict[str, JumperFit]  # of those who are found
    unclear: set[str]  # who may be there, but could be two
    bystanders: tuple[Bystander, ...]


def find_again(lost: Mapping[str, Track], seen: Sequence[Array], frames: Frames) -> Recovery:
    """Look for lost players among those who stand there, without those who are `seen`, states (35,)."""
    places = np.array([track.state[:2] for track in lost.values()])
    zone = np.array([places.min(axis=0) - _FARTHEST_M, places.max(axis=0) + _FARTHEST_M])
    known, standers, now_s = _bystanders(lost, zone), _standers(frames, seen, zone), frames.time_s
    floor_m = np.array([stander.floor_m for stander in standers]).reshape(-1, 2)
    of_known = np.array([_place_nats(*each, floor_m, now_s) for each in known]).reshape(len(known), len(standers))
    nats = np.array([_place_nats(track.state[:2], track.lost_s, floor_m, now_s) for track in lost.values()])
    claimed = _claim(of_known, nats)
    nats[:, list(claimed)] = -np.inf
    nats[nats < -_MOST_NATS] = -np.inf
    fits, share, total = {}, np.full(nats.shape, -np.inf), np.full(nats.shape, -np.inf)
    for i, track in enumerate(lost.values()):
        for j in np.flatnonzero(np.isfinite(nats[i])):
            fits[i, j] = _fit(track, standers[j], frames)
            share[i, j] = evidence_per_px(fits[i, j].owned) / track.reference_evidence
            total[i, j] = fits[i, j].total
    probability = identity_probabilities(nats + colour_nats(share, total))
    found, unclear, is_other = {}, set(), probability.sum(axis=0) < _BYSTANDER
    for i, name in enumerate(lost):
        if len(standers) and probability[i].max() >= _LEAST_PROBABILITY:
            found[name] = fits[i, int(probability[i].argmax())]
        elif probability[i].sum() >= _LEAST_PROBABILITY:
            unclear.add(name)
    now = [Bystander(place, now_s) for place in floor_m[is_other]]
    unseen = [each for k, each in enumerate(known) if k not in claimed.values()]
    return Recovery(found, unclear, (*now, *(each for each in unseen if now_s - each.time_s < _REMEMBERED_S)))


def _standers(frames: Frames, seen: Sequence[Array], zone: Array) -> list[Stander]:
    """Find who stands in a zone, without those who are seen."""
    views = [shrink(view) for view in frames.views if view is not None]
    return find_others(views, seen, zone=zone, places=floor_grid(zone), wanted=zone) if len(views) > 1 else []


def _bystanders(lost: Mapping[str, Track], zone: Array) -> tuple[Bystander, ...]:
    """Return who was there before: as remembered, or as the last sight of the player shows who was lost first."""
    remembered = [track.bystanders for track in lost.values() if track.bystanders is not None]
    if remembered:
        return max(remembered, key=lambda each: max((one.time_s for one in each), default=Fraction(0)))
    sightings = [track.sighting for track in lost.values() if track.sighting is not None]
    if not sightings:
        return ()
    first = min(sightings, key=lambda each: each.frames.time_s)
    return tuple(
        Bystander(stander.floor_m, first.frames.time_s) for stander in _standers(first.frames, first.states, zone)
    )


def _claim(bystanders: Array, lost: Array) -> dict[int, int]:
    """Return which standers are bystanders, and which: nats (bystanders, standers) and (lost, standers) of places."""
    gains = np.maximum(np.vstack([bystanders, lost]), 0.0)
    rows, standers = linear_sum_assignment(gains, maximize=True)
    pairs = zip(rows.tolist(), standers.tolist(), strict=True)
    return {stander: row for row, stander in pairs if row < len(bystanders) and gains[row, stander] > 0}


def identity_probabilities(nats: Array) -> Array:
    """Return the probability (lost, standers) that a lost player is a stander: nats (lost, standers), 0 nats for none.

    No two lost players are the same stander; -inf nats: impossible. All assignments are summed player by player, over
    the sets of standers that are taken: a dozen players in the dark have too many to be listed.
    """
    odds, nobody = np.exp(nats), frozenset[int]()
    options = [[(None, 1.0), *((int(j), float(row[j])) for j in np.flatnonzero(row))] for row in odds]
    before: list[dict[frozenset[int], float]] = [{nobody: 1.0}]  # taken by the players before -> sum of weights
    for choices in options:
        before.append({})
        for taken, weight in before[-2].items():
            for j, odd in choices:
                if j not in taken:
                    now = taken if j is None else taken | {j}
                    before[-1][now] = before[-1].get(now, 0.0) + weight * odd
    after = dict.fromkeys(before[-1], 1.0)  # sum of weights of the players from here on
    probability = np.zeros(nats.shape)
    for i in reversed(range(len(options))):
        later, after = after, dict.fromkeys(before[i], 0.0)
        for taken, weight in before[i].items():
            for j, odd in options[i]:
                if j is None:
                    after[taken] += later[taken]
                elif j not in taken:
                    onward = odd * later[taken | {j}]
                    after[taken] += onward
                    probability[i, j] += weight * onward
    return probability / after[nobody]


def _place_nats(floor_m: Array, since_s: Fraction | None, places_m: Array, time_s: Fraction) -> Array:
    """Return by how much people at places (n, 2) are rather somebody who was at one (2,) than newcomers: (n,) [nat]."""
    elapsed_s = float(time_s - (since_s if since_s is not None else time_s))
    sd_m = min(_PLACE_SD_M + _SPEED_SD_M_S * elapsed_s, _MOST_SD_M)
    squares = ((places_m - floor_m) ** 2).sum(axis=1) / sd_m**2
    return -0.5 * squares - np.log(2 * np.pi * sd_m**2 * _NEWCOMERS_PER_M2)


def colour_nats(share: Array, total: Array) -> Array:
    """Return by how much standers have rather the colours of lost players than those of others: (lost, standers) [nat].

    `share` is that of a player's usual evidence, `total` the fit's [nat]; both -inf where none was tried, as is the
    result. The best share says whether a stander is one of the lost at all; which one, their fits to the same pixels.
    """
    is_tried = np.isfinite(total)
    somebody = (np.minimum(share.max(axis=0), 1.0) - _LIKENESS) / _LIKENESS_SD
    rather = np.where(is_tried, _WHO_PER_NAT * total, -np.inf)
    columns = is_tried.any(axis=0)
    rather[:, columns] -= logsumexp(rather[:, columns], axis=0) - np.log(is_tried.sum(axis=0)[columns])
    return np.where(is_tried, somebody + rather, -np.inf)


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
