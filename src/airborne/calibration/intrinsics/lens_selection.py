"""Model selection for a lens from its views of a board: the simplest model that predicts held-out views as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.bundle import ALL_FIXED, Adjustment, FreeParameters, adjust
from airborne.calibration.diagnosis.control_points import flatness
from airborne.calibration.initial.chaining import Views, board_source, initial_lens
from airborne.calibration.intrinsics.common_lens import common_lens_sd
from airborne.calibration.intrinsics.model_selection import Solution, candidates_for, choose_simplest, place_sd
from airborne.calibration.intrinsics.physical import pinhole_of
from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras.camera import Camera, Lens, Rig
from airborne.types import Array, Progress

LENS_MODELS: dict[Lens, tuple[tuple[str, FreeParameters], ...]] = {
    "brown": (
        ("focal", FreeParameters(extrinsics=False)),
        ("focal + k1", FreeParameters(extrinsics=False, n_terms=1)),
        ("focal + k1 k2", FreeParameters(extrinsics=False, n_terms=2)),
        ("focal + principal point + k1 k2", FreeParameters(extrinsics=False, principal_point=True, n_terms=2)),
        ("focal + principal point + k1 k2 p1 p2 k3", FreeParameters(extrinsics=False, principal_point=True, n_terms=5)),
    ),
    "fisheye": (
        ("focal", FreeParameters(extrinsics=False)),
        ("focal + k1 k2", FreeParameters(extrinsics=False, n_terms=2)),
        ("focal + principal point + k1 k2", FreeParameters(extrinsics=False, principal_point=True, n_terms=2)),
        ("focal + principal point + k1 to k4", FreeParameters(extrinsics=False, principal_point=True, n_terms=4)),
    ),
}
# a lens is an initial value, and fitted once more with all else. Chosen of 1e-5, 1e-3 and 1e-2 nat: about 0.2 sds from
# the end, where held-out errors of a recorded board are the same to 0.3 %, those of a model that overfits apart
_adjust = partial(adjust, least_decrease=1e-2)
_N_FOLDS = 3  # parts of the views, each left out once
_MOST_VIEWS = 30  # views that decide; more take longer and change nothing
# points of a lens, and their thickness over extent. Chosen of 6, 8, 10 and 20 on synthetic scenes of 7 to 17 points:
# without a lens of their own cameras of 17 points stand 242 mm off and 77 % of the errors within 2 sds, with it 28 mm
# and 100 %
_FEWEST_POINTS, _LEAST_FLATNESS = 6, 0.05
_FEWEST_TO_CHOOSE = 9  # views; with fewer only the focal length and k1 are estimated


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LensFit:
    """One camera's lens fitted to its views of a board, the camera at the world's origin; or to control points."""

    camera: Camera
    model: str  # what is free, in words
    free: FreeParameters
    n_views: int  # of a board; or points
    rms_px: float
    held_out_rms_px: dict[
        str, float
    ]  # by model, over what was left out: RMS of a view's corners, mean over views; or of points
    place_sd_m: Array | None = None  # (3,) of control points: with the lens model's error

    @property
    def is_of_points(self) -> bool:
        """Whether it was fitted to control points."""
        return self.place_sd_m is not None


def choose_lens(
    views: Views, size: tuple[int, int], *, lens: Lens = "brown", progress: Callable[[], None] | None = None
) -> LensFit:
    """Fit the lens of the views' only camera, with the fewest parameters that predict held-out views as well.

    As well: the mean over the views of the difference to the best model is within its standard error.
    Raises CalibrationError where too few views show the board.
    """
    row = views.detections[0]
    views = views.select_moments(np.unique(np.linspace(0, len(row) - 1, min(len(row), _MOST_VIEWS)).astype(int)))
    camera, boards = initial_lens(views, size, lens=lens)
    n = views.n_moments
    fold = np.arange(n) % _N_FOLDS
    scores, fits = {}, {}
    models = LENS_MODELS[lens] if n >= _FEWEST_TO_CHOOSE else LENS_MODELS[lens][1:2]
    for name, free in models:
        fit = _adjust(Rig((camera,)), [board_source(views, boards)], free)
        camera, boards = fit.rig.cameras[0], fit.sources[0].world_from_target or boards
        fits[name] = fit
        if n >= _FEWEST_TO_CHOOSE:
            scores[name] = _cross_validate(fit, fold)
        if progress is not None:
            progress()
    chosen = _choose_simplest(scores) if scores else models[0][0]
    fit = fits[chosen]
    return LensFit(
        camera=fit.rig.cameras[0],
        model=chosen,
        free=replace(dict(models)[chosen], extrinsics=True),
        n_views=len(row),
        rms_px=fit.rms_px(),
        held_out_rms_px={name: float(np.mean(score)) for name, score in scores.items()},
    )


def lenses_from_points(rig: Rig, points: ControlPoints, progress: Progress) -> dict[str, LensFit]:
    """Fit the lenses of cameras that see enough points, not in one plane, from initial values; others are left out."""
    candidates: dict[str, list[Solution]] = {}
    for done, camera in enumerate(rig):
        is_seen = points.is_seen_by(camera.name)
        if is_seen.sum() >= _FEWEST_POINTS and flatness(points.world[is_seen]) >= _LEAST_FLATNESS:
            px = points.px[is_seen, points.cameras.index(camera.name)]
            candidates[camera.name] = candidates_for(pinhole_of(camera), points.world[is_seen], px)
        progress(done + 1, len(rig))
    common_sd_m = common_lens_sd(candidates, {camera.name: camera.size for camera in rig})
    return {name: _lens_from_points(rig[name], each, common_sd_m.get(name)) for name, each in candidates.items()}


def _lens_from_points(camera: Camera, candidates: list[Solution], common_lens_sd_m: Array | None) -> LensFit:
    chosen = choose_simplest(candidates)
    model = chosen.model
    return LensFit(
        camera=chosen.pinhole.camera(camera.name, camera.size),
        model=model.name,
        free=FreeParameters(principal_point=model.frees_principal_point, n_terms=len(model.terms)),
        n_views=len(chosen.world),
        rms_px=float(np.sqrt(np.mean(np.sum(chosen.residual_px**2, axis=1)))),
        held_out_rms_px={s.model.name: float(np.sqrt(np.mean(np.sum(s.held_out_px**2, axis=1)))) for s in candidates},
        place_sd_m=place_sd(chosen, candidates, common_lens_sd_m),
    )


def _cross_validate(fit: Adjustment, fold: NDArray[np.integer]) -> Array:
    """Return each view's RMS [px] with a lens fitted to the other folds; the board's pose is fitted to the view."""
    (source,) = fit.with_estimated_noise()
    score = np.zeros(len(fold))
    for k in range(_N_FOLDS):
        is_held_out = fold[source.moments] == k
        fitted = _adjust(fit.rig, [source.select(~is_held_out)], fit.free)
        held_out = source.select(is_held_out)
        squares = np.sum(_adjust(fitted.rig, [held_out], ALL_FIXED).residual_px[0] ** 2, axis=1)
        for m in np.flatnonzero(fold == k):
            known = squares[held_out.moments == m]
            score[m] = np.sqrt(np.mean(known[np.isfinite(known)])) if np.isfinite(known).any() else np.nan
    return score


def _choose_simplest(scores: dict[str, Array]) -> str:
    """Return the first model that is not clearly worse than the best."""
    best = min(scores.values(), key=np.median)
    for name, score in scores.items():
        excess = score - best
        if np.mean(excess) <= np.std(excess, ddof=1) / np.sqrt(len(excess)):
            return name
    raise AssertionError("the best model is never worse than itself")
