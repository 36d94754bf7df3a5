# SPDX-License-Identifier: Apache-2.0
"""The tolerance from the conditioning bounds the effect of changed input, and is not much larger."""

import numpy as np
import pytest
from problems import problems

from libocc.cli.hard_cases.conditioning import EPSILON, Directions, cayley, hat, refined
from libocc.cli.hard_cases.oracle import three_points

CENTROID = np.array([0.1, 0.2, 4])


def seen_from(seed=1, points=5):
    """Directions at a random pose, with the world's points and the rotation."""
    rng = np.random.default_rng(seed)
    world = rng.normal(size=(points, 3))
    rotation = cayley(rng.normal(size=3).astype(np.longdouble))
    in_cam = (world - world.mean(0)) @ rotation.T.astype(float) + CENTROID
    bearings = in_cam / np.sqrt((in_cam**2).sum(1))[:, None]
    return Directions(bearings, world, rotation, CENTROID), world, rotation


def agrees(jacobian, seen):
    step = np.longdouble(1e-6)
    columns = [(seen.residuals(step * e) - seen.residuals(-step * e)) / (2 * step) for e in np.eye(6)]
    return np.abs(jacobian - np.array(columns).T.astype(float)).max() < 1e-10


@pytest.mark.parametrize("seed", range(5))
def test_the_jacobian_is_that_of_the_residuals(seed):
    seen, _, _ = seen_from(seed)
    assert agrees(seen.jacobian(), seen)
    wrong = seen.jacobian()
    wrong[:, :3] *= -1
    assert not agrees(wrong, seen)


def test_turn_is_the_rotation_by_its_vector():
    w = np.array([0.3, -0.2, 0.5], dtype=np.longdouble) * 1e-3
    assert np.abs(cayley(w) @ cayley(w).T - np.eye(3)).max() < 1e-15
    assert np.abs(cayley(w) - (np.eye(3) + hat(w) + hat(w) @ hat(w) / 2)).max() < 1e-9


def test_refined_returns_to_the_pose_that_fits():
    seen, world, rotation = seen_from()
    x = np.array([1, -2, 1, 3, 1, -1]) * np.longdouble(1e-6)
    truth = refined(seen.seen, world, rotation, CENTROID)
    again = refined(seen.seen, world, cayley(x[:3]) @ rotation, CENTROID + x[3:])
    assert np.abs(again.rotation - truth.rotation).max() < 1e-15
    assert np.abs(again.centroid_in_cam - truth.centroid_in_cam).max() < 1e-15


def test_error_is_rotation_or_relative_shift():
    seen, world, rotation = seen_from()
    truth = refined(seen.seen, world, rotation, CENTROID)

    def error(w, shift):
        pose = np.eye(4)
        turned = (cayley(np.asarray(w, dtype=np.longdouble)) @ rotation).astype(float)
        pose[:3, :3], pose[:3, 3] = turned, CENTROID + shift - turned @ world.mean(0)
        return truth.error(pose, world.astype(np.longdouble).mean(0))

    assert error([0, 0, 0], 0) < 1e-14
    assert error([0, 1e-4, 0], 0) == pytest.approx(1e-4, rel=1e-6)
    assert error([0, 0, 0], np.array([0, 0, 1e-4])) == pytest.approx(1e-4 / truth.distance, rel=1e-6)


@pytest.mark.parametrize(
    "name", ["ceiling_triple_tilted", "ceiling_triple_under_lamp", "danger_cylinder", "near_collinear",
             "telephoto_three", "weak_perspective_three", "depth_range_three"]
)
def test_a_change_of_the_bearings_moves_the_pose_as_far_as_is_allowed(name):
    """Each bearing turned by 1e4 roundings: the exact pose moves by about what that allows."""
    factor, rng = 1e4, np.random.default_rng(5)
    ratios = []
    for _, of_row in problems(name, 6):
        for instance in of_row:
            change = rng.normal(size=(3, 3)) * factor * EPSILON / 2
            both = [moved_by(instance, sign * change) for sign in (1, -1)]
            ratios.append(min(both) / instance.truth.allowed(factor))  # a double root may vanish in one
    assert len(ratios) >= 6 and 0.02 < np.median(ratios) < 2 and max(ratios) < 8


def moved_by(instance, change):
    """Error of the nearest exact pose for changed bearings."""
    centroid = instance.points.astype(np.longdouble).mean(0)
    nearest = np.inf
    for solution in three_points(instance.bearings + change, instance.points):
        pose = np.eye(4, dtype=np.longdouble)
        pose[:3, :3] = solution.pose.rotation
        pose[:3, 3] = solution.pose.centroid_in_cam - pose[:3, :3] @ centroid
        nearest = min(nearest, instance.truth.error(pose, centroid))
    return nearest
