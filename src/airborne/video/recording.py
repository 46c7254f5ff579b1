"""Several cameras' files as one stream of `Frames`, aligned by time."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from typing import Literal, get_args

from airborne.cameras import Camera, Rig
from airborne.errors import VideoError
from airborne.video.checks import check_exposures, check_overlap, describe_fields
from airborne.video.decoding import DecodedImage, VideoFacts, VideoSource, decode, inspect, rgb_from_decoded
from airborne.video.fields import fill_rows
from airborne.video.frames import Frames, View
from airborne.video.gaps import describe_gaps
from airborne.video.lazy import ConversionCache, lazy_view
from airborne.video.prefetch import read_ahead
from airborne.video.repeats import PictureChanges, describe_repeats
from airborne.video.sizes import check_sizes
from airborne.video.undistortion import Undistortion, undistortion_of

FieldsAs = Literal["rows", "interpolated"]
_LONGEST_GAP = 30_000  # times without an image of any camera: ten minutes at 50 Hz


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """The videos of one trial; iterating decodes them from the start and yields `Frames`.

    The first camera is the clock: index and time are those of its frames (or fields), continued at its rate over
    images that it lost and past its end, until every camera has ended. Another camera gives the image nearest in
    time, if within half of the clock's period, else None, as where it is left out; its `View` states the delay.
    """

    sources: tuple[VideoSource, ...]  # in the rig's order
    facts: tuple[VideoFacts, ...]
    rig: Rig
    fields_as: FieldsAs
    every: int
    start: int
    stop: int | None
    is_lazy: bool = False
    events: list[str] = field(default_factory=list)  # what the user should know, one line each; grows while reading
    _gaps: dict[str, dict[Fraction, Fraction]] = field(default_factory=dict)  # of each camera, from -> to [s]
    _repeats: dict[str, list[tuple[int, int]]] = field(default_factory=dict)  # of each camera, first and last frames
    _said_of_repeats: list[str] = field(default_factory=list)  # among the events
    _known: dict[tuple[str, bool], tuple[Camera, dict[int | None, Undistortion]]] = field(default_factory=dict)
    _changes: dict[str, PictureChanges] = field(default_factory=dict)  # of each camera's pictures, looked at once

    @property
    def rate(self) -> Fraction:
        """`Frames` in a second."""
        return self.facts[0].image_rate / self.every

    @property
    def n_images(self) -> int | None:
        """How many images the clock counts by the files' stated durations; None where the clock's file states none."""
        ends = [s.trial_time(f.duration_s) for s, f in zip(self.sources, self.facts, strict=True) if f.duration_s]
        if self.facts[0].duration_s is None:
            return None
        return round((max(ends) - self.sources[0].trial_time(Fraction(0))) * self.facts[0].image_rate)

    @property
    def n_frames(self) -> int | None:
        """How many `Frames` to expect by the files' stated durations; None where the clock's file states none."""
        n = self.n_images
        if n is None:
            return None
        return len(range(self.start, n if self.stop is None else min(n, self.stop), self.every))

    def __iter__(self) -> Generator[Frames]:
        period_s = 1 / self.facts[0].image_rate
        undistortions = [self._undistortions(camera, facts) for camera, facts in zip(self.rig, self.facts, strict=True)]
        with ExitStack() as open_files:
            open_files.callback(self._note_repeats)
            cursors = [
                _Cursor(open_files.enter_context(closing(self._decode_on_clock(source, facts))), half_s=period_s / 2)
                for source, facts in zip(self.sources, self.facts, strict=True)
            ]
            # nothing is converted yet in a lazy recording: threads would only wait for a core
            parallel = map if self.is_lazy else open_files.enter_context(ThreadPoolExecutor(len(cursors))).map
            conversions = [ConversionCache(min(facts.size)) for facts in self.facts]
            times = _clock(cursors, start_s=self.sources[0].trial_time(Fraction(0)), period_s=period_s)
            for index, time_s in enumerate(times):
                if self.stop is not None and index >= self.stop:
                    return
                pairs = zip(cursors, self.sources, strict=True)
                images = [None if source.is_left_out(index) else cursor.image_at(time_s) for cursor, source in pairs]
                if index >= self.start and (index - self.start) % self.every == 0:
                    views = parallel(partial(self._view, time_s=time_s), images, self.facts, undistortions, conversions)
                    pairs = zip(views, self.sources, strict=True)
                    exposed = (view and replace(view, exposure_s=source.exposure_s) for view, source in pairs)
                    yield Frames(index, time_s, tuple(exposed))

    def _undistortions(self, camera: Camera, facts: VideoFacts) -> dict[int | None, Undistortion]:
        """Return the undistortion of each kind of image in the file: whole (None), top field (0), bottom field (1).

        They are found once for all readings of a recording.
        """
        is_whole = facts.fields == "progressive" or self.fields_as == "interpolated"
        known = self._known.get((camera.name, is_whole))
        if known is None or known[0] is not camera:
            seen = {parity: camera if is_whole else camera.field(parity or 0) for parity in facts.parities}
            known = camera, {parity: undistortion_of(each) for parity, each in seen.items()}
            self._known[camera.name, is_whole] = known
        return known[1]

    def _view(
        self,
        image: DecodedImage | None,
        facts: VideoFacts,
        undistortions: dict[int | None, Undistortion],
        conversions: ConversionCache,
        *,
        time_s: Fraction,
    ) -> View | None:
        if image is None:
            return None
        delay_s = float(image.time_s - time_s)
        if self.is_lazy:
            return replace(lazy_view(image, facts, undistortions[image.parity], conversions), delay_s=delay_s)
        rgb, is_filled = rgb_from_decoded(image, facts), self.fields_as == "interpolated"
        rgb = fill_rows(rgb, image.parity, facts.size[1]) if is_filled and image.parity is not None else rgb
        return replace(undistortions[image.parity].view(rgb), delay_s=delay_s)

    def _decode_on_clock(self, source: VideoSource, facts: VideoFacts) -> Generator[DecodedImage]:
        """Yield a camera's images on the trial's clock, and note every gap and an early end."""
        period_s = 1 / facts.image_rate
        expected_s, changes = source.trial_time(Fraction(0)), self._changes.setdefault(source.name, PictureChanges())
        with closing(read_ahead(decode(source, facts))) as stream:
            for image in stream:
                time_s = source.trial_time(image.time_s)
                if time_s > expected_s + period_s / 2:
                    self._note_gap(source.name, expected_s, time_s)
                if changes.add(image):
                    self._add_repeat(source, time_s)
                else:
                    yield image._replace(time_s=time_s)
                expected_s = time_s + period_s
        if changes.is_still:
            self._note(f"{source.name}: its pictures are all the same: is the video a still one?")
        end_s = source.trial_time(facts.duration_s or Fraction(0))
        if facts.duration_s and expected_s < end_s - period_s / 2:
            self._note(
                f"{source.name}: the images end at {float(expected_s):.3f} s; the file promises {float(end_s):.3f} s"
            )

    def _add_repeat(self, source: VideoSource, time_s: Fraction) -> None:
        """Add a repeated image to its camera's runs of them."""
        frame = round((time_s - self.sources[0].trial_time(Fraction(0))) * self.facts[0].image_rate)
        runs = self._repeats.setdefault(source.name, [])
        if runs and frame <= runs[-1][1]:
            return  # a recording may be read twice
        if runs and frame == runs[-1][1] + 1:
            runs[-1] = runs[-1][0], frame
        else:
            runs.append((frame, frame))

    def _note_repeats(self) -> None:
        """Name all repeated images so far, in the place of what was said of them before."""
        said = [*describe_repeats(self._repeats)]
        self.events[:] = [*(event for event in self.events if event not in self._said_of_repeats), *said]
        self._said_of_repeats[:] = said

    def _note_gap(self, name: str, from_s: Fraction, to_s: Fraction) -> None:
        """Note a gap in the line that says all of a camera's."""
        gaps = self._gaps.setdefault(name, {})
        self.events[:] = [event for event in self.events if not gaps or event != describe_gaps(name, gaps)]
        gaps[from_s] = to_s
        self._note(describe_gaps(name, gaps))

    def _note(self, event: str) -> None:
        if event not in self.events:  # a recording may be read twice
            self.events.append(event)


def open_recording(
    sources: Sequence[VideoSource],
    rig: Rig,
    *,
    fields_as: FieldsAs = "rows",
    every: int = 1,
    start: int = 0,
    stop: int | None = None,
    lazy: bool = False,
    facts: Sequence[VideoFacts] | None = None,
) -> Recording:
    """Check the cameras' videos against the calibration and return their `Recording`; only first images are decoded.

    Each camera of the rig has one source of the same name; the rig's first camera is the clock. `fields_as` says what
    becomes of the fields of interlaced files: "rows" keeps the field's own rows with a camera of that half-height
    image; "interpolated" keeps the full height and fills the missing rows from their neighbours (rigid-body tracking
    paper), with the camera unchanged. Of the clock's images `start, start + every, ...` below `stop` are read. With
    `lazy` only the parts of an image that are read (`View.crop`) are converted; it needs "rows". `facts` are what
    `inspect` returned for the sources, where it has been called before.

    Raises VideoError where a file cannot be read, a size differs from the calibration's, or names do not match.
    """
    if fields_as not in get_args(FieldsAs):
        raise VideoError(f"fields_as = '{fields_as}' is unknown; use one of: {', '.join(get_args(FieldsAs))}")
    if every < 1 or start < 0 or (stop is not None and stop <= start):
        raise VideoError(f"every = {every}, start = {start}, stop = {stop}; expected every >= 1 and 0 <= start < stop")
    if lazy and fields_as != "rows":
        raise VideoError('a lazy recording reads fields as their own rows; use fields_as = "rows"')
    by_name = {source.name: k for k, source in enumerate(sources)}
    if len(by_name) != len(sources) or set(by_name) != set(rig.names):
        names = ", ".join(source.name for source in sources) or "none"
        raise VideoError(
            f"videos are given for {names}; the calibration has {', '.join(rig.names)}; give each one video"
        )
    ordered = tuple(sources[by_name[name]] for name in rig.names)
    ordered_facts = tuple(facts[by_name[name]] if facts else inspect(sources[by_name[name]]) for name in rig.names)
    check_sizes(ordered, rig, [fact.size for fact in ordered_facts])
    check_exposures(ordered, ordered_facts)
    check_overlap(ordered, ordered_facts)
    recording = Recording(ordered, ordered_facts, rig, fields_as, every, start, stop, lazy)
    recording.events.extend(describe_fields(ordered, ordered_facts))
    return recording


class _Cursor:
    """One camera's images, read once in order, with the next one always at hand."""

    def __init__(self, images: Iterator[DecodedImage], *, half_s: Fraction) -> None:
        self._pictures = images
        self._half_s = half_s  # half of the clock's period
        self._current: DecodedImage | None = None
        self._next = next(images, None)

    def image_at(self, time_s: Fraction) -> DecodedImage | None:
        """Return the image nearest to a time, if within half a period; times never go back, a tie takes the later."""
        self._advance(time_s)
        if self._current and -self._half_s < self._current.time_s - time_s <= self._half_s:
            return self._current
        return None

    def time_after(self, time_s: Fraction) -> Fraction | None:
        """Return the time of the first image after a time that was asked for; None at the end."""
        images = (image for image in (self._current, self._next) if image)
        return next((image.time_s for image in images if image.time_s > time_s), None)

    def is_over(self, time_s: Fraction) -> bool:
        """Whether no image is left for a time or any later one; times never go back."""
        self._advance(time_s)
        return self._next is None and (self._current is None or self._current.time_s <= time_s - self._half_s)

    def _advance(self, time_s: Fraction) -> None:
        while self._next and (
            self._current is None or abs(self._next.time_s - time_s) <= abs(self._current.time_s - time_s)
        ):
            self._current, self._next = self._next, next(self._pictures, None)


def _clock(cursors: Sequence[_Cursor], *, start_s: Fraction, period_s: Fraction) -> Iterator[Fraction]:
    """Yield the first camera's times; over a gap and past its end they go on by the period, until all are over.

    Raises VideoError where no camera has an image for longer than any recording is interrupted.
    """
    time_s, n_empty = start_s, 0
    while not all(cursor.is_over(time_s) for cursor in cursors):
        yield time_s
        n_empty = 0 if any(cursor.image_at(time_s) for cursor in cursors) else n_empty + 1
        if n_empty > _LONGEST_GAP:
            raise VideoError(
                f"no camera has a picture in the {n_empty} frames before {float(time_s):.3f} s, and there are later "
                "ones; correct offset_s, or convert the videos again"
            )
        following_s = cursors[0].time_after(time_s)
        if following_s is None or following_s >= time_s + period_s * Fraction(3, 2):
            following_s = time_s + period_s
        time_s = following_s
