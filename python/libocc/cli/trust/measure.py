# SPDX-License-Identifier: Apache-2.0
"""Solves the problems of all families in several threads."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from .families import Family
from .judge import Record, solved

POLL_S = 0.1  # interval between two updates of the progress bar


@dataclass
class Run:
    """Records by family, in the order of the problems."""

    records: dict[str, list[Record]] = field(default_factory=dict)
    interrupted: bool = False

    @property
    def count(self) -> int:
        return sum(map(len, self.records.values()))


def run(
    families: Sequence[Family], count: int, seed: int, threads: int, advance: Callable[[int], None]
) -> Run:
    """Solves `count` problems of each family. Ctrl-C ends the run; solved problems are kept.

    The families take turns, so an interrupted run has about the same number of problems of each.
    """
    jobs = iter([(number, family) for number in range(count) for family in families])
    lock, stop = threading.Lock(), threading.Event()
    done: list[tuple[str, int, Record]] = []
    errors: list[Exception] = []

    def work() -> None:
        while not stop.is_set():
            with lock:
                job = next(jobs, None)
            if job is None:
                return
            number, family = job
            try:
                done.append((family.name, number, solved(family.problem(seed, number))))
            except Exception as error:
                errors.append(error)
                stop.set()

    workers = [threading.Thread(target=work, daemon=True) for _ in range(threads)]
    result = Run()
    shown = 0
    try:
        for worker in workers:
            worker.start()
        for worker in workers:
            while worker.is_alive():
                worker.join(POLL_S)
                advance(len(done) - shown)
                shown = len(done)
    except KeyboardInterrupt:
        result.interrupted = True
    finally:
        stop.set()
    for worker in workers:
        worker.join()
    if errors:
        raise errors[0]
    for family in families:
        found = sorted((number, i) for i, (name, number, _) in enumerate(done) if name == family.name)
        result.records[family.name] = [done[i][2] for _, i in found]
    return result
