"""A trial's cameras put on one clock: offsets found, and written into the trial file."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Rig
from airborne.errors import AirborneError, TrialError
from airborne.run.opening import cameras_of, source_of
from airborne.sync import Offsets, offsets_by_flash, offsets_by_motion, offsets_by_sound
from airborne.sync.from_tracking import offsets_by_tracking
from airborne.trial.file import Trial
from airborne.video import VideoSource, inspect

Array = NDArray[np.floating]
By = Literal["auto", "flash", "sound", "motion", "tracking"]
Progress = Callable[[int, int | None], None]

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


def _largest_distance_m(rig: Rig) -> float:
    centres = np.stack([camera.centre for camera in rig])
    return float(np.linalg.norm(centres[:, None] - centres, axis=-1).max())
