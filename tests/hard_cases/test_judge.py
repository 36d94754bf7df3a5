# SPDX-License-Identifier: Apache-2.0
"""The judge itself, with answers made up to be right, wrong, incomplete and not even numbers."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from problems import CASES, problems

from libocc.cli.hard_cases import show
from libocc.cli.hard_cases.judge import Outcome, judge, misfit_rad
from libocc.cli.hard_cases.matrix import Cell, by_case, own_harmless, run
from libocc.cli.hard_cases.methods import Answer, Method


def pose_of(reference, instance):
    """4x4 of a reference, in double."""
    pose = np.eye(4)
    pose[:3, :3] = reference.rotation
    pose[:3, 3] = (reference.centroid_in_cam - reference.rotation @ instance.points.mean(0)).astype(float)
    return pose


def moved(pose, turn_rad):
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    around = np.eye(4)
    around[:2, :2] = [[c, -s], [s, c]]
    return around @ pose


@pytest.fixture
def several():
    """A problem of three points with more than one pose, and all of them."""
    case = CASES["ceiling_triple_tilted"]
    instance = next(i for _, row in problems(case.name) for i in row if len(i.solutions) >= 3)
    return case, instance, [pose_of(s.pose, instance) for s in instance.solutions]


def outcome(case, instance, *poses):
    return judge(case, instance, Answer(tuple(poses))).outcome


def test_all_poses_in_any_order_are_solved(several):
    case, instance, poses = several
    for answer in (poses, poses[::-1], [*poses, poses[0]]):
        judgement = judge(case, instance, Answer(tuple(answer)))
        assert judgement.outcome is Outcome.solved and judgement.right and judgement.over_allowed < 1


def test_a_missing_pose_is_dropped(several):
    case, instance, poses = several
    for i in range(len(poses)):
        judgement = judge(case, instance, Answer(tuple(poses[:i] + poses[i + 1 :])))
        assert judgement.outcome is Outcome.dropped and not judgement.right


def test_one_pose_that_does_not_fit_is_wrong(several):
    case, instance, poses = several
    assert outcome(case, instance, *poses, moved(poses[0], 1e-5)) is Outcome.wrong
    assert outcome(case, instance, np.eye(4)) is Outcome.wrong
    mirrored = np.diag([-1.0, -1, -1, 1]) @ poses[0]
    assert outcome(case, instance, *poses, mirrored) is Outcome.wrong


def test_a_matrix_that_is_not_a_rotation_is_wrong(several):
    case, instance, poses = several
    scaled = poses[0].copy()
    scaled[:3] *= 2  # reproduces the bearings all the same
    assert misfit_rad(instance, scaled) < 1e-12
    assert outcome(case, instance, *poses, scaled) is Outcome.wrong


def test_numbers_that_are_not_finite_are_nan_whatever_else_there_is(several):
    case, instance, poses = several
    for value in (np.nan, np.inf):
        spoilt = poses[0].copy()
        spoilt[1, 3] = value
        assert outcome(case, instance, *poses, spoilt) is Outcome.nan
        assert outcome(case, instance, spoilt, np.eye(4)) is Outcome.nan


def test_a_pose_that_fits_but_is_too_far_is_inexact():
    case = CASES["ceiling_square_tilted"]
    (_, (instance, *_)), = problems(case.name)
    pose = pose_of(instance.truth, instance)
    assert outcome(case, instance, pose) is Outcome.solved
    assert outcome(case, instance, moved(pose, 1e-4)) is Outcome.wrong
    case = CASES["weak_perspective_four"]
    instance = problems(case.name)[1][1][0]
    away = next(a for a in np.geomspace(1e-9, 1, 200) if misfit_rad(instance, tilted(instance, a)) > 3e-7)
    assert outcome(case, instance, tilted(instance, away)) is Outcome.inexact
    assert outcome(case, instance, pose_of(instance.truth, instance)) is Outcome.solved


def tilted(instance, angle_rad):
    """The truth turned about the points' centroid, across the line of sight."""
    pose = pose_of(instance.truth, instance)
    centre = pose[:3, :3] @ instance.points.mean(0) + pose[:3, 3]
    axis = np.cross(centre, [1.0, 0, 0]) / np.linalg.norm(np.cross(centre, [1.0, 0, 0]))
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(angle_rad) * k + (1 - np.cos(angle_rad)) * k @ k
    pose[:3, :3] = turn @ pose[:3, :3]
    pose[:3, 3] = turn @ (pose[:3, 3] - centre) + centre
    return pose


def test_an_error_within_conditioning_is_solved_and_measured(several):
    case, instance, poses = several
    off = [moved(pose, 1e-9) for pose in poses]
    judgement = judge(case, instance, Answer(tuple(off)))
    assert judgement.outcome is Outcome.solved and judgement.over_allowed > 100


def test_no_pose_is_right_only_if_no_solution_exists():
    for name, right in (("ceiling_triple_tilted", False), ("no_triangle", True), ("collinear_six", True),
                        ("bad_numbers_three", True), ("two_points", True)):
        instance = problems(name)[0][1][0]
        for answer in (Answer(), Answer(raised="ValueError: no")):
            judgement = judge(CASES[name], instance, answer)
            assert judgement.outcome is Outcome.refused and judgement.right == right, name


def test_any_pose_of_an_undetermined_problem_is_wrong():
    for name in ("no_triangle", "collinear_three", "duplicates_three", "bad_numbers_six",
                 "behind_camera_six"):
        instance = problems(name)[0][1][0]
        assert outcome(CASES[name], instance, instance.nominal) is Outcome.wrong, name


def test_verdict_either_accepts_only_fitting_poses():
    case = CASES["behind_camera_three"]
    of_row = problems(case.name)[0][1]
    possible = next(i for i in of_row if i.solutions)
    none = next(i for i in of_row if not i.solutions)
    fitting = [pose_of(s.pose, possible) for s in possible.solutions]
    assert outcome(case, possible, *fitting) is Outcome.solved
    assert not judge(case, possible, Answer()).right and judge(case, none, Answer()).right
    assert outcome(case, none, none.nominal) is Outcome.wrong


def test_two_points_count_only_with_the_true_pose():
    case = CASES["two_points"]
    instance = problems(case.name)[0][1][0]
    assert outcome(case, instance, pose_of(instance.truth, instance)) is Outcome.solved
    line = instance.points[1] - instance.points[0]
    k = line / np.linalg.norm(line)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    turn = np.eye(3) + np.sin(0.5) * cross + (1 - np.cos(0.5)) * cross @ cross
    other = np.eye(4)
    other[:3, :3], other[:3, 3] = turn, instance.points[0] - turn @ instance.points[0]
    other = pose_of(instance.truth, instance) @ other
    assert misfit_rad(instance, other) < 1e-12 and outcome(case, instance, other) is Outcome.wrong


def test_the_matrix_counts_and_widens():
    case = replace(CASES["ceiling_triple_tilted"], count=4)
    lazy = Method("p3p", "libocc", lambda instance: [])
    spoilt = Method("auto", "libocc", lambda instance: [np.full((4, 4), np.nan)])
    four = Method("four", "peer", lambda instance: [], 4)
    calls = []
    cells = run([case], [lazy, spoilt, four], advance=lambda: calls.append(1))
    assert len(calls) == 1 and [c.method for c in cells] == ["p3p", "auto"]
    assert cells[0].counts == Counter({Outcome.refused: 4}) and cells[0].right == 0
    assert own_harmless(cells[:1]) and not own_harmless(cells)
    (both,) = by_case([cells[0], replace(cells[0], row="again")])
    assert both.total == 8 and both.worst is Outcome.refused
    assert show.text_of(cells[1]) == "N" and show.share_of(cells[0]) == {show.Show.refused: 1.0}


def test_an_exception_counts_as_a_refusal():
    def fails(instance):
        raise RuntimeError("no\nluck")

    answer = Method("m", "peer", fails).answer(problems("two_points")[0][1][0])
    assert answer == Answer(raised="RuntimeError: no luck")


def test_shares_and_signs_of_a_mixed_cell():
    counts = Counter({Outcome.solved: 3, Outcome.refused: 4, Outcome.wrong: 1})
    cell = Cell("c", "", "m", "f", counts, right=4, refused_rightly=1)
    shares = show.share_of(cell)
    assert shares[show.Show.refused] == 3 / 8 and shares[show.Show.refused_rightly] == 1 / 8
    assert sum(shares.values()) == 1 and show.text_of(cell) == "×12" and "red" in show.style_of(cell)
    signs = [s.sign for s in show.Show]
    assert len(set(signs)) == len({s.colour for s in show.Show}) == len(signs)
