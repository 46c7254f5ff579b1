"""Jumps of the step Review: by button or key to the next frame in which something is uncertain or lost."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from nicegui import ui
from nicegui.events import KeyEventArguments

from airborne.studio.pages.slow_work import complain, in_thread, show_errors
from airborne.studio.strips import doubtful_frames
from airborne.studio.view import CameraViews

_KEYS = {"a": "uncertain", "r": "lost"}  # as amber and red
_LABELS = {"uncertain": "uncertain", "lost": "lost or unseen"}
_UNSEEN = {"uncertain": "", "lost": ", or a joint that no picture shows"}


class Jumps:
    """One window's buttons and keys, for the run in view."""

    def __init__(self) -> None:
        """Begin without a run."""
        self.view: CameraViews | None = None  # of the run
        self._run: Path | None = None
        self._buttons: dict[str, ui.button] = {}
        self._one_at_a_time = asyncio.Lock()  # a key while another run is opened is meant for that

    def build(self) -> None:
        """Lay the buttons out, and listen to the keys."""
        ui.keyboard(on_key=self.press, ignore=["input", "select", "textarea"])
        for key, what in _KEYS.items():
            button = ui.button(f"Next {_LABELS[what]}", on_click=lambda _, to=what: self.go(to)).props("flat")
            self._buttons[what] = button.tooltip(
                f"frames with a {what} body, joint or player{_UNSEEN[what]}; key {key.upper()}"
            )

    @asynccontextmanager
    async def turning_to(self, run: Path) -> AsyncIterator[None]:
        """Jump among the frames of this run from now on, as soon as it is laid out; that is done inside."""
        async with self._one_at_a_time:
            self._run = run
            await self.look()
            yield

    async def look(self) -> None:
        """Say how many such frames the run has now."""
        if (run := self._run) is None:
            return
        with show_errors():
            found = await in_thread(doubtful_frames, run, says="reading the run")
            for what, frames in found.items() if run == self._run else ():
                self._buttons[what].set_enabled(len(frames) > 0)
                self._buttons[what].set_text(f"Next {_LABELS[what]}: {len(frames) or 'none'}")

    async def press(self, event: KeyEventArguments) -> None:
        """Jump by key."""
        what = _KEYS.get(str(event.key).lower())
        if event.action.keydown and what is not None and not (event.modifiers.ctrl or event.modifiers.meta):
            await self.go(what, is_back=event.modifiers.shift)

    async def go(self, what: str, *, is_back: bool = False) -> None:
        """Show the next such frame after the one in view, or the first; or the one before, or the last."""
        async with self._one_at_a_time:
            if self._run is None or self.view is None:
                return
            with show_errors():
                frames = (await in_thread(doubtful_frames, self._run, says="reading the run"))[what]
                if not len(frames):
                    complain(f"in no frame of this run is anything {_LABELS[what]}")
                    return
                now = await self.view.latest_frame()
                left = frames[frames < now][::-1] if is_back else frames[frames > now]
                self.view.go(int(left[0] if len(left) else frames[-1 if is_back else 0]))
