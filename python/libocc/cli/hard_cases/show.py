# SPDX-License-Identifier: Apache-2.0
"""Signs and colours of the outcomes in the table and in the picture."""

from collections.abc import Iterable
from enum import Enum

from .cases import Case
from .judge import Outcome
from .matrix import Cell


class Show(Enum):
    """Sign, label, colour (palette of Okabe and Ito), colour of the sign."""

    solved = "●", "solved", "#0072B2", "white"
    refused_rightly = "○", "refused: no solution exists", "#A6D5F2", "black"
    refused = "–", "refused a solvable problem", "#D0D0D0", "black"
    dropped = "d", "solutions missing", "#F0E442", "black"
    inexact = "~", "inexact", "#E69F00", "black"
    wrong = "×", "wrong pose without warning", "#D55E00", "white"
    nan = "N", "NaN", "#000000", "white"

    @property
    def sign(self) -> str:
        return self.value[0]

    @property
    def label(self) -> str:
        return self.value[1]

    @property
    def colour(self) -> str:
        return self.value[2]

    @property
    def ink(self) -> str:
        return self.value[3]

    @property
    def harmful(self) -> bool:
        return self in (Show.inexact, Show.wrong, Show.nan)


def grouped(cases: Iterable[Case]) -> list[tuple[str, list[Case]]]:
    """Groups of cases by number of points and solvability, sorted by name; empty groups are omitted."""
    groups: dict[str, list[Case]] = {"three points": [], "four and more": [], "without a unique answer": []}
    for case in sorted(cases, key=lambda case: case.name):
        solvable = case.verdict == "solved"
        of = ("three points" if case.points == 3 else "four and more") if solvable else "without a unique answer"
        groups[of].append(case)
    return [(heading, members) for heading, members in groups.items() if members]


def share_of(cell: Cell) -> dict[Show, float]:
    """Fraction of each outcome in a cell; zero fractions are omitted."""
    counts = {Show[outcome.name]: cell.counts[outcome] for outcome in Outcome}
    counts[Show.refused] -= cell.refused_rightly
    counts[Show.refused_rightly] = cell.refused_rightly
    return {show: n / cell.total for show, n in counts.items() if n > 0}


def worst_first(shares: dict[Show, float]) -> list[Show]:
    return [show for show in reversed(Show) if show in shares]


def text_of(cell: Cell) -> str:
    """Sign of the worst outcome, with its percentage if there are other outcomes."""
    shares = share_of(cell)
    worst = worst_first(shares)[0]
    return worst.sign if len(shares) == 1 else f"{worst.sign}{max(1, round(100 * shares[worst]))}"


def style_of(cell: Cell) -> str:
    """Style (for rich) of the worst outcome."""
    worst = worst_first(share_of(cell))[0]
    return {
        Show.solved: "bright_blue", Show.refused_rightly: "cyan", Show.refused: "bright_black",
        Show.dropped: "yellow", Show.inexact: "bold yellow", Show.wrong: "bold red",
        Show.nan: "bold white on red",
    }[worst]
