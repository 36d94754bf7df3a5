# SPDX-License-Identifier: Apache-2.0
"""Frames from a video file, or from a camera that OpenCV opens."""

import importlib
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from .frames import StreamFrame

MOST_FAILURES = 30  # frames in a row that a file or a camera does not give, before it counts as ended


def _opencv(name: str) -> Any:
    try:
        return importlib.import_module("cv2")
    except ImportError as error:
        raise ValueError(f"{name}: needs OpenCV: pip install 'libocc[video]'") from error


class VideoSource:
    """Frames at a constant rate: what the file says, or fps. Raises: ValueError naming the file."""

    live = False

    def __init__(self, path: str, fps: float | None = None):
        self.name = path
        cv2 = _opencv(path)
        self._video = cv2.VideoCapture(path)
        self._rate = fps or float(self._video.get(cv2.CAP_PROP_FPS))
        if not self._video.isOpened() or not self._rate > 0:
            raise ValueError(f"{path}: no video that OpenCV can read")
        count = int(self._video.get(cv2.CAP_PROP_FRAME_COUNT))
        self.total: int | None = count if count > 0 else None

    def __iter__(self) -> Iterator[StreamFrame]:
        index = failed = 0
        while self.total is None or index < self.total or not failed:
            there, image = self._video.read()
            if there:
                failed = 0
                yield StreamFrame(index, index / self._rate, np.asarray(image))
            else:
                failed += 1
                if self.total is None or index >= self.total:
                    return
                if failed > MOST_FAILURES:
                    raise ValueError(f"{self.name}: gives nothing after frame {index - failed} of {self.total}")
                yield StreamFrame(index, index / self._rate, None, problem="cannot be decoded")
            index += 1

    def close(self) -> None:
        self._video.release()


class CameraSource:
    """A camera by its number. Times are seconds since 1970 when a frame arrives, by a clock that does
    not jump. Raises: ValueError when it cannot be opened."""

    live = True
    total: int | None = None

    def __init__(self, name: str, number: int, fps: float | None = None):
        self.name = name
        cv2 = _opencv(name)
        self._camera = cv2.VideoCapture(number)
        if not self._camera.isOpened():
            raise ValueError(f"{name}: no camera that OpenCV can open")
        if fps is not None:
            self._camera.set(cv2.CAP_PROP_FPS, fps)
        self._epoch_s = time.time() - time.monotonic()

    def __iter__(self) -> Iterator[StreamFrame]:
        index = failed = 0
        while True:
            there, image = self._camera.read()
            time_s = self._epoch_s + time.monotonic()
            if there:
                failed = 0
                yield StreamFrame(index, time_s, np.asarray(image))
            else:
                failed += 1
                if failed > MOST_FAILURES:
                    raise OSError(f"{self.name}: gives no more frames")
                yield StreamFrame(index, time_s, None, problem="the camera gave no image")
                time.sleep(0.01)
            index += 1

    def close(self) -> None:
        self._camera.release()
