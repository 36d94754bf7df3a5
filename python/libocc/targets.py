# SPDX-License-Identifier: Apache-2.0
"""Calibration targets and AprilTags: rendering with ground truth, detection and the camera's pose from tags."""

from ._core import (
    AprilTag,
    ChessboardCorners,
    ChessboardTarget,
    ChessboardTruth,
    CircleGridPoints,
    CircleGridTarget,
    CircleGridTruth,
    CircleTruth,
    CircularTarget,
    TagPattern,
    TagTruth,
    TargetRenderer,
    april_tag_families,
    circle_grid_positions,
    correct_disc_centres,
    detect_april_tags,
    find_chessboard,
    find_circle_grid,
    locate_by_tags,
    tag_pattern,
    tag_poses,
)

__all__ = [
    "AprilTag", "ChessboardCorners", "ChessboardTarget", "ChessboardTruth", "CircleGridPoints", "CircleGridTarget",
    "CircleGridTruth", "CircleTruth", "CircularTarget", "TagPattern", "TagTruth", "TargetRenderer",
    "april_tag_families", "circle_grid_positions", "correct_disc_centres", "detect_april_tags", "find_chessboard",
    "find_circle_grid", "locate_by_tags", "tag_pattern", "tag_poses",
]
