"""The canvas that shows all cameras at one frame with what lies over them; see `view.js`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypedDict

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from airborne.studio.pictures import ShownTrial


class Mark(TypedDict, total=False):
    """A point that can be grabbed."""

    id: str
    pane: int  # number of the camera
    u: float  # [px] of the video
    v: float
    label: str
    colour: str
    to: list[float]  # where the cameras see it [px]; the difference is drawn ten times as long


class Item(TypedDict, total=False):
    """A line or a field in one camera's picture."""

    pane: int
    points: list[list[float]]  # [px] of the video
    colour: str
    width: float  # [px] on the screen
    closed: bool
    fill: str
    text: str  # at the first point


class View(Element, component="view.js", default_classes="view"):
    """All cameras of a trial, at one frame."""

    def __init__(
        self,
        shown: ShownTrial,
        *,
        frame: int,
        overlay: str = "",
        on_frame: Callable[[int], Any] | None = None,
        on_pick: Callable[[int, float, float, str | None], Any] | None = None,
        on_move: Callable[[str, float, float], Any] | None = None,
        on_select: Callable[[str | None], Any] | None = None,
    ) -> None:
        """Show a trial's videos; `overlay` is the address of what lies over each frame, with {frame} in it.

        `on_pick` gets camera number, pixel, and the mark close by if there is one; `on_move` and `on_select` a mark.
        """
        super().__init__()
        self._props["panes"] = [
            {"name": name, "width": size[0], "height": size[1], "url": f"/image/{k}/{{frame}}?{hash(shown.sources)}"}
            for k, (name, size) in enumerate(shown.sizes.items())
        ]
        self._props["n_frames"] = len(shown.clock)
        self._props["frame"] = min(frame, len(shown.clock) - 1)
        self._props["overlay"] = overlay
        self._props["label"] = f"pictures of {', '.join(shown.names)}"
        self._props["picking"] = False
        self.show_over((), ())
        self._listen("frame", on_frame, lambda args: (int(args["frame"]),))
        self._listen(
            "pick", on_pick, lambda args: (int(args["pane"]), float(args["u"]), float(args["v"]), args["near"])
        )
        self._listen("move", on_move, lambda args: (str(args["id"]), float(args["u"]), float(args["v"])))
        self._listen("select", on_select, lambda args: (args["id"],))

    def _listen(self, name: str, handler: Callable[..., Any] | None, read: Callable[[dict], tuple]) -> None:
        if handler is None:
            return

        def handle(event: GenericEventArguments) -> Any:
            return handler(*read(event.args))

        self.on(name, handle, throttle=0.1 if name == "frame" else 0.0)

    def show_over(self, marks: Sequence[Mark], items: Sequence[Any], selected: str | None = None) -> None:
        """Show marks to grab and lines over the pictures."""
        self._props["marks"], self._props["items"] = list(marks), list(items)
        self._props["selected"] = selected or ""
        self.update()

    def start_picking(self) -> None:
        """Let clicks pick points."""
        self._props["picking"] = True
        self.classes("picking")

    def set_overlay(self, overlay: str) -> None:
        """Show what lies at another address over each frame."""
        self._props["overlay"] = overlay
        self.update()

    def go(self, frame: int) -> None:
        """Show a frame, in every part of the page."""
        self.run_method("show", frame)


class Curves(Element, component="curves.js", default_classes="curves"):
    """Curves of a run over its frames; its cursor and the views' are one."""

    def __init__(self, url: str, *, frame: int) -> None:
        """Show what an address gives, with the cursor at a frame."""
        super().__init__()
        self._props["url"], self._props["start"] = url, frame
