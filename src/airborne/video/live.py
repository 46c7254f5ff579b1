"""Live images as a stream of `Frames`: the newest of each camera, matched in time; what arrives too late is dropped."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from statistics import median
from threading import Condition, Event, Thread

from airborne.cameras import Rig
from airborne.errors import VideoError
from airborne.video.decoding import DecodedImage, VideoFacts, VideoSource, facts_of, intact_frames, snap_to_grid
from airborne.video.frames import Frames, View
from airborne.video.lazy import ConversionCache, lazy_view
from airborne.video.sizes import check_sizes
from airborne.video.sources import POLL_S, SourceKind, is_stdin, kind_of, open_source
from airborne.video.undistortion import Undistortion, undistortion_of

_BUFFER_LENGTH = 16  # images of a camera that wait to be matched, the newest
_LONGEST_WAIT_S, _LONGEST_WAIT_PERIODS = 0.25, _BUFFER_LENGTH - 4  # of an image, for those of the other cameras
_RETRY_S = 0.5  # before a source whose sender went away is opened again
_CLOCK_LENGTH = 50  # images that say how far arrivals are behind stamps
_CLOCK_S = 0.5  # of images that come again, to learn that
_MICRO = 1_000_000  # to a second: the clock of a stream that has none


@dataclass(slots=True, eq=False)
class _Arrival:
    image: DecodedImage
    decoded_s: float  # when, on the monotonic clock


@dataclass(slots=True, eq=False)
class LiveCamera:
    """One camera: a thread that decodes whatever arrives and keeps the newest images."""

    source: VideoSource
    kind: SourceKind
    changed: Condition  # shared by all cameras; guards everything below
    begin: Event  # set when images start to count
    stop: Event
    facts: VideoFacts | None = None
    error: VideoError | None = None
    has_ended: bool = False  # nobody sends any more
    is_away: bool = False  # waited for in vain, and nothing has come since
    delays_s: deque[float] = field(default_factory=lambda: deque(maxlen=_CLOCK_LENGTH))  # of arrivals behind stamps
    shift_s: Fraction = Fraction(0)  # added to the stamps of a sender that came back, which count from its first image
    n_received: int = 0
    n_returns: int = 0  # senders that came after the first one had ended
    n_used: int = 0
    buffer: deque[_Arrival] = field(default_factory=lambda: deque(maxlen=_BUFFER_LENGTH))

    def run(self) -> None:
        """Read to the end, and again where a sender comes back; an error is stored for the waiting thread."""
        while not self.stop.is_set():
            error = None
            try:
                self._read()
            except VideoError as failure:
                error = failure
            with self.changed:
                self.error = error
                self.has_ended = True
                self.changed.notify_all()
            if self.facts is None or self.kind == "file" or is_stdin(self.source):
                return
            self.stop.wait(_RETRY_S)

    def _read(self) -> None:
        known = self.facts
        delay_s = (median(self.delays_s) if self.delays_s else 0.0) - float(self.shift_s)  # the last ones came at once
        with open_source(self.source, self.stop) as (container, stream):
            tick = stream.time_base or Fraction(1, _MICRO)
            size = None if known is None else known.size_before_rotation
            self.delays_s.clear()
            start_s = opened_s = time.monotonic()
            for n_ticks, frame in intact_frames(container, stream, size=size):
                if self.n_received == 1:
                    while not self.begin.wait(POLL_S) and not self.stop.is_set():
                        pass
                    start_s = time.monotonic()
                if self.stop.is_set():
                    return
                facts = self.facts or facts_of(self.source, container, stream, frame)
                stamp_s = snap_to_grid(n_ticks * tick, facts.frame_rate, tick)
                if self.kind == "file" and self.n_received:
                    self.stop.wait(max(start_s + float(stamp_s) - time.monotonic(), 0))
                now_s = time.monotonic()
                if self.kind == "device" and self.n_received:
                    stamp_s = Fraction(round((now_s - start_s) * _MICRO), _MICRO) + 1 / facts.frame_rate
                self.delays_s.append(now_s - float(stamp_s))
                if known is not None and (now_s < opened_s + _CLOCK_S or len(self.delays_s) == 1):
                    self.shift_s = Fraction(round((min(self.delays_s) - delay_s) * _MICRO), _MICRO)
                    continue
                self._keep(DecodedImage(self.source.trial_time(stamp_s + self.shift_s), frame, None), facts, now_s)
        if self.facts is None and not self.stop.is_set():
            raise VideoError(f"{self.source.name}: no image came from {self.source.path}; check what sends them")
        if self.kind == "network" and not self.stop.is_set():
            raise VideoError(f"{self.source.path} says nothing any more; check the camera and its network")

    def _keep(self, image: DecodedImage, facts: VideoFacts, now_s: float) -> None:
        with self.changed:
            self.facts = facts
            self.n_received += 1
            self.n_returns += self.has_ended
            self.is_away = self.has_ended = False
            self.error = None
            self.buffer.append(_Arrival(image, now_s))
            self.changed.notify_all()

    def nearest(self, time_s: Fraction, half_s: Fraction) -> _Arrival | None:
        """Return the waiting image nearest to a time, if within half a period."""
        near = min(self.buffer, key=lambda arrival: abs(arrival.image.time_s - time_s), default=None)
        return near if near is not None and abs(near.image.time_s - time_s) <= half_s else None

    def may_still_deliver(self, time_s: Fraction, half_s: Fraction) -> bool:
        """Whether an image of a time can still arrive."""
        newest_s = self.buffer[-1].image.time_s if self.buffer else None
        return not (self.has_ended or self.is_away) and (newest_s is None or newest_s < time_s - half_s)


@dataclass(slots=True, eq=False)
class LiveRecording:
    """The images of several live cameras; iterating yields `Frames` of the newest complete time.

    The first camera is the clock while it delivers, then the next one. Every other camera contributes its nearest
    image, if within half of the clock's period. Times are the stamps of files and pipes, counted from each one's
    first image, and for capture devices the moments of arrival. A time whose images are incomplete waits for a
    quarter of a second at most; the missing camera then counts as away until it comes back. What is sent by a pipe, a
    device or a network camera is opened again after its end, until all have ended. Whatever is older than the last
    frames is dropped. After the first images the cameras pause until more is asked for, so that preparing on the
    first ones misses nothing of a file.
    """

    cameras: Sequence[LiveCamera]
    rig: Rig
    every: int = 1
    start: int = 0
    stop: int | None = None
    events: list[str] = field(default_factory=list)  # what the user should know, one line each
    arrival_s: float = 0.0  # monotonic clock: when the newest image of the last frames was decoded

    @property
    def rate(self) -> Fraction:
        """Frames in a second, if none is dropped."""
        return self._facts(0).image_rate / self.every

    @property
    def n_frames(self) -> None:
        """How many frames to expect: unknown."""
        return None

    def image_counts(self) -> list[dict[str, str | int]]:
        """Return each camera's name and how many images were received, used and dropped."""
        with self.cameras[0].changed:
            return [
                {
                    "name": camera.source.name,
                    "n_received": camera.n_received,
                    "n_used": camera.n_used,
                    "n_dropped": camera.n_received - camera.n_used,
                }
                for camera in self.cameras
            ]

    def __iter__(self) -> Generator[Frames]:
        undistortions = [undistortion_of(camera) for camera in self.rig]
        conversions = [ConversionCache(min(self._facts(k).size)) for k in range(len(self.cameras))]
        period_s = 1 / self._facts(0).image_rate
        first_s, last_s, last_index = self.cameras[0].source.trial_time(Fraction(0)), None, -1
        while (following := self._next(last_s, period_s)) is not None:
            last_s, arrivals = following
            index = max(round((last_s - first_s) / period_s), last_index + 1)
            if self.stop is not None and index >= self.stop:
                break
            if index >= self.start and (index - self.start) % self.every == 0:
                last_index = index
                self.arrival_s = max(each.decoded_s for each in arrivals if each is not None)
                views = (self._view(k, each, undistortions[k], conversions[k]) for k, each in enumerate(arrivals))
                yield Frames(index, last_s, tuple(views))
            self.cameras[0].begin.set()
        self._note_ends()

    def _facts(self, k: int) -> VideoFacts:
        facts = self.cameras[k].facts
        assert facts is not None, "set once the camera is connected"
        return facts

    def _view(
        self, k: int, arrival: _Arrival | None, undistortion: Undistortion, conversions: ConversionCache
    ) -> View | None:
        if arrival is None:
            return None
        view = lazy_view(arrival.image, self._facts(k), undistortion, conversions)
        return replace(view, exposure_s=self.cameras[k].source.exposure_s)

    def _next(self, last_s: Fraction | None, period_s: Fraction) -> tuple[Fraction, list[_Arrival | None]] | None:
        """Wait for the newest complete time after `last_s`, and take its images; None at the end."""
        half_s = period_s / 2
        changed = self.cameras[0].changed
        with changed:
            while True:
                fresh = [
                    arrival
                    for camera in self.cameras
                    for arrival in reversed(camera.buffer)
                    if last_s is None or arrival.image.time_s > last_s + half_s
                ]
                for arrival in fresh:
                    if self._is_ready(arrival, half_s):
                        return arrival.image.time_s, self._take(arrival.image.time_s, half_s)
                if not fresh and all(camera.has_ended for camera in self.cameras):
                    return None
                changed.wait(float(half_s) if fresh else POLL_S)

    def _is_ready(self, arrival: _Arrival, half_s: Fraction) -> bool:
        """Say whether no camera has to be waited for; one that is too late counts as away."""
        late = [camera for camera in self.cameras if camera.may_still_deliver(arrival.image.time_s, half_s)]
        if late and time.monotonic() - arrival.decoded_s > min(_LONGEST_WAIT_S, _LONGEST_WAIT_PERIODS * 2 * half_s):
            for camera in late:
                camera.is_away = True
            return True
        return not late

    def _take(self, time_s: Fraction, half_s: Fraction) -> list[_Arrival | None]:
        """Take every camera's image of a time out of its buffer, and drop what is older."""
        nearest = [camera.nearest(time_s, half_s) for camera in self.cameras]
        for camera, arrival in zip(self.cameras, nearest, strict=True):
            camera.n_used += arrival is not None
            while camera.buffer and camera.buffer[0].image.time_s <= time_s + half_s:
                camera.buffer.popleft()
        return nearest

    def _note_ends(self) -> None:
        for camera in self.cameras:
            if camera.error is not None:
                self.events.append(f"{camera.source.name}: the images broke off: {camera.error}")
            if camera.n_returns:
                self.events.append(
                    f"{camera.source.name}: went away and came back {camera.n_returns}×; "
                    "from then on its times follow its images' arrival"
                )


@contextmanager
def connect(
    sources: Sequence[VideoSource], on_wait: Callable[[], None] = lambda: None
) -> Iterator[tuple[LiveCamera, ...]]:
    """Connect to live sources and wait for the first image of each; `on_wait` is called now and then meanwhile.

    Raises VideoError where a source gives no images, where two read from one pipe or device, or where one is to be
    read by fields.
    """
    interlaced = [source.name for source in sources if source.fields not in ("progressive", "auto")]
    if interlaced:
        raise VideoError(f"{interlaced[0]}: live images are read as whole frames; remove fields from its [[camera]]")
    paths = [str(source.path) for source in sources]
    twice = [path for path in paths if paths.count(path) > 1 and kind_of(sources[paths.index(path)]) != "file"]
    if twice:
        raise VideoError(f"two cameras read from {twice[0]}; give each a pipe or device of its own")
    changed, begin, stop = Condition(), Event(), Event()
    cameras = tuple(LiveCamera(source, kind_of(source), changed, begin, stop) for source in sources)
    threads = [Thread(target=camera.run, name=f"live {camera.source.name}", daemon=True) for camera in cameras]
    try:
        for thread in threads:
            thread.start()
        with changed:
            while any(camera.facts is None for camera in cameras):
                failed = next((camera.error for camera in cameras if camera.error is not None), None)
                if failed is not None:
                    raise failed
                changed.wait(POLL_S)
                on_wait()
        yield cameras
    finally:
        stop.set()
        for thread in threads:
            thread.join(timeout=2)


def live_recording(
    cameras: Sequence[LiveCamera], rig: Rig, *, every: int = 1, start: int = 0, stop: int | None = None
) -> LiveRecording:
    """Check connected cameras against the calibration, in its order, and return their recording.

    Raises VideoError where a size differs from the calibration's.
    """
    facts = [camera.facts for camera in cameras if camera.facts is not None]
    check_sizes([camera.source for camera in cameras], rig, [fact.size for fact in facts])
    return LiveRecording(cameras, rig, every, start, stop)
