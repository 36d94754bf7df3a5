# SPDX-License-Identifier: Apache-2.0
"""Runs independent jobs in this process, in several processes, or on a Dask cluster."""

import importlib
import logging
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait as wait_for_any
from typing import Any, TypeVar

from .interrupts import remove_temporary_files

Job = TypeVar("Job")
Result = TypeVar("Result")

AHEAD = 4  # queued jobs per worker: keeps workers busy and limits the results held in memory
CONNECT_S = 10  # timeout of the connection to a cluster
POLL_S = 0.2  # interval between calls of `idle`


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is None:
        return
    wait_for_any([parent.sentinel])
    remove_temporary_files()
    os._exit(1)


def start_worker() -> None:
    """Ignores Ctrl-C, which reaches every process of the terminal; only the process that writes files handles it.

    A worker waits for jobs forever, also when its parent was killed; a thread then ends it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


@contextmanager
def processes(count: int) -> Iterator[tuple[Executor, int]]:
    # Processes are spawned: a forked process would inherit locked mutexes of threads that it does not have.
    executor = ProcessPoolExecutor(count, get_context("spawn"), start_worker)
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
            # Cancelled results must not be logged as errors when a run is interrupted.
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
            done, _ = wait(running, POLL_S, FIRST_COMPLETED)
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
    """Yields each job with its result, in the order of completion. `idle` is called while waiting.

    function: defined at module level, so that other processes can import it; its exceptions are raised here.
    Raises: OSError when a worker process was killed.
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
        raise OSError("a worker process was killed; possible cause: too little memory") from error
