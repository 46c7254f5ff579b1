"""Where a body may be in a frame in which it is lost: by the frames around it in which it is not."""

from __future__ import annotations

import numpy as np

from airborne.body import Pose
from airborne.body.chain import delta_between, move_pose
from airborne.motion.rows import MotionRows

_FARTHEST = 3.0  # as many times the way between two frames: what goes on beyond has turned and fallen otherwise


def ghost_of(rows: MotionRows, frame: int) -> tuple[Pose, str] | None:
    """Place a body in a frame where it has no pose; say by which frames. None where the run has no pose at all.

    Between two frames it is placed by their times; beyond the last, or before the first, as the two nearest go on.
    """
    seen = np.flatnonzero(np.isfinite(rows.position).all(axis=1))
    if not len(seen):
        return None
    place = int(np.searchsorted(rows.index[seen], frame))
    pair = seen[max(0, min(place - 1, len(seen) - 2)) :][:2]
    frames = rows.index[pair]
    poses = [pose for each in frames if (pose := rows.pose(int(each))) is not None]
    if len(poses) < 2:
        return (poses[0], f"where frame {frames[0]} has it") if poses else None
    time_s, (begin_s, end_s) = np.interp(frame, rows.index, rows.time_s), rows.time_s[pair]
    share = float(np.clip((time_s - begin_s) / (end_s - begin_s), -_FARTHEST, 1 + _FARTHEST))
    how = "between" if 0 <= share <= 1 else "as it goes on from"
    return move_pose(poses[0], share * delta_between(*poses)), f"{how} frames {frames[0]} and {frames[1]}"
