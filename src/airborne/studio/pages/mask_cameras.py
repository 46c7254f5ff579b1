"""Cameras that are left out of some frames: which, from when to when, written into the trial as [[mask]] tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from nicegui import ui

from airborne.errors import TrialError
from airborne.export.methods_text import name_stretch
from airborne.studio.pages.slow_work import complain, show_errors
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.tracked_again import name_frames
from airborne.studio.trial_edits import with_mask, without_mask
from airborne.studio.view import CameraViews, Item

_VEIL = "#16191dcc"  # over a picture that is left out
_KEYS = {"camera", "first", "last"}
_MOST_IN_ROW = 2  # at 1280 px; below a second row, the pictures would be small


class Entry(NamedTuple):
    """A correction on the list."""

    text: str
    tip: str  # what a click does
    remove: Callable[[], None]


class MaskPanel:
    """One window's row of what is left out."""

    def __init__(
        self,
        session: Session,
        shown: ShownTrial,
        frame_of: Callable[[], int],
        on_change: Callable[[str], None],
        others: Callable[[], Iterable[Entry]] = tuple,
    ) -> None:
        """Lay it out; `frame_of` says which frame is in view, `on_change` is called with what was written.

        `others` returns what is listed before the masks.
        """
        self.session, self.shown, self._frame_of, self._on_change = session, shown, frame_of, on_change
        self._others = others
        with ui.element("div").classes("row-line") as self.area:
            self.camera = ui.select(shown.names, label="camera", value=shown.names[0])
            self.camera.props("outlined dense options-dense").style("min-width: 150px")
            self._end = len(shown.clock) - 1  # the last frame
            self.first, self.last = (
                ui.number(label, min=0, max=self._end, precision=0).props("outlined dense").style("width: 110px")
                for label in ("from frame", "to frame")
            )
            ui.button("Leave it out", on_click=self.add).props("outline")
            self.list = ui.refreshable(self._list)
            self.list()

    @property
    def masks(self) -> list[tuple[int, dict[str, Any]]]:
        """The masks of the trial's file, numbered as they stand there."""
        tables = enumerate(self.session.project().tables.get("mask", []))
        return [(number, mask) for number, mask in tables if isinstance(mask, dict) and mask.keys() >= _KEYS]

    def items(self, frame: int) -> list[Item]:
        """Return a veil over each picture that is left out of a frame."""
        left_out = {mask["camera"] for _, mask in self.masks if mask["first"] <= frame <= mask["last"]}
        items: list[Item] = []
        for pane, (name, (width, height)) in enumerate(self.shown.sizes.items()):
            if name in left_out:
                corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]
                items.append({"pane": pane, "points": corners, "closed": True, "fill": _VEIL})
                items.append({"pane": pane, "points": [[0.04 * width, 0.94 * height]], "text": "left out"})
        return items

    def add(self) -> None:
        """Leave the chosen camera out; without frames, of the one in view."""
        numbers = (self.first.value, self.last.value)
        if numbers.count(None) == 1:
            complain("give both frames, or neither for the one in view")
            return
        first, last = (self._frame_of() if number is None else int(number) for number in numbers)
        camera = str(self.camera.value)
        with show_errors():
            last, note = clip_frames(first, last, self._end)
            what = f"{camera} left out of {name_frames(np.arange(first, last + 1))}{note}"
            self._edit(lambda text: with_mask(text, camera, first, last), what + self._warn_blind(camera, first, last))

    def _warn_blind(self, camera: str, first: int, last: int) -> str:
        """Say in which of these frames no camera is left once this one is left out; nothing where one is."""
        frames, masks = np.arange(first, last + 1), [mask for _, mask in self.masks]
        is_blind = np.ones(len(frames), bool)
        for name in self.shown.names:
            outs = [(mask["first"] <= frames) & (frames <= mask["last"]) for mask in masks if mask["camera"] == name]
            is_blind &= name == camera or np.any([np.zeros_like(is_blind), *outs], axis=0)
        blind = frames[is_blind]
        return f"; no camera is left in {name_frames(blind)}" if len(blind) else ""

    def remove(self, number: int, camera: str) -> None:
        """Use a camera again."""
        with show_errors():
            self._edit(lambda text: without_mask(text, number), f"{camera} used again")

    def _edit(self, change: Callable[[str], str], what: str) -> None:
        self.session.edit_trial(change, what)
        self.list.refresh()
        self._on_change(what)

    def _list(self) -> None:
        """Show what can be taken back: in the row, or where it is much, on a list of its own."""
        entries = list(self._others())
        for number, mask in self.masks:
            text = f"{mask['camera']}: {name_stretch(mask['first'], mask['last'])}"
            entries.append(Entry(text, "use it again", partial(self.remove, number, str(mask["camera"]))))
        if len(entries) <= _MOST_IN_ROW:
            for each in entries:
                button = ui.button(f"{each.text}  ✕", on_click=each.remove).props("flat dense no-caps")
                button.tooltip(each.tip)
            return
        with ui.dropdown_button(f"{len(entries)} corrections").props("flat dense no-caps"):
            for each in entries:
                ui.item(f"{each.text}  ✕", on_click=each.remove).tooltip(each.tip)


class PlayersMasks:
    """What can be corrected of a run of players: cameras are left out, and it is tracked again from its start."""

    def __init__(self, session: Session, shown: ShownTrial) -> None:
        """Begin with nothing that is shown, until the switch is on."""
        self.session, self.shown = session, shown
        self.view: CameraViews | None = None

    def build(self) -> None:
        """Lay out the switch, and what leaves a camera out."""
        self._switch = ui.switch("Leave cameras out", on_change=lambda: self.turn_to(self._frame))
        self._masks = MaskPanel(self.session, self.shown, lambda: self._frame, self._note_change)
        self._masks.area.bind_visibility_from(self._switch, "value")

    def build_watch(self) -> None:
        """Lay out the line that says what to do then."""
        self._says = ui.label().classes("small soft")
        self._says.bind_visibility_from(self._says, "text")

    @property
    def _frame(self) -> int:
        return self.session.frame if self.view is None else self.view.frame

    def turn_to(self, frame: int) -> None:
        """Show what is left out of a frame."""
        if self.view is not None:
            self.view.show_over((), self._masks.items(frame) if self._switch.value else ())

    async def reread(self) -> None:
        """Show what the trial holds now."""
        self._masks.list.refresh()
        self.turn_to(self._frame)

    def _note_change(self, what: str) -> None:
        self._says.set_text(f"{what}; players are tracked again from the start, in the step Track")
        self.turn_to(self._frame)


def clip_frames(first: int, last: int, end: int) -> tuple[int, str]:
    """Return the last frame of a stretch of videos that end with a frame, and what to say where that is another.

    Raises TrialError for a stretch that holds none of their frames.
    """
    if last < first:
        raise TrialError(f"the last frame, {last}, lies before the first, {first}; exchange them")
    if not 0 <= first <= end:
        raise TrialError(f"the videos have frames 0 to {end}, not {first}; give a first frame of them")
    return (last, "") if last <= end else (end, f", the last there is: {last} was asked for")
