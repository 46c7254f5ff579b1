"""Fit a body to a person: lengths, girths, borders of the clothes and colours, with the poses, from a few frames.

The joints' places, which are known to a few centimetres, give lengths and first poses; the images the rest. Shape and
poses move together by Gauss-Newton on the composite of body and empty scene (`composites`), coarse images first. The
poses are eliminated frame by frame, so that the cost grows with the number of frames and not with its cube.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from airborne.appearance.model import Appearance
from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import delta_between, move_pose
from airborne.body.inverse_kinematics import fit_lengths, fit_pose
from airborne.body.outfits import Border, with_borders
from airborne.body.shaping import with_girths, with_mass, with_segment_lengths
from airborne.body_fitting.clothes import PosedView, find_borders, sample_colours
from airborne.body_fitting.composites import NO_MISFIT, misfit, normal_equations
from airborne.body_fitting.shape import (
    ShapeParameter,
    apply_shape,
    border_parameters,
    borders_of,
    girths_of,
    lengths_of,
    shape_parameters,
)
from airborne.errors import BodyError
from airborne.tracking.image_regions import crop_regions, reduce_frames
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, all_joints
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers, image_buffers
from airborne.types import Array, Progress
from airborne.video import Frames

_LEVELS_PX_PER_M = (60.0, 100.0, 150.0)  # of the images that are compared, coarse to fine
JOINT_SD_M = 0.025  # of a landmark of weight 1
_PRIOR_SD = (0.1, 0.2, 0.25)  # of a pose about the landmarks' own: [m], [rad], [rad]
_MOST_STEPS = 4  # a level
_CONVERGED = 1.0  # a step that makes no more likely than this is none [nats]
_BACKTRACK, _MOST_BACKTRACKS = 0.4, 3
_MARGIN_M, _LEAST_MARGIN_PX = 0.1, 8  # round the body, that it may move in
_LEVER_M = 0.3  # a turn by which this far out a point moves a pixel is a step
_MASK_GIRTHS = (1.5, 1.25, 1.15)  # the body by which the empty scene is learned, level by level


@dataclass(frozen=True, slots=True, eq=False)
class BodyObservation:
    """What the cameras saw at one time, and where the body's landmarks were."""

    frames: Frames
    landmarks: Mapping[str, Array]  # landmark -> (3,) world [m]; NaN where unknown


@dataclass(frozen=True, slots=True, eq=False)
class BodyFit:
    """A body fitted to a person."""

    model: BodyModel
    poses: tuple[Pose, ...]  # one a sighting
    start: BodyModel  # dressed alike, before the images changed its shape: lengths from the landmarks alone
    start_poses: tuple[Pose, ...]  # from the landmarks alone
    lengths: dict[str, float]  # segment without its side -> factor on the given body
    girths: dict[str, tuple[float, float]]  # across, on the given body
    borders: dict[str, Border]
    rms_light: tuple[float, float]  # before and after: robust, blurred, of the images round the body; 0..1
    landmark_rms_m: tuple[float, float]  # before and after


@dataclass(frozen=True, slots=True, eq=False)
class _Iterate:
    shape: Array  # (k,) see `shape`
    poses: tuple[Pose, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """What is held still while shape and poses move: the images at one reduction, clothes, what is expected."""

    base: BodyModel  # dressed
    parameters: tuple[ShapeParameter, ...]
    priors: tuple[PosePrior, ...]  # a sighting's pose
    landmarks: tuple[Array, ...]  # (landmarks, 3) a sighting
    weights: Array  # (landmarks,) what they count
    views: tuple[tuple[ViewBuffers, ...], ...]  # a sighting's
    step_m: float  # about a pixel

    @property
    def shape_precision(self) -> Array:
        """Inverse variances (k,) of the shape about 0."""
        return np.array([knob.sd for knob in self.parameters]) ** -2

    def render_model(self, shape: Array) -> RenderModel:
        """Make the body of a shape ready."""
        return RenderModel.of(apply_shape(self.base, self.parameters, shape))

    def landmark_residuals(self, posed: PosedBody, index: int) -> Array:
        """Return how far a body's landmarks are from where they were seen, in sds; 0 where unknown: (3 landmarks,)."""
        away = (self.landmarks[index] - posed.landmarks) / JOINT_SD_M * np.sqrt(self.weights)[:, None]
        return np.where(np.isfinite(away), away, 0.0).ravel()


def fit_body(
    model: BodyModel,
    observations: Sequence[BodyObservation],
    *,
    scenery: Sequence[BodyObservation] = (),
    weights: Mapping[str, float] | None = None,
    mass_kg: float | None = None,
    levels_px_per_m: Sequence[float] = _LEVELS_PX_PER_M,
    progress: Progress | None = None,
) -> BodyFit:
    """Fit a body with joints to a person seen at a few times.

    `scenery` are more times, looked at for what the scene is like without the person; `weights` are what a landmark's
    squared distance counts, 1 where not named. Left and right are alike. Masses and inertias follow the shape at
    constant density, or add up to `mass_kg`. The images are compared from coarse to fine, reduced to
    `levels_px_per_m` where they are larger. Raises BodyError where the landmarks settle no pose, and where the images
    do not show a part of the body.
    """
    if not observations:
        raise BodyError("no frame to fit the body to; give at least one with known landmarks")
    known = tuple(_landmarks(model, each) for each in observations)
    measured = fit_lengths(model, np.stack(known))
    start = with_segment_lengths(model, measured)
    every = (*observations, *scenery)
    first = tuple(_pose_from_landmarks(start, each, weights) for each in every)
    knobs = shape_parameters(start)
    state = _Iterate(np.zeros(len(knobs)), first[: len(observations)])
    told = progress or (lambda done, expected: None)
    for number, px_per_m in enumerate(levels_px_per_m):
        margin_px = max(_LEAST_MARGIN_PX, round(_MARGIN_M * px_per_m))
        now = apply_shape(start, knobs, state.shape[: len(knobs)])
        images = [reduce_frames(each.frames, now.with_pose(first[0]), px_per_m) for each in every]
        plates = _learn_background(
            now, images, (*state.poses, *first[len(observations) :]), _MASK_GIRTHS[min(number, len(_MASK_GIRTHS) - 1)], margin_px
        )
        seen = images[: len(observations)]
        sights = _posed_views(now, state.poses, seen)
        borders = find_borders(now, sights)
        worn = sample_colours(with_borders(now, borders), sights)
        every_knob = (*knobs, *border_parameters(now, borders))
        state = _Iterate(np.append(state.shape[: len(knobs)], np.zeros(len(every_knob) - len(knobs))), state.poses)
        level = _Level(
            base=with_borders(start, borders).with_colours(np.array([part.colour for part in worn.parts])),
            parameters=every_knob,
            priors=tuple(PosePrior(pose, _prior_sd(start)) for pose in first[: len(observations)]),
            landmarks=known,
            weights=np.array([(weights or {}).get(mark.name, 1.0) for mark in model.landmarks]),
            views=_prepare_views(worn, state.poses, seen, plates, margin_px),
            step_m=1 / px_per_m,
        )
        for step in range(_MOST_STEPS):
            told(number * _MOST_STEPS + step, _MOST_STEPS * len(levels_px_per_m))
            following = _step(level, state)
            if following is None:
                break
            state = following
    told(_MOST_STEPS * len(levels_px_per_m), _MOST_STEPS * len(levels_px_per_m))
    fitted = apply_shape(level.base, level.parameters, state.shape)
    fitted = sample_colours(fitted, _posed_views(fitted, state.poses, seen))
    before = with_borders(start, borders_of(level.parameters, state.shape)), first[: len(observations)]
    before = sample_colours(before[0], _posed_views(*before, seen)), before[1]
    lights = _compare(before, (fitted, state.poses), seen, plates)
    return BodyFit(
        model=fitted if mass_kg is None else with_mass(fitted, mass_kg),
        poses=state.poses,
        start=before[0],
        start_poses=before[1],
        lengths=lengths_of(level.parameters, state.shape, measured),
        girths=girths_of(level.parameters, state.shape),
        borders=borders_of(level.parameters, state.shape),
        rms_light=lights,
        landmark_rms_m=(_landmark_rms_m(*before, known), _landmark_rms_m(fitted, state.poses, known)),
    )


def _step(level: _Level, state: _Iterate) -> _Iterate | None:
    """Take a step of shape and poses; None where none makes the objective smaller by much."""
    here = level.render_model(state.shape)
    size = [level.step_m / knob.size_m for knob in level.parameters]
    nudged = [
        (level.render_model(state.shape + h * unit), level.render_model(state.shape - h * unit), 2 * h)
        for h, unit in zip(size, np.eye(len(size)), strict=True)
    ]
    freedom, k = all_joints(here.model), len(size)
    found, systems = NO_MISFIT, []
    for index, (pose, views) in enumerate(zip(state.poses, level.views, strict=True)):
        posed = here.with_pose(pose)
        steps: list = [((up, up.with_pose(pose)), (down, down.with_pose(pose)), step) for up, down, step in nudged]
        steps += _pose_steps(here, pose, level.step_m)
        H, g = np.zeros((len(steps),) * 2), np.zeros(len(steps))
        for view in views:
            misfit_here, own_H, own_g = normal_equations(here, posed, view, steps)
            found, H, g = found + misfit_here, H + own_H, g + own_g
        ends = [(up[1], posed if down is None else down[1], step) for up, down, step in steps]
        rows = np.array([(level.landmark_residuals(down, index) - level.landmark_residuals(up, index)) / step for up, down, step in ends]).T
        systems.append((H, g, rows.T @ rows, rows.T @ level.landmark_residuals(posed, index)))
    noise = found.noise
    systems = [(H / noise + J, g / noise + j) for H, g, J, j in systems]
    S, s = np.diag(level.shape_precision), -level.shape_precision * state.shape
    for (H, g), pose, prior in zip(systems, state.poses, level.priors, strict=True):
        rows, away = freedom.rest_residuals(pose)
        own = H[k:, k:] + np.diag(1 / prior.sd**2) + rows.T @ rows
        pull = g[k:] - delta_between(prior.expected, pose) / prior.sd**2 - rows.T @ away
        through = np.linalg.solve(own, H[k:, :k]).T
        S, s = S + H[:k, :k] - through @ H[k:, :k], s + g[:k] - through @ pull
    turn = np.linalg.solve(S, s)
    motions = [
        freedom.solve_step(pose, H[k:, k:], g[k:] - H[k:, :k] @ turn, prior)
        for (H, g), pose, prior in zip(systems, state.poses, level.priors, strict=True)
    ]
    reached, share = _objective(level, state, noise), 1.0
    for _ in range(_MOST_BACKTRACKS):
        poses = tuple(freedom.update(pose, share * m) for pose, m in zip(state.poses, motions, strict=True))
        tried = _Iterate(state.shape + share * turn, poses)
        if _objective(level, tried, noise) < reached - _CONVERGED:
            return tried
        share *= _BACKTRACK
    return None


def _pose_steps(here: RenderModel, pose: Pose, step_m: float) -> list:
    """Return the body a step up along each degree of freedom, see `composites.equations`."""
    steps = []
    for i, unit in enumerate(np.eye(6 + 3 * (len(here.model.segments) - 1))):
        h = step_m if i < 3 else step_m / _LEVER_M
        steps.append(((here, here.with_pose(move_pose(pose, h * unit))), None, h))
    return steps


def _objective(level: _Level, state: _Iterate, noise: float) -> float:
    """Return minus the log-likelihood of images and landmarks, and the priors'."""
    here = level.render_model(state.shape)
    freedom, total = all_joints(here.model), 0.5 * float(level.shape_precision @ state.shape**2)
    for index, (pose, views) in enumerate(zip(state.poses, level.views, strict=True)):
        posed = here.with_pose(pose)
        total += 0.5 / noise * sum(misfit(here, posed, view).cost for view in views)
        total += 0.5 * float(np.sum(level.landmark_residuals(posed, index) ** 2)) + freedom.prior_cost(pose, level.priors[index])
    return total


def _prior_sd(model: BodyModel) -> Array:
    return np.repeat(_PRIOR_SD, [3, 3, 3 * (len(model.segments) - 1)])


def _landmarks(model: BodyModel, sighting: BodyObservation) -> Array:
    """Return the landmarks' places in the model's order: (landmarks, 3) [m], NaN where unknown."""
    nowhere = np.full(3, np.nan)
    return np.array([sighting.landmarks.get(mark.name, nowhere) for mark in model.landmarks], float)


def _pose_from_landmarks(model: BodyModel, sighting: BodyObservation, weights: Mapping[str, float] | None) -> Pose:
    known = zip(model.landmarks, _landmarks(model, sighting), strict=True)
    return fit_pose(model, {mark.name: at for mark, at in known if np.isfinite(at).all()}, weights=weights).pose


def _landmark_rms_m(model: BodyModel, poses: Sequence[Pose], landmarks: Sequence[Array]) -> float:
    away = [model.with_pose(pose).landmarks - places for pose, places in zip(poses, landmarks, strict=True)]
    return float(np.sqrt(np.nanmean(np.sum(np.square(away), axis=-1))))


def _learn_background(
    model: BodyModel, images: Sequence[Frames], poses: Sequence[Pose], girth: float, margin_px: float
) -> Appearance:
    """Learn the empty scene from what a fatter body leaves free."""
    synthesis = RenderModel.of(_paint(with_girths(model, {s.name: girth for s in model.segments})))
    appearance = Appearance()
    for frames, pose in zip(images, poses, strict=True):
        posed = synthesis.with_pose(pose)
        for region in crop_regions([posed], synthesis.geometry, frames, margin_px):
            appearance.learn_background(region, synthesis.draw_parts(posed, region) >= 0)
    return appearance


def _paint(model: BodyModel) -> BodyModel:
    """Give parts without a colour any."""
    grey = np.full(3, 128.0)
    return model.with_colours(np.array([grey if part.colour is None else part.colour for part in model.parts]))


def _posed_views(model: BodyModel, poses: Sequence[Pose], images: Sequence[Frames]) -> list[PosedView]:
    """Put a body into every image."""
    synthesis, sights = RenderModel.of(_paint(model)), []
    for pose, frames in zip(poses, images, strict=True):
        posed = synthesis.with_pose(pose)
        regions = crop_regions([posed], synthesis.geometry, frames, _LEAST_MARGIN_PX)
        sights += [(synthesis, posed, region) for region in regions]
    return sights


def _prepare_views(
    model: BodyModel, poses: Sequence[Pose], images: Sequence[Frames], background: Appearance, margin_px: float
) -> tuple[tuple[ViewBuffers, ...], ...]:
    """Lay out the images round a body with colours, each time's by themselves."""
    synthesis, found = RenderModel.of(model), []
    for pose, frames in zip(poses, images, strict=True):
        posed = synthesis.with_pose(pose)
        regions = crop_regions([posed], synthesis.geometry, frames, margin_px)
        found.append(tuple(image_buffers(synthesis, [posed], region, background) for region in regions))
    return tuple(found)


def _compare(
    before: tuple[BodyModel, Sequence[Pose]],
    after: tuple[BodyModel, Sequence[Pose]],
    images: Sequence[Frames],
    background: Appearance,
) -> tuple[float, float]:
    """Return the residuals of two bodies over the same parts of the images."""
    totals = [NO_MISFIT, NO_MISFIT]
    ready = [RenderModel.of(model) for model, _ in (before, after)]
    for i, frames in enumerate(images):
        bodies = [synthesis.with_pose(each[1][i]) for synthesis, each in zip(ready, (before, after), strict=True)]
        for region in crop_regions(bodies, ready[1].geometry, frames, 0.0):
            for j, (synthesis, posed) in enumerate(zip(ready, bodies, strict=True)):
                totals[j] = totals[j] + misfit(synthesis, posed, image_buffers(synthesis, [posed], region, background))
    return totals[0].rms_light, totals[1].rms_light
