"""When each image of a file is shown, read off its packets, and which images of several cameras belong together."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from typing import NamedTuple

import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream
from numpy.typing import NDArray

from airborne.errors import VideoError
from airborne.video.containers import open_file, video_stream
from airborne.video.decoding import VideoFacts, VideoSource, inspect, intact_frames
from airborne.video.sample_table import frames_of_packets, frames_of_table

_MOST_IN_64_BITS = 2**61  # of which sums and differences fit too
_MOST_FRAMES = 5_000_000  # of a trial: 28 hours at 50 Hz


@dataclass(frozen=True, slots=True, eq=False)
class ImageIndex:
    """When each frame of a file is shown. Where a file is damaged, frames are listed that cannot be decoded."""

    facts: VideoFacts
    ticks: NDArray[np.int64]  # (frames,) since the first frame, ascending
    keys: NDArray[np.int64]  # (keys,) those of frames from which decoding may begin, ascending; none: the start alone
    first: int  # stamp of the first frame in the file [ticks]
    tick_s: Fraction

    def __len__(self) -> int:
        """Return the number of images; each of two fields is one."""
        return len(self.ticks) * len(self.facts.parities)

    def key_before(self, number: int) -> int:
        """Return the number of the last image up to this one that is decoded without any other; -1 without one."""
        n = len(self.facts.parities)
        keys = self.keys[: bisect_right(self.keys, self.ticks[number // n])]
        return int(np.searchsorted(self.ticks, keys[-1])) * n if len(keys) else -1

    def times(self) -> tuple[NDArray[np.int64], int]:
        """Return the time of every image since the first, as `decode` gives it, and how many units a second has."""
        rate, tick_s, n = self.facts.frame_rate, self.tick_s, len(self.facts.parities)
        unit = lcm(tick_s.denominator, rate.numerator * n)
        tick, frame = round(unit * tick_s), round(unit / rate)
        stamps = self.ticks * tick
        snapped = (stamps + frame // 2) // frame * frame
        frames = np.where(np.abs(snapped - stamps) <= tick, snapped, stamps)
        return (frames[:, None] + frame // n * np.arange(n)).ravel(), unit


def index_images(source: VideoSource) -> ImageIndex:
    """List a file's images by its own table of them, else by its packets; where these have no times, decode it once.

    Raises VideoError.
    """
    facts = inspect(source)
    with ExitStack() as stack:
        container, stream = open_stream(source, stack)
        tick_s, frames = stream.time_base or Fraction(1, 1_000_000), frames_of_table(source.path, container, stream)
    if frames is None:
        with ExitStack() as stack:
            container, stream = open_stream(source, stack)
            frames = frames_of_packets(container.demux(stream))
    if frames is not None:
        ticks, keys = _ascending(frames[:, 0]), _ascending(frames[frames[:, 1] > 0, 0])
        return ImageIndex(facts, ticks - ticks[0], keys - ticks[0], int(ticks[0]), tick_s)
    with ExitStack() as stack:
        container, stream = open_stream(source, stack)
        ticks = np.array([n for n, _ in intact_frames(container, stream, size=facts.size_before_rotation)], np.int64)
    return ImageIndex(facts, ticks, np.zeros(0, np.int64), 0, tick_s)


def _ascending(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return each stamp once, in order: `np.unique` takes five times as long."""
    stamps = np.sort(stamps)
    return stamps[np.append(True, np.diff(stamps) > 0)[: len(stamps)]]


class TrialClock(NamedTuple):
    """Which image of each camera belongs to each frame of a trial, as `Recording` has it."""

    times_s: NDArray[np.float64]  # (n,) on the trial's clock [s]
    images: NDArray[np.int64]  # (n, cameras) image numbers; -1 where a camera has none

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.images)


def match_images(sources: Sequence[VideoSource], indexes: Sequence[ImageIndex]) -> TrialClock:
    """Match the images of several cameras by their times, as `Recording` does; the first camera is the clock."""
    images = [index.times() for index in indexes]
    starts = [source.trial_time(Fraction(0)) for source in sources]
    paces = [source.trial_time(Fraction(1)) - start for source, start in zip(sources, starts, strict=True)]
    period_s = 1 / indexes[0].facts.image_rate
    per_unit = [pace / unit for pace, (_, unit) in zip(paces, images, strict=True)]
    scale = 2 * lcm(*(each.denominator for each in (period_s, *starts, *per_unit)))
    steps = [(int(each * scale), int(start * scale)) for each, start in zip(per_unit, starts, strict=True)]
    ends = [int(numbers[-1]) * step + abs(begin) for (numbers, _), (step, begin) in zip(images, steps, strict=True)]
    whole = np.int64 if max(ends) < _MOST_IN_64_BITS else object  # numbers of any size: exact
    times = [numbers.astype(whole) * step + begin for (numbers, _), (step, begin) in zip(images, steps, strict=True)]
    period, last = int(period_s * scale), max(int(each[-1]) for each in times)
    if last - times[0][0] > _MOST_FRAMES * period:
        raise VideoError(
            f"{sources[0].name}: over {_MOST_FRAMES} frames to its end or another's; convert the videos again"
        )
    clock = _clock(times[0].tolist(), period, last)
    matched = [_nearest(each, np.array(clock, whole), period // 2) for each in times]
    return TrialClock(np.array([time / scale for time in clock]), np.stack(matched, axis=1))


def _clock(own: Sequence[int], period: int, last: int) -> list[int]:
    """Return a camera's own times; over a gap and past its end they go on by the period, to the last of all images."""
    clock: list[int] = []
    for time, following in zip(own, [*own[1:], last + period + period // 2], strict=True):
        clock.append(time)
        while following >= clock[-1] + period * 3 // 2 and last > clock[-1] + period - period // 2:
            clock.append(clock[-1] + period)
    return clock


def _nearest(times: NDArray, clock: NDArray, half: int) -> NDArray[np.int64]:
    """Return the number of the image nearest to each time of the clock, the later of two; -1 beyond half a period."""
    later = (
        np.searchsorted(times, clock, side="right").clip(1, len(times) - 1)
        if len(times) > 1
        else np.zeros(len(clock), int)
    )
    earlier = np.maximum(later - 1, 0)
    number = np.where(times[later] - clock <= clock - times[earlier], later, earlier)
    offset = times[number] - clock
    return np.where((offset > -half) & (offset <= half), number, -1).astype(np.int64)


def open_stream(source: VideoSource, stack: ExitStack) -> tuple[InputContainer, VideoStream]:
    """Open a camera's file, to be closed with the stack, at its video stream; raises VideoError."""
    container = stack.enter_context(open_file(source.name, source.path))
    stream = video_stream(container)
    if stream is None:
        raise VideoError(f"{source.name}: {source.path} holds no video stream; give a video, or copy it again")
    return container, stream
