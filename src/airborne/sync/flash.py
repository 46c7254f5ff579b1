"""Synchronisation by flashes: moments at which the whole image of every camera suddenly brightens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.errors import VideoError
from airborne.geometry.robust import robust_sd
from airborne.sync.offsets import Offsets, fit_line, image_counter
from airborne.types import Array, Progress
from airborne.video.decoding import VideoSource, decode, inspect

_LEAST_STEP_SDS = 8.0  # robust sds of the ordinary changes
_LEAST_STEP = 4.0  # grey levels of the mean image
_LEAST_GAP_S = 0.15  # a flash and its afterglow are one


@dataclass(frozen=True, slots=True, eq=False)
class Brightness:
    """One camera's mean brightness over time."""

    time_s: Array  # (n,) since its first image
    level: Array  # (n,) [grey levels]
    period_s: float


def offsets_by_flash(
    sources: Sequence[VideoSource],
    *,
    with_drift: bool = False,
    progress: Progress | None = None,
) -> Offsets:
    """Find the offsets that bring the flashes of all cameras together.

    A flash lies anywhere between two images (uniform), so that a single one leaves an sd of a period over sqrt(12)
    for each camera. Raises VideoError where a camera shows no flash, or none that fits the first camera's.
    """
    on_image = image_counter(progress)
    flashes = [flashes_of(brightness_of(source, on_image)) for source in sources]
    missing = [source.name for source, (times, _) in zip(sources, flashes, strict=True) if not len(times)]
    if missing:
        raise VideoError(
            f"no flash seen by {', '.join(missing)}: the whole image never brightens at once; "
            "synchronise by sound, motion or tracking instead"
        )
    (reference, reference_sd), rows = flashes[0], [(0.0, 0.0, 0.0, 0.0)]
    for source, (times, sd) in zip(sources[1:], flashes[1:], strict=True):
        pairs = pair_times(reference, times, reference_sd + sd)
        if not len(pairs):
            raise VideoError(f"{source.name}: its flashes do not fit those of {sources[0].name}; are these one take?")
        i, j = pairs.T
        sds = np.full(len(pairs), np.hypot(reference_sd, sd))
        rows.append(fit_line(times[j], reference[i] - times[j], sds, with_drift=with_drift))
    counts = ", ".join(f"{source.name} {len(times)}" for source, (times, _) in zip(sources, flashes, strict=True))
    return Offsets(tuple(source.name for source in sources), *np.array(rows).T, how=f"by flashes seen: {counts}")


def brightness_of(source: VideoSource, on_image: Callable[[], None] = lambda: None) -> Brightness:
    """Read one camera's mean brightness, from the stored luma; `on_image` is called after every image."""
    facts = inspect(source)
    times, levels = [], []
    for image in decode(source, facts):
        luma = np.asarray(image.frame.reformat(width=64, height=48, format="gray").to_ndarray())
        rows = luma if image.parity is None else luma[image.parity :: 2]
        times.append(float(image.time_s))
        levels.append(float(rows.mean()))
        on_image()
    return Brightness(np.array(times), np.array(levels), float(1 / facts.image_rate))


def flashes_of(brightness: Brightness) -> tuple[Array, float]:
    """Return the times of sudden brightening (n,) [s], midway between the dark and the bright image, and their sd."""
    step = np.diff(brightness.level)
    spread = robust_sd(step) if len(step) else 0.0
    times: list[float] = []
    for k in np.flatnonzero(step > max(_LEAST_STEP_SDS * spread, _LEAST_STEP)):
        time_s = float(brightness.time_s[k : k + 2].mean())
        if not times or time_s - times[-1] > _LEAST_GAP_S:
            times.append(time_s)
    return np.array(times), brightness.period_s / np.sqrt(12)


def pair_times(reference: Array, times: Array, tolerance_s: float) -> NDArray[np.int64]:
    """Pair times (n,) and (m,) [s] under the one shift that pairs most of them, most closely: indices (k, 2)."""
    best, best_score = np.zeros((0, 2), int), (0, 0.0)
    for shift in (reference[:, None] - times).ravel():
        distance = np.abs(reference[:, None] - times - shift)
        i = np.flatnonzero(distance.min(axis=1) <= 2 * tolerance_s)
        j = distance[i].argmin(axis=1)
        score = (len(i), -float(distance[i, j].sum()))
        if score > best_score:
            best, best_score = np.stack([i, j], axis=1), score
    return best
