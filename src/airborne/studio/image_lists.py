"""The lists of videos' images, kept in the opened folder: to read one off the packets of a long file takes seconds."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.io.npz import read_arrays, write_arrays
from airborne.studio.folder import file_stamp
from airborne.video import VideoSource, inspect
from airborne.video.image_index import ImageIndex, index_images

LISTS = "images"  # in the folder of what the studio remembers


def read_or_list(folder: Path, source: VideoSource) -> ImageIndex:
    """Return when each image of a file is shown, as the folder has it, else read off the file. Raises VideoError."""
    name = hashlib.sha256(str(Path(source.path).absolute()).encode()).hexdigest()[:16]
    _, *status = file_stamp(Path(source.path))
    path, stamp = folder / LISTS / f"{name}.npz", np.array(status, np.int64)
    with suppress(OSError, ValueError, KeyError, TypeError, ZeroDivisionError):
        kept = read_arrays(path)
        if np.array_equal(kept["stamp"], stamp):
            return _index(source, kept)
    index = index_images(source)
    with suppress(OSError, ResultError):  # a folder that cannot be written is looked at too
        (folder / LISTS).mkdir(parents=True, exist_ok=True)
        part = path.with_name(f"{path.name}.part")
        numbers = [index.first, index.tick_s.numerator, index.tick_s.denominator]
        write_arrays(part, {"stamp": stamp, "ticks": index.ticks, "keys": index.keys, "numbers": np.array(numbers)})
        part.replace(path)
    return index


def _index(source: VideoSource, kept: dict[str, NDArray]) -> ImageIndex:
    """Return a list that was kept; raises ValueError for what is none."""
    ticks, keys = kept["ticks"], kept["keys"]
    first, numerator, denominator = map(int, kept["numbers"])
    if ticks.dtype != np.int64 or keys.dtype != np.int64 or not len(ticks) or np.any(np.diff(ticks) <= 0):
        raise ValueError("no list of images")
    return ImageIndex(inspect(source), ticks, keys, first, Fraction(numerator, denominator))
