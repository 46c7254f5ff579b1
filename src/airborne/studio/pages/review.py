"""The step Review: a run's views in step with its curves and a 3D scene, one cursor over all."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from airborne.cameras import read_rig
from airborne.motion.run_folder import CALIBRATION, holds_players
from airborne.studio.outlines import run_motion
from airborne.studio.pages.layout import complain, framed, in_thread, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.project import list_runs
from airborne.studio.session import Session
from airborne.studio.stage import draw_cameras
from airborne.studio.view import Curves, View
from airborne.tracking import Status

_HELP = "Step through the run: pictures, curves and scene share one frame. Bands are two standard deviations."


async def review_page(session: Session) -> None:
    """Show a run."""
    async with framed(session, "Review", "Is it right?", _HELP):
        runs = list_runs(session.folder)
        if not runs:
            ui.label("There is no run yet; see the step Track.").classes("warn")
            return
        shown = await work("indexing the videos", session.shown)
        if shown is None:
            return
        names = [each.name for each in runs]

        async def change() -> None:
            content.clear()
            with content:
                await _show_run(session, shown, session.folder / choice.value)

        with ui.element("div").classes("row-line"):
            choice = ui.select(names, label="run", value=names[0], on_change=change)
            choice.props("outlined dense options-dense").style("min-width: 180px")
            jumps = ui.element("div").classes("row-line")
        content = ui.element("div").classes("split").style("flex-direction: column")
        with jumps:
            ui.button("next uncertain", on_click=lambda: _jump(session, choice.value, Status.UNCERTAIN)).props("flat")
            ui.button("next lost", on_click=lambda: _jump(session, choice.value, Status.LOST)).props("flat")
        await change()


async def _show_run(session: Session, shown: ShownTrial, folder: Path) -> None:
    def turn_to(frame: int) -> None:
        session.frame = frame

    with ui.element("div").classes("split"):
        with ui.element("div").classes("wide"):
            View(shown, frame=session.frame, overlay=f"/overlay/{folder.name}/{{frame}}", on_frame=turn_to)
        if not holds_players(folder):
            with ui.element("div").classes("side"):
                motion = await in_thread(run_motion, folder)
                middle = motion.position[motion.has_pose].mean(axis=0) if motion.has_pose.any() else None
                draw_cameras(read_rig(folder / CALIBRATION), path=motion.position, middle=middle)
    Curves(f"/curves/{folder.name}", frame=session.frame)


def _jump(session: Session, name: str, status: Status) -> None:
    """Show the next frame of a status after the one in view, or the first."""
    folder = session.folder / name
    if holds_players(folder):
        complain("players have a status each; step through the strip below the curves")
        return
    motion = run_motion(folder)
    frames = motion.index[motion.status == status.value]
    if not len(frames):
        ui.notify(f"no frame is {status.value}")
        return
    later = frames[frames > session.frame]
    ui.run_javascript(
        'window.dispatchEvent(new CustomEvent("airborne-frame", '
        f"{{detail: {{frame: {int(later[0] if len(later) else frames[0])}, from: null}}}}))"
    )
