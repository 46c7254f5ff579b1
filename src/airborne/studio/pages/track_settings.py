"""How the next run is tracked: the method, the first and the last frame, as the trial's [track] has them."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from airborne.errors import TrialError
from airborne.studio.pages.slow_work import show_errors
from airborne.studio.runs import count_frames
from airborne.studio.session import Session
from airborne.trial.settings import BODY_METHODS, PLAYERS_METHODS


class TrackSettingsBar:
    """One window's choices; they are written into the trial as they are made."""

    def __init__(self, session: Session, n_images: int) -> None:
        """Take what the trial has; its videos have this many frames. Raises TrialError for an unfinished one."""
        self._session, self._n_images = session, n_images
        self._trial = session.project().trial()

    @property
    def n_frames(self) -> int:
        """How many frames are tracked."""
        return count_frames(self._trial, self._n_images)

    def build(self) -> None:
        """Lay out the choices."""
        methods = PLAYERS_METHODS if self._trial.has_players else BODY_METHODS
        self._method = ui.select(list(methods), label="method", value=None, on_change=self._set_method)
        self._method.props("outlined dense options-dense").style("min-width: 140px")
        self._first = self._frame_field("first frame", self._set_first)
        self._first.set_visibility(not self._trial.has_players)
        self._last = self._frame_field("last frame", self._set_last)
        self._start = ui.label().classes("small soft")
        self._show()

    def _frame_field(self, label: str, on_text: Callable[[str], None]) -> ui.number:
        field = ui.number(label, min=0, max=self._n_images - 1, precision=0)
        field.props("outlined dense clearable").style("width: 120px")
        # the text is sent along: the field may have been set anew since it was typed
        field.on("change", lambda event: on_text(str(event.args)))
        field.on("clear", lambda: on_text(""), args=[])
        return field

    def set_enabled(self, is_enabled: bool) -> None:
        """Let nobody change them while a run goes on, whose own they are not."""
        for field in (self._method, self._first, self._last):
            field.set_enabled(is_enabled)

    def reread(self) -> None:
        """Show what the trial has now; where that has not changed, what is being typed stays."""
        with show_errors():
            before, self._trial = self._trial, self._session.project().trial()
            if (self._trial.track, self._trial.start) != (before.track, before.start):
                self._show()

    def _show(self) -> None:
        track, frame = self._trial.track, self._trial.start.frame
        self._method.set_value(track.method)
        self._last.set_value(min(self._n_images, track.stop or self._n_images) - 1)
        self._first.set_value(self._trial.first_frame)
        who = "the players are" if self._trial.has_players else "the body is"
        whose = f"where {who} looked for first" if self._trial.start.find else "the first pose's"
        self._start.set_text(
            f"from frame {frame}, {whose}" + (", on and back" if self._trial.first_frame < frame else "")
        )

    def _set_method(self) -> None:
        if self._method.value != self._trial.track.method:
            self._set("method", self._method.value, f"method {self._method.value}")

    def _set_first(self, text: str) -> None:
        frame = self._trial.start.frame
        with show_errors():
            first = _whole(text) if text else frame
            if first > frame:
                raise TrialError(f"the first pose is that of frame {frame}; give a first frame up to there")
            if first != self._trial.first_frame:
                self._set("start", first if first < frame else None, f"first frame {first}")
        self._show()

    def _set_last(self, text: str) -> None:
        frame = self._trial.start.frame
        with show_errors():
            last = _whole(text) if text else self._n_images - 1
            if last < frame:
                raise TrialError(f"the first pose is that of frame {frame}; give a last frame from there on")
            if last >= self._n_images:
                raise TrialError(f"the last frame of all videos is {self._n_images - 1}; {last} lies after it")
            stop = last + 1 if last + 1 < self._n_images else None
            if stop != self._trial.track.stop:
                self._set("stop", stop, f"last frame {last}")
        self._show()

    def _set(self, key: str, value: object, what: str) -> None:
        with show_errors():
            self._session.set_table("track", {key: value}, what)
        self.reread()


def _whole(text: str) -> int:
    """Return the number of a frame that was typed. Raises TrialError for a fraction."""
    number = float(text)
    if number != int(number):
        raise TrialError(f"{number:g} is no frame; give a whole number")
    return int(number)
