# SPDX-License-Identifier: Apache-2.0
"""Received power, visible lamps and the Cramer-Rao bound of the position over a horizontal plane."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import Camera, FluxModel, Rung, Scene, dbm, pose_bound, received_power

__all__ = ["Plane", "PowerMap", "looking_up", "plane_of", "power_map", "with_focal_length"]

MAX_POINTS = 4_000_000  # limits the memory of the arrays


@dataclass(frozen=True)
class Plane:
    """Grid of camera positions at one height, along the world's x and y axes."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    height_m: float


def plane_of(
    scene: Scene,
    height_m: float | None = None,
    step_m: float = 0.05,
    extent_m: Sequence[float] | None = None,
) -> Plane:
    """Grid over a horizontal plane; its first point is the lower corner of the extent.

    height_m: default half the height of the room. extent_m: (x0, x1, y0, y1), default the floor of the room.
    Raises: ValueError naming the argument that is outside the room, not positive or missing.
    """
    if not (step_m > 0 and math.isfinite(step_m)):
        raise ValueError(f"step_m must be positive, got {step_m}")
    if scene.room is not None:
        width, depth, top = map(float, scene.room.size_m)
        height_m = top / 2 if height_m is None else height_m
        extent_m = (0.0, width, 0.0, depth) if extent_m is None else extent_m
    if height_m is None or extent_m is None:
        raise ValueError("height_m and extent_m must be given because the scene has no room")
    x0, x1, y0, y1 = _checked_extent(extent_m)
    if not math.isfinite(height_m):
        raise ValueError(f"height_m must be finite, got {height_m}")
    if scene.room is not None:
        if not 0 <= height_m <= top:
            raise ValueError(f"height_m must be inside the room, 0 to {top:g}, got {height_m:g}")
        if min(x0, y0) < 0 or x1 > width or y1 > depth:
            raise ValueError(f"extent_m must be inside the room, 0 {width:g} 0 {depth:g}, got {tuple(extent_m)}")
    columns, rows = (math.floor((high - low) / step_m + 1e-9) + 1 for low, high in ((x0, x1), (y0, y1)))
    if columns * rows > MAX_POINTS:
        raise ValueError(f"step_m must give at most {MAX_POINTS} points, got {step_m:g} and {columns * rows} points")
    x_m, y_m = (low + float(step_m) * np.arange(count, dtype=float) for low, count in ((x0, columns), (y0, rows)))
    return Plane(x_m, y_m, float(height_m))


def _checked_extent(extent_m: Sequence[float]) -> tuple[float, float, float, float]:
    if len(extent_m) == 4 and all(map(math.isfinite, extent_m)):
        x0, x1, y0, y1 = map(float, extent_m)
        if x0 <= x1 and y0 <= y1:
            return x0, x1, y0, y1
    raise ValueError(f"extent_m must be (x0, x1, y0, y1) with x0 <= x1, y0 <= y1, got {tuple(extent_m)}")


def checked_rotation(rotation_deg: Sequence[float]) -> tuple[float, float, float]:
    """(roll, pitch, yaw) as floats. Raises: ValueError unless these are three finite numbers."""
    if len(rotation_deg) != 3 or not all(map(math.isfinite, rotation_deg)):
        raise ValueError(f"rotation_deg must be roll, pitch and yaw, got {tuple(rotation_deg)}")
    roll, pitch, yaw = map(float, rotation_deg)
    return roll, pitch, yaw


def looking_up(position_m: Any, rotation_deg: Sequence[float] = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
    """cam_from_world (..., 4, 4) of cameras at positions (..., 3) that face up and are then rotated.

    Without rotation the camera axes are those of the world: image +x is +x, image +y is +y, the optical axis is +z.
    rotation_deg: (roll, pitch, yaw), right-handed rotations about the world's x, then y, then z axis:
    world_from_cam = Rz(yaw) Ry(pitch) Rx(roll). A positive roll tilts the optical axis towards -y, a positive pitch
    towards +x.
    """
    position = np.asarray(position_m, dtype=float)
    roll, pitch, yaw = np.radians(checked_rotation(rotation_deg))
    cam_from_world = (_rotation(2, yaw) @ _rotation(1, pitch) @ _rotation(0, roll)).T
    poses = np.zeros((*position.shape[:-1], 4, 4))
    poses[..., :3, :3] = cam_from_world
    # The matrix product @ is not used: its rounding depends on the number of positions.
    poses[..., :3, 3] = -(position[..., None, :] * cam_from_world).sum(axis=-1)
    poses[..., 3, 3] = 1
    return poses


def _rotation(axis: int, angle_rad: float) -> NDArray[np.float64]:
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[a, a] = matrix[b, b] = math.cos(angle_rad)
    matrix[b, a] = math.sin(angle_rad)
    matrix[a, b] = -matrix[b, a]
    return matrix


def focal_length_mm(scene: Scene) -> float:
    return 1e3 * scene.camera.fx_px * scene.sensor.pixel_pitch_m


def with_focal_length(scene: Scene, focal_mm: float) -> Scene:
    """Scene with another focal length; f-number and distortion coefficients are unchanged."""
    if not (focal_mm > 0 and math.isfinite(focal_mm)):
        raise ValueError(f"focal_mm must be positive, got {focal_mm}")
    c = scene.camera
    scale = focal_mm / focal_length_mm(scene)
    return scene.replace(
        camera=Camera.pinhole(
            width=c.width, height=c.height, fx_px=scale * c.fx_px, fy_px=scale * c.fy_px, cx_px=c.cx_px,
            cy_px=c.cy_px, distortion=c.distortion, skew_px=scale * c.skew_px,
        )
    )


@dataclass(frozen=True)
class PowerMap:
    """Arrays over a plane; the first axis is y, the second x."""

    scene: Scene  # with the requested focal length
    plane: Plane
    rotation_deg: tuple[float, float, float]  # roll, pitch, yaw: see looking_up()
    rung: Rung | None  # observations of the bound
    lamp_power_w: NDArray[np.float64]  # (ny, nx, lamps), in the order of the scene
    whole: NDArray[np.bool_]  # (ny, nx, lamps): the lamp is completely visible
    visible: NDArray[np.int32]  # number of lamps of which light arrives
    bound_m: NDArray[np.float64]  # bound of the position: root of the covariance's trace; infinite: no bound

    @property
    def focal_mm(self) -> float:
        """Focal length [mm]."""
        return focal_length_mm(self.scene)

    @property
    def power_w(self) -> NDArray[np.float64]:
        """(ny, nx) power of all lamps [W]."""
        return np.asarray(self.lamp_power_w.sum(axis=-1))

    @property
    def power_dbm(self) -> NDArray[np.float64]:
        """(ny, nx) power of all lamps [dBm]; minus infinity without light."""
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
    """Received power, visible lamps and position bound of the scene's camera over a horizontal plane.

    height_m, step_m, extent_m: grid, by default over the room at half its height. rotation_deg: (roll, pitch, yaw) of
    the camera from facing up, see maps.looking_up(). focal_mm: replaces the focal length of the scene. rung:
    observations of the Cramer-Rao bound; None computes no bound, which is faster. advance: called after each row.
    Raises: ValueError naming the invalid argument.
    """
    plane = plane_of(scene, height_m, step_m, extent_m)
    rotation = checked_rotation(rotation_deg)
    if focal_mm is not None:
        scene = with_focal_length(scene, focal_mm)
    bound = _Bound(scene, rung)
    shape = len(plane.y_m), len(plane.x_m)
    out = PowerMap(
        scene, plane, rotation, rung, np.zeros((*shape, len(scene.lamps))),
        np.zeros((*shape, len(scene.lamps)), bool), np.zeros(shape, np.int32), np.full(shape, math.inf),
    )
    for row, y_m in enumerate(plane.y_m):
        position_m = np.stack(np.broadcast_arrays(plane.x_m, y_m, plane.height_m), axis=-1)
        poses = looking_up(position_m, rotation)
        received = received_power(scene, poses)
        out.lamp_power_w[row], out.whole[row] = received.lamp_power_w, received.whole
        out.visible[row] = received.visible
        out.bound_m[row] = [bound.at(pose, whole) for pose, whole in zip(poses, received.whole)]
        advance()
    return out


@dataclass
class _Bound:
    """Bound from the completely visible lamps only: pose_bound() ignores boxes, which may hide a part of a lamp."""

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
