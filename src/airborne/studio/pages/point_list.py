"""The list of points beside the pictures; each row says how far the point's clicks lie from where they should."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import partial
from html import escape

import numpy as np
from nicegui import ui
from nicegui.element import Element
from nicegui.elements.label import Label

from airborne.types import Array, Mask

_NOT_CLICKED, _CLICKED = "–", "•"
_NARROWEST_PX, _WIDEST_PX, _COLUMNS_PX = 24, 36, 132  # a column: 12.3 fits; cam1 does; all of them, beside the names


class PointList:
    """Rows that stay the same elements while what they say changes, so that no click on them is lost."""

    def __init__(self, cameras: Sequence[str], choose: Callable[[str], Awaitable[None]], *, empty: str = "") -> None:
        """Begin without rows; `choose` is called with a row's point, `empty` stands where there are no points."""
        self._cameras, self._choose, self._empty = cameras, choose, empty
        self._rows: dict[str, tuple[Element, list[Label], Label]] = {}
        width = max(_NARROWEST_PX, min(_WIDEST_PX, _COLUMNS_PX // len(cameras)))
        self._card = (
            ui.element("div")
            .classes("card points")
            .style(f"--n: {width}px; flex: 1; min-height: 160px; overflow-y: auto")
        )
        self._build(())

    def show(
        self,
        names: Sequence[str],
        chosen: str,
        off_px: Callable[[str], tuple[Mask, Array]],
        findings: Mapping[str, str] | None = None,
    ) -> None:
        """Show the points, and below a point what is wrong with it.

        `off_px` says of one whether it is clicked, and how far off, in each camera [px].
        """
        if list(self._rows) != list(names):
            self._build(names)
        for name, (row, labels, finding) in self._rows.items():
            finding.set_text((findings or {}).get(name, ""))
            row.classes(replace="point here" if name == chosen else "point")
            for label, is_clicked, off in zip(labels, *off_px(name), strict=True):
                label.set_text(_NOT_CLICKED if not is_clicked else _CLICKED if np.isnan(off) else f"{off:.1f}")

    def _build_head(self) -> None:
        """Name the columns: the cameras, and the unit."""
        with ui.element("div").classes("point head"):
            ui.label("off [px]")
            ui.element("div").classes("gap")
            for camera in self._cameras:
                ui.label(camera).classes("n")

    def _build(self, names: Sequence[str]) -> None:
        self._card.clear()
        self._rows = {}
        with self._card:
            if not names:
                ui.label(self._empty).classes("soft small")
            else:
                self._build_head()
            for name in names:
                with ui.element("button").classes("point") as row:
                    row.on("click", partial(self._choose, name), args=[])
                    ui.html(escape(name).replace("_", "_<wbr>"), sanitize=False)  # a long name is broken there
                    ui.element("div").classes("gap")
                    labels = [ui.label().classes("n") for _ in self._cameras]
                    for label, camera in zip(labels, self._cameras, strict=True):
                        label._props["title"] = f"{camera} [px]"  # a camera's name may hold quotes
                finding = ui.label().classes("warn small")
                finding.bind_visibility_from(finding, "text")
                self._rows[name] = row, labels, finding
