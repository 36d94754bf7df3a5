# SPDX-License-Identifier: Apache-2.0
"""Sources of frames: folders of images, videos, cameras and ROS bags.

`open_source` opens any of them; a Source yields a StreamFrame for each frame, also for unreadable ones.
"""

from .frames import Source, StreamFrame
from .open_source import open_source

__all__ = ["Source", "StreamFrame", "open_source"]
