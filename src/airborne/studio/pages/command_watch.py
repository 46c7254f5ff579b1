"""A command that a page starts, and looks at until it ends: what it says of itself, its buttons, its end."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from inspect import isawaitable

from nicegui import ui

from airborne.errors import STOPPED
from airborne.studio.commands import Command
from airborne.studio.pages.slow_work import complain, in_thread
from airborne.studio.session import Session

_LOOK_EVERY_S = 0.5  # at a command that goes on


class CommandWatch:
    """One window's look at a command of the session, which belongs to all windows."""

    def __init__(
        self,
        session: Session,
        name: str,
        on_end: Callable[[Command], Awaitable[None] | None],
        *,
        words: str,
        codes: Sequence[int] = (0,),
        again: bool = False,
        how_far: Callable[[], str] | None = None,
    ) -> None:
        """Look at the session's command of a name; `words` say what it does, `codes` with which it ends well.

        `how_far` says how far it is, in the place of what the command says of itself.

        `on_end` is called with a command that ends well; what another says is shown. With `again` that goes for one
        that had ended before the page was opened, too.
        """
        self.session, self.name, self._on_end, self.words, self._codes = session, name, on_end, words, codes
        self._how_far = how_far
        self._ended = None if again or self.is_running else self.command
        self.buttons: list[ui.button] = []  # that wait while it runs
        self.says = ui.label().classes("small soft")
        self.halt = ui.button("Stop", on_click=self.stop).props("flat dense")
        self.timer = ui.timer(_LOOK_EVERY_S, self.look)
        self._show()

    @property
    def command(self) -> Command | None:
        """The command that was started last."""
        return self.session.commands.get(self.name)

    @property
    def is_running(self) -> bool:
        """Whether it goes on."""
        return self.command is not None and self.command.is_running

    def start(self, *words: str, writes: str = "", what: str = "") -> None:
        """Start `airborne` with these words, unless it runs; what it `writes` of the trial's files can be undone."""
        if not self.is_running:
            self.session.commands[self.name] = command = Command(words, self.session.folder)
            if writes:
                self.session.editor.expect(writes, what, lambda: not command.is_running)
            self._show()

    async def stop(self) -> None:
        """Stop it."""
        if self.command is not None:
            await in_thread(self.command.stop, says="stopping")

    async def look(self) -> None:
        """Say how it goes, or what came of it."""
        self._show()
        command = self.command
        if command is None or command.is_running or command is self._ended:
            return
        self._ended = command
        if command.code in self._codes:
            result = self._on_end(command)
            if isawaitable(result):
                await result
        elif command.code != STOPPED:
            complain(command.complaint())

    def _show(self) -> None:
        command, is_running = self.command, self.is_running
        self.halt.set_visibility(is_running)
        for button in self.buttons:
            button.set_enabled(not is_running)
        if command is not None and is_running:
            line = command.how_far() if self._how_far is None else self._how_far()
            self.says.set_text(f"{self.words}, {command.seconds:.0f} s{': ' if line else ''}{line}")
        elif command is not self._ended:
            self.says.set_text("")
