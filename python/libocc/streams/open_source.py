# SPDX-License-Identifier: Apache-2.0
"""Opens a source of frames by its name."""

import re
from pathlib import Path

from .bags import BagSource, is_bag
from .folder import FolderSource
from .frames import Source
from .video import CameraSource, VideoSource


def open_source(name: str, fps: float | None = None, topic: str | None = None) -> Source:
    """Opens `camera:N`, a bag (a ROS 2 folder, .bag, .mcap, .db3), a folder of images, or a video.

    fps: frame rate of frames whose times are unknown. topic: image topic of a bag that has several.

    Raises: FileNotFoundError, OSError or ValueError naming the source.
    """
    camera = re.fullmatch(r"camera:(\d+)", name)
    if camera:
        return CameraSource(name, int(camera[1]), fps)
    place = Path(name)
    if name.startswith("camera:"):
        raise ValueError(f"{name}: a camera must be given as camera:N with its number N, such as camera:0")
    if not place.exists():
        raise FileNotFoundError(f"{name}: no such folder, video or bag")
    if is_bag(place):
        return BagSource(name, topic)
    if topic is not None:
        raise ValueError(f"--topic: {name} is not a bag")
    return FolderSource(name, fps) if place.is_dir() else VideoSource(name, fps)
