# SPDX-License-Identifier: Apache-2.0
"""The loop: a frame comes, is looked at, and what is said of it goes out."""

import threading
import time
from collections.abc import Callable, Generator
from typing import Any

import numpy as np

from ..._core import Scene, moved_pose
from ...streams.frames import Source, StreamFrame
from .clock import FrameOrder
from .latest import Latest
from .positioner import Positioner, Seen
from .record import SKIPPED, Array, Pose, Record


def true_position_m(truth: Any, time_s: float) -> Array | None:
    """Where the camera of a truth file was at a time near to its own."""
    if truth is None:
        return None
    pose = moved_pose(truth["cam_from_world"], truth["velocity"], time_s - truth["time_s"])
    return np.asarray(-pose[:3, :3].T @ pose[:3, 3])


class Follower:
    """Takes frames and says a record of each. Frames of another size than the camera's are left out
    and said; when no frame has had the right one, that is the caller's mistake.

    Raises of look(): ValueError for a first image that is not the camera's.
    """

    def __init__(self, scene: Scene, positioner: Positioner):
        self._size = (scene.camera.height, scene.camera.width)
        self._positioner = positioner
        self._order = FrameOrder()
        self._fitted = False

    def look(self, frame: StreamFrame, dropped: int = 0) -> Record:
        begun_s = time.perf_counter()
        verdict = self._order.look(frame, dropped) if self._fits(frame) else None
        if verdict is None or not verdict.usable:
            reason = verdict.reason if verdict else f"its size is not the camera's, {self._size[1]} x {self._size[0]}"
            return self._record(frame, Seen(SKIPPED, reason), "", begun_s, dropped)
        assert frame.image is not None and frame.time_s is not None
        if verdict.anew:
            self._positioner.begin_anew(frame.time_s)
        seen = self._positioner.add(frame.image, frame.time_s)
        return self._record(frame, seen, verdict.warning, begun_s, dropped)

    def _fits(self, frame: StreamFrame) -> bool:
        if frame.image is None or frame.image.shape[:2] == self._size:
            self._fitted |= frame.image is not None
            return True
        if not self._fitted:
            height, width = frame.image.shape[:2]
            raise ValueError(f"is {width} x {height}, the scene's camera is {self._size[1]} x {self._size[0]}")
        return False

    def _record(self, frame: StreamFrame, seen: Seen, warning: str, begun_s: float, dropped: int) -> Record:
        truth_m = None if frame.time_s is None else true_position_m(frame.truth, _time_of(seen.pose, frame.time_s))
        error_m = None if truth_m is None or seen.pose is None else seen.pose.position_m - truth_m
        return Record(
            frame.index, frame.time_s, seen.state, seen.reason,
            "; ".join(text for text in (warning, seen.warning) if text), frame.name, seen.pose, seen.lamps,
            seen.blobs_px, seen.full_search, seen.nis, seen.nis_dof, time.perf_counter() - begun_s, dropped,
            error_m, truth_m,
        )


def _time_of(pose: Pose | None, time_s: float) -> float:
    return time_s if pose is None else pose.time_s


def records(
    source: Source, follower: Follower, stop: threading.Event, realtime: bool, tell: Callable[[str], None]
) -> Generator[Record, None, None]:
    """Of every frame, until the source ends or stop is set. Sources that are live, or are to be taken
    as if they were, lose the frames that come while one is looked at.

    Raises: OSError or ValueError when the source ends before its time.
    """
    if not (source.live or realtime):
        for frame in source:
            if stop.is_set():
                return
            yield follower.look(frame)
        return
    latest = Latest(source, stop, paced=not source.live)
    counted = 0
    try:
        for frame in latest:
            dropped, counted = latest.dropped - counted, latest.dropped
            yield follower.look(frame, dropped)
    finally:
        if not latest.close():
            tell(f"{source.name}: still being read when the run ended")
