# SPDX-License-Identifier: Apache-2.0
"""Status line of a survey that takes longer than a moment."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..progress import QUIET_S


@contextmanager
def survey_status() -> Iterator[Callable[[str, int, int], bool]]:
    """Yields the callback of survey(), which shows the stage on stderr after QUIET_S."""
    from rich.console import Console
    from rich.status import Status

    begun = time.monotonic()
    status = Status("", console=Console(stderr=True))
    shown = False

    def show(stage: str, done: int, total: int) -> bool:
        nonlocal shown
        status.update(f"{stage}: {done} of {total}" if total else f"{stage}: iteration {done}")
        if not shown and time.monotonic() - begun > QUIET_S:
            status.start()
            shown = True
        return True

    try:
        yield show
    finally:
        status.stop()
