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

# The picture is narrow enough to be legible at the width of a page: a label of LABEL_PT is 9 px high on 830 px.
CELL_W_IN, CELL_H_IN, LABEL_IN, HEAD_IN, FOOT_IN = 0.23, 0.16, 1.95, 1.4, 0.95
LABEL_PT, SIGN_PT = 8, 6
GAP = 0.4  # columns between families
HEADING = 1.3  # rows above each group
MIN_WIDTH_IN = 5.0  # for title and legend
DOTS_PER_INCH = 160


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
    inches = max(LABEL_IN + width * CELL_W_IN + 0.3, MIN_WIDTH_IN), HEAD_IN + height * CELL_H_IN + FOOT_IN
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
                      fontsize=LABEL_PT)
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
    at, margin = left + 0.04, 0.06
    shares = share_of(cell)
    for show in reversed(worst_first(shares)):
        size = 0.92 * shares[show]
        axes.add_patch(Rectangle((at, row + margin), size, 1 - 2 * margin, color=show.colour, lw=0))
        if size > 0.35:
            axes.text(at + size / 2, row + 0.54, show.sign, ha="center", va="center", fontsize=SIGN_PT,
                      color=show.ink, fontweight="bold" if show.harmful else "normal")
        at += size


def _heads(axes: Axes, edges: dict[tuple[str, str], float]) -> None:
    for (family, method), left in edges.items():
        bold = "bold" if family == "libocc" else "normal"
        axes.text(
            left + 0.6, -0.2, method, rotation=60, ha="left", va="bottom", fontsize=LABEL_PT,
            rotation_mode="anchor", fontweight=bold,
        )
    for family in dict.fromkeys(family for family, _ in edges):
        lefts = [left for (of, _), left in edges.items() if of == family]
        bottom = axes.get_ylim()[0]
        axes.plot([min(lefts) + 0.03, max(lefts) + 0.97], [bottom + 0.25] * 2, color="#444444",
                  lw=1, clip_on=False)
        axes.text((min(lefts) + max(lefts) + 1) / 2, bottom + 0.4, family.replace(" ", "\n"),
                  ha="center", va="top", fontsize=LABEL_PT, fontweight="bold")


def _legend(figure: Figure, inches: tuple[float, float]) -> None:
    axes = figure.add_axes((0, 0, 1, 0.42 / inches[1]), xlim=(0, inches[0]), ylim=(0.42, 0))
    axes.axis("off")
    per_line = -(-len(Show) // 2)
    widths = [max(len(show.label) for show in list(Show)[i::per_line]) for i in range(per_line)]
    starts = [0.1 + (inches[0] - 0.2) * sum(widths[:i]) / sum(widths) for i in range(per_line)]
    for i, show in enumerate(Show):
        x, y = starts[i % per_line], 0.02 + 0.2 * (i // per_line)
        axes.add_patch(Rectangle((x, y), 0.22, 0.15, color=show.colour, lw=0))
        axes.text(x + 0.11, y + 0.08, show.sign, ha="center", va="center", fontsize=SIGN_PT, color=show.ink)
        axes.text(x + 0.26, y + 0.08, show.label, ha="left", va="center", fontsize=7.5)
