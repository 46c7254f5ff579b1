"""Images of a file in any order: when each is shown, read off its packets, and each decoded when it is asked for."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from threading import Lock
from typing import NamedTuple, Self

import av
import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream
from numpy.typing import NDArray

from airborne.errors import VideoError
from airborne.types import Image
from airborne.video.containers import open_file, video_stream
from airborne.video.decoding import (
    DecodedImage,
    VideoFacts,
    VideoSource,
    inspect,
    intact_frames,
    rgb_from_decoded,
)
from airborne.video.fields import fill_rows
from airborne.video.sample_table import frames_of_packets, frames_of_table

_KEPT_BYTES, _FEWEST_KEPT = 32_000_000, 2  # of a file's decoded frames, to step back: ten of 1080p
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
        container, stream = _open(source, stack)
        tick_s, frames = stream.time_base or Fraction(1, 1_000_000), frames_of_table(source.path, container, stream)
    if frames is None:
        with ExitStack() as stack:
            container, stream = _open(source, stack)
            frames = frames_of_packets(container.demux(stream))
    if frames is not None:
        ticks, keys = _ascending(frames[:, 0]), _ascending(frames[frames[:, 1] > 0, 0])
        return ImageIndex(facts, ticks - ticks[0], keys - ticks[0], int(ticks[0]), tick_s)
    with ExitStack() as stack:
        container, stream = _open(source, stack)
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


class ImageReader:
    """Decodes any image of a file; images in order, or a few steps back, cost one decoding each or none.

    Not for several threads at once, but for `key_image`.
    """

    def __init__(self, source: VideoSource, index: ImageIndex) -> None:
        """Open nothing yet; call `close` at the end."""
        self._source, self.index = source, index
        self._stack, self._converting = ExitStack(), Lock()
        self._container: InputContainer | None = None
        self._stream: VideoStream | None = None
        self._frames: Iterator[tuple[int, av.VideoFrame]] = iter(())
        self._current: tuple[int, av.VideoFrame] | None = None  # the last that was decoded
        self._key: tuple[int, av.VideoFrame] | None = None  # the last key frame that was decoded
        self._whole_from = 0  # [ticks]; before it, frames that no other is predicted from are left out
        width, height = index.facts.size
        self._n_kept = max(_FEWEST_KEPT, _KEPT_BYTES // (width * height * 3 // 2))
        self._passed: deque[tuple[int, av.VideoFrame]] = deque(maxlen=self._n_kept)  # those before it, and itself

    def image(self, number: int, *, is_exact: bool = True) -> Image | None:
        """Return an image (h, w, 3) sRGB as the file holds it, a field with rows between its own filled in.

        None where it is damaged. `is_exact` as in `rgb_from_frame`. Raises VideoError for a number that is not there.
        """
        self.go_to(number)
        frame = self._find(self._ticks(number))
        return None if frame is None else self._convert(number, frame, is_exact=is_exact)

    def key_image(self, number: int) -> Image | None:
        """Return a key frame's image, not exact, where it is the last that was decoded, else None; decodes nothing.

        While another thread decodes, too.
        """
        key = self._key
        is_it = key is not None and 0 <= number < len(self.index) and key[0] == self._ticks(number)
        return self._convert(number, key[1], is_exact=False) if key is not None and is_it else None

    def go_to(self, number: int, is_wanted: Callable[[], bool] = lambda: True) -> bool:
        """Decode up to an image for as long as it is wanted; say whether it was reached, or is known to be damaged.

        Raises VideoError for a number that is not there.
        """
        if not 0 <= number < len(self.index):
            raise VideoError(f"{self._source.name}: there is no image {number}; the last is {len(self.index) - 1}")
        row, ticks = number // len(self.index.facts.parities), self._ticks(number)
        if self._find(ticks) is not None:
            return True
        near = int(self.index.ticks[max(0, row - self._n_kept)])
        is_back = self._current is not None and near <= 2 * ticks - self._current[0] < ticks  # then more of them follow
        was_left_out = self._current is not None and self._current[0] < ticks < self._whole_from
        self._whole_from = near if is_back else ticks
        begin = min(self._key_before(ticks), int(self.index.ticks[max(0, row - 1)]))  # decoding goes on from there
        if self._current is None or was_left_out or not begin <= self._current[0] <= ticks:
            self._go_before(ticks)
        while self._current is not None and self._current[0] < ticks:
            if not is_wanted():
                return False
            self._step()
        return True

    def close(self) -> None:
        """Close the file."""
        self._stack.close()
        self._container, self._stream, self._frames, self._current = None, None, iter(()), None
        self._key = None
        self._passed.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _convert(self, number: int, frame: av.VideoFrame, *, is_exact: bool) -> Image:
        facts = self.index.facts
        parity = facts.parities[number % len(facts.parities)]
        with self._converting:
            rgb = rgb_from_decoded(DecodedImage(Fraction(0), frame, parity), facts, is_exact=is_exact)
        return rgb if parity is None else fill_rows(rgb, parity, facts.size[1])

    def _ticks(self, number: int) -> int:
        return int(self.index.ticks[number // len(self.index.facts.parities)])

    def _find(self, ticks: int) -> av.VideoFrame | None:
        return next((frame for each, frame in self._passed if each == ticks), None)

    def _step(self) -> None:
        self._current = next(self._frames, None)
        if self._current is not None:
            self._passed.append(self._current)
            if self._current[1].key_frame:
                self._key = self._current

    def _key_before(self, ticks: int) -> int:
        row = bisect_right(self.index.keys, ticks)
        return int(self.index.keys[row - 1]) if row else 0

    def _go_before(self, ticks: int) -> None:
        """Begin to decode at the last key frame from which a frame is reached; some containers seek past it."""
        keys = self.index.keys[: bisect_right(self.index.keys, ticks)]
        for key in keys[:0:-1]:
            self._begin(int(key))
            if self._current is not None and self._current[0] <= ticks:
                return
        self._begin(None)

    def _begin(self, key: int | None) -> None:
        """Begin at a key frame, or anew at the start, and decode one frame."""
        if key is None or self._container is None or self._stream is None:
            self.close()
            self._container, self._stream = _open(self._source, self._stack)
        container, stream = self._container, self._stream
        if key is not None:
            container.seek(key + self.index.first, stream=stream, backward=True)
        self._frames = self._decode(container, stream, self.index.first if key is None else key + self.index.first)
        self._step()

    def _decode(
        self, container: InputContainer, stream: VideoStream, start: int
    ) -> Iterator[tuple[int, av.VideoFrame]]:
        """Yield intact frames from a stamp on; those before it may lack what they are predicted from."""
        if not len(self.index.keys):
            yield from intact_frames(container, stream, size=self.index.facts.size_before_rotation)
            return

        def leave_out(packet: av.Packet) -> None:
            is_before = packet.pts is not None and packet.pts - self.index.first < self._whole_from
            stream.codec_context.skip_frame = "NONREF" if is_before else "DEFAULT"

        first: int | None = None
        size = self.index.facts.size_before_rotation
        for ticks, frame in intact_frames(container, stream, size=size, before_packet=leave_out):
            first = (frame.pts or 0) - ticks if first is None else first
            if ticks + first >= start:
                yield ticks + first - self.index.first, frame


def _open(source: VideoSource, stack: ExitStack) -> tuple[InputContainer, VideoStream]:
    container = stack.enter_context(open_file(source.name, source.path))
    stream = video_stream(container)
    if stream is None:
        raise VideoError(f"{source.name}: {source.path} holds no video stream; give a video, or copy it again")
    return container, stream
