# SPDX-License-Identifier: Apache-2.0
"""Rendered pictures of a room for surveys."""

from collections.abc import Sequence
from pathlib import Path

import libocc as occ
from libocc.cli.poses import upward_pose

Place = tuple[float, float, float, float]  # x, y, z [m], heading [deg]


def rendered_pictures(scene: occ.Scene, places: Sequence[Place], folder: Path) -> list[Path]:
    names = []
    for i, (x, y, z, heading) in enumerate(places):
        image, _ = occ.simulate(scene, upward_pose([x, y, z], heading, 4.0 * (i % 3), 70.0 * i), seed=i)
        names.append(folder / f"p{i}.png")
        occ.write_image(names[-1], image)
    return names
