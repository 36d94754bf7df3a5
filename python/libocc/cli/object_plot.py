# SPDX-License-Identifier: Apache-2.0
"""Plot of an object's points and of the value of each point for the pose."""

from typing import IO, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .._core import LocalisationValue, Object

SEEN, GROWTH = "#7fb3d5", "#0072B2"


def order_of(value: LocalisationValue) -> list[int]:
    """Indices of the points, most valuable first: by the share of precision that is lost without the point."""

    def worth(i: int) -> float:
        point = value.points[i]
        return point.needed + (point.seen - point.needed) * (1 - 1 / point.growth)

    return sorted(range(len(value.points)), key=worth, reverse=True)


def draw(file: IO[bytes], object: Object, value: LocalisationValue, title: str) -> None:
    """Writes a PNG: the points in space, and for each point how often it is seen and what its loss costs."""
    places = np.array([point.position_m for point in object.points])
    growth = np.array([100 * (point.growth - 1) for point in value.points])
    order = order_of(value)
    height = max(4.5, 1.2 + 0.27 * len(order))
    figure = Figure(figsize=(12, height), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(1, 3, width_ratios=(1.5, 1, 1))
    space: Any = figure.add_subplot(grid[0], projection="3d")
    shown = space.scatter(*places.T, c=growth, cmap="viridis", s=60, depthshade=False, edgecolor="black")
    for point in object.points:
        space.text(*point.position_m, f" {point.id}", fontsize=9)
    space.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    for axis in (space.xaxis, space.yaxis, space.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    low, high = places.min(axis=0), places.max(axis=0)
    space.set_box_aspect(np.maximum(high - low, 0.15 * (high - low).max()))
    figure.colorbar(shown, ax=space, shrink=0.7, pad=0.12, label="growth of sigma without the point [%]")
    rows = np.arange(len(order))[::-1]
    names = [f"{object.points[i].label} {object.points[i].id}".strip() for i in order]
    seen = figure.add_subplot(grid[1])
    seen.barh(rows, [100 * value.points[i].seen for i in order], color=SEEN, label="seen")
    seen.barh(rows, [100 * value.points[i].needed for i in order], height=0.4, color="#D55E00", label="needed")
    seen.set(xlabel="views [%]", yticks=rows, yticklabels=names, xlim=(0, 100))
    figure.legend(*seen.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=9)
    worth = figure.add_subplot(grid[2], sharey=seen)
    worth.barh(rows, growth[order], color=GROWTH)
    worth.set(xlabel="growth of sigma without the point [%]")
    worth.tick_params(labelleft=False)
    figure.suptitle(title, fontsize=11)
    figure.savefig(file, format="png")
