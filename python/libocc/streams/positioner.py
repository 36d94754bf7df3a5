# SPDX-License-Identifier: Apache-2.0
"""From an image to what is said of it: by the tracker alone."""

from dataclasses import dataclass
from typing import Protocol

from .._core import Prior, Scene, TrackedFrame, Tracker
from .frames import Pixels
from .record import Pose, pose_of


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

    def begin_anew(self) -> None:
        """Nothing from before counts, such as a clock that jumped."""


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
    """prior: holds for the beginning; not for what begins anew."""

    def __init__(self, scene: Scene, prior: Prior | None = None):
        self._scene = scene
        self._tracker = Tracker(scene, prior=prior)

    def add(self, image: Pixels, time_s: float) -> Seen:
        return seen_of(self._tracker.add_image(image, time_s))

    def begin_anew(self) -> None:
        self._tracker = Tracker(self._scene)
