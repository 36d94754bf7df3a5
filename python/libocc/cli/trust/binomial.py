# SPDX-License-Identifier: Apache-2.0
"""Confidence interval of a share."""

from collections.abc import Callable

import numpy as np

BISECTIONS = 60  # interval of 2^-60


def interval(hits: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of a probability, from the number of hits in independent trials.

    Each end is the probability for which the observed tail has the probability (1 - confidence) / 2 (C. J. Clopper and
    E. S. Pearson, "The use of confidence or fiducial limits", Biometrika 26, 1934). Without trials it is (0, 1).
    """
    if not 0 <= hits <= trials:
        raise ValueError(f"hits must be between 0 and {trials}, got {hits}")
    tail = (1 - confidence) / 2
    low = 0.0 if hits == 0 else _root(lambda p: _at_least(hits, trials, p) - tail)
    # A number of misses of at least trials - hits is as probable as a number of hits of at most `hits`.
    high = 1.0 if hits == trials else _root(lambda p: tail - _at_least(trials - hits, trials, 1 - p))
    return low, high


def _root(rising: Callable[[float], float]) -> float:
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if rising(middle) < 0 else (low, middle)
    return (low + high) / 2


def _at_least(hits: int, trials: int, p: float) -> float:
    """Probability of at least `hits` >= 1 hits."""
    if p <= 0 or p >= 1:
        return float(p >= 1)
    logs = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, trials + 1)))])  # of the factorials
    k = np.arange(hits, trials + 1)
    terms = logs[trials] - logs[k] - logs[trials - k] + k * np.log(p) + (trials - k) * np.log1p(-p)
    return float(np.exp(terms).sum())
