# SPDX-License-Identifier: Apache-2.0
"""Record of one frame, as plain data for JSON and as a line of text."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SKIPPED = "skipped"  # state of a frame that was not usable


@dataclass(frozen=True)
class Pose:
    """Pose of the camera with its covariances, as in a Fix."""

    time_s: float
    cam_from_world: Array
    covariance: Array
    position_m: Array
    position_covariance_m2: Array

    @property
    def sigmas_m(self) -> Array:
        return np.sqrt(np.maximum(np.diag(self.position_covariance_m2), 0))


@dataclass(frozen=True)
class Record:
    """Result of one frame.

    state: searching, tracking, coasting, lost (see Tracker), or skipped. The pose is an estimate in the state tracking,
    a prediction with a growing covariance in the state coasting, and None otherwise.
    """

    frame: int
    time_s: float | None
    state: str
    reason: str = ""
    warning: str = ""
    name: str = ""
    pose: Pose | None = None
    lamps: tuple[int, ...] = ()
    blobs_px: tuple[tuple[float, float], ...] = ()
    full_search: bool = False
    nis: float | None = None
    nis_dof: int = 0
    took_s: float = 0.0
    dropped: int = 0  # frames dropped since the previous record
    error_m: Array | None = None  # estimate minus truth, if the truth is known
    truth_m: Array | None = None

    @property
    def predicted(self) -> bool:
        return self.pose is not None and self.state != "tracking"


def pose_of(tracked: Any) -> Pose | None:
    """Pose of a TrackedFrame; None if it has no pose or the pose is not finite."""
    if tracked.state.name not in ("tracking", "coasting"):
        return None
    values = (tracked.cam_from_world, tracked.covariance, tracked.position_m, tracked.position_covariance_m2)
    arrays = [np.array(value, float) for value in values]
    if not all(np.isfinite(array).all() for array in arrays):
        return None
    return Pose(float(tracked.time_s), *arrays)


def record_dict(record: Record) -> dict[str, Any]:
    """Record as plain data, with the same keys for every frame."""
    pose = record.pose
    return {
        "frame": record.frame,
        "name": record.name or None,
        "time_s": record.time_s,
        "state": record.state,
        "reason": record.reason,
        "warning": record.warning,
        "predicted": record.predicted,
        "position_m": None if pose is None else pose.position_m.tolist(),
        "position_covariance_m2": None if pose is None else pose.position_covariance_m2.tolist(),
        "cam_from_world": None if pose is None else pose.cam_from_world.tolist(),
        "covariance": None if pose is None else pose.covariance.tolist(),
        "pose_time_s": None if pose is None else pose.time_s,
        "lamps": list(record.lamps),
        "full_search": record.full_search,
        "nis": record.nis,
        "nis_dof": record.nis_dof,
        "took_s": record.took_s,
        "dropped": record.dropped,
        "error_m": None if record.error_m is None else record.error_m.tolist(),
    }


HEAD = "    time s  state           x m       y m       z m  sigma mm  lamps"


def record_text(record: Record) -> str:
    """Record as one line of the table with the header HEAD."""
    time = "         -" if record.time_s is None else f"{record.time_s:10.3f}"
    if record.pose is None:
        place = f"{'-':>9} {'-':>9} {'-':>9} {'-':>9}"
    else:
        x, y, z = (round(float(v), 4) + 0.0 for v in record.pose.position_m)
        sigma_mm = 1e3 * float(np.linalg.norm(record.pose.sigmas_m))
        place = f"{x:9.4f} {y:9.4f} {z:9.4f} {sigma_mm:9.2f}"
    lamps = " ".join(map(str, record.lamps)) or "-"
    notes = "; ".join(text for text in (record.reason, record.warning) if text)
    return f"{time}  {record.state:<9} {place}  {lamps}" + (f"  {notes}" if notes else "")
