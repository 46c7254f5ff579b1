"""Offsets of a trial's cameras as unknowns of the tracking: every camera against the body as all of them see it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose
from airborne.body.chain import motion_between, moved_pose
from airborne.errors import TrialError
from airborne.run.first_pose import first_pose
from airborne.run.opening import open_trial, past_the_end
from airborne.sync import Offsets, counting
from airborne.sync.lags import Lags, Sightings, find_lags
from airborne.tracking import Status
from airborne.tracking.methods import sampled
from airborne.tracking.model_based.mixed_frames import Blend, blend_of
from airborne.tracking.model_based.refined import Refined, RefinedState
from airborne.tracking.time_offsets import InTime, InTimeState, in_time
from airborne.trial.file import Trial
from airborne.video import Frames, Recording

Array = NDArray[np.floating]
Progress = Callable[[int, int | None], None]

_FEWEST = 8  # moments at which the body must be tracked to tell lags
_MOMENTS = np.arange(-3, 4) / 2  # that may be in a picture [its period]


def offsets_by_tracking(
    trial: Trial, start_s: Array, *, with_drift: bool = False, progress: Progress | None = None
) -> Offsets:
    """Find the offsets at which every camera's pictures agree with the body as all cameras together track it.

    The recording is tracked some times over, from offsets start_s (c,) [s]. A camera whose pictures are mixed from two
    moments is left out of the tracking; its offset is that of what its pictures show on the mean. Raises TrialError for
    players, and where the body is not tracked often enough.
    """
    if trial.has_players:
        raise TrialError("tracking tells the lags of one body's cameras; of players use motion, flash or sound")
    method = {"track": trial.track.model_copy(update={"method": "refined"})}
    looks = _Looks(_with_offsets(trial.model_copy(update=method), start_s), start_s, counting(progress))
    start = start_s - start_s[0]
    lags = find_lags(looks, start, with_drift=with_drift)
    names, notes = tuple(camera.name for camera in trial.camera), []
    about = np.where(np.isfinite(lags.lag_s), lags.lag_s, start)
    if mixed := [i for i, blend in enumerate(looks.blends(about, range(len(names)))) if blend.is_mixed]:
        listed = ", ".join(names[i] for i in mixed)
        if len(mixed) == len(names):
            notes = [f"{listed}: the pictures are mixed from two moments, so the offsets may be off by half a picture"]
        else:
            lags = _beside_mixed(looks, lags, mixed, start, with_drift=with_drift)
            notes = [f"{listed}: the pictures are mixed from two moments; the offset is that of their mean"]
    unknown = [name for name, lag_s in zip(names, lags.lag_s, strict=True) if not np.isfinite(lag_s)]
    if unknown:
        raise TrialError(f"{', '.join(unknown)}: never sees the tracked body move; synchronise by flash or sound")
    how = "by tracking: every camera's pictures against the body as all of them see it"
    return Offsets(names, start_s[0] + lags.lag_s, lags.sd_s, lags.drift, lags.drift_sd, how=how, notes=tuple(notes))


def _beside_mixed(looks: _Looks, found: Lags, mixed: Sequence[int], start: Array, *, with_drift: bool) -> Lags:
    """Find the lags anew: of the clear cameras by tracking with them alone, of the mixed ones by what they show."""
    looks.hidden = frozenset(mixed)
    lags = find_lags(looks, start, with_drift=with_drift)
    lag_s, sd_s = lags.lag_s.copy(), lags.sd_s.copy()
    about = np.where(np.isfinite(lag_s), lag_s, found.lag_s)
    for i, blend in zip(mixed, looks.blends(about, mixed), strict=True):
        lag_s[i], sd_s[i] = about[i] + blend.centre_s, blend.sd_s
    drift, drift_sd = (np.nan_to_num(each) for each in (lags.drift, lags.drift_sd))
    sd_s[1:] = np.hypot(sd_s[1:], sd_s[0])
    return Lags(lag_s - lag_s[0], np.concatenate([[0.0], sd_s[1:]]), drift, drift_sd)


@dataclass(frozen=True, slots=True, eq=False)
class _Tracked:
    """A recording tracked from end to end."""

    refined: Refined
    state: InTimeState  # after the last frame
    time_s: list[float]  # (n,) of the frames tracked
    poses: list[Pose]
    equations: list[dict[str, tuple[Array, Array]]]

    def pose_at(self, time_s: float, within_s: float) -> Pose | None:
        """Return the pose between two that were found, if these are no more than within_s apart."""
        k = bisect_right(self.time_s, time_s)
        if not 0 < k < len(self.time_s) or self.time_s[k] - self.time_s[k - 1] > within_s:
            return None
        share = (time_s - self.time_s[k - 1]) / (self.time_s[k] - self.time_s[k - 1])
        return moved_pose(self.poses[k - 1], share * motion_between(self.poses[k - 1], self.poses[k]))


class _Looks:
    """Looks at a recording, again and again, with other offsets."""

    def __init__(self, trial: Trial, start_s: Array, told: Callable[[], None]) -> None:
        self._trial, self._start_s, self._told = trial, start_s, told
        self._recording, _ = open_trial(trial)
        self._start = first_pose(trial, trial.model(), self._recording.rig).pose
        self._last: _Tracked | None = None
        self._learned: RefinedState | None = None  # by all cameras
        self.hidden: Collection[int] = ()  # cameras left out

    def __call__(self, lag_s: Array, drift: Array) -> Sightings:
        """Track with these lags (c,) and drifts (c,), and gather what every camera alone says."""
        recording = self._at(np.nan_to_num(lag_s), np.nan_to_num(drift))
        self._last = self._tracked(_without(frames, self.hidden) for frames in recording)
        if not self.hidden:
            self._learned = self._last.state.inner
        return _laid_out(self._last, recording.rig.names)

    def blends(self, lag_s: Array, cameras: Collection[int]) -> list[Blend]:
        """Say which moments the pictures of some cameras show, along the path that was tracked last."""
        assert self._last is not None and self._learned is not None
        recording, last = self._at(lag_s, np.zeros_like(lag_s)), self._last
        moments_s = {i: _MOMENTS / float(recording.facts[i].image_rate) for i in cameras}
        gap_s = 2.5 / float(recording.rate)
        found: dict[int, list[tuple[Array, Array]]] = {i: [] for i in cameras}
        for frames in recording:
            for i in cameras:
                view = frames.views[i]
                if view is not None:
                    at = [last.pose_at(float(frames.time_s) + view.late_s + s, gap_s) for s in moments_s[i]]
                    poses = [pose for pose in at if pose is not None]
                    if len(poses) == len(at) and (each := last.refined.by_moment(self._learned, view, poses)):
                        found[i].append(each)
            self._told()
        return [
            blend_of(moments_s[i], np.array([A for A, _ in found[i]]), np.array([b for _, b in found[i]]))
            for i in cameras
        ]

    def _at(self, lag_s: Array, drift: Array) -> Recording:
        rows = zip(self._recording.sources, self._start_s[0] + lag_s, drift, strict=True)
        timed = [
            replace(source, offset_s=round(float(offset), 9), drift_ppm=round(1e6 * float(rate), 6))
            for source, offset, rate in rows
        ]
        return replace(self._recording, sources=tuple(timed))

    def _tracked(self, recording: Iterable[Frames]) -> _Tracked:
        trial, model = self._trial, self._trial.model()
        settings, tracked = trial.settings, None
        for frames in recording:
            if tracked is None:
                model = sampled(model, self._start, frames)
                refined = Refined(model, self._start, prediction=settings.prediction, fixed_shape=settings.fixed_shape)
                tracker = InTime(refined)
                tracked = _Tracked(refined, tracker.init(), [], [], [])
            estimate = tracker.search(tracked.state, frames)
            tracked = replace(tracked, state=tracker.learn(tracked.state, frames, estimate))
            if estimate.status is Status.TRACKED and estimate.pose is not None:
                state = tracked.state
                tracked.time_s.append(float(frames.time_s))
                tracked.poses.append(estimate.pose)
                tracked.equations.append(refined.by_view(state.inner, in_time(frames, state.past), estimate.pose))
            self._told()
        if tracked is None:
            raise past_the_end(trial)
        if len(tracked.poses) < _FEWEST:
            raise TrialError(
                f"{trial.name}: the body was tracked at {len(tracked.poses)} moments, {_FEWEST} at least tell "
                "the lags; check [start], or synchronise by motion, flash or sound first"
            )
        return tracked


def _with_offsets(trial: Trial, offset_s: Array) -> Trial:
    """Return a trial whose cameras have these offsets (c,) [s] and no drift."""
    pairs = zip(trial.camera, offset_s, strict=True)
    cameras = [camera.model_copy(update={"offset_s": float(s), "drift_ppm": 0.0}) for camera, s in pairs]
    return trial.model_copy(update={"camera": cameras})


def _without(frames: Frames, hidden: Collection[int]) -> Frames:
    views = tuple(None if i in hidden else view for i, view in enumerate(frames.views))
    return replace(frames, views=views) if hidden else frames


def _laid_out(tracked: _Tracked, names: Sequence[str]) -> Sightings:
    """Lay the equations out as arrays; the first and last moment only tell the velocity of their neighbours."""
    time_s, poses = np.array(tracked.time_s), tracked.poses
    n, c = len(time_s) - 2, len(names)
    curvature, slope = np.zeros((n, c, 6, 6)), np.zeros((n, c, 6))
    for k, found in enumerate(tracked.equations[1:-1]):
        for i, name in enumerate(names):
            if name in found:
                curvature[k, i], slope[k, i] = found[name]
    motion = [motion_between(before, after)[:6] for before, after in zip(poses[:-2], poses[2:], strict=True)]
    velocity = np.stack(motion) / (time_s[2:] - time_s[:-2])[:, None]
    return Sightings(time_s[1:-1], velocity, curvature, slope)
