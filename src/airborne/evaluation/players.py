"""How far the tracked joints of several players are from where they really were."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from airborne.cameras import Rig, read_rig
from airborne.errors import ResultError
from airborne.evaluation.compare import matched, or_dash, span, without_nan
from airborne.evaluation.jump_errors import JumpErrors, compare_jumps
from airborne.evaluation.players_truth import read_known_jumps, read_players_truth
from airborne.evaluation.success import Cover, success_cover
from airborne.motion.players import PlayersMotion, read_players
from airborne.tracking import Status

Array = NDArray[np.floating]

_STRICT_M, _STRICTER_M, _AUC_TO_M = 0.10, 0.05, 0.20
_GROUPS = {"hips": "hip", "knees": "knee", "ankles": "ankle", "feet": "foot"}
_RODS = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle")}
_SIDES = ("left", "right")
_CLEARLY = 2.0  # times: a swap of left and right must lower the error by this


@dataclass(frozen=True, slots=True, kw_only=True)
class PartErrors:
    """Distances of one joint, or of a group, from the truth. Unknown places fail, but have no distance."""

    n: int  # true places
    n_unknown: int  # of them without an estimate
    mean_mm: float
    median_mm: float
    largest_mm: float
    within_100mm: float  # share of all true places, like the next two
    within_50mm: float
    auc_200mm: float  # mean success over the tolerances 0 to 200 mm
    jitter_mm: float  # standard deviation of the error's second difference, all axes
    within_95: float  # share inside the 95 % region of the stated covariance; NaN where none is stated


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayerErrors:
    """One player against the truth."""

    n: int  # matched frames; likewise the next three, which sum to it
    n_tracked: int
    n_uncertain: int
    n_lost: int
    parts: dict[str, PartErrors]  # by joint, then hips, knees, ankles, feet, all (of which the mean is the MPJPE)
    pcp: float  # share of thighs and shanks whose ends are off by less than half a length on the mean; NaN without
    swap_rate: dict[str, float]  # by group: frames in which left and right taken for each other fit twice as well
    length_sd_mm: dict[str, float]  # of each estimated thigh and shank
    n_losses: int  # runs of frames with the mean error over 100 mm, or nothing known
    mean_recovery_s: float  # how long those last that end; NaN without
    longest_recovery_s: float
    cover: Cover | None  # the paper's success; None without cameras


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayersComparison:
    """A run of players against the truth, over the frames whose times match."""

    n_frames: int  # of the run
    n_truth: int
    n_matched: int
    largest_time_offset_s: float
    players: dict[str, PlayerErrors]
    jumps: tuple[JumpErrors, ...]
    not_compared: tuple[str, ...]  # players without truth, and joints that only one of the two has

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return without_nan(asdict(self))

    def describe(self) -> str:
        """Return the numbers as short plain tables."""
        lines = [
            f"{self.n_matched} of {self.n_truth} true times matched, at most "
            f"{1e3 * self.largest_time_offset_s:.1f} ms off"
        ]
        for name, errors in self.players.items():
            lines += _table(name, errors)
        lines += [jump.describe() for jump in self.jumps]
        if self.not_compared:
            lines.append(f"not compared: {', '.join(self.not_compared)}")
        return "\n".join(lines)


def assess_players(folder: Path, truth: Path) -> PlayersComparison:
    """Compare the run of players in a folder with a truth table, and with the players.json beside it.

    Raises ResultError where the folder holds no such run or the truth is of another recording.
    """
    path = folder / "joints.csv"
    if not path.is_file():
        raise ResultError(f"{folder} holds no run of players; expected joints.csv, as `airborne track` leaves it")
    calibration = folder / "calib.toml"
    rig = read_rig(calibration) if calibration.is_file() else None
    known = read_known_jumps(truth.parent / "players.json")
    return compare_players(read_players(path), read_players_truth(truth), rig=rig, known_jumps=known)


def compare_players(
    motion: PlayersMotion,
    truth: PlayersMotion,
    *,
    rig: Rig | None = None,
    visible: NDArray[np.bool_] | None = None,
    known_jumps: dict[str, dict[str, float]] | None = None,
) -> PlayersComparison:
    """Compare players of the same names, joint by joint, frame by frame as `compare` matches them.

    With a rig the paper's success is judged too, `visible` (true frames, players of the truth, views, joints of the
    truth) saying what is not hidden. Raises ResultError where no player, joint or time is common to both.
    """
    frames, rows, offset = matched(motion.time_s, truth.time_s)
    players = [name for name in motion.players if name in truth.players]
    joints = [name for name in motion.joints if name in truth.joints]
    if not players or not joints:
        what, ours, theirs = (
            ("player", motion.players, truth.players) if not players else ("joint", motion.joints, truth.joints)
        )
        raise ResultError(
            f"no {what} in common: the run has {', '.join(ours[:4])}, the truth {', '.join(theirs[:4])}; "
            "give the truth of this recording"
        )
    if not len(frames):
        raise ResultError(
            f"no frame to compare: run {span(motion.time_s)}, truth {span(truth.time_s)}; give this recording's truth"
        )
    here, there = [motion.joints.index(name) for name in joints], [truth.joints.index(name) for name in joints]
    found = {}
    for name in players:
        own, other = motion.players.index(name), truth.players.index(name)
        shown = None if visible is None else visible[rows][:, other][:, :, there]
        found[name] = _player_errors(
            _Pair(
                joints=tuple(joints),
                period_s=float(np.median(np.diff(motion.time_s))) if len(motion) > 1 else math.nan,
                estimate=motion.points[frames][:, own][:, here],
                covariance=motion.covariance[frames][:, own][:, here],
                truth=truth.points[rows][:, other][:, there],
                status=motion.status[frames, own],
            ),
            rig,
            shown,
        )
    others = [name for name in (*motion.players, *motion.joints) if name not in (*truth.players, *truth.joints)]
    return PlayersComparison(
        n_frames=len(motion),
        n_truth=len(truth),
        n_matched=len(frames),
        largest_time_offset_s=float(offset.max()),
        players=found,
        jumps=compare_jumps(motion, truth, players, known_jumps or {}),
        not_compared=tuple(others),
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
        """Return left and right of a part, [] where one is missing."""
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
        cover=None if rig is None else success_cover(rig, pair.estimate, pair.truth, pair.joints, visible),
    )


def _part_errors(pair: _Pair, columns: list[int]) -> PartErrors:
    has_truth = np.isfinite(pair.truth[:, columns]).all(axis=-1)
    distance = pair.distance[:, columns][has_truth]
    known = distance[np.isfinite(distance)]
    error = pair.estimate[:, columns] - pair.truth[:, columns]
    bend = np.diff(error, 2, axis=0)
    bend = bend[np.isfinite(bend).all(axis=-1)]
    n = max(len(distance), 1)
    return PartErrors(
        n=len(distance),
        n_unknown=len(distance) - len(known),
        mean_mm=1e3 * float(known.mean()) if len(known) else math.nan,
        median_mm=1e3 * float(np.median(known)) if len(known) else math.nan,
        largest_mm=1e3 * float(known.max()) if len(known) else math.nan,
        within_100mm=float((known <= _STRICT_M).sum()) / n,
        within_50mm=float((known <= _STRICTER_M).sum()) / n,
        auc_200mm=float(np.maximum(1 - known / _AUC_TO_M, 0.0).sum()) / n,
        jitter_mm=1e3 * float(bend.std()) if len(bend) else math.nan,
        within_95=_within_95(error, pair.covariance[:, columns]),
    )


def _within_95(error: Array, covariance: Array) -> float:
    known = np.isfinite(covariance).all(axis=(-2, -1)) & np.isfinite(error).all(axis=-1)
    error, covariance = error[known], covariance[known]
    sound = np.linalg.eigvalsh(covariance)[:, 0] > 0
    if not sound.any():
        return math.nan
    error, covariance = error[sound], covariance[sound]
    squared = np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[..., None])[..., 0])
    return float(np.mean(squared <= chi2.ppf(0.95, 3)))


def _pcp(pair: _Pair) -> float:
    """Return the share of correct thighs and shanks, the ends' errors taken together (PCP 0.5)."""
    hits: list[NDArray[np.bool_]] = []
    for upper, lower in _RODS.values():
        for a, b in zip(pair.columns(upper), pair.columns(lower), strict=False):
            length = np.linalg.norm(pair.truth[:, a] - pair.truth[:, b], axis=-1)
            hits.append(((pair.distance[:, a] + pair.distance[:, b]) / 2 <= length / 2)[np.isfinite(length)])
    return float(np.mean(np.concatenate(hits))) if hits else math.nan


def _swap_rate(pair: _Pair, columns: list[int]) -> float:
    crossed = np.linalg.norm(pair.estimate[:, columns[::-1]] - pair.truth[:, columns], axis=-1).sum(axis=1)
    straight = pair.distance[:, columns].sum(axis=1)
    known = np.isfinite(straight)
    return float(np.mean(_CLEARLY * crossed[known] < straight[known])) if known.any() else math.nan


def _length_sds(pair: _Pair) -> dict[str, float]:
    found = {}
    for rod, (upper, lower) in _RODS.items():
        for side, a, b in zip(_SIDES, pair.columns(upper), pair.columns(lower), strict=False):
            length = np.linalg.norm(pair.estimate[:, a] - pair.estimate[:, b], axis=-1)
            known = length[np.isfinite(length)]
            found[f"{rod}_{side}"] = 1e3 * float(known.std()) if len(known) else math.nan
    return found


def _losses(pair: _Pair, columns: list[int]) -> list[tuple[int, bool]]:
    """Return each run of failed frames: how many, and whether a good frame follows."""
    mean = pair.distance[:, columns].mean(axis=1)
    failed = np.concatenate([[False], ~(mean <= _STRICT_M), [False]])
    edges = np.flatnonzero(np.diff(failed.astype(int)))
    return [(int(b - a), bool(b < len(mean))) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _table(player: str, errors: PlayerErrors) -> list[str]:
    lines = [
        f"{player}: {errors.n_tracked} tracked, {errors.n_uncertain} uncertain, {errors.n_lost} lost",
        f"  {'error [mm]':<14}{'mean':>8}{'median':>8}{'max':>8}{'<=100':>8}{'<=50':>8}{'AUC200':>8}{'jitter':>8}"
        f"{'in 95%':>8}{'cover':>8}",
    ]
    for name, e in errors.parts.items():
        cover = errors.cover.rate.get(name, math.nan) if errors.cover else math.nan
        numbers = [or_dash(number, ".1f") for number in (e.mean_mm, e.median_mm, e.largest_mm)]
        numbers += [or_dash(share, ".1%") for share in (e.within_100mm, e.within_50mm, e.auc_200mm)]
        numbers += [or_dash(e.jitter_mm, ".1f"), or_dash(e.within_95, ".1%"), or_dash(cover, ".1%")]
        lines.append(f"  {name:<14}" + "".join(f"{number:>8}" for number in numbers))
    swaps = ", ".join(f"{name} {rate:.1%}" for name, rate in errors.swap_rate.items())
    lines.append(
        f"  limbs correct (PCP 0.5) {or_dash(errors.pcp, '.1%')}; left and right swapped: {swaps or 'not judged'}"
    )
    if errors.cover:
        reach = ", ".join(f"{name} {metres:.3f}" for name, metres in errors.cover.tolerance_m.items())
        lines.append(f"  cover lets a part be off by [m]: {reach}")
    if errors.n_losses:
        recovery = "not recovered"
        if not math.isnan(errors.mean_recovery_s):
            recovery = (
                f"recovered after {errors.mean_recovery_s:.2f} s on the mean, {errors.longest_recovery_s:.2f} s at most"
            )
        lines.append(f"  off by more than 100 mm {errors.n_losses} times; {recovery}")
    return lines
