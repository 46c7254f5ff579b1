"""A sample spread evenly over a sequence whose length is not known, such as the frames of a run while it is tracked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

T = TypeVar("T")


class EvenSample(Generic[T]):
    """Every n-th item of a sequence; when there are too many, every second one is let go, and n doubles."""

    def __init__(self, most: int) -> None:
        """Begin empty; at most `most` items are kept."""
        self._most, self._stride, self._n = most, 1, 0
        self._kept: list[tuple[int, T]] = []

    def offer(self, make: Callable[[], T]) -> None:
        """Offer the next item, which is made only if it is kept."""
        if self._n % self._stride == 0:
            self._kept.append((self._n, make()))
        self._n += 1
        if len(self._kept) > self._most:
            self._stride *= 2
            self._kept = [each for each in self._kept if each[0] % self._stride == 0]

    def __len__(self) -> int:
        return len(self._kept)

    def __iter__(self) -> Iterator[T]:
        return (item for _, item in self._kept)
