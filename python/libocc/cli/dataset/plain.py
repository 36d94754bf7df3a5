# SPDX-License-Identifier: Apache-2.0
"""The plain layout: images/ and truth/, a file of each for a frame; the scene; the trajectory.

scene.yaml; trajectory.txt: the camera at each frame, at the beginning of its first row's exposure, in
TUM's format; libocc.json: the settings. Other layouts add to it.
"""

from collections.abc import Iterator
from typing import Any

from ..._core import Scene, Trajectory


class Plain:
    name = "plain"
    images = "images"
    formats: tuple[str, ...] = ("png", "pgm", "npy", "exr")

    def __init__(self, scene: Scene):
        self.scene = scene

    def image_name(self, index: int, ending: str) -> str:
        return f"{self.images}/{index:06d}.{ending}"

    def frame_files(self, truth: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
        """Beside image and truth."""
        yield from ()

    def entry(self, truth: dict[str, Any]) -> dict[str, Any]:
        """What set_files() needs of a frame."""
        return {key: truth[key] for key in ("frame", "time_s", "cam_from_world")}

    def set_files(self, entries: list[dict[str, Any]], ending: str) -> Iterator[tuple[str, bytes]]:
        """Of all frames that there are, by index."""
        yield "scene.yaml", self.scene.format().encode()
        poses = [entry["cam_from_world"] for entry in entries]
        trajectory = Trajectory([entry["time_s"] for entry in entries], poses)
        yield "trajectory.txt", trajectory.format().encode()
