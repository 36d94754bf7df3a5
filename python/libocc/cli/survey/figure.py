# SPDX-License-Identifier: Apache-2.0
"""Plan of a surveyed room: lamps with enlarged error ellipses, and the places of the pictures."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from ..._core import Lamp, LampFate, LampShape, LampUpdate
from ..calibration.figures import BLUE, INK, ORANGE, new_figure, round_scale

ELLIPSE_PART = 0.15  # size of the largest drawn ellipse, as a part of the plan


def plan(
    lamps: Sequence[Lamp], covariances_m2: NDArray[np.float64], cameras_m: NDArray[np.float64], joined: bool, unit: str
) -> Figure:
    """Plan view from above.

    lamps: with covariances (n, 3, 3) of their positions. cameras_m: (m, 3) in the order of the pictures. joined: draws
    a line through the cameras.
    """
    at = np.array([lamp.centre_m for lamp in lamps])[:, :2]
    both = np.vstack([at, cameras_m[:, :2]])
    low, high = both.min(axis=0), both.max(axis=0)
    extent = float(max(high - low)) or 1.0
    values, vectors = np.linalg.eigh(covariances_m2[:, :2, :2])
    axes_m = 6 * np.sqrt(np.maximum(values, 0))  # full axes of the ellipse of 3 sigma
    largest = float(axes_m.max())
    factor = round_scale(ELLIPSE_PART * extent / largest) if largest > 0 else 1.0
    figure = new_figure(8, 8 * float(np.clip((high[1] - low[1]) / max(high[0] - low[0], 1e-9), 0.45, 1.1)) + 0.7)
    axes = figure.add_subplot()
    for lamp in lamps:
        axes.add_patch(outline(lamp))
    angles = np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    axes.add_collection(EllipseCollection(
        factor * axes_m[:, 1], factor * axes_m[:, 0], angles, units="xy", offsets=at, transOffset=axes.transData,
        facecolors="none", edgecolors=ORANGE, linewidths=1.2,
    ))
    for lamp, place in zip(lamps, at):
        axes.annotate(str(lamp.id), place, xytext=(7, 7), textcoords="offset points", fontsize=10, color=INK)
    line = "-" if joined else "none"
    axes.plot(cameras_m[:, 0], cameras_m[:, 1], color=BLUE, linestyle=line, linewidth=0.8, marker="^", markersize=5)
    margin = 0.12 * extent
    axes.set(
        xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal",
        xlabel=f"x [{unit}]", ylabel=f"y [{unit}]",
    )
    axes.set_title(
        f"{len(lamps)} lamps with ids; ellipses of 3 sigma x {factor:g}; triangles: {len(cameras_m)} pictures",
        fontsize=10,
    )
    return figure


FATES = {  # colour of the outline, filled, text of the legend
    LampFate.unchanged: ("#806000", True, "unchanged"),
    LampFate.changed: ("#CC79A7", True, "changed"),
    LampFate.moved: (BLUE, True, "moved"),
    LampFate.gone: ("#C00000", False, "gone"),
    LampFate.not_seen: ("#909090", False, "not seen"),
    LampFate.added: ("#009E73", True, "new"),
}


def update_plan(updates: Sequence[LampUpdate], cameras_m: NDArray[np.float64], joined: bool) -> Figure:
    """Plan view from above: what became of each lamp, with arrows from old to new places.

    cameras_m: (m, 3) places of the pictures. joined: draws a line through them.
    """
    at = np.array([update.lamp.centre_m for update in updates])[:, :2]
    old = [np.asarray(u.old_centre_m)[None, :2] for u in updates if u.fate == LampFate.moved]
    everything = np.vstack([at, cameras_m[:, :2], *old])
    low, high = everything.min(axis=0), everything.max(axis=0)
    extent = float(max(high - low)) or 1.0
    figure = new_figure(8, 8 * float(np.clip((high[1] - low[1]) / max(high[0] - low[0], 1e-9), 0.45, 1.1)) + 1.1)
    axes = figure.add_subplot()
    ring = 0.025 * extent  # around lamps that changed, because lamps are small in a plan
    for update, place in zip(updates, at):
        color, filled, _ = FATES[update.fate]
        face = "#F0C000" if filled else "white"
        axes.add_patch(outline(update.lamp, facecolor=face, edgecolor=color))
        if update.fate == LampFate.unchanged:
            label = str(update.lamp.id)
        else:
            radius = max(ring, 1.3 * float(update.lamp.radius_m))
            style = "--" if update.fate == LampFate.not_seen else "-"
            axes.add_patch(Circle(tuple(place), radius, fill=False, edgecolor=color, linewidth=1.6, linestyle=style))
            label = f"{update.lamp.id} {FATES[update.fate][2]}"
        if update.fate == LampFate.gone:
            half = 0.7 * ring
            for sign in (-1, 1):
                axes.plot([place[0] - half, place[0] + half], [place[1] - sign * half, place[1] + sign * half],
                          color=color, linewidth=1.6)
        if update.fate == LampFate.moved:
            axes.annotate("", place, xytext=tuple(update.old_centre_m[:2]),
                          arrowprops={"arrowstyle": "->", "color": color, "linewidth": 1.6})
            axes.plot(*update.old_centre_m[:2], marker="x", markersize=6, color=color)
            label += f" {1e3 * float(np.linalg.norm(update.displacement_m)):.0f} mm"
        is_right = place[0] > high[0] - 0.15 * extent  # a label to the right would leave the plan
        axes.annotate(label, place, xytext=(-9 if is_right else 9, 9), textcoords="offset points", fontsize=9,
                      color=INK, ha="right" if is_right else "left")
    line = "-" if joined else "none"
    axes.plot(cameras_m[:, 0], cameras_m[:, 1], color=BLUE, linestyle=line, linewidth=0.6, marker="^", markersize=4,
              alpha=0.6)
    margin = 0.12 * extent
    axes.set(
        xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal",
        xlabel="x [m]", ylabel="y [m]",
    )
    counts = [f"{sum(u.fate == fate for u in updates)} {text}" for fate, (_, _, text) in FATES.items()]
    axes.set_title(f"lamps: {', '.join(counts)}\ntriangles: {len(cameras_m)} pictures", fontsize=10)
    return figure


def outline(lamp: Lamp, facecolor: str = "#F0C000", edgecolor: str = "#806000") -> Circle | Polygon:
    style: dict[str, Any] = {"facecolor": facecolor, "edgecolor": edgecolor, "linewidth": 0.8}
    if lamp.shape == LampShape.rectangle:
        side, normal = np.asarray(lamp.x_axis), np.asarray(lamp.normal)
        across = np.cross(normal, side)
        a, b = 0.5 * np.asarray(lamp.size_m)
        corners = [lamp.centre_m + u * a * side + v * b * across for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        return Polygon(np.array(corners)[:, :2], **style)
    return Circle(tuple(lamp.centre_m[:2]), lamp.radius_m, **style)
