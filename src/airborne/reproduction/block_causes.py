"""Why a part is not where it is said to be: for each such frame the first of a few plain causes that holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

OFF_M = 0.10  # from here on a part is off
TORSO_OFF_M = 0.25
_AT_ANOTHER_M = 0.15
_HALF_HIDDEN = 0.5
_OTHER_SIDE = (1, 0, 3, 2, 5, 4)  # of PARTS
CAUSES = (
    "no estimate",
    "torso off by 0.25 m",
    "left and right swapped",
    "on another player's leg",
    "hidden in two cameras",
    "in flight",
    "on the floor",
)  # the last two: none of the others


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """One player in truth, over n frames."""

    truth: Array  # (n, 6, 3) [m], as PARTS
    others: Array  # (n, m, 6, 3) of all other players
    hidden: Array  # (n, views, 6) share that other players hide
    is_flying: NDArray[np.bool_]  # (n,)


def causes_of(estimate: Array, what: Situation, torso_error_m: Array | None) -> NDArray[np.int64]:
    """Return the cause (n, 6) for each part of an estimate (n, 6, 3), as an index of CAUSES; -1 where it is not off.

    torso_error_m (n,) is that of the torso that the tracker was told; None for a tracker that needs none.
    """
    error = np.linalg.norm(estimate - what.truth, axis=-1)
    to_other_side = np.linalg.norm(estimate - what.truth[:, _OTHER_SIDE], axis=-1)
    to_others = np.linalg.norm(estimate[:, None, :, None] - what.others[:, :, None], axis=-1)  # (n, m, 6, 6)
    to_another = to_others.min(axis=(1, 3)) if what.others.shape[1] else np.full(error.shape, np.inf)
    is_torso_off = np.zeros(len(error), bool) if torso_error_m is None else torso_error_m > TORSO_OFF_M
    holds = [
        np.isnan(error),
        np.broadcast_to(is_torso_off[:, None], error.shape),
        2 * to_other_side < error,
        (to_another < _AT_ANOTHER_M) & (to_another < error),
        (what.hidden >= _HALF_HIDDEN).sum(axis=1) >= 2,
        np.broadcast_to(what.is_flying[:, None], error.shape),
        np.ones(error.shape, bool),
    ]
    return np.where(error <= OFF_M, -1, np.argmax(holds, axis=0))
