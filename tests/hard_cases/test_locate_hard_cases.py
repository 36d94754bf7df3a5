# SPDX-License-Identifier: Apache-2.0
"""The whole way, image to pose, on those hard cases that a camera can take a picture of."""

import numpy as np
import pytest
from problems import CASES, problems

import libocc as occ

SIDE_PX, FILLED_PX, LARGEST_PX = 480, 180, 8.0
NEAREST_PX = 24  # lamps that are closer in the image run into each other
WIDEST_PX = 150  # focal length of the widest lens, which sees 50 degrees off its axis
NOT_OF_ITS_BEARINGS = {"mismatched", "bad_input", "grazing"}  # or with a lamp beside the camera
NAMED = [
    name for name, case in CASES.items()
    if case.generator not in NOT_OF_ITS_BEARINGS and "behind" not in case.parameters and case.points != 2
]


def photographed(instance):
    """Scene and image: discs that face a camera whose focal length has them fill its image."""
    pose, seen = instance.nominal, instance.bearings
    position = -pose[:3, :3].T @ pose[:3, 3]
    if (seen[:, 2] < 0.2).any():
        return None
    across = seen[:, :2] / seen[:, 2:]
    focal = FILLED_PX / np.abs(across).max(initial=0.1)
    apart = np.linalg.norm(across[:, None] - across[None], axis=2) * focal
    nearest = apart[~np.eye(len(apart), dtype=bool)].min(initial=np.inf)
    if nearest < NEAREST_PX or focal < WIDEST_PX:
        return None
    lamps = []
    for i, (point, bearing) in enumerate(zip(instance.points, seen)):
        across_rad = min(LARGEST_PX, nearest / 5) / focal * bearing[2] ** 2  # no larger off the axis
        radius = across_rad * np.linalg.norm(point - position)
        lamps.append(
            occ.Lamp(id=i, centre_m=point, normal=position - point, radius_m=radius, power_w=200 * radius**2)
        )
    middle = (SIDE_PX - 1) / 2
    camera = occ.Camera.pinhole(
        width=SIDE_PX, height=SIDE_PX, fx_px=focal, fy_px=focal, cx_px=middle, cy_px=middle
    )
    scene = occ.Scene(camera=camera, lamps=lamps)
    return scene, occ.simulate(scene, pose, seed=1)[0], position


def is_right(candidate, position, distance):
    """Within six sigma, or half a percent of the distance: another pose is farther than that."""
    off = candidate.position_m - position
    squared = off @ np.linalg.solve(candidate.position_covariance_m2, off)
    return squared < 36 or np.linalg.norm(off) < 5e-3 * distance


ROWS = [pytest.param(name, row, id=f"{name} {row}".strip()) for name in NAMED for row, _ in CASES[name].rows()]


@pytest.mark.parametrize("name, row", ROWS)
def test_locate_is_correct_or_reports_a_problem(name, row):
    taken = found = 0
    for instance in dict(problems(name, 8))[row]:
        picture = photographed(instance)
        if picture is None:
            continue
        scene, image, position = picture
        taken += 1
        fix = occ.locate(image, scene)
        if fix.status not in (occ.Status.ok, occ.Status.ambiguous):
            continue
        assert CASES[name].verdict == "solved", f"{fix.status} where no pose is determined"
        found += 1
        distance = np.linalg.norm(instance.points.mean(0) - position)
        assert any(is_right(c, position, distance) for c in fix.candidates), fix.message or fix.status
    if not taken:
        pytest.skip("the lamps are too close to each other, or not in front of the camera")
    if CASES[name].verdict == "solved" and CASES[name].points > 3:
        assert found >= taken / 2
