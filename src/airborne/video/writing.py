"""Writing of videos, progressive or interlaced."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from av.codec.context import Flags
from av.error import FFmpegError
from av.filter import Graph
from av.video.reformatter import ColorRange, Colorspace

from airborne.errors import VideoError
from airborne.io.writing import explain_full_disk
from airborne.types import Image
from airborne.video.decoding import FieldOrder
from airborne.video.pixels import frame_from_rgb, matrix_for, weave_frame

_N_THREADS = 4  # fixed: the encoder's output depends on it
_FRAGMENTED = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "flush_packets": "1"}
_BT709, _SMPTE170M = 1, 6  # colour matrix tags (ITU-T H.273)
_CHROMA_IN_THE_MIDDLE = "chromaloc=1"  # of its 2 x 2 pixels, as FFmpeg averages them; unsaid, H.264's lies to the left
_CODED_FIELD_ORDER = {"top-first": 2, "bottom-first": 3}  # FFmpeg's AV_FIELD_TT, AV_FIELD_BB


class VideoWriter:
    """Writes an MP4 (H.264, 4:2:0) image by image, in a `with` block.

    The file is written in fragments of about a second, so that what a killed run wrote can be played; beside an earlier
    file, under the name `<stem>.part.mp4`, so that the earlier one can be played until the new one is whole. An odd
    width or height is made even by repeating the last column or row. A file of `fields` "top-first" or "bottom-first"
    takes woven images (see `weave`), is encoded field by field and flagged so; its height is a multiple of four.
    """

    def __init__(
        self,
        path: Path,
        *,
        size: tuple[int, int],
        rate: Fraction,
        fields: FieldOrder = "progressive",
        crf: int = 18,
        preset: str = "medium",
    ) -> None:
        """Start a file of images of `size` (width, height) [px] at `rate` [1/s]; `crf` 0 is lossless, 51 worst.

        preset: of x264, "ultrafast" to "veryslow": how much time is spent on a smaller file of the same quality.

        Raises VideoError where the file cannot be written or the height does not suit the fields.
        """
        width, height = size
        if fields != "progressive" and height % 4:
            raise VideoError(f"{path}: an interlaced video's height is a multiple of 4, found {height}; pad the image")
        self.path, self.size = (path := Path(path)), size
        self._unfinished = path.with_suffix(f".part{path.suffix}") if path.is_file() else path
        self._time_base = 1 / Fraction(rate)
        self._container = av.open(f"file:{self._unfinished.absolute()}", "w", format="mp4", options=_FRAGMENTED)
        options = {"crf": str(crf), "preset": preset, "bf": "0", "x264-params": _CHROMA_IN_THE_MIDDLE}
        self._stream = self._container.add_stream("libx264", rate=rate, options=options)
        codec = self._stream.codec_context
        codec.width, codec.height, codec.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
        codec.gop_size = round(rate) or 1
        codec.thread_count = _N_THREADS
        codec.colorspace = _BT709 if matrix_for(min(size)) == Colorspace.ITU709 else _SMPTE170M
        codec.color_range = ColorRange.MPEG
        self._field_filter: Graph | None = None
        if fields != "progressive":
            codec.flags |= Flags.interlaced_dct | Flags.interlaced_me
            codec.field_order = _CODED_FIELD_ORDER[fields]
            self._field_filter = _field_filter_graph(codec, "tff" if fields == "top-first" else "bff", self._time_base)
        try:
            self._container.start_encoding()
        except (FFmpegError, OSError) as error:
            raise VideoError(f"{path} cannot be written ({error.strerror}); check its folder") from error
        self._n_written = 0

    def write(self, rgb: Image) -> None:
        """Append an image (h, w, 3) sRGB; raises VideoError where its size is not the file's."""
        width, height = self.size
        if rgb.shape != (height, width, 3):
            actual = "×".join(map(str, rgb.shape))
            raise VideoError(f"{self.path}: an image of {actual} was given, expected {height}×{width}×3")
        even = np.pad(rgb, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        side = min(self.size)
        if self._field_filter is None:
            frame = frame_from_rgb(even, short_side=side)
        else:
            frame = weave_frame(*(frame_from_rgb(even[parity::2], short_side=side) for parity in (0, 1)))
        frame.pts, frame.time_base = self._n_written, self._time_base
        self._n_written += 1
        if self._field_filter is not None:
            self._field_filter.vpush(frame)
            frame = self._field_filter.vpull()
        with explain_full_disk(self.path):
            self._container.mux(self._stream.encode(frame))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the file; after an error too, so that it holds what was written, unless there is an earlier file."""
        with explain_full_disk(self.path):
            self._container.mux(self._stream.encode(None))
            self._container.close()
        if self._unfinished != self.path:
            if kind is None:
                self._unfinished.replace(self.path)
            else:
                self._unfinished.unlink()


def _field_filter_graph(codec: av.VideoCodecContext, order: str, time_base: Fraction) -> Graph:
    """Return a filter that flags frames as interlaced; PyAV cannot set this flag."""
    graph = Graph()
    source = graph.add_buffer(width=codec.width, height=codec.height, format=codec.format, time_base=time_base)
    graph.link_nodes(source, graph.add("setfield", order), graph.add("buffersink")).configure()
    return graph
