# SPDX-License-Identifier: Apache-2.0
"""All frames of a sequence with their times, from a folder of images or from a video."""

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from ..streams.folder import FolderSource
from ..streams.frames import Pixels
from ..streams.video import VideoSource
from .progress import progress


@dataclass(frozen=True)
class Frames:
    images: list[Pixels]
    times_s: list[float]


def load_frames(path: str, fps: float | None) -> Frames:
    """Loads all frames; a video that is damaged ends at its first unreadable frame.

    fps: frame rate of a folder without truth files; replaces the frame rate of a video.
    Raises: FileNotFoundError, OSError or ValueError naming the file.
    """
    place = Path(path)
    if not place.exists():
        raise FileNotFoundError(f"{path}: no such folder or video")
    source = FolderSource(path, fps) if place.is_dir() else VideoSource(path, fps)
    images, times_s = [], []
    with closing(source), progress("reading", source.total or 1) as advance:
        for frame in source:
            if frame.image is None or frame.time_s is None:
                if place.is_dir():
                    raise ValueError(frame.problem)
                break
            images.append(frame.image)
            times_s.append(frame.time_s)
            advance()
    if not images:
        raise ValueError(f"{path}: is not a video that OpenCV can read")
    return Frames(images, times_s)
