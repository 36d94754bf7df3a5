# SPDX-License-Identifier: Apache-2.0
"""Order of the frames in a stream: detects clock jumps and missing, repeated or late frames."""

import statistics
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...streams.frames import Pixels, StreamFrame

INTERVALS = 31  # number of intervals whose median is the frame interval
MISSING = 1.6  # frame intervals; a longer gap means that a frame is missing


@dataclass(frozen=True)
class Verdict:
    """usable: the frame can be processed. restart: the clock jumped, so that earlier frames must be forgotten."""

    usable: bool
    reason: str = ""  # why the frame is not usable
    warning: str = ""
    restart: bool = False


class FrameOrder:
    """Checks frames in the order of arrival.

    A frame with the time or the pixels of its predecessor is repeated: a filter would use the same observation twice.
    A frame earlier than its predecessor is late and is skipped. If the next frame follows that late frame, the clock
    was set back, and the processing restarts.
    """

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._late_s: float | None = None
        self._image: Pixels | None = None
        self._intervals_s: deque[float] = deque(maxlen=INTERVALS)

    def check(self, frame: StreamFrame, dropped: int = 0) -> Verdict:
        """Checks the next frame. dropped: number of frames that were dropped on purpose since the last one."""
        time_s = frame.time_s
        if frame.image is None or time_s is None or not np.isfinite(time_s):
            return Verdict(False, frame.problem or f"its time is {time_s}")
        if self._last_s is None:
            return self._accept(frame, time_s)
        step_s = time_s - self._last_s
        if step_s == 0:
            return Verdict(False, "repeated: its time equals that of the previous frame")
        if step_s < 0:
            return self._back(frame, time_s, -step_s)
        if self._same_pixels(frame.image):
            self._last_s = time_s
            return Verdict(False, "repeated: its pixels equal those of the previous frame")
        warning = self._gap(step_s, dropped)
        if not warning and not dropped:
            self._intervals_s.append(step_s)
        return self._accept(frame, time_s, warning)

    def _accept(self, frame: StreamFrame, time_s: float, warning: str = "", restart: bool = False) -> Verdict:
        self._last_s, self._late_s, self._image = time_s, None, frame.image
        return Verdict(True, warning=warning, restart=restart)

    def _back(self, frame: StreamFrame, time_s: float, by_s: float) -> Verdict:
        if self._late_s is not None and time_s > self._late_s:
            self._intervals_s.clear()
            return self._accept(frame, time_s, f"the clock was set back by {by_s:.3f} s", restart=True)
        self._late_s = time_s
        return Verdict(False, f"late: {by_s:.3f} s earlier than the previous frame")

    def _same_pixels(self, image: Pixels) -> bool:
        """True if the pixels equal those of the previous frame; uniform (dark) frames are never repeated."""
        before = self._image
        if before is None or before.shape != image.shape or before.dtype != image.dtype:
            return False
        return bool(np.array_equal(before, image) and image.min() != image.max())

    def _gap(self, step_s: float, dropped: int) -> str:
        if len(self._intervals_s) < 2:
            return ""
        usual_s = statistics.median(self._intervals_s)
        missing = round(step_s / usual_s) - 1 - dropped
        if step_s < MISSING * usual_s or missing < 1:
            return ""
        return f"{missing} frame{'s' * (missing > 1)} missing before it: {step_s:.3f} s after the previous frame"
