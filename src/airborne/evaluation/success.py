"""The block-jump paper's success measure: a part counts if its rectangle in the images covers it (its equation 14).

The paper counts parts covered wholly or partly by the rectangle's side, within an error range that it does not state.
Two readings are reported: the estimate lies on the part, or its rectangle touches that of the part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import SHANK_WIDTH_M, THIGH_WIDTH_M
from airborne.cameras import Rig
from airborne.types import Array

_WIDTH_M = {"hip": THIGH_WIDTH_M, "knee": SHANK_WIDTH_M, "ankle": SHANK_WIDTH_M, "foot": SHANK_WIDTH_M}
_MARGIN_PX = 5.0  # beside the reach in metres
_FEWEST_VIEWS = 2  # in which a joint must be seen, and hit, to count


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover:
    """Shares of the frames in which a joint counts as covered, and the tolerance that this implies."""

    rate: dict[str, float]  # by joint; NaN if no frame could be judged
    n: dict[str, int]  # frames in which at least two cameras show the joint
    tolerance_m: dict[str, float]  # mean, at the joint's distance from the cameras
    touching_rate: dict[str, float]  # the same if rectangles need only touch
    touching_tolerance_m: dict[str, float]


def success_cover(
    rig: Rig, estimate: Array, truth: Array, joints: Sequence[str], *, visible: NDArray[np.bool_] | None = None
) -> Cover:
    """Judge joints (n, joints, 3) [m] in the images, as the paper's authors did by eye.

    A joint is covered where in two views or more the estimate lies within half of the part's width (thigh 0.15 m, else
    0.11 m) plus 5 px of the truth; the rectangles touch where it lies within a whole width plus 5 px. A view counts
    where the truth is in its image and, if `visible` (n, views, joints) is given, is not occluded; frames with fewer
    than two such views are not judged. An unknown estimate covers nothing. Only hips, knees, ankles, feet are judged.
    """
    judged = [k for k, name in enumerate(joints) if _part(name) in _WIDTH_M]
    names = [joints[k] for k in judged]
    width = np.array([_WIDTH_M[_part(name)] for name in names])
    distance_px, px_per_m, in_view = [], [], []
    for view, camera in enumerate(rig):
        px = camera.px_from_world(truth[:, judged])
        distance_px.append(np.linalg.norm(camera.px_from_world(estimate[:, judged]) - px, axis=-1))
        depth = (truth[:, judged] @ camera.camera_from_world.rotation.as_matrix().T)[..., 2]
        depth = depth + camera.camera_from_world.translation[2]
        px_per_m.append(float(np.mean(np.diagonal(camera.K)[:2])) / depth)
        is_in = ((px >= -0.5) & (px <= np.array(camera.size) - 0.5)).all(axis=-1)
        in_view.append(is_in if visible is None else is_in & visible[:, view][:, judged])
    is_shown, scale = np.stack(in_view), np.stack(px_per_m)
    is_judged = is_shown.sum(axis=0) >= _FEWEST_VIEWS

    def within(reach_m: Array) -> tuple[dict[str, float], dict[str, float]]:
        reach_px = reach_m * scale + _MARGIN_PX
        is_near = ((np.stack(distance_px) < reach_px) & is_shown).sum(axis=0) >= _FEWEST_VIEWS
        metres = np.where(is_shown, reach_px / scale, np.nan)
        return (
            {name: _mean(is_near[is_judged[:, k], k]) for k, name in enumerate(names)},
            {name: _mean(metres[..., k][np.isfinite(metres[..., k])]) for k, name in enumerate(names)},
        )

    (rate, tolerance_m), (touching_rate, touching_tolerance_m) = within(width / 2), within(width)
    return Cover(
        rate=rate,
        n={name: int(is_judged[:, k].sum()) for k, name in enumerate(names)},
        tolerance_m=tolerance_m,
        touching_rate=touching_rate,
        touching_tolerance_m=touching_tolerance_m,
    )


def _part(joint: str) -> str:
    return joint.split("_")[0]


def _mean(values: Array | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else np.nan
