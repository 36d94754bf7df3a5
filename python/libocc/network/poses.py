# SPDX-License-Identifier: Apache-2.0
"""Poses as positions and unit quaternions."""

import numpy as np
from numpy.typing import NDArray


def pose_from(position_m: NDArray[np.float64], quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """4x4 cam_from_world of a camera at a position, with the unit quaternion (w first) of its rotation."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = -rotation @ position_m
    return pose


def pose_columns(pose: NDArray[np.float64]) -> list[float]:
    """Position and unit quaternion (w first) of a pose: inverse of pose_from() up to rounding errors."""
    r = pose[:3, :3]
    eigenvalues, vectors = np.linalg.eigh(np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
        [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
    ]))
    quaternion = vectors[:, np.argmax(eigenvalues)]
    if quaternion[0] < 0:
        quaternion = -quaternion
    return [float(v) for v in (*(-r.T @ pose[:3, 3]), *quaternion)]


def pose_covariance(
    pose: NDArray[np.float64], sigma_rad: NDArray[np.float64], sigma_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """6x6 covariance of the left perturbation of cam_from_world [rotation, translation].

    sigma_rad (3,): errors of the rotation about the camera's axes; sigma_m (3,): errors of the position along the
    world's axes. A translation by d moves the position by -R^T d (libocc/geometry/rigid.hpp).
    """
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = np.diag(np.square(sigma_rad))
    covariance[3:, 3:] = pose[:3, :3] @ np.diag(np.square(sigma_m)) @ pose[:3, :3].T
    return covariance
