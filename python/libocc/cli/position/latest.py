# SPDX-License-Identifier: Apache-2.0
"""The newest frame of a source that does not wait: who is slow misses frames, not time."""

import threading
import time
from collections import deque
from collections.abc import Iterator

from ...streams.frames import Source, StreamFrame


class Latest:
    """Reads a source in a thread of its own and keeps its newest frame alone.

    paced: a file is read at the pace of its times, as if it were live. `dropped` counts the frames
    that a newer one has replaced; those without an image are not dropped, as somebody has to say so.
    """

    def __init__(self, source: Source, stop: threading.Event, paced: bool = False):
        self._source, self._stop, self._paced = source, stop, paced
        self._news = threading.Condition()
        self._newest: StreamFrame | None = None
        self._problems: deque[StreamFrame] = deque(maxlen=1000)
        self._ended = False
        self._closed = threading.Event()
        self._error: Exception | None = None
        self._begun_s: float | None = None  # when time 0 was
        self.dropped = 0
        self._thread = threading.Thread(target=self._grab, name="grabber", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[StreamFrame]:
        """Raises: what the source raised."""
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
        except Exception as error:  # for whoever takes the frames
            self._error = error
        with self._news:
            self._ended = True
            self._news.notify()

    def _early_s(self, time_s: float) -> float:
        """How long to wait for a frame's time to come; where its clock jumps, the pace begins anew."""
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
        """Whether the source is not read any more; a camera may hang."""
        self._closed.set()
        self._thread.join(timeout=2)
        return not self._thread.is_alive()
