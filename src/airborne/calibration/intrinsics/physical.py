"""Physical cameras with square pixels, fitted to control points. Arrays only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import dual_annealing, least_squares
from scipy.spatial.transform import Rotation

from airborne.cameras.distortion import distort, undistort
from airborne.types import Array

_ANNEALING_BOUNDS = np.array(
    [*[np.radians(10)] * 3, *[0.5] * 3, 0.2]
)  # rotation [rad], shift [m], share of the focal length
_ANNEALING_ROUNDS = 100  # of the global search


@dataclass(frozen=True, slots=True)
class PinholeModel:
    """Which parameters of a physical camera are free beside position (3), orientation (3) and focal length."""

    name: str
    frees_principal_point: bool = False
    frees_k1: bool = False

    @property
    def n_parameters(self) -> int:
        """How many parameters are free."""
        return 7 + 2 * self.frees_principal_point + self.frees_k1


SEVEN_PARAMETERS = PinholeModel("7 parameters")
PINHOLE_MODELS = (
    SEVEN_PARAMETERS,
    PinholeModel("7 + k1", frees_k1=True),
    PinholeModel("7 + principal point", frees_principal_point=True),
    PinholeModel("7 + principal point + k1", frees_principal_point=True, frees_k1=True),
)
_PARAMETERS = ("turn_x_rad", "turn_y_rad", "turn_z_rad", "x_m", "y_m", "z_m", "focal_px", "u0_px", "v0_px", "k1")


@dataclass(frozen=True, slots=True, eq=False)
class Pinhole:
    """A camera with square pixels, no skew and one radial distortion term."""

    R: Array  # (3, 3), camera from world
    centre: Array  # (3,) [m]
    focal_px: float
    principal_point: Array  # (2,) [px]
    k1: float = 0.0

    @property
    def P(self) -> Array:
        """The projection matrix without distortion (3, 4)."""
        f, (u0, v0) = self.focal_px, self.principal_point
        K = np.array([[f, 0, u0], [0, f, v0], [0, 0, 1]])
        return K @ np.column_stack([self.R, -self.R @ self.centre])

    def depth(self, world: Array) -> Array:
        """Return how far in front of the camera points (..., 3) lie: (...) [m]."""
        return (world - self.centre) @ self.R[2]

    def px_from_world(self, world: Array) -> Array:
        """Project points (..., 3) [m]: (..., 2) [px]; points behind the camera come out mirrored."""
        xyz = (world - self.centre) @ self.R.T
        xy = xyz[..., :2] / xyz[..., 2:]
        return self.focal_px * distort(xy, np.array([self.k1])) + self.principal_point

    def undistort_px(self, px: Array) -> Array:
        """Undistort pixels (..., 2) [px]."""
        xy = (px - self.principal_point) / self.focal_px
        return self.focal_px * undistort(xy, np.array([self.k1])) + self.principal_point

    def apply_step(self, model: PinholeModel, step: Array) -> Pinhole:
        """Return the camera with the model's free parameters changed by step (n_parameters,).

        The order is that of `_PARAMETERS`, without those the model fixes; the rotation vector is about the camera's own
        axes.
        """
        return Pinhole(
            Rotation.from_rotvec(step[:3]).as_matrix() @ self.R,
            self.centre + step[3:6],
            self.focal_px + step[6],
            self.principal_point + (step[7:9] if model.frees_principal_point else 0.0),
            self.k1 + (step[-1] if model.frees_k1 else 0.0),
        )


def parameter_names(model: PinholeModel) -> tuple[str, ...]:
    """Return the names, with units, of the model's free parameters, in the order of `Pinhole.apply_step`."""
    return _PARAMETERS[:7] + _PARAMETERS[7:9] * model.frees_principal_point + _PARAMETERS[9:] * model.frees_k1


def fit_pinhole(start: Pinhole, model: PinholeModel, world: Array, px: Array) -> Pinhole:
    """Return the camera near start that projects world (n, 3) [m] closest to px (n, 2) [px], by Levenberg-Marquardt."""
    residual = _residual_of_step(start, model, world, px)
    solution = least_squares(residual, np.zeros(model.n_parameters), method="lm", x_scale="jac", xtol=1e-10, ftol=1e-10)
    return start.apply_step(model, solution.x)


def anneal_pinhole(start: Pinhole, world: Array, px: Array, *, seed: int) -> Pinhole:
    """Return the best seven-parameter camera within +-10 deg, +-0.5 m and +-20 % of start, by simulated annealing.

    The constrained optimisation of paper B (section on the wooden cross); its height angle is `2 atan(h / 2f)`.
    The sum of squares is searched over a box scaled to +-1; the same seed gives the same camera.
    """
    scale = _ANNEALING_BOUNDS * np.array([1, 1, 1, 1, 1, 1, start.focal_px])
    residual = _residual_of_step(start, SEVEN_PARAMETERS, world, px)

    def log_cost(unit_step: Array) -> float:
        return float(np.log(np.mean(residual(unit_step * scale) ** 2) + 1e-12))  # the log flattens the far walls

    solution = dual_annealing(log_cost, [(-1.0, 1.0)] * 7, maxiter=_ANNEALING_ROUNDS, rng=np.random.default_rng(seed))
    return start.apply_step(SEVEN_PARAMETERS, solution.x * scale)


def parameter_covariance(pinhole: Pinhole, model: PinholeModel, world: Array, px: Array) -> Array:
    """Return the covariance (n_parameters, n_parameters) of a fitted camera's free parameters, from the Jacobian.

    `(J^T J)^-1 s^2` with `s^2 = |residual|^2 / (2 n - n_parameters)`.
    """
    residual = _residual_of_step(pinhole, model, world, px)
    widths = {"focal_px": 1e-3, "u0_px": 1e-3, "v0_px": 1e-3}
    columns = []
    for i, name in enumerate(parameter_names(model)):
        step = np.zeros(model.n_parameters)
        step[i] = widths.get(name, 1e-6)
        columns.append((residual(step) - residual(-step)) / (2 * step[i]))
    jacobian = np.column_stack(columns)
    variance = np.sum(residual(np.zeros(model.n_parameters)) ** 2) / (px.size - model.n_parameters)
    scale = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.pinv(jacobian / scale)
    return variance * (inverse @ inverse.T) / np.outer(scale, scale)


def _residual_of_step(start: Pinhole, model: PinholeModel, world: Array, px: Array) -> Callable[[Array], Array]:
    return lambda step: (start.apply_step(model, step).px_from_world(world) - px).ravel()
