# SPDX-License-Identifier: Apache-2.0
"""Texts of a picture: labels of points that do not overlap, and lines that fit into a width."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Directions in which a label is tried, the preferred one first, and its distance from the point in steps.
DIRECTIONS = [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)]
RINGS, RING_STEP = 30, 0.5  # RING_STEP in heights of the label
MANY, RINGS_OF_MANY = 100, 3  # more labels than MANY overlap anyway; fewer rings bound the time
MIN_REACH_PX, OBSTACLE_PX = 3.0, 2.0  # half sides of the squares that labels avoid
LEADER_RING = 2  # from this ring on, a line joins label and point


@dataclass
class Label:
    """Text at a point of the axes, at least `reach` (in units of the axes; also in x and in y) away from it."""

    text: str
    at: tuple[float, float]
    reach: float | tuple[float, float] = 0
    colour: str = "black"


def text_size(figure: Figure, text: str, fontsize: float, **style: Any) -> tuple[float, float]:
    """Width and height of a text [px of the figure]."""
    trial = figure.text(0, 0, text, fontsize=fontsize, **style)
    box = trial.get_window_extent()
    trial.remove()
    return float(box.width), float(box.height)


def wrapped(figure: Figure, text: str, width_px: float, fontsize: float) -> str:
    """Breaks the lines of a text at spaces, and words that are longer than a line anywhere."""
    lines: list[str] = []
    for paragraph in text.split("\n"):
        line = ""
        for word in paragraph.split(" "):
            longer = f"{line} {word}" if line else word
            if text_size(figure, longer, fontsize)[0] <= width_px:
                line = longer
                continue
            if line.strip():
                lines.append(line.rstrip())
            *full, line = _cut(figure, word, width_px, fontsize)
            lines += full
        lines.append(line)
    return "\n".join(lines)


def _cut(figure: Figure, word: str, width_px: float, fontsize: float) -> list[str]:
    """Parts of a word that fit into the width."""
    parts = [""]
    for letter in word:
        if parts[-1] and text_size(figure, parts[-1] + letter, fontsize)[0] > width_px:
            parts.append("")
        parts[-1] += letter
    return parts


def add_labels(
    axes: Axes, labels: Sequence[Label], fontsize: float, *, obstacles: ArrayLike = (), **style: Any
) -> list[Annotation]:
    """Writes labels beside their points so that they overlap neither each other nor the points.

    obstacles: (n, 2) further points, in units of the axes, that labels should not cover. style: of the texts.
    The layout of the figure, its limits and its scales must be final. A label that finds no free place near its
    point is written at the place with the smallest overlap.
    """
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    to_px = axes.transData.transform
    points = np.array([to_px(label.at) for label in labels]).reshape(-1, 2)
    edges = np.array([to_px(np.add(label.at, label.reach)) for label in labels]).reshape(-1, 2)
    reaches = np.maximum(np.abs(edges - points), MIN_REACH_PX)
    extra = np.asarray(obstacles, float).reshape(-1, 2)
    extra = to_px(extra) if len(extra) else extra
    taken = np.vstack([_boxes(points, reaches), _boxes(extra, OBSTACLE_PX), np.zeros((len(labels), 4))])
    window = axes.get_window_extent()
    frame = np.array([window.x0, window.y0, window.x1, window.y1])
    sizes = {text: np.array(text_size(figure, text, fontsize, **style)) for text in {x.text for x in labels}}
    used, written = len(points) + len(extra), []
    rings = RINGS if len(labels) <= MANY else RINGS_OF_MANY
    for label, point, reach in zip(labels, points, reaches, strict=True):
        size = sizes[label.text] + 2
        centre, ring = _free_place(point, reach + 0.2 * size[1], size, taken[:used], frame, rings)
        taken[used] = _boxes(centre, size / 2)
        used += 1
        offset = (centre - point) * 72 / figure.dpi
        leader = {"arrowstyle": "-", "color": label.colour, "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "alpha": 0.7}
        annotation = axes.annotate(
            label.text,
            label.at,
            (float(offset[0]), float(offset[1])),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=fontsize,
            color=label.colour,
            arrowprops=leader if ring >= LEADER_RING else None,
            **style,
        )
        annotation.set_in_layout(False)
        written.append(annotation)
    return written


def _free_place(point: Array, reach: Array, size: Array, taken: Array, frame: Array, rings: int) -> tuple[Array, int]:
    """Centre of the first place without overlap, and its ring; or else the place with the smallest overlap."""
    farthest = reach + rings * RING_STEP * size[1] + size
    near = taken[_overlaps(_boxes(point, farthest), taken) > 0]
    best, best_overlap = (point, 0), np.inf
    for ring in range(rings):
        for direction in DIRECTIONS:
            centre = point + np.array(direction) * (reach + ring * RING_STEP * size[1] + size / 2)
            box = _boxes(centre, size / 2)
            outside = float(np.prod(size)) - float(_overlaps(box, frame[None])[0])
            overlap = float(_overlaps(box, near).sum()) + (outside if outside > 1e-6 else 0)
            if overlap == 0:
                return centre, ring
            if overlap < best_overlap:
                best, best_overlap = (centre, ring), overlap
    return best


def _boxes(centres: Array, half_size: Array | float) -> Array:
    """Boxes (x0, y0, x1, y1) around centres."""
    return np.concatenate([centres - half_size, centres + half_size], axis=-1)


def _overlaps(box: Array, others: Array) -> Array:
    """Areas that a box has in common with others."""
    sides = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return np.asarray(np.maximum(sides, 0).prod(axis=1))
