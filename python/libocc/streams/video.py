# SPDX-License-Identifier: Apache-2.0
"""Frames from a video file, or from a camera opened by OpenCV."""

import importlib
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from .frames import StreamFrame

MAX_FAILURES = 30  # consecutive failures after which a file or camera counts as ended


def _red_first(cv2: Any, image: Any) -> Any:
    """Pixels in the order red, green, blue."""
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB) if image.ndim == 3 and image.shape[2] == 3 else np.asarray(image)


def _opencv(name: str) -> Any:
    try:
        return importlib.import_module("cv2")
    except ImportError as error:
        raise ValueError(f"{name}: requires OpenCV: pip install 'libocc[video]'") from error


class VideoSource:
    """Frames of a video at a constant rate: fps, or the rate in the file. Raises: ValueError naming the file."""

    live = False

    def __init__(self, path: str, fps: float | None = None):
        self.name = path
        self._cv2 = cv2 = _opencv(path)
        self._video = cv2.VideoCapture(path)
        self._rate = fps or float(self._video.get(cv2.CAP_PROP_FPS))
        if not self._video.isOpened() or not self._rate > 0:
            raise ValueError(f"{path}: is not a video that OpenCV can read")
        count = int(self._video.get(cv2.CAP_PROP_FRAME_COUNT))
        self.total: int | None = count if count > 0 else None

    def __iter__(self) -> Iterator[StreamFrame]:
        index = failed = 0
        while self.total is None or index < self.total or not failed:
            valid, image = self._video.read()
            if valid:
                failed = 0
                yield StreamFrame(index, index / self._rate, _red_first(self._cv2, image))
            else:
                failed += 1
                if self.total is None or index >= self.total:
                    return
                if failed > MAX_FAILURES:
                    raise ValueError(f"{self.name}: cannot be read after frame {index - failed} of {self.total}")
                yield StreamFrame(index, index / self._rate, None, problem="cannot be decoded")
            index += 1

    def close(self) -> None:
        self._video.release()


class CameraSource:
    """Frames of a camera given by its number.

    Times are the arrival times in seconds since 1970, from a monotonic clock.
    Raises: ValueError when the camera cannot be opened.
    """

    live = True
    total: int | None = None

    def __init__(self, name: str, number: int, fps: float | None = None):
        self.name = name
        self._cv2 = cv2 = _opencv(name)
        self._camera = cv2.VideoCapture(number)
        if not self._camera.isOpened():
            raise ValueError(f"{name}: is not a camera that OpenCV can open")
        if fps is not None:
            self._camera.set(cv2.CAP_PROP_FPS, fps)
        self._epoch_s = time.time() - time.monotonic()

    def __iter__(self) -> Iterator[StreamFrame]:
        index = failed = 0
        while True:
            valid, image = self._camera.read()
            time_s = self._epoch_s + time.monotonic()
            if valid:
                failed = 0
                yield StreamFrame(index, time_s, _red_first(self._cv2, image))
            else:
                failed += 1
                if failed > MAX_FAILURES:
                    raise OSError(f"{self.name}: delivers no more frames")
                yield StreamFrame(index, time_s, None, problem="the camera delivered no image")
                time.sleep(0.01)
            index += 1

    def close(self) -> None:
        self._camera.release()
