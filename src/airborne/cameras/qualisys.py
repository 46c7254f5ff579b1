"""Qualisys `.qca.txt`: XML, lengths in mm, intrinsics in 64ths of a pixel, attitudes with the axes turned."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Camera, Rig
from airborne.errors import CalibrationError

SUBPIXELS = 64
ATTITUDE_TOLERANCE = 1e-3  # how far the nine numbers may be from a rotation
OURS_FROM_QUALISYS = np.diag([1.0, -1.0, -1.0])  # its cameras have y up and look along -z


def rig_from_qualisys(text: str, where: str) -> Rig:
    """Return the rig of a Qualisys calibration; `where` names the file in errors. Cameras are named by their serial.

    `x_camera = diag(1, -1, -1) M (x - C)` with `M = r11..r33` row by row and C in mm. Focal lengths, centre and
    skew are divided by 64. The distortion terms have no unit and stay as they are: pictures of a board bear that out,
    while Pose2Sim divides them by 64 too and so keeps almost no distortion. Raises CalibrationError.
    """
    try:
        root = ElementTree.fromstring(text.encode())
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise CalibrationError(f"{where} is not a Qualisys calibration: as XML, {error}") from None
    elements = root.findall("./cameras/camera")
    if root.tag != "calibration" or not elements:
        raise CalibrationError(f"{where} has no cameras; expected a Qualisys <calibration> with <cameras><camera ...>")
    return Rig(tuple(_camera(where, number, element) for number, element in enumerate(elements, 1)))


def _camera(where: str, number: int, element: ElementTree.Element) -> Camera:
    name = element.get("serial") or f"camera {number}"
    where = f"{where}, camera '{name}'"
    if "fisheye" in element.get("model", "").lower():
        raise CalibrationError(f"{where}: a fisheye lens; fisheye lenses are not supported, straighten the video first")
    lengths = "focalLengthU focalLengthV centerPointU centerPointV skew"
    f_u, f_v, u0, v0, skew = np.array(_numbers(where, element, "intrinsic", lengths)) / SUBPIXELS
    radial = _numbers(where, element, "intrinsic", "radialDistortion1 radialDistortion2 radialDistortion3")
    tangential = _numbers(where, element, "intrinsic", "tangentalDistortion1 tangentalDistortion2")
    left, top, right, bottom = _numbers(where, element, "fov_video", "left top right bottom")
    *attitude, x, y, z = _numbers(where, element, "transform", "r11 r12 r13 r21 r22 r23 r31 r32 r33 x y z")
    M = np.reshape(attitude, (3, 3))
    if not np.allclose(M @ M.T, np.eye(3), atol=ATTITUDE_TOLERANCE) or np.linalg.det(M) < 0:
        raise CalibrationError(f"{where}: r11..r33 is not a rotation; export the calibration again")
    if f_u <= 0 or f_v <= 0 or right <= left or bottom <= top:
        raise CalibrationError(
            f"{where}: focal lengths and field of view must be positive; export the calibration again"
        )
    rotation = Rotation.from_matrix(OURS_FROM_QUALISYS @ M)
    return Camera(
        name=name,
        K=np.array([[f_u, skew, u0], [0, f_v, v0], [0, 0, 1]]),
        size=(round(right - left) + 1, round(bottom - top) + 1),
        camera_from_world=RigidTransform.from_components(-rotation.apply(np.array([x, y, z]) / 1000), rotation),
        distortion=np.array([*radial[:2], *tangential, radial[2]]),
    )


def _numbers(where: str, element: ElementTree.Element, tag: str, attributes: str) -> list[float]:
    child = element.find(tag)
    if child is None:
        raise CalibrationError(f"{where}: no <{tag}>; expected one with {attributes}")
    values = []
    for attribute in attributes.split():
        text = child.get(attribute)
        try:
            value = float(text if text is not None else "nan")
        except ValueError:
            value = float("nan")
        if not np.isfinite(value):
            found = "is missing" if text is None else f"is '{text}'"
            raise CalibrationError(f"{where}: {attribute} of <{tag}> {found}, expected a number")
        values.append(value)
    return values
