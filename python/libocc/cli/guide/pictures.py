# SPDX-License-Identifier: Apache-2.0
"""Pictures of an experiment: paths over the received power, errors over time, docking errors."""

from collections.abc import Sequence
from typing import IO, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray

from ..._core import Route, Scene
from ...guide.docking_test import DEGREE, DockingTest
from ...guide.experiment import Experiment
from ...maps import power_map
from ..maps.picture import INK, LAMP, new_figure, power_bar, power_panel, power_range, save

Columns = dict[str, NDArray[np.float64]]

ROUTE, TRUTH, ESTIMATE, BLIND = "#444444", "#0072B2", "#009E73", "#CC3311"
ROUTE_WIDTH, PATH_WIDTH, BLIND_WIDTH = 7, 1, 3  # points: the route is a band that the paths do not cover
STATES = ("searching", "tracking", "coasting", "lost")
STATE_COLOURS = ("#EE7733", "#FFFFFF", "#FFE9A8", "#F4B6B0")
TRACKING = 1


def draw_paths(file: IO[bytes], experiment: Experiment, runs: Sequence[Columns], title: str) -> None:
    """Route and driven paths over the power that an upright camera receives."""
    figure, (axes,) = new_figure(1, 1, (7.2, 6.0))
    made = power_map(
        experiment.scene, height_m=float(experiment.options.camera_place_m[2]), step_m=0.05, rung=None
    )
    power_bar(figure, power_panel(axes, made, power_range([made])), [axes])
    draw_route(axes, experiment.route)
    for i, run in enumerate(runs):
        label = "driven" if i == 0 else None
        axes.plot(run["true_x_m"], run["true_y_m"], color=TRUTH, lw=PATH_WIDTH, alpha=0.7, label=label)
        blind = np.where(run["state"] == TRACKING, np.nan, run["true_x_m"])
        if not np.isnan(blind).all():
            axes.plot(blind, run["true_y_m"], color=BLIND, lw=BLIND_WIDTH, label="without lamps" if i == 0 else None)
    draw_room(axes, experiment.scene)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4, fontsize=8, frameon=False)
    axes.set_title(f"{title}; power of an upright camera that heads along X", fontsize=9, color=INK)
    save(file, figure)


def draw_route(axes: Axes, route: Route) -> None:
    sampled = route.sampled(0.02)
    edge = [Stroke(linewidth=ROUTE_WIDTH + 1.5, foreground=ROUTE), Normal()]
    axes.plot(sampled[:, 1], sampled[:, 2], color="white", lw=ROUTE_WIDTH, path_effects=edge, label="route")
    if (dock := route.dock) is not None:
        ahead = 0.15 * np.array([np.cos(dock.heading_rad), np.sin(dock.heading_rad)])
        axes.annotate(
            "", (dock.x_m, dock.y_m), (dock.x_m - ahead[0], dock.y_m - ahead[1]),
            arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.5},
        )
        axes.plot(dock.x_m, dock.y_m, "s", color=INK, ms=7, label="dock", zorder=3)


def draw_room(axes: Axes, scene: Scene) -> None:
    for box in scene.boxes:
        size = np.subtract(box.max_m, box.min_m)
        axes.add_patch(Rectangle(tuple(box.min_m[:2]), size[0], size[1], color="#777777", zorder=2))
    for lamp in scene.lamps:
        axes.plot(*lamp.centre_m[:2], "o", color=LAMP, ms=6, mec="white", zorder=4)


def draw_errors(file: IO[bytes], run: Columns, frames: Columns, title: str) -> None:
    """Errors of the estimate with 3-sigma bands, deviation from the route, number of lamps, and protection level."""
    protected = "protection_level_m" in run
    figure = Figure(figsize=(9, 10.8 if protected else 9), dpi=90, layout="constrained")
    rows: Any = figure.subplots(6 if protected else 5, 1, sharex=True)
    time_s = run["time_s"]
    known = np.isin(run["state"], (1, 2))
    for axes, name, unit, scale in (
        (rows[0], "x_m", "x error [mm]", 1e3), (rows[1], "y_m", "y error [mm]", 1e3),
        (rows[2], "heading_rad", "heading error [deg]", 1 / DEGREE),
    ):
        error = run[name] - run[f"true_{name}"]
        if name == "heading_rad":
            error = (error + np.pi) % (2 * np.pi) - np.pi
        draw_band(axes, time_s, scale * np.where(known, error, np.nan), scale * run[f"sigma_{name}"], run["state"])
        axes.set_ylabel(unit, fontsize=8)
    on_route = run["docking"] == 0
    rows[3].plot(time_s, 1e3 * np.where(on_route, run["deviation_m"], np.nan), color=TRUTH, lw=0.9)
    rows[3].axhline(0, color=INK, lw=0.5)
    rows[3].set_ylabel("deviation to the left [mm]", fontsize=8)
    received = frames["lost"] == 0
    rows[4].step(
        frames["captured_s"][received], frames["lamps_in_view"][received], where="post", color=ROUTE, lw=1,
        label="completely in view",
    )
    rows[4].step(
        frames["arrived_s"][received], frames["lamps_used"][received], where="post", color=ESTIMATE, lw=1, label="used"
    )
    if not received.all():
        lost_s = frames["captured_s"][~received]
        rows[4].plot(lost_s, np.zeros(len(lost_s)), "|", color=BLIND, ms=6, label="image lost")
    rows[4].set_ylabel("lamps", fontsize=8)
    rows[4].set_ylim(bottom=-0.3)
    rows[4].legend(fontsize=7, loc="lower right", ncols=3)
    if protected:
        draw_level(rows[5], run, known)
    rows[-1].set_xlabel("time [s]", fontsize=8)
    for axes in rows:
        shade_states(axes, time_s, run["state"])
        axes.tick_params(labelsize=7)
    figure.suptitle(title, fontsize=10, color=INK)
    save(file, figure)


def draw_level(axes: Axes, run: Columns, known: NDArray[np.bool_]) -> None:
    """Length of the position's error, and its bound."""
    error_m = np.hypot(run["x_m"] - run["true_x_m"], run["y_m"] - run["true_y_m"])
    axes.semilogy(run["time_s"], 1e3 * np.where(known, error_m, np.nan), color=TRUTH, lw=0.8, label="error")
    axes.semilogy(run["time_s"], 1e3 * run["protection_level_m"], color=ESTIMATE, lw=1.2, label="protection level")
    axes.fill_between(
        run["time_s"], 0, 1, where=run["alert"] == 1, transform=axes.get_xaxis_transform(), color=BLIND, alpha=0.2,
        lw=0, label="above the alert limit: stopped",
    )
    axes.set_ylabel("position [mm]", fontsize=8)
    axes.legend(fontsize=7, loc="lower right", ncols=3)


def draw_band(
    axes: Axes, time_s: NDArray[Any], error: NDArray[Any], sigma: NDArray[Any], state: NDArray[Any]
) -> None:
    axes.fill_between(time_s, -3 * sigma, 3 * sigma, color=ESTIMATE, alpha=0.2, lw=0)
    axes.plot(time_s, error, color=TRUTH, lw=0.8)
    axes.axhline(0, color=INK, lw=0.5)
    # The scale follows the tracked part, because sigma without lamps is much larger.
    tracked = state == TRACKING
    if tracked.any():
        limit = 1.2 * float(np.quantile(np.abs([error[tracked], 3 * sigma[tracked]]), 0.995))
        axes.set_ylim(-limit, limit)


def shade_states(axes: Axes, time_s: NDArray[Any], state: NDArray[Any]) -> None:
    changes = np.flatnonzero(np.diff(state)) + 1
    for begin, end in zip([0, *changes], [*changes, len(state)], strict=True):
        kind = int(state[begin])
        if kind != TRACKING:
            axes.axvspan(time_s[begin], time_s[end - 1], color=STATE_COLOURS[kind], alpha=0.5, lw=0)


def draw_dockings(file: IO[bytes], test: DockingTest, title: str) -> None:
    """Position and heading errors of each repetition in the dock."""
    figure, (place, heading) = new_figure(2, 1, (4.4, 4.2))
    limit = 1e3 * test.limits.position_m
    place.add_patch(Circle((0, 0), limit, fill=False, color=BLIND, lw=1, ls="--"))
    docked = [one for one in test.repetitions if one.docked]
    for one in docked:
        good = one.succeeds(test.limits)
        place.plot(1e3 * one.across_m, 1e3 * one.along_m, "o" if good else "x", color=TRUTH if good else BLIND, ms=5)
    reach = 1.15 * max([limit, *(1e3 * one.position_m for one in docked)])
    place.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    place.set_xlabel("across [mm]", fontsize=8)
    place.set_ylabel("along [mm]", fontsize=8)
    place.set_title("position in the dock; dashed: limit", fontsize=9)
    degrees = test.limits.heading_rad / DEGREE
    heading.plot([one.heading_rad / DEGREE for one in docked], "o", color=TRUTH, ms=4)
    for side in (-degrees, degrees):
        heading.axhline(side, color=BLIND, lw=1, ls="--")
    heading.set_xlabel("repetition", fontsize=8)
    heading.set_ylabel("heading [deg]", fontsize=8)
    heading.set_title("heading", fontsize=9)
    for axes in (place, heading):
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.suptitle(title, fontsize=10, color=INK)
    save(file, figure)
