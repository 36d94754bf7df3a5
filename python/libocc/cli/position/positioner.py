# SPDX-License-Identifier: Apache-2.0
"""From an image to what is said of it: by the tracker alone."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..._core import Prior, Scene, TrackedFrame, Tracker
from ...streams.frames import Pixels
from .record import Pose, pose_of

DRIFT_M, DRIFT_RAD = 0.3, 0.2  # how far a camera may be from its last pose when a clock was set


@dataclass(frozen=True)
class Seen:
    """As in a Record."""

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
    def add(self, image: Pixels, time_s: float) -> Seen:
        """Raises: ValueError for an image that is not of the camera's size."""

    def begin_anew(self, time_s: float) -> None:
        """With the next frame: the clock was set to that time."""


def seen_of(tracked: TrackedFrame) -> Seen:
    pose = pose_of(tracked)
    state, reason = tracked.state.name, tracked.reason
    if pose is None and state in ("tracking", "coasting"):
        state, reason = "lost", "the pose is not finite"
    centres = [blob.centroid_px for blob in tracked.lamps.values()]
    return Seen(
        state, reason, pose=pose, lamps=tuple(tracked.lamps),
        warning="the pose has jumped to where it was not expected" if tracked.relocated else "",
        blobs_px=tuple((float(x), float(y)) for x, y in centres), full_search=tracked.full_search,
        nis=float(tracked.nis) if tracked.nis_dof > 0 else None, nis_dof=int(tracked.nis_dof),
    )


class TrackerPositioner:
    """prior: holds for the beginning; its height and gravity for ever."""

    def __init__(self, scene: Scene, prior: Prior | None = None):
        self._scene, self._prior = scene, prior
        self._tracker = Tracker(scene, prior)
        self._last: Pose | None = None

    def add(self, image: Pixels, time_s: float) -> Seen:
        seen = seen_of(self._tracker.add_image(image, time_s))
        self._last = seen.pose
        return seen

    def begin_anew(self, time_s: float) -> None:
        """At the last pose, from which the camera may have moved."""
        self._tracker = Tracker(self._scene, _lasting(self._prior))
        if self._last is not None:
            moved = np.diag([DRIFT_RAD**2] * 3 + [DRIFT_M**2] * 3)
            self._tracker.start(time_s, self._last.cam_from_world, self._last.covariance + moved)


def _lasting(prior: Prior | None) -> Prior | None:
    if prior is None:
        return None
    return Prior(
        height_m=prior.height_m, height_sigma_m=prior.height_sigma_m,
        gravity_in_cam=prior.gravity_in_cam, gravity_sigma_rad=prior.gravity_sigma_rad,
    )
