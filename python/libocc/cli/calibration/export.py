# SPDX-License-Identifier: Apache-2.0
"""Export of points with their covariance as CSV and PLY."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...network.tables import table_bytes

POINT_COLUMNS = ("name", "x_m", "y_m", "z_m", "sigma_x_m", "sigma_y_m", "sigma_z_m",
                 "cov_xy_m2", "cov_xz_m2", "cov_yz_m2")


def points_csv(names: Sequence[str], positions: NDArray[np.float64], covariances: NDArray[np.float64]) -> bytes:
    rows = []
    for name, position, q in zip(names, positions, covariances):
        sigmas = np.sqrt(np.diag(q))
        rows.append([name, *map(float, position), *map(float, sigmas), float(q[0, 1]), float(q[0, 2]), float(q[1, 2])])
    return table_bytes(POINT_COLUMNS, rows)


def points_ply(positions: NDArray[np.float64], covariances: NDArray[np.float64]) -> bytes:
    """ASCII PLY file: vertices with their sigmas as properties; -1 is an unknown sigma."""
    head = "ply\nformat ascii 1.0\ncomment libocc, metres\n" + f"element vertex {len(positions)}\n" + "".join(
        f"property double {name}\n" for name in ("x", "y", "z", "sigma_x", "sigma_y", "sigma_z")
    ) + "end_header\n"
    lines = []
    for position, q in zip(positions, covariances):
        sigmas = np.sqrt(np.diag(q))
        sigmas[~np.isfinite(sigmas)] = -1  # not all readers of PLY accept an infinity
        lines.append(" ".join(f"{value:.9g}" for value in (*position, *sigmas)))
    return (head + "\n".join(lines) + ("\n" if lines else "")).encode()
