"""What a result depends on, as every summary ends: warnings, events, method, cameras, versions, inputs."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Any

from airborne import __version__
from airborne.calibration.from_points import Calibration
from airborne.trial.file import Trial
from airborne.video import LiveRecording, Recording

_EXACT_CALIBRATION = "the calibration comes from a file that does not say how good it is; "
_OF_A_BODY = "the standard deviations of poses count with usual errors: 0.1°, 10 mm and 0.5 % of the focal length"
_OF_PLAYERS = "the standard deviations of joints leave its errors out"


def provenance_of(
    trial: Trial, recording: Recording | LiveRecording, calibration: Calibration | None, inputs: dict[str, str]
) -> dict[str, Any]:
    """Return the end of every summary: warnings, events, method, cameras, versions, inputs."""
    exact = _EXACT_CALIBRATION + (_OF_PLAYERS if trial.has_players else _OF_A_BODY)
    says_enough = recording.rig.states_errors and not trial.has_players
    fits = {} if calibration is None else {fit.name: fit for fit in calibration.fits}
    cameras = [
        {
            "name": camera.name,
            "position_m": [round(float(x), 4) for x in camera.centre],
            "focal_px": round(float(camera.K[0, 0]), 2),
            "calibration_rms_px": fits[camera.name].rms_px if camera.name in fits else None,
            "held_out_rms_mm": fits[camera.name].held_out_m * 1e3 if camera.name in fits else None,
        }
        for camera in recording.rig
    ]
    return {
        "warnings": list(calibration.warnings) if calibration else [] if says_enough else [exact],
        "events": recording.events,
        "method": trial.track.model_dump(),
        "cameras": cameras,
        "versions": versions(),
        "inputs": inputs,
    }


def versions() -> dict[str, str]:
    """Return the versions of everything that a result may depend on."""
    packages = ("numpy", "scipy", "numba", "av", "opencv-python-headless")
    return {"airborne": __version__, "python": platform.python_version(), **{name: version(name) for name in packages}}
