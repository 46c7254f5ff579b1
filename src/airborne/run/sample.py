"""Moments spread over a trial's videos, looked at small and once: what a start is found in, and mix-ups."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from airborne.run.opening import open_cameras, past_the_end_error, video_source
from airborne.tracking.first_pose.moments import spread_sample
from airborne.trial.file import Trial
from airborne.types import Progress
from airborne.video import Frames, Recording, VideoFacts, open_recording

_MOST_IMAGES = 1500  # chosen: of each camera that are looked at, half a minute at 50 a second


def look_through(trial: Trial, progress: Progress | None) -> tuple[Recording, tuple[VideoFacts, ...], list[Frames]]:
    """Open the videos and look at moments spread over them, small; raises TrialError where there are none."""
    cameras = open_cameras(trial)
    sources = [video_source(trial, camera) for camera in trial.camera]
    recording = open_recording(sources, cameras.rig, facts=cameras.facts, every=trial.track.every)
    recording, sample = look_at(trial, recording, _MOST_IMAGES, progress)
    return recording, cameras.facts, sample


def look_at(
    trial: Trial, recording: Recording, most_images: int, progress: Progress | None = None
) -> tuple[Recording, list[Frames]]:
    """Look at moments of an opened recording, small; return what of it was looked at, too.

    Images are converted only where they are used. Raises TrialError where there are none.
    """
    start = trial.start.frame
    stop = start + most_images
    if trial.track.stop is not None:
        stop = max(min(stop, trial.track.stop), start + 1)
    recording = replace(recording, start=start, stop=stop, is_lazy=True)
    sample = spread_sample(_report_each(recording, progress), recording.n_frames)
    if not sample:
        raise past_the_end_error(trial, recording)
    return recording, sample


def _report_each(recording: Recording, progress: Progress | None) -> Iterator[Frames]:
    """Yield the frames, and report how many were; after the last, that how much is left is unknown."""
    number = 0
    for number, frames in enumerate(recording, start=1):
        if progress is not None:
            progress(number, recording.n_frames)
        yield frames
    if progress is not None:
        progress(number, None)
