"""One camera's file: its properties, and its images in order of time, each decoded once."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Literal, NamedTuple, get_args

import av
from av.container import InputContainer
from av.error import BlockingIOError as NothingYet
from av.error import FFmpegError
from av.filter import Graph
from av.video.stream import VideoStream

from airborne.errors import VideoError
from airborne.types import Image
from airborne.video.containers import open_file, video_stream
from airborne.video.pixels import field_frame, rgb_from_frame

FieldOrder = Literal["progressive", "top-first", "bottom-first"]
FieldOrderOption = Literal["progressive", "top-first", "bottom-first", "auto"]

_FALSE_RATE, _FEWEST_INDEXED = 2, 3  # chosen: times the rate of the pictures; of them, for a rate


@dataclass(frozen=True, slots=True)
class VideoSource:
    """One camera's video: a file; live also a pipe, a capture device, or a camera on the network."""

    name: str  # the camera's name
    path: Path | str  # text: an address, rtsp://...
    fields: FieldOrderOption = "progressive"
    offset_s: Fraction | float = 0  # added to this camera's times [s]
    drift_ppm: Fraction | float = 0  # by how much its clock is slow, in millionths
    exposure_s: float = 0.0  # of each image, about its time [s]
    left_out: tuple[tuple[int, int], ...] = ()  # frames of the trial without it: first and last of each stretch

    def __post_init__(self) -> None:
        if self.fields not in get_args(FieldOrderOption):
            allowed = ", ".join(get_args(FieldOrderOption))
            raise VideoError(f"{self.name}: fields = '{self.fields}' is unknown; use one of: {allowed}")

    def is_left_out(self, frame: int) -> bool:
        """Whether the camera is not used at a frame of the trial."""
        return any(first <= frame <= last for first, last in self.left_out)

    def trial_time(self, time_s: Fraction) -> Fraction:
        """Convert a time since the file's first image to the trial's clock [s].

        Offset and drift are taken as the decimals written in the trial file, not as their nearest binary numbers.
        """
        return _as_written(self.offset_s) + time_s * (1 + _as_written(self.drift_ppm) / 1_000_000)


@cache
def _as_written(number: Fraction | float) -> Fraction:
    return Fraction(str(number))


@dataclass(frozen=True, slots=True)
class VideoFacts:
    """What a video file states, and how it will be read."""

    size: tuple[int, int]  # (width, height) as shown, after any rotation [px]
    frame_rate: Fraction  # [1/s]; two fields count as one frame
    duration_s: Fraction | None  # None where the file does not state it
    flagged_order: FieldOrder  # by the stream's own flags
    fields: FieldOrder  # how it is read
    rotation_deg: int  # anticlockwise quarter turns that the file asks for
    n_cut: int = 0  # images that the file's index names beyond its end

    @property
    def parities(self) -> tuple[int | None, ...]:
        """The images of one frame in order of time: (None,) for a whole frame, else 0 for top and 1 for bottom."""
        return {"progressive": (None,), "top-first": (0, 1), "bottom-first": (1, 0)}[self.fields]

    @property
    def image_rate(self) -> Fraction:
        """Images in a second: frames, or fields where the file is read by fields."""
        return self.frame_rate * len(self.parities)

    @property
    def size_before_rotation(self) -> tuple[int, int]:
        """The size before rotation."""
        width, height = self.size
        return (height, width) if self.rotation_deg % 180 else (width, height)


class DecodedImage(NamedTuple):
    """One image, still in the file's own colours."""

    time_s: Fraction  # since the file's first image [s]
    frame: av.VideoFrame
    parity: int | None  # of the field; None for a whole frame


def inspect(source: VideoSource) -> VideoFacts:
    """Open a file, decode its first image and close it again.

    Raises VideoError, in one line, where there is no readable video, or where a rotated one is to be read by fields.
    """
    with _open(source) as (container, stream):
        frame = next((image for _, image in intact_frames(container, stream, size=None)), None)
        if frame is None:
            raise VideoError(f"{source.name}: no image of {source.path} can be decoded; copy or convert it again")
        return facts_of(source, container, stream, frame)


def facts_of(source: VideoSource, container: InputContainer, stream: VideoStream, frame: av.VideoFrame) -> VideoFacts:
    """Return what an open video states, given its first image.

    Raises VideoError where it states no frame rate, or where a rotated one is to be read by fields.
    """
    rate = _rate(container, stream)
    if not rate:
        raise VideoError(f"{source.name}: {source.path} states no frame rate; convert it to a constant rate")
    if frame.rotation % 90:
        raise VideoError(f"{source.name}: {source.path} is tagged as rotated by {frame.rotation}°; only quarter turns")
    flagged = _field_order(stream, frame)
    fields = flagged if source.fields == "auto" else source.fields
    if fields != "progressive" and frame.rotation:
        raise VideoError(f"{source.name}: {source.path} is both interlaced and rotated; remove its rotation tag")
    width, height = frame.width, frame.height
    return VideoFacts(
        size=(height, width) if frame.rotation % 180 else (width, height),
        frame_rate=_exact_rate(rate),
        duration_s=_duration_s(container, stream),
        flagged_order=flagged,
        fields=fields,
        rotation_deg=frame.rotation % 360,
        n_cut=_count_cut(Path(source.path), stream),
    )


def decode(source: VideoSource, facts: VideoFacts) -> Generator[DecodedImage]:
    """Decode a file from its start: images in order of time, fields at their own times.

    Time 0 is the first image's stamp. A stamp is exact: `pts * time_base`, snapped to a multiple of the frame's
    duration where it lies within the stamp's own resolution of one. Damaged images are left out, and after a damaged
    key frame all images up to the next one. Decoding runs on one thread, so that damage never depends on the machine.
    """
    with _open(source) as (container, stream):
        tick = stream.time_base or Fraction(1, 1_000_000)
        for n_ticks, frame in intact_frames(container, stream, size=facts.size_before_rotation):
            time_s = snap_to_grid(n_ticks * tick, facts.frame_rate, tick)
            for j, parity in enumerate(facts.parities):
                yield DecodedImage(time_s + j / facts.image_rate, frame, parity)


def rgb_from_decoded(image: DecodedImage, facts: VideoFacts, *, is_exact: bool = True) -> Image:
    """Convert an image to sRGB (h, w, 3), a field with its own rows only; see `rgb_from_frame`."""
    frame = image.frame if image.parity is None else field_frame(image.frame, image.parity)
    return rgb_from_frame(frame, short_side=min(facts.size), rotation_deg=facts.rotation_deg, is_exact=is_exact)


@contextmanager
def _open(source: VideoSource) -> Iterator[tuple[InputContainer, VideoStream]]:
    with open_file(source.name, source.path) as container:
        stream = video_stream(container)
        if stream is None:
            raise VideoError(
                f"{source.name}: {source.path} holds no video stream that can be read; give a video, or copy it again"
            )
        yield container, stream


def intact_frames(
    container: InputContainer,
    stream: VideoStream,
    *,
    size: tuple[int, int] | None,
    before_packet: Callable[[av.Packet], None] = lambda packet: None,
) -> Iterator[tuple[int, av.VideoFrame]]:
    """Yield (ticks since the first image, frame) for every intact frame, of `size` if given.

    `before_packet` is called with each packet before it is decoded.
    """
    first, last, step = None, None, 1
    first_stamp = None  # of the packets: when a damaged beginning would have been shown
    is_damaged = False
    key_stamps: set[int] = set()  # key frames sent to the decoder that have not come out intact
    for packet in _packets(container, stream):
        if packet.pts is not None and not packet.is_discard:
            first_stamp = packet.pts if first_stamp is None else min(first_stamp, packet.pts)
            if packet.is_keyframe:
                key_stamps.add(packet.pts)
            step = packet.duration or step
        before_packet(packet)
        try:
            frames = stream.decode(packet)
        except FFmpegError:
            is_damaged = True
            continue
        for frame in frames:
            stamp = frame.pts if frame.pts is not None else (0 if last is None else last + step)
            if frame.is_corrupt or (size and (frame.width, frame.height) != size):
                is_damaged = True
                continue
            if is_damaged and not frame.key_frame and any(key <= stamp for key in key_stamps):
                continue
            if first is None:
                first = first_stamp if is_damaged and first_stamp is not None else stamp
            is_damaged = is_damaged and not frame.key_frame
            key_stamps = {key for key in key_stamps if key > stamp or is_damaged}
            if last is None or stamp > last:
                yield stamp - first, frame
            last = stamp


def _packets(container: InputContainer, stream: VideoStream) -> Iterator[av.Packet]:
    """Yield the packets up to the end, or up to where the file breaks off; the last, empty one drains the decoder."""
    try:
        yield from container.demux(stream)
    except FFmpegError:
        yield av.Packet()


def _count_cut(path: Path, stream: VideoStream) -> int:
    """Count the images that a file's index names beyond its end, as where it was not copied whole; 0 for a pipe."""
    size = path.stat().st_size if path.is_file() else math.inf
    return sum(entry.pos + entry.size > size for entry in stream.index_entries)


def _rate(container: InputContainer, stream: VideoStream) -> Fraction | None:
    """Return the rate that a file states [1/s]; None where it states none.

    An AVI file states how finely it counts time, which may be finer than its pictures follow one another: then the
    rate is that of their median step, as its index has it, which lists every picture. So does the index of an MP4 or
    QuickTime file, which states the mean rate: where pictures are missing between others at equal steps, theirs counts.
    """
    stated = stream.average_rate or stream.guessed_rate
    lists_all = container.format.name == "avi" or "mp4" in container.format.name.split(",")
    stamps = sorted(entry.timestamp for entry in stream.index_entries) if lists_all else []
    if not stated or not stream.time_base or len(stamps) < _FEWEST_INDEXED:
        return stated
    steps = [b - a for a, b in pairwise(stamps)]
    step = int(median(steps))
    if container.format.name == "avi":
        return 1 / (step * stream.time_base) if step * stream.time_base * stated >= _FALSE_RATE else stated
    passed = [round(each / step) for each in steps] if step else []  # steps of the recording from picture to picture
    has_gaps = any(n > 1 for n in passed)
    is_even = all(n and abs(each - n * step) <= n for n, each in zip(passed, steps, strict=False))
    return sum(passed) / ((stamps[-1] - stamps[0]) * stream.time_base) if has_gaps and is_even else stated


def _exact_rate(rate: Fraction) -> Fraction:
    """Return n · 1000/1001 where a container stores that rate only approximately (Matroska has 19001/317 for 59.94)."""
    broadcast = Fraction(round(rate * 1001 / 1000) * 1000, 1001)
    return broadcast if abs(broadcast - rate) < rate / 1_000_000 else rate


def snap_to_grid(time_s: Fraction, rate: Fraction, tick: Fraction) -> Fraction:
    """Snap a stamp to a multiple of the frame's duration where it lies within its own resolution of one."""
    nearest = round(time_s * rate) / rate
    return nearest if abs(nearest - time_s) <= tick else time_s


def _duration_s(container: InputContainer, stream: VideoStream) -> Fraction | None:
    if stream.duration and stream.time_base:
        return stream.duration * stream.time_base
    begins = max(container.start_time or 0, 0)  # such containers count from 0, whenever their first image is shown
    return Fraction(container.duration - begins, av.time_base) if container.duration else None


def _field_order(stream: VideoStream, frame: av.VideoFrame) -> FieldOrder:
    """Read the field order off the decoded frame; the codec's own tag is wrong for some bottom-first files."""
    if not frame.interlaced_frame:
        return "progressive"
    graph = Graph()
    top_first = graph.add("select", "eq(interlace_type,TOPFIRST)")
    graph.link_nodes(graph.add_buffer(template=stream), top_first, graph.add("buffersink")).configure()
    graph.vpush(frame)
    try:
        graph.vpull()
    except NothingYet:
        return "bottom-first"
    return "top-first"
