"""The self-check of a run of one body: lasting errors for its motion, findings for its summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from airborne.body import BodyModel
from airborne.calibration.from_points import Calibration
from airborne.cameras import Rig
from airborne.motion import Motion
from airborne.motion.tables import write_uncertainty
from airborne.tracking.self_check.check import SelfCheck, TrackedPath, self_check
from airborne.tracking.self_check.kept_frames import KeptFrames
from airborne.tracking.self_check.nuisances import MEASURED_SD, PRESET_SD


def check_run(
    motion: Motion, model: BodyModel, rig: Rig, kept: KeptFrames, calibration: Calibration | None, *, is_preset: bool
) -> tuple[Motion, SelfCheck | None]:
    """Check a finished run; return its motion with the lasting errors, and what was found, None where too little."""
    rows = np.flatnonzero(motion.has_pose)
    path = TrackedPath(motion.index[rows], motion.time_s[rows], [motion.pose(row) for row in rows])
    calibrated = {} if calibration is None else {fit.name: fit.covariance for fit in calibration.fits}
    found = self_check(
        model, rig, path, list(kept), calibrated=calibrated, body_sd=PRESET_SD if is_preset else MEASURED_SD
    )
    return (motion, None) if found is None else (replace(motion, lasting=found.lasting_at(motion.index)), found)


def describe(found: SelfCheck | None) -> list[dict[str, Any]]:
    """Return what summary.json holds of a self-check."""
    return [] if found is None else [finding.to_dict() for finding in found.diagnosis.findings]


def alarms(findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the sentences of what is wrong."""
    return [f"self-check: {finding['sentence']}" for finding in findings if finding["is_alarm"]]


def write_split(path: Path, motion: Motion, found: SelfCheck | None) -> None:
    """Write how the sds are made of lasting errors and those of each frame."""
    if found is not None:
        write_uncertainty(path, motion, found.constant_at(motion.index))
