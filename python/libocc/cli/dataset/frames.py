# SPDX-License-Identifier: Apache-2.0
"""Frames of a sequence and their rendering."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._core import Renderer, Scene, Trajectory
from .images import image_bytes
from .truth import frame_dict


@dataclass(frozen=True)
class Frame:
    """Description of one image; its values can be sent to another process."""

    scene: str  # content of a scene file
    index: int
    time_s: float
    cam_from_world: Any
    velocity: Any
    seed: int
    noise: bool
    image_format: str


def duration_s(scene: Scene) -> float:
    """Time from the start of the first row's exposure to the end of the last row's exposure [s]."""
    by_columns = scene.sensor.readout.name == "columns"
    lines = scene.camera.width if by_columns else scene.camera.height
    return (lines - 1) * scene.sensor.row_time_s + scene.sensor.exposure_s


def frames_of(
    scene: Scene, trajectory: Trajectory, fps: float, image_format: str = "png", seed: int = 0,
    noise: bool = True,
) -> list[Frame]:
    """All frames whose rows are exposed before the end of the trajectory; one frame for a single pose."""
    lasts_s = duration_s(scene)
    spare_s = trajectory.end_s - trajectory.begin_s - lasts_s
    still = len(trajectory) == 1
    if spare_s < 0 and not still:
        raise ValueError(f"must last at least one frame, {lasts_s:g} s")
    text = scene.format()
    count = 1 if still else int(np.floor(spare_s * fps * (1 + 1e-12))) + 1
    frames = []
    for i in range(count):
        time_s = trajectory.begin_s + i / fps
        to_s = time_s if still else min(time_s + lasts_s, trajectory.end_s)
        pose, velocity = trajectory.cam_from_world(time_s), trajectory.velocity(time_s, to_s)
        frames.append(Frame(text, i, time_s, pose, velocity, seed, noise, image_format))
    return frames


@functools.lru_cache(maxsize=1)
def renderer_of(scene: str) -> Renderer:
    """Renderer of a scene, kept for all frames of a process."""
    return Renderer(Scene.parse(scene))


def render_frame(frame: Frame) -> tuple[bytes, dict[str, Any]]:
    """Content of the image file, and the ground truth as plain data."""
    renderer = renderer_of(frame.scene)
    image, truth = renderer.render(
        frame.cam_from_world, seed=frame.seed, frame=frame.index, noise=frame.noise,
        start_s=frame.time_s, velocity=frame.velocity,
    )
    data = {"frame": frame.index, **frame_dict(renderer.scene, truth, frame.time_s, frame.velocity)}
    return image_bytes(image, frame.image_format), data
