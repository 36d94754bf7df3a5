# SPDX-License-Identifier: Apache-2.0
"""Statistics of a rung over all frames: one row of the table."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from .measure import OUTLIER, Run, Rung

RELIABLE = 0.01  # max fraction of failures and outliers of a recommended rung


@dataclass(frozen=True)
class Row:
    """Statistics of a rung.

    Errors are root mean squares over the answers that are not outliers; the bounds of the ratios are those of the same
    frames. NaN without such answers.
    """

    name: str
    family: str
    description: str
    frames: int
    time_median_s: float
    time_p95_s: float
    position_rmse_m: float
    rotation_rmse_rad: float
    position_over_pixels: float  # ratio to the bound of all pixels
    rotation_over_pixels: float
    position_over_own: float  # ratio to the bound of the rung's observations
    rotation_over_own: float
    failures: float  # fraction of frames without an answer
    outliers: float  # fraction of frames with a wrong answer
    peer: bool
    pareto: bool = False  # no reliable rung is both faster and more accurate

    @property
    def reliable(self) -> bool:
        return self.failures + self.outliers <= RELIABLE and math.isfinite(self.position_rmse_m)

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON and CSV; None for NaN and infinity."""
        return {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in asdict(self).items()
        }


def rows_of(run: Run) -> list[Row]:
    """Rows of the rungs that were run on at least one frame, fastest first."""
    rows = [_row(rung) for rung in run.rungs if rung.time_s]
    rows.sort(key=lambda row: row.time_median_s)
    best = math.inf
    for i, row in enumerate(rows):
        if row.reliable and row.position_rmse_m < best:
            best = row.position_rmse_m
            rows[i] = replace(row, pareto=True)
    return rows


def _row(rung: Rung) -> Row:
    error, own, expected, pixels = (
        np.array(values, dtype=float).reshape(-1, 2)
        for values in (rung.error, rung.bound, rung.expected, rung.all_pixels)
    )
    wrong = ((error > OUTLIER * expected) & (expected > 0)).any(axis=1)
    right = ~wrong
    rmse, over_pixels, over_own = (
        _rms(error[right]), _rms(error[right]) / _rms(pixels[right]), _rms(error[right]) / _rms(own[right]),
    )
    frames = len(rung.time_s)
    return Row(
        rung.name, rung.family, rung.description, frames,
        float(np.median(rung.time_s)), float(np.quantile(rung.time_s, 0.95)),
        float(rmse[0]), float(rmse[1]),
        float(over_pixels[0]), float(over_pixels[1]), float(over_own[0]), float(over_own[1]),
        1 - sum(rung.answered) / frames, float(wrong.sum()) / frames, rung.foreign,
    )


def _rms(values: Any) -> Any:
    """Root mean square of each column; NaN without rows, or if all are zero (no bound)."""
    if not len(values):
        return np.full(2, math.nan)
    rms = np.sqrt(np.mean(values**2, axis=0))
    return np.where(rms > 0, rms, math.nan)


def advice(rows: Sequence[Row], target_m: float | None, budget_s: float | None) -> Row | None:
    """Fastest reliable rung of libocc that meets target and budget; without a target the most accurate one.

    None if there is none.
    """
    fit = [row for row in rows if row.reliable and not row.peer]
    if budget_s is not None:
        fit = [row for row in fit if row.time_median_s <= budget_s]
    if target_m is not None:
        fit = [row for row in fit if row.position_rmse_m <= target_m]
        return min(fit, key=lambda row: row.time_median_s, default=None)
    return min(fit, key=lambda row: row.position_rmse_m, default=None)
