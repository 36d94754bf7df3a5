# SPDX-License-Identifier: Apache-2.0
"""Newest frame of a live source: slow processing drops frames instead of falling behind."""

import threading
import time
from collections import deque
from collections.abc import Iterator

from ...streams.frames import Source, StreamFrame


class Latest:
    """Reads a source in a separate thread and keeps only its newest frame.

    paced: a file is read in real time according to its time stamps. `dropped` is the number of frames replaced by
    newer ones; frames without an image are not dropped, because they must be reported.
    """

    def __init__(self, source: Source, stop: threading.Event, paced: bool = False):
        self._source, self._stop, self._paced = source, stop, paced
        self._news = threading.Condition()
        self._newest: StreamFrame | None = None
        self._problems: deque[StreamFrame] = deque(maxlen=1000)
        self._ended = False
        self._closed = threading.Event()
        self._error: Exception | None = None
        self._begun_s: float | None = None  # monotonic time at which the frames' time is 0
        self.dropped = 0
        self._thread = threading.Thread(target=self._grab, name="grabber", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[StreamFrame]:
        """Yields the newest frames. Raises: the exceptions of the source."""
        while not self._stop.is_set():
            with self._news:
                self._news.wait_for(self._any, timeout=0.1)
                if self._problems:
                    frame: StreamFrame | None = self._problems.popleft()
                else:
                    frame, self._newest = self._newest, None
                ended, error = self._ended, self._error
            if frame is not None:
                yield frame
            elif ended:
                if error is not None:
                    raise error
                return

    def _any(self) -> bool:
        return self._newest is not None or bool(self._problems) or self._ended

    def _grab(self) -> None:
        try:
            for frame in self._source:
                if self._paced and frame.time_s is not None:
                    self._stop.wait(self._early_s(frame.time_s))
                if self._stop.is_set() or self._closed.is_set():
                    break
                self._put(frame)
        except Exception as error:  # raised in __iter__, in the thread of the reader
            self._error = error
        with self._news:
            self._ended = True
            self._news.notify()

    def _early_s(self, time_s: float) -> float:
        """Time until a frame is due; after a clock jump of more than 1 s the pace restarts."""
        now_s = time.monotonic()
        if self._begun_s is None or not -1 <= now_s - time_s - self._begun_s <= 1:
            self._begun_s = now_s - time_s
        return max(0.0, self._begun_s + time_s - now_s)

    def _put(self, frame: StreamFrame) -> None:
        with self._news:
            if frame.image is None:
                self._problems.append(frame)
            else:
                self.dropped += self._newest is not None
                self._newest = frame
            self._news.notify()

    def close(self) -> bool:
        """Ends the thread; returns False if it does not end within 2 s, as when a camera hangs."""
        self._closed.set()
        self._thread.join(timeout=2)
        return not self._thread.is_alive()
