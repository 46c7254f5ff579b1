"""Fit a body to a person: lengths, girths, borders of the clothes and colours, with the poses, from a few frames.

The joints' positions, known to a few centimetres, give lengths and initial poses; the images give the rest. Shape and
poses are refined jointly by Gauss-Newton on the composite of body and background (`composites`), coarse images first.
The poses are eliminated frame by frame, so that the cost grows with the number of frames and not with its cube.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import delta_between
from airborne.body.inverse_kinematics import fit_lengths, fit_pose
from airborne.body.outfits import Border, with_borders
from airborne.body.shaping import with_mass, with_segment_lengths
from airborne.body_fitting.checks import joint_widths_m
from airborne.body_fitting.clothes import find_borders, sample_clothing
from airborne.body_fitting.composites import NO_MISFIT, composite_equations, misfit
from airborne.body_fitting.shape import (
    ShapeParameter,
    apply_shape,
    border_parameters,
    borders_of,
    girths_of,
    lengths_of,
    shape_parameters,
)
from airborne.body_fitting.shape_motion import N_AFFINE, ShapeMotion
from airborne.body_fitting.views import LEAST_MARGIN_PX, compare_fits, learn_background, pose_views, prepare_views
from airborne.errors import BodyError
from airborne.tracking.image_regions import reduce_frames
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, all_joints
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers
from airborne.types import Array, Progress
from airborne.video import Frames

_LEVELS_PX_PER_M = (60.0, 100.0, 150.0)  # of the images that are compared, coarse to fine
JOINT_SD_M = 0.025  # of a landmark of weight 1
_PRIOR_SD = (0.1, 0.2, 0.25)  # of a pose about that of the landmarks: root [m], root [rad], joints [rad]
_MOST_STEPS = 4  # a level
_CONVERGED = 1.0  # a step must gain more log-likelihood than this [nats]
_BACKTRACK, _MOST_BACKTRACKS = 0.4, 3  # factor on a step that does not gain, and how often
_FAR_RMS_M = 0.05  # of landmarks: a pose further off is looked for anew
_MARGIN_M = 0.1  # around the body, for its motion
# factors on the girths of the body that masks the person when the background is learned, by level
_MASK_GIRTHS = (1.5, 1.25, 1.15)


@dataclass(frozen=True, slots=True, eq=False)
class BodyObservation:
    """The images of one time, and the positions of the body's landmarks."""

    frames: Frames
    landmarks: Mapping[str, Array]  # landmark -> (3,) world [m]; NaN where unknown
    pose: Pose | None = None  # near by, where one is known


@dataclass(frozen=True, slots=True, eq=False)
class BodyFit:
    """A body fitted to a person."""

    model: BodyModel
    poses: tuple[Pose, ...]  # one per observation
    start: BodyModel  # the same clothes, lengths from the landmarks alone
    start_poses: tuple[Pose, ...]  # from the landmarks alone
    lengths: dict[str, float]  # segment without its side -> factor on the given body
    girths: dict[str, tuple[float, float]]  # across, on the given body
    joint_widths: dict[str, float]  # hip, shoulder -> factor on the given body's distance of left and right
    borders: dict[str, Border]
    rms_light: tuple[float, float]  # before and after: robust, blurred, of the images around the body; 0..1
    landmark_rms_m: tuple[float, float]  # before and after


@dataclass(frozen=True, slots=True, eq=False)
class _Iterate:
    shape: Array  # (k,) see `shape`
    poses: tuple[Pose, ...]
    body: RenderModel  # of that shape


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """What is fixed while shape and poses are refined: the images at one reduction, clothes, priors."""

    base: RenderModel  # dressed
    parameters: tuple[ShapeParameter, ...]
    priors: tuple[PosePrior, ...]  # of each observation's pose
    landmarks: tuple[Array, ...]  # (landmarks, 3) per observation
    weights: Array  # (landmarks,) of their squared distances
    views: tuple[tuple[ViewBuffers, ...], ...]  # of each observation

    @property
    def shape_precision(self) -> Array:
        """Inverse variances (k,) of the shape about 0."""
        return np.array([parameter.sd for parameter in self.parameters]) ** -2

    def iterate(self, shape: Array, poses: tuple[Pose, ...]) -> _Iterate:
        """Prepare a shape and poses for the images."""
        return _Iterate(shape, poses, self.base.reshape(apply_shape(self.base.model, self.parameters, shape)))

    @property
    def landmark_scale(self) -> Array:
        """One over the sd of each landmark's coordinates: (3 landmarks,) [1/m]."""
        return np.repeat(np.sqrt(self.weights) / JOINT_SD_M, 3)

    def is_known(self, index: int) -> NDArray[np.bool_]:
        """Whether an observation has each landmark's coordinates: (3 landmarks,)."""
        return np.isfinite(self.landmarks[index]).ravel()

    def landmark_residuals(self, posed: PosedBody, index: int) -> Array:
        """Return the landmarks' residuals in sds: (3 landmarks,); 0 where unknown."""
        residuals = (self.landmarks[index] - posed.landmarks).ravel() * self.landmark_scale
        return np.where(self.is_known(index), residuals, 0.0)


def fit_body(
    model: BodyModel,
    observations: Sequence[BodyObservation],
    *,
    scenery: Sequence[BodyObservation] = (),
    weights: Mapping[str, float] | None = None,
    mass_kg: float | None = None,
    levels_px_per_m: Sequence[float] = _LEVELS_PX_PER_M,
    girths_alone: bool = False,
    progress: Progress | None = None,
) -> BodyFit:
    """Fit a body with joints to a person observed at a few times.

    `scenery` are further times from which the background is learned; `weights` are those of each landmark's squared
    distance, 1 where not named. Left and right are alike. Masses and inertias follow the shape at constant density, or
    add up to `mass_kg`. The images are compared from coarse to fine, reduced to `levels_px_per_m` where larger. With
    `girths_alone`, lengths, widths between joints and the clothes' borders stay. Raises BodyError where the landmarks
    determine no pose, and where the images do not show a part of the body.
    """
    if not observations:
        raise BodyError("no frame to fit the body to; give at least one with known landmarks")
    landmarks = tuple(_landmarks(model, each.landmarks) for each in observations)
    lengths = {} if girths_alone else measure_lengths(model, [each.landmarks for each in observations])
    start = with_segment_lengths(model, lengths)
    all_times = (*observations, *scenery)
    initial = tuple(_pose_from_landmarks(start, each, weights, each.pose) for each in observations)
    for each in scenery:
        nearest = min(range(len(observations)), key=lambda i: abs(observations[i].frames.index - each.frames.index))
        initial += (_pose_from_landmarks(start, each, weights, initial[nearest]),)
    parameters = tuple(each for each in shape_parameters(start) if not girths_alone or each.kind == "girth")
    shape, own_poses = np.zeros(len(parameters)), initial[: len(observations)]
    report = progress or (lambda done, total: None)
    for number, px_per_m in enumerate(levels_px_per_m):
        margin_px = max(LEAST_MARGIN_PX, round(_MARGIN_M * px_per_m))
        current = apply_shape(start, parameters, shape)
        images = [reduce_frames(each.frames, current.with_pose(initial[0]), px_per_m) for each in all_times]
        girth = _MASK_GIRTHS[min(number, len(_MASK_GIRTHS) - 1)]
        poses = (*own_poses, *initial[len(observations) :])
        background = learn_background(current, images, poses, girth=girth, margin_px=margin_px)
        observed = images[: len(observations)]
        views = pose_views(current, own_poses, observed)
        borders = {} if girths_alone else find_borders(current, views)
        dressed = sample_clothing(with_borders(current, borders), views)
        all_parameters = (*parameters, *border_parameters(current, borders))
        level = _Level(
            base=RenderModel.of(
                with_borders(start, borders).with_colours(np.array([part.colour for part in dressed.parts]))
            ),
            parameters=all_parameters,
            priors=tuple(PosePrior(pose, _prior_sd(start)) for pose in initial[: len(observations)]),
            landmarks=landmarks,
            weights=np.array([(weights or {}).get(mark.name, 1.0) for mark in model.landmarks]),
            views=prepare_views(dressed, own_poses, observed, background, margin_px=margin_px),
        )
        state = level.iterate(np.append(shape, np.zeros(len(all_parameters) - len(parameters))), own_poses)
        for step in range(_MOST_STEPS):
            report(number * _MOST_STEPS + step, _MOST_STEPS * len(levels_px_per_m))
            following = _step(level, state)
            if following is None:
                break
            state = following
        shape, own_poses = state.shape[: len(parameters)], state.poses
    report(_MOST_STEPS * len(levels_px_per_m), _MOST_STEPS * len(levels_px_per_m))
    fitted = sample_clothing(state.body.model, pose_views(state.body.model, state.poses, observed))
    before = with_borders(start, borders_of(level.parameters, state.shape)), initial[: len(observations)]
    before = sample_clothing(before[0], pose_views(*before, observed)), before[1]
    lights = compare_fits(before, (fitted, state.poses), observed, background)
    return BodyFit(
        model=fitted if mass_kg is None else with_mass(fitted, mass_kg),
        poses=state.poses,
        start=before[0],
        start_poses=before[1],
        lengths=lengths_of(level.parameters, state.shape, lengths),
        girths=girths_of(level.parameters, state.shape),
        joint_widths={joint: own / joint_widths_m(model)[joint] for joint, own in joint_widths_m(fitted).items()},
        borders=borders_of(level.parameters, state.shape),
        rms_light=lights,
        landmark_rms_m=(_landmark_rms_m(*before, landmarks), _landmark_rms_m(fitted, state.poses, landmarks)),
    )


def _step(level: _Level, state: _Iterate) -> _Iterate | None:
    """Take a Gauss-Newton step of shape and poses, with backtracking; None where no step gains enough."""
    here = state.body
    motion = ShapeMotion.of(here.model, level.parameters)
    freedom, k = all_joints(here.model), len(level.parameters)
    total, systems = NO_MISFIT, []
    for index, (pose, views) in enumerate(zip(state.poses, level.views, strict=True)):
        posed = here.with_pose(pose)
        border_axes = np.einsum("sij,sj->si", posed.R, motion.axis)
        A, g = np.zeros((len(posed.R), N_AFFINE, N_AFFINE)), np.zeros((len(posed.R), N_AFFINE))
        for view in views:
            view_misfit, own_A, own_g = composite_equations(here, posed, view, border_axes)
            total, A, g = total + view_misfit, A + own_A, g + own_g
        J = motion.surface_jacobian(posed)
        rows = level.landmark_scale[:, None] * motion.landmark_jacobian(posed).reshape(-1, J.shape[-1])
        rows = np.where(level.is_known(index)[:, None], rows, 0.0)
        H = np.tensordot(J, A @ J, axes=([0, 1], [0, 1]))
        systems.append(
            (
                H,
                np.tensordot(J, g, axes=([0, 1], [0, 1])),
                rows.T @ rows,
                rows.T @ level.landmark_residuals(posed, index),
            )
        )
    noise = total.noise
    systems = [(H / noise + J, g / noise + j) for H, g, J, j in systems]
    S, s = np.diag(level.shape_precision), -level.shape_precision * state.shape
    for (H, g), pose, prior in zip(systems, state.poses, level.priors, strict=True):
        rows, residuals = freedom.rest_residuals(pose)
        own = H[k:, k:] + np.diag(1 / prior.sd**2) + rows.T @ rows
        gradient = g[k:] - delta_between(prior.expected, pose) / prior.sd**2 - rows.T @ residuals
        through = np.linalg.solve(own, H[k:, :k]).T
        S, s = S + H[:k, :k] - through @ H[k:, :k], s + g[:k] - through @ gradient
    delta = np.linalg.solve(S, s)
    pose_deltas = [
        freedom.solve_step(pose, H[k:, k:], g[k:] - H[k:, :k] @ delta, prior)
        for (H, g), pose, prior in zip(systems, state.poses, level.priors, strict=True)
    ]
    objective, share = _objective(level, state, noise), 1.0
    for _ in range(_MOST_BACKTRACKS):
        poses = tuple(freedom.update(pose, share * d) for pose, d in zip(state.poses, pose_deltas, strict=True))
        tried = level.iterate(state.shape + share * delta, poses)
        if _objective(level, tried, noise) < objective - _CONVERGED:
            return tried
        share *= _BACKTRACK
    return None


def _objective(level: _Level, state: _Iterate, noise: float) -> float:
    """Return the negative log-posterior: images, landmarks and priors."""
    here = state.body
    freedom, total = all_joints(here.model), 0.5 * float(level.shape_precision @ state.shape**2)
    for index, (pose, views) in enumerate(zip(state.poses, level.views, strict=True)):
        posed = here.with_pose(pose)
        total += 0.5 / noise * sum(misfit(here, posed, view).cost for view in views)
        total += 0.5 * float(np.sum(level.landmark_residuals(posed, index) ** 2)) + freedom.prior_cost(
            pose, level.priors[index]
        )
    return total


def _prior_sd(model: BodyModel) -> Array:
    return np.repeat(_PRIOR_SD, [3, 3, 3 * (len(model.segments) - 1)])


def measure_lengths(model: BodyModel, landmarks: Sequence[Mapping[str, Array]]) -> dict[str, float]:
    """Measure the segments' lengths, relative to the model's, by the landmarks (3,) [m] of some times."""
    return fit_lengths(model, np.stack([_landmarks(model, each) for each in landmarks]))


def _landmarks(model: BodyModel, positions: Mapping[str, Array]) -> Array:
    """Return the landmarks' positions in the model's order: (landmarks, 3) [m], NaN where unknown."""
    unknown = np.full(3, np.nan)
    return np.array([positions.get(mark.name, unknown) for mark in model.landmarks], float)


def _pose_from_landmarks(
    model: BodyModel, observation: BodyObservation, weights: Mapping[str, float] | None, near: Pose | None = None
) -> Pose:
    """Fit a pose to landmarks; from a pose `near` by, unless it leads to none that is close."""
    pairs = zip(model.landmarks, _landmarks(model, observation.landmarks), strict=True)
    targets = {mark.name: at for mark, at in pairs if np.isfinite(at).all()}
    fit = fit_pose(model, targets, weights=weights, start=near)
    if near is not None and fit.rms_m > _FAR_RMS_M:
        return fit_pose(model, targets, weights=weights).pose
    return fit.pose


def _landmark_rms_m(model: BodyModel, poses: Sequence[Pose], landmarks: Sequence[Array]) -> float:
    residuals = [model.with_pose(pose).landmarks - targets for pose, targets in zip(poses, landmarks, strict=True)]
    return float(np.sqrt(np.nanmean(np.sum(np.square(residuals), axis=-1))))
