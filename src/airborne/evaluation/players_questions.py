"""Whether a truth of players is that of the run: its players by another name, its unit, sides, clock, its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from airborne.evaluation.mix_ups import Paths, question_mix_up
from airborne.evaluation.times import CLEARLY_BETTER, ELSEWHERE_MM, best_time_shift, match_times, question_shift
from airborne.motion.players import PlayersMotion
from airborne.types import Array

_NOBODY_M = 1e6  # to somebody of whom nothing is known: further than any court is long
_SAME_PLAYER_M = 0.5  # chosen: players at a net stand further apart than that, and are followed to a tenth of it


def name_by_place(motion: PlayersMotion, truth: PlayersMotion) -> PlayersMotion:
    """Give the run's players the names of the true ones where they stand, where no name is common to both.

    Whoever stands by nobody keeps his name: a start that was found calls them player1, player2.
    """
    joints = [name for name in motion.joints if name in truth.joints]
    frames, rows, _ = match_times(motion.time_s, truth.time_s)
    if set(motion.players) & set(truth.players) or not joints or not len(frames):
        return motion
    own, true = _points(motion, motion.players, joints)[frames], _points(truth, truth.players, joints)[rows]
    distance_m = np.array(
        [[_median_m(own[:, k] - true[:, j]) for j in range(true.shape[1])] for k in range(own.shape[1])]
    )
    names = list(motion.players)
    for k, j in zip(*linear_sum_assignment(np.nan_to_num(distance_m, nan=_NOBODY_M)), strict=True):
        if distance_m[k, j] < _SAME_PLAYER_M:
            names[k] = truth.players[j]
    return replace(motion, players=tuple(names))


def question_players(
    motion: PlayersMotion, truth: PlayersMotion, players: Sequence[str], joints: Sequence[str]
) -> tuple[str, ...]:
    """Ask in one line what is wrong with a truth, in unit, axes, sides, clock or recording; () where it is near."""
    own, true = _points(motion, players, joints), _points(truth, players, joints)
    names = [f"{player}_{joint}" for player in players for joint in joints]
    of_run, of_truth = (
        Paths(each.time_s, points.reshape(len(each), -1, 3)) for each, points in ((motion, own), (truth, true))
    )
    if mix_up := question_mix_up(of_run, of_truth, names):
        return (mix_up,)

    def mean_at(shift_s: float) -> tuple[float, int]:
        frames, rows, _ = match_times(motion.time_s, truth.time_s + shift_s)
        distance = np.linalg.norm(own[frames] - true[rows], axis=-1)
        known = distance[np.isfinite(distance)]
        return 1e3 * float(known.mean()) if len(known) else np.nan, len(known)

    mean_mm, _ = mean_at(0.0)
    shift_s, shifted_mm = best_time_shift(truth.time_s, mean_mm, mean_at, CLEARLY_BETTER)
    if shift_s:
        then = f"the mean distance would be {shifted_mm:.1f} mm, not {mean_mm:.1f} mm"
        return (question_shift(shift_s, "truth", then),)
    elsewhere = "the truth is nowhere near these players: is it of this recording, in its world?"
    return (elsewhere,) if mean_mm > ELSEWHERE_MM else ()


def _points(motion: PlayersMotion, players: Sequence[str], joints: Sequence[str]) -> Array:
    """Return the named joints of the named players: (n, players, joints, 3) [m]."""
    columns = [motion.joints.index(name) for name in joints]
    return motion.points[:, [motion.players.index(name) for name in players]][:, :, columns]


def _median_m(difference: Array) -> float:
    distance = np.linalg.norm(difference, axis=-1)
    known = distance[np.isfinite(distance)]
    return float(np.median(known)) if len(known) else np.nan
