# SPDX-License-Identifier: Apache-2.0
"""Figures of a calibration report."""

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .summary import Calibration, X, Y

BLUE, ORANGE, INK = "#0072B2", "#D55E00", "#222222"  # palette of Okabe and Ito
SHOWN = 4000  # max number of residual vectors in a figure


def new_figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png_bytes(figure: Figure) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def round_scale(value: float) -> float:
    """Largest of 1, 2 or 5 times a power of ten that is not above `value`."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-12)))
    return float(power * max(step for step in (1, 2, 5) if step * power <= max(value, 1e-12) * (1 + 1e-9)))


def residual_vectors(c: Calibration, camera: int) -> Figure:
    """Enlarged residual vectors over the image, and histograms of the residuals."""
    chosen = np.flatnonzero(c.of_camera(camera))
    model = c.network.cameras[camera]
    width, height = model.width, model.height
    wide = width > 2.2 * height
    figure = new_figure(9, 5.6 if wide else 4.4)
    grid = figure.add_gridspec(2, 2, height_ratios=(3, 2)) if wide else figure.add_gridspec(1, 2, width_ratios=(3, 2))
    axes = figure.add_subplot(grid[0, :] if wide else grid[0, 0])
    residuals = c.residuals_px[chosen]
    at = c.observations[chosen][:, [X, Y]]
    step = max(1, len(chosen) // SHOWN)
    typical = float(np.sqrt(np.mean(residuals**2))) if len(residuals) else 1.0
    scale = 0.03 * width / max(typical, 1e-12)
    shown = slice(None, None, step)
    axes.quiver(
        at[shown, 0], at[shown, 1], residuals[shown, 0], residuals[shown, 1], angles="xy", scale_units="xy",
        scale=1 / scale, width=0.0012, color=BLUE,
    )
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", xlabel="x [px]", ylabel="y [px]")
    axes.set_title(f"residuals x {scale:.3g}, measured minus projected", fontsize=10)
    for k, axis in enumerate("xy"):
        histogram = figure.add_subplot(grid[1, k]) if wide else None
        if histogram is not None:
            normal_histogram(histogram, residuals[:, k], f"{axis} [px]")
    if not wide:
        normal_histogram(figure.add_subplot(grid[0, 1]), residuals.ravel(), "x and y [px]")
    return figure


def normal_histogram(axes: object, values: NDArray[np.float64], label: str) -> None:
    if not len(values):
        return
    sigma = float(np.std(values)) or 1e-12
    edges = np.linspace(-4.5 * sigma, 4.5 * sigma, 46)
    axes.hist(values, edges, color=BLUE, alpha=0.55, density=True)  # type: ignore[attr-defined]
    x = np.linspace(edges[0], edges[-1], 200)
    density = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
    axes.plot(x, density, color=INK, lw=1)  # type: ignore[attr-defined]
    axes.set(xlabel=f"residual {label}", yticks=[])  # type: ignore[attr-defined]
    axes.set_title(f"r.m.s. {np.sqrt(np.mean(values**2)):.3g} px", fontsize=10)  # type: ignore[attr-defined]


def ellipses(covariances: NDArray[np.float64], scale: float) -> tuple[NDArray[np.float64], ...]:
    """Widths, heights and angles [deg] of the ellipses of 2x2 covariances."""
    values, vectors = np.linalg.eigh(covariances)
    values = np.sqrt(np.maximum(values, 0)) * 2 * scale
    return values[:, 1], values[:, 0], np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))


def field_map(c: Calibration) -> Figure:
    """Points with enlarged error ellipses, and stations, from above and from the side."""
    return positions_map(c, *target_positions(c))


def positions_map(c: Calibration, positions: NDArray[np.float64], covariances: NDArray[np.float64]) -> Figure:
    """Positions (n, 3) with their covariances (n, 3, 3), and stations, from above and from the side."""
    stations = np.array([station_position(c, i) for i in range(len(c.network.image_names))])
    everything = np.vstack([positions, stations]) if len(positions) else stations
    extent = float(np.max(np.ptp(everything, axis=0))) or 1.0
    known = np.isfinite(covariances).all(axis=(1, 2)) if len(covariances) else np.zeros(0, bool)
    sigma = float(np.median(np.sqrt(np.trace(covariances[known], axis1=1, axis2=2)))) if known.any() else 0.0
    enlarge = round_scale(0.03 * extent / sigma) if sigma > 0 else 1.0
    figure = new_figure(10, 5)
    views = (((0, 1), "x [m]", "y [m]", "from above"), ((0, 2), "x [m]", "z [m]", "from the side"))
    for k, (axis, xlabel, ylabel, title) in enumerate(views):
        axes = figure.add_subplot(1, 2, k + 1)
        if known.any():
            part = covariances[known][:, axis][:, :, axis]
            widths, heights, angles = ellipses(part, enlarge)
            axes.add_collection(EllipseCollection(
                widths, heights, angles, units="xy", offsets=positions[known][:, axis],
                transOffset=axes.transData, facecolors="none", edgecolors=ORANGE, linewidths=0.7,
            ))
        if len(positions):
            axes.plot(positions[:, axis[0]], positions[:, axis[1]], ".", color=INK, markersize=2)
        axes.plot(stations[:, axis[0]], stations[:, axis[1]], "^", color=BLUE, markersize=7)
        axes.set(xlabel=xlabel, ylabel=ylabel, aspect="equal")
        axes.set_title(f"{title}; ellipses x {enlarge:g}" if sigma > 0 else title, fontsize=10)
        axes.margins(0.08)
    return figure


def station_position(c: Calibration, image: int) -> NDArray[np.float64]:
    pose = np.asarray(c.network.cam_from_world(image))
    return np.asarray(-pose[:3, :3].T @ pose[:3, 3])


def target_positions(c: Calibration) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions and covariances of points and of bodies' first corners."""
    from ..._core import Target

    positions = [*np.asarray(c.network.points_m)]
    unknown = [np.full((3, 3), np.inf)] * len(positions)
    covariances = [*np.asarray(c.known.points())] if c.known.ok and positions else unknown
    for body in range(len(c.network.body_names)):
        target = Target.corner(body, 0)
        positions.append(np.asarray(c.network.position_m(target)))
        covariances.append(np.asarray(c.known.position(target)) if c.known.ok else np.full((3, 3), np.inf))
    return np.array(positions).reshape(-1, 3), np.array(covariances).reshape(-1, 3, 3)


def correlation_matrix(c: Calibration, camera: int) -> Figure:
    names = c.network.free_parameters[camera]
    figure = new_figure(1.6 + 0.45 * len(names), 1.2 + 0.45 * len(names))
    axes = figure.add_subplot()
    rho = c.correlations(camera)
    drawn = axes.imshow(rho, vmin=-1, vmax=1, cmap="RdBu_r")
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    for i in range(len(names)):
        for j in range(len(names)):
            if i != j and abs(rho[i, j]) >= 0.1:
                axes.text(j, i, f"{rho[i, j]:.2f}", ha="center", va="center", fontsize=6,
                          color="white" if abs(rho[i, j]) > 0.6 else INK)
    figure.colorbar(drawn, ax=axes, shrink=0.8, label="correlation")
    return figure


def ladder(names: Sequence[str], sigma0: Sequence[float]) -> Figure:
    """sigma0 of adjustments with an increasing number of parameters."""
    figure = new_figure(7.5, 3.2)
    axes = figure.add_subplot()
    axes.semilogy(range(len(names)), sigma0, "o-", color=BLUE)
    for k, value in enumerate(sigma0):
        axes.annotate(f"{value:.3g}", (k, value), xytext=(4, 6), textcoords="offset points", fontsize=8)
    axes.set_xticks(range(len(names)), names, fontsize=8)
    axes.set(xlim=(-0.4, len(names) - 0.4), ylabel="sigma0", ylim=(min(sigma0) / 1.6, max(sigma0) * 1.8))
    axes.grid(True, which="major", axis="y", alpha=0.3)
    return figure


def uncertainty_map(sigma_px: NDArray[np.float64], width: int, height: int) -> Figure:
    """Map of the projection uncertainty. sigma_px: (rows, columns), the major semi-axis of the error ellipses."""
    figure = new_figure(8, 1.2 + 6.4 * min(1.0, height / width))
    axes = figure.add_subplot()
    inside = sigma_px[np.isfinite(sigma_px)]
    shown = np.where(np.isfinite(sigma_px), sigma_px, np.nan)  # outside the domain: white
    drawn = axes.imshow(shown, extent=(-0.5, width - 0.5, height - 0.5, -0.5), cmap="viridis",
                        vmax=float(np.percentile(inside, 98)) if len(inside) else None)
    finite = np.isfinite(sigma_px).all() and np.ptp(sigma_px) > 0
    if finite:
        lines = axes.contour(np.linspace(0, width, sigma_px.shape[1]), np.linspace(0, height, sigma_px.shape[0]),
                             sigma_px, 6, colors="white", linewidths=0.6)
        axes.clabel(lines, fontsize=7)
    axes.set(xlabel="x [px]", ylabel="y [px]")
    figure.colorbar(drawn, ax=axes, shrink=0.8, label="sigma of a projection [px]")
    return figure
