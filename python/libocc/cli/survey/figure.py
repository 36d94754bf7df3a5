# SPDX-License-Identifier: Apache-2.0
"""Plan of a surveyed room: lamps with enlarged error ellipses, and the places of the pictures."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from ..._core import Lamp, LampShape
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


def outline(lamp: Lamp) -> Circle | Polygon:
    style: dict[str, Any] = {"facecolor": "#F0C000", "edgecolor": "#806000", "linewidth": 0.8}
    if lamp.shape == LampShape.rectangle:
        side, normal = np.asarray(lamp.x_axis), np.asarray(lamp.normal)
        across = np.cross(normal, side)
        a, b = 0.5 * np.asarray(lamp.size_m)
        corners = [lamp.centre_m + u * a * side + v * b * across for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        return Polygon(np.array(corners)[:, :2], **style)
    return Circle(tuple(lamp.centre_m[:2]), lamp.radius_m, **style)
