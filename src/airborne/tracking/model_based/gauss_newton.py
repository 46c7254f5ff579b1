"""Gauss-Newton by analysis-by-synthesis: the pose changes until its rendering agrees with the images of all cameras.

Far out, the blurred mask is fitted to the blurred probability of each pixel to be body, on reduced images
(`fit_silhouettes`). Close in, the composite of the lit body over the background is fitted to the image itself
(`fit_images`), which is not biased toward bright edges as any classification is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from airborne.appearance.model import Appearance, Region
from airborne.body import Pose, PosedBody
from airborne.tracking.model_based.blur import gaussian_taps
from airborne.tracking.model_based.degrees_of_freedom import DegreesOfFreedom, PosePrior
from airborne.tracking.model_based.image_views import NOISE_PX, ImageView, make_image_views
from airborne.tracking.model_based.kernel_arguments import Comparison
from airborne.tracking.model_based.normal_equations import (
    MASK,
    equations_of_known_light,
    photometric_equations,
)
from airborne.tracking.model_based.pose_descent import PoseEquations, descend_pose, map_to_dofs
from airborne.tracking.model_based.render_model import (
    RenderModel,
    ViewBuffers,
    silhouette_buffers,
)
from airborne.tracking.model_based.shape_error import shape_error_gradients, shape_error_px
from airborne.tracking.model_based.twist_equations import Sums, new_blocks, one_block
from airborne.types import Array, Array32

PyramidLevels = Sequence[tuple[int, int]]

# reduction of the image, iterations
FAR, NEAR, CLOSE = ((8, 5), (4, 4), (2, 3)), ((4, 2), (2, 2)), ((2, 1),)
# from a good prediction of a body with joints: on six synthetic people as near as NEAR, 9.0 and 9.1 mm, but with the
# images at half the size alone 9.4 and, after one iteration, 9.9 mm
CLOSE_JOINTED = ((4, 1), (2, 2))
_COARSE_SIGMA_PX = 1.2  # of the reduced image
_CLIP_MASK = 0.5  # a residual of a mask this large has a quarter of the weight
_PATCH = 8.0  # by this factor more pixels of a person are body, or not, together; chosen as `shape_error`'s width
_OVERSTEP = 1.6  # robust weights and the refitted light make each step too short by about this factor
# the same of a rigid body in unknown light, of its position and its rotation: least errors on seven throws
_OVERSTEP_STIFF = np.repeat([2.0, 1.3], 3)
_MOST_STEPS = 12  # at each level of a body with joints
_MOST_STEPS_STIFF = 30  # of a rigid body: its steps are cheap, and a far start may need them
_CONVERGED, _CONVERGED_STIFF = 1 / 3, 1  # squared length of the last step, in sds, a degree of freedom; masks too


@dataclass(frozen=True, slots=True, eq=False)
class Posteriors:
    """Regions and each of their pixels' probability to be body, reduced once for all fits of masks to them."""

    regions: Sequence[Region]
    planes: Sequence[Array32]  # (h, w) each
    _reduced: dict[int, list[ViewBuffers]] = field(default_factory=dict)

    def reduce(self, reduction: int) -> list[ViewBuffers]:
        """Return the views at a reduction, as the kernels take them."""
        if reduction not in self._reduced:
            self._reduced[reduction] = [
                silhouette_buffers(region, plane, reduction, taps=gaussian_taps(_COARSE_SIGMA_PX), clip=_CLIP_MASK)
                for region, plane in zip(self.regions, self.planes, strict=True)
            ]
        return self._reduced[reduction]


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a fit ended."""

    pose: Pose
    dofs: DegreesOfFreedom
    equations: PoseEquations  # before the last step
    rms_light: float  # blurred residual, linear light 0..1
    views: Sequence[ImageView]  # what was compared
    prior: PosePrior | None  # what was expected

    def objective(self, noise: float, prior: PosePrior | None) -> float:
        """Return minus the log-posterior before the last step, for a given variance of the noise."""
        return self.equations.objective(noise, self.dofs.prior_cost(self.equations.pose, prior))

    @property
    def covariance(self) -> Array:
        """Of position [m] and rotation vectors [rad], (6 + 3 joints,) squared; infinite where unobserved."""
        covariance = self.equations.covariance()
        whole = np.zeros((len(self.dofs.embed(covariance[0])),) * 2)
        whole[np.ix_(self.dofs.columns, self.dofs.columns)] = covariance
        return whole


def fit_silhouettes(
    render_model: RenderModel,
    pose: Pose,
    posteriors: Posteriors,
    *,
    levels: PyramidLevels,
    dofs: DegreesOfFreedom,
    prior: PosePrior | None = None,
    goes_on: bool = False,
) -> Pose:
    """Move the body until its masks agree with the posteriors, from coarse to fine.

    Steps end early where they gain next to nothing, unless `goes_on`: a start may be far off.
    """
    taps = gaussian_taps(_COARSE_SIGMA_PX)
    correlated = 4 * np.pi * _COARSE_SIGMA_PX**2
    converged = 0.0 if goes_on else _CONVERGED if dofs.moves_joints else _CONVERGED_STIFF
    for reduction, steps in levels:
        views = posteriors.reduce(reduction)
        empty_cost = sum(view.empty_cost for view in views)

        def evaluate(
            pose: Pose, _: bool, views: list[ViewBuffers] = views, empty_cost: float = empty_cost
        ) -> PoseEquations:
            posed, n = render_model.with_pose(pose), len(render_model.model.segments)
            sums, totals = Sums.zero(n), np.array([empty_cost, 0.0, 0.0])
            for view in views:
                comparison = Comparison(taps, taps, _CLIP_MASK)
                args = render_model.body, view.projection(posed), view.observation, comparison, view.maps
                totals += np.array(photometric_equations(*args, *MASK, sums, one_block(n)))
            return map_to_dofs(
                render_model,
                dofs,
                pose,
                posed,
                sums=sums,
                blocks=[],
                shifted=[],
                totals=totals,
                correlated=correlated,
                shared=_PATCH * correlated if dofs.moves_joints else correlated,
            )

        pose, _ = descend_pose(evaluate, dofs, pose, prior, most_steps=steps, overstep=1.0, tolerance=converged)
    return pose


def fit_images(
    render_model: RenderModel,
    poses: Sequence[Pose],
    views: Sequence[ImageView],
    *,
    dofs: DegreesOfFreedom,
    prior: PosePrior | None = None,
) -> Fit:
    """Move the body until body and background agree with the images; of several starts, return the best end."""
    evaluate, correlated = image_evaluator(render_model, poses, views, dofs=dofs)
    most_steps, converged = (_MOST_STEPS, _CONVERGED) if dofs.moves_joints else (_MOST_STEPS_STIFF, _CONVERGED_STIFF)
    overstep = _OVERSTEP if dofs.moves_joints or render_model.lights is not None else _OVERSTEP_STIFF
    ends = [
        descend_pose(evaluate, dofs, pose, prior, most_steps=most_steps, overstep=overstep, tolerance=converged)
        for pose in poses
    ]
    noise = min(equations.noise for _, equations in ends)
    pose, best = min(ends, key=lambda end: end[1].objective(noise, dofs.prior_cost(end[1].pose, prior)))
    return Fit(pose, dofs, best, (best.noise / correlated) ** 0.5, views, prior)


def linearise_fit(render_model: RenderModel, pose: Pose, views: Sequence[ImageView], *, dofs: DegreesOfFreedom) -> Fit:
    """Return the fit that ends where it begins, without anything expected."""
    evaluate, correlated = image_evaluator(render_model, [pose], views, dofs=dofs)
    equations = evaluate(pose, True)
    return Fit(pose, dofs, equations, (equations.noise / correlated) ** 0.5, views, None)


def linearise_images(
    render_model: RenderModel, pose: Pose, regions: Sequence[Region], appearance: Appearance, *, dofs: DegreesOfFreedom
) -> PoseEquations:
    """Return the normal equations of the images at one pose, without moving it."""
    evaluate, _ = image_evaluator(render_model, [pose], make_image_views(render_model, regions, appearance), dofs=dofs)
    return evaluate(pose, True)


def image_evaluator(
    render_model: RenderModel, poses: Sequence[Pose], views: Sequence[ImageView], *, dofs: DegreesOfFreedom
) -> tuple[Callable[[Pose, bool], PoseEquations], float]:
    """Return the normal equations as a function of poses near the given ones, and how many pixels share their noise.

    The function's second argument says whether the light is fitted for the first time.
    """
    bodies = [render_model.with_pose(pose) for pose in poses]
    empty_cost = sum(view.buffers.empty_cost for view in views)
    correlated = _correlated_px(views)
    shape_px = [shape_error_px(view.buffers, bodies[0]) for view in views] if dofs.moves_joints else []
    shared = max(correlated, float(np.mean(shape_px or [0.0])))

    def evaluate(pose: Pose, is_first: bool) -> PoseEquations:
        posed, n = render_model.with_pose(pose), len(render_model.model.segments)
        sums, totals, blocks, shifted = Sums.zero(n), np.array([empty_cost, 0.0, 0.0]), [], []
        noise_of_views = []
        for image in views:
            sums.B[:] = 0
            blocks.append(new_blocks(image.buffers.whole.x1, image.buffers.whole.y1, n))
            of_view = _add_image_equations(
                render_model, posed, image, iterations=3 if is_first else 1, sums=sums, blocks=blocks[-1]
            )
            totals += of_view
            noise_of_views.append(float(image.noise_px * of_view[1] / of_view[2]) if of_view[2] > 0 else 1.0)
            shifted.append((sums.B * image.shift_sds_px).transpose(2, 0, 1))
        if dofs.moves_joints:
            shifted.append(shape_error_gradients(sums.A, posed))
        return map_to_dofs(
            render_model,
            dofs,
            pose,
            posed,
            sums=sums,
            blocks=blocks,
            shifted=shifted,
            totals=totals,
            correlated=correlated,
            shared=shared,
            noise_of_views=noise_of_views,
        )

    return evaluate, correlated


def _correlated_px(views: Sequence[ImageView]) -> float:
    """Return how many pixels of the images have their noise in common."""
    return float(np.mean([view.noise_px for view in views] or [NOISE_PX]))


def weigh_images(render_model: RenderModel, poses: Sequence[Pose], views: Sequence[ImageView]) -> Array:
    """Return minus the log-likelihood of the images in each pose, by the noise of the best one: (n,) [nat].

    The light is fitted to each.
    """
    totals = np.zeros((len(poses), 3))
    for of_pose, pose in zip(totals, poses, strict=True):
        posed = render_model.with_pose(pose)
        for image in views:
            of_pose += _weigh(render_model, posed, image)
    empty_cost = sum(view.buffers.empty_cost for view in views)
    cost, residual, weight = totals.T
    noise = _correlated_px(views) * np.divide(residual, weight, out=np.ones(len(poses)), where=weight > 0)
    return 0.5 * (cost + empty_cost) / noise.min()


def weigh_image(render_model: RenderModel, posed: PosedBody, image: ImageView) -> float:
    """Return what an image costs with a body, less what it costs without; its light is fitted."""
    return float(_weigh(render_model, posed, image)[0])


def _weigh(render_model: RenderModel, posed: PosedBody, image: ImageView) -> Array:
    """Return the totals of `_add_image_equations`, its light being fitted anew, without the equations."""
    return _add_image_equations(render_model, posed, image, iterations=3, sums=Sums.zero(0), blocks=one_block(0))


def _add_image_equations(
    render_model: RenderModel, posed: PosedBody, image: ImageView, *, iterations: int, sums: Sums, blocks: Array
) -> Array:
    """Add one view's equations; return the cost, less an empty image's, the weighted squared residual, the weight."""
    view = image.buffers
    args = render_model.body, view.projection(posed), view.observation, image.drawn, view.maps
    if render_model.lights is None:
        return np.array(photometric_equations(*args, render_model.paint, view.light, iterations, sums, blocks))
    lamps, ambient = view.light
    return np.array(equations_of_known_light(*args, render_model.paint, lamps, ambient, sums, blocks))
