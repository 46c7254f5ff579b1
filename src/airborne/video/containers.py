"""The one place where videos and sound are opened: a file is opened as a file, of a kind that holds its own pictures.

FFmpeg would take a name such as `http:/host/x.mp4` or `concat:a|b` for an address, and open what a playlist names.
"""

from __future__ import annotations

import errno
import time
from pathlib import Path
from typing import IO, Any

import av
from av.container import InputContainer
from av.error import FFmpegError, InvalidDataError
from av.video.stream import VideoStream

from airborne.errors import VideoError
from airborne.io.environment import MOST_PIXELS

_KINDS = (  # of container, as FFmpeg names them; none opens a second file
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,mpegvideo,m4v,h264,hevc,vvc,av1,obu,ivf,mxf,gxf,asf,flv,"
    "live_flv,ogg,nut,dv,cine,mjpeg,mjpeg_2000,mpjpeg,yuv4mpegpipe,vc1,dirac,wav,w64,aiff,caf,flac,mp3,aac,ac3"
)
_SILENCE_S = 10.0  # after which a camera on the network counts as gone


ADDRESS = "rtsp://"  # how the address of a camera on the network begins


def open_file(name: str, path: Path | str) -> InputContainer:
    """Open a camera's file, a video or its sound; raises VideoError, in one line, for anything else."""
    if isinstance(path, str):
        raise VideoError(f"{name}: {path} is an address; give a file, or read cameras on the network with --live")
    if not path.exists():
        in_braces = "{" in str(path) and "}" in str(path)
        remedy = (
            "words in braces are filled in from a trial's labels in session.toml only"
            if in_braces
            else "check its path"
        )
        raise VideoError(f"{name}: video {path} not found; {remedy}")
    if not path.is_file():
        raise VideoError(f"{name}: {path} is not a file; give a video, or read pipes and devices with --live")
    if path.stat().st_size == 0:
        raise VideoError(f"{name}: {path} is empty (0 bytes); copy it again")
    try:
        return _open(f"file:{path.absolute()}", protocols="file")
    except (FFmpegError, OSError, ValueError) as error:
        why = "" if isinstance(error, InvalidDataError) else f" ({getattr(error, 'strerror', None) or error})"
        raise VideoError(
            f"{name}: {path} cannot be opened as a video{why}; it is of another kind or was cut off; "
            "copy or convert it again"
        ) from error


def open_pipe(pipe: Any, probe: dict[str, str]) -> InputContainer:
    """Open what an object with `read` delivers; raises FFmpegError."""
    return _open(pipe, protocols="pipe", **probe)


def open_device(path: Path) -> InputContainer:
    """Open a capture device; raises FFmpegError."""
    return av.open(str(path.absolute()), "r", format="v4l2", container_options={"protocol_whitelist": "file"})


def open_network(address: str) -> InputContainer:
    """Connect to a camera on the network; every wait for it has a limit. Raises FFmpegError, or TimeoutError."""
    options = {"protocol_whitelist": "rtp,tcp,udp", "format_whitelist": "rtsp", "rtsp_transport": "tcp"}
    start_s = time.monotonic()
    try:
        return av.open(address, "r", format="rtsp", container_options=options, timeout=_SILENCE_S)
    except FFmpegError:
        if time.monotonic() - start_s < _SILENCE_S:
            raise
        raise TimeoutError(errno.ETIMEDOUT, f"it says nothing for {_SILENCE_S:g} s") from None


def video_stream(container: InputContainer) -> VideoStream | None:
    """Return the first video stream, if there is one, to be decoded on one thread and within a size."""
    if not container.streams.video:
        return None
    stream = container.streams.video[0]
    stream.thread_type = "NONE"
    stream.codec_context.options = {"max_pixels": str(MOST_PIXELS)}
    return stream


def _open(what: str | IO[bytes], *, protocols: str, **options: str) -> InputContainer:
    return av.open(
        what, "r", container_options={"protocol_whitelist": protocols, "format_whitelist": _KINDS, **options}
    )
