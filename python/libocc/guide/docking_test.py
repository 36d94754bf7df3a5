# SPDX-License-Identifier: Apache-2.0
"""Docking test after ASTM F3499-21, "Standard Test Method for Confirming the Docking Performance of A-UGVs".

The requestor of the test specifies the probability R that a repetition succeeds and the confidence C (sec. 7.5). They
determine the number of consecutive repetitions that must succeed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DEGREE = math.pi / 180
BISECTIONS = 50  # interval of 2^-50


@dataclass(frozen=True)
class DockingLimits:
    """Limits of a repetition, and probability and confidence of the test."""

    position_m: float = 0.002
    heading_rad: float = 0.1 * DEGREE
    probability: float = 0.9  # R
    confidence: float = 0.95  # C

    def __post_init__(self) -> None:
        for name in ("position_m", "heading_rad"):
            if not (getattr(self, name) > 0 and math.isfinite(getattr(self, name))):
                raise ValueError(f"{name} must be positive, got {getattr(self, name)!r}")
        for name in ("probability", "confidence"):
            if not 0 < getattr(self, name) < 1:
                raise ValueError(f"{name} must be between 0 and 1, got {getattr(self, name)!r}")

    @property
    def repetitions(self) -> int:
        """Number of consecutive repetitions that must succeed: the smallest n with 1 - R^n >= C."""
        # The tolerance avoids that rounding errors add one repetition to an integer quotient.
        return math.ceil(math.log(1 - self.confidence) / math.log(self.probability) - 1e-9)


@dataclass(frozen=True)
class Repetition:
    """One docking, with the errors of the vehicle in the frame of the dock."""

    docked: bool
    along_m: float
    across_m: float
    heading_rad: float
    duration_s: float

    @property
    def position_m(self) -> float:
        return math.hypot(self.along_m, self.across_m)

    def succeeds(self, limits: DockingLimits) -> bool:
        return (
            self.docked and self.position_m <= limits.position_m
            and abs(self.heading_rad) <= limits.heading_rad
        )


@dataclass(frozen=True)
class DockingTest:
    limits: DockingLimits
    repetitions: Sequence[Repetition]

    @property
    def successes(self) -> int:
        return sum(one.succeeds(self.limits) for one in self.repetitions)

    @property
    def longest_sequence(self) -> int:
        """Max number of consecutive successes."""
        longest = now = 0
        for one in self.repetitions:
            now = now + 1 if one.succeeds(self.limits) else 0
            longest = max(longest, now)
        return longest

    @property
    def passed(self) -> bool:
        return self.longest_sequence >= self.limits.repetitions

    @property
    def probability_shown(self) -> float:
        """Lower confidence limit of the success probability from all repetitions
        (Clopper, Pearson, Biometrika 26, 1934)."""
        return lower_limit(self.successes, len(self.repetitions), self.limits.confidence)

    def repeatability(self) -> dict[str, float]:
        """Means and standard deviations of the errors of completed dockings [m, rad]."""
        docked = [one for one in self.repetitions if one.docked]
        out = {}
        for name in ("along_m", "across_m", "heading_rad"):
            values = [getattr(one, name) for one in docked]
            mean = sum(values) / len(values) if values else math.nan
            squares = sum((v - mean) ** 2 for v in values)
            sigma = math.sqrt(squares / (len(values) - 1)) if len(values) > 1 else math.nan
            out[f"{name}_mean"], out[f"{name}_sigma"] = mean, sigma
        return out


def lower_limit(successes: int, count: int, confidence: float) -> float:
    """Success probability for which `successes` or more of `count` occur with the probability 1 - confidence."""
    if successes == 0:
        return 0.0
    k = np.arange(successes, count + 1)
    log_factorials = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, count + 1)))])
    log_choices = log_factorials[count] - log_factorials[k] - log_factorials[count - k]
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        chance = np.exp(log_choices + k * np.log(middle) + (count - k) * np.log1p(-middle)).sum()
        low, high = (middle, high) if chance < 1 - confidence else (low, middle)
    return low
