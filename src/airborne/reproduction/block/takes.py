"""Sequences in parallel processes: each is written as soon as it is finished; a run resumes with the missing ones."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait as until_ready
from pathlib import Path
from threading import Thread
from typing import Any

import cv2

from airborne.reproduction.block.measures import write_take
from airborne.reproduction.block.plan import BlockTake
from airborne.reproduction.block.tracking import track_scene
from airborne.types import Progress

_POLL_S = 0.2  # polling interval of the processes


class _Stopped(Exception):
    """The program is to stop."""


def n_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def do_takes(
    folder: Path, takes: Sequence[BlockTake], *, n_processes: int = 1, progress: Progress | None = None
) -> list[Path]:
    """Track the sequences that have no file in the folder yet; return the files of all, in the order of the takes.

    The results do not depend on the number of processes. Progress counts frames, finished files included.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{take.number:02d}.json" for take in takes]
    total = sum(take.n_frames for take in takes)
    missing = [(path, take) for path, take in zip(paths, takes, strict=True) if not path.is_file()]
    done = _Counter(total - sum(take.n_frames for _, take in missing), total, progress)
    if n_processes <= 1 or len(missing) <= 1:
        for path, take in missing:
            _do_take(path, take, done)
    else:
        _in_processes(missing, min(n_processes, len(missing)), done)
    return paths


class _Counter:
    """Counts frames."""

    def __init__(self, done: int, total: int, progress: Progress | None) -> None:
        self._done, self._total, self._progress = done, total, progress

    def __call__(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._total)


def _do_take(path: Path, take: BlockTake, progress: Callable[[], None]) -> None:
    scene = take.scene()
    write_take(path, take, scene, track_scene(scene, take.runs, progress))


def _in_processes(missing: Sequence[tuple[Path, BlockTake]], n: int, done: _Counter) -> None:
    context = get_context("spawn")
    frames, stop = context.Value("q", 0), context.Event()
    with ProcessPoolExecutor(n, context, _init_worker, (frames, stop)) as pool:
        futures = [pool.submit(_do_take_in_worker, path, take) for path, take in missing]
        try:
            _report_frames(futures, frames, done)
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)


def _report_frames(futures: Sequence[Future[None]], frames: Any, done: _Counter) -> None:
    """Report frames until all is finished; an exception in a process is raised here at once."""
    left, n_reported = set(futures), 0
    while left:
        finished, left = wait(left, timeout=_POLL_S)
        while n_reported < frames.value:
            n_reported += 1
            done()
        for future in finished:
            future.result()


class _Shared:
    """What a worker process shares with its parent; only `_init_worker` sets it."""

    frames: Any  # how many are done, by all processes
    stop: Any  # an event


def _init_worker(frames: Any, stop: Any) -> None:
    """Make a worker ignore Ctrl-C, which the parent handles, end with its parent, and use one core."""
    _Shared.frames, _Shared.stop = frames, stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
    parent = parent_process()
    assert parent is not None, "a worker process has a parent"
    Thread(target=lambda: (until_ready([parent.sentinel]), os._exit(1)), daemon=True).start()


def _do_take_in_worker(path: Path, take: BlockTake) -> None:
    def count_frame() -> None:
        with _Shared.frames.get_lock():
            _Shared.frames.value += 1
        if _Shared.stop.is_set():
            raise _Stopped

    try:
        _do_take(path, take, count_frame)
    except _Stopped:
        return
