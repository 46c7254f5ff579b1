"""A calibration from control points in words and numbers, for people and for programs."""

from __future__ import annotations

import math

import numpy as np

from airborne.calibration.from_points import Calibration, CameraFit
from airborne.cameras import Camera


def describe_points_calibration(calibration: Calibration) -> str:
    """Return a short plain table: RMS per camera in px and mm, held-out errors, chosen models, warnings.

    RMS of 2D distances; mm across the line of sight at each point's depth. "held out": each point predicted by a camera
    fitted without it. "DLT": the residual of the 11-parameter transformation.
    """
    header = ("camera", "points", "RMS px", "RMS mm", "held-out px", "held-out mm", "DLT px", "model")
    rows = [header, *(_row(fit) for fit in calibration.fits)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(header))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(row[i].rjust(widths[i]) for i in range(1, 7)), row[7]]) for row in rows
    ]
    if not math.isnan(calibration.held_out_3d_m):
        lines.append(f"held-out control points in 3D: {calibration.held_out_3d_m * 1e3:.1f} mm RMS")
    n_models = max(len(fit.held_out_rms_px) for fit in calibration.fits)
    if n_models > 1:
        lines.append(
            f"model: the simplest of {n_models} that is not clearly worse on held-out points; --json lists their errors"
        )
    lines += [f"warning: {warning}" for warning in calibration.warnings]
    return "\n".join(lines)


def points_calibration_to_dict(calibration: Calibration) -> dict:
    """Return the same, and the cameras' numbers, as plain values for JSON; None where a value does not exist."""
    cameras = {}
    for camera, fit in zip(calibration.rig, calibration.fits, strict=True):
        cameras[fit.name] = {
            "model": fit.model,
            "n_points": fit.n_points,
            "rms_px": fit.rms_px,
            "rms_mm": fit.rms_m * 1e3,
            "held_out_rms_px": fit.held_out_rms_px[fit.model],
            "held_out_rms_mm": fit.held_out_m * 1e3,
            "held_out_rms_px_of_model": fit.held_out_rms_px,
            "dlt_rms_px": fit.dlt_rms_px,
            "dlt_coefficients": fit.dlt.tolist(),
            "position_m": camera.centre.tolist(),
            "focal_px": float(camera.K[0, 0]),
            "height_angle_deg": _height_angle_deg(camera),
            "principal_point_px": camera.K[:2, 2].tolist(),
            "distortion": camera.distortion.tolist(),
            "sd": fit.sd,
        }
    held_out = calibration.held_out_3d_m
    return {
        "method": calibration.method,
        "cameras": cameras,
        "held_out_3d_rms_mm": None if math.isnan(held_out) else held_out * 1e3,
        "warnings": list(calibration.warnings),
    }


def _row(fit: CameraFit) -> tuple[str, ...]:
    held_out_px = fit.held_out_rms_px[fit.model]
    numbers = (fit.rms_px, fit.rms_m * 1e3, held_out_px, fit.held_out_m * 1e3, fit.dlt_rms_px)
    return (fit.name, str(fit.n_points), *(f"{number:.2f}" for number in numbers), fit.model)


def _height_angle_deg(camera: Camera) -> float:
    """Return the angle that the image spans from top to bottom through its principal point, seen through the lens."""
    u = camera.K[0, 2]
    rows = camera.undistort_px(np.array([[u, -0.5], [u, camera.size[1] - 0.5]]))[:, 1]
    top, bottom = np.arctan((rows - camera.K[1, 2]) / camera.K[1, 1])
    return math.degrees(bottom - top)
