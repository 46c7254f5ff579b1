"""Prefetching: items prepared ahead of their use, in a thread of their own."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

_T = TypeVar("_T")

_N_AHEAD = 4  # items ready: enough to hide the time of one, few enough to stay small


def read_ahead(items: Generator[_T]) -> Generator[_T]:
    """Yield the items unchanged and in order, while a thread prepares the next few.

    An error is raised where its item would have come. Closing this generator ends the thread and closes `items`.
    """
    end = object()
    thread = ThreadPoolExecutor(1)
    try:
        waiting = deque(thread.submit(next, items, end) for _ in range(_N_AHEAD))
        while (item := waiting.popleft().result()) is not end:
            waiting.append(thread.submit(next, items, end))
            yield item  # pyright: ignore[reportReturnType]
    finally:
        thread.shutdown(cancel_futures=True)
        items.close()
