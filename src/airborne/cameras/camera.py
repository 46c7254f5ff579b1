"""Cameras and rigs: values that map world points to pixels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.distortion import distort, distort_fisheye, undistort, undistort_fisheye
from airborne.errors import CalibrationError
from airborne.geometry.triangulation import triangulate
from airborne.io.names import check_name
from airborne.types import Array

Lens = Literal["brown", "fisheye"]


def _check_shape(values: ArrayLike, ending: tuple[int, ...], what: str, meaning: str) -> Array:
    """Return numbers whose shape ends as it should; raises CalibrationError for anything else."""
    expected = f"expected (..., {', '.join(map(str, ending))}), {meaning}"
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        raise CalibrationError(f"{what} are no array of numbers (found {str(values)[:60]}); {expected}") from None
    if array.shape[-len(ending) :] != ending:
        raise CalibrationError(f"{what} have the shape {array.shape}; {expected}")
    return array


def scale_lengths(covariance: Array, factor: float) -> Array:
    """Return a camera's covariance (7, 7) with lengths that are `factor` times as large; see `Camera`."""
    sizes = np.array([1, 1, 1, factor, factor, factor, 1.0])
    return covariance * np.outer(sizes, sizes)


def correlation(covariance: Array) -> tuple[Array, Array]:
    """Return standard deviations (n,) and the symmetric correlation matrix (n, n) of a covariance."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    return sd, (covariance + covariance.T) / 2 / sd[:, None] / sd


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Camera:
    """A pinhole camera with distortion: x right, y down, z forward; pixel centres at whole numbers.

    World points are in metres. `camera_from_world` is the rigid map from world to camera axes.
    """

    name: str
    K: Array  # (3, 3) [px]
    size: tuple[int, int]  # (width, height) [px]
    camera_from_world: RigidTransform
    distortion: Array = field(
        default_factory=lambda: np.zeros(5)
    )  # k1, k2, p1, p2, k3 (, k4, k5, k6); of a fisheye k1 to k4
    lens: Lens = "brown"
    shift_sd_px: float = 0.0  # how far the calibration may displace an image as a whole, right or down [px]
    # (7, 7) of the calibration's errors: turn [rad] and place [m], both in the camera's axes, and focal length [share];
    # None: it does not say
    covariance: Array | None = None
    world_sd: float | None = None  # of the size of the calibration's world [share]; None: it does not say

    def __repr__(self) -> str:
        (width, height), (x, y, z) = self.size, self.centre
        focal_px = f"{self.K[0, 0]:.1f} px"
        return f"<Camera '{self.name}': {width}×{height} px, focal length {focal_px}, at {x:.3f}, {y:.3f}, {z:.3f} m>"

    @property
    def centre(self) -> Array:
        """The camera's position in the world: (3,) [m]."""
        return self.camera_from_world.inv().translation + 0.0  # no -0

    @property
    def is_distorted(self) -> bool:
        """Whether the lens is anything but a pinhole."""
        return self.lens == "fisheye" or bool(np.any(self.distortion))

    @property
    def is_rational(self) -> bool:
        """Whether the lens has the eight terms of the rational model."""
        return len(self.distortion) == 8

    @property
    def P(self) -> Array:
        """The projection matrix without distortion: (3, 4), `px ~ P [X; 1]`."""
        return self.K @ self.camera_from_world.as_matrix()[:3]

    def px_from_world(self, points: Array) -> Array:
        """Project points (..., 3) [m] to the image: (..., 2) [px]; NaN behind the camera."""
        points = _check_shape(points, (3,), "points", "x, y, z in metres")
        matrix = self.camera_from_world.as_matrix()
        xyz = points @ matrix[:3, :3].T + matrix[:3, 3]
        z = np.where(xyz[..., 2:] > 0, xyz[..., 2:], np.nan)
        return self._distort(xyz[..., :2] / z) @ self.K[:2, :2].T + self.K[:2, 2]

    def distort_px(self, px: Array) -> Array:
        """Map undistorted pixels (..., 2) to the pixels that the lens gives: (..., 2) [px]."""
        xy = (_check_shape(px, (2,), "pixels", "u, v") - self.K[:2, 2]) @ np.linalg.inv(self.K[:2, :2]).T
        return self._distort(xy) @ self.K[:2, :2].T + self.K[:2, 2]

    def undistort_px(self, px: Array) -> Array:
        """Map pixels (..., 2) [px] to those of the same camera without distortion: (..., 2) [px].

        NaN stays NaN; NaN also where the lens model has no inverse.
        """
        px = _check_shape(px, (2,), "pixels", "u, v")
        if not self.is_distorted:
            return px
        xy = (px - self.K[:2, 2]) @ np.linalg.inv(self.K[:2, :2]).T
        inverse = undistort_fisheye if self.lens == "fisheye" else undistort
        return inverse(xy, self.distortion) @ self.K[:2, :2].T + self.K[:2, 2]

    def _distort(self, xy: Array) -> Array:
        if not self.is_distorted:
            return xy
        return (distort_fisheye if self.lens == "fisheye" else distort)(xy, self.distortion)

    def resample(
        self, *, scale: tuple[float, float], offset: tuple[float, float] = (0.0, 0.0), size: tuple[int, int]
    ) -> Camera:
        """Return the camera of an image whose pixel (i, j) is this image's pixel `scale * (i, j) + offset`.

        Serves fields (scale (1, 2), offset (0, parity)), reduced images and crops.
        """
        new_from_old = np.array(
            [[1 / scale[0], 0, -offset[0] / scale[0]], [0, 1 / scale[1], -offset[1] / scale[1]], [0, 0, 1.0]]
        )
        return replace(self, K=new_from_old @ self.K, size=size)

    def field(self, parity: int) -> Camera:
        """Return the camera of one field: the rows `parity, parity + 2, ...` of the frame."""
        width, height = self.size
        return self.resample(scale=(1, 2), offset=(0, parity), size=(width, (height - parity + 1) // 2))

    def without_distortion(self) -> Camera:
        """Return the same camera without distortion."""
        return replace(self, distortion=np.zeros(5), lens="brown")


def camera_looking_at(
    name: str,
    position: ArrayLike,
    target: ArrayLike,
    *,
    focal_px: float,
    size: tuple[int, int],
) -> Camera:
    """Return a level camera of size (width, height) [px] that looks from one world point (3,) to another [m]."""
    centre, forward = np.asarray(position, float), np.subtract(target, position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    width, height = size
    return Camera(
        name=name,
        K=np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]]),
        size=size,
        camera_from_world=RigidTransform.from_components(-R @ centre, Rotation.from_matrix(R)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """The cameras of one recording, in a fixed order."""

    cameras: tuple[Camera, ...]

    def __post_init__(self) -> None:
        names = [camera.name for camera in self.cameras]
        if len(set(names)) != len(names):
            raise CalibrationError(f"two cameras share a name: {', '.join(names)}; give each its own")
        try:
            list(map(check_name, names))
        except ValueError as error:
            raise CalibrationError(f"cameras: {error}") from None

    def __repr__(self) -> str:
        return f"<Rig: {', '.join(camera.name for camera in self.cameras)}>"

    def __len__(self) -> int:
        return len(self.cameras)

    def __iter__(self) -> Iterator[Camera]:
        return iter(self.cameras)

    @property
    def states_errors(self) -> bool:
        """Whether the calibration says of every camera how good it is."""
        return all(camera.covariance is not None for camera in self.cameras)

    @property
    def world_sd(self) -> float | None:
        """Standard deviation of the size of the calibration's world [share]; None where it does not say."""
        return max((each for camera in self.cameras if (each := camera.world_sd) is not None), default=None)

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras' names, in order."""
        return tuple(camera.name for camera in self.cameras)

    def __getitem__(self, name: str) -> Camera:
        for camera in self.cameras:
            if camera.name == name:
                return camera
        raise CalibrationError(f"camera '{name}' not in rig; it has: {', '.join(self.names)}")

    def select(self, names: Sequence[str]) -> Rig:
        """Return the rig of the named cameras, in that order; raises CalibrationError for an unknown name."""
        if isinstance(names, str):
            raise CalibrationError(f"select takes a list of names; give ['{names}'], or rig['{names}'] for the camera")
        return Rig(tuple(self[name] for name in names))

    @property
    def P(self) -> Array:
        """The projection matrices without distortion: (cameras, 3, 4)."""
        return np.stack([camera.P for camera in self.cameras])

    def points_from_px(self, px: Array, weights: Array | None = None) -> Array:
        """Triangulate pixels (..., cameras, 2) [px], NaN where not seen: (..., 3) [m]; weights (..., cameras).

        Lens distortion is taken out first; NaN where fewer than two cameras see the point (see `triangulate`).
        """
        px = _check_shape(px, (len(self), 2), "pixels", "a row a camera")
        if weights is not None:
            weights = _check_shape(weights, (len(self),), "weights", "one a camera, none below 0")
            if (weights < 0).any():
                raise CalibrationError(f"a weight is {weights.min():g}; expected 0 or more")
        undistorted = [camera.undistort_px(px[..., i, :]) for i, camera in enumerate(self.cameras)]
        return triangulate(self.P, np.stack(undistorted, axis=-2), weights)
