# SPDX-License-Identifier: Apache-2.0
"""The frames of a sequence with their times: from a folder of images or from a video."""

import importlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import read_image
from .progress import progress

Pixels = NDArray[np.uint8 | np.uint16]
ENDINGS = (".png", ".pgm", ".tif", ".tiff", ".jpg", ".jpeg")


@dataclass(frozen=True)
class Frames:
    images: list[Pixels]
    times_s: list[float]


def load_frames(path: str, fps: float | None) -> Frames:
    """fps: of a folder without truth files, or instead of what a video says.

    Raises: FileNotFoundError, OSError or ValueError naming the file.
    """
    place = Path(path)
    if place.is_dir():
        return _folder(place, fps)
    if not place.exists():
        raise FileNotFoundError(f"{path}: no such folder or video")
    return _video(path, fps)


def _folder(folder: Path, fps: float | None) -> Frames:
    inside = folder / "images" if (folder / "images").is_dir() else folder
    files = sorted(file for file in inside.iterdir() if file.suffix.lower() in ENDINGS)
    if not files:
        raise ValueError(f"{inside}: holds no images ({', '.join(ENDINGS)})")
    times_s = [frame_time_s(folder, file, i, fps) for i, file in enumerate(files)]
    images = []
    with progress("reading", len(files)) as advance:
        for file in files:
            images.append(read_image(file))
            advance()
    return Frames(images, times_s)


def frame_time_s(folder: Path, image: Path, index: int, fps: float | None) -> float:
    """A frame's own time where `libocc sequence` wrote it down, unless fps says another."""
    truth = folder / "truth" / f"{image.stem}.json"
    if fps is not None:
        number = int(image.stem) if image.stem.isdigit() else index
        return number / fps
    if not truth.is_file():
        raise ValueError(f"{truth}: no such file, so the times are unknown: give --fps")
    try:
        return float(json.loads(truth.read_text())["time_s"])
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{truth}: key `time_s`: must be a number of seconds") from error


def _video(path: str, fps: float | None) -> Frames:
    try:
        cv2: Any = importlib.import_module("cv2")
    except ImportError as error:
        raise ValueError(f"{path}: videos need OpenCV: pip install 'libocc[video]'") from error
    video = cv2.VideoCapture(path)
    rate = fps or float(video.get(cv2.CAP_PROP_FPS))
    if not video.isOpened() or not rate > 0:
        raise ValueError(f"{path}: no video that OpenCV can read")
    images: list[Pixels] = []
    with progress("reading", max(int(video.get(cv2.CAP_PROP_FRAME_COUNT)), 1)) as advance:
        while True:
            there, image = video.read()
            if not there:
                break
            images.append(np.asarray(image))
            advance()
    if not images:
        raise ValueError(f"{path}: no video that OpenCV can read")
    return Frames(images, [i / rate for i in range(len(images))])
