"""Did a camera move while it filmed? Its displacement, block by block, from the points that the others triangulate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.bundle.lenses import project_by_camera
from airborne.cameras.camera import Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.finding import Finding
from airborne.types import Array

_MOST_MOMENTS = 400  # evenly spaced, that are looked at
_FEWEST_IN_A_BLOCK, _MOST_BLOCKS = 30, 12  # observations of a block; blocks of the recording
_MOVED_PX, _TIMES_SPREAD = 2.0, 4.0  # a step is reported above both: px, and multiples of the scatter of the blocks
_TYPICAL = 0.6  # quantile of distances, below the outliers
_LEAST_GAIN, _LEAST_GAIN_PX = 0.3, 0.3  # share, and px, by which the misfit must fall without a camera
_N_STEPS = 15  # of Gauss and Newton
_SCALE_PX = 2.0  # of the Cauchy loss


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    """A camera's observations of the points that the others agree on, one a row."""

    moment: NDArray[np.integer]  # (n,)
    residual_px: Array  # (n, 2)
    jacobian: Array  # (n, 2, 6) by rotation [rad] and shift [m] of the camera


@dataclass(frozen=True, slots=True, eq=False)
class _Displacement:
    """A sudden displacement of a camera."""

    moment: int  # the first after it
    shift_px: float
    turn_rad: float
    shift_m: float


def check_moved_cameras(rig: Rig, px: Array, times_s: Array | None = None) -> list[Finding]:
    """Report cameras that moved, when and how far, from px (moments, points, cameras, 2) [px], NaN where not seen.

    times_s (moments,) [s]; without them the moments are given by number. Needs three cameras: those that agree
    triangulate the points. A slow drift is reported as one step.
    """
    rows = np.unique(np.linspace(0, len(px) - 1, min(len(px), _MOST_MOMENTS)).astype(int)) if len(px) else []
    if len(rig) < 3 or not len(px):
        return []
    px, time_texts = px[rows], [f"frame {row}" if times_s is None else f"{times_s[row]:.2f} s" for row in rows]
    suspects = _suspects(rig, px)
    others = [name for name in rig.names if name not in suspects]
    displacements = {name: _find_displacement(rig, others, name, px) for name in suspects}
    return [
        _displacement_finding(name, displacement, time_texts)
        for name, displacement in displacements.items()
        if displacement is not None
    ]


def _displacement_finding(name: str, displacement: _Displacement, times: Sequence[str]) -> Finding:
    return Finding(
        kind="moved",
        what=(
            f"{name} moved between {times[displacement.moment - 1]} and {times[displacement.moment]}: its image "
            f"jumps by {displacement.shift_px:.1f} px (turned by {np.degrees(displacement.turn_rad):.2f} degrees, "
            f"shifted by {displacement.shift_m * 1e3:.0f} mm)"
        ),
        advice=(
            "fix it better and film again, or calibrate only with the side of the jump on which the trial was filmed"
        ),
        cameras=(name,),
    )


def _suspects(rig: Rig, px: Array) -> tuple[str, ...]:
    """Return the cameras without which the others agree clearly better; more while each one more clearly helps."""
    best, suspects = _misfit(rig, px), ()
    for n in range(1, len(rig) - 1):
        misfits = {
            names: _misfit(rig.select([name for name in rig.names if name not in names]), _without(rig, px, names))
            for names in combinations(rig.names, n)
        }
        names = min(misfits, key=misfits.__getitem__)
        if not misfits[names] < best - max(_LEAST_GAIN_PX, _LEAST_GAIN * best):
            break
        best, suspects = misfits[names], names
    return suspects


def _without(rig: Rig, px: Array, names: Sequence[str]) -> Array:
    return px[:, :, [i for i, name in enumerate(rig.names) if name not in names]]


def _misfit(rig: Rig, px: Array) -> float:
    """Return the cameras' misfit [px] per degree of freedom: a quantile of each part of the recording, averaged.

    A few outliers do not count, a part of the recording does.
    """
    points = rig.points_from_px(px)
    distances = np.linalg.norm(np.stack([camera.px_from_world(points) for camera in rig], axis=2) - px, axis=-1)
    n_views = np.isfinite(distances).sum(axis=2, keepdims=True)
    distances = distances / np.sqrt(np.where(n_views >= 2, 1 - 1.5 / np.maximum(n_views, 2), np.nan))
    parts = [part[np.isfinite(part)] for part in np.array_split(distances, _MOST_BLOCKS)]
    quantiles = [np.quantile(part, _TYPICAL) for part in parts if part.size]
    return float(np.mean(quantiles)) if quantiles else np.inf


def _find_displacement(rig: Rig, others: Sequence[str], name: str, px: Array) -> _Displacement | None:
    track = _track(rig, others, name, px)
    blocks = list(_blocks(track.moment))
    if len(blocks) < 4:
        return None
    displacements = np.array([_fit_displacement(track, rows) for rows in blocks])  # (blocks, 6)
    jacobian = track.jacobian[np.linspace(0, len(track.jacobian) - 1, 50).astype(int)].reshape(-1, 6)
    shifts = displacements @ jacobian.T  # (blocks, 100) px
    best = (-1.0, 0, 0.0, 0.0)
    for k in range(2, len(blocks) - 1):
        before, after = np.median(shifts[:k], axis=0), np.median(shifts[k:], axis=0)
        scatter = _rms(np.concatenate([shifts[:k] - before, shifts[k:] - after]), quantile=0.5)
        step_px = _rms((after - before)[None], quantile=0.5)
        best = max(best, (step_px / (scatter + 0.1), k, step_px, scatter))
    _, k, step_px, scatter = best
    if step_px < max(_MOVED_PX, _TIMES_SPREAD * scatter):
        return None
    before, after = np.median(displacements[:k], axis=0), np.median(displacements[k:], axis=0)
    moment = _first_moment_after(track, before, after)
    change = after - before
    return _Displacement(moment, step_px, float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:])))


def _rms(shifts: Array, *, quantile: float) -> float:
    """Return a quantile over rows of the root mean square distance of points (rows, 2 points) [px]."""
    return float(np.quantile(np.sqrt(2 * np.mean(shifts**2, axis=1)), quantile))


def _track(rig: Rig, others: Sequence[str], name: str, px: Array) -> _Track:
    columns = [rig.names.index(other) for other in others]
    others_px = px[:, :, columns]
    points = triangulate_consensus(rig.select(others), others_px, np.ones(others_px.shape[:-1])).points
    own = px[:, :, rig.names.index(name)]
    moment, point = np.nonzero(np.isfinite(points).all(axis=-1) & np.isfinite(own).all(axis=-1))
    projected, jacobian, _ = project_by_camera(rig[name], points[moment, point])
    residual = own[moment, point] - projected
    is_valid = np.isfinite(residual).all(axis=1)
    return _Track(moment[is_valid], residual[is_valid], jacobian[is_valid, :, :6])


def _blocks(moment: NDArray[np.integer]) -> Iterator[NDArray[np.integer]]:
    """Yield rows of successive blocks of whole moments, of about equal size."""
    n_blocks = min(_MOST_BLOCKS, len(moment) // _FEWEST_IN_A_BLOCK)
    if n_blocks < 1:
        return
    edges = moment[np.linspace(0, len(moment) - 1, n_blocks + 1).astype(int)]
    edges[-1] += 1
    for first, last in pairwise(edges):
        rows = np.flatnonzero((moment >= first) & (moment < last))
        if len(rows) >= _FEWEST_IN_A_BLOCK / 2:
            yield rows


def _fit_displacement(track: _Track, rows: NDArray[np.integer]) -> Array:
    """Return the small rotation and shift (6,) that explain the residuals of some rows, robustly (Cauchy).

    A little damping keeps poorly determined directions (rotation against shift) small.
    """
    J, r = track.jacobian[rows], track.residual_px[rows]
    weights, displacement = np.ones(len(rows)), np.zeros(6)
    for _ in range(_N_STEPS):
        displacement = _displace(J, r, weights)
        weights = _cauchy_weights(np.linalg.norm(r - J @ displacement, axis=1))
    return displacement


def _displace(J: Array, r: Array, weights: Array) -> Array:
    """Solve the weighted normal equations: (6,)."""
    information = np.einsum("nij,n,nik->jk", J, weights, J)
    damping = 1e-6 * np.diag(np.diag(information)) + 1e-12 * np.eye(6)
    return np.linalg.solve(information + damping, np.einsum("nij,n,ni->j", J, weights, r))


def _cauchy_weights(distances: Array) -> Array:
    scale = max(1.5 * float(np.median(distances)), _SCALE_PX / 4)
    return 1 / (1 + (distances / scale) ** 2)


def _first_moment_after(track: _Track, before: Array, after: Array) -> int:
    """Return the change point: the first moment at which the later displacement fits better."""

    def cost(displacement: Array) -> Array:
        squares = np.sum((track.residual_px - track.jacobian @ displacement) ** 2, axis=1)
        return np.bincount(track.moment, np.log1p(squares / _SCALE_PX**2)).astype(float)

    gain = np.cumsum(cost(before) - cost(after))  # falls until the jump, then rises
    return int(np.argmin(gain[:-1])) + 1
