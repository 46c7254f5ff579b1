"""Pictures of videos as JPEG, in any order: kept in a cache of bounded size, the next ones made ahead."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock

from airborne.export.pictures import encode_jpeg
from airborne.trial.cameras import CameraTable
from airborne.video import VideoSource
from airborne.video.seeking import ImageIndex, ImageReader, TrialClock, index_images, match_images

_MOST_BYTES = 100_000_000  # of JPEG that are kept
_AHEAD = 4  # pictures made beyond the one that was asked for
_MOST_OPEN = 32  # files

Key = tuple[VideoSource, int]


@dataclass(frozen=True, slots=True, eq=False)
class ShownTrial:
    """The videos of a trial as they are looked at: which image of each camera belongs to each frame."""

    tables: tuple[CameraTable, ...]
    sources: tuple[VideoSource, ...]
    indexes: tuple[ImageIndex, ...]
    clock: TrialClock

    @property
    def names(self) -> list[str]:
        """The cameras' names."""
        return [source.name for source in self.sources]

    @property
    def sizes(self) -> dict[str, tuple[int, int]]:
        """Camera -> (width, height) [px]."""
        return {source.name: index.facts.size for source, index in zip(self.sources, self.indexes, strict=True)}


class _Store:
    """The newest JPEGs, as many as fit."""

    def __init__(self, most_bytes: int) -> None:
        self._most, self._n_bytes, self._lock = most_bytes, 0, Lock()
        self._jpegs: OrderedDict[Key, bytes | None] = OrderedDict()

    def find(self, key: Key) -> tuple[bool, bytes | None]:
        """Return whether a picture is there, and the picture; None where it is damaged."""
        with self._lock:
            if key not in self._jpegs:
                return False, None
            self._jpegs.move_to_end(key)
            return True, self._jpegs[key]

    def add(self, key: Key, jpeg: bytes | None) -> None:
        with self._lock:
            old = self._jpegs.pop(key, None)
            self._jpegs[key] = jpeg
            self._n_bytes += len(jpeg or b"") - len(old or b"")
            while self._n_bytes > self._most:
                self._n_bytes -= len(self._jpegs.popitem(last=False)[1] or b"")


class _Video:
    """One file: its index and its reader, for one thread at a time."""

    def __init__(self, source: VideoSource) -> None:
        self._source, self._lock, self._ahead = source, Lock(), Lock()
        self._reader: ImageReader | None = None
        self._wanted = -1

    def index(self) -> ImageIndex:
        """List the file's images, once."""
        with self._lock:
            return self._open().index

    def fetch(self, store: _Store, number: int) -> bytes | None:
        """Return a picture, made where the store does not hold it."""
        key = (self._source, number)
        with self._lock:
            is_there, jpeg = store.find(key)
            if not is_there:
                image = self._open().image(number)
                jpeg = None if image is None else encode_jpeg(image)
                store.add(key, jpeg)
            return jpeg

    def look_ahead(self, store: _Store, number: int) -> None:
        """Make the pictures after one, until another is asked for."""
        self._wanted = number
        with self._ahead:
            for later in range(number + 1, min(number + 1 + _AHEAD, len(self.index()))):
                if self._wanted != number:
                    return
                self.fetch(store, later)

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._reader is not None:
                self._reader.close()

    def _open(self) -> ImageReader:
        if self._reader is None:
            self._reader = ImageReader(self._source, index_images(self._source))
        return self._reader


class Pictures:
    """The pictures of any number of videos; for any number of threads."""

    def __init__(self) -> None:
        """Open nothing yet."""
        self._store, self._lock = _Store(_MOST_BYTES), Lock()
        self._videos: OrderedDict[VideoSource, _Video] = OrderedDict()
        self._helpers = ThreadPoolExecutor(2, thread_name_prefix="look-ahead")

    def index(self, source: VideoSource) -> ImageIndex:
        """Return when each image of a file is shown. Raises VideoError."""
        return self._video(source).index()

    def jpeg(self, source: VideoSource, number: int) -> bytes | None:
        """Return an image of a file, None where it is damaged; those after it are then made ahead.

        Raises VideoError for a number that is not there.
        """
        video = self._video(source)
        is_there, jpeg = self._store.find((source, number))
        if not is_there:
            jpeg = video.fetch(self._store, number)
        self._helpers.submit(video.look_ahead, self._store, number)
        return jpeg

    def show(self, tables: tuple[CameraTable, ...], source_of: Callable[[CameraTable], VideoSource]) -> ShownTrial:
        """Match the images of a trial's cameras. Raises VideoError."""
        sources = tuple(map(source_of, tables))
        with ThreadPoolExecutor(len(sources)) as readers:
            indexes = tuple(readers.map(self.index, sources))
        return ShownTrial(tables, sources, indexes, match_images(sources, indexes))

    def _video(self, source: VideoSource) -> _Video:
        with self._lock:
            video = self._videos.pop(source, None) or _Video(source)
            self._videos[source] = video
            if len(self._videos) > _MOST_OPEN:
                self._helpers.submit(self._videos.popitem(last=False)[1].close)
        return video
