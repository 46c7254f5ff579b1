"""Images of a file in any order: each decoded when it is asked for."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from fractions import Fraction
from threading import Lock
from typing import Self

import av
from av.container import InputContainer
from av.video.stream import VideoStream

from airborne.errors import VideoError
from airborne.types import Image
from airborne.video.decoding import DecodedImage, VideoSource, intact_frames, rgb_from_decoded
from airborne.video.fields import fill_rows
from airborne.video.image_index import ImageIndex, open_stream

_KEPT_BYTES, _FEWEST_KEPT = 32_000_000, 2  # of a file's decoded frames, to step back: ten of 1080p


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
            self._container, self._stream = open_stream(self._source, self._stack)
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
