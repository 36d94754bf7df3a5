# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C: every command ends with exit code 130, also during a long call of compiled code.

Python runs a signal handler only between two of its own instructions. A call into compiled code can take seconds to
minutes. Therefore a thread, woken by the signal, waits for the handler to run; if it does not run within GRACE_S, or if
a second signal arrives before, the thread removes temporary files and ends the process.
"""

import os
import select
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130  # exit code after Ctrl-C (128 + SIGINT)
GRACE_S = 2.0  # a frame or a point of a run that ends in order takes less
POLL_S = 0.02
SHOW_CURSOR = b"\x1b[?25h"  # progress bars hide it

temporary_files: set[str] = set()  # to be removed when the process ends
_handled = threading.Event()  # of the current block; each has its own, so that none ends the process for another


def acknowledge() -> None:
    """Must be called by a handler of SIGINT that replaces the one of interruptible()."""
    _handled.set()


def _raise_interrupt(number: int, frame: FrameType | None) -> None:
    acknowledge()
    signal.default_int_handler(number, frame)


def remove_temporary_files() -> None:
    for name in list(temporary_files):
        try:
            os.unlink(name)
        except OSError:
            pass


def _leave() -> None:
    remove_temporary_files()
    if os.isatty(2):
        os.write(2, SHOW_CURSOR)
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


def _watch(reading: int, handled: threading.Event) -> None:
    """Ends the process if a SIGINT is not handled in time. The thread ends when the pipe is closed."""
    while numbers := os.read(reading, 64):
        if signal.SIGINT in numbers:
            deadline = time.monotonic() + GRACE_S
            while not handled.wait(POLL_S):
                late = time.monotonic() > deadline or select.select([reading], [], [], 0)[0]
                if late and not handled.is_set():  # set before the pipe is closed, which makes it readable
                    _leave()
            handled.clear()
    os.close(reading)


@contextmanager
def interruptible() -> Iterator[None]:
    """Watches for Ctrl-C during the block, unless the process ignores SIGINT or has its own handler for it."""
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    global _handled
    handled = _handled = threading.Event()
    threading.Thread(target=_watch, args=(reading, handled), daemon=True).start()
    before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    signal.signal(signal.SIGINT, _raise_interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.set_wakeup_fd(before)
        handled.set()
        os.close(writing)
