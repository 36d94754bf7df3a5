# SPDX-License-Identifier: Apache-2.0
"""Plot of a run: path over the room; errors (sigmas if the truth is unknown) and states over time."""

from typing import IO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ..._core import Scene
from .record import Record

STATES = {
    "tracking": "#009E73", "coasting": "#E69F00", "searching": "#999999", "lost": "#D55E00", "skipped": "#CC79A7",
}
AXES = (("x", "#0072B2"), ("y", "#D55E00"), ("z", "#009E73"))


def draw(file: IO[bytes], records: list[Record], scene: Scene, title: str = "") -> None:
    """Writes a PNG."""
    figure = Figure(figsize=(12, 5), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(4, 2, width_ratios=(5, 6), height_ratios=(4, 4, 4, 1))
    _path(figure.add_subplot(grid[:, 0]), records, scene)
    timed = [r for r in records if r.time_s is not None]
    begun_s = min((r.time_s for r in timed if r.time_s is not None), default=0.0)
    first: Axes | None = None
    for i, (name, colour) in enumerate(AXES):
        axes = figure.add_subplot(grid[i, 1], sharex=first)
        first = first or axes
        _errors(axes, timed, begun_s, i, colour)
        axes.set_ylabel(f"{name} [mm]")
        axes.tick_params(labelbottom=False)
    assert first is not None
    with_truth = any(r.error_m is not None for r in timed)
    first.set_title("error against the truth and 3 sigma" if with_truth else "3 sigma of the position", fontsize=10)
    states = figure.add_subplot(grid[3, 1], sharex=first)
    _states(states, timed, begun_s)
    if title:
        figure.suptitle(title, fontsize=11)
    figure.savefig(file, format="png")


def _path(axes: Axes, records: list[Record], scene: Scene) -> None:
    if scene.room is not None:
        axes.add_patch(Rectangle((0, 0), *scene.room.size_m[:2], fill=False, color="#666666", linewidth=1.5))
    true = np.array([r.truth_m for r in records if r.truth_m is not None])
    if len(true):
        axes.plot(true[:, 0], true[:, 1], color="#444444", linewidth=1, linestyle="--", label="truth")
    for state in ("tracking", "coasting"):
        at = np.array([r.pose.position_m for r in records if r.pose is not None and r.state == state])
        if len(at):
            axes.plot(at[:, 0], at[:, 1], ".", color=STATES[state], markersize=2.5, label=state)
    lamps = np.array([lamp.centre_m for lamp in scene.lamps])
    if len(lamps):
        axes.plot(
            lamps[:, 0], lamps[:, 1], "o", color="#F0C000", markeredgecolor="#806000", markersize=9, label="lamps"
        )
        for lamp in scene.lamps:
            x, y, _ = lamp.centre_m
            axes.annotate(str(lamp.id), (x, y), xytext=(7, 5), textcoords="offset points", fontsize=9)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.set_title("path from above", fontsize=10)
    axes.grid(alpha=0.3)
    if len(lamps) or len(true):
        axes.legend(fontsize=8, ncol=4, loc="upper center", bbox_to_anchor=(0.5, -0.12), frameon=False)


def _errors(axes: Axes, records: list[Record], begun_s: float, axis: int, colour: str) -> None:
    """Draws error and 3 sigma of one axis, with gaps where there is no pose."""
    time_s = np.array([(r.time_s or 0.0) - begun_s for r in records])
    sigma = np.array([np.nan if r.pose is None else r.pose.sigmas_m[axis] for r in records], float)
    error = np.array([np.nan if r.error_m is None else r.error_m[axis] for r in records], float)
    axes.fill_between(time_s, -3e3 * sigma, 3e3 * sigma, color=colour, alpha=0.2, linewidth=0)
    if np.isfinite(error).any():
        axes.plot(time_s, 1e3 * error, color=colour, linewidth=0.9)
    shown = np.concatenate([3e3 * sigma[np.isfinite(sigma)], 1e3 * np.abs(error[np.isfinite(error)])])
    if len(shown):  # percentile: sigma during long times without lamps would hide everything else
        top = 1.1 * float(np.percentile(shown, 97)) + 1e-3
        axes.set_ylim(-top, top)
    axes.grid(alpha=0.3)


def _states(axes: Axes, records: list[Record], begun_s: float) -> None:
    begins = [(r.time_s or 0.0) - begun_s for r in records]
    last = begins[-1] - begins[-2] if len(begins) > 1 else 1.0
    ends = [*begins[1:], *[begin + last for begin in begins[-1:]]]
    for state, colour in STATES.items():
        spans = [(b, e - b) for b, e, r in zip(begins, ends, records, strict=True) if r.state == state]
        if spans:
            axes.broken_barh(spans, (0, 1), color=colour, label=state)
    axes.set(xlabel="time since the first frame [s]", yticks=[], ylim=(0, 1))
    axes.legend(fontsize=7, ncol=5, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
