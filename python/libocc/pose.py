# SPDX-License-Identifier: Apache-2.0
"""Types of the pose solvers beside `libocc.solve_pose`, and the solver for poses on a floor."""

from ._core import (
    Layout,
    PlanarPrior,
    PoseCandidate,
    missing_solvers,
    planar_poses,
)

__all__ = [
    "Layout", "PlanarPrior", "PoseCandidate", "missing_solvers", "planar_poses",
]
