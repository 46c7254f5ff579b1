"""Live pictures as a stream of `Frames`: the newest of each camera, matched in time; what comes too late is dropped."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from threading import Condition, Event, Thread

from airborne.cameras import Rig
from airborne.errors import VideoError
from airborne.video.decoding import Picture, VideoFacts, VideoSource, facts_of, on_grid, sound_frames
from airborne.video.frames import Frames, View
from airborne.video.lazy import KnownColours, kept_view
from airborne.video.recording import check_sizes
from airborne.video.sources import LOOK_S, Kind, kind_of, opened_live
from airborne.video.undistortion import Lens, lens_of

N_KEPT = 16  # newest pictures of a camera that wait to be matched
PATIENCE_S, PATIENCE_PERIODS = 0.25, N_KEPT - 4  # how long a picture waits for those of the other cameras, at most
_MICRO = 1_000_000


@dataclass(slots=True, eq=False)
class _Arrived:
    picture: Picture
    at_s: float  # monotonic clock, when it was decoded


@dataclass(slots=True, eq=False)
class LiveCamera:
    """One camera: a thread that decodes all that comes and keeps the newest pictures."""

    source: VideoSource
    kind: Kind
    news: Condition  # shared by all cameras; guards everything below
    go: Event  # set when pictures begin to count
    stop: Event
    facts: VideoFacts | None = None
    error: VideoError | None = None
    has_ended: bool = False
    is_away: bool = False  # it was waited for in vain, and has not come since
    n_received: int = 0
    n_used: int = 0
    waiting: deque[_Arrived] = field(default_factory=lambda: deque(maxlen=N_KEPT))

    def run(self) -> None:
        """Read to the end; what goes wrong is kept for who waits."""
        try:
            self._read()
        except VideoError as error:
            with self.news:
                self.error = error
        finally:
            with self.news:
                self.has_ended = True
                self.news.notify_all()

    def _read(self) -> None:
        with opened_live(self.source, self.stop) as (container, stream):
            tick = stream.time_base or Fraction(1, _MICRO)
            begun_s = 0.0
            for n_ticks, frame in sound_frames(container, stream, size=None):
                if self.n_received == 1:
                    while not self.go.wait(LOOK_S) and not self.stop.is_set():
                        pass
                    begun_s = time.monotonic()
                if self.stop.is_set():
                    return
                facts = self.facts or facts_of(self.source, container, stream, frame)
                stamp_s = on_grid(n_ticks * tick, facts.frame_rate, tick)
                if self.kind == "file" and self.n_received:
                    self.stop.wait(max(begun_s + float(stamp_s) - time.monotonic(), 0))
                now_s = time.monotonic()
                if self.kind == "device" and self.n_received:
                    stamp_s = Fraction(round((now_s - begun_s) * _MICRO), _MICRO) + 1 / facts.frame_rate
                self._keep(Picture(self.source.on_clock(stamp_s), frame, None), facts, now_s)
        if self.facts is None and not self.stop.is_set():
            raise VideoError(f"{self.source.name}: no picture came from {self.source.path}; check what sends them")

    def _keep(self, picture: Picture, facts: VideoFacts, now_s: float) -> None:
        with self.news:
            self.facts = facts
            self.n_received += 1
            self.is_away = False
            self.waiting.append(_Arrived(picture, now_s))
            self.news.notify_all()

    def nearest(self, time_s: Fraction, half_s: Fraction) -> _Arrived | None:
        """Return the waiting picture nearest to a time, if within half a period."""
        near = min(self.waiting, key=lambda arrived: abs(arrived.picture.time_s - time_s), default=None)
        return near if near is not None and abs(near.picture.time_s - time_s) <= half_s else None

    def may_still_show(self, time_s: Fraction, half_s: Fraction) -> bool:
        """Whether a picture of a time can still come."""
        newest_s = self.waiting[-1].picture.time_s if self.waiting else None
        return not (self.has_ended or self.is_away) and (newest_s is None or newest_s < time_s - half_s)


@dataclass(slots=True, eq=False)
class LiveRecording:
    """The pictures of several live cameras; iterating yields `Frames` of the newest time that can be had.

    The first camera is the clock while its pictures come, then the next one. Another camera gives the picture nearest
    in time, if within half of the clock's period. Times are the stamps of files and pipes, counted from each one's
    first picture, and for capture devices the moments at which pictures arrive. A time whose pictures are not all there
    waits for a quarter of a second at most; then that camera is away until it comes back. Whatever is older than what
    was yielded is dropped. After the first pictures the cameras are held until more is asked for, so that whoever
    prepares at the first ones misses nothing of a file.
    """

    cameras: Sequence[LiveCamera]
    rig: Rig
    every: int = 1
    start: int = 0
    stop: int | None = None
    events: list[str] = field(default_factory=list)  # what the user should know, one line each
    arrived_s: float = 0.0  # monotonic clock: when the newest picture of the last frames had been decoded

    @property
    def rate(self) -> Fraction:
        """Frames in a second, if none is dropped."""
        return self._facts(0).image_rate / self.every

    @property
    def n_frames(self) -> None:
        """How many frames to expect: nobody knows."""
        return None

    def dropped(self) -> list[dict[str, str | int]]:
        """Return for each camera its name and how many pictures came, were used and were dropped."""
        with self.cameras[0].news:
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
        lenses = [lens_of(camera) for camera in self.rig]
        known = [KnownColours(min(self._facts(k).size)) for k in range(len(self.cameras))]
        period_s = 1 / self._facts(0).image_rate
        first_s, last_s, last_index = self.cameras[0].source.on_clock(Fraction(0)), None, -1
        while (found := self._next(last_s, period_s)) is not None:
            last_s, arrived = found
            index = max(round((last_s - first_s) / period_s), last_index + 1)
            if self.stop is not None and index >= self.stop:
                break
            if index >= self.start and (index - self.start) % self.every == 0:
                last_index = index
                self.arrived_s = max(each.at_s for each in arrived if each is not None)
                views = (self._view(k, each, lenses[k], known[k]) for k, each in enumerate(arrived))
                yield Frames(index, last_s, tuple(views))
            self.cameras[0].go.set()
        self._note_ends()

    def _facts(self, k: int) -> VideoFacts:
        facts = self.cameras[k].facts
        assert facts is not None, "known since it was connected"
        return facts

    def _view(self, k: int, arrived: _Arrived | None, lens: Lens, known: KnownColours) -> View | None:
        return None if arrived is None else kept_view(arrived.picture, self._facts(k), lens, known)

    def _next(self, last_s: Fraction | None, period_s: Fraction) -> tuple[Fraction, list[_Arrived | None]] | None:
        """Wait for the newest time after `last_s` that can be had, and take its pictures; None at the end."""
        half_s = period_s / 2
        news = self.cameras[0].news
        with news:
            while True:
                fresh = [
                    arrived
                    for camera in self.cameras
                    for arrived in reversed(camera.waiting)
                    if last_s is None or arrived.picture.time_s > last_s + half_s
                ]
                for arrived in fresh:
                    if self._is_ready(arrived, half_s):
                        return arrived.picture.time_s, self._take(arrived.picture.time_s, half_s)
                if not fresh and all(camera.has_ended for camera in self.cameras):
                    return None
                news.wait(float(half_s) if fresh else LOOK_S)

    def _is_ready(self, arrived: _Arrived, half_s: Fraction) -> bool:
        """Say whether no camera need be waited for; one that was waited for long enough counts as away."""
        late = [camera for camera in self.cameras if camera.may_still_show(arrived.picture.time_s, half_s)]
        if late and time.monotonic() - arrived.at_s > min(PATIENCE_S, PATIENCE_PERIODS * 2 * half_s):
            for camera in late:
                camera.is_away = True
            return True
        return not late

    def _take(self, time_s: Fraction, half_s: Fraction) -> list[_Arrived | None]:
        """Take every camera's picture of a time out of what waits, and drop what is older."""
        taken = [camera.nearest(time_s, half_s) for camera in self.cameras]
        for camera, arrived in zip(self.cameras, taken, strict=True):
            camera.n_used += arrived is not None
            while camera.waiting and camera.waiting[0].picture.time_s <= time_s + half_s:
                camera.waiting.popleft()
        return taken

    def _note_ends(self) -> None:
        for camera in self.cameras:
            if camera.error is not None:
                self.events.append(f"{camera.source.name}: the pictures broke off: {camera.error}")


@contextmanager
def connected(
    sources: Sequence[VideoSource], waiting: Callable[[], None] = lambda: None
) -> Iterator[tuple[LiveCamera, ...]]:
    """Connect to live sources and wait for the first picture of each; `waiting` is called now and then meanwhile.

    Raises VideoError where a source is nothing that gives pictures, two read from one pipe or device, or fields
    are asked for.
    """
    interlaced = [source.name for source in sources if source.fields not in ("progressive", "auto")]
    if interlaced:
        raise VideoError(f"{interlaced[0]}: live pictures are read as whole frames; remove fields from its [[camera]]")
    paths = [str(source.path) for source in sources]
    twice = [path for path in paths if paths.count(path) > 1 and kind_of(sources[paths.index(path)]) != "file"]
    if twice:
        raise VideoError(f"two cameras read from {twice[0]}; give each a pipe or device of its own")
    news, go, stop = Condition(), Event(), Event()
    cameras = tuple(LiveCamera(source, kind_of(source), news, go, stop) for source in sources)
    threads = [Thread(target=camera.run, name=f"live {camera.source.name}", daemon=True) for camera in cameras]
    try:
        for thread in threads:
            thread.start()
        with news:
            while any(camera.facts is None for camera in cameras):
                failed = next((camera.error for camera in cameras if camera.error is not None), None)
                if failed is not None:
                    raise failed
                news.wait(LOOK_S)
                waiting()
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
    check_sizes([camera.source for camera in cameras], rig, facts)
    return LiveRecording(cameras, rig, every, start, stop)
