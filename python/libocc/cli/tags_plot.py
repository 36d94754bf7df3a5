# SPDX-License-Identifier: Apache-2.0
"""Plot of the detected AprilTags over their image."""

from collections.abc import Sequence
from typing import IO

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from .._core import AprilTag

COLOUR, OTHER = "#0072B2", "#D55E00"


def draw(
    file: IO[bytes],
    pixels: NDArray[np.uint8 | np.uint16],
    tags: Sequence[AprilTag],
    known: set[int],
    title: str,
) -> None:
    """Writes a PNG with the outline of each tag, its lower side thicker; tags that the map lacks are orange."""
    height, width = pixels.shape[:2]
    figure = Figure(figsize=(8, 8 * height / width + 0.6), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.imshow(pixels, cmap="gray", interpolation="nearest")
    for tag in tags:
        colour = COLOUR if tag.id in known else OTHER
        corners = tag.corners_px
        axes.add_patch(Polygon(corners, closed=True, fill=False, edgecolor=colour, linewidth=1.5))
        axes.plot(corners[:2, 0], corners[:2, 1], color=colour, linewidth=4)
        axes.annotate(
            str(tag.id), (tag.centre_px[0], tag.centre_px[1]), color="white", ha="center", va="center", fontsize=11,
            bbox={"boxstyle": "round", "facecolor": colour, "edgecolor": "none"},
        )
    axes.set(xlabel="x [px]", ylabel="y [px]", xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    axes.set_title(title, fontsize=10)
    figure.savefig(file, format="png")
