"""A look at the files of the run in view: what a page shows of it is shown anew when they change, by whomever."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from inspect import isawaitable
from pathlib import Path
from typing import Any

from nicegui import ui

from airborne.motion.run_folder import JOINTS, MOTION, SUMMARY
from airborne.studio.folder import file_stamp
from airborne.studio.pages.slow_work import show_errors

_LOOK_EVERY_S = 1.0  # at the files' stamps
_FILES = (MOTION, JOINTS, SUMMARY)  # of which at least one changes whenever a run does


class RunWatch:
    """One window's look at a run, which may be tracked on or again here, in another window or by a command."""

    def __init__(self, folder: Path) -> None:
        """Look every second from now on."""
        self.folder = folder
        self._seen = self._stamp
        self.changed: list[Callable[[], Any]] = []  # what shows the run anew
        ui.timer(_LOOK_EVERY_S, self.look)

    @property
    def _stamp(self) -> Hashable:
        return tuple(file_stamp(self.folder / name) for name in _FILES)

    async def look(self) -> None:
        """Show the run anew if it is another."""
        if self._seen == (now := self._stamp):
            return
        self._seen = now
        with show_errors():
            for show in self.changed:
                if isawaitable(result := show()):
                    await result
