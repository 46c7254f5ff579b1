"""Synchronisation by sound: the shift at which two cameras' microphones hear the same (GCC-PHAT)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from av.audio.resampler import AudioResampler
from av.error import FFmpegError

from airborne.constants import SPEED_OF_SOUND_M_S
from airborne.errors import VideoError
from airborne.geometry.robust import robust_sd
from airborne.sync.offsets import Offsets, fit_line
from airborne.types import Array, Progress
from airborne.video.containers import open_file
from airborne.video.decoding import VideoSource

RATE_HZ = 8000  # 0.125 ms a sample
_ENVELOPE_HZ = 500  # of the loudness that is compared first
_WINDOW_S = 4.0  # of a waveform that is compared
_SEARCH_S = 0.02  # half width of the search with the waveforms, about the shift of the envelopes
_LEAST_CORRELATION = 0.2  # of the envelopes of two cameras that hear the same
_LEAST_PEAK_SDS = 6.0  # robust sds by which the peak of a phase transform must stand out
_N_WINDOWS = 12  # windows compared, the loudest


def offsets_by_sound(
    sources: Sequence[VideoSource],
    *,
    microphones_apart_m: float = 0.0,
    with_drift: bool = False,
    progress: Progress | None = None,
) -> Offsets:
    """Find the offsets that bring the cameras' sound together.

    The envelopes give a coarse shift, the waveforms of the loudest windows refine it (phase transform); their scatter
    gives the sd. Sound takes 3 ms a metre: a source may be nearer to one camera by up to the distance between them,
    `microphones_apart_m`, which widens the sd as a uniform error does. Raises VideoError where a camera has no sound,
    or none that fits the first camera's.
    """
    sounds = []
    for number, source in enumerate(sources, start=1):
        sounds.append(read_sound(source))
        if progress is not None:
            progress(number, len(sources))
    travel_s = microphones_apart_m / SPEED_OF_SOUND_M_S / np.sqrt(3)
    rows = [(0.0, 0.0, 0.0, 0.0)]
    for source, sound in zip(sources[1:], sounds[1:], strict=True):
        shift = shift_between(sounds[0], sound)
        if shift is None:
            raise VideoError(
                f"{source.name}: its sound does not fit that of {sources[0].name}; "
                "clap near both, or synchronise by flash, motion or tracking"
            )
        offset, sd, drift, drift_sd = fit_line(*shift, with_drift=with_drift)
        rows.append((offset, float(np.hypot(sd, travel_s)), drift, drift_sd))
    notes = () if travel_s else ("sound takes 3 ms a metre, and how far the microphones are apart is not known",)
    names = tuple(source.name for source in sources)
    return Offsets(names, *np.array(rows).T, how=f"by sound, {_shortest_s(sounds):.1f} s of it", notes=notes)


def read_sound(source: VideoSource) -> Array:
    """Read one camera's sound: (n,) at 8 kHz, starting at its first image. Raises VideoError."""
    chunks = []
    try:
        with open_file(source.name, source.path) as container:
            if not container.streams.audio:
                raise VideoError(
                    f"{source.name}: {source.path} has no sound; synchronise by flash, motion or tracking instead"
                )
            audio, video_start_s = container.streams.audio[0], 0.0
            if container.streams.video:
                video = container.streams.video[0]
                video_start_s = float((video.start_time or 0) * (video.time_base or 0))
            resampler = AudioResampler("flt", "mono", RATE_HZ)
            first_s = None
            for frame in container.decode(audio):
                first_s = float(frame.time or 0.0) if first_s is None else first_s
                chunks += [chunk.to_ndarray().ravel() for chunk in resampler.resample(frame)]
            chunks += [chunk.to_ndarray().ravel() for chunk in resampler.resample(None)]
    except (FFmpegError, OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise VideoError(f"{source.name}: the sound of {source.path} cannot be read ({reason}); convert it") from error
    sound = np.nan_to_num(np.concatenate([np.zeros(0), *chunks]))
    n_late = round(((first_s or 0.0) - video_start_s) * RATE_HZ)
    return np.concatenate([np.zeros(n_late), sound]) if n_late >= 0 else sound[-n_late:]


def shift_between(reference: Array, sound: Array) -> tuple[Array, Array, Array] | None:
    """Find what to add to the second sound's times: its own times (n,), offsets (n,) and their sds (n,) [s].

    None where no shift stands out.
    """
    from scipy.signal import correlate, correlation_lags  # takes a third of a second to load

    a, b = _envelope(reference), _envelope(sound)
    if min(len(a), len(b)) < _ENVELOPE_HZ // 4 or not (a.any() and b.any()):
        return None
    match = correlate(a, b, method="fft")
    if match.max() < _LEAST_CORRELATION * np.linalg.norm(a) * np.linalg.norm(b):
        return None
    coarse_s = correlation_lags(len(a), len(b))[match.argmax()] / _ENVELOPE_HZ
    rows = [
        row for start in _loud_windows(sound) if (row := _refine_shift(reference, sound, start, coarse_s)) is not None
    ]
    if not rows:
        return np.zeros(1), np.array([coarse_s]), np.array([1 / _ENVELOPE_HZ])
    time_s, offset_s = np.array(rows).T
    near = np.abs(offset_s - np.median(offset_s)) < 5 / RATE_HZ + 3 * np.median(np.abs(offset_s - np.median(offset_s)))
    return time_s[near], offset_s[near], np.full(int(near.sum()), 1 / RATE_HZ)


def _envelope(sound: Array) -> Array:
    """Return the onset envelope at 500 Hz: the rises of the log level, mean removed."""
    from scipy.signal import butter, sosfilt

    step = RATE_HZ // _ENVELOPE_HZ
    passed = sosfilt(butter(2, (300, 3400), "bandpass", fs=RATE_HZ, output="sos"), sound)
    power = np.asarray(passed)[: len(sound) // step * step].reshape(-1, step)
    level = np.log(np.mean(power**2, axis=1) + 1e-8)
    onset = np.maximum(np.diff(level, prepend=level[:1]), 0)
    return onset - onset.mean() if len(onset) else onset


def _loud_windows(sound: Array) -> list[int]:
    n = round(_WINDOW_S * RATE_HZ)
    starts = np.arange(0, max(len(sound) - n // 2, 1), n // 2)
    loudness = [float(np.sum(sound[start : start + n] ** 2)) for start in starts]
    return [int(starts[k]) for k in np.argsort(loudness)[::-1][:_N_WINDOWS] if loudness[k] > 0]


def _refine_shift(reference: Array, sound: Array, start: int, coarse_s: float) -> tuple[float, float] | None:
    """Match one window's waveform by phase transform near the coarse shift: (time of its middle, offset) [s]."""
    n, near = round(_WINDOW_S * RATE_HZ), round(_SEARCH_S * RATE_HZ)
    part, at = sound[start : start + n], start + round(coarse_s * RATE_HZ)
    other = reference[max(at, 0) : max(at + n, 0)]
    if len(part) < n // 4 or len(other) < n // 4:
        return None
    size = 2 * n
    cross = np.fft.rfft(other, size) * np.conj(np.fft.rfft(part, size))
    match = np.fft.irfft(cross / (np.abs(cross) + 1e-9 * np.abs(cross).max() + 1e-30), size)
    match = np.concatenate([match[-near:], match[: near + 1]])
    k = int(match.argmax())
    if not 0 < k < len(match) - 1 or match[k] < _LEAST_PEAK_SDS * robust_sd(match):
        return None
    before, top, after = match[k - 1 : k + 2]
    between = 0.5 * (before - after) / (before - 2 * top + after)
    shift = (k + between - near + max(at, 0) - start) / RATE_HZ
    return (start + len(part) / 2) / RATE_HZ, shift


def _shortest_s(sounds: Sequence[Array]) -> float:
    return min(len(each) for each in sounds) / RATE_HZ
