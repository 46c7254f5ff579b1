"""Physical cameras with square pixels, fitted to control points. Arrays only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import dual_annealing, least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle.lenses import left_jacobian, project_with_jacobian
from airborne.cameras.camera import Camera, Lens
from airborne.cameras.distortion import distort, distort_fisheye, undistort, undistort_fisheye
from airborne.types import Array

# rotation [rad], shift [m], share of the focal length
_ANNEALING_BOUNDS = np.array([*[np.radians(10)] * 3, *[0.5] * 3, 0.2])
_ANNEALING_ROUNDS = 100  # of the global search


@dataclass(frozen=True, slots=True)
class PinholeModel:
    """Which parameters of a physical camera are free beside position (3), orientation (3) and focal length."""

    name: str
    frees_principal_point: bool = False
    terms: tuple[int, ...] = ()  # of the lens, by index: of `brown` k1 k2 p1 p2 k3 k4 k5 k6, of `fisheye` k1 to k4
    lens: Lens = "brown"

    @property
    def n_parameters(self) -> int:
        """How many parameters are free."""
        return 7 + 2 * self.frees_principal_point + len(self.terms)


SEVEN_PARAMETERS = PinholeModel("7 parameters")
PINHOLE_MODELS = (
    SEVEN_PARAMETERS,
    PinholeModel("7 + k1", terms=(0,)),
    PinholeModel("7 + principal point", frees_principal_point=True),
    PinholeModel("7 + principal point + k1", frees_principal_point=True, terms=(0,)),
)
FISHEYE_MODELS = (  # Kannala and Brandt 2006
    PinholeModel("7 + Kannala-Brandt k1 k2", terms=(0, 1), lens="fisheye"),
    PinholeModel("7 + principal point + Kannala-Brandt k1 k2", True, (0, 1), "fisheye"),
    PinholeModel("7 + principal point + Kannala-Brandt k1 to k4", True, (0, 1, 2, 3), "fisheye"),
)
WIDE_MODELS = (
    FISHEYE_MODELS[0],
    PinholeModel("7 + principal point + k1 k2", True, (0, 1)),
    *FISHEYE_MODELS[1:],
    PinholeModel("7 + principal point + k1 k2 p1 p2 k3", True, (0, 1, 2, 3, 4)),
    PinholeModel("7 + principal point + rational k1 to k6 p1 p2", True, (0, 1, 2, 3, 4, 5, 6, 7)),
)
_MOST_ITERATIONS = 40  # of a fit; the rational model's terms nearly cancel, and would wander for thousands
_PARAMETERS = ("turn_x_rad", "turn_y_rad", "turn_z_rad", "x_m", "y_m", "z_m", "focal_px", "u0_px", "v0_px")
_FEWEST_TERMS = {"brown": 5, "fisheye": 4}  # that a camera keeps
_TERM_NAMES = {"brown": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), "fisheye": ("k1", "k2", "k3", "k4")}


@dataclass(frozen=True, slots=True, eq=False)
class Pinhole:
    """A camera with square pixels, no skew and a distorting lens."""

    R: Array  # (3, 3), camera from world
    centre: Array  # (3,) [m]
    focal_px: float
    principal_point: Array  # (2,) [px]
    terms: Array = field(default_factory=lambda: np.zeros(5))  # of the lens, indexed by `PinholeModel.terms`
    lens: Lens = "brown"

    @property
    def P(self) -> Array:
        """The projection matrix without distortion (3, 4)."""
        f, (u0, v0) = self.focal_px, self.principal_point
        K = np.array([[f, 0, u0], [0, f, v0], [0, 0, 1]])
        return K @ np.column_stack([self.R, -self.R @ self.centre])

    def camera(self, name: str, size: tuple[int, int], shift_sd_px: float = 0.0) -> Camera:
        """Return the camera of a name and size (width, height) [px]."""
        f, (u0, v0) = self.focal_px, self.principal_point
        return Camera(
            name=name,
            K=np.array([[f, 0, u0], [0, f, v0], [0, 0, 1]]),
            size=size,
            camera_from_world=RigidTransform.from_components(-self.R @ self.centre, Rotation.from_matrix(self.R)),
            distortion=self.terms,
            lens=self.lens,
            shift_sd_px=shift_sd_px,
        )

    def depth(self, world: Array) -> Array:
        """Return how far in front of the camera points (..., 3) lie: (...) [m]."""
        return (world - self.centre) @ self.R[2]

    def px_from_world(self, world: Array) -> Array:
        """Project points (..., 3) [m]: (..., 2) [px]; points behind the camera come out mirrored."""
        xyz = (world - self.centre) @ self.R.T
        xy = xyz[..., :2] / xyz[..., 2:]
        lens = distort_fisheye if self.lens == "fisheye" else distort
        return self.focal_px * lens(xy, self.terms) + self.principal_point

    def undistort_px(self, px: Array) -> Array:
        """Undistort pixels (..., 2) [px]."""
        xy = (px - self.principal_point) / self.focal_px
        inverse = undistort_fisheye if self.lens == "fisheye" else undistort
        return self.focal_px * inverse(xy, self.terms) + self.principal_point

    def with_lens(self, model: PinholeModel) -> Pinhole:
        """Return the camera with room for the model's lens terms; one of the other kind starts without distortion."""
        n = 1 + max(model.terms, default=0)
        terms = np.zeros(n) if model.lens != self.lens else np.pad(self.terms, (0, max(n - len(self.terms), 0)))
        return replace(self, terms=np.pad(terms, (0, max(_FEWEST_TERMS[model.lens] - len(terms), 0))), lens=model.lens)

    def apply_step(self, model: PinholeModel, step: Array) -> Pinhole:
        """Return the camera with the model's free parameters changed by step (n_parameters,).

        The order is that of `parameter_names`; the rotation vector is about the camera's own axes.
        """
        terms = self.terms.copy()
        terms[list(model.terms)] += step[-len(model.terms) :] if model.terms else 0.0
        return Pinhole(
            Rotation.from_rotvec(step[:3]).as_matrix() @ self.R,
            self.centre + step[3:6],
            self.focal_px + step[6],
            self.principal_point + (step[7:9] if model.frees_principal_point else 0.0),
            terms,
            self.lens,
        )


def pinhole_of(camera: Camera) -> Pinhole:
    """Return a camera's pose and focal length with square pixels, its lens without distortion."""
    R = camera.camera_from_world.rotation.as_matrix()
    terms = np.zeros(_FEWEST_TERMS[camera.lens])
    return Pinhole(R, camera.centre, camera.K[0, 0], camera.K[:2, 2], terms, camera.lens)


def parameter_names(model: PinholeModel) -> tuple[str, ...]:
    """Return the names, with units, of the model's free parameters, in the order of `Pinhole.apply_step`."""
    lens_terms = tuple(_TERM_NAMES[model.lens][term] for term in model.terms)
    return _PARAMETERS[:7] + _PARAMETERS[7:] * model.frees_principal_point + lens_terms


def fit_pinhole(start: Pinhole, model: PinholeModel, world: Array, px: Array) -> Pinhole:
    """Return the camera near start that projects world (n, 3) [m] closest to px (n, 2) [px], by Levenberg-Marquardt."""
    start, n = start.with_lens(model), model.n_parameters
    residual = _residual_of_step(start, model, world, px)
    slopes: Any = _slopes_of_step(start, model, world)
    solution = least_squares(
        residual,
        np.zeros(n),
        jac=slopes,
        method="lm",
        x_scale="jac",
        xtol=1e-10,
        ftol=1e-10,
        max_nfev=_MOST_ITERATIONS,
    )
    return start.apply_step(model, solution.x)


def fit_pinhole_pose(start: Pinhole, world: Array, px: Array) -> Pinhole:
    """Return the camera near start with its lens kept that projects world (n, 3) [m] closest to px (n, 2) [px]."""
    residual = _residual_of_step(start, SEVEN_PARAMETERS, world, px)
    solution = least_squares(lambda step: residual(np.append(step, 0.0)), np.zeros(6), method="lm", x_scale="jac")
    return start.apply_step(SEVEN_PARAMETERS, np.append(solution.x, 0.0))


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
    n = model.n_parameters
    residual, jacobian = pinhole.px_from_world(world) - px, _slopes_of_step(pinhole, model, world)(np.zeros(n))
    variance = np.sum(residual**2) / (px.size - n)
    scale = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.pinv(jacobian / scale)
    return variance * (inverse @ inverse.T) / np.outer(scale, scale)


def _residual_of_step(start: Pinhole, model: PinholeModel, world: Array, px: Array) -> Callable[[Array], Array]:
    return lambda step: (start.apply_step(model, step).px_from_world(world) - px).ravel()


def _slopes_of_step(start: Pinhole, model: PinholeModel, world: Array) -> Callable[[Array], Array]:
    """Return the derivatives (2 n, n_parameters) of the projections at a step."""
    own = [*range(7), *(8, 9) * model.frees_principal_point, *(10 + term for term in model.terms)]

    def slopes(step: Array) -> Array:
        pinhole, n = start.apply_step(model, step), len(world)
        f, terms = pinhole.focal_px, np.pad(pinhole.terms, (0, 8 - len(pinhole.terms)))
        intrinsics = np.array([f, f, *pinhole.principal_point, *terms])
        _, by_camera, _ = project_with_jacobian(
            np.broadcast_to(pinhole.R, (n, 3, 3)),
            pinhole.centre,
            np.broadcast_to(intrinsics, (n, 12)),
            is_fisheye=np.full(n, pinhole.lens == "fisheye"),
            world=world,
        )
        by_camera[:, :, 6] += by_camera[:, :, 7]  # square pixels
        by_camera[:, :, :3] = by_camera[:, :, :3] @ left_jacobian(step[:3])
        return by_camera.reshape(2 * n, -1)[:, own]

    return slopes
