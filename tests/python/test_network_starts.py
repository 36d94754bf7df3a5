# SPDX-License-Identifier: Apache-2.0
"""Start values of networks: relative orientation from bearings, resection and intersection in turn."""

import numpy as np
import pytest

import libocc as occ
from libocc.network import free_start, relative_orientation, start_values


def rotation(vector: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew)


def scene(seed: int, count: int, planar: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bearings in two images and the pose of the second in the first, with a baseline of 1."""
    random = np.random.default_rng(seed)
    points = random.uniform(-2, 2, (count, 3)) * [1, 1, 0 if planar else 1] + [0, 0, 5]
    pose = np.eye(4)
    pose[:3, :3] = rotation(random.normal(0, 0.3, 3) + [0, 0.1, 0])
    shift = random.normal(0, 1, 3) * [1, 1, 0.3]
    pose[:3, 3] = shift / np.linalg.norm(shift)
    seen = [points, points @ pose[:3, :3].T + pose[:3, 3]]
    a, b = (p / np.linalg.norm(p, axis=1, keepdims=True) for p in seen)
    return a, b, pose


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_relative_orientation_is_robust(seed: int, planar: bool) -> None:
    a, b, pose = scene(seed, 30, planar)
    random = np.random.default_rng(100 + seed)
    b = b + random.normal(0, 1e-4, b.shape)
    wrong = random.choice(30, 7, replace=False)
    b[wrong] += random.normal(0, 0.2, (7, 3))
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    found = relative_orientation(a, b)
    off = []
    for one in found:
        turn = one.second_from_first[:3, :3] @ pose[:3, :3].T
        along = np.clip(one.second_from_first[:3, 3] @ pose[:3, 3], -1, 1)
        off.append(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)) + np.arccos(along))
    assert found[int(np.argmin(off))].intersected >= 20 and min(off) < 0.1
    assert planar or off[0] < 0.1  # points of a plane have two poses


CAMERA = occ.Camera.pinhole(width=640, height=480, fx_px=500, fy_px=500, cx_px=319.5, cy_px=239.5)


def pixels(bearings: np.ndarray) -> dict[int, np.ndarray]:
    return {k: np.asarray(CAMERA.project(bearing)) for k, bearing in enumerate(bearings)}


def test_images_alone_give_poses_and_positions() -> None:
    a, b, pose = scene(2, 12)
    found = free_start([CAMERA] * 2, [pixels(a), pixels(b)])
    assert found is not None
    poses, points = found
    assert sorted(poses) == [0, 1] and sorted(points) == list(range(12))
    between = poses[1] @ np.linalg.inv(poses[0])
    assert np.abs(between - pose).max() < 1e-5
    known = {k: points[k] for k in range(6)}
    again, extended = start_values([CAMERA] * 2, [pixels(a), pixels(b)], known)
    assert np.abs(again[1] - poses[1]).max() < 1e-5 and np.abs(extended[11] - points[11]).max() < 1e-5


def test_no_orientation_without_enough_points_or_without_a_baseline() -> None:
    a, b, _ = scene(1, 5)
    assert relative_orientation(a[:3], b[:3]) == []
    with pytest.raises(ValueError, match="size of first"):
        relative_orientation(a, b[:4])
    a, _, pose = scene(1, 20)
    assert free_start([CAMERA] * 2, [pixels(a), pixels(a @ pose[:3, :3].T)]) is None
