"""How rough a path is beside its stated errors: bodies move smoothly, so what changes between frames is error."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.geometry.sampling import chi2_quantile
from airborne.tracking.self_check.path import TrackedPath, alarm
from airborne.types import Array

# (frames on either side, degree) of the polynomials that a path is compared with. Chosen on five synthetic throws, the
# videos compressed, blurred, noisy, shaken, occluded or getting brighter: errors that alternate between fields show in
# the short one, slower ones in the long one. 95 and 94 % of the errors of position and rotation lie within two
# deviations, where 90 and 84 % did; of the throws as they were no deviation changes
_WINDOWS = ((2, 2), (3, 3))
_FEWEST = 5  # chosen: windows from which a factor is estimated
# chosen: throws whose pictures are bad have up to 3.3, one of pictures blended from two 5.2, one of cameras that shake
# by whole fields more; those of the latter hold 95 % within two deviations nevertheless
_FAR_TOO_ROUGH = 4.0
# of a step over the mean of those beside, chosen: a thing's speed does not fall to a seventh and back within three
# frames; and how many such steps count, as it may bounce
_REPEATED, _FEWEST_REPEATED, _LEAST_SHARE = 0.15, 4, 0.1
_LEAST_STEP_SDS = 4.0  # chosen: of those beside, so that they are seen
# a step of so many of those beside, in position and rotation alike, to this share of one: chosen on the bundled throw
# with a picture of two fields lost in all cameras, which has 3.04 and 3.14, off by 0.16 and 0.23; right throws have 1.5
# at most
_MOST_LOST, _LIKE_STEPS = 12, 0.3
_MEDIAN_SQUARE = chi2_quantile(0.5, 1)  # of normal errors in standard deviations


class PathFinding(NamedTuple):
    """What a path tells of the pictures: they cannot be one after another at the stated rate."""

    kind: str
    value: float
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """Return what `self_check` in summary.json holds: an alarm."""
        return alarm("path", self.kind, value=self.value, sd=0.0, sentence=self.sentence)


def find_wrong_path(path: TrackedPath, rough: Array) -> PathFinding | None:
    """Find a thing that moves by jerks; `rough` (2,) is its roughness, by which its deviations are multiplied."""
    steps = _Steps.of(path) if len(path.index) > 3 else None
    if steps is not None and (lost := _find_lost_pictures(path, steps)) is not None:
        return lost
    if steps is not None and (share := _share_of_repeats(steps)):
        return PathFinding(
            "repeated",
            share,
            f"{share:.0%} of the pictures show what the one before showed: the videos were filmed at a lower rate and "
            "filled up by repeating; drop the repeated pictures (where it is every second, track with --every 2)",
        )
    if rough.max() < _FAR_TOO_ROUGH:
        return None
    return PathFinding(
        "roughness",
        float(rough.max()),
        f"from frame to frame positions scatter {rough[0]:.1f} times and rotations {rough[1]:.1f} times as much as "
        "stated errors explain, so that their standard deviations are multiplied by that: look in the videos for "
        "pictures that are blended from two, lost or out of order, and for cameras that shake",
    )


class _Steps(NamedTuple):
    """The steps of a path between those before and after, by position and rotation: (n, 2, 3) [m, rad]."""

    step: Array
    before: Array
    after: Array
    is_gapless: NDArray[np.bool_]  # (n,) the three follow one another
    least_m: Array  # (n,) of a position's step that is seen

    @classmethod
    def of(cls, path: TrackedPath) -> _Steps:
        """Take the steps of a path of four frames or more."""
        turns = Rotation.from_matrix(path.rotations[1:] @ np.swapaxes(path.rotations[:-1], 1, 2)).as_rotvec()
        moves = np.concatenate([np.diff(path.positions, axis=0), turns], axis=1).reshape(-1, 2, 3)
        is_gapless = path.index[3:] - path.index[:-3] == 3 * np.median(np.diff(path.index))
        variance = np.trace(path.covariance[1:-2, :3, :3], axis1=1, axis2=2)
        return cls(moves[1:-1], moves[:-2], moves[2:], is_gapless, _LEAST_STEP_SDS * np.sqrt(variance))


def _find_lost_pictures(path: TrackedPath, steps: _Steps) -> PathFinding | None:
    """Find the first place where a thing moves and turns in one step as in several of those beside."""
    beside = (steps.before + steps.after) / 2
    size = np.linalg.norm(beside, axis=2)
    n_steps = np.rint(np.linalg.norm(steps.step[:, 0], axis=1) / np.maximum(size[:, 0], 1e-9))
    is_like = np.linalg.norm(steps.step - n_steps[:, None, None] * beside, axis=2) < _LIKE_STEPS * size
    least = np.linalg.norm([steps.before[:, 0], steps.after[:, 0]], axis=2).min(axis=0)
    is_sure = steps.is_gapless & (size[:, 0] > steps.least_m) & (least > 0.5 * size[:, 0])  # else one repeats
    is_lost = is_like.all(axis=1) & is_sure & (n_steps > 1) & (n_steps <= _MOST_LOST)
    if not is_lost.any():
        return None
    k = int(np.argmax(is_lost))
    n, late_s = int(n_steps[k]), (n_steps[k] - 1) * float(path.time_s[k + 2] - path.time_s[k + 1])
    return PathFinding(
        "lost",
        float(late_s),
        f"from frame {path.index[k + 1]} to the next the body moves and turns as in {n} frames elsewhere: images seem "
        f"to be lost there in all cameras, so that later times are {1e3 * late_s:.0f} ms too early: put the lost "
        "images back, or track what lies before and after them as two trials",
    )


def _share_of_repeats(steps: _Steps) -> float:
    """Return the share of steps that hardly are any, between two that are; 0 where they are few."""
    step, before, after = np.linalg.norm([steps.step[:, 0], steps.before[:, 0], steps.after[:, 0]], axis=2)
    beside = (before + after) / 2
    is_repeated = steps.is_gapless & (beside > steps.least_m) & (step < _REPEATED * beside)
    n, share = np.count_nonzero(is_repeated), float(is_repeated.mean())
    return share if n >= _FEWEST_REPEATED and share >= _LEAST_SHARE else 0.0


def measure_roughness(path: TrackedPath, is_tracked: NDArray[np.bool_]) -> Array:
    """Return by how much the errors of position and rotation exceed the stated ones: (2,) factors on them, 1 at least.

    is_tracked (n,): of the path's frames, others do not count. The middle of each window of tracked frames without a
    gap is compared with a polynomial through the window (Savitzky and Golay 1964). Along each axis the median of the
    squares, in units of their variances, is that of normal errors where the stated ones are right; the mean over axes
    counts, without those that the images do not show in some frame.
    """
    factors = np.ones(2)
    for half, degree in _WINDOWS:
        squares = _squares(path, is_tracked, half, degree)
        if len(squares) < _FEWEST:
            continue
        medians = np.median(squares, axis=0)  # NaN where one is
        for k, of_axes in enumerate(np.split(medians, 2)):
            known = of_axes[np.isfinite(of_axes)]
            factors[k] = max(factors[k], np.sqrt(known.mean() / _MEDIAN_SQUARE)) if len(known) else factors[k]
    return factors


def _squares(path: TrackedPath, is_tracked: NDArray[np.bool_], half: int, degree: int) -> Array:
    """Return the squared residuals of the middles, in variances: (windows, 6), NaN where one is not finite."""
    n = 2 * half + 1
    if len(path.index) < n:
        return np.zeros((0, 6))
    terms = np.vander(np.arange(-half, half + 1.0), degree + 1)
    weights = (np.eye(n) - terms @ np.linalg.pinv(terms))[half]
    rows = sliding_window_view(np.arange(len(path.index)), n)
    rows = rows[is_tracked[rows].all(axis=1) & (np.ptp(path.index[rows], axis=1) == n - 1)]
    R = path.rotations
    turns = Rotation.from_matrix((R[rows] @ np.swapaxes(R[rows[:, half], None], -1, -2)).reshape(-1, 3, 3)).as_rotvec()
    moves = np.concatenate([path.positions[rows], turns.reshape(-1, n, 3)], axis=-1)
    variance = np.diagonal(path.covariance[rows], axis1=-2, axis2=-1)
    known = np.where(np.isfinite(variance), variance, np.nan)
    return (weights @ moves) ** 2 / (weights**2 @ known)
