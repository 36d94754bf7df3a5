# SPDX-License-Identifier: Apache-2.0
"""The loop: a frame comes, is looked at, and what is said of it goes out."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._core import Scene, moved_pose
from .clock import FrameOrder
from .frames import Source, StreamFrame
from .latest import Latest
from .positioner import Positioner, Seen
from .record import SKIPPED, Array, Pose, Record


@dataclass
class Summary:
    """What a whole run came to."""

    frames: int = 0
    states: Counter[str] = field(default_factory=Counter)
    warnings: int = 0
    dropped: int = 0
    first_pose_s: float | None = None
    begun_s: float | None = None
    took_s: list[float] = field(default_factory=list)
    errors_m: list[float] = field(default_factory=list)
    nees: list[float] = field(default_factory=list)

    def add(self, record: Record) -> None:
        self.frames += 1
        self.states[record.state] += 1
        self.warnings += bool(record.warning)
        self.dropped += record.dropped
        if record.time_s is not None and self.begun_s is None:
            self.begun_s = record.time_s
        if record.state != SKIPPED:
            self.took_s.append(record.took_s)
        if record.pose is None or record.predicted:
            return
        if self.first_pose_s is None:
            self.first_pose_s = record.time_s
        if record.error_m is not None:
            self.errors_m.append(float(np.linalg.norm(record.error_m)))
            self.nees.append(_nees(record.error_m, record.pose.position_covariance_m2))

    def text(self) -> str:
        """For people, some lines."""
        states = ", ".join(f"{count} {state}" for state, count in self.states.most_common())
        lines = [f"{self.frames} frames: {states or 'none'}"]
        if self.dropped:
            lines[0] += f"; {self.dropped} dropped to keep up"
        if self.warnings:
            lines[0] += f"; {self.warnings} with a warning"
        if self.first_pose_s is not None and self.begun_s is not None:
            lines.append(f"first position {self.first_pose_s - self.begun_s:.3f} s after the first frame")
        if self.took_s:
            median, late = np.percentile(self.took_s, [50, 99])
            lines.append(f"time a frame {1e3 * median:.2f} ms (median), {1e3 * late:.2f} ms (99 %)")
        if self.errors_m:
            error = 1e3 * np.asarray(self.errors_m)
            lines.append(
                f"against the truth: mean {error.mean():.2f} mm, RMSE {np.sqrt((error**2).mean()):.2f} mm, "
                f"largest {error.max():.2f} mm; mean NEES {np.mean(self.nees):.2f} (3 expected)"
            )
        return "\n".join(lines)


def _nees(error_m: Array, covariance_m2: Array) -> float:
    """Infinite where the covariance claims to know a direction without error."""
    try:
        return float(error_m @ np.linalg.solve(covariance_m2, error_m))
    except np.linalg.LinAlgError:
        return float("inf")


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
        if verdict.anew:
            self._positioner.begin_anew()
        assert frame.image is not None and frame.time_s is not None
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
