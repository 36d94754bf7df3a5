# SPDX-License-Identifier: Apache-2.0
"""Calibration targets and AprilTags: rendering with ground truth, detection and the camera's pose from tags."""

from ._core import (
    AprilGrid,
    AprilGridTarget,
    AprilTag,
    BoardPoints,
    CharucoBoard,
    CharucoTarget,
    ChessboardCorners,
    ChessboardTarget,
    ChessboardTruth,
    CircleGridPoints,
    CircleGridTarget,
    CircleGridTruth,
    CircleTruth,
    CircularTarget,
    MarkerBoardTruth,
    TagPattern,
    TagTruth,
    TargetRenderer,
    april_tag_families,
    circle_grid_positions,
    correct_disc_centres,
    detect_april_tags,
    find_april_grid,
    find_charuco,
    find_chessboard,
    find_circle_grid,
    locate_by_tags,
    tag_pattern,
    tag_poses,
)

__all__ = [
    "AprilGrid", "AprilGridTarget", "AprilTag", "BoardPoints", "CharucoBoard", "CharucoTarget", "ChessboardCorners",
    "ChessboardTarget", "ChessboardTruth", "CircleGridPoints", "CircleGridTarget", "CircleGridTruth", "CircleTruth",
    "CircularTarget", "MarkerBoardTruth", "TagPattern", "TagTruth", "TargetRenderer", "april_tag_families",
    "circle_grid_positions", "correct_disc_centres", "detect_april_tags", "find_april_grid", "find_charuco",
    "find_chessboard", "find_circle_grid", "locate_by_tags", "tag_pattern", "tag_poses",
]
