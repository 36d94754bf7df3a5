# SPDX-License-Identifier: Apache-2.0
"""Many independent jobs in this process, in several, or on a Dask cluster."""

import importlib
import logging
import signal
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")

AHEAD = 4  # jobs that wait for each worker: none is idle, and results do not pile up
CONNECT_S = 10  # to find a cluster
PATIENCE_S = 0.2  # between two looks at whether a run has become a long one


def ignore_interrupts() -> None:
    """Ctrl-C reaches every process of the terminal; the one that writes files decides what it means."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def processes(count: int) -> Iterator[tuple[Executor, int]]:
    # Spawned, not forked: a fork copies the locks of threads that it does not have.
    executor = ProcessPoolExecutor(count, get_context("spawn"), ignore_interrupts)
    try:
        yield executor, count
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


@contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """Raises: OSError when there is no scheduler or no worker; ValueError without Dask."""
    try:
        distributed = importlib.import_module("distributed")
    except ImportError as error:
        raise ValueError("a Dask cluster needs: pip install 'libocc[dask]'") from error
    with distributed.Client(address, timeout=CONNECT_S, set_as_default=False) as client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise OSError(f"{address}: the scheduler has no workers")
        executor = client.get_executor(pure=False)
        try:
            yield executor, threads
        finally:
            # Results that are on their way when a run is broken off are no errors to tell of.
            logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
            executor.shutdown(wait=False)


def _results(
    executor: Executor, count: int, function: Callable[[Job], Result], jobs: Sequence[Job],
    idle: Callable[[], None],
) -> Generator[tuple[Job, Result], None, None]:
    rest = iter(jobs)
    running: dict[Future[Result], Job] = {}
    try:
        while True:
            for job in rest:
                running[executor.submit(function, job)] = job
                if len(running) >= AHEAD * count:
                    break
            if not running:
                return
            done, _ = wait(running, PATIENCE_S, FIRST_COMPLETED)
            idle()
            for future in done:
                yield running.pop(future), future.result()
    finally:
        for future in running:
            future.cancel()


def run_jobs(
    function: Callable[[Job], Result], jobs: Sequence[Job], workers: int = 1,
    scheduler: str | None = None, idle: Callable[[], None] = lambda: None,
) -> Generator[tuple[Job, Result], None, None]:
    """Each job with its result, in the order in which they are done. `idle` is called while none is.

    function: of a module, so that other processes find it. What it raises is raised here.
    Raises: OSError when a process was ended from outside.
    """
    if scheduler is None and workers == 1:
        for job in jobs:
            yield job, function(job)
        return
    pool: Any = processes(min(workers, max(1, len(jobs)))) if scheduler is None else cluster(scheduler)
    try:
        with pool as (executor, count):
            yield from _results(executor, count, function, jobs, idle)
    except BrokenExecutor as error:
        raise OSError("a worker process was ended from outside; too little memory?") from error
