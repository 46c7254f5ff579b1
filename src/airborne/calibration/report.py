"""A calibration from any sources in words and numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from airborne.calibration.bundle.lenses import CAMERA_PARAMETERS, FISHEYE_PARAMETERS
from airborne.calibration.diagnosis.results import diagnose
from airborne.calibration.from_sources import RigCalibration, rms
from airborne.cameras import Camera
from airborne.types import Array

_LEFT_OUT_WEIGHT = 0.1  # observations of a smaller weight count as left out
# of left-out errors to those of the fit; chosen between recordings that fix the cameras, 1.0 to 1.1, and two that do
# not, a few points of a court and four webcams that are not synchronised, 2.1 and 2.7
_SUSPECT_RATIO = 2.0
_MORE_POINTS = "click more points, spread over the images and some of them above the floor"
_OPEN_SD_M = 1.0  # of a camera's place; chosen between wands, up to 0.2, and lenses without any place, 85 and more


def calibration_to_dict(calibration: RigCalibration) -> dict[str, Any]:
    """Return everything as plain values for JSON; None where a value does not exist."""
    adjusted, findings = calibration.adjustment, diagnose(calibration)
    cameras = {}
    for i, camera in enumerate(calibration.rig):
        sd = _sds(calibration, camera)
        fit = calibration.inputs.lenses.get(camera.name)
        cameras[camera.name] = {
            "size_px": list(camera.size),
            "lens": camera.lens,
            "focal_px": [float(camera.K[0, 0]), float(camera.K[1, 1])],
            "principal_point_px": camera.K[:2, 2].tolist(),
            "distortion": camera.distortion.tolist(),
            "position_m": camera.centre.tolist(),
            "sd": sd,
            "n_observations": int(sum(np.isfinite(r[s.camera == i, 0]).sum() for r, s in _pairs(calibration))),
            "rms_px": _number(adjusted.rms_px(camera=i)),
            "held_out_rms_px": _number(rms(calibration.held_out_px_of(camera.name))),
            "lens_model": None if fit is None else fit.model,
            "lens_held_out_rms_px": {} if fit is None else fit.held_out_rms_px,
            **_change_from_start(calibration, camera),
            "lag_median_s": _number(float(np.median(calibration.lag_s[camera.name])))
            if camera.name in calibration.lag_s
            else None,
        }
    return {
        "cameras": cameras,
        "sources": {source.name: _source(calibration, i) for i, source in enumerate(adjusted.sources)},
        "rms_px": _number(adjusted.rms_px()),
        "median_px": _number(float(np.nanmedian(np.concatenate(residual_distances_px(calibration))))),
        "held_out_rms_px": _number(calibration.held_out_rms_px),
        "world": calibration.world,
        "sd_is_within_the_rig": adjusted.is_gauge_free,
        "mended": [mending.describe() for mending in calibration.resections],
        "notes": list(calibration.notes),
        "findings": [
            {"kind": each.kind, "cameras": list(each.cameras), "sentence": each.sentence} for each in findings
        ],
        "warnings": list(calibration_warnings(calibration, is_misfit=any(each.kind == "misfit" for each in findings))),
    }


def _sds(calibration: RigCalibration, camera: Camera) -> dict[str, float]:
    """Return the standard deviations of what was adjusted of a camera, by name."""
    names = FISHEYE_PARAMETERS if camera.lens == "fisheye" else CAMERA_PARAMETERS
    values = calibration.adjustment.camera_sd[calibration.rig.names.index(camera.name)]
    return {name: float(value) for name, value in zip(names, values, strict=True) if name and value > 0}


def _change_from_start(calibration: RigCalibration, camera: Camera) -> dict[str, float]:
    """Return how far a camera moved from the initial calibration."""
    if calibration.inputs.start_rig is None:
        return {}
    start = calibration.inputs.start_rig[camera.name]
    turn = camera.camera_from_world.rotation * start.camera_from_world.rotation.inv()
    return {
        "moved_m": float(np.linalg.norm(camera.centre - start.centre)),
        "turned_deg": math.degrees(turn.magnitude()),
    }


def describe_calibration(calibration: RigCalibration) -> str:
    """Return the same as two plain tables, with notes, findings and warnings."""
    report = calibration_to_dict(calibration)
    header = ("camera", "seen", "RMS px", "held-out px", "focal px", "sd", "place sd mm", "model")
    rows: list[tuple[str, ...]] = [header]
    for name, camera in report["cameras"].items():
        place_sd_m = _place_sd_m(camera["sd"])
        place = "held" if not place_sd_m else "open" if place_sd_m > _OPEN_SD_M else f"{1e3 * place_sd_m:.1f}"
        rows.append(
            (
                name,
                str(camera["n_observations"]),
                _format(camera["rms_px"]),
                _format(camera["held_out_rms_px"]),
                f"{camera['focal_px'][0]:.1f}",
                f"{camera['sd']['fx_px']:.1f}" if "fx_px" in camera["sd"] else "held",
                place,
                camera["lens_model"] or "",
            )
        )
    lines = _table(rows)
    rows = [("source", "seen", "RMS px", "median px", "held-out px", "left out %")]
    for name, source in report["sources"].items():
        numbers = (source["rms_px"], source["median_px"], source["held_out_rms_px"], source["left_out_percent"])
        rows.append((name, str(source["n_observations"]), *(_format(number) for number in numbers)))
    lines += ["", *_table(rows), "", f"world: {report['world']}"]
    if report["sd_is_within_the_rig"]:
        lines.append("standard deviations of places are those of the cameras among each other")
    lines += [f"wrong before: {text}" for text in report["mended"]]
    lines += [
        f"{name}: now, as written, {camera['moved_m']:.3f} m and {camera['turned_deg']:.2f} degrees from where it was "
        "thought to be"
        for name, camera in report["cameras"].items()
        if "moved_m" in camera
    ]
    lines += [f"note: {text}" for text in report["notes"]]
    lines += [f"found: {each['sentence']}" for each in report["findings"]]
    return "\n".join([*lines, *(f"warning: {text}" for text in report["warnings"])])


def _place_sd_m(sd: Mapping[str, float]) -> float:
    """Return the standard deviation of a camera's place, over all axes [m]; 0 where it is held."""
    return math.hypot(*(sd.get(key, 0.0) for key in ("x_m", "y_m", "z_m")))


def residual_distances_px(calibration: RigCalibration) -> list[Array]:
    """Return by source the distances of observations from their projections [px]."""
    return [np.linalg.norm(residual, axis=1) for residual in calibration.adjustment.residual_px]


def calibration_warnings(calibration: RigCalibration, *, is_misfit: bool) -> tuple[str, ...]:
    """Return plain sentences about what casts doubt on the calibration; is_misfit: clicked points do not fit."""
    sentences = []
    if not calibration.adjustment.has_converged:
        sentences.append("the adjustment did not come to rest: look at the residuals, a source may contradict another")
    for i, source in enumerate(calibration.adjustment.sources):
        share = _share_left_out(calibration, i)
        if share > 0.2:
            sentences.append(
                f"{share:.0%} of source '{source.name}' fit nothing: it contradicts others, is of other cameras, or "
                "has points exchanged in some of them"
            )
    are_surveyed = [source.is_surveyed for source in calibration.adjustment.sources]
    rms_px, held_out_px = calibration.adjustment.rms_px(), calibration.held_out_rms_px
    if held_out_px > _SUSPECT_RATIO * rms_px:
        sentences.append(
            f"what is left out of the fit lies {held_out_px / rms_px:.1f} times as far from its prediction as what is "
            "in it: the standard deviations, here and in the calibration file, are enlarged by it; "
            + (_MORE_POINTS if all(are_surveyed) else "record more poses, slower, in every corner")
        )
    places = [each.name for each in calibration.rig if _place_sd_m(_sds(calibration, each)) > _OPEN_SD_M]
    if places and not is_misfit:  # else a wrong point, and no lacking one, leaves them open
        found = calibration.inputs.start_rig is not None
        of_start = ": their places are those of [start], which were found with other lenses" if found else ""
        stand = f"where {', '.join(places)} stand{'s' if len(places) == 1 else ''}{of_start}"
        sentences.append(
            f"the points show {stand} to no better than {_OPEN_SD_M:g} m; {_MORE_POINTS}"
            if any(are_surveyed)
            else f"no source shows {stand}; add control points, a wand, a court or a board that several cameras see"
        )
    return tuple(sentences)


def _share_left_out(calibration: RigCalibration, i: int) -> float:
    """Return the share of a source's observations that were left out, beforehand or by their weight; 0 of none."""
    source, distances = calibration.adjustment.sources[i], residual_distances_px(calibration)[i]
    is_out = ~np.isfinite(distances) | (calibration.adjustment.weight[i] < _LEFT_OUT_WEIGHT)
    return (int(is_out.sum()) + source.n_rejected) / max(len(distances) + source.n_rejected, 1)


def _source(calibration: RigCalibration, i: int) -> dict[str, Any]:
    adjusted = calibration.adjustment
    source, distances = adjusted.sources[i], residual_distances_px(calibration)[i]
    is_used = np.isfinite(distances)
    return {
        "n_observations": int(is_used.sum()),
        "rms_px": _number(rms(distances)),
        "median_px": _number(float(np.median(distances[is_used]))) if is_used.any() else None,
        "noise_sd_px": float(np.mean(adjusted.noise_px[i] * np.asarray(source.sd_px))),
        "held_out_rms_px": _number(rms(calibration.held_out_px[source.name])),
        "left_out_percent": 100 * _share_left_out(calibration, i) if len(distances) else None,
        "rms_px_by_camera": {
            name: _number(rms(distances[source.camera == c])) for c, name in enumerate(calibration.rig.names)
        },
    }


def _pairs(calibration: RigCalibration) -> list:
    return list(zip(calibration.adjustment.residual_px, calibration.adjustment.sources, strict=True))


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
