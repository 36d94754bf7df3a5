# SPDX-License-Identifier: Apache-2.0
"""The images that every rung is measured on."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libocc as occ

MOST_DRAWS = 200  # views tried until one shows every lamp
RIM_POINTS = 16
MARGIN_PX = 3.0  # around a lamp's rim: its blur is in the image, too


def noisier(sensor: occ.Sensor, factor: float) -> occ.Sensor:
    """A sensor whose noise is `factor` times as large in grey levels, the image being as bright.

    Shot noise follows from the number of electrons: there are factor^2 times fewer of them, and each
    makes as many more grey levels. Rounding to grey levels stays.
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
    """Views of a scene from `range_m`, around the lamps' common normal by `tilt_deg`."""

    scene: occ.Scene
    range_m: float = 2.5  # from the lamps' centroid
    tilt_deg: float = 10.0  # between the line of sight and the normal; its azimuth is random
    seed: int = 0

    def pose(self, frame: int) -> NDArray[np.float64]:
        """cam_from_world of a frame: looks at the lamps' centroid, turned at random about the line
        of sight. Raises: ValueError when no such view shows all lamps."""
        random = np.random.default_rng([self.seed, frame])
        centres = np.array([lamp.centre_m for lamp in self.scene.lamps])
        centroid = centres.mean(axis=0)
        normal = np.mean([lamp.normal for lamp in self.scene.lamps], axis=0)
        length = np.linalg.norm(normal)
        normal = normal / length if length > 1e-6 else np.array([0.0, 0.0, -1.0])
        for _ in range(MOST_DRAWS):
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
            f"{len(centres)} lamps whole: go farther, or take fewer"
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
    """A random unit vector across an axis."""
    vector = random.normal(size=3)
    vector -= (vector @ axis) * axis
    return np.asarray(vector / np.linalg.norm(vector))
