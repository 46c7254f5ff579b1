"""The images of a finished run, read again to fit the whole run at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.body_fitting.first_frames import fit_preset
from airborne.errors import ResultError
from airborne.motion import Motion, read_estimates
from airborne.motion.flight.momentum_table import falls_freely
from airborne.motion.run_folder import MOTION
from airborne.motion.smoothing.run_fit import N_STEPS, Look, Stretch, fit_run
from airborne.motion.smoothing.segments import segment_numbers, stretches
from airborne.run.folder import require_run_of
from airborne.run.opening import open_trial
from airborne.tracking import Estimate, Status
from airborne.tracking.methods import Settings, sample_body_colours, tracker_of
from airborne.tracking.model_based.image_evidence import ImageEvidence
from airborne.tracking.time_offsets import CompensatedState, CompensatedTracker
from airborne.trial.file import Trial
from airborne.types import Progress
from airborne.video import Frames
from airborne.video.rereading import Rereading

# frames that a preset is fitted to: four synthetic somersaults of people unlike it then err by 18 to 47 % less than
# tracked, as fitted to the first frames by 5 to 20 % less
_N_OF_BODY = 13
_MOST_PASSES = (
    4 + 2 * N_STEPS
)  # over the images: to learn, for the body, to look before and after every step of two fits


def fit_to_images(
    folder: Path,
    trial: Trial,
    motion: Motion,
    model: BodyModel,
    *,
    boundaries_s: Sequence[float] = (),
    progress: Progress | None = None,
) -> tuple[Motion, BodyModel]:
    """Return a run's motion with the most probable poses, given its images and how bodies move, and the body.

    See `run_fit`. Motion is smooth between boundaries and gaps, in stretches of five frames or more; other frames stay
    as they are. So do the covariances: those of the frames one by one, which are wider. A preset that was fitted to the
    first frames is fitted again to some of the whole run, whose postures show more of it, and then the run to that
    body. Raises ResultError for a trial that is not the run's, and for a body whose joints do not move.
    """
    if trial.has_players or not motion.joints or trial.settings.fixed_shape:
        raise ResultError("only the run of a body whose joints move is fitted to its images; smooth this one without")
    require_run_of(trial, folder)
    posed = np.flatnonzero(motion.has_pose)
    is_known, segment = motion.has_pose[posed], segment_numbers(motion.time_s, boundaries_s)[posed]
    fitted = [
        Stretch(rows, falls_freely(motion, model, posed[rows]))
        for rows in stretches(motion.time_s[posed], is_known, segment, 0.0)
    ]
    images = _RunImages.read(folder, trial, model, progress=progress)
    poses = fit_run(model, [motion.pose(row) for row in posed], motion.time_s[posed], fitted, images.look)
    own = images.fit_preset(poses) if trial.body.preset is not None and not trial.key else None
    if own is not None:
        model = own
        poses = fit_run(model, poses, motion.time_s[posed], fitted, images.look_with(model))
    matrices = np.array([pose.world_from_root.as_matrix() for pose in poses])
    position, R, angles = motion.position.copy(), motion.R.copy(), motion.joint_angles.copy()
    position[posed], R[posed] = matrices[:, :3, 3], matrices[:, :3, :3]
    angles[posed] = [pose.joint_angles for pose in poses]
    return replace(motion, position=position, R=R, joint_angles=angles), model


@dataclass(slots=True, eq=False)
class _RunImages:
    """The images of the frames in which a run has poses, and what they all taught of body and background."""

    reader: Rereading
    trial: Trial
    model: BodyModel
    estimates: Sequence[Estimate]  # those with a pose
    tracker: CompensatedTracker
    learned: CompensatedState
    progress: Progress | None
    misfits: Sequence[float] = ()  # of the frames, as first seen with this body
    _n_read: int = field(default=0)

    @classmethod
    def read(cls, folder: Path, trial: Trial, model: BodyModel, *, progress: Progress | None) -> _RunImages:
        """Open a run's videos and learn from all of their frames."""
        estimates = [each for each in read_estimates(folder / MOTION) if each.pose is not None]
        start, reader = estimates[0].pose, Rereading(open_trial(trial).recording)
        assert start is not None
        model = sample_body_colours(model, start, next(reader.forward(estimates[0].index, None)))
        tracker = _tracker_of(trial, model, start)
        images = cls(reader, trial, model, estimates, tracker, tracker.init(), progress)
        for frames, estimate in zip(images._frames(), estimates, strict=True):
            images.learned = tracker.learn(images.learned, frames, estimate)
        return images

    def fit_preset(self, poses: Sequence[Pose]) -> BodyModel | None:
        """Fit the body to frames spread over the run, in these poses; None where they do not show all of it."""
        tracked = [i for i, each in enumerate(self.estimates) if each.status is Status.TRACKED]
        chosen = {tracked[i] for i in np.linspace(0, len(tracked) - 1, _N_OF_BODY).astype(int)} if tracked else set()
        pairs = zip(self._frames(), poses, strict=True)
        found = [(frames, pose) for i, (frames, pose) in enumerate(pairs) if i in chosen]
        return fit_preset(self.model, found, mass_kg=self.trial.body.mass_kg) if found else None

    def look_with(self, model: BodyModel) -> Look:
        """Return how the images look with another body, of the same colours."""
        assert self.estimates[0].pose is not None
        return replace(self, tracker=_tracker_of(self.trial, model, self.estimates[0].pose), misfits=()).look

    def look(self, poses: Sequence[Pose]) -> list[ImageEvidence]:
        """Return what the images say about poses, weighed as at the first look."""
        evidence, path = list[ImageEvidence](), []
        for i, (frames, pose) in enumerate(zip(self._frames(), poses, strict=True)):
            path.append((frames.time_s, pose))
            misfit = self.misfits[i] if self.misfits else None
            evidence.append(self.tracker.linearise(self.learned, frames, path, misfit))
        self.misfits = [each.misfit for each in evidence]
        return evidence

    def _frames(self) -> Iterator[Frames]:
        """Yield the frames of the estimates."""
        wanted = {estimate.index for estimate in self.estimates}
        for frames in self.reader.forward(min(wanted), max(wanted) + 1):
            if frames.index in wanted:
                yield frames
                self._n_read += 1
                if self.progress is not None:
                    self.progress(self._n_read, max(self._n_read, _MOST_PASSES * len(wanted)))


def _tracker_of(trial: Trial, model: BodyModel, start: Pose) -> CompensatedTracker:
    known = trial.settings
    return tracker_of(Settings(lights=known.lights, is_light_exact=known.is_light_exact), model, start)
