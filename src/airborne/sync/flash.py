"""Synchronisation by flashes: moments at which every camera's whole picture suddenly brightens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.errors import VideoError
from airborne.geometry.robust import robust_sd
from airborne.sync.offsets import Offsets, counting, line_through
from airborne.video.decoding import VideoSource, inspect, pictures

Array = NDArray[np.floating]

_CLEAR = 8.0  # robust sds of the ordinary changes
_LEAST_STEP = 4.0  # grey levels of the mean picture
_APART_S = 0.15  # a flash and its afterglow are one


@dataclass(frozen=True, slots=True, eq=False)
class Brightness:
    """One camera's mean brightness over time."""

    time_s: Array  # (n,) since its first picture
    level: Array  # (n,) [grey levels]
    period_s: float


def offsets_by_flash(
    sources: Sequence[VideoSource],
    *,
    with_drift: bool = False,
    progress: Callable[[int, int | None], None] | None = None,
) -> Offsets:
    """Find the offsets that bring the flashes of all cameras together.

    A flash is known to the time between two pictures: uniform, so that one flash leaves an sd of a period over
    sqrt(12) for each camera. Raises VideoError where a camera shows no flash, or none that fits the first camera's.
    """
    told = counting(progress)
    flashes = [flashes_of(brightness_of(source, told)) for source in sources]
    missing = [source.name for source, found in zip(sources, flashes, strict=True) if not len(found[0])]
    if missing:
        raise VideoError(
            f"no flash seen by {', '.join(missing)}: the whole picture never brightens at once; "
            "synchronise by sound, motion or tracking instead"
        )
    (reference, reference_sd), rows = flashes[0], [(0.0, 0.0, 0.0, 0.0)]
    for source, (times, sd) in zip(sources[1:], flashes[1:], strict=True):
        pairs = paired(reference, times, reference_sd + sd)
        if not len(pairs):
            raise VideoError(f"{source.name}: its flashes do not fit those of {sources[0].name}; are these one take?")
        i, j = pairs.T
        sds = np.full(len(pairs), np.hypot(reference_sd, sd))
        rows.append(line_through(times[j], reference[i] - times[j], sds, with_drift=with_drift))
    counts = ", ".join(f"{source.name} {len(found[0])}" for source, found in zip(sources, flashes, strict=True))
    return Offsets(tuple(source.name for source in sources), *np.array(rows).T, how=f"by flashes seen: {counts}")


def brightness_of(source: VideoSource, told: Callable[[], None] = lambda: None) -> Brightness:
    """Read one camera's mean brightness, from the stored luma; `told` is called after every picture."""
    facts = inspect(source)
    times, levels = [], []
    for picture in pictures(source, facts):
        luma = np.asarray(picture.frame.reformat(width=64, height=48, format="gray").to_ndarray())
        rows = luma if picture.parity is None else luma[picture.parity :: 2]
        times.append(float(picture.time_s))
        levels.append(float(rows.mean()))
        told()
    return Brightness(np.array(times), np.array(levels), float(1 / facts.image_rate))


def flashes_of(brightness: Brightness) -> tuple[Array, float]:
    """Return when the picture suddenly brightens (n,) [s], the middle between dark and bright picture, and the sd."""
    step = np.diff(brightness.level)
    spread = robust_sd(step) if len(step) else 0.0
    found: list[float] = []
    for k in np.flatnonzero(step > max(_CLEAR * spread, _LEAST_STEP)):
        time_s = float(brightness.time_s[k : k + 2].mean())
        if not found or time_s - found[-1] > _APART_S:
            found.append(time_s)
    return np.array(found), brightness.period_s / np.sqrt(12)


def paired(reference: Array, times: Array, tolerance_s: float) -> NDArray[np.int64]:
    """Pair moments (n,) and (m,) [s] under the one shift that pairs most of them, then the closest: (k, 2) rows."""
    best, quality = np.zeros((0, 2), int), (0, 0.0)
    for shift in (reference[:, None] - times).ravel():
        away = np.abs(reference[:, None] - times - shift)
        i = np.flatnonzero(away.min(axis=1) <= 2 * tolerance_s)
        j = away[i].argmin(axis=1)
        reached = (len(i), -float(away[i, j].sum()))
        if reached > quality:
            best, quality = np.stack([i, j], axis=1), reached
    return best
