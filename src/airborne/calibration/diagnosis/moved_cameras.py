"""Did a camera move while it filmed? Its place is found block by block from the points that the others see."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.bundle.lenses import project_with_jacobian
from airborne.cameras.camera import Camera, Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.finding import Finding
from airborne.types import Array

_MOST_MOMENTS = 400
_FEWEST_IN_A_BLOCK, _MOST_BLOCKS = 30, 12  # points that place a camera; blocks of the recording
_MOVED_PX, _TIMES_SPREAD = 2.0, 4.0  # a step is told that is larger than both: px, and times the blocks' own spread
_TYPICAL = 0.6  # quantile of distances, above what most points have and below what strays have
_LEAST_GAIN, _LEAST_GAIN_PX = 0.3, 0.3  # share, and px, by which the others must agree better without a camera
_N_STEPS = 15
_SCALE_PX = 2.0  # residuals much beyond this count ever less


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    """What one camera sees of the points that the others agree on: one row an observation."""

    moment: NDArray[np.integer]  # (n,)
    residual_px: Array  # (n, 2)
    jacobian: Array  # (n, 2, 6) by turn [rad] and shift [m] of the camera


@dataclass(frozen=True, slots=True, eq=False)
class _Displacement:
    """A camera's jump."""

    moment: int  # the first after it
    shift_px: float
    spread_px: float
    turn_rad: float
    shift_m: float


def check_moved_cameras(rig: Rig, px: Array, times_s: Array | None = None) -> list[Finding]:
    """Say which cameras moved, when, and how far, by points px (moments, points, cameras, 2) [px], NaN where not seen.

    times_s (moments,) [s]; without them the moments' numbers are told.
    Three cameras or more: those that agree say where the points are. A slow drift is told as one step.
    """
    rows = np.unique(np.linspace(0, len(px) - 1, min(len(px), _MOST_MOMENTS)).astype(int)) if len(px) else []
    if len(rig) < 3 or not len(px):
        return []
    px, when = px[rows], [f"frame {row}" if times_s is None else f"{times_s[row]:.2f} s" for row in rows]
    suspects = _suspects(rig, px)
    others = [name for name in rig.names if name not in suspects]
    steps = {name: _find_displacement(rig, others, name, px) for name in suspects}
    return [_moved_finding(name, step, when) for name, step in steps.items() if step is not None]


def _moved_finding(name: str, step: _Displacement, when: Sequence[str]) -> Finding:
    return Finding(
        kind="moved",
        what=(
            f"{name} moved between {when[step.moment - 1]} and {when[step.moment]}: its picture jumps by "
            f"{step.shift_px:.1f} px (turned by {np.degrees(step.turn_rad):.2f} degrees, shifted by "
            f"{step.shift_m * 1e3:.0f} mm)"
        ),
        advice=(
            "fix it better and film again, or calibrate only with the side of the jump on which the trial was filmed"
        ),
        cameras=(name,),
    )


def _suspects(rig: Rig, px: Array) -> tuple[str, ...]:
    """Return the cameras without which the others agree clearly better; more where that is clearly better again."""
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
    """Return how far cameras disagree [px], per degree of freedom: the mean over the recording's parts of a quantile.

    A few strays do not count, a part of the recording does.
    """
    points = rig.points_from_px(px)
    off = np.linalg.norm(np.stack([camera.px_from_world(points) for camera in rig], axis=2) - px, axis=-1)
    n_views = np.isfinite(off).sum(axis=2, keepdims=True)
    off = off / np.sqrt(np.where(n_views >= 2, 1 - 1.5 / np.maximum(n_views, 2), np.nan))
    parts = [part[np.isfinite(part)] for part in np.array_split(off, _MOST_BLOCKS)]
    typical = [np.quantile(part, _TYPICAL) for part in parts if part.size]
    return float(np.mean(typical)) if typical else np.inf


def _find_displacement(rig: Rig, others: Sequence[str], name: str, px: Array) -> _Displacement | None:
    track = _track(rig, others, name, px)
    blocks = list(_blocks(track.moment))
    if len(blocks) < 4:
        return None
    places = np.array([_fit_displacement(track, rows) for rows in blocks])  # (blocks, 6)
    reference = track.jacobian[np.linspace(0, len(track.jacobian) - 1, 50).astype(int)].reshape(-1, 6)
    shifts = places @ reference.T  # (blocks, 100) px
    best = (-1.0, 0, 0.0, 0.0)
    for k in range(2, len(blocks) - 1):
        before, after = np.median(shifts[:k], axis=0), np.median(shifts[k:], axis=0)
        spread = _rms(np.concatenate([shifts[:k] - before, shifts[k:] - after]), quantile=0.5)
        step_px = _rms((after - before)[None], quantile=0.5)
        best = max(best, (step_px / (spread + 0.1), k, step_px, spread))
    _, k, step_px, spread = best
    if step_px < max(_MOVED_PX, _TIMES_SPREAD * spread):
        return None
    before, after = np.median(places[:k], axis=0), np.median(places[k:], axis=0)
    moment = _first_moment_after(track, before, after)
    change = after - before
    return _Displacement(moment, step_px, spread, float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:])))


def _rms(shifts: Array, *, quantile: float) -> float:
    """Return a quantile over rows of the root mean square distance of points (rows, 2 points) [px]."""
    return float(np.quantile(np.sqrt(2 * np.mean(shifts**2, axis=1)), quantile))


def _track(rig: Rig, others: Sequence[str], name: str, px: Array) -> _Track:
    columns = [rig.names.index(other) for other in others]
    seen = px[:, :, columns]
    points = triangulate_consensus(rig.select(others), seen, np.ones(seen.shape[:-1])).points
    own = px[:, :, rig.names.index(name)]
    moment, point = np.nonzero(np.isfinite(points).all(axis=-1) & np.isfinite(own).all(axis=-1))
    projected, slopes = _project(rig[name], points[moment, point])
    residual = own[moment, point] - projected
    known = np.isfinite(residual).all(axis=1)
    return _Track(moment[known], residual[known], slopes[known])


def _project(camera: Camera, points: Array) -> tuple[Array, Array]:
    n = len(points)
    place = camera.camera_from_world.rotation.as_matrix()
    terms = np.pad(camera.distortion, (0, 5 - len(camera.distortion)))
    inner = np.array([camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2], *terms])
    px, slopes, _ = project_with_jacobian(
        np.broadcast_to(place, (n, 3, 3)),
        np.broadcast_to(camera.centre, (n, 3)),
        np.broadcast_to(inner, (n, 9)),
        np.full(n, camera.lens == "fisheye"),
        points,
    )
    return px, slopes[:, :, :6]


def _blocks(moment: NDArray[np.integer]) -> Iterator[NDArray[np.integer]]:
    """Yield rows of successive blocks of whole moments, alike in size."""
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
    """Return the small turn and shift (6,) that explains the residuals of some rows, robustly (Cauchy).

    A little damping keeps what the points do not tell (turns against shifts) small.
    """
    J, r = track.jacobian[rows], track.residual_px[rows]
    weights, place = np.ones(len(rows)), np.zeros(6)
    for _ in range(_N_STEPS):
        information = np.einsum("nij,n,nik->jk", J, weights, J)
        damping = 1e-6 * np.diag(np.diag(information))
        place = np.linalg.solve(information + damping + 1e-12 * np.eye(6), np.einsum("nij,n,ni->j", J, weights, r))
        off = np.linalg.norm(r - J @ place, axis=1)
        scale = max(1.5 * float(np.median(off)), _SCALE_PX / 4)
        weights = 1 / (1 + (off / scale) ** 2)
    return place


def _first_moment_after(track: _Track, before: Array, after: Array) -> int:
    """Return the first moment at which the later place fits better, as a whole."""

    def cost(place: Array) -> Array:
        off = np.sum((track.residual_px - track.jacobian @ place) ** 2, axis=1)
        return np.bincount(track.moment, np.log1p(off / _SCALE_PX**2)).astype(float)

    gain = np.cumsum(cost(before) - cost(after))  # falls until the jump, then rises
    return int(np.argmin(gain[:-1])) + 1
