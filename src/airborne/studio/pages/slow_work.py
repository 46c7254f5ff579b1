"""Long work and errors, told to the user."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar, cast

from nicegui import Client, app, run, ui

from airborne.errors import AirborneError

_T = TypeVar("_T")
_SILENT_S = 0.1  # a wait that is not announced: shorter ones are not felt as such


@contextmanager
def show_errors() -> Iterator[None]:
    """Show a user's error as a line on the page."""
    try:
        yield
    except AirborneError as error:
        complain(error)


def complain(error: AirborneError | str) -> None:
    """Show what is wrong, in the place of what was wrong before."""
    own: dict[str, Any] = {"group": "complaint", "badgeStyle": "display: none"}
    ui.notify(str(error), type="warning", multi_line=True, timeout=10_000, close_button="Close", **own)


async def in_thread(function: Callable[..., _T], *arguments: object, says: str = "reading") -> _T:
    """Do something that takes time without holding up other windows; what asked ends here if its own is closed.

    Where it takes longer than a tenth of a second, a note says what is done until it ends; none where nobody waits
    for it, and `says` is empty.
    """
    try:
        client = ui.context.client
    except RuntimeError:  # it was closed while this waited for its turn
        raise asyncio.CancelledError from None
    try:
        with _announce_late(client, says):
            return cast(_T, await run.io_bound(function, *arguments))
    finally:
        if client.id not in Client.instances or app.is_stopping:  # it would get None
            raise asyncio.CancelledError


@contextmanager
def _announce_late(client: Client, says: str) -> Iterator[None]:
    """Say on a page what goes on, once it has taken a tenth of a second."""
    notes: list[ui.notification] = []

    def announce() -> None:
        if says and client.id in Client.instances:
            with client:
                notes.append(ui.notification(f"{says} …", spinner=True, timeout=None, type="ongoing"))

    soon = asyncio.get_running_loop().call_later(_SILENT_S, announce)
    try:
        yield
    finally:
        soon.cancel()
        for note in notes:
            if client.id in Client.instances:
                note.dismiss()


class Latest:
    """Slow work of which only the last that was asked for matters: one at a time, and what is overtaken is left out."""

    def __init__(self) -> None:
        """Begin with nothing asked for."""
        self._lock, self._asked = asyncio.Lock(), 0

    async def do(self, says: str, function: Callable[..., _T], *arguments: object) -> _T | None:
        """Do something in a thread, as `in_thread` does; None where something else was asked for meanwhile."""
        self._asked += 1
        asked = self._asked
        async with self._lock:
            result = await in_thread(function, *arguments, says=says) if asked == self._asked else None
        return result if asked == self._asked else None

    async def settle(self) -> None:
        """Wait until nothing that was asked for goes on."""
        async with self._lock:
            pass


async def work(what: str, function: Callable[[], _T]) -> _T | None:
    """Do something slow in a thread, saying what; None where it ends in an error, which is shown."""
    with show_errors():
        return await in_thread(function, says=what)
    return None
