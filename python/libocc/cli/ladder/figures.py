# SPDX-License-Identifier: Apache-2.0
"""From the frames of a rung to its row in the table."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from .measure import OUTLIER, Run, Rung

RELIABLE = 0.01  # of failures and outliers together: a rung with more is not recommended


@dataclass(frozen=True)
class Row:
    """A rung's figures. Errors are root mean squares of the answers that are no outliers, and their
    ratios are to bounds of the same frames; NaN where there is nothing to take them of."""

    name: str
    family: str
    what: str
    frames: int
    time_median_s: float
    time_p95_s: float
    position_rmse_m: float
    rotation_rmse_rad: float
    position_over_pixels: float  # to the bound of all pixels
    rotation_over_pixels: float
    position_over_own: float  # to the bound of what the rung sees
    rotation_over_own: float
    failures: float  # part of the frames without an answer
    outliers: float  # part of the frames with an answer that is wrong
    peer: bool
    pareto: bool = False  # no reliable rung is both faster and more accurate

    @property
    def reliable(self) -> bool:
        return self.failures + self.outliers <= RELIABLE and math.isfinite(self.position_rmse_m)

    def plain(self) -> dict[str, Any]:
        """For JSON and CSV: what is not a number is None."""
        return {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in asdict(self).items()
        }


def rows_of(run: Run) -> list[Row]:
    """The rungs that suited some frame, fastest first."""
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
        rung.name, rung.family, rung.what, frames,
        float(np.median(rung.time_s)), float(np.quantile(rung.time_s, 0.95)),
        float(rmse[0]), float(rmse[1]),
        float(over_pixels[0]), float(over_pixels[1]), float(over_own[0]), float(over_own[1]),
        1 - sum(rung.answered) / frames, float(wrong.sum()) / frames, rung.foreign,
    )


def _rms(values: Any) -> Any:
    """Of each column; NaN without rows, and where all are zero (there is no bound)."""
    if not len(values):
        return np.full(2, math.nan)
    rms = np.sqrt(np.mean(values**2, axis=0))
    return np.where(rms > 0, rms, math.nan)


def advice(rows: Sequence[Row], target_m: float | None, budget_s: float | None) -> Row | None:
    """The fastest reliable rung of ours that meets the target within the budget; without a target
    the most accurate within the budget. None when there is none."""
    fit = [row for row in rows if row.reliable and not row.peer]
    if budget_s is not None:
        fit = [row for row in fit if row.time_median_s <= budget_s]
    if target_m is not None:
        fit = [row for row in fit if row.position_rmse_m <= target_m]
        return min(fit, key=lambda row: row.time_median_s, default=None)
    return min(fit, key=lambda row: row.position_rmse_m, default=None)
