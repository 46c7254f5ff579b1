"""A trial's cameras on one clock: find their offsets, and write them into the trial file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tomlkit

from airborne.cameras import Rig
from airborne.errors import AirborneError, TrialError
from airborne.io.text import parse_editable_toml
from airborne.io.writing import replace_text
from airborne.run.opening import open_cameras, video_source
from airborne.sync import Offsets, offsets_by_flash, offsets_by_motion, offsets_by_sound
from airborne.sync.from_players import offsets_by_players
from airborne.sync.from_tracking import offsets_by_tracking
from airborne.trial.file import Trial
from airborne.types import Array, Progress
from airborne.video import VideoSource, inspect

By = Literal["auto", "flash", "sound", "motion", "tracking"]

_DECIMALS = 6  # of seconds, as written
# chosen, of what moves where several people do: the errors' root mean square on 13 of the synthetic blocks 9001 to 9023
_SEVERAL_PEOPLE_SD_S = 0.011
_KEYS = ("offset_s", "offset_sd_s", "drift_ppm")


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

    "auto" takes motion, then tracking, which is the most exact. With `whole_pictures`, for genlocked
    cameras that were started apart, offsets are rounded to whole images. Raises VideoError or TrialError where the
    recording does not show it.
    """
    if len(trial.camera) < 2:
        raise TrialError(f"{trial.name} has one camera; there is nothing to synchronise it with")
    if with_drift and by in ("auto", "motion"):
        raise TrialError(f"drift cannot be estimated by {by}; use flash, sound or tracking")
    sources = [video_source(trial, camera) for camera in trial.camera]
    if by == "flash":
        offsets = offsets_by_flash(sources, with_drift=with_drift, progress=progress)
    elif by == "sound":
        apart_m = _largest_distance_m(open_cameras(trial).rig)
        offsets = offsets_by_sound(sources, microphones_apart_m=apart_m, with_drift=with_drift, progress=progress)
    elif by == "tracking":
        present = np.array([camera.offset_s for camera in trial.camera])
        offsets = _by_tracking(trial, present, with_drift=with_drift, progress=progress)
    else:
        offsets = offsets_by_motion(sources, open_cameras(trial).rig, within_s=within_s, progress=progress)
        if trial.has_players:
            several_s = np.where(np.arange(len(sources)) > 0, _SEVERAL_PEOPLE_SD_S, 0.0)
            offsets = replace(offsets, offset_sd_s=np.hypot(offsets.offset_sd_s, several_s))
        if by == "auto":
            offsets = _refine(trial, offsets, progress)
    return round_to_images(offsets, sources) if whole_pictures else offsets


def round_to_images(offsets: Offsets, sources: Sequence[VideoSource]) -> Offsets:
    """Round offsets to whole images of each camera; a note says where that is doubtful."""
    period_s = np.array([float(1 / inspect(source).image_rate) for source in sources])
    rounded = np.round((offsets.offset_s - offsets.offset_s[0]) / period_s) * period_s + offsets.offset_s[0]
    apart_s = np.abs(offsets.offset_s - rounded)
    doubts = [
        f"{name} lies {1000 * apart:.1f} ms beside a whole image: is it genlocked?"
        for name, apart, sd, period in zip(offsets.names, apart_s, offsets.offset_sd_s, period_s, strict=True)
        if apart > max(period / 4, 3 * sd)
    ]
    return replace(
        offsets,
        offset_s=rounded,
        offset_sd_s=np.zeros_like(rounded),
        notes=(*offsets.notes, *doubts),
        how=offsets.how + ", in whole images",
    )


def write_offsets(path: Path, offsets: Offsets) -> None:
    """Write offsets, their sds and drifts into a trial file; all else in it stays as it is, comments too.

    Raises TrialError where the file's cameras are not those of the offsets.
    """
    try:
        document = parse_editable_toml(path.read_text(encoding="utf-8-sig"))
    except ValueError as error:
        raise TrialError(f"{path}: cannot be edited ({error}); write the offsets into it by hand") from None
    cameras: Any = document.get("camera", [])
    names = [camera.get("name") for camera in cameras]
    if names != list(offsets.names):
        raise TrialError(f"{path}: has the cameras {names}, but offsets are of {list(offsets.names)}; run sync again")
    for number, camera in enumerate(cameras):
        _set_keys(camera, _entries(offsets, number))
    replace_text(path, tomlkit.dumps(document))


def _set_keys(table: Any, entries: dict[str, float]) -> None:
    """Set the keys of a camera's clock, new ones below its last key; what follows in the file stays below."""
    for key in _KEYS:
        if key not in entries:
            table.pop(key, None)
    body = table.value.body
    end = 1 + max(k for k, (key, _) in enumerate(body) if key is not None)
    rest = body[end:]
    del body[end:]
    table.update(entries)
    body.extend(rest)


def _entries(offsets: Offsets, number: int) -> dict[str, float]:
    """Return the entries of one camera's clock; none for a first camera without an offset."""
    values = (
        round(float(offsets.offset_s[number]), _DECIMALS) + 0.0,
        round(float(offsets.offset_sd_s[number]), _DECIMALS),
        round(1e6 * float(offsets.drift[number]), 3),
    )
    is_needed = number > 0 or any(values)
    return {key: value for key, value in zip(_KEYS, values, strict=True) if is_needed and (value or key == "offset_s")}


def _by_tracking(
    trial: Trial, start_s: Array, *, with_drift: bool = False, progress: Progress | None = None
) -> Offsets:
    find = offsets_by_players if trial.has_players else offsets_by_tracking
    return find(trial, start_s, with_drift=with_drift, progress=progress)


def _refine(trial: Trial, offsets: Offsets, progress: Progress | None) -> Offsets:
    try:
        better = _by_tracking(trial, offsets.offset_s, progress=progress)
    except AirborneError as error:
        return replace(offsets, notes=(*offsets.notes, f"not refined by tracking: {error}"))
    if np.any(np.abs(better.offset_s - offsets.offset_s) > 10 * offsets.offset_sd_s + 0.01):
        return replace(
            offsets, notes=(*offsets.notes, "tracking led elsewhere, so motion's offsets are kept; look at both")
        )
    return better


def _largest_distance_m(rig: Rig) -> float:
    centres = np.stack([camera.centre for camera in rig])
    return float(np.linalg.norm(centres[:, None] - centres, axis=-1).max())
