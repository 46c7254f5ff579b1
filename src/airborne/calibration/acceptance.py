"""Acceptance of a calibration: one that predicts absurdly, or that we cannot read, is not written as a good one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airborne.calibration.from_points import Calibration
from airborne.cameras import Rig, read_rig, write_pose2sim
from airborne.cameras.units import check_baselines
from airborne.errors import CalibrationError
from airborne.types import Array

if TYPE_CHECKING:
    from airborne.calibration.from_sources import RigCalibration  # which takes its time to load

_ABSURD_SHARE = 0.02  # of an image's longer side: a quarter of what is left out, or one point, beyond it is no noise
_N_NAMED = 3  # outliers in a message
_FEWEST = 8  # left-out errors of a camera that can be judged


class CalibrationErrors(NamedTuple):
    """What a calibration misses, by camera."""

    rms_px: Mapping[str, float]
    held_out_px: Mapping[str, Array]  # (n,) distances of left-out observations from their predictions
    residual_px: Mapping[str, Array] = {}  # (n, 2) of a fit by least squares, which a single wrong point spoils
    points: Sequence[str] = ()  # (n,) their names

    @classmethod
    def of(cls, calibration: Calibration | RigCalibration, points: Sequence[str] = ()) -> CalibrationErrors:
        """Return those of a calibration from control points of these names, or from sources."""
        if isinstance(calibration, Calibration):
            return cls(
                rms_px={fit.name: fit.rms_px for fit in calibration.fits},
                held_out_px={fit.name: np.linalg.norm(fit.held_out_px, axis=1) for fit in calibration.fits},
                residual_px={fit.name: fit.residual_px for fit in calibration.fits},
                points=points,
            )
        names = calibration.rig.names
        return cls(
            rms_px={name: np.nan_to_num(calibration.adjustment.rms_px(camera=i)) for i, name in enumerate(names)},
            held_out_px={name: calibration.held_out_px_of(name) for name in names},
        )


def write_accepted(path: Path, rig: Rig, missed: CalibrationErrors) -> tuple[Path, tuple[str, ...]]:
    """Write a rig as Pose2Sim TOML; return where, and why it was rejected: then it has another name, beside."""
    rejected = path.with_name(f"{path.stem}.rejected{path.suffix}")
    reasons = list(_reasons(rig, missed))
    try:
        write_pose2sim(rejected, rig, errors_px=missed.rms_px)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error  # which the user knows
    if not reasons:  # else what follows follows from them
        reasons = [
            f"{finding.what}: give lengths in metres, and check that names and clicks belong together"
            for finding in check_baselines(rig)
        ]
    try:
        read_rig(rejected, unit="m")  # its distances are judged already
    except CalibrationError as error:
        reasons = reasons or [f"the file cannot be read back: {error}"]
    return (rejected, tuple(reasons)) if reasons else (rejected.replace(path), ())


def require_plausible(calibration: Calibration | RigCalibration) -> None:
    """Raise CalibrationError, naming points, for a calibration that `write_accepted` would reject for its errors."""
    found = calibration.findings if isinstance(calibration, Calibration) else ()
    outliers = [finding.what for finding in found if finding.kind == "outlier"]
    for reason in _reasons(calibration.rig, CalibrationErrors.of(calibration)):
        raise CalibrationError("; ".join([reason, *outliers[:_N_NAMED]]))


def _reasons(rig: Rig, missed: CalibrationErrors) -> Iterator[str]:
    yield from _absurd_errors(rig, missed.held_out_px)
    yield from _find_spoiled_fits(rig, missed)


def _find_spoiled_fits(rig: Rig, missed: CalibrationErrors) -> Iterator[str]:
    """Yield a sentence for every camera one of whose points lies absurdly far from where the fit expects it."""
    for name, residual in missed.residual_px.items():
        distance, limit = np.nan_to_num(np.linalg.norm(residual, axis=1)), _ABSURD_SHARE * max(rig[name].size)
        if distance.max() > limit:
            worst = [k for k in np.argsort(-distance)[:_N_NAMED] if k < len(missed.points)]
            listed = ", ".join(f"{missed.points[k]} by {distance[k]:.0f} px" for k in worst)
            yield (
                f"{name}: a control point lies {distance.max():.0f} px from where the fit expects it, more than "
                f"{limit:.0f} px, and spoils the fit: mend or leave out the points that miss most"
                f"{f' ({listed})' if listed else ''}, of which two may be mixed up"
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
