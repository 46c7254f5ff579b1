"""DLT coefficients as DLTdv, easyWand and Argus keep them: 11 rows, one column a camera, no header."""

from __future__ import annotations

import numpy as np

from airborne.cameras.camera import Camera, Rig
from airborne.cameras.dlt import decompose_with_skew, dlt_coefficients
from airborne.cameras.formats.options import METRES, FileOptions, PixelConvention, Unit
from airborne.cameras.formats.parsing import LARGEST_NUMBER, build_camera, parse_size
from airborne.cameras.formats.xml import parse_number
from airborne.errors import CalibrationError
from airborne.types import Array

_N_ROWS = 11  # L1 to L11
_NO_CAMERA = "these coefficients are no camera's; give the table that DLTdv wrote"
_SMALLEST_AXIS = 1e-12  # of the largest: below, the three axes lie in a plane
_SMALLEST_DEPTH = 1e-6  # of the camera's distance: nearer to its plane the world's origin has no depth to divide by


def is_dlt(text: str) -> bool:
    """Whether a text begins as a table of bare numbers."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    return bool(first) and all(np.isfinite(parse_number(cell)) for cell in _cells(first))


def rig_from_dlt(text: str, where: str, options: FileOptions) -> Rig:
    """Return the cameras cam1, cam2, ... of a table of coefficients, in metres unless the options say otherwise.

    `u = (L1 X + L2 Y + L3 Z + L4) / (L9 X + L10 Y + L11 Z + 1)`, v with L5 to L8, in pixels as `options.pixels` counts
    them. All eleven numbers are kept: the fifth of the intrinsics is the skew. Raises CalibrationError where the
    cameras look away from each other, the sign of a wrong pixel corner.
    """
    rows = [_cells(line) for line in text.splitlines() if line.strip()]
    widths = {len(row) for row in rows}
    if len(rows) != _N_ROWS or len(widths) != 1:
        shape_text = f"{len(rows)} rows of {' or '.join(map(str, sorted(widths)[:3]))} numbers"
        raise CalibrationError(f"{where}: {shape_text}; expected 11 rows, one column a camera")
    L = np.array([[parse_number(cell) for cell in row] for row in rows])
    if not np.all(np.abs(L) <= LARGEST_NUMBER):
        raise CalibrationError(f"{where}: a coefficient is not a number, or too large; expected 11 rows of numbers")
    rig = Rig(tuple(_camera(f"{where}, column {k + 1}", f"cam{k + 1}", L[:, k], options) for k in range(L.shape[1])))
    _check_view(rig, where, options.pixels)
    return rig


def dlt_text(rig: Rig, pixels: PixelConvention, unit: Unit = "m") -> str:
    """Return a table of coefficients, 17 digits each. Raises CalibrationError where a camera has none."""
    columns = []
    for camera in rig:
        P = pixels.theirs_from_ours(camera.size[1]) @ camera.P @ np.diag([*[METRES[unit]] * 3, 1.0])
        if camera.lens == "fisheye":
            raise CalibrationError(f"camera '{camera.name}' has a fisheye lens, which DLT coefficients cannot hold")
        if abs(P[2, 3]) <= _SMALLEST_DEPTH * np.linalg.norm(camera.centre):
            raise CalibrationError(
                f"camera '{camera.name}' has the world's origin beside it, where DLT coefficients divide by zero; "
                "move the origin"
            )
        columns.append(dlt_coefficients(P))
    return "".join(",".join(f"{value:.17g}" for value in row) + "\n" for row in np.transpose(columns))


def dlt_losses(rig: Rig) -> tuple[str, ...]:
    """Return what DLT coefficients cannot hold: names, image sizes, and distortion with its largest displacement."""
    notes = [f"names: cam1, cam2, ... for {', '.join(rig.names)}", "image sizes"]
    distorted = [f"{camera.name} (up to {_corner_shift_px(camera):.1f} px)" for camera in rig if camera.is_distorted]
    return (
        (*notes, f"lens distortion of {', '.join(distorted)}: straighten pixels first") if distorted else tuple(notes)
    )


def _camera(where: str, name: str, L: Array, options: FileOptions) -> Camera:
    size = parse_size(where, options.size_of(name, where))
    to_ours = np.linalg.inv(options.pixels.theirs_from_ours(size[1]))
    P = np.asarray(to_ours @ np.append(L, 1.0).reshape(3, 4), float)
    P[:, :3] /= options.metres("m")
    length = np.linalg.norm(P[:, :3])
    if length == 0 or np.linalg.svd(P[:, :3] / length, compute_uv=False)[-1] < _SMALLEST_AXIS:
        raise CalibrationError(f"{where}: {_NO_CAMERA}")
    decomposition = decompose_with_skew(P)
    if not (
        np.all(np.abs(decomposition.K) <= LARGEST_NUMBER) and np.all(np.abs(decomposition.centre) <= LARGEST_NUMBER)
    ):
        raise CalibrationError(f"{where}: {_NO_CAMERA}")
    translation = -decomposition.R @ decomposition.centre
    return build_camera(
        where,
        name,
        K=decomposition.K,
        size=size,
        rotation=decomposition.R,
        translation=translation,
        distortion=np.zeros(5),
    )


def _check_view(rig: Rig, where: str, pixels: PixelConvention) -> None:
    """Raise CalibrationError if the point nearest to all optical axes lies behind every camera."""
    if len(rig) < 2:
        return
    axes = np.stack([camera.camera_from_world.rotation.as_matrix()[2] for camera in rig])
    centres = np.stack([camera.centre for camera in rig])
    across = np.eye(3) - axes[:, :, None] * axes[:, None]
    middle = np.linalg.lstsq(across.sum(axis=0), np.einsum("cij,cj->i", across, centres), rcond=None)[0]
    if np.all(np.einsum("ci,ci->c", middle - centres, axes) < 0):
        other = "lower-left" if pixels.corner == "upper-left" else "upper-left"
        raise CalibrationError(
            f"{where}: with pixels from the {pixels.corner} the cameras look away from each other; "
            f"is it --origin {other} (DLTdv 8: upper-left; DLTdv 7 and older, easyWand, Argus: lower-left)?"
        )


def _corner_shift_px(camera: Camera) -> float:
    width, height = camera.size
    corners = np.array([[u, v] for u in (0, width - 1) for v in (0, height - 1)], float)
    return float(np.linalg.norm(camera.distort_px(corners) - corners, axis=1).max())


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().rstrip(",").split(",")]
