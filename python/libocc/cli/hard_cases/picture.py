# SPDX-License-Identifier: Apache-2.0
"""Picture of the results: one row per case, one column per solver."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from .cases import Case
from .matrix import Cell
from .methods import Method
from .show import Show, grouped, share_of, worst_first

CELL_W_IN, CELL_H_IN, LABEL_IN, HEAD_IN, FOOT_IN = 0.46, 0.2, 2.5, 1.25, 0.95
GAP = 0.45  # columns between families
HEADING = 1.3  # rows above each group
DOTS_PER_INCH = 110


def columns(methods: Sequence[Method]) -> dict[tuple[str, str], float]:
    """Left edge of each method's column, with gaps between families."""
    edges: dict[tuple[str, str], float] = {}
    at, family = 0.0, ""
    for method in methods:
        at += GAP if family not in ("", method.family) else 0
        edges[method.family, method.name] = at
        at, family = at + 1, method.family
    return edges


def draw(
    path: str | PathLike[str], cells: Sequence[Cell], cases: Sequence[Case], methods: Sequence[Method]
) -> None:
    """Writes the picture (PNG by the name's ending).

    cells: one for each case and method (`matrix.by_case`). cases, methods: the rows and columns in
    their order. Raises: OSError when it cannot be written, ValueError for an unknown ending.
    """
    edges = columns(methods)
    groups = grouped(cases)
    width = max(edges.values()) + 1
    height = len(cases) + HEADING * len(groups)
    inches = LABEL_IN + width * CELL_W_IN + 0.1, HEAD_IN + height * CELL_H_IN + FOOT_IN
    figure = Figure(figsize=inches, dpi=DOTS_PER_INCH, facecolor="white")
    FigureCanvasAgg(figure)
    place = (
        LABEL_IN / inches[0], FOOT_IN / inches[1],
        width * CELL_W_IN / inches[0], height * CELL_H_IN / inches[1],
    )
    axes = figure.add_axes(place, xlim=(0, width), ylim=(height, 0))
    axes.axis("off")
    rows: dict[str, float] = {}
    below = 0.0
    for heading, members in groups:
        axes.text(-0.15, below + HEADING - 0.45, heading, ha="right", va="center", fontsize=8.5,
                  fontweight="bold")
        below += HEADING
        for case in members:
            axes.text(-0.15, below + 0.5, case.name.replace("_", " "), ha="right", va="center",
                      fontsize=8)
            rows[case.name] = below
            below += 1
    for cell in cells:
        _cell(axes, edges[cell.family, cell.method], rows[cell.case], cell)
    _heads(axes, edges)
    _legend(figure, inches)
    problems = sum({c.case: c.total for c in cells}.values())
    figure.text(
        0.1 / inches[0], 1 - 0.2 / inches[1], "Hard cases of camera pose estimation",
        fontsize=12, fontweight="bold", va="center",
    )
    figure.text(
        0.1 / inches[0], 1 - 0.42 / inches[1], f"{len(rows)} cases, {problems} noise-free problems",
        fontsize=8.5, va="center", color="#444444",
    )
    with Path(path).open("wb") as file:
        figure.savefig(file, format=Path(path).suffix.lstrip(".") or "png")


def _cell(axes: Axes, left: float, row: float, cell: Cell) -> None:
    """Draws a bar with the fraction of each outcome, the worst last, with signs on wide parts."""
    at, margin = left + 0.03, 0.06
    shares = share_of(cell)
    for show in reversed(worst_first(shares)):
        size = 0.94 * shares[show]
        axes.add_patch(Rectangle((at, row + margin), size, 1 - 2 * margin, color=show.colour, lw=0))
        if size > 0.2:
            axes.text(at + size / 2, row + 0.52, show.sign, ha="center", va="center", fontsize=6.5,
                      color=show.ink, fontweight="bold" if show.harmful else "normal")
        at += size


def _heads(axes: Axes, edges: dict[tuple[str, str], float]) -> None:
    for (family, method), left in edges.items():
        bold = "bold" if family == "libocc" else "normal"
        axes.text(
            left + 0.4, -0.25, method, rotation=50, ha="left", va="bottom", fontsize=8,
            rotation_mode="anchor", fontweight=bold,
        )
    for family in dict.fromkeys(family for family, _ in edges):
        lefts = [left for (of, _), left in edges.items() if of == family]
        bottom = axes.get_ylim()[0]
        axes.plot([min(lefts) + 0.03, max(lefts) + 0.97], [bottom + 0.25] * 2, color="#444444",
                  lw=1, clip_on=False)
        axes.text((min(lefts) + max(lefts) + 1) / 2, bottom + 0.4, family.replace(" ", "\n"),
                  ha="center", va="top", fontsize=8, fontweight="bold")


def _legend(figure: Figure, inches: tuple[float, float]) -> None:
    axes = figure.add_axes((0, 0, 1, 0.42 / inches[1]), xlim=(0, inches[0]), ylim=(0.42, 0))
    axes.axis("off")
    per_line = -(-len(Show) // 2)
    step = (inches[0] - 0.2) / per_line
    for i, show in enumerate(Show):
        x, y = 0.1 + step * (i % per_line), 0.02 + 0.2 * (i // per_line)
        axes.add_patch(Rectangle((x, y), 0.22, 0.15, color=show.colour, lw=0))
        axes.text(x + 0.11, y + 0.08, show.sign, ha="center", va="center", fontsize=6.5, color=show.ink)
        axes.text(x + 0.28, y + 0.08, show.label, ha="left", va="center", fontsize=7.5)
