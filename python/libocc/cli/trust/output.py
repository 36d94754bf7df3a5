# SPDX-License-Identifier: Apache-2.0
"""Tables of `libocc trust` for the terminal, CSV and JSON."""

from collections.abc import Sequence
from typing import Any

from ..ladder.plot import seconds_text
from .figures import FamilyRow, RiskRow, Share, plain_family, plain_risk

LEGEND = (
    "other: not_converged, degenerate, ...; wrong: ok, but more than 0.05 m or 0.05 rad off and outside the "
    "covariance (chi-square of probability 1e-9); inside: truths within 1, 2, 3 sigma of all six parameters, expected "
    "68.3, 95.4, 99.7 %; time: of one thread"
)


def family_table(rows: Sequence[FamilyRow]) -> Any:
    out = _table(("family",), ("problems", "ok", "ambiguous", "no pose", "other", "wrong", "inside", "median", "p99"))
    for row in filter(lambda row: row.problems, rows):
        inside = [percent(c.inside) for c in row.coverage if c.by == "chi2"]
        out.add_row(
            row.family.name, *map(str, (row.problems, row.ok, row.ambiguous, row.no_pose, row.other, row.wrong.hits)),
            " ".join(inside) or "-", seconds_text(row.time_median_s), seconds_text(row.time_p99_s),
        )
    return out


def risk_table(rows: Sequence[RiskRow]) -> Any:
    out = _table((), ("risk up to", "fixes", "wrong", "share", "95 % interval"))
    for row in rows:
        low, high = row.wrong.band
        out.add_row(
            f"{row.max_risk:.0e}", str(row.wrong.trials), str(row.wrong.hits), f"{row.wrong.value:.2g}",
            f"{low:.2g} to {high:.2g}",
        )
    return out


def _table(left: Sequence[str], right: Sequence[str]) -> Any:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    out = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for name in left:
        out.add_column(name, no_wrap=True)
    for name in right:
        out.add_column(name, justify="right", no_wrap=True)
    return out


def percent(share: Share) -> str:
    return f"{100 * share.value:.1f}"


def plain(settings: dict[str, Any], rows: Sequence[FamilyRow], risks: Sequence[RiskRow], interrupted: bool) -> Any:
    return {
        **settings, "interrupted": interrupted, "families": [plain_family(row) for row in rows if row.problems],
        "risk": [plain_risk(row) for row in risks],
    }
