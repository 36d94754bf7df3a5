# SPDX-License-Identifier: Apache-2.0
"""Every solver behind the guard on every hard case, and libocc's own held to more."""

import pytest
from problems import CASES, problems

import libocc as occ
from libocc.cli.hard_cases.judge import Outcome, judge
from libocc.cli.hard_cases.methods import OWN, Method, own_methods

METHODS = {method.name: method for method in own_methods()}
HARMLESS = {Outcome.solved, Outcome.refused, Outcome.dropped}
# Problems in which rounding of the bearings alone makes the pose uncertain to the tolerance of the guard,
# other people's solvers may answer with a pose that fits but has lost digits.
LOSES_DIGITS = {
    "ceiling_triple_under_lamp",
    "ceiling_triple_under_lamp_upright",
    "danger_cylinder",
    "danger_cylinder_mate",
    "near_collinear",
}
# More than three points are fitted: how each is weighed moves the answer within what rounding allows.
LIMIT = {True: 1, False: 12}


def pairs() -> list[tuple[str, str]]:
    """Every case with every method that takes its number of points."""
    found = []
    for case in CASES:
        instances = [instance for _, of_row in problems(case) for instance in of_row]
        found += [(case, name) for name, m in METHODS.items() if any(map(m.takes, instances))]
    return found


def check(case_name: str, method: Method, count: int | None) -> None:
    case = CASES[case_name]
    for row, of_row in problems(case_name, count):
        for i, instance in enumerate(of_row):
            if not method.takes(instance):
                continue
            answer = method.answer(instance)
            judgement = judge(case, instance, answer)
            where = f"{case_name} {row} #{i}: {judgement} {answer.raised}"
            if case.verdict == "error":
                assert answer.raised.startswith("ValueError: "), where
            else:
                assert not answer.raised, where
            if method.name in OWN:
                assert judgement.right, where
                assert not judgement.over_allowed > LIMIT[len(instance.points) == 3], where
            elif judgement.outcome is Outcome.inexact:
                assert case_name in LOSES_DIGITS, where
            else:
                assert judgement.outcome in HARMLESS, where


@pytest.mark.parametrize(("case", "method"), pairs())
def test_solver(case, method):
    check(case, METHODS[method], None)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "method"), pairs())
def test_solver_many_times(case, method):
    check(case, METHODS[method], CASES[case].slow_count)


def test_p3p_is_the_solver_of_that_name():
    """The function without a guard's name gives what the guarded solver gives."""
    for name in ("ceiling_triple_under_lamp", "no_triangle", "collinear_three", "grazing_three"):
        for _, of_row in problems(name):
            for instance in of_row:
                poses = occ.p3p(instance.bearings, instance.points)
                assert poses.shape == (len(METHODS["p3p"].answer(instance).poses), 4, 4)
