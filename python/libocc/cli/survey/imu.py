# SPDX-License-Identifier: Apache-2.0
"""Samples of an inertial measurement unit: a table, or a topic of a bag."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...network.tables import decoded, read_table
from ...streams.bags import imu_of_bag, is_bag
from .. import error_context

COLUMNS = ("time_s", *(f"gyro_{axis}_rad_s" for axis in "xyz"), *(f"accel_{axis}_m_s2" for axis in "xyz"))
# Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 35, 2016; also written by Kalibr.
EUROC_COLUMNS = (
    "#timestamp [ns]", *(f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"), *(f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"),
)
PLAUSIBLE_M_S2 = (5.0, 20.0)  # median length of specific forces: gravity, and the motion of a hand or a robot


def read_imu(name: str, source: str) -> NDArray[np.float64]:
    """Samples (n, 7): time [s], rotation rates [rad/s], specific forces [m/s^2]; of a table or, if the source of the
    pictures is a bag, of its topic. Raises: Failure naming file, line and value."""
    with error_context(name):
        rows = imu_of_bag(source, name) if is_bag(Path(source)) and not Path(name).exists() else rows_of_table(name)
        if len(rows) < 2:
            raise ValueError("has fewer than two samples")
        late = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
        if len(late):
            before_s, time_s = rows[late[0] : late[0] + 2, 0]
            raise ValueError(f"sample {late[0] + 1}: its time {time_s:.9g} s is not after {before_s:.9g} s")
        force_m_s2 = float(np.median(np.linalg.norm(rows[:, 4:], axis=1)))
        if not PLAUSIBLE_M_S2[0] < force_m_s2 < PLAUSIBLE_M_S2[1]:
            raise ValueError(
                f"the median of the specific force is {force_m_s2:.3g} m/s^2; it must contain gravity, in m/s^2"
            )
        return rows


def rows_of_table(name: str) -> NDArray[np.float64]:
    first = decoded(Path(name), Path(name).read_bytes()).split("\n", 1)[0]
    columns, unit_s = (EUROC_COLUMNS, 1e-9) if "[ns]" in first else (COLUMNS, 1.0)
    rows: list[Any] = [[row.number(column) for column in columns] for row in read_table(Path(name), columns)]
    return np.array(rows).reshape(-1, 7) * [unit_s, 1, 1, 1, 1, 1, 1]
