"""One player's legs for the analysis of jumps: hips to forefeet, and an approximate centre of mass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import LEG_POINTS
from airborne.errors import ResultError
from airborne.motion.players import PlayersMotion, worst_of
from airborne.tracking import Status
from airborne.types import Array

_UNKNOWN_SD_M = 0.02  # of a joint without a covariance
_FEWEST_VIEWS = 2  # that tell how high a joint is
_LEAP_M = 0.05  # beyond the noise
# of de Leva (1996), men, but for head, arms and trunk, which have 0.6782 (Winter 2009): chosen, though they sum to
# 1.075, as what moves above the hips is not seen. With de Leva's 0.6028 take-off errs by 0.6 to 1.0 frames on noisy
# synthetic blocks instead of 0.2 to 0.5 (benchmarks/accuracy/jumps.py)
_MASS_SHARES = {
    "hip": 0.6782 + 0.2832 * 0.5905,
    "knee": 0.2832 * 0.4095 + 0.0866 * 0.5605,
    "ankle": 0.0866 * 0.4395 + 0.0274,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegTrack:
    """Paths of one player [m], left side first, with the variances of their errors [m²]; NaN where unknown."""

    player: str
    index: NDArray[np.int64]  # (n,) frame numbers
    time_s: Array  # (n,)
    is_uncertain: NDArray[np.bool_]  # (n,) hips, knees or ankles, according to the tracker
    are_hips_uncertain: NDArray[np.bool_]  # (n,)
    is_measured: NDArray[np.bool_]  # (n,) by two cameras or more, or tracked; nowhere if no frame is tracked
    is_ankle_tracked: NDArray[np.bool_]  # (n,) left or right
    hips: Array  # (n, 2, 3)
    knees: Array  # (n, 2, 3)
    ankles: Array  # (n, 2, 3)
    forefeet: Array | None  # (n, 2, 3) balls of the feet
    wrists: Array | None  # (n, 2, 3)
    variances: dict[str, Array]  # "hips", ... -> (n, 2, 3)

    @property
    def period_s(self) -> float:
        """Time between two frames."""
        return float(np.median(np.diff(self.time_s)))

    @property
    def mid_hips(self) -> tuple[Array, Array]:
        """The mid-hips (n, 3), with their variance."""
        return self.hips.mean(axis=1), self.variances["hips"].mean(axis=1) / 2

    @property
    def mid_ankles(self) -> tuple[Array, Array]:
        """The mid-ankles (n, 3), with their variance."""
        return self.ankles.mean(axis=1), self.variances["ankles"].mean(axis=1) / 2

    @property
    def centre_of_mass_height(self) -> tuple[Array, Array]:
        """Height of the centre of mass up to a constant (n,) [m], and its variance.

        Trunk, arms and head move with the hips.
        """
        parts = {"hip": (self.hips, "hips"), "knee": (self.knees, "knees"), "ankle": (self.ankles, "ankles")}
        height = sum(_MASS_SHARES[name] * points[:, :, 2].mean(axis=1) for name, (points, _) in parts.items())
        variance = sum(
            _MASS_SHARES[name] ** 2 * self.variances[key][:, :, 2].mean(axis=1) / 2 for name, (_, key) in parts.items()
        )
        return np.asarray(height), np.asarray(variance)

    def scale_variances(self, factor: float) -> LegTrack:
        """Return the same paths with all variances times a factor."""
        return replace(self, variances={name: factor * variance for name, variance in self.variances.items()})


def extract_legs(motion: PlayersMotion, player: str) -> LegTrack:
    """Extract one player's legs from a motion. A missing covariance counts as an sd of 20 mm per axis.

    A position more than 5 sd + 0.05 m from the median of the five frames about it is an outlier and counts as unknown.
    Raises ResultError if the motion has no such player, or lacks hips, knees or ankles.
    """
    if player not in motion.players:
        raise ResultError(f"no player '{player}'; the motion has: {', '.join(motion.players)}")
    missing = [name for name in LEG_POINTS if name not in motion.joints]
    if missing:
        raise ResultError(f"jumps need {', '.join(LEG_POINTS)}; the motion lacks {', '.join(missing)}")
    who = motion.players.index(player)
    parts = {}
    for part in ("hip", "knee", "ankle", "foot", "wrist"):
        names = [f"{part}_left", f"{part}_right"]
        if all(name in motion.joints for name in names):
            at = [motion.joints.index(name) for name in names]
            variance = np.diagonal(motion.covariance[:, who][:, at], axis1=-2, axis2=-1)
            is_stated = np.isfinite(variance) & (variance > 0)
            variance = np.where(is_stated, variance, _UNKNOWN_SD_M**2)
            parts[part] = _remove_spikes(motion.points[:, who][:, at], variance), variance
    hips, ankles = ([motion.joints.index(f"{part}_{side}") for side in ("left", "right")] for part in ("hip", "ankle"))
    keys = {"hip": "hips", "knee": "knees", "ankle": "ankles", "foot": "forefeet", "wrist": "wrists"}
    return LegTrack(
        player=player,
        index=motion.index,
        time_s=motion.time_s,
        is_uncertain=motion.status[:, who] == Status.UNCERTAIN.value,
        are_hips_uncertain=worst_of(motion.joint_status[:, who, hips]) == Status.UNCERTAIN.value,
        is_ankle_tracked=(motion.joint_status[:, who, ankles] == Status.TRACKED.value).any(axis=1),
        is_measured=_is_measured(motion, who),
        hips=parts["hip"][0],
        knees=parts["knee"][0],
        ankles=parts["ankle"][0],
        forefeet=parts["foot"][0] if "foot" in parts else None,
        wrists=parts["wrist"][0] if "wrist" in parts else None,
        variances={keys[part]: variance for part, (_, variance) in parts.items()},
    )


def _is_measured(motion: PlayersMotion, who: int) -> NDArray[np.bool_]:
    """Tell which frames (n,) can carry a number: none where no frame of the run is tracked."""
    is_tracked = motion.status[:, who] == Status.TRACKED.value
    return is_tracked | ((motion.n_views[:, who] >= _FEWEST_VIEWS) & is_tracked.any())


def _remove_spikes(points: Array, variance: Array) -> Array:
    """Return paths (n, sides, 3) with outliers from their neighbours set to NaN."""
    if len(points) < 5:
        return points
    windows = np.lib.stride_tricks.sliding_window_view(points, 5, axis=0)  # only full windows without NaN can tell
    middle = np.pad(np.median(windows, axis=-1), ((2, 2), (0, 0), (0, 0)), constant_values=np.nan)
    is_spike = np.any(np.abs(points - middle) > 5 * np.sqrt(variance) + _LEAP_M, axis=-1, keepdims=True)
    return np.where(is_spike, np.nan, points)
