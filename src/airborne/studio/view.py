"""The canvas that shows all cameras at one frame with what lies over them; see `view.js`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from inspect import isawaitable
from typing import Any, TypedDict

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from airborne.studio.pictures import ShownTrial

_PATIENCE_S = 5.0  # with a browser that is busy


class Mark(TypedDict, total=False):
    """A point that can be grabbed."""

    id: str
    pane: int  # number of the camera
    u: float  # [px] of the video
    v: float
    label: str
    colour: str
    to: list[float]  # where the cameras see it [px]; the difference is drawn ten times as long
    holds: bool  # whether the body follows where it is dragged


class Item(TypedDict, total=False):
    """A line or a field in one camera's picture."""

    pane: int
    points: list[list[float]]  # [px] of the video
    colour: str
    width: float  # [px] on the screen
    closed: bool
    fill: str
    text: str  # at the first point
    grab: bool  # a drag that begins in it holds the body


@dataclass(frozen=True, slots=True)
class Drag:
    """A movement of the pointer that holds the body, or a mark."""

    number: int  # of the drag, which has many movements
    frame: int  # in whose pictures it is made
    pane: int  # number of the camera
    start: tuple[float, float]  # where the body was taken [px]
    px: tuple[float, float]  # where the pointer has it now
    mark: str | None
    turns: bool  # Shift is down
    has_ended: bool


class CameraViews(Element, component="view.js", default_classes="view"):
    """All cameras of a trial, at one frame."""

    def __init__(
        self,
        shown: ShownTrial,
        *,
        frame: int,
        camera: int | None = None,
        overlay: str = "",
        on_frame: Callable[[int], Any] | None = None,
        on_pick: Callable[[int, float, float, str | None], Any] | None = None,
        on_move: Callable[[str, float, float], Any] | None = None,
        on_select: Callable[[str | None], Any] | None = None,
        on_drag: Callable[[Drag], Any] | None = None,
    ) -> None:
        """Show a trial's videos, or one `camera` alone, picture by picture as its file has them.

        `overlay` is the address of what lies over each frame, with {frame} in it.
        `on_pick` gets camera number, pixel, and the mark close by if there is one; `on_move` and `on_select` a mark.
        `on_drag` gets the movements of what can be grabbed, and answers each with `follow`.
        What is done in a picture is done to the frame that it shows: `on_frame` is called with that frame first.
        """
        super().__init__()
        kind = "image" if camera is None else "picture"
        self._props["panes"] = [
            {"name": name, "width": size[0], "height": size[1], "url": f"/{kind}/{k}/{{frame}}?{hash(shown.sources)}"}
            for k, (name, size) in enumerate(shown.sizes.items())
            if camera in (None, k)
        ]
        n_frames = len(shown.clock) if camera is None else len(shown.indexes[camera])
        self._props["n_frames"] = n_frames
        self._props["frame"] = min(frame, n_frames - 1)
        self._props["apart"] = camera is not None
        self._props["overlay"] = overlay
        self._props["label"] = f"pictures of {', '.join(shown.names)}"
        self._props["picking"] = False
        self.show_over((), ())
        self._frame, self._turn_to = min(frame, n_frames - 1), on_frame
        self._listen("frame", on_frame, lambda args: (int(args["frame"]),))
        self._listen(
            "pick", on_pick, lambda args: (int(args["pane"]), float(args["u"]), float(args["v"]), args["near"])
        )
        self._listen("move", on_move, lambda args: (str(args["id"]), float(args["u"]), float(args["v"])))
        self._listen("select", on_select, lambda args: (args["id"],))
        self._props["follows"] = on_drag is not None
        self._listen("drag", on_drag, lambda args: (_read_drag(args),))
        FrameBar(self, n_frames, min(frame, n_frames - 1))

    @property
    def frame(self) -> int:
        """The frame in view here; another window's is its own."""
        return self._frame

    async def latest_frame(self) -> int:
        """Return the frame that was asked for last here, whose pictures may be on their way."""
        with suppress(TimeoutError):
            return int(await self.run_method("wantedFrame", timeout=_PATIENCE_S) or 0)
        return self._frame

    def _listen(self, name: str, handler: Callable[..., Any] | None, read: Callable[[dict], tuple]) -> None:
        if handler is None:
            return

        async def handle(event: GenericEventArguments) -> None:
            before, self._frame = self._frame, int(event.args["frame"])
            if name != "frame" and self._frame != before and self._turn_to is not None:  # its note is on the way
                await _finish(self._turn_to(self._frame))
            await _finish(handler(*read(event.args)))

        self.on(name, handle, throttle=0.1 if name == "frame" else 0.0)

    def show_over(self, marks: Sequence[Mark], items: Sequence[Any], selected: str | None = None) -> None:
        """Show marks to grab and lines over the pictures."""
        self._props["marks"], self._props["items"] = list(marks), list(items)
        self._props["selected"] = selected or ""
        self.update()

    def follow(self, drag: Drag, marks: Sequence[Mark] | None, items: Sequence[Any] | None) -> None:
        """Answer a movement: show this until the page's own marks and lines change; None leaves them as they are."""
        self.run_method("follow", drag.number, marks, items)

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

    def lead(self, frame: int, *, anew: bool) -> None:
        """Show a frame as the next of a row that `anew` begins; not while the user looks at another."""
        self.run_method("lead", frame, anew)


async def _finish(result: Any) -> None:
    if isawaitable(result):
        await result


def _read_drag(args: dict) -> Drag:
    (x, y), mark = args["from"], args["id"]
    return Drag(
        number=int(args["n"]),
        frame=int(args["frame"]),
        pane=int(args["pane"]),
        start=(float(x), float(y)),
        px=(float(args["u"]), float(args["v"])),
        mark=None if mark is None else str(mark),
        turns=bool(args["turn"]),
        has_ended=bool(args["ended"]),
    )


class FrameBar(Element, component="frames.js"):
    """The bar below a view, by which its frames are played and chosen."""

    def __init__(self, view: CameraViews, n_frames: int, frame: int) -> None:
        """Begin at a frame."""
        super().__init__()
        self._props |= {"view": view.id, "n_frames": n_frames, "start": frame}


class Curves(Element, component="curves.js", default_classes="curves"):
    """Curves of a run over its frames; its cursor and the views' are one."""

    def __init__(self, url: str, *, frame: int) -> None:
        """Show what an address gives, with the cursor at a frame."""
        super().__init__()
        self._props["url"], self._props["start"] = url, frame

    def show(self, url: str) -> None:
        """Show what another address gives."""
        self._props["url"] = url
        self.update()
