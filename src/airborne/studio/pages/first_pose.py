"""The step First pose: a thing is looked for, a person's landmarks are clicked."""

from __future__ import annotations

from nicegui import ui

from airborne.errors import AirborneError
from airborne.studio.pages.click_players import PlayersPanel
from airborne.studio.pages.click_pose import ClickPanel
from airborne.studio.pages.find_pose import FindPanel
from airborne.studio.pages.layout import complain, in_thread, page_frame, work
from airborne.studio.session import Session


async def first_pose_page(session: Session) -> None:
    """Let the user find or click the pose at one frame, and write it into the trial."""
    project = session.project()
    async with page_frame(session, "First pose", "Where is the body at the start?", "") as changed:
        missing = [name for name in ("camera", "calibration", "body") if not project.tables.get(name)]
        if missing:
            ui.label(f"This step needs the steps before it: {', '.join(missing)}.").classes("warn")
            return
        shown = await work("indexing the videos", session.shown)
        rig = await work("calibrating the cameras", session.rig)
        if shown is None or rig is None:
            return
        frame = int(project.table("start").get("frame", session.frame))
        if project.table("body").get("preset") == "legs":
            players = PlayersPanel(session, shown, rig, frame)
            changed.append(players.reread)
            await players.build()
            return
        try:
            model = await in_thread(project.model)
        except AirborneError as error:
            complain(error)
            return
        if model.has_joints:
            panel = ClickPanel(session, shown, rig, model, frame)
            changed.append(panel.reread)
            await panel.build()
        else:
            await FindPanel(session, shown, rig, model, frame).build()
