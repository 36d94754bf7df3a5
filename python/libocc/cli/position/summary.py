# SPDX-License-Identifier: Apache-2.0
"""Summary of a run in constant memory."""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from .record import SKIPPED, Array, Record


class Durations:
    """Histogram of processing times with bins of 2 %, because the number of frames is unlimited."""

    SHORTEST_S, STEP, BINS = 1e-6, 1.02, 1000

    def __init__(self) -> None:
        self._counts = np.zeros(self.BINS, int)

    def add(self, took_s: float) -> None:
        bin_ = math.log(max(took_s, self.SHORTEST_S) / self.SHORTEST_S) / math.log(self.STEP)
        self._counts[min(int(bin_), self.BINS - 1)] += 1

    def quantile_s(self, part: float) -> float | None:
        """Quantile, accurate to 1 %; None without data."""
        total = int(self._counts.sum())
        if total == 0:
            return None
        bin_ = int(np.searchsorted(np.cumsum(self._counts), max(part * total, 1)))
        return float(self.SHORTEST_S * self.STEP ** (bin_ + 0.5))


@dataclass
class Errors:
    """Statistics of the position errors against the truth."""

    count: int = 0
    sum_m: float = 0.0
    sum_m2: float = 0.0
    max_m: float = 0.0
    sum_nees: float = 0.0

    def add(self, error_m: Array, covariance_m2: Array) -> None:
        length_m = float(np.linalg.norm(error_m))
        self.count += 1
        self.sum_m += length_m
        self.sum_m2 += length_m**2
        self.max_m = max(self.max_m, length_m)
        self.sum_nees += _nees(error_m, covariance_m2)

    def text(self) -> str:
        return (
            f"against the truth: mean {1e3 * self.sum_m / self.count:.2f} mm, "
            f"RMSE {1e3 * math.sqrt(self.sum_m2 / self.count):.2f} mm, max {1e3 * self.max_m:.2f} mm; "
            f"mean NEES {self.sum_nees / self.count:.2f} (3 expected)"
        )


@dataclass
class Summary:
    """Counts and statistics of a run."""

    frames: int = 0
    states: Counter[str] = field(default_factory=Counter)
    warnings: int = 0
    dropped: int = 0
    first_pose_s: float | None = None
    begun_s: float | None = None
    took: Durations = field(default_factory=Durations)
    errors: Errors = field(default_factory=Errors)

    def add(self, record: Record) -> None:
        self.frames += 1
        self.states[record.state] += 1
        self.warnings += bool(record.warning)
        self.dropped += record.dropped
        if record.time_s is not None and self.begun_s is None:
            self.begun_s = record.time_s
        if record.state != SKIPPED:
            self.took.add(record.took_s)
        if record.pose is None or record.predicted:
            return
        if self.first_pose_s is None:
            self.first_pose_s = record.time_s
        if record.error_m is not None:
            self.errors.add(record.error_m, record.pose.position_covariance_m2)

    def text(self) -> str:
        """Summary as several lines of text."""
        states = ", ".join(f"{count} {state}" for state, count in self.states.most_common())
        lines = [f"{self.frames} frames: {states or 'none'}"]
        if self.dropped:
            lines[0] += f"; {self.dropped} dropped to keep up with the source"
        if self.warnings:
            lines[0] += f"; {self.warnings} with a warning"
        if self.first_pose_s is not None and self.begun_s is not None:
            lines.append(f"first position {self.first_pose_s - self.begun_s:.3f} s after the first frame")
        median_s, late_s = self.took.quantile_s(0.5), self.took.quantile_s(0.99)
        if median_s is not None and late_s is not None:
            lines.append(f"time per frame {1e3 * median_s:.2f} ms (median), {1e3 * late_s:.2f} ms (99 %)")
        if self.errors.count:
            lines.append(self.errors.text())
        return "\n".join(lines)


def _nees(error_m: Array, covariance_m2: Array) -> float:
    """Normalised estimation error squared; infinite for a singular covariance."""
    try:
        return float(error_m @ np.linalg.solve(covariance_m2, error_m))
    except np.linalg.LinAlgError:
        return float("inf")
