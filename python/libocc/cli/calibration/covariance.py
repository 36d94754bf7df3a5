# SPDX-License-Identifier: Apache-2.0
"""Export of points and bodies with their joint covariance."""

import io
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..._core import Network, Precision, Target
from ...network.poses import pose_columns
from ...network.tables import table_bytes

MAX_TARGETS = 1000  # a covariance of 72 MB; it grows with the square of their number
BODY_COLUMNS = (
    "name", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "scale", "sigma_rx_rad", "sigma_ry_rad", "sigma_rz_rad",
    "sigma_x_m", "sigma_y_m", "sigma_z_m", "sigma_scale",
)


def targets_of(network: Network) -> tuple[list[str], list[Target]]:
    """All points, then the corners of all bodies, with their names."""
    targets = [Target.point(k) for k in range(len(network.point_names))]
    names = list(network.point_names)
    for body, (name, corners) in enumerate(zip(network.body_names, network.body_corners_m)):
        targets += [Target.corner(body, k) for k in range(len(corners))]
        names += [f"{name}.{k}" for k in range(len(corners))]
    return names, targets


def body_covariances(network: Network, known: Precision) -> NDArray[np.float64]:
    """(n, 6, 6) covariances of the left perturbations of world_from_body."""
    return np.array([known.body(k) for k in range(len(network.body_names))]).reshape(-1, 6, 6)


def bodies_csv(network: Network, known: Precision) -> bytes:
    """Poses of bodies with the sigmas of their left perturbation about the body's origin, in the world's axes."""
    rows: list[Sequence[object]] = []
    poses, scales = [np.asarray(pose) for pose in network.body_poses], network.body_scales
    for k, (pose, covariance) in enumerate(zip(poses, body_covariances(network, known))):
        # The covariance is that of a perturbation about the world's origin: the body's origin moves by d + r x t.
        x, y, z = pose[:3, 3]
        to_origin = np.eye(6)
        to_origin[3:, :3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        variances = np.diag(to_origin @ covariance @ to_origin.T if np.isfinite(covariance).all() else covariance)
        columns = pose_columns(np.asarray(np.linalg.inv(pose), dtype=float))
        rows.append((network.body_names[k], *columns, float(scales[k]), *map(float, np.sqrt(np.maximum(variances, 0))),
                     float(known.body_scale_sigma(k))))
    return table_bytes(BODY_COLUMNS, rows)


def covariance_npz(network: Network, known: Precision) -> bytes | None:
    """NumPy archive with the joint covariance of all points and corners; None for more than MAX_TARGETS."""
    names, targets = targets_of(network)
    if len(targets) > MAX_TARGETS:
        return None
    content = io.BytesIO()
    np.savez(
        content, names=np.array(names, dtype=str),
        positions_m=np.array([network.position_m(target) for target in targets]).reshape(-1, 3),
        covariance_m2=known.joint(targets), body_names=np.array(network.body_names, dtype=str),
        body_poses=np.array(network.body_poses).reshape(-1, 4, 4), body_covariances=body_covariances(network, known),
    )
    return content.getvalue()
