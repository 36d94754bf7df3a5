# SPDX-License-Identifier: Apache-2.0
"""Plain layout: images/ and truth/ with one file per frame, and files of the whole set.

scene.yaml is the scene. trajectory.txt has the camera's pose at the start of the first row's exposure of each frame, in
TUM format. libocc.json has the settings. Other layouts extend this one.
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
        """Additional files of a frame."""
        yield from ()

    def entry(self, truth: dict[str, Any]) -> dict[str, Any]:
        """Data of a frame for set_files()."""
        return {key: truth[key] for key in ("frame", "time_s", "cam_from_world")}

    def set_files(self, entries: list[dict[str, Any]], ending: str) -> Iterator[tuple[str, bytes]]:
        """Files of the whole set; entries: of all existing frames by index."""
        yield "scene.yaml", self.scene.format().encode()
        poses = [entry["cam_from_world"] for entry in entries]
        trajectory = Trajectory([entry["time_s"] for entry in entries], poses)
        yield "trajectory.txt", trajectory.format().encode()
