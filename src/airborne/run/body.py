"""A run of one body: its tracker, its tables and pictures, its summary."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.files import find_mesh_files, write_body
from airborne.calibration.from_points import Calibration
from airborne.export import headline
from airborne.export.overlays import OverlaysAs, OverlayVideos
from airborne.export.summary import is_hardly_tracked
from airborne.motion import Motion, MotionWriter, flight_summary, read_estimates, read_motion, revise_motion, sort_rows
from airborne.motion.files import copy_motion
from airborne.motion.joints import doubtful_segments
from airborne.motion.run_folder import BODY, MOTION, TRACKED_MOTION, figures_of, tables_of, videos_of
from airborne.motion.tables import write_uncertainty
from airborne.run.body_passes import BodyPasses
from airborne.run.body_tables import missing_masses, write_tables
from airborne.run.drawing import DrawingThread
from airborne.run.first_pose import find_first_pose, out_of_sight
from airborne.run.key_misses import far_keys
from airborne.run.keys import keys_of_frames
from airborne.run.moving_mix_ups import look_at_silhouettes
from airborne.run.opening import Opened
from airborne.run.self_check import check_run, widen_by_fall
from airborne.run.untracked import explain_by_silhouettes, explain_untracked
from airborne.run.wrong_colours import find_wrong_colours
from airborne.tracking import Estimate
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.first_pose import FirstPose
from airborne.tracking.methods import sample_body_colours, tracker_of
from airborne.tracking.self_check.kept_frames import KeptFrames
from airborne.trial.file import Trial
from airborne.trial.settings import BodySettings
from airborne.types import Progress
from airborne.video import Frames, Recording
from airborne.video.rereading import Rereading

if TYPE_CHECKING:
    from airborne.run.find import FoundStart
    from airborne.run.whole_run import FittedRun

_UNCERTAINTY = (
    "Standard deviations of position and orientation include image noise, light, and edges not where the drawn "
    "body has them; and what the self-check leaves open: the sizes of body and world, and the cameras' places and "
    "times. They do not include wrong lengths and girths of single segments."
)
_CALIBRATION_UNCERTAINTY = " They include a shift of each camera's whole image due to calibration."


@dataclass(frozen=True, slots=True, eq=False)
class BodyRun:
    """One body, to be tracked from its first pose; a `Subject`."""

    trial: Trial
    recording: Recording
    calibration: Calibration | None
    model: BodyModel
    start: Pose
    found: FoundStart | None = None  # where the start was looked for
    keys: Mapping[int, PoseEvidence] = field(default_factory=dict)  # of later frames, in the order of time
    first: FirstPose | None = None  # as the trial gives it
    kept: KeptFrames = field(default_factory=KeptFrames)  # grows while the run is tracked

    table = MOTION

    @classmethod
    def open(cls, trial: Trial, opened: Opened[Recording], found: FoundStart | None = None) -> BodyRun:
        """Read the body and find its first pose, whose notes become events of the recording."""
        model = trial.model()
        first = find_first_pose(trial, model, opened.recording.rig, opened.detections)
        keys, missed = keys_of_frames(trial, model, opened.recording)
        notes = [*model.notes, *([] if found is None else found.notes)]
        notes += [note for note in first.notes if note not in first.doubts]
        opened.recording.events.extend([*notes, *missed])
        return cls(trial, opened.recording, opened.calibration, model, first.pose, found, keys, first)

    @property
    def n_frames(self) -> int | None:
        """How many times to expect by the files' stated durations; None where they are unknown."""
        return replace(self.recording, start=self.trial.first_frame).n_frames

    @property
    def names(self) -> tuple[str, ...]:
        """The names that figures show."""
        return tuple(segment.name for segment in self.model.segments)

    def read_done(self, folder: Path) -> dict[int, Estimate]:
        """Return the estimates that an earlier run left: from their frames the tracker only learns."""
        return {estimate.index: estimate for estimate in read_estimates(folder / self.table)}

    def copy_inputs(self, folder: Path) -> None:
        """Write the body beside the results, for `airborne evaluate` and for other tools."""
        file = self.trial.body.file
        if file is None or find_mesh_files(self.trial.path(file)):  # meshes get names of our own, beside the body's
            write_body(folder / BODY, self.model)
        else:
            shutil.copyfile(self.trial.path(file), folder / BODY)

    def see(self, first: Frames) -> BodyRun:
        """Return the body with the colours, and a preset with the shape, that the first frames show.

        An event says where they do not show it.
        """
        notes: list[str] = []
        model = sample_body_colours(self.model, self.start, first, notes.append)
        seen = replace(self, model=model)
        if self.model.needs_colours:  # once more where the first frames show the body to be
            tracker = tracker_of(self.trial.settings, model, self.start)
            found = tracker.search(tracker.init(), first)
            if found.pose is not None:
                notes.clear()
                seen = replace(self, model=sample_body_colours(self.model, found.pose, first, notes.append))
                seen = seen._fit_shape(first)
        self.recording.events.extend(notes)
        cameras = [view.camera for view in first.views if view is not None]
        if unseen := out_of_sight(seen.model.with_pose(self.start), cameras):
            self.recording.events.append(unseen)
        return seen

    def _fit_shape(self, first: Frames) -> BodyRun:
        """Return a preset fitted to the person in the first frames.

        Keys change nothing of it, so that a run to which one is added goes on with its body; they are read anew for its
        lengths.
        """
        from airborne.run.preset_shape import fit_preset_shape

        if not self.trial.body.is_preset:
            return self
        args = self.trial, self.model, self.recording, self.start
        fitted = fit_preset_shape(*args, first=self.first, at_first=first)
        if fitted is None:
            return self
        keys = keys_of_frames(self.trial, fitted[0], self.recording)[0] if self.keys else {}
        return replace(self, model=fitted[0], start=fitted[1], keys=keys)

    def track(
        self,
        frames: Iterable[Frames],
        write: Callable[[Estimate], None],
        done: Mapping[int, Estimate],
        tick: Callable[[int], None],
    ) -> Iterator[tuple[Frames, Estimate]]:
        """Yield each time's frames with the body's estimate there, written: from the start on, then back from it."""
        yield from self._passes.track(frames, write, done, tick)
        yield from self._passes.track_earlier(write, done)

    @property
    def _passes(self) -> BodyPasses:
        return BodyPasses(self.trial, self.recording, self.model, self.start, self.keys)

    def writer(self, folder: Path, *, resume: bool) -> MotionWriter:
        """Return what writes the estimates."""
        return MotionWriter(folder / self.table, self.names[1:], resume=resume)

    def write(self, writer: MotionWriter, estimate: Estimate) -> None:
        """Write one time's estimate."""
        writer.append(estimate)

    def artists(self, folder: Path, drawn: OverlaysAs) -> Iterable[AbstractContextManager[Any]]:
        """Return what draws the frames while they are tracked; nothing where they are drawn at the end of the run."""
        return () if drawn == "videos" and self._is_drawn_at_end else self._all_artists(folder, drawn)

    def _all_artists(self, folder: Path, drawn: OverlaysAs) -> Iterator[AbstractContextManager[Any]]:
        from airborne.export.matching import MatchingPicture
        from airborne.export.sheet import ContactSheet

        recording, folder_of = self.recording, videos_of if drawn == "videos" else figures_of
        yield OverlayVideos(folder_of(folder), recording.rig, recording.rate, drawn=drawn)
        yield ContactSheet(figures_of(folder) / "through_mask.png", recording.rig)
        yield MatchingPicture(figures_of(folder) / "matching.png", recording.rig)

    def draw(
        self, artists: Sequence[Any], frames: Frames, estimate: Estimate, doubtful: NDArray[np.bool_] | None = None
    ) -> None:
        """Let the artists draw one time; a start that failed is shown where it was set.

        doubtful (segments,): None where the estimate alone says which are.
        """
        is_first = frames.index == self.trial.start.frame
        pose = self.start if is_first and estimate.pose is None else estimate.pose
        posed = None if pose is None else self.model.with_pose(pose)
        if doubtful is None and self.model.has_joints:
            (doubtful,) = doubtful_segments(Motion.collect([estimate], self.names[1:]), self.model)
        for artist in artists:
            more = (doubtful,) if isinstance(artist, OverlayVideos) else ()
            artist.write(frames, posed, estimate.status, *more)

    def keep(self, frames: Frames) -> None:
        """Keep some frames, spread over the run, for the self-check."""
        self.kept.add(frames)

    @property
    def _fits_whole_run(self) -> bool:
        settings = self.trial.track
        return isinstance(settings, BodySettings) and settings.fits_whole_run and self.model.has_joints

    @property
    def _is_drawn_at_end(self) -> bool:
        """Whether poses change at the end of the run, or frames are not tracked in the order of time."""
        return self._fits_whole_run or self.trial.first_frame < self.trial.start.frame

    def finish(
        self, folder: Path, drawn: OverlaysAs | None, progress_of: Callable[[str], Progress | None]
    ) -> tuple[Motion, dict[str, Any]]:
        """Check the run, fit it and write the tables; return the motion and the beginning of the summary."""
        sort_rows(folder / self.table)
        motion, model, rig, begun_s = read_motion(folder / self.table), self.model, self.recording.rig, time.monotonic()
        checked = check_run(motion, model, rig, self.kept, is_preset=self.trial.body.is_preset, first=self.first)
        fitted, timings_s = None, {"self_check": time.monotonic() - begun_s}
        if self._fits_whole_run:
            fitted = self._fit_whole_run(folder, checked.motion, progress_of("fitting the whole run"))
            timings_s["whole_run"] = time.monotonic() - begun_s - timings_s["self_check"]
        motion = checked.doubt_joints(checked.motion if fitted is None else fitted.motion)
        revise_motion(folder / self.table, motion)
        if checked.found is not None:
            write_uncertainty(tables_of(folder) / "uncertainty.csv", motion, checked.found.constant_at(motion.index))
        measured = write_tables(folder, motion, model)
        if measured.wrong_fall is not None:
            motion = widen_by_fall(motion, measured.wrong_fall)
            revise_motion(folder / self.table, motion)
            measured = write_tables(folder, motion, model)
        if drawn == "videos" and self._is_drawn_at_end:
            self._draw_again(folder, drawn, motion, progress_of("drawing"))
        findings = [*([measured.wrong_fall.to_dict()] if measured.wrong_fall else []), *checked.findings]
        warnings = find_wrong_colours(model, motion, self.kept)
        self.recording.events.extend([*checked.doubts, *far_keys(self.trial, model, motion, rig)])
        if is_hardly_tracked(head := headline(motion)) and not checked.is_start_wrong:
            seen = look_at_silhouettes(self.trial, self.recording) if self.found is None else self.found.silhouettes
            if (why := explain_by_silhouettes(seen)) is None:
                args = self.trial.settings, model, self.start, self.recording, progress_of("trying other videos")
                why = explain_untracked(*args)
            is_new = why.sentence not in self.recording.events and (why.is_cause or measured.wrong_fall is None)
            warnings += [why.sentence] if is_new else []
            findings = [] if why.is_mix_up else [each for each in findings if each["is_alarm"]]
        return motion, {
            "name": self.trial.name,
            **head,
            "warnings": warnings,
            **({} if measured.joint_statuses is None else {"joint_statuses": measured.joint_statuses}),
            **({} if measured.flight is None else {"flight": flight_summary(motion, measured.flight).to_dict()}),
            **({} if fitted is None else {"whole_run": fitted.surface}),
            "has_lasting_errors": motion.lasting is not None,
            "self_check": findings,
            "uncertainty": _UNCERTAINTY + (_CALIBRATION_UNCERTAINTY if rig.states_errors else ""),
            "timings_s": timings_s,
        }

    def _fit_whole_run(self, folder: Path, motion: Motion, progress: Progress | None) -> FittedRun | None:
        """Fit the whole run; what the tracker found stays beside it, for a run that is resumed and for a comparison."""
        from airborne.run.whole_run import fit_whole_run

        estimates, reader = read_estimates(folder / self.table), Rereading(self.recording)
        args = reader, self.trial.settings, self.model, motion, estimates
        fitted = fit_whole_run(*args, keys=self.keys, is_joined=self._passes.is_joined, progress=progress)
        if fitted is not None:
            tables_of(folder)
            copy_motion(folder / self.table, folder / TRACKED_MOTION)
        return fitted

    def _draw_again(self, folder: Path, drawn: OverlaysAs, motion: Motion, progress: Progress | None) -> None:
        """Draw every time with the estimate that the run ended with."""
        estimates = {estimate.index: estimate for estimate in read_estimates(folder / self.table)}
        doubtful = dict(zip(motion.index.tolist(), doubtful_segments(motion, self.model), strict=True))
        with ExitStack() as stack:
            artists = [stack.enter_context(artist) for artist in self._all_artists(folder, drawn)]
            drawing = stack.enter_context(DrawingThread(partial(self.draw, artists)))
            for frames in Rereading(self.recording).forward(min(estimates), max(estimates) + 1):
                if frames.index in estimates:
                    drawing.put(frames, estimates[frames.index], doubtful[frames.index])
                if progress is not None:
                    progress(frames.index - min(estimates) + 1, max(estimates) - min(estimates) + 1)

    def write_report(self, folder: Path, summary: dict[str, Any], motion: Motion) -> None:
        """Draw the figures and write the report."""
        from airborne.export.figures import write_figures
        from airborne.export.report import write_report
        from airborne.export.viewer import body_viewer

        write_figures(figures_of(folder), motion, self.model)
        if self.found is not None:
            self.found.draw(folder)
        write_report(folder, summary, body_viewer(folder, motion, self.model))

    def warnings(self) -> list[str]:
        """Return what a reader of the numbers must know beside the uncertainty."""
        doubts = [] if self.first is None else [*self.first.doubts, *self.first.mistakes]
        return [*doubts, *self.trial.body.doubts(self.model), *missing_masses(self.model)]
