"""The images of a finished run, read again to fit the whole run at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.body_fitting.skin import N_FRAMES, fit_skin
from airborne.errors import ResultError
from airborne.motion import Motion, read_estimates
from airborne.motion.flight.momentum_table import falls_freely
from airborne.motion.run_folder import MOTION
from airborne.motion.smoothing.run_fit import N_STEPS, Stretch, fit_run
from airborne.motion.smoothing.segments import segment_numbers, stretches
from airborne.run.folder import require_run_of
from airborne.run.opening import open_trial
from airborne.tracking import Estimate, Status
from airborne.tracking.methods import Settings, sample_body_colours, tracker_of
from airborne.tracking.model_based.image_evidence import ImageEvidence
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.time_offsets import CompensatedState, CompensatedTracker
from airborne.trial.file import Trial
from airborne.types import Progress
from airborne.video import Frames
from airborne.video.rereading import Rereading


def fit_to_images(
    folder: Path,
    trial: Trial,
    motion: Motion,
    model: BodyModel,
    *,
    boundaries_s: Sequence[float] = (),
    progress: Progress | None = None,
) -> tuple[Motion, str]:
    """Return a run's motion with the most probable poses, given its images and how bodies move, and how; see `run_fit`.

    Motion is smooth between boundaries and gaps, in stretches of five frames or more; other frames stay as they are.
    So do the covariances: those of the frames one by one, which are wider. Raises ResultError for a trial that is not
    the run's, and for a body whose joints do not move.
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
    matrices = np.array([pose.world_from_root.as_matrix() for pose in poses])
    position, R, angles = motion.position.copy(), motion.R.copy(), motion.joint_angles.copy()
    position[posed], R[posed] = matrices[:, :3, 3], matrices[:, :3, :3]
    angles[posed] = [pose.joint_angles for pose in poses]
    surface = "the body's surface" if images.skin is None else "a smooth skin, its girths fitted to them"
    how = f"the whole run was fitted at once to its images by {surface}, with smooth accelerations and free falls"
    return replace(motion, position=position, R=R, joint_angles=angles), how


@dataclass(slots=True, eq=False)
class _RunImages:
    """The images of the frames in which a run has poses, and what they all taught of body and background."""

    reader: Rereading
    tracker: CompensatedTracker
    estimates: Sequence[Estimate]  # those with a pose
    progress: Progress | None
    learned: CompensatedState
    skin: RenderModel | None = None  # which is compared with the images instead of the body's ellipsoids
    misfits: Sequence[float] = ()  # of the frames, as first seen
    _n_read: int = field(default=0)

    @classmethod
    def read(cls, folder: Path, trial: Trial, model: BodyModel, *, progress: Progress | None) -> _RunImages:
        """Open a run's videos and learn from all of their frames."""
        estimates = [each for each in read_estimates(folder / MOTION) if each.pose is not None]
        start, known, reader = estimates[0].pose, trial.settings, Rereading(open_trial(trial).recording)
        assert start is not None
        model = sample_body_colours(model, start, next(reader.forward(estimates[0].index, None)))
        settings = Settings(lights=known.lights, is_light_exact=known.is_light_exact)
        tracker = tracker_of(settings, model, start)
        images = cls(reader, tracker, estimates, progress, tracker.init())
        tracked = [each.index for each in estimates if each.status is Status.TRACKED]
        fitted = {tracked[k] for k in np.linspace(0, len(tracked) - 1, N_FRAMES).astype(int)} if tracked else set()
        found = list[tuple[Frames, Pose]]()
        for frames, estimate in zip(images._frames(), estimates, strict=True):
            images.learned = tracker.learn(images.learned, frames, estimate)
            if estimate.index in fitted and estimate.pose is not None:
                found.append((frames, estimate.pose))
        skin = fit_skin(model, found)
        images.skin = None if skin is None else RenderModel.of(skin, settings.exact_lights)
        return images

    def look(self, poses: Sequence[Pose]) -> list[ImageEvidence]:
        """Return what the images say about poses, weighed as at the first look."""
        evidence, path = list[ImageEvidence](), []
        for i, (frames, pose) in enumerate(zip(self._frames(), poses, strict=True)):
            path.append((frames.time_s, pose))
            misfit = self.misfits[i] if self.misfits else None
            evidence.append(self.tracker.linearise(self.learned, frames, path, misfit, surface=self.skin))
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
                    self.progress(self._n_read, max(self._n_read, (2 + N_STEPS) * len(wanted)))
