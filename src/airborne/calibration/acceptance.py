"""Acceptance of a calibration: one that predicts absurdly, or that we cannot read, is not written as a good one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from airborne.calibration.from_points import Calibration
from airborne.cameras import Rig, read_rig, write_pose2sim
from airborne.errors import CalibrationError
from airborne.types import Array

if TYPE_CHECKING:
    from airborne.calibration.from_sources import RigCalibration  # which takes its time to load

_ABSURD_SHARE = 0.02  # of an image's longer side: a quarter of what is left out, or one point, beyond it is no noise
_N_NAMED = 3  # outliers in a message
_FEWEST = 8  # left-out errors of a camera that can be judged


def write_accepted(
    path: Path,
    rig: Rig,
    *,
    errors_px: Mapping[str, float],
    held_out_px: Mapping[str, Array],
    residual_px: Mapping[str, Array] | None = None,
) -> tuple[Path, tuple[str, ...]]:
    """Write a rig as Pose2Sim TOML; return where, and why it was rejected: then it stands beside, under another name.

    errors_px: RMS by camera; held_out_px: by camera, distances (n,) of left-out observations from their predictions;
    residual_px: of all from the fit (n, 2), where it is one of least squares, which a single wrong point spoils.
    """
    rejected = path.with_name(f"{path.stem}.rejected{path.suffix}")
    reasons = [*_absurd_errors(rig, held_out_px), *_spoiled_fits(rig, residual_px or {})]
    write_pose2sim(rejected, rig, errors_px=errors_px)
    try:
        read_rig(rejected)
    except CalibrationError as error:
        reasons.append(f"the file cannot be read back: {error}")
    return (rejected, tuple(reasons)) if reasons else (rejected.replace(path), ())


def require_plausible(calibration: Calibration | RigCalibration) -> None:
    """Raise CalibrationError, naming points, for a calibration that `write_accepted` would reject for its errors."""
    rig, outliers = calibration.rig, list[str]()
    if isinstance(calibration, Calibration):
        held_out_px = {fit.name: np.linalg.norm(fit.held_out_px, axis=1) for fit in calibration.fits}
        residual_px = {fit.name: fit.residual_px for fit in calibration.fits}
        outliers = [finding.what for finding in calibration.findings if finding.kind == "outlier"]
    else:
        held_out_px, residual_px = {name: calibration.held_out_px_of(name) for name in rig.names}, {}
    for reason in (*_absurd_errors(rig, held_out_px), *_spoiled_fits(rig, residual_px)):
        raise CalibrationError("; ".join([reason, *outliers[:_N_NAMED]]))


def _spoiled_fits(rig: Rig, residual_px: Mapping[str, Array]) -> Iterator[str]:
    """Yield a sentence for every camera one of whose points lies absurdly far from where the fit expects it."""
    for name, residual in residual_px.items():
        camera = rig[name]
        largest, limit = float(np.nanmax(np.linalg.norm(residual, axis=1))), _ABSURD_SHARE * max(camera.size)
        if largest > limit:
            yield (
                f"{name}: a control point lies {largest:.0f} px from where the fit expects it, more than {limit:.0f} "
                "px, and spoils the fit: mend or leave out the points that miss most, of which two may be mixed up"
            )


def _absurd_errors(rig: Rig, held_out_px: Mapping[str, Array]) -> Iterator[str]:
    """Yield a sentence for every camera that predicts what was left out absurdly."""
    for camera in rig:
        distances = held_out_px[camera.name]
        distances = distances[np.isfinite(distances)]
        limit = _ABSURD_SHARE * max(camera.size)
        if len(distances) >= _FEWEST and np.quantile(distances, 0.75) > limit:
            yield (
                f"{camera.name}: what is left out of the fit lies {np.sqrt(np.mean(distances**2)):.0f} px (RMS) from "
                f"where the fit expects it, a quarter of it over {limit:.0f} px: check its points or recording, its "
                "size and its lens, and that files and columns belong to the cameras named"
            )
