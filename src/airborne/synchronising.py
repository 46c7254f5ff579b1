"""A trial's cameras put on one clock: offsets found, and written into the trial file."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose
from airborne.body.chain import motion_between
from airborne.cameras import Rig
from airborne.errors import AirborneError, TrialError
from airborne.runs import cameras_of, open_trial, past_the_end, source_of
from airborne.start import first_pose
from airborne.tracking import Status
from airborne.tracking.lags import Sightings, find_lags
from airborne.tracking.lateness import InTime, in_time
from airborne.tracking.methods import sampled
from airborne.tracking.refined import Refined
from airborne.trial import Trial
from airborne.video import Recording, VideoSource, inspect
from airborne.video.sync import Offsets, counting, offsets_by_flash, offsets_by_motion, offsets_by_sound

Array = NDArray[np.floating]
By = Literal["auto", "flash", "sound", "motion", "tracking"]
Progress = Callable[[int, int | None], None]

_FEWEST = 8  # moments at which the body must be tracked to tell lags
_DECIMALS = 6  # of seconds, as written
_KEYS = "offset_s|offset_sd_s|drift_ppm"


def synchronise(
    trial: Trial,
    *,
    by: By = "auto",
    within_s: float = 1.0,
    whole_pictures: bool = False,
    with_drift: bool = False,
    progress: Progress | None = None,
) -> Offsets:
    """Find what to add to the times of each camera; the first camera's are the clock.

    "auto" takes motion and, of one body, then tracking, which is the most exact. With `whole_pictures`, for genlocked
    cameras that were started apart, offsets are rounded to whole pictures. Raises VideoError or TrialError where the
    recording does not tell.
    """
    if len(trial.camera) < 2:
        raise TrialError(f"{trial.name} has one camera; there is nothing to synchronise it with")
    if with_drift and by in ("auto", "motion"):
        raise TrialError(f"drift cannot be told by {by}; use flash, sound or tracking")
    sources = [source_of(trial, camera) for camera in trial.camera]
    if by == "flash":
        found = offsets_by_flash(sources, with_drift=with_drift, progress=progress)
    elif by == "sound":
        apart_m = _largest_distance_m(cameras_of(trial)[0])
        found = offsets_by_sound(sources, microphones_apart_m=apart_m, with_drift=with_drift, progress=progress)
    elif by == "tracking":
        present = np.array([camera.offset_s for camera in trial.camera])
        found = offsets_by_tracking(trial, present, with_drift=with_drift, progress=progress)
    else:
        found = offsets_by_motion(sources, cameras_of(trial)[0], within_s=within_s, progress=progress)
        if by == "auto" and not trial.has_players:
            found = _refined(trial, found, progress)
    return in_whole_pictures(found, sources) if whole_pictures else found


def offsets_by_tracking(
    trial: Trial, start_s: Array, *, with_drift: bool = False, progress: Progress | None = None
) -> Offsets:
    """Find the offsets at which every camera's pictures agree with the body as all cameras together track it.

    The recording is tracked some times over, from offsets start_s (c,) [s]. Raises TrialError for players, and where
    the body is not tracked often enough.
    """
    if trial.has_players:
        raise TrialError("tracking tells the lags of one body's cameras; of players use motion, flash or sound")
    method = {"track": trial.track.model_copy(update={"method": "refined"})}
    trial = _with_offsets(trial.model_copy(update=method), start_s)
    recording, _ = open_trial(trial)
    start, told = first_pose(trial, trial.model(), recording.rig).pose, counting(progress)

    def look(lag_s: Array, drift: Array) -> Sightings:
        return _sightings(trial, _at(recording, start_s[0] + lag_s, drift), start, told)

    lags = find_lags(look, start_s - start_s[0], with_drift=with_drift)
    names = tuple(camera.name for camera in trial.camera)
    unknown = [name for name, lag_s in zip(names, lags.lag_s, strict=True) if not np.isfinite(lag_s)]
    if unknown:
        raise TrialError(f"{', '.join(unknown)}: never sees the tracked body move; synchronise by flash or sound")
    how = "by tracking: every camera's pictures against the body as all of them see it"
    return Offsets(names, start_s[0] + lags.lag_s, lags.sd_s, lags.drift, lags.drift_sd, how)


def in_whole_pictures(found: Offsets, sources: Sequence[VideoSource]) -> Offsets:
    """Round offsets to whole pictures of each camera; a note says where that is not sure."""
    period_s = np.array([float(1 / inspect(source).image_rate) for source in sources])
    rounded = np.round((found.offset_s - found.offset_s[0]) / period_s) * period_s + found.offset_s[0]
    away = np.abs(found.offset_s - rounded)
    unsure = [
        f"{name} lies {1000 * apart:.1f} ms beside a whole picture: is it genlocked?"
        for name, apart, sd, period in zip(found.names, away, found.offset_sd_s, period_s, strict=True)
        if apart > max(period / 4, 3 * sd)
    ]
    return replace(
        found,
        offset_s=rounded,
        offset_sd_s=np.zeros_like(rounded),
        notes=(*found.notes, *unsure),
        how=found.how + ", in whole pictures",
    )


def write_offsets(path: Path, found: Offsets) -> None:
    """Write offsets, their sds and drifts into a trial file; all else in it stays as it is, comments too.

    Raises TrialError where the cameras' tables are not found in the file.
    """
    text = path.read_text(encoding="utf-8-sig")
    written = _in_tables(text, found) or _in_list(text, found)
    if written is None:
        raise TrialError(f"{path.name}: its cameras are not written as [[camera]] tables; write the offsets by hand")
    beside = path.with_name(path.name + ".part")
    beside.write_text(written, encoding="utf-8")
    beside.replace(path)


def _in_tables(text: str, found: Offsets) -> str | None:
    """Set the lines of [[camera]] tables; None where there are not as many as cameras."""
    lines = text.splitlines()
    heads = [k for k, line in enumerate(lines) if re.match(r"\s*\[\[\s*camera\s*\]\]", line)]
    if len(heads) != len(found.names):
        return None
    for number in reversed(range(len(heads))):
        end = next((k for k in range(heads[number] + 1, len(lines)) if lines[k].lstrip().startswith("[")), len(lines))
        kept = [line for line in lines[heads[number] : end] if not re.match(rf"\s*({_KEYS})\s*=", line)]
        last = max(k for k, line in enumerate(kept) if line.strip())
        lines[heads[number] : end] = [*kept[: last + 1], *_clock(found, number), *kept[last + 1 :]]
    return "\n".join(lines) + "\n"


def _in_list(text: str, found: Offsets) -> str | None:
    """Set the entries of `camera = [{ ... }, ...]`; None where there are not as many as cameras."""
    begun = re.search(r"^\s*camera\s*=\s*\[", text, re.MULTILINE)
    entries = [] if begun is None else list(re.finditer(r"\{[^{}]*\}", text[begun.end() :]))[: len(found.names)]
    if begun is None or len(entries) != len(found.names):
        return None
    names = [re.search(r"\bname\s*=\s*[\"']([^\"']*)", entry.group()) for entry in entries]
    if [name and name.group(1) for name in names] != list(found.names):
        return None
    for number, entry in reversed(list(enumerate(entries))):
        kept = re.sub(rf",\s*({_KEYS})\s*=\s*[^,}}]*", "", entry.group()[:-1]).rstrip()
        start, end = (begun.end() + each for each in entry.span())
        text = text[:start] + ", ".join([kept, *_clock(found, number)]) + " }" + text[end:]
    return text


def _clock(found: Offsets, number: int) -> list[str]:
    """Return the entries that say when one camera took its pictures; none for a first camera in time."""
    wanted = {
        "offset_s": round(float(found.offset_s[number]), _DECIMALS) + 0.0,
        "offset_sd_s": round(float(found.offset_sd_s[number]), _DECIMALS),
        "drift_ppm": round(1e6 * float(found.drift[number]), 3),
    }
    is_needed = number > 0 or any(wanted.values())
    return [f"{key} = {value!r}" for key, value in wanted.items() if is_needed and (value or key == "offset_s")]


def _refined(trial: Trial, found: Offsets, progress: Progress | None) -> Offsets:
    try:
        better = offsets_by_tracking(trial, found.offset_s, progress=progress)
    except AirborneError as error:
        return replace(found, notes=(*found.notes, f"not refined by tracking: {error}"))
    if np.any(np.abs(better.offset_s - found.offset_s) > 10 * found.offset_sd_s + 0.01):
        return replace(
            found, notes=(*found.notes, "tracking led elsewhere, so motion's offsets are kept; look at both")
        )
    return better


def _with_offsets(trial: Trial, offset_s: Array) -> Trial:
    """Return a trial whose cameras have these offsets (c,) [s] and no drift."""
    pairs = zip(trial.camera, offset_s, strict=True)
    cameras = [camera.model_copy(update={"offset_s": float(s), "drift_ppm": 0.0}) for camera, s in pairs]
    return trial.model_copy(update={"camera": cameras})


def _at(recording: Recording, offset_s: Array, drift: Array) -> Recording:
    """Return a recording whose cameras have these offsets (c,) [s] and drifts (c,)."""
    rows = zip(recording.sources, offset_s, drift, strict=True)
    timed = [
        replace(source, offset_s=round(float(offset), 9), drift_ppm=round(1e6 * float(rate), 6))
        for source, offset, rate in rows
    ]
    return replace(recording, sources=tuple(timed))


def _sightings(trial: Trial, recording: Recording, start: Pose, told: Callable[[], None]) -> Sightings:
    """Track a recording and gather what every camera alone says; `told` is called after every frame."""
    model, names = trial.model(), recording.rig.names
    times: list[float] = []
    poses: list[Pose] = []
    equations: list[dict[str, tuple[Array, Array]]] = []
    settings, refined = trial.settings, None
    for frames in recording:
        if refined is None:
            model = sampled(model, start, frames)
            refined = Refined(model, start, prediction=settings.prediction, fixed_shape=settings.fixed_shape)
            tracker = InTime(refined)
            state = tracker.init()
        estimate = tracker.search(state, frames)
        state = tracker.learn(state, frames, estimate)
        if estimate.status is Status.TRACKED and estimate.pose is not None:
            times.append(float(frames.time_s))
            poses.append(estimate.pose)
            equations.append(refined.by_view(state.inner, in_time(frames, state.past), estimate.pose))
        told()
    if refined is None:
        raise past_the_end(trial)
    if len(times) < _FEWEST:
        raise TrialError(
            f"{trial.name}: the body was tracked at {len(times)} moments, {_FEWEST} at least tell the lags; "
            "check [start], or synchronise by motion, flash or sound first"
        )
    return _laid_out(np.array(times), poses, equations, names)


def _laid_out(
    time_s: Array, poses: Sequence[Pose], equations: Sequence[dict[str, tuple[Array, Array]]], names: Sequence[str]
) -> Sightings:
    """Lay the equations out as arrays; the first and last moment only tell the velocity of their neighbours."""
    n, c = len(time_s) - 2, len(names)
    curvature, slope = np.zeros((n, c, 6, 6)), np.zeros((n, c, 6))
    for k, found in enumerate(equations[1:-1]):
        for i, name in enumerate(names):
            if name in found:
                curvature[k, i], slope[k, i] = found[name]
    motion = [motion_between(before, after)[:6] for before, after in zip(poses[:-2], poses[2:], strict=True)]
    velocity = np.stack(motion) / (time_s[2:] - time_s[:-2])[:, None]
    return Sightings(time_s[1:-1], velocity, curvature, slope)


def _largest_distance_m(rig: Rig) -> float:
    centres = np.stack([camera.centre for camera in rig])
    return float(np.linalg.norm(centres[:, None] - centres, axis=-1).max())
