# SPDX-License-Identifier: Apache-2.0
"""Filters and smoothers over recordings, odometry, and statistics for the consistency of covariances."""

from ._core import (
    Consistency,
    ConsistencyReport,
    FilterOutcome,
    FilterUpdate,
    OdometryLink,
    PlanarEstimate,
    PlanarFilter,
    PlanarFilterOptions,
    PlanarOdometry,
    PlanarSmoothing,
    PlanarWindowEstimate,
    PlanarWindowSmoother,
    PoseFilter,
    PoseFilterOptions,
    PoseObservation,
    PosePrediction,
    SmootherFrame,
    Smoothing,
    WindowEstimate,
    WindowSmoother,
    chi2_quantile,
    moved_pose,
    nees,
    nis,
    normalised_squared_error,
    position_covariance,
    smooth,
    smooth_planar,
)

__all__ = [
    "Consistency", "ConsistencyReport", "FilterOutcome", "FilterUpdate", "OdometryLink", "PlanarEstimate",
    "PlanarFilter", "PlanarFilterOptions", "PlanarOdometry", "PlanarSmoothing",
    "PlanarWindowEstimate", "PlanarWindowSmoother", "PoseFilter", "PoseFilterOptions", "PoseObservation",
    "PosePrediction", "SmootherFrame", "Smoothing", "WindowEstimate", "WindowSmoother", "chi2_quantile", "moved_pose",
    "nees", "nis", "normalised_squared_error", "position_covariance", "smooth", "smooth_planar",
]
