# SPDX-License-Identifier: Apache-2.0
"""Targets and AprilTags: rendering with ground truth, detection and the camera's pose from tags."""

from ._core import (
    AprilTag,
    ChessboardTarget,
    ChessboardTruth,
    CircleTruth,
    CircularTarget,
    TagPattern,
    TagTruth,
    TargetRenderer,
    april_tag_families,
    detect_april_tags,
    find_chessboard,
    locate_by_tags,
    tag_pattern,
    tag_poses,
)

__all__ = [
    "AprilTag", "ChessboardTarget", "ChessboardTruth", "CircleTruth", "CircularTarget", "TagPattern", "TagTruth",
    "TargetRenderer", "april_tag_families", "detect_april_tags", "find_chessboard", "locate_by_tags", "tag_pattern",
    "tag_poses",
]
