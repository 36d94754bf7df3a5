# SPDX-License-Identifier: Apache-2.0
"""Simulated images on which every rung is measured."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libocc as occ

MAX_DRAWS = 200  # random views until one shows all lamps
RIM_POINTS = 16
MARGIN_PX = 3.0  # around a lamp's rim, for its blur


def noisier(sensor: occ.Sensor, factor: float) -> occ.Sensor:
    """Sensor whose noise in grey levels is `factor` times as large at the same brightness of the image.

    The relative shot noise is 1 / sqrt(electrons): the number of electrons is divided by factor^2 and the gain is
    multiplied by factor^2. The quantisation noise is unchanged.
    """
    if not factor > 0:
        raise ValueError(f"noise must be positive, got {factor}")
    fewer = factor**2
    return sensor.replace(
        exposure_s=sensor.exposure_s / fewer,
        full_well_e=sensor.full_well_e / fewer,
        gain_dn_per_e=sensor.gain_dn_per_e * fewer,
        dark_current_e_per_s=sensor.dark_current_e_per_s,
        read_noise_e=sensor.read_noise_e / factor,
    )


@dataclass(frozen=True)
class Experiment:
    """Random views of a scene from the distance `range_m`, at the angle `tilt_deg` to the lamps' mean normal."""

    scene: occ.Scene
    range_m: float = 2.5  # from the lamps' centroid
    tilt_deg: float = 10.0  # between the line of sight and the normal; its azimuth is random
    seed: int = 0

    def pose(self, frame: int) -> NDArray[np.float64]:
        """cam_from_world of a frame: faces the lamps' centroid with a random rotation about the optical axis.

        Raises: ValueError when no such view shows all lamps.
        """
        random = np.random.default_rng([self.seed, frame])
        centres = np.array([lamp.centre_m for lamp in self.scene.lamps])
        centroid = centres.mean(axis=0)
        normal = np.mean([lamp.normal for lamp in self.scene.lamps], axis=0)
        length = np.linalg.norm(normal)
        normal = normal / length if length > 1e-6 else np.array([0.0, 0.0, -1.0])
        for _ in range(MAX_DRAWS):
            away = _perpendicular(normal, random)
            tilt = np.radians(self.tilt_deg)
            direction = np.cos(tilt) * normal + np.sin(tilt) * away
            position = centroid + self.range_m * direction
            up = _perpendicular(direction, random)
            pose: NDArray[np.float64] = occ.look_at(position, centroid, up)
            if self._shows_all(pose):
                return pose
        raise ValueError(
            f"no view from {self.range_m:g} m tilted by {self.tilt_deg:g} degrees shows all of the "
            f"{len(centres)} lamps completely: increase the range or use fewer lamps"
        )

    def _shows_all(self, pose: Any) -> bool:
        camera = self.scene.camera
        last = np.array([camera.width, camera.height]) - 1 - MARGIN_PX
        for lamp in self.scene.lamps:
            rim = occ.rendering.project_rim(lamp, pose, camera, RIM_POINTS)
            if rim is None or (rim < MARGIN_PX).any() or (rim > last).any():
                return False
        return True

    def image(self, frame: int, pose: Any) -> Any:
        return occ.simulate(self.scene, pose, seed=self.seed, frame=frame)[0]


def _perpendicular(axis: Any, random: np.random.Generator) -> NDArray[np.float64]:
    """Random unit vector perpendicular to an axis."""
    vector = random.normal(size=3)
    vector -= (vector @ axis) * axis
    return np.asarray(vector / np.linalg.norm(vector))
