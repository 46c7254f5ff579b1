"""What cameras saw or heard on the trial's clock: where their offsets are right, the curves rise together."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from airborne.sync.audio import RATE_HZ, read_sound
from airborne.sync.flash import brightness_of
from airborne.types import Array
from airborne.video import VideoSource

WAYS = {"flash": "mean brightness", "sound": "loudness"}  # that have curves, and what they show
_AROUND_S = 0.5  # of the moment at which the first camera's curve rises most
_STEP_S = 0.002  # between points of loudness
_WIDE_PX, _HIGH_PX, _RIM_PX = 720, 90, 6  # of the drawing; about the curves


def level_curves(way: str, sources: Sequence[VideoSource]) -> list[Array]:
    """Return for each camera time on the trial's clock [s] and level, 0 to 1: (n, 2), about the moment that tells most.

    Raises VideoError.
    """
    curves = [_levels(way, source) for source in sources]
    first = curves[0]
    middle_s = float(first[1 + np.argmax(np.diff(first[:, 1])), 0]) if len(first) > 1 else 0.0
    return [_scale(curve[np.abs(curve[:, 0] - middle_s) <= _AROUND_S]) for curve in curves]


def curves_svg(curves: Sequence[Array], colours: Sequence[str]) -> str:
    """Draw curves (n, 2) of time and level over one axis of time, each in its colour."""
    times = np.concatenate([curve[:, 0] for curve in curves])
    low, span = float(times.min(initial=0)), max(float(np.ptp(times)) if len(times) else 0.0, 1e-6)
    scale = np.array([(_WIDE_PX - 2 * _RIM_PX) / span, -(_HIGH_PX - 2 * _RIM_PX)])
    drawn = []
    for curve, colour in zip(curves, colours, strict=False):
        px = (curve - [low, 1.0]) * scale + _RIM_PX
        points = " ".join(f"{u:.1f},{v:.1f}" for u, v in px.tolist())
        drawn.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    head = f'<svg width="{_WIDE_PX}" height="{_HIGH_PX}" role="img" aria-label="levels over time">'
    return f"{head}{''.join(drawn)}</svg>"


def _levels(way: str, source: VideoSource) -> Array:
    if way == "flash":
        seen = brightness_of(source)
        time_s, level = seen.time_s, seen.level
    else:
        sound, step = read_sound(source), round(_STEP_S * RATE_HZ)
        level = np.sqrt(np.mean(sound[: len(sound) // step * step].reshape(-1, step) ** 2, axis=1))
        time_s = (np.arange(len(level)) + 0.5) * _STEP_S
    begin, end = (float(source.trial_time(Fraction(t))) for t in (0, 1))
    return np.stack([begin + time_s * (end - begin), level], axis=1).astype(float, copy=False)


def _scale(curve: Array) -> Array:
    if not len(curve):
        return curve
    low, high = curve[:, 1].min(), curve[:, 1].max()
    return np.stack([curve[:, 0], (curve[:, 1] - low) / max(high - low, 1e-9)], axis=1)
