# SPDX-License-Identifier: Apache-2.0
"""Processing loop: turns the frames of a source into records."""

import threading
import time
from collections.abc import Callable, Generator
from typing import Any

import numpy as np

from ..._core import Scene, moved_pose
from ...streams.frames import Source, StreamFrame
from .clock import FrameOrder
from .latest import Latest
from .positioner import FrameResult, Positioner
from .record import SKIPPED, Array, Pose, Record


def true_position_m(truth: Any, time_s: float) -> Array | None:
    """True camera position at a time near that of a truth file, from its pose and velocity."""
    if truth is None:
        return None
    pose = moved_pose(truth["cam_from_world"], truth["velocity"], time_s - truth["time_s"])
    return np.asarray(-pose[:3, :3].T @ pose[:3, 3])


class Follower:
    """Computes the record of each frame.

    Frames whose size differs from the camera's are skipped. process() raises ValueError if the first image has a wrong
    size, because then the scene does not match the source.
    """

    def __init__(self, scene: Scene, positioner: Positioner):
        self._size = (scene.camera.height, scene.camera.width)
        self._positioner = positioner
        self._order = FrameOrder()
        self._fitted = False

    def process(self, frame: StreamFrame, dropped: int = 0) -> Record:
        begun_s = time.perf_counter()
        verdict = self._order.check(frame, dropped) if self._fits(frame) else None
        if verdict is None or not verdict.usable:
            camera_size = f"{self._size[1]} x {self._size[0]}"
            reason = verdict.reason if verdict else f"its size is not that of the camera, {camera_size}"
            return self._record(frame, FrameResult(SKIPPED, reason), "", begun_s, dropped)
        assert frame.image is not None and frame.time_s is not None
        if verdict.restart:
            self._positioner.restart(frame.time_s)
        result = self._positioner.add(frame.image, frame.time_s)
        return self._record(frame, result, verdict.warning, begun_s, dropped)

    def _fits(self, frame: StreamFrame) -> bool:
        if frame.image is None or frame.image.shape[:2] == self._size:
            self._fitted |= frame.image is not None
            return True
        if not self._fitted:
            height, width = frame.image.shape[:2]
            camera_size = f"{self._size[1]} x {self._size[0]}"
            raise ValueError(f"its size is {width} x {height}, that of the scene's camera is {camera_size}")
        return False

    def _record(self, frame: StreamFrame, result: FrameResult, warning: str, begun_s: float, dropped: int) -> Record:
        truth_m = None if frame.time_s is None else true_position_m(frame.truth, _time_of(result.pose, frame.time_s))
        error_m = None if truth_m is None or result.pose is None else result.pose.position_m - truth_m
        return Record(
            frame.index, frame.time_s, result.state, result.reason,
            "; ".join(text for text in (warning, result.warning) if text), frame.name, result.pose, result.lamps,
            result.blobs_px, result.full_search, result.nis, result.nis_dof, time.perf_counter() - begun_s, dropped,
            error_m, truth_m,
        )


def _time_of(pose: Pose | None, time_s: float) -> float:
    return time_s if pose is None else pose.time_s


def records(
    source: Source, follower: Follower, stop: threading.Event, realtime: bool, report: Callable[[str], None]
) -> Generator[Record, None, None]:
    """Yields the record of every frame until the source ends or `stop` is set.

    Live sources, and all sources with `realtime`, lose the frames that arrive while another one is processed.
    Raises: OSError or ValueError when the source ends prematurely.
    """
    if not (source.live or realtime):
        for frame in source:
            if stop.is_set():
                return
            yield follower.process(frame)
        return
    latest = Latest(source, stop, paced=not source.live)
    counted = 0
    try:
        for frame in latest:
            dropped, counted = latest.dropped - counted, latest.dropped
            yield follower.process(frame, dropped)
    finally:
        if not latest.close():
            report(f"{source.name}: reading had not ended when the run ended")
