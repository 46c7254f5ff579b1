"""Fit a body to a person: lengths, girths, borders of the clothes and colours, with the poses, from a few frames.

The joints' places, which are known to a few centimetres, give lengths and first poses; the pictures the rest. Shape and
poses move together by Gauss-Newton on the composite of body and empty scene (`composites`), coarse pictures first. The
poses are eliminated frame by frame, so that the cost grows with the number of frames and not with its cube.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance
from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import motion_between, moved_pose
from airborne.body.inverse_kinematics import fit_lengths, fit_pose
from airborne.body.outfits import Border, with_borders
from airborne.body.shaping import with_girths, with_mass, with_segment_lengths
from airborne.body_fitting.clothes import Sight, borders_seen, coloured
from airborne.body_fitting.composites import NOTHING, equations, misfit
from airborne.body_fitting.shape import Knob, border_knobs, borders_of, girths_of, knobs_of, lengths_of, shaped
from airborne.errors import BodyError
from airborne.tracking.image_regions import reduced, regions_round
from airborne.tracking.model_based.degrees_of_freedom import Prior, all_joints
from airborne.tracking.model_based.render_model import Laid, Synthesis, pictured
from airborne.video import Frames

Array = NDArray[np.floating]
Progress = Callable[[int, int], None]  # steps done, steps expected

LEVELS_PX_PER_M = (60.0, 100.0, 150.0)  # of the pictures that are compared, coarse to fine
JOINT_SD_M = 0.025  # of a landmark of weight 1
_EXPECTED_SD = (0.1, 0.2, 0.25)  # of a pose about the landmarks' own: [m], [rad], [rad]
_MOST_STEPS = 4  # a level
_SETTLED = 1.0  # a step that makes no more likely than this is none [nats]
_SHORTER, _MOST_SHORTER = 0.4, 3
_MARGIN_M, _LEAST_MARGIN_PX = 0.1, 8  # round the body, that it may move in
_LEVER_M = 0.3  # a turn by which this far out a point moves a pixel is a step
_FATTER = (1.5, 1.25, 1.15)  # the body by which the empty scene is learned, level by level


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """What the cameras saw at one time, and where the body's landmarks were."""

    frames: Frames
    landmarks: Mapping[str, Array]  # landmark -> (3,) world [m]; NaN where unknown


@dataclass(frozen=True, slots=True, eq=False)
class BodyFit:
    """A body fitted to a person."""

    model: BodyModel
    poses: tuple[Pose, ...]  # one a sighting
    start: BodyModel  # dressed alike, before the pictures changed its shape: lengths from the landmarks alone
    start_poses: tuple[Pose, ...]  # from the landmarks alone
    lengths: dict[str, float]  # segment without its side -> factor on the given body
    girths: dict[str, tuple[float, float]]  # across, on the given body
    borders: dict[str, Border]
    rms_light: tuple[float, float]  # before and after: robust, blurred, of the pictures round the body; 0..1
    landmark_rms_m: tuple[float, float]  # before and after


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    shape: Array  # (k,) see `shape`
    poses: tuple[Pose, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """What is held still while shape and poses move: the pictures at one reduction, clothes, what is expected."""

    base: BodyModel  # dressed
    knobs: tuple[Knob, ...]
    priors: tuple[Prior, ...]  # a sighting's pose
    known: tuple[Array, ...]  # (landmarks, 3) a sighting
    weights: Array  # (landmarks,) what they count
    views: tuple[tuple[Laid, ...], ...]  # a sighting's
    step_m: float  # about a pixel

    @property
    def shape_precision(self) -> Array:
        """Inverse variances (k,) of the shape about 0."""
        return np.array([knob.sd for knob in self.knobs]) ** -2

    def synthesis(self, shape: Array) -> Synthesis:
        """Make the body of a shape ready."""
        return Synthesis.of(shaped(self.base, self.knobs, shape))

    def away(self, posed: PosedBody, index: int) -> Array:
        """Return how far a body's landmarks are from where they were seen, in sds; 0 where unknown: (3 landmarks,)."""
        away = (self.known[index] - posed.landmarks) / JOINT_SD_M * np.sqrt(self.weights)[:, None]
        return np.where(np.isfinite(away), away, 0.0).ravel()


def fit_body(
    model: BodyModel,
    sightings: Sequence[Sighting],
    *,
    scenery: Sequence[Sighting] = (),
    weights: Mapping[str, float] | None = None,
    mass_kg: float | None = None,
    levels_px_per_m: Sequence[float] = LEVELS_PX_PER_M,
    progress: Progress | None = None,
) -> BodyFit:
    """Fit a body with joints to a person seen at a few times.

    `scenery` are more times, looked at for what the scene is like without the person; `weights` are what a landmark's
    squared distance counts, 1 where not named. Left and right are alike. Masses and inertias follow the shape at
    constant density, or add up to `mass_kg`. The pictures are compared from coarse to fine, reduced to
    `levels_px_per_m` where they are larger. Raises BodyError where the landmarks settle no pose, and where the pictures
    do not show a part of the body.
    """
    if not sightings:
        raise BodyError("no frame to fit the body to; give at least one with known landmarks")
    known = tuple(_known(model, each) for each in sightings)
    measured = fit_lengths(model, np.stack(known))
    start = with_segment_lengths(model, measured)
    every = (*sightings, *scenery)
    first = tuple(_pose(start, each, weights) for each in every)
    knobs = knobs_of(start)
    state = _State(np.zeros(len(knobs)), first[: len(sightings)])
    told = progress or (lambda done, expected: None)
    for number, px_per_m in enumerate(levels_px_per_m):
        margin_px = max(_LEAST_MARGIN_PX, round(_MARGIN_M * px_per_m))
        now = shaped(start, knobs, state.shape[: len(knobs)])
        pictures = [reduced(each.frames, now.with_pose(first[0]), px_per_m) for each in every]
        plates = _plates(
            now, pictures, (*state.poses, *first[len(sightings) :]), _FATTER[min(number, len(_FATTER) - 1)], margin_px
        )
        seen = pictures[: len(sightings)]
        sights = _sights(now, state.poses, seen)
        borders = borders_seen(now, sights)
        worn = coloured(with_borders(now, borders), sights)
        every_knob = (*knobs, *border_knobs(now, borders))
        state = _State(np.append(state.shape[: len(knobs)], np.zeros(len(every_knob) - len(knobs))), state.poses)
        level = _Level(
            base=with_borders(start, borders).with_colours(np.array([part.colour for part in worn.parts])),
            knobs=every_knob,
            priors=tuple(Prior(pose, _expected_sd(start)) for pose in first[: len(sightings)]),
            known=known,
            weights=np.array([(weights or {}).get(mark.name, 1.0) for mark in model.landmarks]),
            views=_laid(worn, state.poses, seen, plates, margin_px),
            step_m=1 / px_per_m,
        )
        for step in range(_MOST_STEPS):
            told(number * _MOST_STEPS + step, _MOST_STEPS * len(levels_px_per_m))
            following = _stepped(level, state)
            if following is None:
                break
            state = following
    told(_MOST_STEPS * len(levels_px_per_m), _MOST_STEPS * len(levels_px_per_m))
    fitted = shaped(level.base, level.knobs, state.shape)
    fitted = coloured(fitted, _sights(fitted, state.poses, seen))
    before = with_borders(start, borders_of(level.knobs, state.shape)), first[: len(sightings)]
    before = coloured(before[0], _sights(*before, seen)), before[1]
    lights = _compared(before, (fitted, state.poses), seen, plates)
    return BodyFit(
        model=fitted if mass_kg is None else with_mass(fitted, mass_kg),
        poses=state.poses,
        start=before[0],
        start_poses=before[1],
        lengths=lengths_of(level.knobs, state.shape, measured),
        girths=girths_of(level.knobs, state.shape),
        borders=borders_of(level.knobs, state.shape),
        rms_light=lights,
        landmark_rms_m=(_landmark_rms_m(*before, known), _landmark_rms_m(fitted, state.poses, known)),
    )


def _stepped(level: _Level, state: _State) -> _State | None:
    """Take a step of shape and poses; None where none makes the objective smaller by much."""
    here = level.synthesis(state.shape)
    size = [level.step_m / knob.size_m for knob in level.knobs]
    nudged = [
        (level.synthesis(state.shape + h * unit), level.synthesis(state.shape - h * unit), 2 * h)
        for h, unit in zip(size, np.eye(len(size)), strict=True)
    ]
    freedom, k = all_joints(here.model), len(size)
    found, systems = NOTHING, []
    for index, (pose, views) in enumerate(zip(state.poses, level.views, strict=True)):
        posed = here.place(pose)
        steps: list = [((up, up.place(pose)), (down, down.place(pose)), step) for up, down, step in nudged]
        steps += _moved(here, pose, level.step_m)
        H, g = np.zeros((len(steps),) * 2), np.zeros(len(steps))
        for view in views:
            misfit_here, own_H, own_g = equations(here, posed, view, steps)
            found, H, g = found + misfit_here, H + own_H, g + own_g
        ends = [(up[1], posed if down is None else down[1], step) for up, down, step in steps]
        rows = np.array([(level.away(down, index) - level.away(up, index)) / step for up, down, step in ends]).T
        systems.append((H, g, rows.T @ rows, rows.T @ level.away(posed, index)))
    noise = found.noise
    systems = [(H / noise + J, g / noise + j) for H, g, J, j in systems]
    S, s = np.diag(level.shape_precision), -level.shape_precision * state.shape
    for (H, g), pose, prior in zip(systems, state.poses, level.priors, strict=True):
        rows, away = freedom.from_rest(pose)
        own = H[k:, k:] + np.diag(1 / prior.sd**2) + rows.T @ rows
        pull = g[k:] - motion_between(prior.expected, pose) / prior.sd**2 - rows.T @ away
        through = np.linalg.solve(own, H[k:, :k]).T
        S, s = S + H[:k, :k] - through @ H[k:, :k], s + g[:k] - through @ pull
    turn = np.linalg.solve(S, s)
    motions = [
        freedom.step(pose, H[k:, k:], g[k:] - H[k:, :k] @ turn, prior)
        for (H, g), pose, prior in zip(systems, state.poses, level.priors, strict=True)
    ]
    reached, share = _objective(level, state, noise), 1.0
    for _ in range(_MOST_SHORTER):
        poses = tuple(freedom.moved(pose, share * m) for pose, m in zip(state.poses, motions, strict=True))
        tried = _State(state.shape + share * turn, poses)
        if _objective(level, tried, noise) < reached - _SETTLED:
            return tried
        share *= _SHORTER
    return None


def _moved(here: Synthesis, pose: Pose, step_m: float) -> list:
    """Return the body a step up along each degree of freedom, see `composites.equations`."""
    steps = []
    for i, unit in enumerate(np.eye(6 + 3 * (len(here.model.segments) - 1))):
        h = step_m if i < 3 else step_m / _LEVER_M
        steps.append(((here, here.place(moved_pose(pose, h * unit))), None, h))
    return steps


def _objective(level: _Level, state: _State, noise: float) -> float:
    """Return minus the log-likelihood of pictures and landmarks, and the priors'."""
    here = level.synthesis(state.shape)
    freedom, total = all_joints(here.model), 0.5 * float(level.shape_precision @ state.shape**2)
    for index, (pose, views) in enumerate(zip(state.poses, level.views, strict=True)):
        posed = here.place(pose)
        total += 0.5 / noise * sum(misfit(here, posed, view).cost for view in views)
        total += 0.5 * float(np.sum(level.away(posed, index) ** 2)) + freedom.prior_cost(pose, level.priors[index])
    return total


def _expected_sd(model: BodyModel) -> Array:
    return np.repeat(_EXPECTED_SD, [3, 3, 3 * (len(model.segments) - 1)])


def _known(model: BodyModel, sighting: Sighting) -> Array:
    """Return the landmarks' places in the model's order: (landmarks, 3) [m], NaN where unknown."""
    nowhere = np.full(3, np.nan)
    return np.array([sighting.landmarks.get(mark.name, nowhere) for mark in model.landmarks], float)


def _pose(model: BodyModel, sighting: Sighting, weights: Mapping[str, float] | None) -> Pose:
    known = zip(model.landmarks, _known(model, sighting), strict=True)
    return fit_pose(model, {mark.name: at for mark, at in known if np.isfinite(at).all()}, weights=weights).pose


def _landmark_rms_m(model: BodyModel, poses: Sequence[Pose], known: Sequence[Array]) -> float:
    away = [model.with_pose(pose).landmarks - places for pose, places in zip(poses, known, strict=True)]
    return float(np.sqrt(np.nanmean(np.sum(np.square(away), axis=-1))))


def _plates(
    model: BodyModel, pictures: Sequence[Frames], poses: Sequence[Pose], fatter: float, margin_px: float
) -> Appearance:
    """Learn the empty scene from what a fatter body leaves free."""
    synthesis = Synthesis.of(_painted(with_girths(model, {s.name: fatter for s in model.segments})))
    appearance = Appearance()
    for frames, pose in zip(pictures, poses, strict=True):
        posed = synthesis.place(pose)
        for region in regions_round([posed], synthesis.geometry, frames, margin_px):
            appearance.learn_scene(region, synthesis.parts(posed, region) >= 0)
    return appearance


def _painted(model: BodyModel) -> BodyModel:
    """Give parts without a colour any."""
    grey = np.full(3, 128.0)
    return model.with_colours(np.array([grey if part.colour is None else part.colour for part in model.parts]))


def _sights(model: BodyModel, poses: Sequence[Pose], pictures: Sequence[Frames]) -> list[Sight]:
    """Put a body into every picture."""
    synthesis, sights = Synthesis.of(_painted(model)), []
    for pose, frames in zip(poses, pictures, strict=True):
        posed = synthesis.place(pose)
        regions = regions_round([posed], synthesis.geometry, frames, _LEAST_MARGIN_PX)
        sights += [(synthesis, posed, region) for region in regions]
    return sights


def _laid(
    model: BodyModel, poses: Sequence[Pose], pictures: Sequence[Frames], plates: Appearance, margin_px: float
) -> tuple[tuple[Laid, ...], ...]:
    """Lay out the pictures round a body with colours, each time's by themselves."""
    synthesis, found = Synthesis.of(model), []
    for pose, frames in zip(poses, pictures, strict=True):
        posed = synthesis.place(pose)
        regions = regions_round([posed], synthesis.geometry, frames, margin_px)
        found.append(tuple(pictured(synthesis, [posed], region, plates) for region in regions))
    return tuple(found)


def _compared(
    before: tuple[BodyModel, Sequence[Pose]],
    after: tuple[BodyModel, Sequence[Pose]],
    pictures: Sequence[Frames],
    plates: Appearance,
) -> tuple[float, float]:
    """Return the residuals of two bodies over the same parts of the pictures."""
    totals = [NOTHING, NOTHING]
    ready = [Synthesis.of(model) for model, _ in (before, after)]
    for i, frames in enumerate(pictures):
        bodies = [synthesis.place(each[1][i]) for synthesis, each in zip(ready, (before, after), strict=True)]
        for region in regions_round(bodies, ready[1].geometry, frames, 0.0):
            for j, (synthesis, posed) in enumerate(zip(ready, bodies, strict=True)):
                totals[j] = totals[j] + misfit(synthesis, posed, pictured(synthesis, [posed], region, plates))
    return totals[0].rms_light, totals[1].rms_light
