"""The players at the net found where they stand: moments, players, the directions that they face, and a decision."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import expit

from airborne.errors import TrialError
from airborne.tracking.capsules.bystanders import LEAST_EVIDENCE, fit_stander
from airborne.tracking.capsules.first_frame import FirstFrameFit, points_of
from airborne.tracking.capsules.floor_search import (
    Stander,
    evaluate_grid,
    find_standers,
    floor_grid,
    lies_in,
    sum_support,
)
from airborne.tracking.capsules.jumper import JOINTS, N_DOF, SHANK, THIGH
from airborne.tracking.capsules.standing import ColourViews
from airborne.tracking.capsules.track import evidence_per_px
from airborne.tracking.first_pose.candidates import LEAST_PROBABILITY
from airborne.tracking.players import PlayerStart
from airborne.types import Array, Progress
from airborne.video import Frames, View

_COURT_M = (4.5, 9.0)  # half width and half length (FIVB rules of volleyball, 1.1)
_NEAR_NET_M = 1.5  # of the net's plane, half of the front zone
_BEYOND_M = 2.5  # on the other side of the net: who stands there is seen behind the blockers
_BOTH_SIDES_M = 2.0  # cameras whose mean lies nearer to the net's plane stand on both sides
_AS_WELL = 0.7  # share of what players tell at most, which counts as much as any
_MOST_MOMENTS, _MOST_SEARCHED = 8, 5  # that are looked at, and searched until one decides and two agree on how many
# [nat m2] that are as likely a player as none, and their logistic scale: of synthetic blocks 3001 to 3008, 3201 to 3250
# and 3301 to 3315 players told 1.1 or more, and in 160 moments nobody else at the net told over 0.8
_SUPPORT, _SUPPORT_SD = 0.95, 0.05
_SHARE_PER_NAT = 0.01  # share of the support that makes a pose e times likelier
_EVIDENCE_PER_NAT = 0.03  # the same of the fit's evidence; chosen on synthetic blocks 3101 to 3124
_NET_NATS = 3.0  # for facing the net, of players near it
# a logistic regression (Platt 1999) of whether the legs lie within 80 mm: nats of a constant, of the length of thigh
# and shank [m], of how far the knees are straighter than a player's who waits [rad], of the fit's way from its stance
# [m], of hips and knees that are not alike [rad], of what the evidence lacks of a player's who is well seen [nat a
# pixel]; 276 players of synthetic blocks 3201 to 3250, of whom 13 % lay farther away
_RIGHT_NATS = np.array([79.2, -75.2, -46.0, -77.1, -12.5, -9.4])
_WAITING, _WELL_SEEN = 0.5, 1.8  # [rad] flexion of knees, [nat a pixel]; chosen on the same
_HIPS, _KNEES = [8, 13], [11, 16]  # columns of a state: flexion
_ALIKE_M = 0.06  # mean distance of the legs' joints, below which poses are the same
_MOST_CANDIDATES, _LEAST_SHOWN = 8, 0.01  # number and share of those that are listed


@dataclass(frozen=True, slots=True, eq=False)
class FoundPlayer:
    """A player who may stand there, in one pose."""

    joints_m: dict[str, Array]  # joint -> (3,) world [m]
    state: Array  # (35,)
    support: float  # [nat m2]
    evidence: float  # [nat a pixel] of the fit
    probability: float  # that the legs lie within 80 mm, if somebody stands there in a pose like this


@dataclass(frozen=True, slots=True, eq=False)
class PlayersCandidate:
    """Players who may be all that stand there."""

    players: tuple[FoundPlayer, ...]  # from left to right
    share: float  # of the probability of all candidates, if one of them is right

    @property
    def probability(self) -> float:
        """That these are all, and every one's legs lie within 80 mm."""
        return self.share * float(np.prod([player.probability for player in self.players]))

    @property
    def is_plausible(self) -> bool:
        """Whether there are any, and the pictures show each of them well."""
        return bool(self.players) and all(player.evidence > LEAST_EVIDENCE for player in self.players)

    @property
    def starts(self) -> tuple[PlayerStart, ...]:
        """Where they start, by names."""
        return tuple(
            PlayerStart(name=f"player{number}", joints_m=player.joints_m)
            for number, player in enumerate(self.players, start=1)
        )


@dataclass(frozen=True, slots=True, eq=False)
class PlayersSearch:
    """What was found at one moment."""

    frames: Frames
    candidates: tuple[PlayersCandidate, ...]  # the likeliest first

    @property
    def n_players(self) -> int:
        """How many players the likeliest candidate has."""
        return len(self.candidates[0].players)

    @property
    def is_decided(self) -> bool:
        """Whether the likeliest candidate can be taken."""
        return self.candidates[0].is_plausible and self.candidates[0].probability >= LEAST_PROBABILITY


def find_players(
    sample: Sequence[Frames],
    whole: Callable[[int], Frames],
    *,
    near_net: bool = True,
    progress: Progress | None = None,
) -> PlayersSearch:
    """Find the players at the net, or all on the cameras' half of the court, at one of some times.

    It is the earliest of those that decide, or the likeliest. `sample` holds small pictures, `whole` returns those of a
    frame's number in full size. The world is the court's: its origin in the middle on the floor, x along the net.
    Raises TrialError where nobody is found.
    """
    sample = [frames for frames in sample if sum(view is not None for view in frames.views) > 1]
    moments = [_Moment.of(frames, near_net=near_net) for frames in sample[:: -(-len(sample) // _MOST_MOMENTS) or 1]]
    findings: list[PlayersSearch] = []
    complete, most = findings, 0
    for number, moment in enumerate(_best_first(moments)[:_MOST_SEARCHED]):
        if progress is not None:
            progress(number, _MOST_SEARCHED)
        findings.append(moment.search(whole))
        most = max(finding.n_players for finding in findings)
        complete = [finding for finding in findings if finding.n_players == most]
        if len(complete) > 1 and any(finding.is_decided for finding in complete):
            break
    if most == 0:
        where = "at the net" if near_net else "on the court"
        raise TrialError(
            f"[start] is missing, and no player is seen to stand {where}, whose middle must be the world's origin, x "
            "along the net; give [[start.player]] tables"
        )
    decided = [finding for finding in complete if finding.is_decided]
    if decided:  # from the earliest most of the recording can be followed: after a jump players stand as well as before
        return min(decided, key=lambda finding: finding.frames.index)
    return max(complete, key=lambda finding: finding.candidates[0].probability)


def probability_right(state: Array, way_m: float, evidence: float) -> float:
    """Return the probability that the legs of a fit (35,) lie within 80 mm.

    It lies `way_m` from the stance where it began, and has this evidence [nat a pixel].
    """
    leg_m = state[N_DOF + THIGH] + state[N_DOF + SHANK]  # feet in the air seem to reach the floor on longer legs
    knees, hips = state[_KNEES], state[_HIPS]
    straighter = max(_WAITING - knees.mean(), 0.0)
    unlike = abs(knees[0] - knees[1]) + abs(hips[0] - hips[1])
    return float(expit(_RIGHT_NATS @ [1.0, leg_m, straighter, way_m, unlike, max(_WELL_SEEN - evidence, 0.0)]))


def _best_first(moments: Sequence[_Moment]) -> list[_Moment]:
    """Sort moments by what players at the net tell; those in which they tell about as much as ever by time."""
    support = [moment.support for moment in moments]
    best = [moment for moment, each in zip(moments, support, strict=True) if each >= _AS_WELL * max(support)]
    rest = [(each, moment) for moment, each in zip(moments, support, strict=True) if each < _AS_WELL * max(support)]
    return [*best, *(moment for _, moment in sorted(rest, key=lambda pair: -pair[0]))]


@dataclass(frozen=True, eq=False)
class _Moment:
    """A time, and where players are looked for."""

    frames: Frames
    views: ColourViews
    zone: Array  # (2, 2) where players are looked for, from and to x, y [m]
    wanted: Array  # (2, 2) where they are wanted
    near_net: bool

    @classmethod
    def of(cls, frames: Frames, *, near_net: bool) -> _Moment:
        views = [view for view in frames.views if view is not None]
        zone, wanted = _zones(views, near_net=near_net)
        return cls(frames, ColourViews.of(views, zone), zone, wanted, near_net)

    @property
    def support(self) -> float:
        """What players there may tell in all [nat m2]."""
        return sum_support(*evaluate_grid(self.views, floor_grid(self.wanted)))

    def search(self, whole: Callable[[int], Frames]) -> PlayersSearch:
        """Find the players and fit them to the whole pictures."""
        standers = list(find_standers(self.views, floor_grid(self.zone), self.wanted))
        wanted = [stander for stander in standers if lies_in(self.wanted, stander.floor_m)]
        others = [stander.states[0] for stander in standers if not lies_in(self.wanted, stander.floor_m)]
        wanted.sort(key=lambda stander: stander.floor_m[0])
        found = _fit(wanted, others, whole(self.frames.index))
        return PlayersSearch(self.frames, _candidates(wanted, found, near_net=self.near_net))


def _zones(views: Sequence[View], *, near_net: bool) -> tuple[Array, Array]:
    """Return where players are looked for, and where they are wanted, from and to x, y: (2, 2) each [m]."""
    half_width, half_length = _COURT_M
    y = float(np.mean([view.camera.centre[1] for view in views]))
    ends = np.array([half_length, half_length] if abs(y) < _BOTH_SIDES_M else [half_length, 0.0])
    seen, wanted = np.maximum(ends, _BEYOND_M), np.minimum(ends, _NEAR_NET_M) if near_net else ends
    if y > 0:
        seen, wanted = seen[::-1], wanted[::-1]
    zones = [np.array([[-half_width, -zone[0]], [half_width, zone[1]]]) for zone in (seen, wanted)]
    return zones[0], zones[1]


def _fit(standers: Sequence[Stander], others: Sequence[Array], frames: Frames) -> list[list[FoundPlayer]]:
    """Fit each player's model from all its stances, beside the others as they are likeliest."""
    states = [stander.states[0] for stander in standers]
    found: list[list[FoundPlayer]] = [[] for _ in standers]
    for n in (1, None):  # first the likeliest stances, then all beside these
        for i, stander in enumerate(standers):
            beside = [*others, *states[:i], *states[i + 1 :]]
            fits = [fit_stander(state, beside, frames) for state in stander.states[:n]]
            found[i] = [_player_of(fit, stander, number) for number, fit in enumerate(fits)]
            states[i] = found[i][0].state
    return found


def _player_of(fit: FirstFrameFit, stander: Stander, number: int) -> FoundPlayer:
    joints_m: dict[str, Array] = dict(zip(JOINTS, fit.fit.points, strict=True))
    way_m = np.linalg.norm(fit.fit.points - points_of(stander.states[number]), axis=1)[:-1].mean()
    state, evidence = fit.fit.state, evidence_per_px(fit.fit.owned)
    probability = probability_right(state, float(way_m), evidence)
    return FoundPlayer(joints_m, state, float(stander.support[number]), evidence, probability)


def _candidates(
    standers: Sequence[Stander], found: Sequence[Sequence[FoundPlayer]], *, near_net: bool
) -> tuple[PlayersCandidate, ...]:
    """Combine who is a player and how each stands; the likeliest first."""
    options = []
    for stander, poses in zip(standers, found, strict=True):
        there = float(expit((stander.support[0] - _SUPPORT) / _SUPPORT_SD))
        each = [(there * p, player) for p, player in _distinct_poses(poses, near_net=near_net)]
        options.append([option for option in [(1 - there, None), *each] if option[0] > _LEAST_SHOWN / 2])
    candidates = []
    for chosen in product(*options):
        players = tuple(player for _, player in chosen if player is not None)
        candidates.append(PlayersCandidate(players, float(np.prod([p for p, _ in chosen]))))
    candidates.sort(key=lambda candidate: -candidate.share)
    return tuple(candidates[:1] + [each for each in candidates[1:_MOST_CANDIDATES] if each.share > _LEAST_SHOWN])


def _distinct_poses(poses: Sequence[FoundPlayer], *, near_net: bool) -> list[tuple[float, FoundPlayer]]:
    """Return a player's poses with their probabilities, those that the fit made alike as one."""
    support, evidence = np.array([(pose.support, pose.evidence) for pose in poses]).T
    nats = support / support.max() / _SHARE_PER_NAT + evidence / max(evidence.max(), 1e-9) / _EVIDENCE_PER_NAT
    if near_net:
        nats = nats + _NET_NATS * np.array([_faces_net(pose) for pose in poses])
    likelihood = np.exp(nats - nats.max())
    merged: list[tuple[float, FoundPlayer]] = []
    for i in np.argsort(-likelihood):
        p, legs = float(likelihood[i] / likelihood.sum()), points_of(poses[i].state)[:-1]
        away_m = [np.linalg.norm(points_of(other.state)[:-1] - legs, axis=1).mean() for _, other in merged]
        alike = int(np.argmin(away_m)) if away_m and min(away_m) < _ALIKE_M else None
        if alike is None:
            merged.append((p, poses[i]))
        else:
            merged[alike] = merged[alike][0] + p, merged[alike][1]
    return merged


def _faces_net(player: FoundPlayer) -> bool:
    """Return whether the left hip lies where it does when the net, y = 0, is in front."""
    across, y = player.joints_m["hip_left"] - player.joints_m["hip_right"], player.joints_m["torso"][1]
    return bool(across[0] * y > 0)
