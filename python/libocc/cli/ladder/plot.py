# SPDX-License-Identifier: Apache-2.0
"""Plot of error against time, one marker per rung."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from matplotlib.transforms import Bbox

from .figures import Row

ENDINGS = (".png", ".svg", ".pdf")
# Palette of Okabe and Ito, distinguishable with colour vision deficiency; the markers differ as well.
OURS, OPENGV, PEER, LITERATURE, FRONT, INK = "#0072B2", "#009E73", "#D55E00", "#CC79A7", "#0072B2", "#222222"
FAMILIES = {
    "libocc": (OURS, "o"), "OpenGV": (OPENGV, "D"), "OpenCV": (PEER, "s"), "PoseLib": (PEER, "^"),
    "literature": (LITERATURE, "v"),
}  # fmt: skip
HALO = [withStroke(linewidth=2.5, foreground="white")]
# Candidate offsets of a label: directions (right, up) and distances in multiples of NEAR points.
NEAR, STEPS = 7.0, (1.0, 2.2, 3.6, 5.2, 7.0, 9.0, 11.0, 13.0)
AROUND = ((1, 0), (1, 0.7), (1, -0.7), (0, 1), (0, -1), (-1, 0), (-1, 0.7), (-1, -0.7))


def drawable(rows: Sequence[Row]) -> list[Row]:
    """Rungs with an error and a bound."""
    return [row for row in rows if row.position_over_pixels > 0]


def draw(file: IO[bytes], ending: str, rows: Sequence[Row], title: str, note: str) -> None:
    """Writes the picture to an open file; ending: one of ENDINGS."""
    figure = Figure(figsize=(8.6, 5.2), dpi=150, facecolor="white")
    canvas: Any = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.08, 0.195, 0.9, 0.72))
    shown = drawable(rows)
    _frame(axes, shown)
    _front(axes, [row for row in shown if row.pareto])
    for row in shown:
        colour, marker = FAMILIES[row.family]
        axes.plot(
            row.time_median_s, row.position_over_pixels, marker, color=colour if row.reliable else "white",
            markeredgecolor=colour, markeredgewidth=1.3, markersize=7, zorder=3,
        )
    canvas.draw()
    _labels(axes, canvas.get_renderer(), shown)
    _legend(axes, shown)
    figure.text(0.012, 0.95, title, fontsize=12, fontweight="bold", color=INK, va="center")
    figure.text(0.012, 0.022, note, fontsize=8, color="#444444", va="center")
    figure.savefig(file, format=ending.lstrip("."))


def _frame(axes: Axes, rows: Sequence[Row]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    times = [row.time_median_s for row in rows] or [1e-6, 1e-3]
    errors = [row.position_over_pixels for row in rows] or [1.0]
    axes.set_xlim(min(times) / 2, max(times) * 2.8)
    axes.set_ylim(0.75, max(2.0, 1.6 * max(errors)))
    axes.axhline(1, color="#888888", linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    axes.text(
        0.004, 0.93, "Cramér-Rao bound of all pixels", fontsize=8, color="#555555", va="top",
        transform=axes.get_yaxis_transform(),
    )
    axes.set_xlabel("time per pose, from identified blobs (median)", fontsize=9.5, color=INK)
    axes.set_ylabel("position error / bound", fontsize=9.5, color=INK)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: seconds_text(value)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if max(errors) < 60 else (1,)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def seconds_text(value: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size * 0.9999:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def _front(axes: Axes, front: Sequence[Row]) -> None:
    """Draws the Pareto front as a staircase."""
    if not front:
        return
    x = [row.time_median_s for row in front]
    y = [row.position_over_pixels for row in front]
    right = axes.get_xlim()[1]
    axes.step([*x, right], [*y, y[-1]], where="post", color=FRONT, linewidth=1.4, alpha=0.55, zorder=2)


def _front_boxes(axes: Axes, front: Sequence[Row]) -> list[Bbox]:
    """Boxes of the staircase on the canvas, which labels must avoid."""
    to_canvas = axes.transData.transform
    at = [to_canvas((row.time_median_s, row.position_over_pixels)) for row in front]
    ends = [x for x, _ in at[1:]] + [axes.bbox.x1]
    flat = [Bbox.from_extents(x, y - 1, end, y + 1) for (x, y), end in zip(at, ends)]
    return flat + [Bbox.from_extents(x - 1, y, x + 1, above) for (x, y), (_, above) in zip(at[1:], at)]


def _legend(axes: Axes, rows: Sequence[Row]) -> None:
    families = dict.fromkeys(row.family for row in rows)
    for family in sorted(families, key=list(FAMILIES).index):
        colour, marker = FAMILIES[family]
        axes.plot([], [], marker, color=colour, markersize=6.5, label=family)
    axes.plot([], [], "-", color=FRONT, linewidth=1.4, alpha=0.55, label="Pareto front")
    if any(not row.reliable for row in rows):
        axes.plot([], [], "o", color="white", markeredgecolor="#555555", label="unreliable")
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.125), ncols=len(FAMILIES) + 2, frameon=False, fontsize=8,
        handletextpad=0.3, columnspacing=1.3,
    )


@dataclass(frozen=True)
class _Place:
    """A label's offset from its mark in points and its box on the canvas."""

    offset: tuple[float, float]
    align: tuple[str, str]
    box: Bbox


def _labels(axes: Axes, renderer: Any, rows: Sequence[Row]) -> None:
    """Places each label near its marker without overlapping others; distant labels get a line."""
    per_point = axes.figure.dpi / 72
    at = {i: axes.transData.transform((r.time_median_s, r.position_over_pixels)) for i, r in enumerate(rows)}
    taken = [Bbox.from_bounds(x - 5 * per_point, y - 5 * per_point, 10 * per_point, 10 * per_point)
             for x, y in at.values()]
    taken += _front_boxes(axes, [row for row in rows if row.pareto])
    order = sorted(at, key=lambda i: -sum(abs(at[i] - other).max() < 60 * per_point for other in at.values()))
    for i in order:
        row = rows[i]
        colour, _ = FAMILIES[row.family]
        weight = "bold" if row.family == "libocc" else "normal"
        name = f"{row.family} {row.name}" if row.family == "PoseLib" else row.name
        text = axes.text(0, 0, name, fontsize=8.5, fontweight=weight)
        size = text.get_window_extent(renderer)
        text.remove()
        place = _place(at[i], size.width, size.height, per_point, taken, axes.bbox)
        taken.append(place.box)
        far = max(map(abs, place.offset)) > 1.6 * NEAR
        axes.annotate(
            name, (row.time_median_s, row.position_over_pixels), place.offset,
            textcoords="offset points", ha=place.align[0], va=place.align[1], fontsize=8.5,
            fontweight=weight, color=colour, path_effects=HALO, zorder=4,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.7, "shrinkA": 1, "shrinkB": 3} if far else None,
        )


def _place(
    at: Any, width: float, height: float, per_point: float, taken: Sequence[Bbox], within: Bbox
) -> _Place:
    best: tuple[float, _Place] | None = None
    for step in STEPS:
        for right, up in AROUND:
            offset = right * NEAR * step, up * NEAR * step
            x, y = at[0] + offset[0] * per_point, at[1] + offset[1] * per_point
            left = x if right > 0 else x - width if right < 0 else x - width / 2
            low = y if up >= 1 else y - height if up <= -1 else y - height / 2
            box = Bbox.from_bounds(left - 2, low - 1, width + 4, height + 2)
            overlap = sum(_area(box, other) for other in taken)
            overlap += box.width * box.height - _area(box, within)
            horizontal = "left" if right > 0 else "right" if right < 0 else "center"
            vertical = "bottom" if up >= 1 else "top" if up <= -1 else "center"
            place = _Place(offset, (horizontal, vertical), box)
            if overlap <= 0.5:
                return place
            if best is None or overlap < best[0]:
                best = overlap, place
    assert best is not None
    return best[1]


def _area(a: Bbox, b: Bbox) -> float:
    """Area of the intersection."""
    width = float(min(a.x1, b.x1) - max(a.x0, b.x0))
    height = float(min(a.y1, b.y1) - max(a.y0, b.y0))
    return max(0.0, width) * max(0.0, height)


def ending_of(path: str) -> str:
    """Ending of the file name. Raises: ValueError for an unknown ending."""
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(f"{path}: the name of a plot must end with {', '.join(ENDINGS)}")
    return ending
