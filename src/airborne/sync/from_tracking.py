"""Offsets of a trial's cameras as unknowns of the tracking: each camera against the body tracked by all of them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from airborne.body import Pose
from airborne.body.chain import delta_between, move_pose
from airborne.errors import TrialError
from airborne.run.first_pose import find_first_pose
from airborne.run.opening import open_trial, past_the_end_error
from airborne.sync import Offsets, image_counter
from airborne.sync.camera_equations import root_equations, share_equations
from airborne.sync.lags import LEAST_MOMENTS, CameraLags, find_lags
from airborne.sync.mixed_frames import Blend, blend_of
from airborne.sync.offsets import with_offsets
from airborne.tracking import Status
from airborne.tracking.camera_lags import LagEquations
from airborne.tracking.methods import sample_body_colours
from airborne.tracking.model_based.refined import RefinedState, RefinedTracker
from airborne.tracking.self_check.check import gather_equations
from airborne.tracking.self_check.kept_frames import KeptFrames
from airborne.tracking.self_check.nuisances import MEASURED_SD
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.times import camera_times
from airborne.tracking.time_offsets import CompensatedState, CompensatedTracker, compensate_offsets
from airborne.trial.file import Trial
from airborne.types import Array, Progress
from airborne.video import Frames

_MOST_PASSES = 4  # over the recording, with silhouettes
_CONVERGED_SDS = 0.15  # a step of theirs below this share of its sd ends the iteration
_MOMENTS_PER_PERIOD = np.arange(-3, 4) / 2  # that an image may show [its period]


def offsets_by_tracking(
    trial: Trial, start_s: Array, *, with_drift: bool = False, progress: Progress | None = None
) -> Offsets:
    """Find the offsets at which every camera's images agree with the body as all cameras together track it.

    The recording is tracked several times, from offsets start_s (c,) [s]. A camera whose images blend two moments is
    excluded from the tracking; its offset is that of the mean moment shown. Raises TrialError where the body is tracked
    too rarely.
    """
    method = {"track": trial.track.model_copy(update={"method": "refined"})}
    measure = _Measure(_with_offsets(trial.model_copy(update=method), start_s), start_s, image_counter(progress))
    start = start_s - start_s[0]
    lags = None if with_drift else _lags_by_silhouettes(measure, start)
    if lags is None:
        lags = find_lags(measure, start, with_drift=with_drift)
    names, notes = tuple(camera.name for camera in trial.camera), []
    about = np.where(np.isfinite(lags.lag_s), lags.lag_s, start)
    if mixed := [i for i, blend in enumerate(measure.blends(about, range(len(names)))) if blend.is_mixed]:
        listed = ", ".join(names[i] for i in mixed)
        if len(mixed) == len(names):
            notes = [f"{listed}: the images are mixed from two moments, so the offsets may be off by half an image"]
        else:
            lags = _lags_beside_mixed(measure, lags, mixed, start=start, with_drift=with_drift)
            notes = [f"{listed}: the images are mixed from two moments; the offset is that of their mean"]
    how = "by tracking: every camera's images against the body as all of them see it"
    return lags.to_offsets(names, float(start_s[0]), who="the tracked body", how=how, notes=notes)


def _lags_by_silhouettes(measure: _Measure, lag_s: Array) -> CameraLags | None:
    """Find the lags from where each view shows the body of the run; None for a person, and where scenes are hidden."""
    zeros, sd_s = np.zeros_like(lag_s), np.zeros_like(lag_s)
    for _ in range(_MOST_PASSES):
        measure(lag_s, zeros)
        found = measure.camera_times()
        if found is None:
            return None
        step, sd_s = found
        lag_s = lag_s + step
        if np.all(np.abs(step) <= _CONVERGED_SDS * sd_s):
            break
    return CameraLags(lag_s, sd_s, zeros, zeros)


def _lags_beside_mixed(
    measure: _Measure, first: CameraLags, mixed: Sequence[int], *, start: Array, with_drift: bool
) -> CameraLags:
    """Find the lags again: of the clear cameras by tracking with them alone, of the mixed ones by what they show."""
    measure.excluded = frozenset(mixed)
    lags = find_lags(measure, start, with_drift=with_drift)
    lag_s, sd_s = lags.lag_s.copy(), lags.sd_s.copy()
    about = np.where(np.isfinite(lag_s), lag_s, first.lag_s)
    for i, blend in zip(mixed, measure.blends(about, mixed), strict=True):
        lag_s[i], sd_s[i] = about[i] + blend.centre_s, blend.sd_s
    drift, drift_sd = (np.nan_to_num(each) for each in (lags.drift, lags.drift_sd))
    sd_s[1:] = np.hypot(sd_s[1:], sd_s[0])
    return CameraLags(lag_s - lag_s[0], np.concatenate([[0.0], sd_s[1:]]), drift, drift_sd)


@dataclass(frozen=True, slots=True, eq=False)
class _TrackedPath:
    """A recording tracked from end to end."""

    refined: RefinedTracker
    state: CompensatedState  # after the last frame
    time_s: list[float]  # (n,) of the frames tracked
    poses: list[Pose]
    equations: list[dict[str, tuple[Array, Array]]]
    index: list[int] = field(default_factory=list)  # (n,) frame numbers
    kept: KeptFrames = field(default_factory=KeptFrames)

    def pose_at(self, time_s: float, within_s: float) -> Pose | None:
        """Interpolate the pose between two tracked ones, if these are no more than within_s apart."""
        k = bisect_right(self.time_s, time_s)
        if not 0 < k < len(self.time_s) or self.time_s[k] - self.time_s[k - 1] > within_s:
            return None
        share = (time_s - self.time_s[k - 1]) / (self.time_s[k] - self.time_s[k - 1])
        return move_pose(self.poses[k - 1], share * delta_between(self.poses[k - 1], self.poses[k]))


class _Measure:
    """Measures the lags left in a recording by tracking it with given offsets."""

    def __init__(self, trial: Trial, start_s: Array, on_image: Callable[[], None]) -> None:
        self._trial, self._start_s, self._on_image = trial, start_s, on_image
        opened = open_trial(trial)
        self._recording = opened.recording
        self._start = find_first_pose(trial, trial.model(), opened.recording.rig, opened.detections).pose
        self._last: _TrackedPath | None = None
        self._appearance_state: RefinedState | None = None  # of the last pass with all cameras
        self.excluded: Collection[int] = ()  # cameras left out of the tracking

    def __call__(self, lag_s: Array, drift: Array) -> LagEquations:
        """Track with these lags (c,) and drifts (c,); return each camera's own normal equations."""
        recording = with_offsets(self._recording, self._start_s[0] + np.nan_to_num(lag_s), np.nan_to_num(drift))
        self._last = self._track(_without(frames, self.excluded) for frames in recording)
        if not self.excluded:
            self._appearance_state = self._last.state.inner
        return _lag_equations(self._last, recording.rig.names)

    def blends(self, lag_s: Array, cameras: Collection[int]) -> list[Blend]:
        """Estimate which moments the images of some cameras show, along the path tracked last."""
        assert self._last is not None and self._appearance_state is not None
        last = self._last
        recording = with_offsets(self._recording, self._start_s[0] + lag_s, np.zeros_like(lag_s))
        moments_s = {i: _MOMENTS_PER_PERIOD / float(recording.facts[i].image_rate) for i in cameras}
        gap_s = 2.5 / float(recording.rate)
        systems: dict[int, list[tuple[Array, Array]]] = {i: [] for i in cameras}
        for frames in recording:
            for i in cameras:
                view = frames.views[i]
                if view is not None:
                    at = [last.pose_at(float(frames.time_s) + view.delay_s + s, gap_s) for s in moments_s[i]]
                    poses = [pose for pose in at if pose is not None]
                    if len(poses) == len(at) and (
                        each := share_equations(last.refined, self._appearance_state, view, poses)
                    ):
                        systems[i].append(each)
            self._on_image()
        return [
            blend_of(moments_s[i], np.array([A for A, _ in systems[i]]), np.array([b for _, b in systems[i]]))
            for i in cameras
        ]

    def camera_times(self) -> tuple[Array, Array] | None:
        """Return how late the cameras of the last tracking still are, by silhouettes, and sds (c,) [s]."""
        last, rig = self._last, self._recording.rig
        assert last is not None
        model = last.refined.render_model.model
        if model.has_joints:
            return None
        n = len(last.poses)
        path = TrackedPath(np.array(last.index), np.array(last.time_s), last.poses, np.zeros((n, 6, 6)))
        run = gather_equations(model, rig, path, list(last.kept), body_sd=MEASURED_SD)
        return None if run is None else camera_times(run, rig)

    def _track(self, recording: Iterable[Frames]) -> _TrackedPath:
        trial, model = self._trial, self._trial.model()
        settings, tracked = trial.settings, None
        for frames in recording:
            if tracked is None:
                model = sample_body_colours(model, self._start, frames)
                refined = RefinedTracker(
                    model, self._start, prediction=settings.prediction, fixed_shape=settings.fixed_shape
                )
                tracker = CompensatedTracker(refined)
                tracked = _TrackedPath(refined, tracker.init(), [], [], [])
            tracked.kept.add(frames)
            estimate = tracker.search(tracked.state, frames)
            tracked = replace(tracked, state=tracker.learn(tracked.state, frames, estimate))
            if estimate.status is Status.TRACKED and estimate.pose is not None:
                state = tracked.state
                tracked.index.append(frames.index)
                tracked.time_s.append(float(frames.time_s))
                tracked.poses.append(estimate.pose)
                compensated = compensate_offsets(frames, state.past)
                tracked.equations.append(root_equations(refined, state.inner, compensated, estimate.pose))
            self._on_image()
        if tracked is None:
            raise past_the_end_error(trial, self._recording)
        if len(tracked.poses) < LEAST_MOMENTS:
            raise TrialError(
                f"{trial.name}: the body was tracked at {len(tracked.poses)} moments; the lags need at least "
                f"{LEAST_MOMENTS}; check [start], or synchronise by motion, flash or sound first"
            )
        return tracked


def _with_offsets(trial: Trial, offset_s: Array) -> Trial:
    """Return a trial whose cameras have these offsets (c,) [s] and no drift."""
    pairs = zip(trial.camera, offset_s, strict=True)
    cameras = [camera.model_copy(update={"offset_s": float(s), "drift_ppm": 0.0}) for camera, s in pairs]
    return trial.model_copy(update={"camera": cameras})


def _without(frames: Frames, excluded: Collection[int]) -> Frames:
    views = tuple(None if i in excluded else view for i, view in enumerate(frames.views))
    return replace(frames, views=views) if excluded else frames


def _lag_equations(tracked: _TrackedPath, names: Sequence[str]) -> LagEquations:
    """Stack the equations as arrays; the first and last moment only give the velocity of their neighbours."""
    time_s, poses = np.array(tracked.time_s), tracked.poses
    n, c = len(time_s) - 2, len(names)
    information, gradient = np.zeros((n, c, 6, 6)), np.zeros((n, c, 6))
    for k, systems in enumerate(tracked.equations[1:-1]):
        for i, name in enumerate(names):
            if name in systems:
                information[k, i], gradient[k, i] = systems[name]
    deltas = [delta_between(before, after)[:6] for before, after in zip(poses[:-2], poses[2:], strict=True)]
    velocity = np.stack(deltas) / (time_s[2:] - time_s[:-2])[:, None]
    return LagEquations(time_s[1:-1], velocity, information, gradient)
