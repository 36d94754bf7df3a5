# SPDX-License-Identifier: Apache-2.0
"""Whether a frame follows the one before: clocks jump, frames are missing, repeated or late."""

import statistics
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...streams.frames import Pixels, StreamFrame

KEPT = 31  # intervals whose median is the frames' own
MISSING = 1.6  # intervals from which on a frame is missing


@dataclass(frozen=True)
class Verdict:
    """usable: to be looked at. anew: the clock jumped, so that nothing before it counts."""

    usable: bool
    reason: str = ""  # why it is not
    warning: str = ""
    anew: bool = False


class FrameOrder:
    """Looks at frames in the order in which they come.

    A frame of the same time or the same pixels as the one before is a repeated one: to a filter it
    would say twice what was seen once. A frame before the last one is late and is left out; when the
    next one goes on from there, the clock has been set back, and what follows begins anew.
    """

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._late_s: float | None = None
        self._image: Pixels | None = None
        self._intervals_s: deque[float] = deque(maxlen=KEPT)

    def look(self, frame: StreamFrame, dropped: int = 0) -> Verdict:
        """dropped: frames since the last one that were left out on purpose."""
        time_s = frame.time_s
        if frame.image is None or time_s is None or not np.isfinite(time_s):
            return Verdict(False, frame.problem or f"its time is {time_s}")
        if self._last_s is None:
            return self._take(frame, time_s)
        step_s = time_s - self._last_s
        if step_s == 0:
            return Verdict(False, "repeated: its time is that of the frame before")
        if step_s < 0:
            return self._back(frame, time_s, -step_s)
        if self._same_pixels(frame.image):
            self._last_s = time_s
            return Verdict(False, "repeated: its pixels are those of the frame before")
        warning = self._gap(step_s, dropped)
        if not warning and not dropped:
            self._intervals_s.append(step_s)
        return self._take(frame, time_s, warning)

    def _take(self, frame: StreamFrame, time_s: float, warning: str = "", anew: bool = False) -> Verdict:
        self._last_s, self._late_s, self._image = time_s, None, frame.image
        return Verdict(True, warning=warning, anew=anew)

    def _back(self, frame: StreamFrame, time_s: float, by_s: float) -> Verdict:
        if self._late_s is not None and time_s > self._late_s:
            self._intervals_s.clear()
            return self._take(frame, time_s, f"the clock was set back by {by_s:.3f} s", anew=True)
        self._late_s = time_s
        return Verdict(False, f"late: {by_s:.3f} s before the frame before")

    def _same_pixels(self, image: Pixels) -> bool:
        """All-dark frames are alike and say nothing twice."""
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
        return f"{missing} frame{'s' * (missing > 1)} missing before it: {step_s:.3f} s after the one before"
