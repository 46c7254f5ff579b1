"""The step Review: a run's views in step with its curves and a 3D scene, one cursor over all."""

from __future__ import annotations

from collections.abc import Callable
from inspect import isawaitable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from nicegui import ui
from nicegui.elements.scene.scene import Scene

from airborne.errors import format_digits
from airborne.export.palette import VERMILION
from airborne.motion.run_folder import SUMMARY, holds_players, read_summary
from airborne.studio.curve_data import Momenta, curve_kinds, describe_distance, run_momenta
from airborne.studio.disagreement import look_for_disagreement
from airborne.studio.outlines import BESIDE_COLOUR, leg_rods, player_colours, sides_m
from airborne.studio.pages.correct import Correction
from airborne.studio.pages.jumps import Jumps
from airborne.studio.pages.layout import page_frame, two_columns
from airborne.studio.pages.mask_cameras import PlayersMasks
from airborne.studio.pages.run_watch import RunWatch
from airborne.studio.pages.slow_work import in_thread, show_errors, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.project import list_runs
from airborne.studio.runs import run_body, run_players, run_rig, run_rows
from airborne.studio.session import Session
from airborne.studio.stage import Arrow, BodyOnStage, Sticks, draw_cameras, overview, reach_of
from airborne.studio.view import CameraViews, Curves
from airborne.tracking import Status

_MOMENTUM_COLOUR, _LONGEST_M = VERMILION, 1.0  # chosen: its arrow's length where it is greatest in the run
_HELP = "Pictures, curves and scene share one frame. Bands are two standard deviations, numbers ± one."


async def review_page(session: Session) -> None:
    """Show a run."""
    async with page_frame(session, "Review", "Is it right?", _HELP) as changed:
        runs = list_runs(session.folder)
        if not runs:
            ui.label("There is no run yet; see the step Track.").classes("warn")
            return
        shown = await work("indexing the videos", session.shown)
        if shown is None:
            return
        names = [each.name for each in runs]
        view: CameraViews | None = None

        def frame() -> int:
            return session.frame if view is None else view.frame

        jumps = Jumps()

        async def list_anew() -> None:
            """Offer the runs that there are now."""
            found = [each.name for each in list_runs(session.folder)]
            names[:] = found if choice.value in found else [choice.value, *found]
            if choice.options != names:
                choice.set_options(list(names))
                beside.set_options(["", *(name for name in names if name != choice.value)])
                beside.set_visibility(len(names) > 1)

        async def change() -> None:
            nonlocal view
            others = [name for name in names if name != choice.value]
            if beside.value not in ("", *others):
                beside.set_options(["", *others], value="")  # which calls this again
                return
            beside.set_options(["", *others])
            folder = session.folder / choice.value
            blame.set_visibility(not holds_players(folder))  # which have no outline to compare
            async with jumps.turning_to(folder):
                content.clear()
                with content:
                    files = RunWatch(folder)
                    view, correction = await _show_run(
                        session, shown, files, beside.value, frame(), on_turn=lambda: says.set_text("")
                    )
                    files.changed.append(jumps.look)
                jumps.view = view
                changed[:] = [list_anew, correction.reread]

        with ui.element("div").classes("row-line tools"):
            choice = ui.select(list(names), label="run", value=names[0], on_change=change)
            choice.props("outlined dense options-dense").style("min-width: 180px")
            beside = ui.select([""], label="Compare with", value="", on_change=change)
            beside.props("outlined dense options-dense").style("min-width: 150px")
            beside.set_visibility(len(names) > 1)
            jumps.build()
            blame = ui.button("Which camera disagrees?").props("flat")
            blame.on_click(lambda: _blame(session, shown, session.folder / choice.value, frame(), says))
        says = ui.label().classes("small")
        says.bind_visibility_from(says, "text")
        content = ui.element("div").classes("split").style("flex-direction: column")
        await change()


async def _blame(session: Session, shown: ShownTrial, folder: Path, frame: int, says: ui.label) -> None:
    """Say which camera disagrees with the run about the frame in view."""
    text = await work(
        "comparing edges with outlines", lambda: look_for_disagreement(folder, frame, shown, session.pictures)
    )
    if text is not None:
        says.set_text(f"Frame {frame}: {text}.")


async def _show_run(
    session: Session, shown: ShownTrial, files: RunWatch, beside: str, frame: int, *, on_turn: Callable[[], Any]
) -> tuple[CameraViews, Correction | PlayersMasks]:
    """Lay a run out, at a frame, and let what shows it be shown anew when its files change.

    Return its pictures, and what corrects it. `on_turn` is called when another frame is shown.
    """
    folder = files.folder
    bodies: list[Callable[[int], Any]] = []
    correction = PlayersMasks(session, shown) if holds_players(folder) else Correction(session, shown, files)
    alarms = ui.refreshable(_show_alarms)
    await alarms(folder)
    address = f"/curves/{quote(folder.name)}?beside={quote(beside)}&of="
    with ui.element("div").classes("row-line"):
        correction.build()
        bodies.append(correction.turn_to)
        kinds = await in_thread(curve_kinds, folder, says="reading the run")
        kind = ui.select(kinds, label="curves", value="", on_change=lambda: curves.show(address + quote(kind.value)))
        kind.props("outlined dense options-dense").style("min-width: 180px")
        kind.set_visibility(len(kinds) > 1)

    async def turn_to(frame: int) -> None:
        session.go(frame=frame)
        on_turn()
        with show_errors():
            for show in bodies:
                if isawaitable(result := show(frame)):
                    await result

    query = f"?beside={quote(beside)}" if beside else ""
    if beside:
        with ui.element("div").classes("row-line small"), show_errors():
            ui.element("span").style(f"width: 16px; border-top: 3px solid {BESIDE_COLOUR}")
            ui.label(beside).classes("name")
            ui.label(
                await in_thread(describe_distance, folder, session.folder / beside, says="comparing the runs")
            ).classes("soft")
    wide, side = two_columns()
    with wide:
        view = CameraViews(
            shown,
            frame=frame,
            overlay=f"/overlay/{quote(folder.name)}/{{frame}}{query}",
            on_frame=turn_to,
            on_move=correction.move if isinstance(correction, Correction) else None,
            on_drag=correction.drag if isinstance(correction, Correction) else None,
        )
        correction.view = view
    with side:
        correction.build_watch()
        if isinstance(correction, PlayersMasks):
            bodies.append(await _players_stage(folder, view.frame))
        else:
            bodies += await _stage(files, view)
    curves = Curves(address, frame=frame)

    def draw_anew() -> None:
        view.run_method("refresh")
        curves.run_method("load")
        alarms.refresh()

    files.changed += [draw_anew, lambda: turn_to(view.frame)]
    return view, correction


async def _show_alarms(folder: Path) -> None:
    """Show what the self-check of a finished run found wrong."""
    with show_errors():
        summary = await in_thread(read_summary, folder, says="reading the run") if (folder / SUMMARY).is_file() else {}
        for finding in summary.get("self_check") or []:
            if finding["is_alarm"]:
                ui.label(finding["sentence"]).classes("bad small")


async def _stage(files: RunWatch, view: CameraViews) -> list[Callable[[int], None]]:
    """Build the scene of a run of one body; return what shows a frame in it."""
    folder = files.folder
    rows = await in_thread(run_rows, folder, says="reading the run")
    model = await in_thread(run_body, folder, says="reading the run")
    path, reach_m = rows.position[np.isfinite(rows.position).all(axis=1)], reach_of(model)
    around = overview(np.vstack([path - reach_m, path + reach_m])) if len(path) else None
    scene = draw_cameras(run_rig(folder), rows.position, seen_from=around)
    body = BodyOnStage(scene, model, f"/mesh/{quote(folder.name)}/{{part}}")

    def show(frame: int) -> None:
        body.show(run_rows(folder).pose(frame))

    arrow = MomentumArrow(folder, view, scene)
    files.changed.append(arrow.read)
    return [show, arrow.show]


async def _players_stage(folder: Path, frame: int) -> Callable[[int], None]:
    """Build the scene of a run of players at a frame, sticks down their legs; return what shows another in it."""
    motion = await in_thread(run_players, folder, says="reading the run")
    points = motion.points[np.isfinite(motion.points).all(axis=3)]  # (n, 3)
    scene = draw_cameras(run_rig(folder), seen_from=overview(points) if len(points) else None)
    colours = player_colours(dict(zip(motion.players, sides_m(motion), strict=True)))
    rods = [(motion.joints.index(a), motion.joints.index(b)) for a, b in leg_rods(motion.joints)]
    sticks = Sticks(scene, [colours[name] for name in motion.players for _ in rods])

    def show(frame: int) -> None:
        row = int(np.searchsorted(motion.index, frame))
        ends = np.full((len(motion.players), len(rods), 2, 3), np.nan)
        if row < len(motion.index) and motion.index[row] == frame:
            is_there = motion.status[row] != Status.LOST.value
            ends[is_there] = motion.points[row][is_there][:, rods]
        sticks.show(ends.reshape(-1, 2, 3))

    show(frame)
    return show


class MomentumArrow:
    """The angular momentum at the frame in view: an arrow at the centre of mass, and its size in words."""

    def __init__(self, folder: Path, view: CameraViews, scene: Scene) -> None:
        """Read the run's table once the page is there; a long one takes its time."""
        self._folder, self._view = folder, view
        self._momenta: Momenta | None = None
        self._arrow, self._says = Arrow(scene, _MOMENTUM_COLOUR), ui.label().classes("small soft")
        ui.timer(0, self.read, once=True)

    async def read(self) -> None:
        """Read the run's table, and show what it says of the frame in view."""
        with show_errors():
            self._momenta = await in_thread(run_momenta, self._folder, says="reading the run")
            self.show(self._view.frame)

    def show(self, frame: int) -> None:
        """Show a frame's."""
        if self._momenta is None:
            return
        com_m, L, sd = self._momenta.at(frame) or (np.zeros(3), np.zeros(3), 0.0)
        self._arrow.show(com_m, L / self._momenta.greatest * _LONGEST_M)
        size = float(np.linalg.norm(L))
        text = f"arrow: angular momentum {format_digits(size, 3)} ± {format_digits(sd, 3)} kg m²/s"
        self._says.set_text(text if size else "")
