# SPDX-License-Identifier: Apache-2.0
"""Start values of networks: relative orientation from bearings, resection and intersection in turn."""

import numpy as np
import pytest

from libocc.network.relative import depths, five_point, poses_of, relative_orientation, start_pair


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


@pytest.mark.parametrize("seed", range(20))
def test_five_pairs_of_bearings_have_the_essential_matrix_among_their_solutions(seed: int) -> None:
    a, b, pose = scene(seed, 5)
    x, y, z = pose[:3, 3]
    expected = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ pose[:3, :3]
    expected /= np.linalg.norm(expected)
    solutions = five_point(a, b)
    for essential in solutions:
        assert np.abs(np.einsum("ni,ij,nj->n", b, essential, a)).max() < 1e-8
        singular = np.linalg.svd(essential)[1]
        assert singular[2] < 1e-6 and singular[0] - singular[1] < 1e-6
    assert min(min(np.linalg.norm(e - expected), np.linalg.norm(e + expected)) for e in solutions) < 1e-6
    poses = [p for e in solutions for p in poses_of(e)]
    assert min(np.linalg.norm(p - pose[:3]) for p in poses) < 1e-5


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
        turn = one.pose[:3, :3] @ pose[:3, :3].T
        off.append(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)) + np.arccos(one.pose[:3, 3] @ pose[:3, 3]))
    assert found[int(np.argmin(off))].intersected >= 20 and min(off) < 0.1
    assert planar or off[0] < 0.1  # points of a plane have two poses


def test_depths_are_distances_along_the_bearings() -> None:
    a, b, pose = scene(3, 10)
    along_a, along_b = depths(pose[:3], a, b)
    assert np.allclose(along_a[:, None] * a @ pose[:3, :3].T + pose[:3, 3], along_b[:, None] * b)


def test_no_orientation_without_enough_points_or_without_a_baseline() -> None:
    a, b, _ = scene(1, 5)
    assert relative_orientation(a, b) == []
    a, _, pose = scene(1, 20)
    turned = a @ pose[:3, :3].T
    assert start_pair([dict(enumerate(a)), dict(enumerate(turned))]) is None
