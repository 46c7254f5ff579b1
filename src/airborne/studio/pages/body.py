"""The step Body: what is tracked, a body file of the folder or a person of given size."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Hashable, Mapping
from typing import Any, TypeAlias

from nicegui import ui

from airborne.body import BodyModel, Pose
from airborne.errors import AirborneError, count
from airborne.io.text import parse_editable_toml
from airborne.run.first_pose import find_first_pose
from airborne.studio.folder import outer_files
from airborne.studio.outlines import outline_items
from airborne.studio.pages.layout import name_outer_links, page_frame
from airborne.studio.pages.slow_work import complain, in_thread, show_errors
from airborne.studio.project import BODY_ENDING, MEASURED_ENDINGS, list_bodies, list_measurements
from airborne.studio.session import Session
from airborne.studio.stage import draw_body, reach_of
from airborne.studio.starts import POSE_COLOUR
from airborne.studio.trial_edits import with_table
from airborne.studio.view import CameraViews
from airborne.trial.body import BodyTable
from airborne.trial.settings import PLAYERS_METHODS

Use: TypeAlias = Callable[[dict[str, Any]], Awaitable[None]]  # takes the table [body] to write
_SEEN_PX = 320  # high: the body in 3D and over the pictures
_KEYS = ("file", "preset", "stature_m", "mass_kg", "measurements")
_STATURE_M, _MASS_KG = (0.5, 2.6), (10.0, 300.0)  # that are taken for a person's


async def body_page(session: Session) -> None:
    """Let the user choose a body file, or say how tall and heavy the person is."""
    text = (
        "A thing needs a body file with its measured solids and colours. "
        "A person's body is scaled from stature and mass, and its colours are taken from the video."
    )
    async with page_frame(session, "Body", "What is tracked?", text, scrolls=True) as changed:
        table = session.project().table("body")
        bodies = await in_thread(list_bodies, session.folder, says="reading the bodies")
        measured = await in_thread(list_measurements, session.folder, says="reading the measurements")
        name_outer_links(outer_files(session.folder, BODY_ENDING, *MEASURED_ENDINGS))
        in_force = ui.refreshable(lambda: ui.label(describe_body(session.project().table("body"))).classes("name"))
        in_force()
        seen = ui.refreshable(_show_body)
        shown_of: list[Hashable] = []

        async def show_anew() -> None:
            tables = repr([session.project().table(name) for name in ("body", "calibration", "start")])
            if shown_of != [tables]:
                shown_of[:] = [tables]
                in_force.refresh()
                await seen.refresh()

        async def use(values: dict[str, Any]) -> None:
            save_body(session, values)
            await show_anew()

        with ui.element("div").classes("row-line").style("align-items: flex-start"):
            if bodies:
                _thing_card(bodies, table, use)
            _person_card(table, use)
            _measurements_card(measured, table, use)
            _players_card(use)
        with ui.element("div").classes("row-line"):
            if session.project().cameras:
                _link("/thing", "Describe a thing made of solids")
            if session.project().table("calibration"):
                _link("/ruler", "Measure a length in the pictures")
        await seen(session)
        changed.append(show_anew)


def _link(address: str, text: str) -> None:
    with ui.element("a").props(f'href="{address}"').classes("plain"):
        ui.label(text)


def _thing_card(bodies: dict[str, BodyModel], table: dict[str, Any], use: Use) -> None:
    with _card():
        ui.label("A body file").classes("name")
        present = table.get("file")
        choice = ui.select(
            list(bodies), label="file", value=present if present in bodies else next(iter(bodies))
        ).props("outlined dense options-dense")
        says = ui.label().classes("soft small")
        says.bind_text_from(choice, "value", lambda name: _describe(bodies[name]))
        ui.button("Use this body", on_click=lambda: use({"file": choice.value})).props("unelevated")


def _person_card(table: dict[str, Any], use: Use) -> None:
    with _card():
        ui.label("A person").classes("name")
        stature = ui.number("stature [m]", value=table.get("stature_m", 1.75), step=0.01, format="%.2f")
        mass = ui.number("mass [kg]", value=table.get("mass_kg", 70.0), step=0.5, format="%.1f")
        for field in (stature, mass):
            field.props("outlined dense")

        async def save() -> None:
            stature_m, mass_kg = float(stature.value or 0), float(mass.value or 0)
            if not _STATURE_M[0] <= stature_m <= _STATURE_M[1]:
                is_cm = _STATURE_M[0] <= stature_m / 100 <= _STATURE_M[1]
                meant = f"in centimetres? Then give {stature_m / 100:g}" if is_cm else "give it in metres, as 1.75"
                complain(f"the stature is {stature_m:g} m; {meant}")
                return
            if not _MASS_KG[0] <= mass_kg <= _MASS_KG[1]:
                complain(f"the mass is {mass_kg:g} kg; expected {_MASS_KG[0]:g} to {_MASS_KG[1]:g}; correct it")
                return
            await use({"preset": "human18", "stature_m": stature_m, "mass_kg": mass_kg})

        ui.button("Use this person", on_click=save).props("unelevated")


def _measurements_card(files: list[str], table: dict[str, Any], use: Use) -> None:
    if not files:
        return
    with _card():
        ui.label("A measured person").classes("name")
        present = table.get("measurements")
        choice = ui.select(files, label="Yeadon's measurements", value=present if present in files else files[0])
        choice.props("outlined dense options-dense")
        button = ui.button("Use these measurements", on_click=lambda: use({"measurements": choice.value}))
        button.props("unelevated")


async def _show_body(session: Session) -> None:
    """Show the trial's body from all sides, and over the pictures of the first pose; players have none."""

    def read() -> BodyModel:
        model = session.project().model()
        reach_of(model)  # computes its surface, here and not where windows wait
        return model

    try:
        model = await in_thread(read, says="reading the body")
    except AirborneError:
        return
    address = f"/body/mesh/{{part}}?{hash(repr(session.project().table('body')))}"  # another body's parts are others
    with ui.element("div").style(f"display: flex; gap: 12px; height: {_SEEN_PX}px; flex: none"):
        with ui.element("div").style("display: flex; width: 320px"):
            draw_body(model, address)
        placed = await in_thread(_place, session, model, says="placing the body")
        if placed is not None:
            frame, pose = placed
            shown = session.shown()
            items = outline_items(model.with_pose(pose), session.rig().select(shown.names).cameras, POSE_COLOUR)
            with ui.element("div").style("display: flex; flex-direction: column; flex: 1; min-width: 0"):
                view = CameraViews(shown, frame=frame, on_frame=lambda at: view.show_over((), items * (at == frame)))
                view.show_over((), items)


def _place(session: Session, model: BodyModel) -> tuple[int, Pose] | None:
    """Return the frame and the first pose of the trial; None where it has none, or none yet."""
    try:
        trial, rig = session.project().trial(), session.rig()
        session.shown()
        if trial.start.find or trial.start.detections is not None:
            return None
        return trial.start.frame, find_first_pose(trial, model, rig, None).pose
    except AirborneError:
        return None


def describe_body(table: Mapping[str, Any]) -> str:
    """Say which body a trial has, as its table [body] gives it."""
    preset, file, measured = (table.get(key) for key in ("preset", "file", "measurements"))
    if file:
        return f"The body now: {file}"
    if measured:
        return f"The body now: a person as measured in {measured}"
    if preset == "legs":
        return "The body now: players"
    if preset:
        return f"The body now: a person, {table.get('stature_m', '?')} m, {table.get('mass_kg', '?')} kg"
    return "No body is chosen yet."


def _card() -> ui.element:
    return ui.element("div").classes("card").style("width: 320px")


def _players_card(use: Use) -> None:
    with _card():
        ui.label("Players").classes("name")
        text = "Hips, knees and feet of any number of players, such as blockers at the net."
        ui.label(text).classes("soft small")
        ui.button("Use players", on_click=lambda: use({"preset": "legs"})).props("unelevated")


def _describe(model: BodyModel) -> str:
    parts = sum(len(segment.parts) for segment in model.segments)
    return f"{model.name}: {count(len(model.segments), 'segment')}, {count(parts, 'solid')}"


def save_body(session: Session, values: dict[str, Any]) -> None:
    """Write another body into the trial, and a method that can track it where the old one cannot."""
    with show_errors():
        try:
            BodyTable(**values)
        except ValueError as error:
            raise AirborneError(str(error)) from None
        session.edit_trial(lambda text: _with_body(text, values), "body chosen")
        ui.notify("the body is written into the trial", type="positive")


def _with_body(text: str, values: dict[str, Any]) -> str:
    """Return a trial's text with another body, and with a method that can track it."""
    text = with_table(text, "body", {**dict.fromkeys(_KEYS), **values})
    method = parse_editable_toml(text).get("track", {}).get("method")
    if values.get("preset") == "legs":
        return text if method in PLAYERS_METHODS else with_table(text, "track", {"method": PLAYERS_METHODS[0]})
    return with_table(text, "track", {"method": None}) if method in PLAYERS_METHODS else text
