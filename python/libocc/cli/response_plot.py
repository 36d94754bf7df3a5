# SPDX-License-Identifier: Apache-2.0
"""Plot of a recovered response: curve, standard deviation and residuals."""

from collections.abc import Sequence
from typing import IO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from .._core import ChannelResponse, RecoveredResponse

NAMES = {1: (("grey", "#0072B2"),), 3: (("red", "#D55E00"), ("green", "#009E73"), ("blue", "#0072B2"))}
MAX_SIGMA = 1.0  # levels with a larger sigma of ln(exposure) are not drawn


def draw(file: IO[bytes], response: RecoveredResponse, exposures_s: Sequence[float]) -> None:
    """Writes a PNG."""
    figure = Figure(figsize=(12.6, 4), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    curve, sigma, residuals = figure.subplots(1, 3)
    for channel, (name, colour) in zip(response.channels, NAMES[len(response.channels)]):
        known = channel.sigma < MAX_SIGMA
        level, g, error = channel.level_dn[known], channel.log_exposure[known], channel.sigma[known]
        curve.plot(g, level, color=colour, label=name)
        curve.fill_betweenx(level, g - 2 * error, g + 2 * error, color=colour, alpha=0.25, linewidth=0)
        sigma.semilogy(level, np.where(error > 0, error, np.nan), color=colour)
        for end in (channel.lowest_dn, channel.highest_dn):
            sigma.axvline(end, color=colour, linestyle=":", linewidth=1)
    curve.set(xlabel="ln(light × time), 0 at the middle level", ylabel="stored level [DN]")
    curve.set_title("response, ± 2 sigma", fontsize=10)
    if len(response.channels) > 1:
        curve.legend(frameon=False)
    sigma.set(xlabel="stored level [DN]", ylabel="sigma of ln(light × time)")
    sigma.set_title("standard deviation (dotted: range of observed levels)", fontsize=10)
    _residuals(figure, residuals, response.channels[-1], exposures_s)
    of = f" of {name}" if len(response.channels) > 1 else ""
    residuals.set_title(f"residuals{of}, chi2 {channel.chi2:.0f} of {channel.dof}", fontsize=10)
    for axes in (curve, sigma, residuals):
        axes.grid(alpha=0.3)
    figure.savefig(file, format="png")


def _residuals(figure: Figure, axes: Axes, channel: ChannelResponse, exposures_s: Sequence[float]) -> None:
    rows = channel.residuals
    times = np.asarray(exposures_s)[rows[:, 0].astype(int)]
    low, high = min(exposures_s), max(exposures_s)
    dots = axes.scatter(
        rows[:, 3], rows[:, 5] / rows[:, 6], c=times, s=4, cmap="viridis",
        norm=LogNorm(low, high if high > low else 2 * low),
    )
    axes.axhspan(-2, 2, color="#888888", alpha=0.15, linewidth=0)
    axes.set(xlabel="stored level [DN]", ylabel="residual / sigma")
    figure.colorbar(dots, ax=axes, label="exposure time [s]")
