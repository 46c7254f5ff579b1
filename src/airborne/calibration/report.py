"""A calibration from any sources in words and numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from airborne.calibration.bundle.lenses import CAMERA_PARAMETERS, FISHEYE_PARAMETERS
from airborne.calibration.diagnosis.results import diagnose
from airborne.calibration.from_sources import RigCalibration
from airborne.cameras import Camera
from airborne.types import Array

_LEFT_OUT_WEIGHT = 0.1  # observations of a smaller weight hardly count


def calibration_to_dict(found: RigCalibration) -> dict[str, Any]:
    """Return everything as plain values for JSON; None where a value does not exist."""
    adjusted = found.adjustment
    cameras = {}
    for i, camera in enumerate(found.rig):
        names = FISHEYE_PARAMETERS if camera.lens == "fisheye" else CAMERA_PARAMETERS
        sd = {
            name: float(value) for name, value in zip(names, adjusted.camera_sd[i], strict=True) if name and value > 0
        }
        fit = found.inputs.lenses.get(camera.name)
        cameras[camera.name] = {
            "size_px": list(camera.size),
            "lens": camera.lens,
            "focal_px": [float(camera.K[0, 0]), float(camera.K[1, 1])],
            "principal_point_px": camera.K[:2, 2].tolist(),
            "distortion": camera.distortion.tolist(),
            "position_m": camera.centre.tolist(),
            "sd": sd,
            "n_observations": int(sum(np.isfinite(r[s.camera == i, 0]).sum() for r, s in _pairs(found))),
            "rms_px": _number(adjusted.rms_px(camera=i)),
            "held_out_rms_px": _number(
                _rms(np.concatenate([found.held_out_px[s.name][s.camera == i] for s in adjusted.sources]))
            ),
            "lens_model": None if fit is None else fit.model,
            "lens_held_out_rms_px": {} if fit is None else fit.held_out_rms_px,
            **_change_from_start(found, camera),
            "lag_median_s": _number(float(np.median(found.lag_s[camera.name]))) if camera.name in found.lag_s else None,
        }
    return {
        "cameras": cameras,
        "sources": {source.name: _source(found, i) for i, source in enumerate(adjusted.sources)},
        "rms_px": _number(adjusted.rms_px()),
        "median_px": _number(float(np.nanmedian(np.concatenate(residual_distances_px(found))))),
        "held_out_rms_px": _number(_rms(np.concatenate(list(found.held_out_px.values())))),
        "world": found.world,
        "sd_is_within_the_rig": adjusted.is_gauge_free,
        "mended": [mending.describe() for mending in found.resections],
        "notes": list(found.notes),
        "findings": [
            {"kind": each.kind, "cameras": list(each.cameras), "sentence": each.sentence} for each in diagnose(found)
        ],
        "warnings": list(calibration_warnings(found)),
    }


def _change_from_start(found: RigCalibration, camera: Camera) -> dict[str, float]:
    """Return how far a camera went from where the calibration before had it."""
    if found.inputs.start_rig is None:
        return {}
    before = found.inputs.start_rig[camera.name]
    turn = camera.camera_from_world.rotation * before.camera_from_world.rotation.inv()
    return {
        "moved_m": float(np.linalg.norm(camera.centre - before.centre)),
        "turned_deg": math.degrees(turn.magnitude()),
    }


def describe_calibration(found: RigCalibration) -> str:
    """Return the same as two plain tables with what should be known beside them."""
    told = calibration_to_dict(found)
    header = ("camera", "seen", "RMS px", "held-out px", "focal px", "sd", "place sd mm", "model")
    rows: list[tuple[str, ...]] = [header]
    for name, camera in told["cameras"].items():
        place = [camera["sd"].get(key, 0.0) for key in ("x_m", "y_m", "z_m")]
        rows.append(
            (
                name,
                str(camera["n_observations"]),
                _format(camera["rms_px"]),
                _format(camera["held_out_rms_px"]),
                f"{camera['focal_px'][0]:.1f}",
                f"{camera['sd']['fx_px']:.1f}" if "fx_px" in camera["sd"] else "held",
                f"{1e3 * math.hypot(*place):.1f}" if any(place) else "held",
                camera["lens_model"] or "",
            )
        )
    lines = _table(rows)
    rows = [("source", "seen", "RMS px", "median px", "held-out px", "left out %")]
    for name, source in told["sources"].items():
        numbers = (source["rms_px"], source["median_px"], source["held_out_rms_px"], source["left_out_percent"])
        rows.append((name, str(source["n_observations"]), *(_format(number) for number in numbers)))
    lines += ["", *_table(rows), "", f"world: {told['world']}"]
    if told["sd_is_within_the_rig"]:
        lines.append("standard deviations of places are those of the cameras among each other")
    lines += [f"wrong before: {text}" for text in told["mended"]]
    lines += [
        f"{name}: now {camera['moved_m']:.3f} m and {camera['turned_deg']:.2f} degrees from where it was thought to be"
        for name, camera in told["cameras"].items()
        if "moved_m" in camera
    ]
    lines += [f"note: {text}" for text in told["notes"]]
    lines += [f"found: {each['sentence']}" for each in told["findings"]]
    return "\n".join([*lines, *(f"warning: {text}" for text in told["warnings"])])


def residual_distances_px(found: RigCalibration) -> list[Array]:
    """Return by source how far observations lie from where the cameras see them [px]."""
    return [np.linalg.norm(residual, axis=1) for residual in found.adjustment.residual_px]


def calibration_warnings(found: RigCalibration) -> tuple[str, ...]:
    """Return plain sentences about what makes the calibration doubtful."""
    said = []
    if not found.adjustment.has_converged:
        said.append("the adjustment did not come to rest: look at the residuals, a source may contradict another")
    for source, off in zip(found.adjustment.sources, found.adjustment.weight, strict=True):
        share = float(np.mean(off < _LEFT_OUT_WEIGHT)) if len(off) else 0.0
        if share > 0.2:
            said.append(
                f"{share:.0%} of source '{source.name}' fit nothing: it contradicts the others, or is of other cameras"
            )
    return tuple(said)


def _source(found: RigCalibration, i: int) -> dict[str, Any]:
    adjusted = found.adjustment
    source, off = adjusted.sources[i], residual_distances_px(found)[i]
    seen = np.isfinite(off)
    return {
        "n_observations": int(seen.sum()),
        "rms_px": _number(_rms(off)),
        "median_px": _number(float(np.median(off[seen]))) if seen.any() else None,
        "noise_sd_px": float(np.mean(adjusted.noise_px[i] * np.asarray(source.sd_px))),
        "held_out_rms_px": _number(_rms(found.held_out_px[source.name])),
        "left_out_percent": 100 * float(np.mean(~seen | (adjusted.weight[i] < _LEFT_OUT_WEIGHT))) if len(off) else None,
        "rms_px_by_camera": {name: _number(_rms(off[source.camera == c])) for c, name in enumerate(found.rig.names)},
    }


def _pairs(found: RigCalibration) -> list:
    return list(zip(found.adjustment.residual_px, found.adjustment.sources, strict=True))


def _rms(off: Array) -> float:
    off = off[np.isfinite(off)]
    return float(np.sqrt(np.mean(off**2))) if len(off) else float("nan")


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _format(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        )
        for row in rows
    ]
