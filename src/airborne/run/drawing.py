"""Drawing beside tracking: in a thread of its own, in the order of the frames, and only a few of them behind."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Any, Self

_MOST_WAITING = 4  # times: enough to hide the time that one takes, few enough to stay small


class DrawingThread:
    """Calls `draw` for one time after the other in a thread of its own; use it in a `with` block.

    The block's end waits until all is drawn. An error of the drawing is raised at a later time, or there.
    """

    def __init__(self, draw: Callable[..., None]) -> None:
        """Begin with nothing to draw."""
        self._draw, self._thread = draw, ThreadPoolExecutor(1, thread_name_prefix="drawing")
        self._waiting: deque[Future[None]] = deque()

    def put(self, *what: Any) -> None:
        """Let `draw(*what)` be called; where too many wait, wait for the first of them."""
        while self._waiting and (self._waiting[0].done() or len(self._waiting) >= _MOST_WAITING):
            self._waiting.popleft().result()
        self._waiting.append(self._thread.submit(self._draw, *what))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for the rest; raise what drawing raised, unless there is an error already."""
        self._thread.shutdown()
        if kind is None:
            for each in self._waiting:
                each.result()
