"""The block-jump paper's success: a part counts where its rectangle in the pictures covers it (its equation 14)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import SHANK_WIDTH_M, THIGH_WIDTH_M
from airborne.cameras import Rig
from airborne.evaluation.compare import without_nan

Array = NDArray[np.floating]

_WIDTH_M = {"hip": THIGH_WIDTH_M, "knee": SHANK_WIDTH_M, "ankle": SHANK_WIDTH_M, "foot": SHANK_WIDTH_M}
_MARGIN_PX = 5.0
_FEWEST_VIEWS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover:
    """Shares of the frames in which a joint counts as covered, and how far off that lets it be."""

    rate: dict[str, float]  # by joint; NaN where no frame could be judged
    n: dict[str, int]  # frames in which two cameras or more show the joint
    tolerance_m: dict[str, float]  # mean, at the joint's distance from the cameras

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return without_nan(asdict(self))

    def describe(self) -> str:
        """Return the numbers as a short plain table."""
        lines = [f"{'covered':<18}{'rate':>9}{'frames':>9}{'tolerance':>12}"]
        for name, rate in self.rate.items():
            lines.append(f"  {name:<16}{rate:9.1%}{self.n[name]:9d}{self.tolerance_m[name]:10.3f} m")
        return "\n".join(lines)


def success_cover(
    rig: Rig, estimate: Array, truth: Array, joints: Sequence[str], visible: NDArray[np.bool_] | None = None
) -> Cover:
    """Judge joints (n, joints, 3) [m] as the paper's authors did by eye, in the pictures.

    A joint is covered where in two views or more the estimate lies within half of the part's width (thigh 0.15 m, else
    0.11 m) plus 5 px of the truth. A view counts where the truth is in its picture and, if `visible` (n, views, joints)
    is given, is not hidden; frames with fewer than two such views are not judged. An unknown estimate covers nothing.
    Only hips, knees, ankles and feet are judged.
    """
    judged = [k for k, name in enumerate(joints) if _part(name) in _WIDTH_M]
    names = [joints[k] for k in judged]
    width = np.array([_WIDTH_M[_part(name)] for name in names])
    near, shown, tolerance = [], [], []
    for view, camera in enumerate(rig):
        px = camera.px_from_world(truth[:, judged])
        apart = np.linalg.norm(camera.px_from_world(estimate[:, judged]) - px, axis=-1)
        depth = (truth[:, judged] @ camera.camera_from_world.rotation.as_matrix().T)[..., 2]
        depth = depth + camera.camera_from_world.translation[2]
        px_per_m = float(np.mean(np.diagonal(camera.K)[:2])) / depth
        reach = width / 2 * px_per_m + _MARGIN_PX
        is_in = ((px >= -0.5) & (px <= np.array(camera.size) - 0.5)).all(axis=-1)
        near.append(apart < reach)
        shown.append(is_in if visible is None else is_in & visible[:, view][:, judged])
        tolerance.append(reach / px_per_m)
    is_shown = np.stack(shown)
    n_near = (np.stack(near) & is_shown).sum(axis=0)
    is_judged = is_shown.sum(axis=0) >= _FEWEST_VIEWS
    metres = np.where(is_shown, np.stack(tolerance), np.nan)
    return Cover(
        rate={name: _mean((n_near >= _FEWEST_VIEWS)[is_judged[:, k], k]) for k, name in enumerate(names)},
        n={name: int(is_judged[:, k].sum()) for k, name in enumerate(names)},
        tolerance_m={name: _mean(metres[..., k][np.isfinite(metres[..., k])]) for k, name in enumerate(names)},
    )


def _part(joint: str) -> str:
    return joint.split("_")[0]


def _mean(values: Array | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else np.nan
