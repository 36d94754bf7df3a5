# SPDX-License-Identifier: Apache-2.0
"""Problems of a case with their reference solutions."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import exact as ex
from .cases import GENERATORS, Case
from .conditioning import EPSILON, Reference, refined
from .oracle import Solution, three_points
from .views import View

TRIES = 200  # max number of random draws for one problem


@dataclass(frozen=True)
class Instance:
    """One problem: input of the solver and reference solutions."""

    bearings: Any  # (n, 3)
    points: Any  # (n, 3)
    up_in_cam: Any  # (3,)
    truth: Reference | None  # None: no pose is correct
    solutions: tuple[Solution, ...] | None  # all solutions; None: unknown (not three points)
    nominal: Any  # (4, 4) cam_from_world of the generator

    @property
    def size(self) -> int:
        return len(self.points)


def instances(case: Case, parameters: dict[str, Any], count: int) -> Iterator[Instance]:
    """First `count` problems of one row of a case; reproducible."""
    row = zlib.crc32(repr(sorted(parameters.items())).encode())
    for i in range(count):
        rng = np.random.default_rng([case.seed, row, i])
        for _ in range(TRIES):
            found = _instance(case, parameters, rng)
            if found is not None:
                yield found
                break
        else:
            raise ValueError(f"{case.name}: no problem of this kind in {TRIES} draws")


def _instance(case: Case, parameters: dict[str, Any], rng: np.random.Generator) -> Instance | None:
    """Draws one problem; None if the draw does not satisfy the conditions of the case."""
    with ex.digits():
        view = GENERATORS[case.generator](rng, case.points, **parameters)
        bearings, points = view.arrays()
        up = ex.rounded(view.rotation[:, 2])
        nominal = _nominal(view)
        centre = view.in_cam().sum(0) / max(1, case.points)
    if case.verdict == "error":
        return Instance(bearings, points, up, None, None, nominal)
    solutions = tuple(three_points(bearings, points)) if case.points == 3 else None
    if view.other_bearings is not None or case.truth == "none":
        wanted = not solutions or case.truth == "none"
        return Instance(bearings, points, up, None, solutions, nominal) if wanted else None
    rotation, centroid = ex.long(view.rotation), ex.long(centre)
    if solutions is None:
        truth = refined(bearings, points, rotation, centroid) if case.points > 1 else None
        return Instance(bearings, points, up, truth, None, nominal)
    chosen = _chosen(case, solutions, rotation, centroid)
    if chosen is None:  # no second solution, or a double root that was lost by rounding of large coordinates
        return None
    return Instance(bearings, points, up, chosen, solutions, nominal)


def _chosen(
    case: Case, solutions: tuple[Solution, ...], rotation: Any, centroid: Any
) -> Reference | None:
    """Reference solution: that of the view, or for truth `mate` the best conditioned of the others."""
    own: list[tuple[float, Solution]] = []
    others: list[tuple[float, Solution]] = []
    for solution in solutions:
        shift = (solution.pose.centroid_in_cam - centroid).astype(float)
        rotation_change = (solution.pose.rotation - rotation).astype(float)
        away = max(np.linalg.norm(shift) / solution.pose.distance, np.linalg.norm(rotation_change))
        rounding = max(1, solution.pose.rounding / EPSILON)  # rounding of the world coordinates
        near = max(1e-9, 4 * solution.pose.allowed(case.tolerance_factor * rounding))
        (own if away < near else others).append((float(away), solution))
    if case.truth == "mate":
        clear = [s.pose for _, s in others if s.real and not s.is_double()]
        return min(clear, key=lambda pose: pose.condition, default=None)
    return min(own, key=lambda pair: pair[0])[1].pose if own else None


def _nominal(view: View) -> Any:
    out = np.eye(4)
    out[:3, :3] = ex.rounded(view.rotation)
    out[:3, 3] = ex.rounded(-(view.rotation @ view.position))
    return out
