"""The passes of one body's run: on from the start, both ways between keys, and back from the start."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from airborne.body import BodyModel, Pose
from airborne.tracking import Estimate
from airborne.tracking.backward import Tracked, Write, track_back
from airborne.tracking.both_directions import track_between_keys, track_forward_backward
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.methods import tracker_of
from airborne.tracking.tracker import track_frames
from airborne.trial.file import Trial
from airborne.video import Frames, Recording
from airborne.video.rereading import Rereading


@dataclass(frozen=True, slots=True, eq=False)
class BodyPasses:
    """What is tracked, and from where."""

    trial: Trial
    recording: Recording
    model: BodyModel
    start: Pose
    keys: Mapping[int, PoseEvidence]  # of later frames, in the order of time

    @property
    def is_joined(self) -> bool:
        """Whether a limb lies where the images of the whole run are likelier, of both directions."""
        return self.trial.directions == "both" and not self.keys

    def track(
        self, frames: Iterable[Frames], write: Write, done: Mapping[int, Estimate], tick: Callable[[int], None]
    ) -> Tracked:
        """Yield each time's frames with the body's estimate there, written; between keys it is tracked both ways.

        So is a body with limbs that has no keys, wherever one of them is in doubt. `tick`: as a `Subject` takes it.
        """
        if not self.keys or self.trial.directions == "forward":
            return self._track(frames, write, done, tick)
        recording = self.recording
        frames_to_track = range(recording.start, max(self.keys) + 1, recording.every)
        tracker = tracker_of(self.trial.settings, self.model, self.start, self.keys)
        args = tracker, self.model, Rereading(recording), frames_to_track
        return track_between_keys(*args, keys=list(self.keys), write=write, done=done, tick=tick)

    def track_earlier(self, write: Write, done: Mapping[int, Estimate]) -> Tracked:
        """Yield the frames before the start that are to be tracked, the last one first."""
        first, start = self.trial.first_frame, self.recording.start
        if first == start:
            return iter(())
        frames = Rereading(self.recording).backward(first, start + 1)
        return track_back(self._track, frames, start, write=write, done=done)

    def _track(
        self,
        frames: Iterable[Frames],
        write: Write,
        done: Mapping[int, Estimate],
        tick: Callable[[int], None] = lambda n_done: None,
    ) -> Tracked:
        tracker = tracker_of(self.trial.settings, self.model, self.start, self.keys)
        if self.trial.directions == "both" and tracker.moves_joints:
            return track_forward_backward(tracker, self.model, frames, write=write, done=done, tick=tick)
        return track_frames(tracker, frames, write, done)
