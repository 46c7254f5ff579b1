"""One picture of a trial as its file holds it, to click in."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from airborne.cameras import Rig
from airborne.errors import TrialError
from airborne.run.opening import open_cameras, video_source
from airborne.trial.file import Trial
from airborne.types import Size
from airborne.video import open_recording


def write_frame(trial: Trial, camera: str, frame: int, path: Path) -> Size:
    """Write what a camera shows at a frame, or field, of the trial's clock; return its size (width, height) [px].

    Pixels are those of the video: the lens is not undone, and a field has the rows of the whole frame, the missing ones
    between its own. Raises TrialError for a camera or frame that is not there, or a picture that cannot be written.
    """
    names = [table.name for table in trial.camera]
    if camera not in names:
        raise TrialError(f"{trial.name}: no camera '{camera}'; it has: {', '.join(names)}")
    cameras = open_cameras(trial)
    recording = open_recording(
        [video_source(trial, table) for table in trial.camera],
        Rig(tuple(each.without_distortion() for each in cameras.rig)),
        facts=cameras.facts,
        fields_as="interpolated",
        start=frame,
        stop=frame + 1,
    )
    frames = next(iter(recording), None)
    view = None if frames is None else frames.views[names.index(camera)]
    if view is None:
        raise TrialError(f"{trial.name}: {camera} has no image at frame {frame}{_last(recording.n_images)}")
    try:
        is_written = cv2.imwrite(str(path), np.ascontiguousarray(view.rgb[..., ::-1]))
    except cv2.error:
        is_written = False
    if not is_written:
        raise TrialError(f"{path}: cannot be written; give a file in an existing folder that ends in .png")
    return view.camera.size


def _last(n_images: int | None) -> str:
    return "; give an earlier frame" if n_images is None else f"; frames are 0 to {n_images - 1}"
