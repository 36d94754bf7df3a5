# SPDX-License-Identifier: Apache-2.0
"""The oracle against closed forms, and against the poses that problems were made from."""

from decimal import Decimal

import numpy as np
import pytest

from libocc.cli.hard_cases import exact as ex
from libocc.cli.hard_cases.clouds import cloud
from libocc.cli.hard_cases.oracle import three_points
from libocc.cli.hard_cases.triangles import danger_cylinder


def triangle(a: float, b: float, c: float) -> np.ndarray:
    """Points with |P2 - P3| = a, |P1 - P3| = b, |P1 - P2| = c."""
    x = (b * b + c * c - a * a) / (2 * c)
    return np.array([[0, 0, 0], [c, 0, 0], [x, np.sqrt(b * b - x * x), 0]])


def cone(cosine: float) -> np.ndarray:
    """Three unit bearings with that cosine between any two."""
    sine = np.sqrt((1 - cosine) * 2 / 3)
    angles = np.array([0, 2, 4]) * np.pi / 3
    flat = np.stack([sine * np.cos(angles), sine * np.sin(angles), np.full(3, np.sqrt(1 - sine**2))])
    return flat.T


def test_bearings_at_right_angles_leave_one_pose():
    a, b, c = 1.1, 1.3, 0.9
    wanted = np.sqrt([(b * b + c * c - a * a) / 2, (a * a + c * c - b * b) / 2, (a * a + b * b - c * c) / 2])
    (only,) = three_points(np.eye(3), triangle(a, b, c))
    assert only.real and np.abs(np.array(only.depths) / wanted - 1).max() < 1e-14


@pytest.mark.parametrize("cosine", [0.55, 0.8, 0.99, 0.9999])
def test_equilateral_from_its_axis_has_four_poses(cosine):
    solutions = three_points(cone(cosine), triangle(1, 1, 1))
    found = sorted((np.round(s.depths, 9).tolist(), s.depths) for s in solutions)
    far, near = 1 / np.sqrt(2 * (1 - cosine)), (2 * cosine - 1) / np.sqrt(2 * (1 - cosine))
    wanted = sorted([(far, far, far), (near, far, far), (far, near, far), (far, far, near)])
    depths = np.array([exact for _, exact in found])
    assert np.abs(depths / wanted - 1).max() < 1e-14 / (1 - cosine)


def test_equilateral_from_its_axis_nearby_has_one_pose():
    (only,) = three_points(cone(0.3), triangle(1, 1, 1))
    assert np.allclose(only.depths, 1 / np.sqrt(1.4), rtol=1e-14)


def test_the_pose_a_problem_was_made_from_is_found():
    for seed in range(60):
        with ex.digits():
            view = cloud(np.random.default_rng(seed), 3)
            bearings, points = view.arrays()
            rotation, centroid = ex.rounded(view.rotation), ex.rounded(view.in_cam().sum(0) / 3)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, centroid - rotation @ points.mean(0)
        found = [s.pose for s in three_points(bearings, points)]
        errors = [known.error(pose, points.mean(0)) / known.allowed(8) for known in found]
        assert 1 <= len(errors) <= 4 and min(errors) < 1
        assert sorted(errors)[1:] == [] or sorted(errors)[1] > 1e3, "the others are other poses"


def test_every_pose_reproduces_the_bearings():
    for seed in range(30):
        with ex.digits():
            bearings, points = cloud(np.random.default_rng(seed), 3).arrays()
        for solution in three_points(bearings, points):
            arms = points - points.astype(np.longdouble).mean(0)
            in_cam = arms @ solution.pose.rotation.T + solution.pose.centroid_in_cam
            depth = np.sqrt((in_cam**2).sum(1))
            length = np.sqrt((bearings.astype(np.longdouble) ** 2).sum(1))
            assert np.abs(in_cam / depth[:, None] - bearings / length[:, None]).max() < 1e-17
            assert np.allclose(depth.astype(float), solution.depths, rtol=1e-14)


def test_order_of_the_points_does_not_matter():
    with ex.digits():
        bearings, points = cloud(np.random.default_rng(3), 3).arrays()
    wanted = sorted(sorted(s.depths) for s in three_points(bearings, points))
    for order in ([1, 0, 2], [2, 0, 1], [1, 2, 0]):
        turned = sorted(sorted(s.depths) for s in three_points(bearings[order], points[order]))
        assert np.allclose(turned, wanted, rtol=1e-15)


@pytest.mark.parametrize("aside, double", [(0, True), (1e-9, True), (1e-3, False)])
def test_the_danger_cylinder_has_a_double_root(aside, double):
    for seed in range(10):
        with ex.digits():
            view = danger_cylinder(np.random.default_rng(seed), 3, aside)
            bearings, points = view.arrays()
            centroid = ex.long(view.in_cam().sum(0) / 3)
        found = three_points(bearings, points)
        own = min(found, key=lambda s: np.abs((s.pose.centroid_in_cam - centroid).astype(float)).max())
        assert own.is_double() == double
        assert (own.pose.condition > 1e7) == double and own.pose.allowed(64) < 1e-5


def test_no_pose_for_points_on_a_line_or_coincident_or_for_bearings_that_fit_nothing():
    bearings = cone(0.9)
    assert three_points(bearings, np.array([[0, 0, 1.0], [1, 0, 1], [3, 0, 1]])) == []
    assert three_points(bearings, np.array([[0, 0, 1.0], [0, 0, 1], [3, 0, 1]])) == []
    narrow = np.array([[0, 0, 1], [1e-3, 0, 1], [1, 0, 0]], dtype=float)
    narrow /= np.linalg.norm(narrow, axis=1)[:, None]
    assert three_points(narrow, triangle(0.1, 0.1, 0.19)) == []


def test_roots_of_known_polynomials():
    with ex.digits():
        third = Decimal(1) / 3

        def with_roots(*roots):
            out = [Decimal(1)]
            for root in roots:
                out = [a - root * b for a, b in zip([*out, ex.ZERO], [ex.ZERO, *out])]
            return out

        close = third + Decimal("1e-40")
        found, slopes, *_ = ex.positive_roots(with_roots(third, close, Decimal(2), Decimal(-5)))
        assert [abs(x - y) < Decimal("1e-50") for x, y in zip(found, [third, close, 2])] == [True] * 3
        assert third < slopes[0] < close < slopes[1] < 2
        _, slopes, *_ = ex.positive_roots(with_roots(third, third))
        assert len(slopes) == 1 and abs(slopes[0] - third) < Decimal("1e-90")
        assert ex.positive_roots([ex.ONE, ex.ZERO, ex.ONE])[0] == []
        assert ex.positive_roots([ex.ZERO, ex.ZERO]) == [[]]
