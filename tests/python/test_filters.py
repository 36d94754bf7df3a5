# SPDX-License-Identifier: Apache-2.0
"""Filters: rejected covariances, and covariances after gaps."""

import numpy as np
import pytest

from libocc import Odometry, guide, look_at, smoothing

POSE = look_at([1, 2, 0.5], [2, 2, 1], [0, 0, 1])
ASYMMETRIC = 1e-4 * np.eye(6) + np.diag([5e-5, 0, 0, 0, 0], 1)
INDEFINITE = 1e-4 * np.eye(6)
INDEFINITE[0, 1] = INDEFINITE[1, 0] = 1


def started():
    pose_filter = smoothing.PoseFilter(smoothing.PoseFilterOptions(gate_sigma=np.inf))
    pose_filter.start(0.0, POSE, 1e-6 * np.eye(6))
    return pose_filter


@pytest.mark.parametrize(("covariance", "rule"), [(ASYMMETRIC, "symmetric"), (INDEFINITE, "positive semi-definite")])
def test_invalid_covariances_of_odometry_are_rejected(covariance, rule):
    step = Odometry(from_s=0.0, to_s=1.0, to_from_from=np.eye(4), covariance=covariance)
    with pytest.raises(ValueError, match=f"covariance must be {rule}, got"):
        started().add(step)
    planar = smoothing.PlanarOdometry(from_s=0.0, to_s=1.0, increment=guide.PlanarPose(), covariance=covariance[:3, :3])
    planar_filter = smoothing.PlanarFilter()
    planar_filter.start(0.0, guide.PlanarPose(), 1e-6 * np.eye(3))
    with pytest.raises(ValueError, match=f"covariance must be {rule}, got"):
        planar_filter.add(planar)


@pytest.mark.parametrize(("covariance", "rule"), [(ASYMMETRIC, "symmetric"), (INDEFINITE, "positive definite")])
def test_invalid_covariances_of_poses_are_rejected(covariance, rule):
    with pytest.raises(ValueError, match=f"covariance must be {rule}, got"):
        smoothing.PoseFilter().start(0.0, POSE, covariance)
    with pytest.raises(ValueError, match=f"covariance must be {rule}, got"):
        smoothing.PoseObservation.of_pose(0.0, POSE, covariance)


@pytest.mark.parametrize("gap_s", [60.0, 1000.0, 36000.0])
def test_covariance_is_positive_definite_after_a_gap(gap_s):
    pose_filter = started()
    for time_s in (gap_s, gap_s + 0.03):
        pose_filter.add(smoothing.PoseObservation.of_pose(time_s, POSE, 1e-12 * np.eye(6)))
        estimate = pose_filter.at(time_s)
        for covariance in (estimate.covariance, estimate.velocity_covariance):
            sigmas = np.sqrt(np.diag(covariance))
            assert np.linalg.eigvalsh(covariance / np.outer(sigmas, sigmas))[0] > 0
