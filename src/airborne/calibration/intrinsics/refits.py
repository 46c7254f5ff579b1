"""Many fits of one pinhole to parts of its points, all at once, by Levenberg-Marquardt. Arrays only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.calibration.bundle.lenses import project_with_jacobian
from airborne.calibration.intrinsics.physical import Pinhole, PinholeModel
from airborne.types import Array

_MOST_ITERATIONS = 40  # of a fit, as of `fit_pinhole`; from the fit to all points most end after three
# of equations whose diagonal is 1 (Marquardt 1963); the first chosen on the bundled example: with 1e-3 the fits, which
# begin near their ends, take a tenth more steps to the same deviations
_FIRST_DAMPING, _DAMPING_FACTOR = 1e-7, 10.0
# share of the squared error that a further step would gain; chosen on the same: deviations change by 6e-5 of themselves
_CONVERGED = 1e-8


def refit_pinholes(
    pinhole: Pinhole, model: PinholeModel, world: Array, px: Array, kept: NDArray[np.bool_]
) -> list[Pinhole]:
    """Return the pinhole fitted again to each of f parts of its points.

    pinhole is fitted to all; world (n, 3) [m], px (n, 2) [px]; kept (f, n) the points of each part. All parts take
    their steps together, so that a step costs little more than that of one.
    """
    start, n_fits = pinhole.with_lens(model), len(kept)
    own = [*range(7), *(8, 9) * model.frees_principal_point, *(10 + term for term in model.terms)]
    parameters = np.zeros((n_fits, 18))
    parameters[:, 3:10] = [*start.centre, start.focal_px, start.focal_px, *start.principal_point]
    parameters[:, 10 : 10 + len(start.terms)] = start.terms
    R, damping = np.tile(start.R, (n_fits, 1, 1)), np.full(n_fits, _FIRST_DAMPING)
    is_fisheye, open_fits = start.lens == "fisheye", np.arange(n_fits)
    residual, J = _linearise(R, parameters, own, world, px=px, kept=kept, is_fisheye=is_fisheye)
    for _ in range(_MOST_ITERATIONS):
        step, predicted = _levenberg_step(residual[open_fits], J[open_fits], damping[open_fits])
        cost = np.sum(residual[open_fits] ** 2, axis=1)
        goes_on = predicted > _CONVERGED * cost
        open_fits, step, cost = open_fits[goes_on], step[goes_on], cost[goes_on]
        if not len(open_fits):
            break
        new = parameters[open_fits]
        new[:, own] += step
        new[:, 7] = new[:, 6]  # square pixels
        new_R = Rotation.from_rotvec(step[:, :3]).as_matrix() @ R[open_fits]
        found = _linearise(new_R, new, own, world, px=px, kept=kept[open_fits], is_fisheye=is_fisheye)
        gains = np.sum(found[0] ** 2, axis=1) < cost  # False where a point came behind the camera
        better = open_fits[gains]
        parameters[better], R[better] = new[gains], new_R[gains]
        residual[better], J[better] = (each[gains] for each in found)
        now = damping[open_fits]
        damping[open_fits] = np.where(gains, now / _DAMPING_FACTOR, now * _DAMPING_FACTOR)
    return [
        Pinhole(rotation, each[3:6], float(each[6]), each[8:10], each[10 : 10 + len(start.terms)], start.lens)
        for rotation, each in zip(R, parameters, strict=True)
    ]


def _linearise(
    R: Array, parameters: Array, own: list[int], world: Array, *, px: Array, kept: NDArray[np.bool_], is_fisheye: bool
) -> tuple[Array, Array]:
    """Return the residuals (f, 2 n) and their derivatives (f, 2 n, p), zero for the points left out."""
    n_fits, n = kept.shape
    found, by_camera, _ = project_with_jacobian(
        R.repeat(n, axis=0),
        parameters[:, 3:6].repeat(n, axis=0),
        parameters[:, 6:].repeat(n, axis=0),
        is_fisheye=np.full(n_fits * n, is_fisheye),
        world=np.tile(world, (n_fits, 1)),
    )
    by_camera[:, :, 6] += by_camera[:, :, 7]
    residual = np.where(kept[:, :, None], found.reshape(n_fits, n, 2) - px, 0.0)
    J = np.where(kept[:, :, None, None], by_camera[:, :, own].reshape(n_fits, n, 2, -1), 0.0)
    return residual.reshape(n_fits, 2 * n), J.reshape(n_fits, 2 * n, -1)


def _levenberg_step(residual: Array, J: Array, damping: Array) -> tuple[Array, Array]:
    """Return the steps (f, p) of least squares, damped (f,), and the decrease of the squared error they predict (f,).

    By the QR decomposition: the terms of a lens may nearly cancel.
    """
    n_fits, n_rows, p = J.shape
    scale = np.linalg.norm(J, axis=1)
    scale[scale == 0] = 1.0
    rows = np.zeros((n_fits, n_rows + p, p))
    rows[:, :n_rows] = J / scale[:, None]
    rows[:, n_rows:] = np.sqrt(damping)[:, None, None] * np.eye(p)
    Q, upper = np.linalg.qr(rows)
    step = np.linalg.solve(upper, -np.swapaxes(Q[:, :n_rows], 1, 2) @ residual[..., None])
    after = residual + (rows[:, :n_rows] @ step)[..., 0]
    return step[..., 0] / scale, np.sum(residual**2, axis=1) - np.sum(after**2, axis=1)
