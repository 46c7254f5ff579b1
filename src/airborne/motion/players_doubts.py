"""Why players' joints are uncertain: which joints, in which frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.finding import join_names
from airborne.motion.players import PlayersMotion
from airborne.tracking import Status

_ALL_JOINTS, _SD_OVER = "all joints", "sd over"
_PLURALS = {"hip": "hips", "knee": "knees", "ankle": "ankles", "foot": "feet", "wrist": "wrists"}


def describe_player_doubts(
    motion: PlayersMotion, player: str, *, most_sd_m: float, is_joint_alone: bool = True
) -> Iterator[str]:
    """Yield, for each reason, which joints of a player are uncertain in which frames, and why.

    most_sd_m: of a joint, RMS over the axes, from which on the tracker calls it uncertain; where it is not judged
    alone, the largest of all joints counts.
    """
    k = motion.players.index(player)
    is_uncertain = motion.joint_status[:, k] == Status.UNCERTAIN.value
    is_alone = np.repeat(motion.n_views[:, k, None] < 2, len(motion.joints), axis=1)
    sd = motion.sd[:, k] if is_joint_alone else motion.sd[:, k].max(axis=1, keepdims=True)
    is_wide = ~is_alone & (sd >= most_sd_m)
    reasons = {
        "fewer than two cameras show the player": is_alone,
        f"{_SD_OVER} {100 * most_sd_m:.0f} cm": is_wide,
        "images show them worse than usual": ~is_alone & ~is_wide,
    }
    for why, has_reason in reasons.items():
        said = [f"{what} in {where}" for what, where in _places(motion, is_uncertain & has_reason)]
        if said:
            yield f"{', '.join(said)}: {why}"


def are_of_single_joints(doubts: Sequence[str]) -> bool:
    """Say whether there are doubts, each of single joints' deviations and none of all joints at once."""
    return bool(doubts) and all(_SD_OVER in each and not each.startswith(_ALL_JOINTS) for each in doubts)


def _places(motion: PlayersMotion, is_in: NDArray[np.bool_]) -> Iterator[tuple[str, str]]:
    """Name joints and their frames, of a mask (n, joints): those together whose first and last frames are the same."""
    by_part: dict[str, dict[str, NDArray[np.bool_]]] = {}
    for joint, column in zip(motion.joints, is_in.T, strict=True):
        part, _, side = joint.partition("_")
        by_part.setdefault(part, {})[side] = column
    together: dict[tuple[int, int], dict[str, NDArray[np.bool_]]] = {}
    for part, sides in by_part.items():
        found = {side: column for side, column in sides.items() if column.any()}
        if found:
            frames = np.any(list(found.values()), axis=0)
            rows = np.flatnonzero(frames)
            name = _PLURALS.get(part, part) if len(found) > 1 else f"{next(iter(found))} {part}".strip()
            together.setdefault((int(rows[0]), int(rows[-1])), {})[name] = frames
    for (first, last), parts in together.items():
        n = int(np.any(list(parts.values()), axis=0).sum())
        frames = f"frames {motion.index[first]} to {motion.index[last]}" if n > 1 else f"frame {motion.index[first]}"
        where = frames if n == last - first + 1 else f"{n} of {frames}"
        yield _ALL_JOINTS if len(parts) == len(by_part) > 1 else join_names(list(parts)), where
