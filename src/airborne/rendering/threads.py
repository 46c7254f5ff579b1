"""Work shared between threads; the kernels let go of Python's lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise


def in_threads(fill: Callable[[slice], None], n: int, threads: int) -> None:
    """Call `fill` with slices that together cover 0 to n - 1 once, in so many threads."""
    if threads <= 1 or n <= 1:
        fill(slice(0, n))
        return
    edges = [n * k // threads for k in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(fill, [slice(a, b) for a, b in pairwise(edges)]))
