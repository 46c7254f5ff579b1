"""Images in rows and columns, with titles above and names beside them, composed of pixels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from airborne.export.lettering import draw_text, text_width
from airborne.export.palette import TEXT_RGB
from airborne.export.pictures import encode_png
from airborne.io.writing import explain_full_disk
from airborne.types import Image

_WIDTH_PX = 1520  # of a page's width in print: 7.6 inches of 200 dots
_TEXT_PX = 20  # size of titles and names: 7 points in print
_MARGIN_PX, _GAP_PX = 10, 8  # around everything; between cells
_FINER = 4  # text is drawn so many times larger
_LINE = 1.3  # height of a line over the size of its letters
_LEFT_PX = _MARGIN_PX + round(_LINE * _TEXT_PX) + _GAP_PX  # of the names beside the rows
_MISSING = "no picture"  # stands in a cell without an image


class ColumnTitle(NamedTuple):
    """One or more lines above a column."""

    text: str
    rgb: tuple[int, int, int] = TEXT_RGB


def write_mosaic(
    path: Path,
    rows: Sequence[Sequence[Image | None]],
    names: Sequence[str],
    titles: Sequence[ColumnTitle],
    *,
    aspect: float = 1.0,
    n_columns: int | None = None,
) -> None:
    """Write a PNG of report width: images (h, w, 3) in rows with names, titles above; None says that there is none.

    aspect: height over width of a cell; an image of another shape keeps its own. n_columns: how many would fill the
    width; with fewer the picture is narrower.
    """
    n = len(titles) if n_columns is None else n_columns
    width = (_WIDTH_PX - _LEFT_PX - _MARGIN_PX) // n - _GAP_PX
    page = draw_mosaic(rows, names, titles, cell_px=(width, round(aspect * width)))
    with explain_full_disk(path):
        path.write_bytes(encode_png(page))


def draw_mosaic(
    rows: Sequence[Sequence[Image | None]],
    names: Sequence[str],
    titles: Sequence[ColumnTitle],
    *,
    cell_px: tuple[int, int],
) -> Image:
    """Draw images as `write_mosaic` does, in cells of a width and height [px]: (h, w, 3)."""
    (width, height), left = cell_px, _LEFT_PX
    n_lines = max(title.text.count("\n") + 1 for title in titles)
    top = _MARGIN_PX + round(n_lines * _LINE * _TEXT_PX) + _GAP_PX
    size = top + len(rows) * (height + _GAP_PX) + _MARGIN_PX, left + len(titles) * (width + _GAP_PX) + _MARGIN_PX
    page = np.full((*size, 3), 255, np.uint8)
    for j, title in enumerate(titles):
        x = left + j * (width + _GAP_PX)
        _write_lines(page[:top, x : x + width], title)
    for i, (row, name) in enumerate(zip(rows, names, strict=True)):
        y = top + i * (height + _GAP_PX)
        page[y : y + height, : left - _GAP_PX] = _upward_name(name, height, left - _GAP_PX)
        for j, image in enumerate(row):
            x = left + j * (width + _GAP_PX)
            _fill_cell(page[y : y + height, x : x + width], image)
    return page


def _write_lines(image: Image, title: ColumnTitle) -> None:
    for k, line in enumerate(title.text.split("\n")):
        _write_centred(image, line, (image.shape[1] / 2, _MARGIN_PX + _LINE * (k + 0.5) * _TEXT_PX), title.rgb)


def _write_centred(image: Image, text: str, at: tuple[float, float], rgb: tuple[int, int, int]) -> None:
    """Write a line about a pixel (x, y) on white; drawn larger and reduced, which keeps small letters fine."""
    height = round(_LINE * _TEXT_PX)
    width = min(round(text_width(text, size_px=_TEXT_PX)) + 2, image.shape[1])
    large = np.full((_FINER * height, _FINER * width, 3), 255, np.uint8)
    draw_text(large, text, (_FINER, _FINER * (height + 0.7 * _TEXT_PX) / 2), size_px=_FINER * _TEXT_PX, rgb=rgb)
    x, y = min(max(round(at[0] - width / 2), 0), image.shape[1] - width), round(at[1] - height / 2)
    image[y : y + height, x : x + width] = cv2.resize(large, (width, height), interpolation=cv2.INTER_AREA)


def _upward_name(name: str, height: int, width: int) -> Image:
    """Return a strip (height, width, 3) with a name that is read from below."""
    strip = np.full((width, height, 3), 255, np.uint8)
    _write_centred(strip, name, (height / 2, width / 2), TEXT_RGB)
    return np.rot90(strip)


def _fill_cell(cell: Image, image: Image | None) -> None:
    """Show an image in the middle of a cell (h, w, 3) as large as it fits, or say that there is none."""
    height, width = cell.shape[:2]
    if image is None:
        _write_centred(cell, _MISSING, (width / 2, height / 2), TEXT_RGB)
        return
    share = min(height / image.shape[0], width / image.shape[1])
    h, w = max(1, round(share * image.shape[0])), max(1, round(share * image.shape[1]))
    y, x = (height - h) // 2, (width - w) // 2
    how = cv2.INTER_CUBIC if share > 1 else cv2.INTER_AREA
    cell[y : y + h, x : x + w] = cv2.resize(np.ascontiguousarray(image), (w, h), interpolation=how)
