# SPDX-License-Identifier: Apache-2.0
"""How far a long run is."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

QUIET_S = 1.0  # a run shorter than this shows nothing


@contextmanager
def progress(total: int, doing: str) -> Iterator[Callable[[], None]]:
    """A bar on stderr, from the moment a run turns out to be long; call what it gives at each step."""
    from rich.console import Console
    from rich.progress import Progress

    begun = time.monotonic()
    bar = Progress(console=Console(stderr=True), transient=True)
    task = bar.add_task(doing, total=total)

    def advance() -> None:
        bar.advance(task)
        if not bar.live.is_started and time.monotonic() - begun > QUIET_S:
            bar.start()

    try:
        yield advance
    finally:
        if bar.live.is_started:
            bar.stop()
