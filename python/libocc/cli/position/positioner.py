# SPDX-License-Identifier: Apache-2.0
"""Positions from images by the tracker."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..._core import Prior, Scene, TrackedFrame, Tracker
from ...streams.frames import Pixels
from .record import Pose, pose_of

DRIFT_M, DRIFT_RAD = 0.3, 0.2  # sigma of the motion during a clock jump, whose duration is unknown


@dataclass(frozen=True)
class FrameResult:
    """Result of one frame; the fields are those of Record."""

    state: str
    reason: str = ""
    warning: str = ""
    pose: Pose | None = None
    lamps: tuple[int, ...] = ()
    blobs_px: tuple[tuple[float, float], ...] = ()
    full_search: bool = False
    nis: float | None = None
    nis_dof: int = 0


class Positioner(Protocol):
    def add(self, image: Pixels, time_s: float) -> FrameResult:
        """Processes an image. Raises: ValueError when its size is not that of the camera."""

    def restart(self, time_s: float) -> None:
        """Restarts with the next frame because the clock jumped to that time."""


def result_of(tracked: TrackedFrame) -> FrameResult:
    pose = pose_of(tracked)
    state, reason = tracked.state.name, tracked.reason
    if pose is None and state in ("tracking", "coasting"):
        state, reason = "lost", "the pose is not finite"
    centres = [blob.centroid_px for blob in tracked.lamps.values()]
    return FrameResult(
        state, reason, pose=pose, lamps=tuple(tracked.lamps),
        warning="relocalised: the pose differs from the prediction" if tracked.relocated else "",
        blobs_px=tuple((float(x), float(y)) for x, y in centres), full_search=tracked.full_search,
        nis=float(tracked.nis) if tracked.nis_dof > 0 else None, nis_dof=int(tracked.nis_dof),
    )


class TrackerPositioner:
    """prior: used for the first fix; its height and gravity are used throughout."""

    def __init__(self, scene: Scene, prior: Prior | None = None):
        self._scene, self._prior = scene, prior
        self._tracker = Tracker(scene, prior)
        self._last: Pose | None = None

    def add(self, image: Pixels, time_s: float) -> FrameResult:
        result = result_of(self._tracker.add_image(image, time_s))
        self._last = result.pose
        return result

    def restart(self, time_s: float) -> None:
        """Restarts at the last pose with an enlarged covariance, because the camera may have moved."""
        self._tracker = Tracker(self._scene, _permanent(self._prior))
        if self._last is not None:
            moved = np.diag([DRIFT_RAD**2] * 3 + [DRIFT_M**2] * 3)
            self._tracker.start(time_s, self._last.cam_from_world, self._last.covariance + moved)


def _permanent(prior: Prior | None) -> Prior | None:
    if prior is None:
        return None
    return Prior(
        height_m=prior.height_m, height_sigma_m=prior.height_sigma_m,
        gravity_in_cam=prior.gravity_in_cam, gravity_sigma_rad=prior.gravity_sigma_rad,
    )
