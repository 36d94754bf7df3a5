# SPDX-License-Identifier: Apache-2.0
"""Power, lamps in view and the position's bound at every point of a plane."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import FluxModel, Rung, Scene, dbm, pose_bound, received_power
from .plane import Plane, checked_rotation, focal_length_mm, looking_up, plane_of, with_focal_length


@dataclass(frozen=True)
class PowerMap:
    """Arrays over a plane: the first axis is y, the second x."""

    scene: Scene  # with the focal length that was asked for
    plane: Plane
    rotation_deg: tuple[float, float, float]  # roll, pitch, yaw: see looking_up()
    rung: Rung | None  # what of the image the bound is of
    lamp_power_w: NDArray[np.float64]  # (ny, nx, lamps), in the scene's order
    whole: NDArray[np.bool_]  # (ny, nx, lamps): all of the lamp's face is seen
    visible: NDArray[np.int32]  # lamps of which some light arrives
    bound_m: NDArray[np.float64]  # of the position, r.m.s. over three axes; infinite: no bound

    @property
    def focal_mm(self) -> float:
        """Of the lens [mm]."""
        return focal_length_mm(self.scene)

    @property
    def power_w(self) -> NDArray[np.float64]:
        """(ny, nx) of all lamps [W]."""
        return np.asarray(self.lamp_power_w.sum(axis=-1))

    @property
    def power_dbm(self) -> NDArray[np.float64]:
        """(ny, nx) of all lamps; minus infinity without light."""
        return np.asarray(dbm(self.power_w))


def power_map(
    scene: Scene,
    *,
    height_m: float | None = None,
    step_m: float = 0.05,
    extent_m: Sequence[float] | None = None,
    rotation_deg: Sequence[float] = (0.0, 0.0, 0.0),
    focal_mm: float | None = None,
    rung: Rung | None = Rung.centres,
    advance: Callable[[], None] = lambda: None,
) -> PowerMap:
    """What the scene's camera receives where it stands on a horizontal plane.

    height_m, step_m, extent_m: of the grid, by default over the room at half its height.
    rotation_deg: (roll, pitch, yaw) from looking up, see maps.looking_up(). focal_mm: instead of
    the scene's. rung: of which observations the Cramer-Rao bound is; None: no bound, the fastest.
    advance: called after each row of the grid.
    Raises: ValueError naming what does not fit.
    """
    plane = plane_of(scene, height_m, step_m, extent_m)
    turn = checked_rotation(rotation_deg)
    if focal_mm is not None:
        scene = with_focal_length(scene, focal_mm)
    bound = _Bound(scene, rung)
    shape = len(plane.y_m), len(plane.x_m)
    out = PowerMap(
        scene, plane, turn, rung, np.zeros((*shape, len(scene.lamps))),
        np.zeros((*shape, len(scene.lamps)), bool), np.zeros(shape, np.int32), np.full(shape, math.inf),
    )
    for row, y_m in enumerate(plane.y_m):
        position_m = np.stack(np.broadcast_arrays(plane.x_m, y_m, plane.height_m), axis=-1)
        poses = looking_up(position_m, turn)
        received = received_power(scene, poses)
        out.lamp_power_w[row], out.whole[row] = received.lamp_power_w, received.whole
        out.visible[row] = received.visible
        out.bound_m[row] = [bound.at(pose, whole) for pose, whole in zip(poses, received.whole)]
        advance()
    return out


@dataclass
class _Bound:
    """The bound does not know of boxes: a lamp that one hides in part is kept from it."""

    scene: Scene
    rung: Rung | None
    of_lamps: dict[bytes, Scene] = field(default_factory=dict)

    def at(self, pose: Any, whole: NDArray[np.bool_]) -> float:
        if self.rung is None or not whole.any():
            return math.inf
        seen = self.of_lamps.get(whole.tobytes())
        if seen is None:
            lamps = [lamp for lamp, is_whole in zip(self.scene.lamps, whole) if is_whole]
            seen = self.of_lamps[whole.tobytes()] = self.scene.replace(lamps=lamps)
        covariance = pose_bound(seen, pose, self.rung, FluxModel.ignore).position_covariance_m2
        return math.sqrt(np.trace(covariance))
