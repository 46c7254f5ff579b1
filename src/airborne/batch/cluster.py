"""Tasks on Dask's distributed scheduler: on this machine, or on any by the scheduler's address."""

from __future__ import annotations

import hashlib
import logging
import multiprocessing
import os
import sys
from asyncio import CancelledError
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from multiprocessing import forkserver
from typing import TYPE_CHECKING, Any

from airborne.batch.task import Report, Task, TaskOutcome, do_task
from airborne.errors import INSTALL_EXTRA, AirborneError, count
from airborne.io.environment import ONE_THREAD

if TYPE_CHECKING:
    from distributed import Client

_TOPIC = "airborne"  # of the events that tell of frames
_LEAST_BYTES = 500_000_000  # a worker takes 300 MB with everything loaded
_CONNECT_S = 10  # to reach a scheduler
_DASHBOARD = "127.0.0.1:0"  # for this machine alone, on any port
_FORKS = sys.platform == "linux"  # elsewhere a forked process may not use what its parent has loaded
# one task runs, none waits at a worker: the longest go first, and a dead worker costs what it ran; only many deaths are
# a task's own fault; a worker that is killed again while it starts is not given up
_SETTINGS = {
    "distributed.scheduler.allowed-failures": 10,
    "distributed.deploy.lost-worker-timeout": "30 days",
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.work-stealing": False,
    "distributed.admin.large-graph-warning-threshold": "1GB",
    # what would take 4 % of two cores: the dashboard has no profile
    "distributed.worker.profile.enabled": False,
    "distributed.worker.profile.interval": "1s",
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.worker.multiprocessing-method": "forkserver" if _FORKS else "spawn",
}


def import_for_workers() -> None:
    """Start the process that this machine's workers are forked from: it imports all, so that each is there at once and
    shares that memory. Returns before it has done so.
    """  # noqa: D205
    if not _FORKS:
        return
    multiprocessing.get_context("forkserver").set_forkserver_preload([do_task.__module__, "distributed.nanny"])
    known = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        forkserver.ensure_running()
    finally:
        for name, value in known.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def require_dask() -> None:
    """Raise AirborneError where Dask is not installed."""
    if find_spec("dask") is None or find_spec("distributed") is None:
        raise AirborneError(f"batches need Dask, {INSTALL_EXTRA.format('batch')}")


@contextmanager
def open_client(scheduler: str | None, n_workers: int, memory: str) -> Iterator[Client]:
    """Connect to a scheduler by its address, or start one with workers of one thread on this machine.

    `memory` is each worker's, as "4GB", or "auto": an equal share; a worker that needs more is started anew. Workers of
    another machine keep what they were started with, and `memory` is the least of it. Raises AirborneError where Dask
    is not installed, the scheduler cannot be reached, or there is not so much memory.
    """
    require_dask()
    from dask import config
    from distributed import Client, LocalCluster

    least_bytes = _parse_memory(memory, n_workers if scheduler is None else 0)
    for logger in ("distributed", "distributed.client"):  # what goes wrong is told once, by the row of its trial
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        stack.enter_context(config.set(_SETTINGS))
        if scheduler is None:
            import_for_workers()
            address: Any = stack.enter_context(
                LocalCluster(
                    n_workers=n_workers,
                    threads_per_worker=1,
                    memory_limit=memory,
                    dashboard_address=_DASHBOARD,
                    preload=do_task.__module__,  # so that no task waits for imports, or dies of them
                    silence_logs=logging.CRITICAL,
                )
            )
        else:
            address = scheduler
        try:
            client = stack.enter_context(Client(address, timeout=_CONNECT_S))
        except (OSError, ValueError, TimeoutError) as error:
            raise AirborneError(
                f"no scheduler answers at {scheduler} ({str(error).splitlines()[0][:120]}); "
                "start one with: dask scheduler"
            ) from None
        workers = client.scheduler_info(n_workers=-1)["workers"]
        wrong = [name for name, each in workers.items() if each["nthreads"] != 1]
        if wrong:
            raise AirborneError(
                f"{count(len(wrong), 'worker')} of {scheduler} run several threads ({wrong[0]}); "
                "start them with --nthreads 1"
            )
        small = [name for name, each in workers.items() if 0 < each["memory_limit"] < least_bytes]
        if scheduler is not None and small:
            raise AirborneError(
                f"{count(len(small), 'worker')} of {scheduler} may use less than {memory} ({small[0]}); "
                f"start them with --memory-limit {memory}"
            )
        yield client


def _parse_memory(memory: str, n_workers: int) -> int:
    """Return the memory of a worker [bytes], 0 for "auto"; raises AirborneError where this machine has less."""
    from dask.utils import format_bytes, parse_bytes
    from distributed.system import MEMORY_LIMIT

    if memory == "auto":
        return 0
    try:
        n_bytes = parse_bytes(memory)
    except ValueError:
        raise AirborneError(f"memory {memory[:40]}: expected a size such as 4GB") from None
    if n_bytes < _LEAST_BYTES:
        raise AirborneError(f"memory {memory}: a worker needs {format_bytes(_LEAST_BYTES)} at least")
    if n_bytes * n_workers > MEMORY_LIMIT:
        raise AirborneError(
            f"{count(n_workers, 'worker')} of {memory} are more than the {format_bytes(MEMORY_LIMIT)} of this machine; "
            f"give --workers {MEMORY_LIMIT // n_bytes or 1}, or less --memory"
        )
    return n_bytes


def count_workers(memory: str) -> int:
    """Return how many workers of so much memory this machine can have: one for each core, if there is room."""
    try:
        from dask.system import CPU_COUNT
        from distributed.system import MEMORY_LIMIT
    except ImportError:
        return 1  # nothing is started without Dask
    return max(1, min(CPU_COUNT, MEMORY_LIMIT // (_parse_memory(memory, 1) or 1)))


def do_tasks(
    client: Client,
    tasks: Sequence[Task],
    *,
    work: Callable[[Task, Report], TaskOutcome] = do_task,
    report: Report = lambda name, done, total: None,
) -> Iterator[TaskOutcome]:
    """Do tasks on a cluster, the first first, and yield each one's outcome when it ends.

    A task whose worker dies is done again by another, and so goes on where it stopped; after a few deaths it fails.
    Ends early where the scheduler is lost.
    """
    from distributed import as_completed

    client.subscribe_topic(_TOPIC, lambda event: report(*event[1]))
    batch = hashlib.sha256(str(tasks[0].batch).encode()).hexdigest()[:12]
    names = {f"airborne-{batch}-{task.trial.name}": task.trial.name for task in tasks}
    futures = [
        client.submit(_work_and_tell, work, task, key=key, priority=-rank, pure=False)
        for rank, (key, task) in enumerate(zip(names, tasks, strict=True))
    ]
    try:
        for future in as_completed(futures):
            if future.status == "finished":
                try:
                    yield future.result()
                except (CancelledError, OSError):  # the scheduler went between
                    return
            elif future.status == "error":
                yield TaskOutcome(names[str(future.key)], "failed", _describe_end(future.exception()))
            else:  # the scheduler is gone, and with it all the others
                return
            future.release()
    finally:
        client.unsubscribe_topic(_TOPIC)


def _work_and_tell(work: Callable[[Task, Report], TaskOutcome], task: Task) -> TaskOutcome:
    """Do a task on a worker, and tell the batch of its frames."""
    from distributed import get_worker

    worker = get_worker()
    return work(task, lambda *progress: worker.log_event(_TOPIC, progress))


def _describe_end(error: BaseException | None) -> str:
    """Say in one line why a task brought no outcome."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return (
            "worker after worker died with it, of too little memory or killed; give each more with --memory, "
            "or start fewer"
        )
    if isinstance(error, AirborneError):
        return str(error)
    return " ".join(f"unexpected {type(error).__name__}: {error}".split())[:400]
