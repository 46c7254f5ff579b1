"""Pictures of videos as JPEG, in any order, kept in a cache of bounded size. Which come next, the browser knows."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

import cv2
import numpy as np

from airborne.errors import VideoError
from airborne.export.pictures import encode_jpeg
from airborne.studio.image_lists import read_or_list
from airborne.studio.jpeg_store import JpegStore, Key
from airborne.studio.prefetch import Prefetch
from airborne.trial.cameras import CameraTable
from airborne.types import Image
from airborne.video import VideoFacts, VideoSource
from airborne.video.image_index import ImageIndex, TrialClock, match_images
from airborne.video.seeking import ImageReader

_MOST_BYTES = 300_000_000  # of JPEG on the disk: three cameras of 1080p for a minute, at a quarter of their size
_MOST_OPEN = 32  # files
_LOOK_AGAIN_S = 0.02  # while another thread holds a file, whether it has passed the key frame that is asked for
_INDEXING = 2  # files at once: four threads take three times the CPU time of one, waiting for the interpreter

SHRINKS = (1, 2, 4)  # times smaller than the video, as pictures are asked for


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
        return {name: facts.size for name, facts in self.facts.items()}

    @property
    def facts(self) -> dict[str, VideoFacts]:
        """Camera -> what its file states."""
        return {source.name: index.facts for source, index in zip(self.sources, self.indexes, strict=True)}


class _Video:
    """One file: its index and its reader, for one thread at a time."""

    def __init__(self, source: VideoSource, memory: Path) -> None:
        self._source, self._memory, self._lock = source, memory, Lock()
        self._reader: ImageReader | None = None

    def index(self) -> ImageIndex:
        """List the file's images, once."""
        with self._lock:
            return self._open().index

    def decode(self, number: int, is_wanted: Callable[[], bool]) -> Image | None:
        """Decode an image; None where it is damaged. Raises VideoError where nobody wants it any more.

        The key frame that another thread has begun with comes at once.
        """
        is_mine = False
        while not is_mine:
            reader = self._reader
            image = None if reader is None else reader.key_image(number)
            if image is not None:
                return image
            is_mine = self._lock.acquire(timeout=_LOOK_AGAIN_S)
        try:
            reader = self._open()
            if not (is_wanted() and reader.go_to(number, is_wanted)):
                raise VideoError(f"{self._source.name}: nobody waits for image {number} any more")
            return reader.image(number, is_exact=False)
        finally:
            self._lock.release()

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._reader is not None:
                self._reader.close()

    def _open(self) -> ImageReader:
        if self._reader is None:
            self._reader = ImageReader(self._source, read_or_list(self._memory, self._source))
        return self._reader


class Pictures:
    """The pictures of any number of videos; for any number of threads."""

    def __init__(self, memory: Path) -> None:
        """Open nothing yet; when the videos' images are shown is remembered in a folder."""
        self._memory, self._store, self._lock = memory, JpegStore(_MOST_BYTES), Lock()
        self.prefetch = Prefetch(self._store, self.index, _encode)
        self._videos: OrderedDict[VideoSource, _Video] = OrderedDict()

    def index(self, source: VideoSource) -> ImageIndex:
        """Return when each image of a file is shown. Raises VideoError."""
        return self._video(source).index()

    def jpeg(
        self,
        source: VideoSource,
        number: int,
        shrink: int = 1,
        is_wanted: Callable[[], bool] = lambda: True,
        *,
        is_passing: bool = False,
    ) -> bytes | None:
        """Return an image of a file, one of `SHRINKS` times smaller; None where it is damaged.

        Others around it are made while nobody waits, unless it is looked at in passing.

        Raises VideoError for a number that is not there, and where it is no longer wanted before it is decoded.
        """
        key = Key(source, number, shrink)
        with self.prefetch.waiting(key, is_passing=is_passing):
            is_there, jpeg = self._store.find(key)
            if not is_there:
                image = self._video(source).decode(number, is_wanted)
                jpeg = None if image is None else _encode(image, shrink)
                self._store.add(key, jpeg)
        return jpeg

    def image(self, source: VideoSource, number: int) -> Image | None:
        """Return an image of a file (h, w, 3) sRGB, None where it is damaged. Raises VideoError as `jpeg` does."""
        return self._video(source).decode(number, lambda: True)

    def show(self, tables: tuple[CameraTable, ...], source_of: Callable[[CameraTable], VideoSource]) -> ShownTrial:
        """Match the images of a trial's cameras. Raises VideoError."""
        sources = tuple(map(source_of, tables))
        with ThreadPoolExecutor(_INDEXING) as readers:
            indexes = tuple(readers.map(self.index, sources))
        return ShownTrial(tables, sources, indexes, match_images(sources, indexes))

    def _video(self, source: VideoSource) -> _Video:
        with self._lock:
            video = self._videos.pop(source, None) or _Video(source, self._memory)
            self._videos[source] = video
            oldest = self._videos.popitem(last=False)[1] if len(self._videos) > _MOST_OPEN else None
        if oldest is not None:
            oldest.close()
        return video


def _encode(image: Image, shrink: int) -> bytes:
    height, width = image.shape[:2]
    while shrink > 1:  # by halves, each of which takes a fifth of the time of a quarter
        shrink, height, width = shrink // 2, height // 2, width // 2
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8)
    return encode_jpeg(image)
