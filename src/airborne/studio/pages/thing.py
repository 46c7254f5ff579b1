"""A thing to be tracked, described in the pictures: solids with sizes, places, and colours taken by a click."""

from __future__ import annotations

import math
from dataclasses import replace

from nicegui import ui

from airborne.errors import AirborneError
from airborne.studio.folder import files_inside
from airborne.studio.pages.body import save_body
from airborne.studio.pages.layout import name_missing_steps, page_frame, two_columns
from airborne.studio.pages.slow_work import complain, in_thread, show_errors, work
from airborne.studio.pictures import ShownTrial
from airborne.studio.session import Session
from airborne.studio.things import LABELS, MESHES, Solid, check_thing, colour_at, parse_thing, thing_text
from airborne.studio.view import CameraViews
from airborne.studio.writing import read_if_there

_FILE = "thing.toml"
_HELP = (
    "Measure the thing with a ruler: a millimetre wrong here is one in the result. Choose a solid and click it in a "
    "picture, in even light: that is its colour. A solid without a colour takes it from the pictures at the first pose."
)
_DRAFT = "thing"  # its name among the drafts
_SOON = "debounce=300"  # [ms] after the last key: a number is one change, not one for each digit
_WORDS = {"size_mm": "lengths", "centre_mm": "centre", "turn_deg": "turn", "scale": "unit"}  # of an undo
_FIELDS = ("size_mm", "centre_mm", "turn_deg")


async def thing_page(session: Session) -> None:
    """Let the user describe a thing."""
    async with page_frame(session, "Body", "What is it made of?", _HELP, task="thing") as changed:
        if name_missing_steps(session, changed, "Videos"):
            return
        shown = await work("indexing the videos", session.shown)
        if shown is not None:
            panel = ThingPanel(session, shown)
            panel.build()
            changed.append(panel.reread)


class ThingPanel:
    """One window's thing: a draft with every change, in its file once it is used."""

    def __init__(self, session: Session, shown: ShownTrial) -> None:
        """Begin with the thing as it was described last, or with a box."""
        self.session, self.shown = session, shown
        self.name, self.solids, self.chosen = "thing", [Solid("box")], 0
        self.text = self._kept()
        self._read()
        self.shapes = ["box", "ellipsoid", *(path.name for path in files_inside(session.folder, *MESHES))]

    def build(self) -> None:
        """Lay out the pictures and the solids."""
        wide, side = two_columns()
        with wide:
            self.view = CameraViews(
                self.shown, frame=self.session.frame, on_frame=self.session.turn_to, on_pick=self.take_colour
            )
            self.view.start_picking()
        with side, ui.element("div").classes("card"):
            name = ui.input("what it is", on_change=lambda: self.keep("thing named")).bind_value(self, "name")
            name.props(f"outlined dense {_SOON}")
            self.form = ui.refreshable(self._form)
            self.form()
            ui.button("Use this thing", on_click=self.write).props("unelevated")

    async def take_colour(self, pane: int, u: float, v: float, near: str | None) -> None:
        """Give the chosen solid the colour that a picture has there."""
        number = int(self.shown.clock.images[self.view.frame, pane])
        with show_errors():
            image = await in_thread(self.session.pictures.image, self.shown.sources[pane], number, says="decoding")
            if image is not None:
                self.change(colour=colour_at(image, u, v))
                self.form.refresh()

    def change(self, **values: object) -> None:
        """Change the chosen solid."""
        self.solids[self.chosen] = replace(self.solids[self.chosen], **values)
        self.keep(f"{', '.join(_WORDS.get(key, key) for key in values)} of {self.solids[self.chosen].name} changed")

    def keep(self, what: str) -> None:
        """Keep the thing as it is described now."""
        text = thing_text(self.name or "thing", self.solids)
        if text != self.text:
            self.text = text
            with show_errors():
                over = read_if_there(self.session.file(_FILE))
                self.session.keep_draft(_DRAFT, {"text": text, "over": over}, what)

    async def reread(self) -> None:
        """Show what is kept now: undo or another window may have changed it."""
        if (text := self._kept()) != self.text:
            self.text = text
            self._read()
            self.chosen = min(self.chosen, len(self.solids) - 1)
            self.form.refresh()

    def _kept(self) -> str:
        """Return the draft, unless the thing's file was changed elsewhere since; without both, a box."""
        draft, text = self.session.draft(_DRAFT), None
        with show_errors():
            text = read_if_there(self.session.file(_FILE))
        if isinstance(draft, dict) and isinstance(draft.get("text"), str) and draft.get("over") == text:
            return draft["text"]
        return thing_text("thing", [Solid("box")]) if text is None else text

    def _read(self) -> None:
        """Describe what the text holds; one that is more than solids in one piece is left alone."""
        with show_errors():
            self.name, self.solids = parse_thing(self.text, _FILE)

    async def write(self) -> None:
        """Write the thing into its file, and the file into the trial, where it can be used."""
        name, solids = self.name or "thing", list(self.solids)
        text = await work("reading the thing", lambda: check_thing(self.session.folder, _FILE, name, solids))
        if text is not None:
            with show_errors():
                self.session.edit(_FILE, text, "thing described")
                save_body(self.session, {"file": _FILE})

    def _form(self) -> None:
        """Lay out the solids, and what can be changed of the chosen one."""
        solid = self.solids[self.chosen]
        names = {number: each.name for number, each in enumerate(self.solids)}
        with ui.element("div").classes("row-line"):
            choice = ui.select(names, label="solid", value=self.chosen, on_change=lambda e: self._choose(e.value))
            choice.props("outlined dense options-dense").style("width: 130px")
            ui.button("Add", on_click=self._add).props("flat dense")
            ui.button("Remove", on_click=self._remove).props("flat dense")
        with ui.element("div").classes("row-line"):
            name = ui.input("its name", value=solid.name, on_change=lambda e: self.change(name=e.value or ""))
            name.props(f"outlined dense {_SOON}").style("width: 110px")
            shape = ui.select(self.shapes, label="shape", value=solid.shape, on_change=lambda e: self._shape(e.value))
            shape.props("outlined dense options-dense").style("width: 130px")
        is_mesh = solid.shape not in ("box", "ellipsoid")
        if is_mesh:
            value = _or_nothing(solid.scale)
            unit = ui.number(LABELS["scale"], value=value, on_change=lambda e: self._number("scale", e))
            unit.props(f"outlined dense {_SOON}").style("width: 110px")
        for key in _FIELDS if not is_mesh else ("centre_mm", "turn_deg"):
            ui.label(LABELS[key]).classes("small soft")
            with ui.element("div").classes("row-line"):
                for k, axis in enumerate("xyz"):
                    value = _or_nothing(getattr(solid, key)[k])
                    number = ui.number(axis, value=value, on_change=lambda e, key=key, k=k: self._number(key, e, k))
                    number.props(f'outlined dense {_SOON} aria-label="{LABELS[key]} {axis}"').style("width: 84px")
        with ui.element("div").classes("row-line"):
            if solid.colour is not None:
                shade = f"rgb({', '.join(map(str, solid.colour))})"
                ui.element("span").style(f"width: 28px; height: 28px; border-radius: 4px; background: {shade}")
                ui.label(f"colour {', '.join(map(str, solid.colour))}").classes("small")
            else:
                ui.label("colour: taken at the first pose").classes("small soft")

    def _number(self, key: str, event, k: int | None = None) -> None:
        value = math.nan if event.value is None else float(event.value)
        old = getattr(self.solids[self.chosen], key)
        self.change(**{key: value if k is None else (*old[:k], value, *old[k + 1 :])})

    def _shape(self, shape: str) -> None:
        self.change(shape=shape)
        self.form.refresh()

    def _choose(self, number: int) -> None:
        self.chosen = number
        self.form.refresh()

    def _add(self) -> None:
        self.solids.append(replace(self.solids[self.chosen], name=f"solid{len(self.solids) + 1}"))
        self.keep("solid added")
        self._choose(len(self.solids) - 1)

    def _remove(self) -> None:
        if len(self.solids) == 1:
            complain(AirborneError("a thing has at least one solid; change this one"))
            return
        del self.solids[self.chosen]
        self.keep("solid removed")
        self._choose(0)


def _or_nothing(value: float) -> float | None:
    """Return what a field shows of a number: nothing where it is missing."""
    return None if math.isnan(value) else value
