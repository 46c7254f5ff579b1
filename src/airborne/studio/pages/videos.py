"""The step Videos: which files are cameras, what they are called, and how they are read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from nicegui import ui

from airborne.errors import AirborneError, count
from airborne.io.names import check_name
from airborne.studio.field_order import ORDERS
from airborne.studio.folder import outer_files
from airborne.studio.pages.layout import name_outer_links, page_frame
from airborne.studio.pages.slow_work import complain, in_thread, show_errors
from airborne.studio.project import VIDEO_ENDINGS, Project, list_videos
from airborne.studio.session import Session
from airborne.studio.trial_edits import with_cameras
from airborne.video import VideoFacts, VideoSource, inspect

_FIELDS = {
    "progressive": "progressive",
    "top-first": "interlaced, top field first",
    "bottom-first": "interlaced, bottom field first",
    "auto": "as the file's flags say",
}


@dataclass(slots=True)
class _Choice:
    """What the user says of one file."""

    video: str
    is_camera: bool
    name: str
    fields: str


async def videos_page(session: Session) -> None:
    """Show the folder's videos, and write those chosen as cameras into the trial."""
    text = (
        "Tick the files that are cameras of one recording; the first one is the clock. "
        "Interlaced files hold two fields in each picture, and so give twice as many images a second."
    )
    async with page_frame(session, "Videos", "Which videos are the cameras?", text, scrolls=True) as changed:
        project = session.project()
        if project.mistake:
            ui.label(project.mistake).classes("bad")
            ui.label(f"Open {session.path.name} in a text editor and correct it, then reload this page.")
        order = [camera.video for camera in project.cameras]  # the trial's, as its first camera is the clock
        files = list_videos(session.folder)
        files.sort(key=lambda path: order.index(path.name) if path.name in order else len(order))
        name_outer_links(outer_files(session.folder, *VIDEO_ENDINGS))
        if not files:
            ui.label(f"{session.folder} holds no videos; copy them there, then reload this page.").classes("warn")
            return
        choices: list[_Choice] = []
        clock = ui.refreshable(lambda: _link_to_clock(session))

        def save() -> None:
            _save(session, choices)
            clock.refresh()

        async def show_anew() -> None:
            clock.refresh()

        with ui.element("div").classes("row-line"):
            use = ui.button("Use these cameras", on_click=save).props("unelevated")
            use.disable()
            ui.label(f"writes {session.path.name}").classes("soft small")
            clock()
        with ui.element("div").classes("files"):
            for path in files:
                facts = await in_thread(_facts, path, says=f"looking at {path.name}")
                choices.append(_choose(project, path, facts))
                _card(choices[-1], facts)
        use.set_enabled(project.mistake is None)
        changed.append(show_anew)


def _link_to_clock(session: Session) -> None:
    """Show the way to one clock, where the trial has several cameras."""
    if len(session.project().cameras) > 1:
        with ui.element("a").props('href="/sync"').classes("plain"):
            ui.label("Put them on one clock")


def _facts(path: Path) -> VideoFacts | str:
    try:
        return inspect(VideoSource(path.name, path))
    except AirborneError as error:
        return str(error).removeprefix(f"{path.name}: ").replace(str(path), "this file")


def _choose(project: Project, path: Path, facts: VideoFacts | str) -> _Choice:
    """Return what the trial says of a file; of one that it does not name, what the file's flags say."""
    camera = next((each for each in project.cameras if each.video == path.name), None)
    if camera is not None:
        return _Choice(path.name, True, camera.name, camera.fields)
    if isinstance(facts, str):
        return _Choice(path.name, False, path.stem, "progressive")
    return _Choice(path.name, not project.cameras, path.stem, facts.flagged_order)


def _card(choice: _Choice, facts: VideoFacts | str) -> None:
    with ui.element("div").classes("card"):
        if isinstance(facts, str):
            ui.label(choice.video).classes("name")
            ui.label(facts).classes("bad small")
            return
        picture = ui.element("img").props(f"src=/thumbnail/{quote(choice.video)}")
        picture._props["alt"] = f"first picture of {choice.video}"  # a file's name may hold quotes
        ui.checkbox(choice.video).bind_value(choice, "is_camera").props("dense")
        ui.label().classes("soft small").bind_text_from(choice, "fields", lambda fields: _describe(facts, fields))
        ui.input("name of the camera").bind_value(choice, "name").props("dense outlined")
        fields = ui.select(_FIELDS, label="pictures are").bind_value(choice, "fields")
        fields.props("dense outlined options-dense")
        if facts.flagged_order != "progressive":
            ui.label(f"the file's flags say {_FIELDS[facts.flagged_order]}").classes("soft small")
        orders = ui.refreshable(_show_orders)
        orders(choice, facts)
        fields.on_value_change(lambda: orders.refresh())


def _show_orders(choice: _Choice, facts: VideoFacts) -> None:
    """Show both orders of a file that is read by fields; the right one is obvious where something moves."""
    if _order(facts, choice.fields) == "progressive":
        return
    ui.label("Two neighbouring fields by either order: the correct one has the smaller teeth.").classes("soft small")
    with ui.element("div").classes("row-line"):
        for order in ORDERS:
            with ui.element("figure").style("margin: 0; width: 47%"):
                picture = ui.element("img").props(f"src=/fields/{order}/{quote(choice.video)}")
                picture.style("width: 100%; height: auto")
                picture._props["alt"] = f"{choice.video}, {_FIELDS[order]}"
                ui.label(_FIELDS[order].removeprefix("interlaced, ")).classes("small")


def _describe(facts: VideoFacts, fields: str) -> str:
    length = "" if facts.duration_s is None else f", {float(facts.duration_s):.1f} s"
    halves = "" if _order(facts, fields) == "progressive" else f" = {2 * float(facts.frame_rate):.5g} fields/s"
    return f"{facts.size[0]}×{facts.size[1]} px, {float(facts.frame_rate):.5g} pictures/s{halves}{length}"


def _order(facts: VideoFacts, fields: str) -> str:
    return facts.flagged_order if fields == "auto" else fields


def _save(session: Session, choices: list[_Choice]) -> None:
    chosen = [choice for choice in choices if choice.is_camera]
    if not chosen:
        complain("no video is ticked; tick those that are cameras")
        return
    names = [choice.name for choice in chosen]
    try:
        list(map(check_name, names))
    except ValueError as error:
        complain(str(error))
        return
    if len(set(names)) < len(names):
        complain("two cameras have the same name; give each its own")
        return
    tables = [
        {
            "name": choice.name,
            "video": choice.video,
            "fields": choice.fields if choice.fields != "progressive" else None,
        }
        for choice in chosen
    ]
    with show_errors():
        session.edit_trial(
            lambda text: with_cameras(text, session.folder.name, tables), f"{count(len(chosen), 'camera')} chosen"
        )
        ui.notify(f"{session.path.name} is written: {', '.join(names)}", type="positive")
