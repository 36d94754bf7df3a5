# SPDX-License-Identifier: Apache-2.0
"""Measures the computing time of the refinement's rungs on this machine, for `locate(costs=...)`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from ... import _core
from ..._core import Rung, RungCost, RungCosts
from .experiment import Experiment

RANGES = (1.0, 1.5, 2.2)  # multiples of the experiment's range, which vary the size of the lamps
MIN_LAMPS = 3
# Terms of a rung's time: indices into (1, lamps, rim points, pixels).
TERMS = {Rung.points: (0, 1), Rung.centres: (0, 1), Rung.rims: (0, 1, 2), Rung.direct: (0, 1, 3)}
NAMES = ("fixed_s", "per_lamp_s", "per_rim_point_s", "per_pixel_s")
REPEATS = 3  # measurements; their median is used


def problems(experiment: Experiment) -> list[Experiment]:
    """Variants of the experiment with fewer lamps and longer ranges."""
    lamps = experiment.scene.lamps
    counts = sorted({MIN_LAMPS, (MIN_LAMPS + len(lamps)) // 2, len(lamps)})
    if counts[0] > len(lamps):
        raise ValueError(f"costs require at least {MIN_LAMPS} lamps, got {len(lamps)}")
    return [
        replace(experiment, scene=experiment.scene.replace(lamps=lamps[:n]), range_m=experiment.range_m * by)
        for n in counts
        for by in RANGES
    ]


def measure(
    experiment: Experiment, frames: int, min_time_s: float, advance: Callable[[], None]
) -> RungCosts:
    """Measures and fits the costs. frames: per problem. Raises: ValueError when a rung could not be measured."""
    seen: dict[Rung, list[tuple[Any, float]]] = {rung: [] for rung in TERMS}
    for problem in problems(experiment):
        for number in range(frames):
            pose = problem.pose(number)
            image = problem.image(number, pose)
            for rung, rows in seen.items():
                runs = [
                    _core.time_refine(image, problem.scene, pose, rung, min_time_s)
                    for _ in range(REPEATS)
                ]
                *work, _ = runs[0]
                time_s = float(np.median([run[-1] for run in runs]))
                if time_s > 0:
                    rows.append((np.array([1, *work], dtype=float), time_s))
            advance()
    return RungCosts(**{rung.name: _fitted(rung, rows) for rung, rows in seen.items()})


def _fitted(rung: Rung, rows: Sequence[tuple[Any, float]]) -> RungCost:
    """Fits non-negative costs by least squares of relative errors."""
    if not rows:
        raise ValueError(f"no pose could be refined by {rung.name}")
    times = np.array([time_s for _, time_s in rows])
    all_terms = np.array([work for work, _ in rows]) / times[:, None]
    best: tuple[float, dict[str, float]] = (np.inf, {})
    terms = TERMS[rung]
    for count in range(1, len(terms) + 1):
        for chosen in combinations(terms, count):
            columns = all_terms[:, chosen]
            if np.linalg.matrix_rank(columns) < count:
                continue
            costs = np.linalg.lstsq(columns, np.ones(len(rows)), rcond=None)[0]
            misfit = float(np.sum((columns @ costs - 1) ** 2))
            if (costs >= 0).all() and misfit < best[0]:
                best = misfit, {NAMES[i]: float(cost) for i, cost in zip(chosen, costs)}
    return RungCost(**best[1])
