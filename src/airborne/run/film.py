"""A film of a stretch of a run: what its cameras saw with outlines, side by side, over curves with a cursor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from fractions import Fraction
from itertools import cycle
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as GifPicture

from airborne.errors import ResultError
from airborne.export.lettering import draw_text, text_width
from airborne.export.palette import TEXT_RGB
from airborne.motion.run_folder import SUMMARY, VIDEOS, holds_players, read_body_run, read_players_run
from airborne.types import Array, Image, Progress
from airborne.video import VideoSource, VideoWriter
from airborne.video.image_index import index_images
from airborne.video.seeking import ImageReader

_WIDEST_PX = {".mp4": 1920, ".gif": 960}  # of the film: what screens, and pages, take
_MOST_GIF_HZ = 25  # browsers slow faster ones down
_CURVES_SHARE = 0.12  # of the width: the curves' height
_COLOURS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0))  # Okabe, Ito
_LEAST_RANGE_M = 0.2  # of the curves: less is noise


def write_film(
    folder: Path,
    path: Path,
    *,
    first: int | None = None,
    last: int | None = None,
    progress: Progress | None = None,
) -> tuple[int, int]:
    """Write frames `first` to `last` of a run, by default all, as .mp4 or .gif; return its first and last there.

    Raises ResultError where the run has no videos of its overlays, or no such frames.
    """
    if path.suffix.lower() not in _WIDEST_PX:
        raise ResultError(f"{path}: films are .mp4 or .gif; name it so")
    check_order(first, last)
    index, time_s, series = _read(folder)
    first = int(index[0]) if first is None else first
    last = int(index[-1]) if last is None else last
    rows = np.flatnonzero((index >= first) & (index <= last))
    if not len(rows):
        what = f"{first} is after {last}" if first > last else f"none lies from {first} to {last}"
        raise ResultError(
            f"{folder} has frames {index[0]} to {index[-1]}, and {what}; give a first and a last frame of it"
        )
    with ExitStack() as stack:
        readers = [stack.enter_context(reader) for reader in _open(folder, len(index))]
        pictures = _draw(readers, rows, time_s=time_s, series=series, width=_WIDEST_PX[path.suffix.lower()])
        rate = readers[0].index.facts.frame_rate
        _write(path, _report(pictures, len(rows), progress), rate)
    return int(index[rows[0]]), int(index[rows[-1]])


def check_order(first: float | None, last: float | None) -> None:
    """Raise ResultError where a film would begin after its end; None for a run's own."""
    if first is not None and last is not None and first > last:
        raise ResultError(f"frames {first:g} to {last:g}: the first frame must come before the last; exchange them")


def _read(folder: Path) -> tuple[NDArray[np.int64], Array, dict[str, Array]]:
    """Return frames (n,), times (n,) [s] and curves, name -> (n,) [m]."""
    if holds_players(folder):
        motion = read_players_run(folder)
        ankles = [k for k, name in enumerate(motion.joints) if name.startswith("ankle")]
        lower = motion.points[:, :, ankles, 2].min(axis=2)
        return motion.index, motion.time_s, {f"{who}: lower ankle": lower[:, k] for k, who in enumerate(motion.players)}
    motion, _ = read_body_run(folder)
    return motion.index, motion.time_s, {axis: motion.position[:, k] for k, axis in enumerate("xyz")}


def _open(folder: Path, n: int) -> list[ImageReader]:
    paths = sorted((folder / VIDEOS).glob("overlay_*.mp4"))
    if not paths:
        raise ResultError(f"{folder} has no videos of overlays; track again without --no-pictures")
    sources = [VideoSource(path.stem.removeprefix("overlay_"), path) for path in paths]
    readers = [ImageReader(source, index_images(source)) for source in sources]
    short = [path.name for path, reader in zip(paths, readers, strict=True) if len(reader.index) != n]
    if short:
        hold = "does not hold" if len(short) == 1 else "do not hold"
        is_finished = (folder / SUMMARY).is_file()
        mend = "track again" if is_finished else "the run is not finished; finish it with `airborne track --resume`"
        raise ResultError(f"{', '.join(short)} {hold} the run's {n} frames; {mend}")
    return readers


def _draw(
    readers: Sequence[ImageReader], rows: NDArray[np.integer], *, time_s: Array, series: dict[str, Array], width: int
) -> Iterator[Image]:
    """Yield the film's pictures (h, w, 3), all of one size."""
    sizes = [reader.index.facts.size for reader in readers]
    height = min(width / sum(w / h for w, h in sizes), max(h for _, h in sizes))  # no larger than the videos
    tiles = [(round(w / h * height), round(height)) for w, h in sizes]
    across = sum(w for w, _ in tiles)
    below = _curves(time_s[rows], {name: curve[rows] for name, curve in series.items()}, across)
    for k, row in enumerate(rows.tolist()):
        images = [reader.image(row) for reader in readers]
        shown = [
            np.full((size[1], size[0], 3), 128, np.uint8)
            if image is None  # damaged
            else cv2.resize(image, size, interpolation=cv2.INTER_AREA)
            for image, size in zip(images, tiles, strict=True)
        ]
        yield np.concatenate([np.concatenate(shown, axis=1), _with_cursor(below, k, len(rows))]).astype(np.uint8)


def _curves(time_s: Array, series: dict[str, Array], width: int) -> Image:
    """Draw curves (n,) [m] over their frames, with their names and range."""
    height = round(_CURVES_SHARE * width)
    image, em, edge = np.full((height, width, 3), 255, np.uint8), height / 9, height // 8
    values = np.concatenate(list(series.values()))
    low, high = (np.nanmin(values), np.nanmax(values)) if np.isfinite(values).any() else (0.0, 0.0)
    middle, half = (low + high) / 2, max(high - low, _LEAST_RANGE_M) / 2
    x, left = np.linspace(0, width - 1, len(time_s)), em / 2
    for (name, curve), colour in zip(series.items(), cycle(_COLOURS), strict=False):
        y = height / 2 - (curve - middle) / half * (height / 2 - edge)
        for piece in np.split(np.arange(len(x)), np.flatnonzero(~np.isfinite(y))):
            seen = piece[np.isfinite(y[piece])]
            points = np.rint(16 * np.stack([x[seen], y[seen]], axis=1)).astype(np.int32)
            cv2.polylines(image, [points], False, colour, max(1, round(em / 8)), cv2.LINE_AA, 4)
        draw_text(image, name, (left, em), size_px=em, rgb=colour)
        left += text_width(name, size_px=em) + em
    draw_text(image, f"{middle - half:.2f} to {middle + half:.2f} m", (left, em), size_px=em, rgb=TEXT_RGB)
    text = f"{time_s[0]:.2f} to {time_s[-1]:.2f} s"
    draw_text(image, text, (em / 2, height - em / 3), size_px=em, rgb=TEXT_RGB)
    return image


def _with_cursor(curves: Image, row: int, n: int) -> Image:
    image, x = curves.copy(), round(row / max(n - 1, 1) * (curves.shape[1] - 1))
    cv2.line(image, (x, 0), (x, image.shape[0]), TEXT_RGB, 2)
    return image


def _report(pictures: Iterator[Image], n: int, progress: Progress | None) -> Iterator[Image]:
    for done, picture in enumerate(pictures, start=1):
        yield picture
        if progress is not None:
            progress(done, n)


def _write(path: Path, pictures: Iterator[Image], rate: Fraction) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    first = next(pictures)
    if path.suffix.lower() == ".mp4":
        with VideoWriter(path, size=(first.shape[1], first.shape[0]), rate=rate) as writer:
            writer.write(first)
            for picture in pictures:
                writer.write(picture)
        return
    step = -(-rate // _MOST_GIF_HZ)  # pictures left out
    later = (GifPicture.fromarray(picture) for k, picture in enumerate(pictures, start=1) if k % step == 0)
    duration_ms = round(1000 * step / rate)
    GifPicture.fromarray(first).save(path, save_all=True, append_images=later, duration=duration_ms, loop=0)
