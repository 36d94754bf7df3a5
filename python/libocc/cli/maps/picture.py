# SPDX-License-Identifier: Apache-2.0
"""Picture of a power map: power, number of visible lamps, bound of the position."""

from collections.abc import Sequence
from typing import IO, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from ..._core import LampShape, Scene
from ...maps import PowerMap

NOTHING, INK, LAMP = "#d9d9d9", "#222222", "#D55E00"
HALO = [withStroke(linewidth=2, foreground="white")]
PANEL_IN = (4.2, 3.6)  # inches; a square map with labels and a colour bar


def new_figure(columns: int, rows: int, panel_in: tuple[float, float] = PANEL_IN) -> tuple[Figure, list[Axes]]:
    """Figure with panels, row by row."""
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.08)
    figure = Figure(figsize=(columns * panel_in[0], rows * panel_in[1]), dpi=90, layout=layout)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, list(axes.flat)


def save(file: IO[bytes], figure: Figure) -> None:
    figure.savefig(file, format="png", pil_kwargs={"optimize": True})


def draw(file: IO[bytes], made: PowerMap, scene_name: str) -> None:
    """Writes the map's three panels as PNG."""
    figure, (power, visible, bound) = new_figure(3, 1)
    power_bar(figure, power_panel(power, made, power_range([made])), [power])
    power.set_title("received power", fontsize=10)
    count = len(made.scene.lamps)
    visible_bar(figure, visible_panel(visible, made, count), [visible], count)
    visible.set_title("lamps in view", fontsize=10)
    bound_bar(figure, bound_panel(bound, made, bound_range([made])), [bound])
    by = "not computed" if made.rung is None else f"Cramér-Rao, {made.rung.name}"
    bound.set_title(f"bound of the position ({by})", fontsize=10)
    figure.suptitle(
        f"{scene_name}: camera at Z = {made.plane.height_m:g} m, {view_text(made)}", fontsize=11, fontweight="bold",
        color=INK,
    )
    save(file, figure)


def view_text(made: PowerMap) -> str:
    roll, pitch, yaw = made.rotation_deg
    return f"f = {made.focal_mm:g} mm, roll {roll:g}°, pitch {pitch:g}°, yaw {yaw:g}°"


def power_range(maps: Sequence[PowerMap]) -> tuple[float, float] | None:
    """Range of the power [dBm] over the points with a completely visible lamp, else over all lit points.

    Lamps cut by the border are excluded because their power can be arbitrarily small. None without light.
    """
    of_whole = _range([made.power_dbm[made.whole.any(axis=-1)] for made in maps], (0, 1), 0.5)
    return of_whole or _range([made.power_dbm for made in maps], (0, 1), 0.5)


def bound_range(maps: Sequence[PowerMap]) -> tuple[float, float] | None:
    """Range of the bound [mm] over all points with a bound; None without any."""
    found = _range([np.log10(1e3 * made.bound_m) for made in maps], (0, 0.99), 0.05)
    return None if found is None else (10 ** found[0], 10 ** found[1])


def _range(
    values: Sequence[NDArray[np.float64]], parts: tuple[float, float], min_half: float
) -> tuple[float, float] | None:
    finite = np.concatenate([value[np.isfinite(value)] for value in values])
    if not len(finite):
        return None
    low, high = np.quantile(finite, parts)
    middle, half = (low + high) / 2, max((high - low) / 2, min_half)
    return float(middle - half), float(middle + half)


def power_panel(axes: Axes, made: PowerMap, limits: tuple[float, float] | None) -> QuadMesh | None:
    """Draws the power. limits: of the colours [dBm], see power_range(); None: no point is lit."""
    mesh = limits and _mesh(axes, made, made.power_dbm, "viridis", Normalize(*limits))
    return _framed(axes, made, mesh, "no lamp in view")


def visible_panel(axes: Axes, made: PowerMap, lamps: int) -> QuadMesh | None:
    """Draws the number of visible lamps. lamps: number of colours."""
    shades = matplotlib.colormaps["Blues"](np.linspace(0.15, 0.95, max(lamps, 1)))
    colours = ListedColormap([NOTHING, *map(tuple, shades)])
    norm = BoundaryNorm(np.arange(-0.5, max(lamps, 1) + 1), max(lamps, 1) + 1)
    return _framed(axes, made, _mesh(axes, made, made.visible.astype(float), colours, norm), "")


def bound_panel(axes: Axes, made: PowerMap, limits: tuple[float, float] | None) -> QuadMesh | None:
    """Draws the bound. limits: of the colours [mm], see bound_range(); None: there is no bound."""
    mesh = limits and _mesh(axes, made, 1e3 * made.bound_m, "magma_r", LogNorm(*limits))
    return _framed(axes, made, mesh, "no bound")


def _mesh(axes: Axes, made: PowerMap, values: Any, colours: str | Colormap, norm: Normalize) -> QuadMesh:
    shown = np.ma.masked_invalid(values)
    return axes.pcolormesh(made.plane.x_m, made.plane.y_m, shown, shading="nearest", cmap=colours, norm=norm)


def _framed(axes: Axes, made: PowerMap, mesh: QuadMesh | None, nothing: str) -> QuadMesh | None:
    """Sets the axes in metres and draws lamps and boxes over the map."""
    axes.set_facecolor(NOTHING)
    x, y = made.plane.x_m, made.plane.y_m
    half = (x[1] - x[0]) / 2 if len(x) > 1 else (y[1] - y[0]) / 2 if len(y) > 1 else 0.5
    axes.set_xlim(x[0] - half, x[-1] + half)
    axes.set_ylim(y[0] - half, y[-1] + half)
    axes.set_aspect("equal")
    axes.set_xlabel("X [m]", fontsize=9)
    axes.set_ylabel("Y [m]", fontsize=9)
    axes.tick_params(labelsize=8)
    mark_room(axes, made.scene)
    if mesh is None:
        axes.text(0.5, 0.06, f"{nothing} anywhere", transform=axes.transAxes, ha="center", fontsize=9, color=INK)
    return mesh


def mark_room(axes: Axes, scene: Scene) -> None:
    """Draws the boxes and the lamps with their ids."""
    for box in scene.boxes:
        (x, y), (width, depth) = box.min_m[:2], (box.max_m - box.min_m)[:2]
        axes.add_patch(Rectangle((x, y), width, depth, fill=False, hatch="////", edgecolor=INK, linewidth=0.8))
    for lamp in scene.lamps:
        x, y = lamp.centre_m[:2]
        marker = "s" if lamp.shape is LampShape.rectangle else "o"
        axes.plot(x, y, marker, ms=6, markerfacecolor="white", markeredgecolor=LAMP, markeredgewidth=1.6)
        axes.annotate(
            str(lamp.id), (x, y), (6, 4), textcoords="offset points", fontsize=8, color=INK, path_effects=HALO,
        )


def power_bar(figure: Figure, mesh: ScalarMappable | None, axes: Sequence[Axes]) -> None:
    if mesh is not None:
        bar = figure.colorbar(mesh, ax=list(axes), shrink=0.85, pad=0.02, extend="min")
        bar.set_label("received power [dBm], grey: no lamp in view", fontsize=8.5)
        bar.ax.tick_params(labelsize=8)


def visible_bar(figure: Figure, mesh: ScalarMappable | None, axes: Sequence[Axes], lamps: int) -> None:
    if mesh is not None:
        step = 1 + lamps // 12
        bar = figure.colorbar(mesh, ax=list(axes), shrink=0.85, pad=0.02, ticks=range(0, lamps + 1, step))
        bar.set_label("number of visible lamps", fontsize=8.5)
        bar.ax.tick_params(labelsize=8)


def bound_bar(figure: Figure, mesh: ScalarMappable | None, axes: Sequence[Axes]) -> None:
    if mesh is not None:
        bar = figure.colorbar(mesh, ax=list(axes), shrink=0.85, pad=0.02, extend="max")
        bar.set_label("standard deviation [mm], grey: no bound", fontsize=8.5)
        low, high = mesh.get_clim()
        narrow = high < 12 * low
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 4, 5, 6, 8) if narrow else (1, 3)))
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        bar.ax.yaxis.set_minor_locator(NullLocator())
        bar.ax.tick_params(labelsize=8)
