# SPDX-License-Identifier: Apache-2.0
"""Confidence interval of a share."""

from ...guide.docking_test import lower_limit


def interval(hits: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of a probability, from the number of hits in independent trials.

    Each end is the probability for which the observed tail has the probability (1 - confidence) / 2 (C. J. Clopper and
    E. S. Pearson, "The use of confidence or fiducial limits", Biometrika 26, 1934). Without trials it is (0, 1).
    """
    if not 0 <= hits <= trials:
        raise ValueError(f"hits must be between 0 and {trials}, got {hits}")
    one_sided = (1 + confidence) / 2
    return lower_limit(hits, trials, one_sided), 1 - lower_limit(trials - hits, trials, one_sided)
