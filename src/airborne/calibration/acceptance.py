"""Acceptance of a calibration: one that predicts absurdly, or that we cannot read, is not written as a good one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from airborne.cameras import Rig, read_rig, write_pose2sim
from airborne.errors import CalibrationError
from airborne.types import Array

_ABSURD_SHARE = 0.02  # of an image's longer side: a quarter of the left-out errors beyond it are no noise
_FEWEST = 8  # left-out errors of a camera that can be judged


def write_accepted(
    path: Path, rig: Rig, *, errors_px: Mapping[str, float], held_out_px: Mapping[str, Array]
) -> tuple[Path, tuple[str, ...]]:
    """Write a rig as Pose2Sim TOML; return where, and why it was rejected: then it stands beside, under another name.

    errors_px: RMS by camera; held_out_px: by camera, distances (n,) of left-out observations from their predictions.
    """
    rejected = path.with_name(f"{path.stem}.rejected{path.suffix}")
    reasons = list(_absurd_errors(rig, held_out_px))
    write_pose2sim(rejected, rig, errors_px=errors_px)
    try:
        read_rig(rejected)
    except CalibrationError as error:
        reasons.append(f"the file cannot be read back: {error}")
    return (rejected, tuple(reasons)) if reasons else (rejected.replace(path), ())


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
