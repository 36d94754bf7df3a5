# SPDX-License-Identifier: Apache-2.0
"""A bar for what takes long."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

QUIET_S = 1.0  # a run shorter than this shows no progress


class Advance(Protocol):
    """Tells the bar of steps that are done; 0: of none, only that time has passed."""

    def __call__(self, steps: int = 1) -> None: ...


@contextmanager
def progress(what: str, total: int) -> Iterator[Advance]:
    """A bar on stderr, from the moment a run turns out to be long."""
    from rich.console import Console
    from rich.progress import Progress

    begun = time.monotonic()
    bar = Progress(console=Console(stderr=True), transient=True)
    task = bar.add_task(what, total=total)

    def advance(steps: int = 1) -> None:
        bar.advance(task, steps)
        if not bar.live.is_started and time.monotonic() - begun > QUIET_S:
            bar.start()

    try:
        yield advance
    finally:
        if bar.live.is_started:
            bar.stop()
