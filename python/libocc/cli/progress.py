# SPDX-License-Identifier: Apache-2.0
"""Progress bar of long runs."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

QUIET_S = 1.0  # a shorter run shows no progress bar


class Advance(Protocol):
    """Advances the bar by a number of steps; 0 only checks whether the bar must appear."""

    def __call__(self, steps: int = 1) -> None: ...


@contextmanager
def progress(what: str, total: int) -> Iterator[Advance]:
    """Shows a progress bar on stderr once the run takes longer than QUIET_S."""
    from rich.console import Console
    from rich.progress import Progress

    begun = time.monotonic()
    bar = Progress(console=Console(stderr=True), transient=True)
    task = bar.add_task(what, total=total)
    lock = threading.Lock()
    ended = False

    def show() -> None:
        with lock:
            if not ended and not bar.live.is_started:
                bar.start()

    def advance(steps: int = 1) -> None:
        bar.advance(task, steps)
        if time.monotonic() - begun > QUIET_S:
            show()

    timer = threading.Timer(QUIET_S, show)  # shows the bar during a first step that takes long
    timer.daemon = True
    timer.start()
    try:
        yield advance
    finally:
        timer.cancel()
        with lock:
            ended = True
            if bar.live.is_started:
                bar.stop()
