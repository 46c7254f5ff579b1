"""Live sources: pipes, capture devices, cameras on the network, and files played at their own speed."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Literal

from av.container import InputContainer
from av.error import FFmpegError
from av.video.stream import VideoStream

from airborne.errors import VideoError
from airborne.video.containers import open_device, open_file, open_network, open_pipe, video_stream
from airborne.video.decoding import VideoSource

SourceKind = Literal["file", "pipe", "device", "network"]

_STDIN = "-"
POLL_S = 0.1  # how often a waiting reader checks whether it should stop
_PROBE = {"probesize": "1000000", "analyzeduration": "500000"}  # start early


def kind_of(source: VideoSource) -> SourceKind:
    """Return the kind of a live source; raises VideoError where there is none."""
    path = source.path
    if isinstance(path, str):
        return "network"
    if is_stdin(source) or path.is_fifo():
        return "pipe"
    if path.is_char_device():
        return "device"
    if path.is_file():
        return "file"
    raise VideoError(f"{source.name}: {path} is not a file, pipe or capture device; check its path")


def is_stdin(source: VideoSource) -> bool:
    """Say whether a source is the standard input, which cannot be opened again."""
    return isinstance(source.path, Path) and source.path.name == _STDIN


@contextmanager
def open_source(source: VideoSource, stop: Event) -> Iterator[tuple[InputContainer, VideoStream]]:
    """Open a live source and yield its container and video stream; reading ends early once `stop` is set.

    Raises VideoError where there are no images.
    """
    path, kind, pipe = source.path, kind_of(source), None
    try:
        if isinstance(path, str):
            container = open_network(path)
        elif kind == "pipe":
            pipe = _Pipe(path, stop)
            container = open_pipe(pipe, _PROBE)
        elif kind == "device":
            container = open_device(path)
        else:
            container = open_file(source.name, path)
    except (FFmpegError, OSError, ValueError) as error:
        if pipe is not None:
            pipe.close()
        reason = getattr(error, "strerror", None) or error
        raise VideoError(f"{source.name}: no images come from {path} ({reason}); check what sends them") from error
    try:
        with container:
            stream = video_stream(container)
            if stream is None:
                raise VideoError(f"{source.name}: what comes from {path} holds no video; send a video stream")
            yield container, stream
    finally:
        if pipe is not None:
            pipe.close()


class _Pipe:
    """A pipe, or the standard input, that FFmpeg reads and that can be abandoned at any time."""

    def __init__(self, path: Path, stop: Event) -> None:
        self._stop = stop
        self._is_own = path.name != _STDIN
        self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK) if self._is_own else sys.stdin.fileno()
        self._poll = select.poll()
        self._poll.register(self._file, select.POLLIN | select.POLLHUP)

    def read(self, n: int) -> bytes:
        """Wait for up to n bytes; none at the end, and once `stop` is set."""
        while not self._stop.is_set():
            if self._poll.poll(POLL_S * 1000):
                return os.read(self._file, n)
        return b""

    def close(self) -> None:
        """Close our end, so that the writer notices."""
        if self._is_own:
            os.close(self._file)
            self._is_own = False
