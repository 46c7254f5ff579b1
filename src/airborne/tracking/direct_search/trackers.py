"""Trackers that only evaluate a score: `stepping` (paper B's own search) and `simplex` (paper B's suggestion).

A pose is a vector of six numbers: x, y, z [m], somersault, tilt, twist [rad]; joints stay as they are at the start.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.appearance.model import Appearance
from airborne.body import BodyModel, Pose, PosedBody, surface_arrays
from airborne.cameras import Camera
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.rendering import (
    FLAT,
    RULES,
    Lights,
    ScoreRule,
    Targets,
    colour_sums,
    count_missed_pixels,
    pack_targets,
    render,
    score,
    scores_from_sums,
)
from airborne.rendering.packing import shift_view
from airborne.rendering.shapes import new_shapes
from airborne.rendering.sums import PIXELS
from airborne.tracking.covariance import SHIFT_SD_PX, covariance_of
from airborne.tracking.direct_search.stepping import Objective, VRule, minimise_by_stepping
from airborne.tracking.estimate import Doubt, Estimate, Status, lost_estimate
from airborne.tracking.image_regions import crop_regions
from airborne.types import Array
from airborne.video import Frames


class Search(NamedTuple):
    """A minimiser, and how far from the minimum it may stop."""

    run: Callable[[Objective, Array], Array]  # objective, start (6,) -> best (6,)
    resolution: Array  # (6,) standard deviations [m, rad]


_UNCERTAIN_RATIO, _LOST_RATIO = 1.6, 2.5  # of a frame's score to the median of those tracked
_HISTORY, _SCORE_HISTORY = 2, 25  # poses that predict; scores of the running median
_PROBE = np.array([0.004] * 3 + [0.012] * 3)  # [m], [rad]: steps of the finite differences
_SHARED_NOISE_PX = 8  # this many pixels share one pixel's independent noise: compression, interpolated rows
_MARGIN_PX = 40  # around the predicted body, of a full frame
_V_RULE_SD = 0.2  # of the last step: the RMS error of the V rule as printed


def stepping_search(loops: Sequence[Array], v_rule: VRule, order: Sequence[int] | None = None) -> Search:
    """Search by paper B's stepping; loops: steps (6,) [m, rad] for each loop; order: of the variables in a loop."""
    return Search(
        lambda objective, start: minimise_by_stepping(objective, start, loops, v_rule=v_rule, order=order)[0],
        _V_RULE_SD * np.asarray(loops[-1]),
    )


def simplex_search(size: Array) -> Search:
    """Search by Nelder and Mead's simplex of first edges `size` (6,) [m, rad], then once more from a smaller one."""

    def run(objective: Objective, start: Array) -> Array:
        best = start
        for share in (1.0, 0.2):
            corners = np.vstack([best, best + share * np.diag(size)])
            options = {"initial_simplex": corners, "xatol": 1e-4, "fatol": 1e-4, "maxfev": 600}
            best = minimize(lambda x: float(objective(x[None])[0]), best, method="Nelder-Mead", options=options).x
        return best

    return Search(run, np.zeros(6))


@dataclass(frozen=True, slots=True)
class DirectState:
    """What the next frame needs."""

    past: tuple[tuple[Fraction, Pose], ...] = ()
    scores: tuple[float, ...] = ()  # of the last frames tracked
    appearance: Appearance = field(default_factory=Appearance)


class DirectTracker:
    """Track by minimising a colour difference inside the mask, from a prediction, with any search.

    With `notices_loss` False, as in paper B, a frame counts as tracked whatever its score, and the next starts from it.
    """

    def __init__(
        self,
        model: BodyModel,
        start: Pose,
        search: Search,
        *,
        rule: ScoreRule,
        lights: Lights,
        scale: int,
        predict: Callable,
        notices_loss: bool = True,
    ) -> None:
        self._model, self._geometry = model, surface_arrays(model)
        self._shapes = new_shapes(self._geometry)
        self._start, self._search, self._rule, self._lights = start, search, rule, lights
        self._scale, self._predict, self._notices_loss = scale, predict, notices_loss
        self._at_origin = model.with_pose(replace(start, world_from_root=RigidTransform.identity()))

    def init(self) -> DirectState:
        """Return the state before the first frame."""
        return DirectState()

    def search(self, state: DirectState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        start = self._predict(state.past, frames.time_s) if state.past else self._start
        observed, cameras = self._targets(state, start, frames)
        objective, first = self._objective(observed), _vector(start)
        if not len(observed.views) or not np.isfinite(objective(first[None])[0]):
            return lost_estimate(frames.index, frames.time_s)
        best = self._search.run(objective, first)
        value = float(objective(best[None])[0])
        sums = colour_sums(self._geometry, observed, *self._pose_segments(best[None]), rule=RULES["raw"])
        pixels = sums[0, :, PIXELS]
        status = _status(value, state.scores if self._notices_loss else ())
        if status is Status.LOST:
            return lost_estimate(frames.index, frames.time_s)
        pose = _pose(best, self._start)
        return Estimate(
            index=frames.index,
            time_s=frames.time_s,
            status=status,
            doubts=(Doubt.IMAGES,) if status is Status.UNCERTAIN else (),
            score=value,
            pose=pose,
            covariance=self._covariance(observed, cameras, pose, value=value, pixels=float(pixels.sum())),
            n_views=int(np.count_nonzero(pixels)),
        )

    def learn(self, state: DirectState, frames: Frames, estimate: Estimate) -> DirectState:
        """Return the state after the frames, given their estimate."""
        if estimate.pose is None:
            return state
        appearance = state.appearance
        if self._rule.counts_missed and estimate.status is Status.TRACKED:
            appearance = self._learn_colours(appearance, estimate.pose, frames)
        past = (*state.past, (frames.time_s, estimate.pose))[-_HISTORY:]
        scores = state.scores
        if estimate.status is Status.TRACKED:
            scores = (*scores, estimate.score)[-_SCORE_HISTORY:]
        return DirectState(past, scores, appearance)

    def _objective(self, observed: Targets) -> Objective:
        args, options = (self._geometry, observed), {"rule": self._rule, "shapes": self._shapes}
        return lambda vectors: score(*args, *self._pose_segments(vectors), **options)

    def _pose_segments(self, vectors: Array) -> tuple[Array, Array]:
        """Pose the segments by vectors (n, 6): R (n, s, 3, 3), t (n, s, 3)."""
        rotations = matrix_from_angles(vectors[:, 3:])[:, None]
        return rotations @ self._at_origin.R, (rotations @ self._at_origin.t[..., None])[..., 0] + vectors[:, None, :3]

    def _targets(self, state: DirectState, start: Pose, frames: Frames) -> tuple[Targets, list[Camera]]:
        """Pack the views to compare with; "union" uses those whose colours have been learned."""
        if not self._rule.counts_missed:
            views = [view for view in frames.views if view is not None]
            return pack_targets(views, self._lights, scale=self._scale), [view.camera for view in views]
        appearance = state.appearance
        if not state.past:
            appearance = self._learn_colours(Appearance(), start, frames)
        regions = crop_regions([self._model.with_pose(start)], self._geometry, frames, _MARGIN_PX)
        region_of = {region.camera.name: region for region in regions if appearance.has_colours(region)}
        views = [view for view in frames.views if view is not None and view.camera.name in region_of]
        maps = []
        for view in views:
            region, whole = region_of[view.camera.name], np.full(view.rgb.shape[:2], -1, np.float32)
            region.crop(whole)[:] = appearance.posterior(region) - 0.5
            maps.append(whole)
        packed = pack_targets(views, self._lights, scale=self._scale, evidence=maps or None)
        return packed, [view.camera for view in views]

    def _learn_colours(self, appearance: Appearance, pose: Pose, frames: Frames) -> Appearance:
        posed = self._model.with_pose(pose)
        for region in crop_regions([posed], self._geometry, frames, _MARGIN_PX):
            mask = render(self._geometry, posed, region.camera, FLAT).mask
            appearance = appearance.learn_colours(region, mask)
        return appearance

    def _covariance(
        self, observed: Targets, cameras: Sequence[Camera], pose: Pose, *, value: float, pixels: float
    ) -> Array:
        """Return the covariance of position and world rotation from the curvature of the squared score.

        n |r|^2 / (2 s^2) is the log-likelihood of n independent pixels; s^2 is the score's own square.
        """
        posed = self._model.with_pose(pose)
        rows, columns = np.triu_indices(6)
        i, j = np.eye(6)[rows] * _PROBE, np.eye(6)[columns] * _PROBE
        steps, back = np.unique(np.concatenate([i + j, i - j, j - i, -i - j]), axis=0, return_inverse=True)
        args = self._geometry, observed, *_move_body(posed, steps)
        squared = score(*args, rule=self._rule)[back.ravel()].reshape(4, -1) ** 2
        gradient, *shifted = self._gradients(observed, cameras, posed)
        if not (np.isfinite(squared).all() and np.isfinite(gradient).all()):  # at the images' edge
            return self._embed(np.diag(np.full(6, np.inf)))
        curvature = np.zeros((6, 6))
        second = (squared[0] - squared[1] - squared[2] + squared[3]) / (4 * _PROBE[rows] * _PROBE[columns])
        curvature[rows, columns] = curvature[columns, rows] = second
        changes = np.nan_to_num(shifted - gradient)
        score_covariance = changes.T @ changes
        likelihood = pixels / (2 * max(value, 1e-3) ** 2)
        shared = max(_SHARED_NOISE_PX / self._scale**2, 1)
        covariance = covariance_of(
            curvature * likelihood, noise=shared, score_covariance=score_covariance * likelihood**2
        )
        return self._embed(covariance + np.diag(self._search.resolution**2))

    def _embed(self, covariance: Array) -> Array:
        """Embed the covariance of the root (6, 6) in that of all degrees of freedom; the joints do not move."""
        return np.pad(covariance, (0, self._model.n_dofs - 6))

    def _gradients(self, observed: Targets, cameras: Sequence[Camera], posed: PosedBody) -> Array:
        """Differentiate the squared score: of the images, then of each shifted by its sd, right and down: (n, 6)."""
        n = len(cameras)
        shifts_px = [np.hypot(SHIFT_SD_PX, camera.shift_sd_px) / self._scale for camera in cameras]
        shifted = [
            shift_view(view, *shift)
            for view, px in zip(observed.views, shifts_px, strict=True)
            for shift in ((px, 0), (0, px))
        ]
        own = np.concatenate([np.arange(n), np.repeat(np.arange(n), 2)])
        views, sizes, lights = np.vstack([observed.views, shifted]), observed.sizes[own], observed.lights[own]
        R, t = _move_body(posed, np.concatenate([np.diag(_PROBE), -np.diag(_PROBE)]))
        images = replace(observed, views=views, sizes=sizes, lights=lights)
        sums = colour_sums(self._geometry, images, R, t, rule=self._rule)
        missed = count_missed_pixels(self._geometry, observed, R, t, rule=self._rule)
        gradients = []
        for k in range(1 + 2 * n):
            chosen = np.arange(n)
            if k:
                chosen[(k - 1) // 2] = n + k - 1
            squared = scores_from_sums(sums[:, chosen], self._rule, missed).reshape(2, 6) ** 2
            gradients.append((squared[0] - squared[1]) / (2 * _PROBE))
        return np.array(gradients)


def _move_body(posed: PosedBody, deltas: Array) -> tuple[Array, Array]:
    """Move a body by deltas (n, 6), as `PosedBody.move` does: R (n, s, 3, 3), t (n, s, 3)."""
    R = Rotation.from_rotvec(deltas[:, 3:]).as_matrix()
    t = (posed.t - posed.t[0]) @ np.swapaxes(R, 1, 2) + posed.t[0] + deltas[:, None, :3]
    return R[:, None] @ posed.R, t


def _status(value: float, scores: Sequence[float]) -> Status:
    if not np.isfinite(value):
        return Status.LOST
    ratio = value / np.median(scores) if scores else 1.0
    return Status.LOST if ratio > _LOST_RATIO else Status.UNCERTAIN if ratio > _UNCERTAIN_RATIO else Status.TRACKED


def _vector(pose: Pose) -> Array:
    root = pose.world_from_root
    return np.concatenate([root.translation, angles_from_matrix(root.rotation.as_matrix())])


def _pose(vector: Array, start: Pose) -> Pose:
    rotation = Rotation.from_matrix(matrix_from_angles(vector[3:]))
    return replace(start, world_from_root=RigidTransform.from_components(vector[:3], rotation))
