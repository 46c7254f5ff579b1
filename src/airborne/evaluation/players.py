"""Errors of the tracked joints of several players."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Rig, read_rig
from airborne.errors import ResultError, count
from airborne.evaluation.columns import align_columns
from airborne.evaluation.compare import nan_to_none, or_dash
from airborne.evaluation.jump_errors import JumpErrors, compare_jumps
from airborne.evaluation.players_questions import name_by_place, question_players
from airborne.evaluation.players_truth import read_players_truth, read_reference_jumps
from airborne.evaluation.success import Cover, success_cover
from airborne.evaluation.times import match_times, span
from airborne.geometry.sampling import chi2_quantile
from airborne.motion.players import PlayersMotion, read_players
from airborne.tracking import Status
from airborne.types import Array

_STRICT_M, _STRICTER_M, _AUC_TO_M = 0.10, 0.05, 0.20  # tolerances of success; the largest of the curve's
_GROUPS = {"hips": "hip", "knees": "knee", "ankles": "ankle", "feet": "foot"}
_SEGMENTS = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle")}
_SIDES = ("left", "right")
_SWAP_RATIO = 2.0  # factor by which a swap of left and right must lower the error


@dataclass(frozen=True, slots=True, kw_only=True)
class PartErrors:
    """Distances of one joint, or of a group, from the truth. Missing estimates fail, but have no distance."""

    n: int  # true positions
    n_unknown: int  # of these without an estimate
    mean_mm: float
    median_mm: float
    largest_mm: float
    within_100mm: float  # share of all true positions, like the next two
    within_50mm: float
    auc_200mm: float  # mean success over the tolerances 0 to 200 mm
    jitter_mm: float  # sd of the error's second difference, all axes
    within_95: float  # share inside the 95 % region of the stated covariance; NaN where none is stated


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayerErrors:
    """One player against the truth."""

    n: int  # matched frames, the sum of the next three
    n_tracked: int
    n_uncertain: int
    n_lost: int
    parts: dict[str, PartErrors]  # by joint, then hips, knees, ankles, feet, all (its mean is the MPJPE)
    pcp: float  # share of thighs and shanks whose mean end error is below half their length; NaN without
    swap_rate: dict[str, float]  # by group: share of frames in which left and right exchanged fit twice as well
    length_sd_mm: dict[str, float]  # of each estimated thigh and shank
    n_losses: int  # runs of frames with a mean error over 100 mm, or unknown
    mean_recovery_s: float  # of the runs that end; NaN without
    longest_recovery_s: float
    cover: Cover | None  # the paper's success measure; None without cameras


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayersComparison:
    """A run of players against the truth, over the frames whose times match."""

    n_frames: int  # of the run
    n_truth: int
    n_matched: int
    largest_time_offset_s: float
    players: dict[str, PlayerErrors]
    jumps: tuple[JumpErrors, ...]
    not_compared: tuple[str, ...]  # players without truth, and joints in only one of the two
    questions: tuple[str, ...]  # about the truth's unit, axes, sides, clock or recording, where it is far

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return nan_to_none(asdict(self))

    def describe(self) -> str:
        """Return the numbers as short plain tables."""
        off_ms = 1e3 * self.largest_time_offset_s
        lines = [f"{self.n_matched} of {self.n_truth} true times matched, at most {off_ms:.1f} ms off"]
        lines += [line for name, errors in self.players.items() for line in _error_lines(name, errors)]
        lines += [jump.describe() for jump in self.jumps]
        lines += [f"not compared: {', '.join(self.not_compared)}"] if self.not_compared else []
        return "\n".join([*lines, *self.questions])


def assess_players(folder: Path, truth: Path) -> PlayersComparison:
    """Compare the run of players in a folder with a truth table, and with the players.json beside it.

    Raises ResultError if the folder holds no such run, or nothing in the truth can be compared with it.
    """
    path = folder / "joints.csv"
    if not path.is_file():
        raise ResultError(f"{folder} holds no run of players; expected the joints.csv of `airborne track`")
    rig = read_rig(folder / "calib.toml") if (folder / "calib.toml").is_file() else None
    references = read_reference_jumps(truth.parent / "players.json")
    return compare_players(read_players(path), read_players_truth(truth), rig=rig, reference_jumps=references)


def compare_players(
    motion: PlayersMotion,
    truth: PlayersMotion,
    *,
    rig: Rig | None = None,
    visible: NDArray[np.bool_] | None = None,
    reference_jumps: dict[str, dict[str, float]] | None = None,
) -> PlayersComparison:
    """Compare players of the same names, or else in the same places, joint by joint; times as in `compare_motion`.

    With a rig the paper's success measure is computed too; `visible` (true frames, true players, views, true joints)
    marks what is not occluded. Raises ResultError if no player, joint or time is common to both.
    """
    frames, rows, offset = match_times(motion.time_s, truth.time_s)
    motion = name_by_place(motion, truth)
    players = [name for name in motion.players if name in truth.players]
    joints = [name for name in motion.joints if name in truth.joints]
    if not players or not joints:
        kind = "joint" if players else "player"
        ours, theirs = (", ".join(getattr(each, f"{kind}s")[:4]) for each in (motion, truth))
        names = "" if players else "name players under [[start.player]] as the truth does, or "
        raise ResultError(
            f"no {kind} in common: the run has {ours}, the truth {theirs}; {names}give the truth of this recording"
        )
    if not len(frames):
        raise ResultError(
            f"no frame to compare: run {span(motion.time_s)}, truth {span(truth.time_s)}; give this recording's truth"
        )
    columns, true_columns = ([each.joints.index(name) for name in joints] for each in (motion, truth))
    errors = {}
    for name in players:
        k, true_k = motion.players.index(name), truth.players.index(name)
        is_visible = None if visible is None else visible[rows][:, true_k][:, :, true_columns]
        errors[name] = _player_errors(
            _Pair(
                joints=tuple(joints),
                period_s=float(np.median(np.diff(motion.time_s))) if len(motion) > 1 else math.nan,
                estimate=motion.points[frames][:, k][:, columns],
                covariance=motion.covariance[frames][:, k][:, columns],
                truth=truth.points[rows][:, true_k][:, true_columns],
                status=motion.status[frames, k],
            ),
            rig,
            is_visible,
        )
    theirs = (*truth.players, *truth.joints)
    return PlayersComparison(
        n_frames=len(motion),
        n_truth=len(truth),
        n_matched=len(frames),
        largest_time_offset_s=float(offset.max()),
        players=errors,
        jumps=compare_jumps(motion, truth, players, reference_jumps or {}),
        not_compared=tuple(name for name in (*motion.players, *motion.joints) if name not in theirs),
        questions=question_players(motion, truth, players, joints),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pair:
    """One player's estimate beside the truth, both (n, joints, 3) [m]."""

    joints: tuple[str, ...]
    period_s: float
    estimate: Array
    covariance: Array  # (n, joints, 3, 3)
    truth: Array
    status: NDArray[np.str_]  # (n,)

    @property
    def distance(self) -> Array:
        return np.linalg.norm(self.estimate - self.truth, axis=-1)

    def columns(self, part: str) -> list[int]:
        """Return the columns of a part, left and right; [] if one is missing."""
        names = [f"{part}_{side}" for side in _SIDES]
        return [self.joints.index(name) for name in names] if set(names) <= set(self.joints) else []


def _player_errors(pair: _Pair, rig: Rig | None, visible: NDArray[np.bool_] | None) -> PlayerErrors:
    groups = {name: [k] for k, name in enumerate(pair.joints)}
    groups |= {group: columns for group, part in _GROUPS.items() if (columns := pair.columns(part))}
    legs = [k for k, name in enumerate(pair.joints) if name.split("_")[0] in _GROUPS.values()]
    groups |= {"all": legs or list(range(len(pair.joints)))}
    losses = _losses(pair, groups["all"])
    ended = [n * pair.period_s for n, has_end in losses if has_end]
    return PlayerErrors(
        n=len(pair.status),
        n_tracked=int(np.sum(pair.status == Status.TRACKED.value)),
        n_uncertain=int(np.sum(pair.status == Status.UNCERTAIN.value)),
        n_lost=int(np.sum(pair.status == Status.LOST.value)),
        parts={name: _part_errors(pair, columns) for name, columns in groups.items()},
        pcp=_pcp(pair),
        swap_rate={g: _swap_rate(pair, columns) for g, part in _GROUPS.items() if (columns := pair.columns(part))},
        length_sd_mm=_length_sds(pair),
        n_losses=len(losses),
        mean_recovery_s=float(np.mean(ended)) if ended else math.nan,
        longest_recovery_s=max(ended, default=math.nan),
        cover=None if rig is None else success_cover(rig, pair.estimate, pair.truth, pair.joints, visible=visible),
    )


def _part_errors(pair: _Pair, columns: list[int]) -> PartErrors:
    has_truth = np.isfinite(pair.truth[:, columns]).all(axis=-1)
    distance = pair.distance[:, columns][has_truth]
    finite = distance[np.isfinite(distance)]
    error = pair.estimate[:, columns] - pair.truth[:, columns]
    jitter = np.diff(error, 2, axis=0)
    jitter = jitter[np.isfinite(jitter).all(axis=-1)]
    n = max(len(distance), 1)
    return PartErrors(
        n=len(distance),
        n_unknown=len(distance) - len(finite),
        mean_mm=1e3 * float(finite.mean()) if len(finite) else math.nan,
        median_mm=1e3 * float(np.median(finite)) if len(finite) else math.nan,
        largest_mm=1e3 * float(finite.max()) if len(finite) else math.nan,
        within_100mm=float((finite <= _STRICT_M).sum()) / n,
        within_50mm=float((finite <= _STRICTER_M).sum()) / n,
        auc_200mm=float(np.maximum(1 - finite / _AUC_TO_M, 0.0).sum()) / n,
        jitter_mm=1e3 * float(jitter.std()) if len(jitter) else math.nan,
        within_95=_within_95(error, pair.covariance[:, columns]),
    )


def _within_95(error: Array, covariance: Array) -> float:
    is_known = np.isfinite(covariance).all(axis=(-2, -1)) & np.isfinite(error).all(axis=-1)
    error, covariance = error[is_known], covariance[is_known]
    is_definite = np.linalg.eigvalsh(covariance)[:, 0] > 0
    if not is_definite.any():
        return math.nan
    error, covariance = error[is_definite], covariance[is_definite]
    squared = np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[..., None])[..., 0])
    return float(np.mean(squared <= chi2_quantile(0.95, 3)))


def _pcp(pair: _Pair) -> float:
    """Return the share of correct thighs and shanks by the mean error of their ends (PCP 0.5)."""
    hits: list[NDArray[np.bool_]] = []
    for upper, lower in _SEGMENTS.values():
        for a, b in zip(pair.columns(upper), pair.columns(lower), strict=False):
            length = np.linalg.norm(pair.truth[:, a] - pair.truth[:, b], axis=-1)
            hits.append(((pair.distance[:, a] + pair.distance[:, b]) / 2 <= length / 2)[np.isfinite(length)])
    return float(np.mean(np.concatenate(hits))) if hits else math.nan


def _swap_rate(pair: _Pair, columns: list[int]) -> float:
    crossed = np.linalg.norm(pair.estimate[:, columns[::-1]] - pair.truth[:, columns], axis=-1).sum(axis=1)
    straight = pair.distance[:, columns].sum(axis=1)
    is_known = np.isfinite(straight)
    return float(np.mean(_SWAP_RATIO * crossed[is_known] < straight[is_known])) if is_known.any() else math.nan


def _length_sds(pair: _Pair) -> dict[str, float]:
    sds = {}
    for segment, (upper, lower) in _SEGMENTS.items():
        for side, a, b in zip(_SIDES, pair.columns(upper), pair.columns(lower), strict=False):
            length = np.linalg.norm(pair.estimate[:, a] - pair.estimate[:, b], axis=-1)
            finite = length[np.isfinite(length)]
            sds[f"{segment}_{side}"] = 1e3 * float(finite.std()) if len(finite) else math.nan
    return sds


def _losses(pair: _Pair, columns: list[int]) -> list[tuple[int, bool]]:
    """Return each run of failed frames: its length, and whether a good frame follows."""
    mean = pair.distance[:, columns].mean(axis=1)
    failed = np.concatenate([[False], ~(mean <= _STRICT_M), [False]])
    edges = np.flatnonzero(np.diff(failed.astype(int)))
    return [(int(b - a), bool(b < len(mean))) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _error_lines(player: str, errors: PlayerErrors) -> list[str]:
    lines = [f"{player}: {errors.n_tracked} tracked, {errors.n_uncertain} uncertain, {errors.n_lost} lost"]
    rows = [["  error [mm]", "mean", "median", "max", "<=100", "<=50", "AUC200", "jitter", "in 95%", "cover"]]
    for name, e in errors.parts.items():
        cover = errors.cover.rate.get(name, math.nan) if errors.cover else math.nan
        numbers = [or_dash(number, ".1f") for number in (e.mean_mm, e.median_mm, e.largest_mm)]
        numbers += [or_dash(share, ".1%") for share in (e.within_100mm, e.within_50mm, e.auc_200mm)]
        numbers += [or_dash(e.jitter_mm, ".1f"), or_dash(e.within_95, ".1%"), or_dash(cover, ".1%")]
        rows.append([f"  {name}", *numbers])
    lines += align_columns(rows, (16, *[8] * 9))
    swaps = ", ".join(f"{name} {rate:.1%}" for name, rate in errors.swap_rate.items())
    lines.append(
        f"  limbs correct (PCP 0.5) {or_dash(errors.pcp, '.1%')}; left and right swapped: {swaps or 'not judged'}"
    )
    if errors.cover:
        reach = ", ".join(f"{name} {metres:.3f}" for name, metres in errors.cover.tolerance_m.items())
        lines.append(f"  cover lets a part be off by [m]: {reach}")
    if errors.n_losses:
        mean, longest = (f"{each:.2f} s" for each in (errors.mean_recovery_s, errors.longest_recovery_s))
        recovery = "not recovered" if mean == "nan s" else f"recovered after {mean} on the mean, {longest} at most"
        lines.append(f"  off by more than 100 mm {count(errors.n_losses, 'time')}; {recovery}")
    return lines
