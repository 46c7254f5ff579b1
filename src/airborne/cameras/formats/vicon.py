"""Vicon `.xcp`: XML, lengths in mm, one key frame a camera."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.formats.parsing import build_camera, parse_array, parse_size, refuse_lens
from airborne.cameras.formats.xml import attribute_numbers, xml_text
from airborne.errors import CalibrationError

_QUATERNION_TOLERANCE = 1e-3  # how far four numbers may be from unit length


def rig_from_vicon(root: ElementTree.Element, where: str, options: FileOptions) -> Rig:
    """Return the cameras that have a key frame, named by their DEVICEID.

    `x_camera = R (x - C)`: ORIENTATION is R, camera from world, as a quaternion x, y, z, w; POSITION is C in mm.
    FOCAL_LENGTH is fx, fx / PIXEL_ASPECT_RATIO is fy. Fields 4 to 6 of VICON_RADIAL2 are taken as k1, k2, k3 (the last
    may be missing), as other readers of the file do. Raises CalibrationError.
    """
    elements = [element for element in root.findall("Camera") if element.find("KeyFrames/KeyFrame") is not None]
    if not elements:
        raise CalibrationError(f"{where} has no calibrated cameras; expected <Camera> with <KeyFrames><KeyFrame ...>")
    return Rig(tuple(_camera(where, number, element, options) for number, element in enumerate(elements, 1)))


def vicon_text(rig: Rig) -> str:
    """Return a Vicon file; errors are not known and therefore NaN. Raises CalibrationError for a fisheye lens."""
    root = ElementTree.Element("Cameras", {"SOURCE": "airborne", "VERSION": "1"})
    for number, camera in enumerate(rig, 1):
        refuse_lens(camera, "a Vicon file")
        element = ElementTree.SubElement(root, "Camera", _attributes(camera, number))
        keys = ElementTree.SubElement(element, "KeyFrames")
        ElementTree.SubElement(keys, "KeyFrame", _key_frame(camera))
    return xml_text(root)


def vicon_losses(rig: Rig) -> tuple[str, ...]:
    """Return what a Vicon file cannot hold: tangential distortion and skew."""
    tangential = [camera.name for camera in rig if np.any(camera.distortion[2:4])]
    skewed = [camera.name for camera in rig if camera.K[0, 1]]
    notes = (f"tangential distortion of {', '.join(tangential)}",) if tangential else ()
    return notes + ((f"skew of {', '.join(skewed)}",) if skewed else ())


def _attributes(camera: Camera, number: int) -> dict[str, str]:
    width, height = camera.size
    video = {"DISPLAY_TYPE": "VideoInputDevice", "TYPE": "VideoInputDevice", "SKEW": "0"}
    aspect = repr(float(camera.K[0, 0] / camera.K[1, 1]))
    named = {"DEVICEID": camera.name, "NAME": "", "USERID": str(number), "SENSOR_SIZE": f"{width} {height}"}
    return named | video | {"PIXEL_ASPECT_RATIO": aspect}


def _key_frame(camera: Camera) -> dict[str, str]:
    k1, k2, _, _, k3 = camera.distortion.tolist()
    centre = _text(camera.K[:2, 2])
    return {
        "FRAME": "0",
        "FOCAL_LENGTH": repr(float(camera.K[0, 0])),
        "PRINCIPAL_POINT": centre,
        "ORIENTATION": _text(camera.camera_from_world.rotation.as_quat()),
        "POSITION": _text(1e3 * camera.centre),
        "VICON_RADIAL": _text([k1, k2]),
        "VICON_RADIAL2": f"ViconRadial2 {centre} {_text([k1, k2, k3])}",
        "IMAGE_ERROR": "nan",
        "WORLD_ERROR": "nan",
    }


def _text(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def _camera(where: str, number: int, element: ElementTree.Element, options: FileOptions) -> Camera:
    name = element.get("DEVICEID") or element.get("USERID") or f"camera {number}"
    where = f"{where}, camera '{name[:60]}'"
    frame = element.find("KeyFrames/KeyFrame")
    assert frame is not None
    [focal] = attribute_numbers(where, frame, "FOCAL_LENGTH")
    [aspect] = attribute_numbers(where, element, "PIXEL_ASPECT_RATIO")
    if focal <= 0 or aspect <= 0:
        raise CalibrationError(f"{where}: FOCAL_LENGTH and PIXEL_ASPECT_RATIO must be positive; export it again")
    if element.get("SKEW") and attribute_numbers(where, element, "SKEW") != [0]:
        raise CalibrationError(f"{where}: SKEW is not 0, whose meaning Vicon does not publish; calibrate it anew")
    u0, v0 = _list(where, frame, "PRINCIPAL_POINT", 2)
    quaternion = _list(where, frame, "ORIENTATION", 4)
    if abs(np.linalg.norm(quaternion) - 1) > _QUATERNION_TOLERANCE:
        raise CalibrationError(f"{where}: ORIENTATION is not a unit quaternion; export the calibration again")
    rotation = Rotation.from_quat(quaternion)
    centre = options.metres("mm") * _list(where, frame, "POSITION", 3)
    k1, k2, k3 = _radial(where, frame)
    return build_camera(
        where,
        name,
        K=np.array([[focal, 0, u0], [0, focal / aspect, v0], [0, 0, 1]]),
        size=parse_size(where, _list(where, element, "SENSOR_SIZE", 2)),
        rotation=rotation.as_matrix(),
        translation=-rotation.apply(centre),
        distortion=np.array([k1, k2, 0, 0, k3]),
    )


def _radial(where: str, frame: ElementTree.Element) -> np.ndarray:
    """Return k1, k2, k3: of the newer model, else of the older, which has no k3."""
    fields = (frame.get("VICON_RADIAL2") or "").split()[3:]
    name = "VICON_RADIAL2" if fields else "VICON_RADIAL"
    coefficients = parse_array(where, name, fields or (frame.get(name) or "0 0").split(), (2,), (3,))
    return np.pad(coefficients, (0, 3 - len(coefficients)))


def _list(where: str, element: ElementTree.Element, name: str, n: int) -> np.ndarray:
    text = element.get(name)
    return parse_array(where, name, None if text is None else text.split(), (n,))
