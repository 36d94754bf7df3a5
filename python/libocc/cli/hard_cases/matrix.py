# SPDX-License-Identifier: Apache-2.0
"""Results of every method on every problem."""

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from .cases import Case
from .instances import instances
from .judge import Judgement, Outcome, judge
from .methods import OWN, Method


@dataclass
class Cell:
    """Results of one method on one row of a case, or on all of its rows."""

    case: str
    row: str
    method: str
    family: str
    counts: Counter[Outcome] = field(default_factory=Counter)
    right: int = 0
    over_allowed: float = math.nan  # max over the problems
    refused_rightly: int = 0

    @property
    def total(self) -> int:
        return sum(self.counts.values())

    @property
    def worst(self) -> Outcome:
        return max(self.counts, key=lambda outcome: outcome.severity)

    @property
    def harmless(self) -> bool:
        """True if every problem is solved or refused."""
        return set(self.counts) <= {Outcome.solved, Outcome.refused}

    def add(self, judgement: Judgement) -> None:
        self.counts[judgement.outcome] += 1
        self.right += judgement.right
        self.refused_rightly += judgement.right and judgement.outcome is Outcome.refused
        self._widen(judgement.over_allowed)

    def merge(self, other: "Cell") -> None:
        self.counts += other.counts
        self.right += other.right
        self.refused_rightly += other.refused_rightly
        self._widen(other.over_allowed)

    def _widen(self, ratio: float) -> None:
        if not math.isnan(ratio):
            self.over_allowed = ratio if math.isnan(self.over_allowed) else max(ratio, self.over_allowed)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, one entry per column."""
        counts = {outcome.name: self.counts[outcome] for outcome in Outcome}
        return {
            "case": self.case, "row": self.row, "family": self.family, "method": self.method,
            "problems": self.total, **counts, "right": self.right,
            "error_over_allowed": None if math.isnan(self.over_allowed) else self.over_allowed,
        }


def run(
    cases: Iterable[Case],
    methods: list[Method],
    count: int | None = None,
    advance: Callable[[], None] = lambda: None,
) -> list[Cell]:
    """Cells for every row of every case and every method that accepts its problems.

    advance: called after each row.
    """
    cells = []
    for case in cases:
        for row, parameters in case.rows():
            of_row = [Cell(case.name, row, m.name, m.family) for m in methods]
            for instance in instances(case, parameters, count or case.count):
                for method, cell in zip(methods, of_row):
                    if method.takes(instance):
                        cell.add(judge(case, instance, method.answer(instance)))
            cells += [cell for cell in of_row if cell.total]
            advance()
    return cells


def by_case(cells: Iterable[Cell]) -> list[Cell]:
    """Merges the rows of each case."""
    merged: dict[tuple[str, str, str], Cell] = {}
    for cell in cells:
        key = cell.case, cell.family, cell.method
        merged.setdefault(key, Cell(cell.case, "", cell.method, cell.family)).merge(cell)
    return list(merged.values())


def own_harmless(cells: Iterable[Cell]) -> bool:
    """True if libocc's methods OWN solve or refuse every problem."""
    return all(c.harmless for c in cells if c.family == "libocc" and c.method in OWN)
