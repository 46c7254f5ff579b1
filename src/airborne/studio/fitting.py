"""A first pose fitted to the pictures of its frame, as tracking that frame alone does, and how well it fits there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.errors import ResultError, count, format_digits
from airborne.motion.rows import read_rows
from airborne.motion.run_folder import MOTION
from airborne.run.track import track_trial
from airborne.studio.disagreement import EdgeShift, edge_shifts
from airborne.studio.session import Session
from airborne.studio.starts import start_from_pose
from airborne.studio.writing import FOLDER
from airborne.tracking import Status
from airborne.trial.start import StartTable
from airborne.types import Array

_RUN = "fit"  # of one frame, in the folder of what the studio remembers


@dataclass(frozen=True, slots=True, eq=False)
class FirstPoseFit:
    """A pose that was fitted to the pictures of a frame."""

    pose: Pose
    is_sure: bool  # tracked, and not only uncertain
    place_sd_m: Array  # (3,)
    shifts: Sequence[EdgeShift]  # of the cameras that show enough of the body


def fit_to_frame(session: Session, model: BodyModel, frame: int, pose: Pose) -> FirstPoseFit:
    """Return where the trial's method finds the body from a pose in a frame. Raises AirborneError."""
    start = StartTable(**start_from_pose(model, frame, pose))
    trial = session.project().trial()
    alone = trial.model_copy(update={"start": start, "key": [], "mask": []})
    folder = session.folder / FOLDER / _RUN
    track_trial(alone, folder, overwrite=True, pictures=False, first_frame=True)
    rows = read_rows(folder / MOTION)
    row, fitted = rows.row(frame), rows.pose(frame)
    if row is None or fitted is None:
        raise ResultError("the body is not found at this pose; bring it nearer to where the pictures show it")
    cameras = session.rig().select(session.shown().names).cameras
    shifts = edge_shifts(model, {frame: fitted}, cameras, shown=session.shown(), pictures=session.pictures)
    return FirstPoseFit(fitted, str(rows.status[row]) == Status.TRACKED.value, rows.position_sd[row], shifts)


def describe_quality(fit: FirstPoseFit) -> str:
    """Say how well a pose fits: how far edges lie off its outline, in how many cameras, and how sure its place is."""
    sds_mm = ", ".join(format_digits(each, 2) for each in (1e3 * fit.place_sd_m).tolist())
    says = f"Place ± {sds_mm} mm (sd of x, y, z)."
    if not fit.shifts:
        return f"No camera shows enough of the body to tell how well it fits; look at the outlines. {says}"
    far_px = float(np.mean([each.far_px for each in fit.shifts]))
    sd_px = float(np.linalg.norm([each.sd_px for each in fit.shifts])) / len(fit.shifts)
    off = [each for each in fit.shifts if each.stands_out]
    agree = f"{len(fit.shifts) - len(off)} of {count(len(fit.shifts), 'camera')} agree"
    says = f"Edges lie {far_px:.1f} ± {sd_px:.1f} px off the outline on average; {agree}. {says}"
    if off:
        names = ", ".join(f"{each.camera} {each.far_px:.1f} px" for each in off)
        return f"Doubtful: off in {names}. {says} Drag the body onto those pictures and fit again."
    if not fit.is_sure:
        return f"{says} Some of the body is uncertain: look at its outlines before you use it."
    return says
