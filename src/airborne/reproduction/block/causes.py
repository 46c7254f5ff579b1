"""Why an estimated part is wrong: for each such frame the first of a few simple causes that applies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import RODS
from airborne.types import Array

OFF_M = 0.10  # beyond this a part is off
TORSO_OFF_M = 0.10  # beyond this the torso is off
_AT_ANOTHER_M = 0.15  # an estimate this near to another part is that part's
_HALF_OCCLUDED = 0.5  # share of a part
_LAG_FRAMES = 9  # at most, that an estimate is compared with
_ALONG_COS = np.cos(np.radians(20))  # an error within 20 degrees of the limb lies along it
_OTHER_SIDE = (1, 0, 3, 2, 5, 4)  # of PARTS
CAUSES = (
    "no estimate",
    "torso off by 0.10 m",
    "left and right swapped",
    "on another player's leg",
    "hidden in two cameras",
    "behind the motion",
    "along the limb",
    "none of these",
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlayerTruth:
    """Ground truth of one player, over n frames."""

    truth: Array  # (n, 6, 3) [m], as PARTS
    others: Array  # (n, m, 6, 3) of all other players
    occluded: Array  # (n, views, 6) share that other players occlude


def causes_of(estimate: Array, player: PlayerTruth, torso_error_m: Array | None) -> NDArray[np.int64]:
    """Return the cause (n, 6) for each part of an estimate (n, 6, 3), as an index of CAUSES; -1 where it is not off.

    torso_error_m (n,) is that of the tracker's torso input; None for a tracker without one. Swapped: the other side's
    joint is less than half as far. On another's leg: a joint of it within 0.15 m, and nearer. Hidden: half of the part
    or more, by other players. Behind: less than half as far from one of the part's last nine positions. Along: the
    error within 20 degrees of a limb that ends there.
    """
    error = np.linalg.norm(estimate - player.truth, axis=-1)
    to_other_side = np.linalg.norm(estimate - player.truth[:, _OTHER_SIDE], axis=-1)
    to_others = np.linalg.norm(estimate[:, None, :, None] - player.others[:, :, None], axis=-1)  # (n, m, 6, 6)
    to_another = to_others.min(axis=(1, 3)) if player.others.shape[1] else np.full(error.shape, np.inf)
    is_torso_off = np.zeros(len(error), bool) if torso_error_m is None else torso_error_m > TORSO_OFF_M
    applies = [
        np.isnan(error),
        np.broadcast_to(is_torso_off[:, None], error.shape),
        2 * to_other_side < error,
        (to_another < _AT_ANOTHER_M) & (to_another < error),
        (player.occluded >= _HALF_OCCLUDED).sum(axis=1) >= 2,
        2 * _lag_distance(estimate, player.truth) < error,
        _limb_cosine(estimate - player.truth, player.truth) > _ALONG_COS,
        np.ones(error.shape, bool),
    ]
    return np.where(error <= OFF_M, -1, np.argmax(applies, axis=0))


def _lag_distance(estimate: Array, truth: Array) -> Array:
    """Return the distance (n, 6) to each part's nearest position in the preceding frames."""
    least = np.full(estimate.shape[:2], np.inf)
    for k in range(1, min(_LAG_FRAMES, len(truth) - 1) + 1):
        least[k:] = np.fmin(least[k:], np.linalg.norm(estimate[k:] - truth[:-k], axis=-1))
    return least


def _limb_cosine(error: Array, truth: Array) -> Array:
    """Return the cosine (n, 6), 0 to 1, between an error (n, 6, 3) and a thigh or shank that ends there."""
    cosine = np.zeros(error.shape[:2])
    size = np.maximum(np.linalg.norm(error, axis=-1), 1e-9)
    for a, b in RODS:
        rod = truth[:, b] - truth[:, a]
        rod /= np.linalg.norm(rod, axis=-1, keepdims=True)
        for k in (a, b):
            cosine[:, k] = np.fmax(cosine[:, k], np.abs(np.sum(error[:, k] * rod, axis=-1)) / size[:, k])
    return cosine
