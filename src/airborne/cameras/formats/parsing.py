"""What all formats share: numbers checked, and cameras built from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Camera
from airborne.errors import CalibrationError
from airborne.types import Array, Size

LARGEST_NUMBER = 1e9  # of any number in a calibration: metres, millimetres or pixels
_LARGEST_SIZE_PX = 65_535  # what 16 bits hold
_ROTATION_TOLERANCE = 1e-3  # how far nine numbers may be from a rotation
_N_TERMS = {"brown": (5, 8), "fisheye": (4,)}  # the numbers that a lens may have; 8: the rational model


def parse_array(where: str, name: str, value: object, *shapes: tuple[int, ...]) -> Array:
    """Return a file's value as an array of finite numbers with one of the shapes; raises CalibrationError."""
    expected = " or ".join("×".join(map(str, shape)) for shape in shapes)
    if value is None:
        raise CalibrationError(f"{where}: no {name}; expected {expected} numbers")
    try:
        values = np.array(value, float)
    except (TypeError, ValueError, OverflowError, RecursionError):
        values = np.array(np.nan)
    if values.shape not in shapes or not np.all(np.abs(values) <= LARGEST_NUMBER):
        raise CalibrationError(f"{where}: {name} = {_short(value)}, expected {expected} numbers")
    return values


def build_camera(
    where: str,
    name: str,
    *,
    K: Array,
    size: ArrayLike,
    rotation: Array,
    translation: Array,
    distortion: Array,
    is_fisheye: bool = False,
) -> Camera:
    """Build a camera from checked numbers; raises CalibrationError where they describe no camera.

    size (width, height) [px]; rotation (3,) Rodrigues or (3, 3), camera from world; translation (3,) [m]; distortion up
    to five Brown terms k1, k2, p1, p2, k3, the eight of the rational model, or the four of a fisheye.
    """
    if not (K[0, 0] > 0 and K[1, 1] > 0 and K[1, 0] == 0 and np.array_equal(K[2], [0, 0, 1])):
        raise CalibrationError(f"{where}: matrix is not [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy")
    lens = "fisheye" if is_fisheye else "brown"
    n_terms = next((n for n in _N_TERMS[lens] if n >= len(distortion)), None)
    if n_terms is None:
        raise CalibrationError(f"{where}: {len(distortion)} distortion terms; a {lens} lens has {_N_TERMS[lens][-1]}")
    return Camera(
        name=name,
        K=K,
        size=parse_size(where, size),
        camera_from_world=RigidTransform.from_components(translation, _rotation(where, rotation)),
        distortion=np.pad(distortion, (0, n_terms - len(distortion))),
        lens=lens,
    )


def parse_size(where: str, size: ArrayLike) -> Size:
    """Return (width, height) [px]; raises CalibrationError where they are not whole numbers."""
    values = np.asarray(size, float)
    if not (np.all(values >= 1) and np.all(values <= _LARGEST_SIZE_PX) and np.array_equal(values, np.round(values))):
        raise CalibrationError(f"{where}: size = {values.tolist()}, expected width and height in whole pixels")
    return int(values[0]), int(values[1])


def distortion_terms(camera: Camera, n: int) -> list[float]:
    """Return the camera's distortion in n terms, zeros where it has fewer; all eight of the rational model."""
    if camera.is_rational:
        return camera.distortion.tolist()
    return np.pad(camera.distortion, (0, max(n - len(camera.distortion), 0)))[:n].tolist()


def refuse_lens(camera: Camera, name_of_format: str, *, is_rational_held: bool = False) -> None:
    """Raise CalibrationError for a fisheye lens, or the rational model, in a format that cannot hold it."""
    if camera.lens == "fisheye" or (camera.is_rational and not is_rational_held):
        lens = "fisheye lens" if camera.lens == "fisheye" else "rational lens model"
        raise CalibrationError(
            f"camera '{camera.name}' has a {lens}, which {name_of_format} cannot hold; "
            "write pose2sim, aniposelib or caliscope"
        )


def _rotation(where: str, value: Array) -> Rotation:
    if value.shape == (3,):
        return Rotation.from_rotvec(value)
    if np.abs(value @ value.T - np.eye(3)).max() > _ROTATION_TOLERANCE or np.linalg.det(value) < 0:
        raise CalibrationError(f"{where}: the rotation is not one: its rows are not at right angles, or it mirrors")
    return Rotation.from_matrix(value)


def _short(value: object) -> str:
    try:
        return str(value)[:60]
    except (RecursionError, ValueError):  # nested too deeply, or a number of too many digits
        return "something unreadable"
