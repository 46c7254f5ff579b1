"""Gauss-Newton by synthesis: the pose moves until its picture agrees with every camera's at once.

Far out, the blurred mask is fitted to the blurred probability of each pixel to be body, on reduced pictures
(`fit_silhouettes`). Close in, the composite of the lit body over the empty scene is fitted to the picture itself
(`fit_pictures`), which is not pulled toward bright edges as any classification is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance, Region
from airborne.body import Pose, PosedBody
from airborne.tracking.covariance import covariance_of
from airborne.tracking.model_based.degrees_of_freedom import Freedom, Prior
from airborne.tracking.model_based.normal_equations import (
    Sums,
    gaussian_taps,
    lit_equations,
    mapped,
    new_blocks,
    photometric_equations,
    silhouette_equations,
    spread_of,
)
from airborne.tracking.model_based.render_model import Laid, Synthesis, outlined, pictured, shifts_px

Array = NDArray[np.floating]
Levels = Sequence[tuple[int, int]]

# reduction of the picture, iterations
FAR, NEAR, CLOSE = ((8, 5), (4, 4), (2, 3)), ((4, 2), (2, 2)), ((2, 2),)
_COARSE_SIGMA_PX = 1.2  # of the reduced picture
_FINE_SIGMA_PX = 1.2  # of a full frame
_CLIP = 0.1  # linear light, 0..1: a residual this large counts a quarter
_CLIP_LIT = 0.5  # the same in exact light, where no shadow or highlight has to be left out
_CLIP_MASK = 0.5  # the same of a mask
_OVERSTEP = 1.6  # robust weights and refitted light make each step about this much too short
_MOST_STEPS = 12
_MOST_STEPS_STIFF = 30  # of a body in one piece: its steps are cheap, and a far start may need them
_SETTLED = 1 / 3  # squared length of the last step, in sds of the pose, for each degree of freedom
SHAPE_SD_M = 0.007  # a person's segment is not quite where the ellipsoid that fits its picture is
_SHORTER = 0.4
_SLACK = 1e-3  # of the objective: refitted light makes it waver


@dataclass(frozen=True, slots=True)
class Evaluation:
    """The normal equations at one pose, mapped to the free degrees of freedom."""

    pose: Pose
    A: Array  # (d, d)
    g: Array  # (d,)
    J: Array  # (segments, 6, d)
    patches: Sequence[Array]  # (n, segments, 6) gradients that vary together: of blocks, of shifted pictures
    cost: float  # robust squared residual
    noise: float  # mean square of the weighted residual, times how many pixels share it

    def covariance(self) -> Array:
        """Return the covariance (d, d) of the free degrees of freedom."""
        spread = np.zeros_like(self.A)
        for each in self.patches:
            spread_of(np.ascontiguousarray(each), self.J, spread)
        return covariance_of(self.A, noise=self.noise, spread=spread)

    def objective(self, noise: float, prior_cost: float) -> float:
        """Return minus the log-likelihood and the prior's, for a given variance of the noise."""
        return 0.5 * self.cost / noise + prior_cost


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a fit ended."""

    pose: Pose
    freedom: Freedom
    evaluation: Evaluation  # before the last step
    rms_light: float  # blurred residual, linear light 0..1
    steps: int

    @property
    def covariance(self) -> Array:
        """Of position [m] and turns [rad], (6 + 3 joints,) squared; infinite where the pictures show nothing."""
        covariance = self.evaluation.covariance()
        whole = np.zeros((len(self.freedom.whole(covariance[0])),) * 2)
        whole[np.ix_(self.freedom.columns, self.freedom.columns)] = covariance
        return whole


def fit_silhouettes(
    synthesis: Synthesis,
    pose: Pose,
    regions: Sequence[Region],
    posteriors: Sequence[Array],
    levels: Levels,
    freedom: Freedom,
    prior: Prior | None = None,
) -> Pose:
    """Move the body until its masks agree with the posteriors (h, w) of the regions, from coarse to fine."""
    taps = gaussian_taps(_COARSE_SIGMA_PX)
    correlated = 4 * np.pi * _COARSE_SIGMA_PX**2
    for reduction, steps in levels:
        posed = synthesis.place(pose)
        views = [outlined(synthesis, posed, *each, reduction) for each in zip(regions, posteriors, strict=True)]
        views = [view for view in views if view.is_seen]

        def evaluate(pose: Pose, _: int, views: list[Laid] = views) -> Evaluation:
            posed, n = synthesis.place(pose), len(synthesis.model.segments)
            sums, totals, blocks = Sums.zero(n), np.zeros(3), []
            for view in views:
                blocks.append(_blocks(view, n))
                through = view.window, taps, taps, _CLIP_MASK
                args = synthesis.body, _place(posed, view), view.seen, through, view.maps, sums, blocks[-1]
                totals += np.array(silhouette_equations(*args))
            return _mapped(synthesis, freedom, pose, posed, sums, blocks, [], totals, correlated)

        pose = _descend(evaluate, freedom, pose, prior, most_steps=steps, overstep=1.0).pose
    return pose


def fit_pictures(
    synthesis: Synthesis,
    poses: Sequence[Pose],
    regions: Sequence[Region],
    appearance: Appearance,
    freedom: Freedom,
    prior: Prior | None = None,
) -> Fit:
    """Move the body until the composite of body and empty scene agrees with the pictures; say how sure that is.

    From several poses, the one is kept that ends in the best agreement with pictures and prior.
    """
    evaluate, correlated = _comparison(synthesis, poses, regions, appearance, freedom)
    most_steps = _MOST_STEPS_STIFF if len(freedom.columns) <= 6 else _MOST_STEPS
    ends = [
        _descend(evaluate, freedom, pose, prior, most_steps=most_steps, overstep=_OVERSTEP, settled=_SETTLED)
        for pose in poses
    ]
    noise = min(end.evaluation.noise for end in ends)
    last = min(ends, key=lambda end: end.evaluation.objective(noise, freedom.prior_cost(end.evaluation.pose, prior)))
    return Fit(last.pose, freedom, last.evaluation, (last.evaluation.noise / correlated) ** 0.5, last.steps)


def evaluate_pictures(
    synthesis: Synthesis, pose: Pose, regions: Sequence[Region], appearance: Appearance, freedom: Freedom
) -> Evaluation:
    """Return what the pictures say of one pose, without moving it."""
    evaluate, _ = _comparison(synthesis, [pose], regions, appearance, freedom)
    return evaluate(pose, 1)


def _comparison(
    synthesis: Synthesis, poses: Sequence[Pose], regions: Sequence[Region], appearance: Appearance, freedom: Freedom
) -> tuple[Callable[[Pose, int], Evaluation], float]:
    """Return what compares poses near the given ones with the pictures, and how many pixels share their noise."""
    bodies = [synthesis.place(pose) for pose in poses]
    laid_out = [(pictured(synthesis, bodies, region, appearance), region) for region in regions]
    laid_out = [(view, region) for view, region in laid_out if view.is_seen]
    rows_sigma_px = [max(_FINE_SIGMA_PX * region.aspect, 0.5) for _, region in laid_out]
    taps = [(gaussian_taps(_FINE_SIGMA_PX), gaussian_taps(sigma)) for sigma in rows_sigma_px]
    correlated = 4 * np.pi * _FINE_SIGMA_PX * float(np.mean(rows_sigma_px or [_FINE_SIGMA_PX]))
    shifts = [shifts_px(region) for _, region in laid_out]

    def evaluate(pose: Pose, step: int) -> Evaluation:
        posed, n = synthesis.place(pose), len(synthesis.model.segments)
        sums, totals, blocks, shifted = Sums.zero(n), np.zeros(3), [], []
        for (view, _), (taps_u, taps_v), shift in zip(laid_out, taps, shifts, strict=True):
            sums.B[:] = 0
            blocks.append(_blocks(view, n))
            totals += _compare(synthesis, posed, view, (taps_u, taps_v), 3 if step == 1 else 1, sums, blocks[-1])
            shifted.append(np.moveaxis(sums.B * shift, 2, 0))
            if len(freedom.columns) > 6:
                shifted.append(_shape_errors(sums.B, posed, view))
        return _mapped(synthesis, freedom, pose, posed, sums, blocks, shifted, totals, correlated)

    return evaluate, correlated


def _compare(
    synthesis: Synthesis,
    posed: PosedBody,
    view: Laid,
    taps: tuple[Array, Array],
    rounds: int,
    sums: Sums,
    blocks: Array,
) -> Array:
    """Add one view's equations; return the cost, the weighted squared residual and the weight."""
    through = view.window, *taps, _CLIP if synthesis.lights is None else _CLIP_LIT
    args = synthesis.body, _place(posed, view), view.seen, through, view.maps
    if synthesis.lights is None:
        paint = synthesis.albedo, synthesis.is_faceted
        return np.array(photometric_equations(*args, paint, view.light, rounds, sums, blocks))
    size = view.maps[0].shape
    drawn = (
        np.empty(size, np.int16),
        np.empty(size, np.int16),
        np.empty(size, np.float32),
        np.empty((*size, 3), np.float32),
    )
    lamps, ambient = view.light
    return np.array(lit_equations(*args, drawn, synthesis.is_faceted, lamps, ambient, sums, blocks))


def _shape_errors(B: Array, posed: PosedBody, view: Laid) -> Array:
    """Return what it does to the gradient that a person's segments are not ellipsoids: (2 segments, segments, 6).

    Each segment's picture may lie beside the drawn one by SHAPE_SD_M, right or down, in each view by itself.
    """
    n = len(B)
    depth_m = posed.t @ view.packed[6:9] + view.packed[11]
    sd_px = SHAPE_SD_M * np.array([view.K[0, 0], view.K[1, 1]]) / np.maximum(depth_m, 0.1)[:, None]  # (segments, 2)
    rows = np.zeros((n, 2, n, 6))
    rows[np.arange(n), :, np.arange(n)] = np.swapaxes(B[..., :2], 1, 2) * sd_px[..., None]
    return rows.reshape(2 * n, n, 6)


def _place(posed: PosedBody, view: Laid) -> tuple:
    return posed.R, posed.t, view.packed, view.K, posed.t[0]


def _blocks(view: Laid, n_segments: int) -> Array:
    x0, y0, x1, y1 = view.window
    return new_blocks(x1 - x0, y1 - y0, n_segments)


@dataclass(frozen=True, slots=True)
class _Descent:
    pose: Pose  # after the last step
    evaluation: Evaluation  # before it
    steps: int


def _descend(
    evaluate: Callable[[Pose, int], Evaluation],
    freedom: Freedom,
    pose: Pose,
    prior: Prior | None,
    *,
    most_steps: int,
    overstep: float,
    settled: float = 0.0,
) -> _Descent:
    """Step downhill; a step after which the pictures agree less is taken back and shortened."""
    best, motion, share, objective = None, np.zeros(0), overstep, np.inf
    for step in range(1, most_steps + 1):
        tried = evaluate(pose, step)
        noise = max(tried.noise if best is None else best.noise, 1e-9)
        reached = tried.objective(noise, freedom.prior_cost(pose, prior))
        if best is not None and reached > objective * (1 + _SLACK):
            share *= _SHORTER
            pose = freedom.moved(best.pose, share * motion)
            continue
        best, share, noise = tried, overstep, max(tried.noise, 1e-9)
        objective = best.objective(noise, freedom.prior_cost(pose, prior))
        motion = freedom.step(best.pose, best.A / noise, best.g / noise, prior)
        pose = freedom.moved(best.pose, share * motion)
        if motion @ best.A @ motion <= settled * len(motion) * noise:
            break
    assert best is not None
    return _Descent(pose if share == overstep else best.pose, best, step)


def _mapped(
    synthesis: Synthesis,
    freedom: Freedom,
    pose: Pose,
    posed: PosedBody,
    sums: Sums,
    blocks: Sequence[Array],
    shifted: Sequence[Array],
    totals: Array,
    correlated: float,
) -> Evaluation:
    """Map the segments' equations through the chain of joints."""
    J = np.ascontiguousarray(synthesis.jacobian(posed, freedom))
    d = J.shape[-1]
    A, g = np.zeros((d, d)), np.zeros(d)
    mapped(sums.curvature, sums.g, J, A, g)
    cost, total, weight = totals
    noise = correlated * (total / weight if weight > 0 else 1.0)
    rows = [each.reshape(-1, *J.shape[:2]) for each in blocks] + list(shifted)
    return Evaluation(pose, A, g, J, rows, float(cost), float(noise))
