"""When each frame of a file is shown: off its packets, or in a hundredth of the time off its own table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.video.stream import VideoStream
from numpy.typing import NDArray

_N_COMPARED = 64  # packets at the beginning of a file, with its table
_LARGEST_BYTES = 500_000_000  # of a table: 10 million frames
_INTO_STBL = (b"mdia", b"minf", b"stbl")


def frames_of_packets(packets: Iterable[av.Packet]) -> NDArray[np.int64] | None:
    """Return when each frame is shown [ticks], and whether it is a key frame: (n, 2); None where one has no time."""
    shown = [(packet.pts, packet.is_keyframe) for packet in packets if packet.size and not packet.is_discard]
    if not shown or any(stamp is None for stamp, _ in shown):
        return None
    return np.array(shown, np.int64)


def frames_of_table(path: Path | str, container: InputContainer, stream: VideoStream) -> NDArray[np.int64] | None:
    """Return what `frames_of_packets` would, off the table of an MP4 or QuickTime file (ISO/IEC 14496-12).

    None where there is none, where the first or the last packets say otherwise, and where the meaning is FFmpeg's own,
    as of fragments and of frames without bytes.
    """
    table = _read_sample_table(Path(path), stream.id)
    if table is None or len(stream.index_entries) != len(table):
        return None
    try:
        first = frames_of_packets(islice(container.demux(stream), _N_COMPARED))
        if first is None:
            return None
        table[:, 0] += first[0, 0] - table[0, 0]
        container.seek(int(table[table[:, 1] > 0, 0].max()), stream=stream)
        last = frames_of_packets(container.demux(stream))
    except FFmpegError:
        return None
    is_same = last is not None and np.array_equal(table[-len(last) :], last)
    return table if is_same and np.array_equal(table[:_N_COMPARED], first) else None


def _read_sample_table(path: Path, track_id: int) -> NDArray[np.int64] | None:
    """Return when each frame of a track is shown [ticks], and whether it is a key frame: (n, 2) in the file's order.

    The stamps lack a shift that the track's edit may give them.
    """
    try:
        with path.open("rb") as file:
            movie = _read_movie(file)
        return None if movie is None else _read_track(movie, track_id)
    except (OSError, ValueError, KeyError, IndexError):
        return None


def _read_movie(file: BinaryIO) -> bytes | None:
    """Return the inside of the box `moov`; None where the file has none, or is in fragments."""
    movie, begin = None, 0
    while len(head := file.read(16)) >= 8:
        size, kind = int.from_bytes(head[:4]), head[4:8]
        inside = 16 if size == 1 else 8
        size = int.from_bytes(head[8:16]) if size == 1 else size
        if not kind.isalnum() or kind == b"moof" or (size and size < inside):
            return None
        if kind == b"moov":
            if size > _LARGEST_BYTES or not size:
                return None
            file.seek(begin + inside)
            movie = file.read(size - inside)
        if not size:
            break
        begin += size
        file.seek(begin)
    return movie


def _boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    begin = 0
    while begin + 8 <= len(data):
        size, kind = int.from_bytes(data[begin : begin + 4]), data[begin + 4 : begin + 8]
        if size < 8:
            return
        yield kind, data[begin + 8 : begin + size]
        begin += size


def _read_track(movie: bytes, track_id: int) -> NDArray[np.int64] | None:
    for kind, track in _boxes(movie):
        boxes = dict(_boxes(track))
        if kind != b"trak" or _track_id(boxes[b"tkhd"]) != track_id:
            continue
        for name in _INTO_STBL:
            boxes = dict(_boxes(boxes[name]))
        if boxes.keys() & {b"stps", b"sgpd", b"sbgp"}:  # frames that are key frames in part
            return None
        return _read_samples(boxes)
    return None


def _track_id(header: bytes) -> int:
    at = 20 if header[0] == 1 else 12  # after two times of 8 or 4 bytes
    return int.from_bytes(header[at : at + 4])


def _read_samples(boxes: dict[bytes, bytes]) -> NDArray[np.int64] | None:
    counts, steps = _table(boxes[b"stts"], 2).T
    decoded = np.append(0, np.cumsum(np.repeat(steps, counts)))[:-1]
    n = len(decoded)
    sizes = boxes[b"stsz"]
    each_size, n_sizes = np.frombuffer(sizes, ">u4", 2, 4).tolist()
    if n_sizes != n or not n or (not each_size and not np.frombuffer(sizes, ">u4", n, 12).all()):
        return None
    shown = decoded
    if b"ctts" in boxes:
        counts, offsets = _table(boxes[b"ctts"], 2).T
        shown = decoded + np.repeat(offsets, counts)
    keys = _table(boxes[b"stss"], 1)[:, 0] if b"stss" in boxes else np.arange(1, n + 1)  # counted from 1
    if not len(keys):
        return None
    is_key = np.isin(np.arange(1, n + 1), keys).astype(np.int64)
    return np.stack([shown, is_key], axis=1)


def _table(box: bytes, columns: int) -> NDArray[np.int64]:
    """Return the rows of a table, whose number stands before them."""
    n = int.from_bytes(box[4:8])
    return np.frombuffer(box, ">i4", columns * n, 8).reshape(n, columns).astype(np.int64)
