"""The step Body: what is tracked, a body file of the folder or a person of given size."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from airborne.body import BodyModel
from airborne.errors import AirborneError, count
from airborne.io.text import parse_editable_toml
from airborne.studio.folder import outer_files
from airborne.studio.pages.layout import complain, errors_shown, in_thread, name_outer_links, page_frame
from airborne.studio.project import BODY_ENDING, MEASURED_ENDINGS, list_bodies, list_measurements
from airborne.studio.session import Session
from airborne.studio.stage import draw_body
from airborne.studio.trial_edits import with_table
from airborne.trial.body import BodyTable
from airborne.trial.settings import PLAYERS_METHODS

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
        with ui.element("div").classes("row-line").style("align-items: flex-start"):
            if bodies:
                _thing_card(session, bodies, table)
            _person_card(session, table)
            _measurements_card(session, measured, table)
            _players_card(session)
            scene = ui.refreshable(_show_body)
            await scene(session)

        async def show_anew() -> None:
            await scene.refresh()

        changed.append(show_anew)
        with ui.element("div").classes("row-line"):
            if session.project().cameras:
                _link("/thing", "Describe a thing made of solids")
            if session.project().table("calibration"):
                _link("/ruler", "Measure a length in the pictures")


def _link(address: str, text: str) -> None:
    with ui.element("a").props(f'href="{address}"').classes("plain"):
        ui.label(text)


def _thing_card(session: Session, bodies: dict[str, BodyModel], table: dict[str, Any]) -> None:
    with ui.element("div").classes("card").style("width: 360px"):
        ui.label("A body file").classes("name")
        present = table.get("file")
        choice = ui.select(
            list(bodies), label="file", value=present if present in bodies else next(iter(bodies))
        ).props("outlined dense options-dense")
        says = ui.label().classes("soft small")
        says.bind_text_from(choice, "value", lambda name: _describe(bodies[name]))
        ui.button("Use this body", on_click=lambda: save_body(session, {"file": choice.value})).props("unelevated")


def _person_card(session: Session, table: dict[str, Any]) -> None:
    with ui.element("div").classes("card").style("width: 360px"):
        ui.label("A person").classes("name")
        stature = ui.number("stature [m]", value=table.get("stature_m", 1.75), step=0.01, format="%.2f")
        mass = ui.number("mass [kg]", value=table.get("mass_kg", 70.0), step=0.5, format="%.1f")
        for field in (stature, mass):
            field.props("outlined dense")

        def save() -> None:
            stature_m, mass_kg = float(stature.value or 0), float(mass.value or 0)
            if not (_STATURE_M[0] <= stature_m <= _STATURE_M[1] and _MASS_KG[0] <= mass_kg <= _MASS_KG[1]):
                complain("give a stature in metres, such as 1.75, and a mass in kilograms, such as 70")
                return
            save_body(session, {"preset": "human18", "stature_m": stature_m, "mass_kg": mass_kg})

        ui.button("Use this person", on_click=save).props("unelevated")


def _measurements_card(session: Session, files: list[str], table: dict[str, Any]) -> None:
    if not files:
        return
    with ui.element("div").classes("card").style("width: 360px"):
        ui.label("A measured person").classes("name")
        present = table.get("measurements")
        choice = ui.select(files, label="Yeadon's measurements", value=present if present in files else files[0])
        choice.props("outlined dense options-dense")
        ui.button("Use these measurements", on_click=lambda: save_body(session, {"measurements": choice.value})).props(
            "unelevated"
        )


async def _show_body(session: Session) -> None:
    """Show the trial's body from all sides; players have none."""
    try:
        model = await in_thread(session.project().model, says="reading the body")
    except AirborneError:
        return
    address = f"/body/mesh/{{part}}?{hash(repr(session.project().table('body')))}"  # another body's parts are others
    with ui.element("div").style("display: flex; width: 360px; height: 320px"):
        draw_body(model, address)


def _players_card(session: Session) -> None:
    with ui.element("div").classes("card").style("width: 360px"):
        ui.label("Players").classes("name")
        text = "Hips, knees and feet of any number of players, such as blockers at the net."
        ui.label(text).classes("soft small")
        ui.button("Use players", on_click=lambda: save_body(session, {"preset": "legs"})).props("unelevated")


def _describe(model: BodyModel) -> str:
    parts = sum(len(segment.parts) for segment in model.segments)
    return f"{model.name}: {count(len(model.segments), 'segment')}, {count(parts, 'solid')}"


def save_body(session: Session, values: dict[str, Any]) -> None:
    """Write another body into the trial, and a method that can track it where the old one cannot."""
    with errors_shown():
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
