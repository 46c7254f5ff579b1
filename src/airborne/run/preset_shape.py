"""The shape of a preset, fitted to the person in some of the first frames, those where it is tracked."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

from airborne.body import BodyModel, Pose
from airborne.body_fitting.first_frames import EVERY, N_FRAMES, fit_preset
from airborne.body_fitting.landmark_places import place_landmarks
from airborne.tracking import Status
from airborne.tracking.first_pose import FirstPose
from airborne.tracking.methods import tracker_of
from airborne.tracking.tracker import track_frames
from airborne.trial.file import Trial
from airborne.video import Frames, Recording


def fit_preset_shape(
    trial: Trial, model: BodyModel, recording: Recording, start: Pose, *, first: FirstPose | None, at_first: Frames
) -> tuple[BodyModel, Pose] | None:
    """Return the fitted body and the pose that it starts from; None where nothing can be fitted.

    Its landmarks lie where the points of the `first` pose mark them in the frames `at_first`.
    """
    tracker = tracker_of(trial.settings, model, start)
    estimates = track_frames(tracker, islice(replace(recording, stop=None), N_FRAMES), lambda estimate: None)
    found = [
        (frames, estimate.pose)
        for frames, estimate in islice(estimates, 0, None, EVERY)
        if estimate.pose is not None and estimate.status is Status.TRACKED
    ]
    fitted = fit_preset(model, found, mass_kg=trial.body.mass_kg) if found else None
    if fitted is None:
        return None
    index, pose = found[0][0].index, found[0][1]
    start = pose if index == recording.start else start
    if first is not None and first.points:
        tracker = tracker_of(trial.settings, fitted, start)
        tracked = tracker.search(tracker.init(), at_first).pose
        fitted = fitted if tracked is None else place_landmarks(fitted, tracked, first.points)
    return fitted, start
