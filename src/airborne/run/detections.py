"""A trial's 2D detections, read once, at the times of its cameras; cameras that moved, resected by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.initial.resection import (
    find_exchanged_detections,
    find_misplaced_cameras,
    resect_cameras,
)
from airborne.cameras import Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.detections import Detections, landmarks_from_points, read_detections
from airborne.errors import MistakesError
from airborne.tracking.first_pose import LEAST_VISIBILITY
from airborne.trial.cameras import CameraTable
from airborne.trial.file import Trial
from airborne.trial.pose_forms import PoseForms
from airborne.types import Array
from airborne.video import VideoFacts


@dataclass(frozen=True, slots=True, eq=False)
class TrialDetections:
    """The detections of a trial's cameras, and what it takes to match them in time."""

    frames: Detections  # of each camera's own frames
    cameras: tuple[CameraTable, ...]
    facts: tuple[VideoFacts, ...]

    def at_image(self, index: int) -> Detections:
        """Return the detections at one image of the first camera, a frame or a field: one row."""
        return self.frames.at(self._frames_at(np.array([index]), float(self.facts[0].image_rate)))

    def synchronous(self) -> Detections:
        """Return the detections at common times, one row for each frame of the first camera."""
        return self.frames.at(self._frames_at(np.arange(len(self.frames.px)), float(self.facts[0].frame_rate)))

    def _frames_at(self, index: NDArray[np.integer], rate_hz: float) -> NDArray[np.int64]:
        """Return every camera's frame nearest in time (n, cameras) to the first camera's images (n,) at this rate."""
        first = self.cameras[0]
        time_s = first.offset_s + index / rate_hz * (1 + first.drift_ppm / 1e6)
        columns = [
            (time_s - camera.offset_s) / (1 + camera.drift_ppm / 1e6) * float(fact.frame_rate)
            for camera, fact in zip(self.cameras, self.facts, strict=True)
        ]
        # a field at a half belongs to its frame
        return np.floor(np.stack(columns, axis=1) + 0.5 - 1e-6).astype(np.int64)


def read_trial_detections(trial: Trial, facts: Sequence[VideoFacts]) -> TrialDetections | None:
    """Read the trial's detections; None where its start has none. `facts` are of its videos."""
    return read_forms_detections(trial, trial.start, facts)


def read_forms_detections(trial: Trial, forms: PoseForms, facts: Sequence[VideoFacts]) -> TrialDetections | None:
    """Read the detections of a start or a key; None where it has none."""
    if forms.detections is None:
        return None
    names = [camera.name for camera in trial.camera]
    frames = read_detections(trial.path(forms.detections), names, forms.detections_cameras, skeleton=forms.skeleton)
    return TrialDetections(frames, tuple(trial.camera), tuple(facts))


def resect_moved_cameras(rig: Rig, detections: TrialDetections, moved: Sequence[str]) -> tuple[Rig, tuple[str, ...]]:
    """Resect the cameras named as moved; the notes say what changed, and which others disagree.

    Raises CalibrationError where a camera cannot be resected, and MistakesError where two cameras' are exchanged.
    """
    synchronous = detections.synchronous()
    if (exchanged := find_exchanged_detections(rig, synchronous)) is not None:
        raise MistakesError("the detections", [exchanged.sentence])
    notes = []
    if moved:
        rig, done = resect_cameras(rig, synchronous, moved)
        notes += [mending.describe() for mending in done]
    notes += [
        f"{each.camera.name} disagrees with the other cameras: half of its detections lie over "
        f"{each.before_px:.0f} px from where the others see the points; if it moved after the calibration, give "
        f'mend = ["{each.camera.name}"] under [calibration]'
        for each in find_misplaced_cameras(rig, synchronous)
    ]
    return rig, tuple(notes)


def landmarks_over_time(rig: Rig, detections: TrialDetections) -> dict[str, Array]:
    """Triangulate detections at every frame of the first camera: point or landmark -> (frames, 3) [m].

    NaN where fewer than two cameras agree.
    """
    confident = detections.synchronous().above_visibility(LEAST_VISIBILITY)
    return landmarks_from_points(
        confident.points, triangulate_consensus(rig, confident.px, confident.visibility).points
    )
