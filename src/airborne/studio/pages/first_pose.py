"""The step First pose: a body or players are looked for, or landmarks are clicked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from airborne.errors import AirborneError
from airborne.studio.pages.click_players import PlayersPanel
from airborne.studio.pages.click_pose import ClickPanel
from airborne.studio.pages.find_players import FindPlayersPanel
from airborne.studio.pages.find_pose import FindPanel
from airborne.studio.pages.layout import name_missing_steps, page_frame
from airborne.studio.pages.slow_work import complain, in_thread, work
from airborne.studio.session import Session
from airborne.studio.starts import can_be_clicked, read_draft_start

_HELP = "Choose the frame where tracking starts, and place the body there. Each later frame follows from it."
_CLICK, _FIND = "Click the points", "Find automatically"
_NO_LANDMARKS = (
    "To click points of this thing too, name three or more that are not on one line, as [[landmark]] in its body file."
)


async def first_pose_page(session: Session) -> None:
    """Let the user find or click the pose at one frame, and write it into the trial."""
    project = session.project()
    title = "Where are the players at the start?" if project.has_players else "Where is the body at the start?"
    async with page_frame(session, "First pose", title, _HELP) as changed:
        if name_missing_steps(session, changed, "Videos", "Cameras", "Body"):
            return
        shown = await work("indexing the videos", session.shown)
        rig = await work("calibrating the cameras", session.rig)
        if shown is None or rig is None:
            return
        start = read_draft_start(session) or project.table("start")
        frame = int(start.get("frame", session.frame))
        if project.has_players:
            players = PlayersPanel(session, shown, rig, frame)
            await _build_either(players, FindPlayersPanel(session, shown, rig, frame), changed)
            return
        try:
            model = await in_thread(project.model, says="reading the body")
        except AirborneError as error:
            complain(error)
            return
        find = FindPanel(session, shown, rig, model, frame)
        if can_be_clicked(model):
            panel = ClickPanel(session, shown, rig, model, frame)
            await _build_either(panel, find, changed, first=_CLICK if model.has_joints else _FIND)
        else:
            ui.label(_NO_LANDMARKS).classes("soft small")
            await find.build()
            changed.append(find.reread)


async def _build_either(
    click: ClickPanel | PlayersPanel,
    find: FindPanel | FindPlayersPanel,
    changed: list[Callable[[], Any]],
    *,
    first: str = _CLICK,
) -> None:
    """Lay out the panel for clicks, or the one that finds, as the user chooses."""

    async def build() -> None:
        changed[:] = [each for each in changed if each not in (click.reread, find.reread)]
        area.clear()
        chosen = find if choice.value == _FIND else click
        with area:
            await chosen.build()
        changed.append(chosen.reread)

    choice = (
        ui.toggle([_CLICK, _FIND], value=first, on_change=build).props("dense no-caps").style("align-self: flex-start")
    )
    area = ui.element("div").style("display: contents")
    await build()
