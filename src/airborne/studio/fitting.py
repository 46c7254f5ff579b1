"""A first pose fitted to the pictures of its frame, as tracking that frame alone does."""

from __future__ import annotations

from airborne.body import BodyModel, Pose
from airborne.errors import ResultError
from airborne.motion.rows import read_rows
from airborne.motion.run_folder import MOTION
from airborne.run.track import track_trial
from airborne.studio.session import Session
from airborne.studio.starts import start_from_pose
from airborne.studio.writing import FOLDER
from airborne.trial.start import StartTable

_RUN = "fit"  # of one frame, in the folder of what the studio remembers


def fit_to_frame(session: Session, model: BodyModel, frame: int, pose: Pose) -> Pose:
    """Return the pose at which the trial's method finds the body from a pose in a frame. Raises AirborneError."""
    start = StartTable(**start_from_pose(model, frame, pose))
    trial = session.project().trial()
    alone = trial.model_copy(update={"start": start, "key": [], "mask": []})
    folder = session.folder / FOLDER / _RUN
    track_trial(alone, folder, overwrite=True, pictures=False, first_frame=True)
    fitted = read_rows(folder / MOTION).pose(frame)
    if fitted is None:
        raise ResultError("the body is not found at this pose; bring it nearer to where the pictures show it")
    return fitted
