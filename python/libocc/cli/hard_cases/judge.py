# SPDX-License-Identifier: Apache-2.0
"""Whether an answer is right, an honest refusal, or harmful."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from .cases import Case
from .conditioning import EPSILON, Reference, long_norm
from .instances import Instance
from .methods import Answer

SOLVED_WITHIN = 1e-6  # rotation [rad] and shift over distance, unless conditioning allows less
FITS_WITHIN_RAD = 1e-6  # a pose that reproduces the bearings worse is no solution


class Outcome(Enum):
    """From best to worst; an answer gets the worst that is true of it."""

    solved = "the truth is found, with every other pose that exists"
    refused = "no pose is returned"
    dropped = "poses that exist are missing"
    inexact = "fits the bearings, yet farther from the truth than conditioning allows"
    wrong = "a pose that does not fit or has a point behind, or one where none can be told"
    nan = "numbers that are not finite"

    @property
    def severity(self) -> int:
        return list(Outcome).index(self)


@dataclass(frozen=True)
class Judgement:
    outcome: Outcome
    right: bool  # as good a solver ends; an honest refusal of a solvable problem is not
    over_allowed: float = np.nan  # error over what the input's rounding explains, where found


def misfit_rad(instance: Instance, cam_from_world: Any) -> float:
    """Largest angle between a bearing and the direction to its point."""
    pose = np.asarray(cam_from_world, dtype=np.longdouble)
    in_cam = instance.points.astype(np.longdouble) @ pose[:3, :3].T + pose[:3, 3]
    seen = instance.bearings.astype(np.longdouble)
    apart = in_cam / long_norm(in_cam)[:, None] - seen / long_norm(seen)[:, None]
    return float(2 * np.arcsin(min(1.0, float(long_norm(apart).max()) / 2)))


def is_rotation(matrix: Any) -> bool:
    off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    return bool(off < SOLVED_WITHIN and np.linalg.det(matrix) > 0)


def _fits(instance: Instance, cam_from_world: Any) -> bool:
    """The coordinates' own rounding, which no pose can undo, is granted."""
    if not is_rotation(cam_from_world[:3, :3]):
        return False
    in_cam = instance.points @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
    nearest = np.linalg.norm(in_cam, axis=1).min()
    granted = 8 * EPSILON * np.abs(instance.points).max() / max(nearest, 1e-300)
    return misfit_rad(instance, cam_from_world) <= FITS_WITHIN_RAD + float(granted)


def judge(case: Case, instance: Instance, answer: Answer) -> Judgement:
    """The outcome of one problem."""
    refusal_is_right = case.verdict != "solved"
    if not all(np.isfinite(pose).all() for pose in answer.poses):
        return Judgement(Outcome.nan, False)
    if not answer.poses:
        if case.verdict == "either" and any(s.real for s in instance.solutions or ()):
            refusal_is_right = False
        return Judgement(Outcome.refused, refusal_is_right)
    if case.verdict in ("refused", "error"):
        return Judgement(Outcome.wrong, False)
    if not all(_fits(instance, pose) for pose in answer.poses):
        return Judgement(Outcome.wrong, False)
    return _of_fitting(case, instance, answer)


def _of_fitting(case: Case, instance: Instance, answer: Answer) -> Judgement:
    centroid = instance.points.astype(np.longdouble).mean(0)

    def nearest(pose: Reference) -> float:
        return min(pose.error(given, centroid) for given in answer.poses)

    def limit(pose: Reference) -> float:
        return max(SOLVED_WITHIN, pose.allowed(case.tolerance_factor))

    ratio = np.nan
    if instance.truth is not None:
        error = nearest(instance.truth)
        if error > limit(instance.truth):
            return Judgement(_missed(instance, answer, centroid, limit), False)
        ratio = error / instance.truth.allowed(case.tolerance_factor)
    for solution in instance.solutions or ():
        if solution.real and nearest(solution.pose) > limit(solution.pose):
            return Judgement(Outcome.dropped, False, ratio)
    return Judgement(Outcome.solved, True, ratio)


def _missed(instance: Instance, answer: Answer, centroid: Any, limit: Any) -> Outcome:
    """What poses are that fit while the true one is not among them."""
    if instance.size < 3:
        return Outcome.wrong  # one of endlessly many
    known = [solution.pose for solution in instance.solutions or ()]
    if known and all(any(k.error(p, centroid) <= limit(k) for k in known) for p in answer.poses):
        return Outcome.dropped
    return Outcome.inexact
