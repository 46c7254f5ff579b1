"""Qualisys `.qca.txt`: XML, lengths in mm, intrinsics in 64ths of a pixel, camera axes with y up and z backward."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.formats.parsing import build_camera, parse_size, refuse_lens
from airborne.cameras.formats.xml import attribute_numbers, xml_text
from airborne.errors import CalibrationError

_SUBPIXELS = 64  # to a pixel: the unit of its lengths in the image
_ATTITUDE_TOLERANCE = 1e-3  # how far the nine numbers may be from a rotation
_OURS_FROM_QUALISYS = np.diag([1.0, -1.0, -1.0])  # its cameras have y up and look along -z
_ATTITUDE = "r11 r12 r13 r21 r22 r23 r31 r32 r33"


def rig_from_qualisys(root: ElementTree.Element, where: str, options: FileOptions) -> Rig:
    """Return the rig of a Qualisys calibration; `where` names the file in errors. Cameras are named by their serial.

    `x_camera = diag(1, -1, -1) M (x - C)` with `M = r11..r33` row by row and C in mm. Focal lengths, centre and
    skew are divided by 64; the centre counts from the sensor's corner, the image from fov_video's. The distortion
    terms have no unit and stay as they are: images of a board confirm it, while Pose2Sim divides them by 64 too and so
    loses almost all distortion. Raises CalibrationError.
    """
    elements = root.findall("./cameras/camera")
    if not elements:
        raise CalibrationError(f"{where} has no cameras; expected a Qualisys <calibration> with <cameras><camera ...>")
    return Rig(tuple(_camera(where, number, element, options) for number, element in enumerate(elements, 1)))


def qualisys_text(rig: Rig) -> str:
    """Return a Qualisys file; residuals are not known and therefore NaN. Raises CalibrationError for a fisheye lens."""
    root = ElementTree.Element("calibration", {"source": "airborne", "type": "regular"})
    cameras = ElementTree.SubElement(root, "cameras")
    for camera in rig:
        refuse_lens(camera, "a Qualisys file")
        attributes = {"active": "1", "avg-residual": "nan", "model": "none", "serial": camera.name, "viewrotation": "0"}
        element = ElementTree.SubElement(cameras, "camera", attributes)
        right, bottom = camera.size[0] - 1, camera.size[1] - 1
        fov = {"left": "0", "top": "0", "right": str(right), "bottom": str(bottom)}
        for tag in ("fov_marker", "fov_marker_max", "fov_video", "fov_video_max"):
            ElementTree.SubElement(element, tag, fov)
        ElementTree.SubElement(element, "transform", _transform(camera))
        sensor = {"sensorMinU": 0, "sensorMaxU": _SUBPIXELS * right, "sensorMinV": 0, "sensorMaxV": _SUBPIXELS * bottom}
        ElementTree.SubElement(element, "intrinsic", _intrinsic(camera) | {k: str(v) for k, v in sensor.items()})
    return xml_text(root)


def _camera(where: str, number: int, element: ElementTree.Element, options: FileOptions) -> Camera:
    name = element.get("serial") or f"camera {number}"
    where = f"{where}, camera '{name[:60]}'"
    if "fisheye" in element.get("model", "").lower():
        raise CalibrationError(f"{where}: a fisheye lens, whose terms Qualisys does not publish; calibrate it anew")
    lengths = "focalLengthU focalLengthV centerPointU centerPointV skew"
    f_u, f_v, u0, v0, skew = np.array(_numbers(where, element, "intrinsic", lengths)) / _SUBPIXELS
    radial = _numbers(where, element, "intrinsic", "radialDistortion1 radialDistortion2 radialDistortion3")
    tangential = _numbers(where, element, "intrinsic", "tangentalDistortion1 tangentalDistortion2")
    left, top, right, bottom = _numbers(where, element, "fov_video", "left top right bottom")
    *attitude, x, y, z = _numbers(where, element, "transform", f"{_ATTITUDE} x y z")
    M = np.reshape(attitude, (3, 3))
    if not np.allclose(M @ M.T, np.eye(3), atol=_ATTITUDE_TOLERANCE) or np.linalg.det(M) < 0:
        raise CalibrationError(f"{where}: r11..r33 is not a rotation; export the calibration again")
    if f_u <= 0 or f_v <= 0 or right <= left or bottom <= top:
        raise CalibrationError(
            f"{where}: focal lengths and field of view must be positive; export the calibration again"
        )
    rotation = Rotation.from_matrix(_OURS_FROM_QUALISYS @ M)
    return build_camera(
        where,
        name,
        K=np.array([[f_u, skew, u0 - left], [0, f_v, v0 - top], [0, 0, 1]]),
        size=parse_size(where, np.round([right - left + 1, bottom - top + 1])),
        rotation=rotation.as_matrix(),
        translation=-rotation.apply(options.metres("mm") * np.array([x, y, z])),
        distortion=np.array([*radial[:2], *tangential, radial[2]]),
    )


def _numbers(where: str, element: ElementTree.Element, tag: str, attributes: str) -> list[float]:
    child = element.find(tag)
    if child is None:
        raise CalibrationError(f"{where}: no <{tag}>; expected one with {attributes}")
    return attribute_numbers(where, child, attributes)


def _transform(camera: Camera) -> dict[str, str]:
    attitude = _OURS_FROM_QUALISYS @ camera.camera_from_world.rotation.as_matrix()
    names, values = [*_ATTITUDE.split(), *"xyz"], [*attitude.ravel(), *(1e3 * camera.centre)]
    named = dict(zip(names, values, strict=True))
    return {key: repr(float(value)) for key, value in named.items()}


def _intrinsic(camera: Camera) -> dict[str, str]:
    K = _SUBPIXELS * camera.K
    k1, k2, p1, p2, k3 = camera.distortion
    named = {"focalLengthU": K[0, 0], "focalLengthV": K[1, 1], "centerPointU": K[0, 2], "centerPointV": K[1, 2]}
    named |= {"skew": K[0, 1], "radialDistortion1": k1, "radialDistortion2": k2, "radialDistortion3": k3}
    named |= {"tangentalDistortion1": p1, "tangentalDistortion2": p2}
    return {key: repr(float(value)) for key, value in named.items()}
