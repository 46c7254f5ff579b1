"""What all pages share: the bar, the rail of steps, the sheet of keys, two columns."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Sequence
from contextlib import asynccontextmanager

from nicegui import ui
from nicegui.events import KeyEventArguments

from airborne.export.palette import BLUE
from airborne.studio.guide import next_task
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.project import steps
from airborne.studio.session import Session

_LOOK_EVERY_S = 0.25  # for changes by this window, by others and by other programs: the rail follows at once
_BLUE = BLUE  # of buttons: dark enough for white letters
_GREEN = "#006b3c"  # of good news, likewise
_KEYS = {
    "← →": "one frame back or on; with Shift ten",
    ", .": "one frame back or on, also while a point is chosen",
    "Home End": "first and last frame",
    "Space": "play, stop",
    "wheel": "zoom where the pointer is",
    "drag": "move the picture, a point, or the body where it is outlined",
    "Shift+drag": "turn the body",
    "0": "whole pictures",
    "double-click": "one whole picture, where clicks set no point",
    "C": "one camera alone, the next one, all of them",
    "click": "set the chosen point",
    "arrows": "move the chosen point by 0.1 px; with Shift by 1 px",
    "A": "the next frame in which the body, a joint or a player is uncertain, in Review; with Shift the one before",
    "R": "the next frame in which one of them is lost, or a joint is in no picture; with Shift the one before",
    "E": "both pictures show the same event, where cameras are synchronised by hand",
    "N P": "choose the next point, the one before",
    "Delete": "remove the chosen click, where points are clicked",
    "Ctrl+Enter": "press the page's blue button: Use, Track, Track again; of several cards that in which the cursor is",
    "Esc": "let go of the chosen mark",
    "Ctrl+Z, Ctrl+Y": "undo, redo",
    "?": "this sheet",
}

_PAGE_KEYS = 'import("/parts/page_keys.js")'


@asynccontextmanager
async def page_frame(
    session: Session,
    here: str,
    title: str,
    text: str,
    *,
    scrolls: bool = False,
    task: str = "",
) -> AsyncIterator[list[Callable[[], Awaitable[None]]]]:
    """Lay out a page: `here` is its step, `text` its help. What it yields takes what to call when a file has changed.

    `task` names a page beside the step's own in the guided walk.

    What stands in it is built once the window is there, so that it may take its time.
    """
    changed: list[Callable[[], Awaitable[None]]] = []
    ui.colors(primary=_BLUE, positive=_GREEN)
    sheet, example, known = _sheet(), _example(here), [session.stamp]

    async def move(verb: str) -> None:
        with show_errors():
            what = session.editor.undo() if verb == "undo" else session.editor.redo()
            ui.notify(f"{'undone' if verb == 'undo' else 'redone'}: {what}")
            await look()

    async def look() -> None:
        with show_errors():
            session.editor.settle()
        for button, tip, what in ((undo, undo_tip, session.editor.last), (redo, redo_tip, session.editor.next)):
            button.set_enabled(what is not None)
            tip.set_text(what or "nothing")
        if known[0] != (stamp := session.stamp):
            known[0] = stamp
            rail.refresh()
            guide.refresh()
            for tell in changed:
                await tell()

    with ui.element("div").classes("bar"):
        ui.label("Airborne").classes("name")
        name = f"{session.folder.name}/{session.path.name}"
        ui.label(name).classes("path small").tooltip(str(session.path))
        ui.element("div").classes("gap")
        with ui.button(icon="undo", on_click=lambda: move("undo")).props("flat round dense aria-label=Undo") as undo:
            undo_tip = ui.tooltip()
        with ui.button(icon="redo", on_click=lambda: move("redo")).props("flat round dense aria-label=Redo") as redo:
            redo_tip = ui.tooltip()
        ui.button("An example", on_click=example.open).props("flat dense no-caps")
        ui.button("Keys  ?", on_click=sheet.open).props("flat dense")
    with ui.element("div").classes("body"):
        with ui.element("nav").classes("rail").props("aria-label=steps"):
            rail = ui.refreshable(lambda: _rail(session, here))
            rail()
        ui.timer(_LOOK_EVERY_S, look)
        ui.keyboard(on_key=lambda event: _key(event, sheet, move), ignore=["input", "select", "textarea"])
        ui.keyboard(on_key=_enter, ignore=[])  # in a field too
        with ui.element("div").classes("main" if scrolls else "main still"):  # the page has a <main> already
            ui.html(f"<h1>{title}</h1>", sanitize=False)
            if text:
                ui.label(text).classes("help")
            guide = ui.refreshable(lambda: _guide(session, here, task))
            guide()
            await look()
            await ui.context.client.connected()
            ui.run_javascript(_PAGE_KEYS)
            yield changed


def two_columns(second: str = "side") -> tuple[ui.element, ui.element]:
    """Lay out two columns and return them: a wide one for pictures, and one beside it that is narrow, or wide too."""
    with ui.element("div").classes("split"):
        return ui.element("div").classes("wide"), ui.element("div").classes(second)


async def _key(event, sheet: ui.dialog, move: Callable[[str], Awaitable[None]]) -> None:
    if not event.action.keydown:
        return
    if event.key == "?":
        sheet.open()
    elif event.modifiers.ctrl and event.key in ("z", "y"):
        await move("undo" if event.key == "z" else "redo")


def _enter(event: KeyEventArguments) -> None:
    if event.action.keydown and not event.action.repeat and event.modifiers.ctrl and event.key == "Enter":
        ui.run_javascript(f"{_PAGE_KEYS}.then((keys) => keys.pressBlue())")


def _rail(session: Session, here: str) -> None:
    for number, step in enumerate(steps(session.project()), start=1):
        state = {"ready": "ready", "needs you": "needs", "empty": "empty"}[step.state]
        classes = f"{state} here" if step.name == here else state
        with ui.element("a").props(f'href="{step.address}"').classes(classes) as link:
            if step.name == here:
                link.props("aria-current=step")
            ui.label("✓" if step.state == "ready" else str(number)).classes("number")
            ui.label(step.name).classes("title")
            ui.label(step.says).classes("says")._props["title"] = step.says


def _guide(session: Session, here: str, page: str) -> None:
    """Show what to do here in the guided walk."""
    if not session.is_guided:
        return
    task, following = next_task(session.project(), here, page)
    with ui.element("div").classes("guide"):
        ui.html(task, sanitize=False)
        if following is not None:
            with ui.element("a").props(f'href="{following.address}"').classes("plain"):
                ui.label(f"Next: {following.name} →")


def _sheet() -> ui.dialog:
    with ui.dialog().props("aria-label=keys") as dialog, ui.card():
        _dialog_head(dialog, "Keys")
        rows = "".join(f"<tr><th><kbd>{key}</kbd></th><td>{what}</td></tr>" for key, what in _KEYS.items())
        ui.html(f'<table class="plain">{rows}</table>', sanitize=False)
    return dialog


def _dialog_head(dialog: ui.dialog, title: str) -> None:
    """Head a dialog that may be longer than the window with its title and the button that closes it."""
    with ui.element("div").classes("row-line").style("width: 100%; justify-content: space-between"):
        ui.html(f"<h2>{title}</h2>", sanitize=False)
        ui.button("Close", on_click=dialog.close).props("flat dense")


def _example(here: str) -> ui.dialog:
    """Lay out a picture of a step that is done well: of the thrown cross."""
    with ui.dialog().props('aria-label="an example"') as dialog, ui.card().style("max-width: min(1120px, 94vw)"):
        _dialog_head(dialog, f"{here}: the thrown cross")
        name = here.lower().replace(" ", "_")
        picture = ui.element("img").props(f"src=/example/{name}.jpg loading=lazy").style("width: 100%; height: auto")
        picture._props["alt"] = f"the step {here}, done for the thrown cross"
    return dialog


def name_missing_steps(session: Session, changed: list[Callable[[], Awaitable[None]]], *needed: str) -> bool:
    """Tell which of the steps that this one needs come first, as they are not ready; return whether any is.

    Once they are, and `changed` is called, the page is loaded anew.
    """

    def missing() -> list[str]:
        return [step.name for step in steps(session.project()) if step.name in needed and step.state != "ready"]

    async def look() -> None:
        if not missing():
            ui.navigate.reload()

    if names := missing():
        verb = "comes" if len(names) == 1 else "come"
        ui.label(f"First {verb} {', '.join(names)}: see the steps at the left.").classes("warn")
        changed.append(look)
    return bool(names)


def name_outer_links(links: Sequence[str]) -> None:
    """Tell which links are not followed, where there are any."""
    if links:
        ui.label(f"{', '.join(links)}: a link that leads out of this folder is not followed; copy the file.").classes(
            "warn"
        )


def show_findings(sentences: Iterable[str]) -> None:
    """Show what a diagnosis found, beside what it speaks of."""
    for sentence in sentences:
        ui.label(sentence).classes("warn small")
