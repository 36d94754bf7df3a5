# SPDX-License-Identifier: Apache-2.0
"""Figures of a run: verdicts, risk against truth, coverage, times."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...smoothing import chi2_quantile
from .binomial import interval
from .families import Family
from .judge import Record

MAX_RISK = 1e-4  # of `ok`, default of locate() and robust_pose()
DECADES = tuple(10.0**k for k in range(-8, 1))
INSIDE = tuple(math.erf(k / math.sqrt(2)) for k in (1, 2, 3))  # expected coverage of 1, 2, 3 sigma
AXES = ("x", "y", "z")
ANSWERED = ("ok", "ambiguous")  # these statuses are ok with max_risk = 1


@dataclass(frozen=True)
class Share:
    """Share of hits with its 95 % interval."""

    hits: int
    trials: int

    @property
    def value(self) -> float:
        return self.hits / self.trials if self.trials else float("nan")

    @property
    def band(self) -> tuple[float, float]:
        return interval(self.hits, self.trials)


@dataclass(frozen=True)
class RiskRow:
    """Fixes with a stated risk of at most `max_risk`, with max_risk = 1 of locate()."""

    max_risk: float
    wrong: Share
    mean_risk: float  # stated


@dataclass(frozen=True)
class Coverage:
    """Truths inside `sigmas` standard deviations; by: an axis, or "chi2" for all six parameters."""

    by: str
    sigmas: int
    inside: Share


@dataclass(frozen=True)
class FamilyRow:
    family: Family
    problems: int
    ok: int
    ambiguous: int
    no_pose: int
    other: int
    wrong: Share  # of the fixes that are ok
    lost: int  # ambiguous fixes without the right pose among their candidates
    time_median_s: float
    time_p99_s: float
    coverage: tuple[Coverage, ...]
    risks: tuple[RiskRow, ...]  # empty if no risk is stated


def family_row(family: Family, records: Sequence[Record]) -> FamilyRow:
    ok = [record for record in records if record.status == "ok"]
    counts = {name: sum(r.status == name for r in records) for name in ("ok", "ambiguous", "no_pose")}
    times = [record.time_s for record in records] or [float("nan")]
    return FamilyRow(
        family, len(records), **counts, other=len(records) - sum(counts.values()),
        wrong=Share(sum(bool(r.wrong) for r in ok), len(ok)),
        lost=sum(r.status == "ambiguous" and not r.truth_listed for r in records),
        time_median_s=float(np.median(times)), time_p99_s=float(np.quantile(times, 0.99)),
        coverage=coverage_of(ok), risks=risk_rows(records),
    )


def coverage_of(ok: Sequence[Record]) -> tuple[Coverage, ...]:
    """Coverage of the fixes that are ok; empty without any."""
    known = [(r.chi2, r.z) for r in ok if r.chi2 is not None and r.z is not None]
    if not known:
        return ()
    rows = []
    for sigmas, expected in enumerate(INSIDE, 1):
        limit = chi2_quantile(expected, 6)
        rows.append(Coverage("chi2", sigmas, Share(sum(chi2 <= limit for chi2, _ in known), len(known))))
        for i, axis in enumerate(AXES):
            rows.append(Coverage(axis, sigmas, Share(sum(abs(z[i]) <= sigmas for _, z in known), len(known))))
    return tuple(rows)


def risk_rows(records: Sequence[Record]) -> tuple[RiskRow, ...]:
    """Rows for all decades that have fixes."""
    stated = [(r.risk, bool(r.wrong)) for r in records
              if r.status in ANSWERED and r.risk is not None and r.wrong is not None]
    rows = []
    for limit in DECADES:
        below = [(risk, wrong) for risk, wrong in stated if risk <= limit]
        if below:
            wrong = Share(sum(wrong for _, wrong in below), len(below))
            rows.append(RiskRow(limit, wrong, float(np.mean([risk for risk, _ in below]))))
    return tuple(rows)


def too_often_wrong(rows: Sequence[FamilyRow]) -> list[str]:
    """Families whose share of wrong fixes that are ok is significantly above MAX_RISK."""
    return [row.family.name for row in rows if row.wrong.band[0] > MAX_RISK]


def plain_share(share: Share) -> dict[str, Any]:
    low, high = share.band
    return {"share": share.value if share.trials else None, "low": low, "high": high}


def plain_risk(row: RiskRow) -> dict[str, Any]:
    return {
        "max_risk": row.max_risk, "fixes": row.wrong.trials, "wrong": row.wrong.hits, **plain_share(row.wrong),
        "mean_risk": row.mean_risk,
    }


def plain_family(row: FamilyRow) -> dict[str, Any]:
    coverage = [
        {
            "by": c.by, "sigmas": c.sigmas, "expected": INSIDE[c.sigmas - 1], "fixes": c.inside.trials,
            "inside": c.inside.hits, **plain_share(c.inside),
        }
        for c in row.coverage
    ]
    return {
        "family": row.family.name, "about": row.family.about, "problems": row.problems, "ok": row.ok,
        "ambiguous": row.ambiguous, "no_pose": row.no_pose, "other": row.other, "wrong": row.wrong.hits,
        **{f"wrong_{key}": value for key, value in plain_share(row.wrong).items()}, "lost": row.lost,
        "time_median_s": row.time_median_s, "time_p99_s": row.time_p99_s, "coverage": coverage,
        "risk": [plain_risk(risk) for risk in row.risks],
    }
