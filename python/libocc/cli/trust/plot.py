# SPDX-License-Identifier: Apache-2.0
"""Picture of a run: verdicts, coverage and times by family; stated risk against the share of wrong poses."""

import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import IO, Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..ladder.plot import seconds_text
from .figures import AXES, INSIDE, FamilyRow, RiskRow, Share

# Palette of Okabe and Ito, distinguishable with colour vision deficiency.
OK, WRONG, INK, GREY, LIGHT = "#0072B2", "#D55E00", "#222222", "#666666", "#e4e4e4"
VERDICTS = {"ok, wrong": WRONG, "ok, right": OK, "ambiguous": "#E69F00", "no pose": "#B8B8B8", "other": "#E2E2E2"}
SHADES = ("#56B4E9", "#0072B2", "#00304B")  # of 1, 2 and 3 sigma
INCHES, DPI = (9.4, 8.6), 130
COLUMNS = ((0.165, 0.28), (0.505, 0.275), (0.815, 0.165))  # left edge and width of the upper panels
MAX_SIGMAS = 4.2  # right end of the coverage axis; a share of 100 % is drawn there
MIN_SHARE = 1e-4  # bottom of the risk axes; a share of 0 is drawn there
SIZE = 8.5  # points of small text
READING = (
    "How to read it\n"
    "\n"
    "Each row above is a family of simulated problems.\n"
    "\n"
    "Verdicts: statuses of the answers. A wrong pose that is ok\n"
    "is a fault; the column on the right counts them.\n"
    "\n"
    "Coverage: how often the truth is within 1, 2, 3 standard\n"
    "deviations. Each dot belongs on the line of its colour:\n"
    "left of it, sigmas are too small; right of it, too large.\n"
    "\n"
    "Time: median (dot) to the 99 % quantile (end of the line).\n"
    "\n"
    "Risk: the share of wrong poses among all fixes that state\n"
    "a risk of at most r, over all families. Below the diagonal\n"
    "the risk is honest. Hollow circle: none is wrong; the line\n"
    "ends at the share that this number of fixes excludes.\n"
    "Orange: the excess is significant. Diamonds: without\n"
    "the families that are wrong significantly too often."
)


def draw(
    file: IO[bytes], ending: str, rows: Sequence[FamilyRow], risks: Sequence[RiskRow], others: Sequence[RiskRow],
    title: str, note: str,
) -> None:
    """Writes the picture to an open file; ending: .png, .svg or .pdf.

    risks: of all families; others: without the families that are too often wrong, empty if there are none.
    """
    figure = Figure(figsize=INCHES, dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    shown = [row for row in rows if row.problems]
    columns = [figure.add_axes((left, 0.515, width, 0.38)) for left, width in COLUMNS]
    for axes, name in zip(columns, ("Verdicts", "Coverage of the ok fixes", "Time of one call")):
        axes.set_title(name, fontsize=10, fontweight="bold", color=INK, loc="left", pad=20)
        axes.set_ylim(len(shown) - 0.4, -0.6)
        axes.set_yticks(range(len(shown)), [row.family.title for row in shown], fontsize=SIZE + 0.5)
        axes.tick_params(axis="y", length=0)
        _clean(axes)
    for axes in columns[1:]:
        axes.set_yticklabels([])
    _verdicts(columns[0], shown)
    _coverage(columns[1], shown)
    _times(columns[2], shown)
    _risks(figure.add_axes((0.085, 0.105, 0.475, 0.30)), risks, others)
    figure.text(0.60, 0.43, READING, fontsize=SIZE, color=INK, va="top", linespacing=1.25)
    figure.text(0.012, 0.97, title, fontsize=12.5, fontweight="bold", color=INK, va="center")
    figure.text(0.012, 0.018, note, fontsize=8, color=GREY, va="center")
    figure.savefig(file, format=ending.lstrip("."))


def _clean(axes: Axes) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=SIZE)
    axes.set_axisbelow(True)


def _verdicts(axes: Axes, rows: Sequence[FamilyRow]) -> None:
    axes.set_xlim(0, 100)
    for y, row in enumerate(rows):
        right = row.ok - row.wrong.hits
        counts = (row.wrong.hits, right, row.ambiguous, row.no_pose, row.other)
        left = 0.0
        for count, colour in zip(counts, VERDICTS.values()):
            width = 100 * count / row.problems
            axes.barh(y, width, left=left, height=0.62, color=colour)
            left += width
        colour, weight = (WRONG, "bold") if row.wrong.hits else (GREY, "normal")
        axes.text(104, y, str(row.wrong.hits), fontsize=SIZE, color=colour, fontweight=weight, va="center")
    axes.text(104, -0.95, "wrong", fontsize=SIZE, color=WRONG, ha="center", va="center")
    axes.legend(
        [Rectangle((0, 0), 1, 1, color=colour) for colour in VERDICTS.values()], list(VERDICTS), ncols=len(VERDICTS),
        loc="lower left", bbox_to_anchor=(-0.33, 1.0), frameon=False, fontsize=SIZE - 0.5, handlelength=0.8,
        handleheight=0.8, handletextpad=0.3, columnspacing=0.8, borderaxespad=0.1,
    )
    axes.set_xlabel("share of the problems [%]", fontsize=SIZE + 0.5)


def sigmas_of(share: float) -> float:
    """Number of standard deviations that a Gaussian variable stays within with this probability."""
    if share >= 1:
        return MAX_SIGMAS
    return min(MAX_SIGMAS, NormalDist().inv_cdf((1 + max(0.0, share)) / 2))


def _coverage(axes: Axes, rows: Sequence[FamilyRow]) -> None:
    axes.set_xlim(0, MAX_SIGMAS)
    for sigmas, expected in enumerate(INSIDE, 1):
        colour = SHADES[sigmas - 1]
        axes.axvline(sigmas, color=colour, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
        axes.text(sigmas, 1.035, f"{sigmas}σ: {100 * expected:.1f}", fontsize=SIZE - 0.5, color=colour, ha="center",
                  va="center", transform=axes.get_xaxis_transform())
    for y, row in enumerate(rows):
        if not row.coverage:
            axes.text(0.1, y, "no fix is ok" if not row.ok else "no truth", fontsize=SIZE, color=GREY, va="center")
        for item in row.coverage:
            colour, at = SHADES[item.sigmas - 1], sigmas_of(item.inside.value)
            if item.by == "chi2":
                band = [sigmas_of(p) for p in item.inside.band]
                axes.plot(band, [y, y], "-", color=colour, linewidth=2.6, alpha=0.55)
                axes.plot(at, y, "o", color=colour, markersize=5, clip_on=False, zorder=4)
            else:
                offset = 0.19 + 0.13 * AXES.index(item.by)
                axes.plot(at, y + offset, "|", color=colour, markersize=4, markeredgewidth=1.2, clip_on=False)
    shares = (0.3, 0.683, 0.9, 0.99, 0.999)
    ticks = [0.0, *map(sigmas_of, shares), MAX_SIGMAS]
    axes.set_xticks(ticks, ["0", *(f"{100 * p:g}" for p in shares), "100"])
    label = "share of truths inside [%]; scale: Gaussian\ndot: six parameters; ticks: x, y, z"
    axes.set_xlabel(label, fontsize=SIZE + 0.5)


def _times(axes: Axes, rows: Sequence[FamilyRow]) -> None:
    axes.set_xscale("log")
    for y, row in enumerate(rows):
        axes.plot([row.time_median_s, row.time_p99_s], [y, y], "-", color=OK, linewidth=2.2, alpha=0.45)
        axes.plot(row.time_median_s, y, "o", color=OK, markersize=5)
    times = [time for row in rows for time in (row.time_median_s, row.time_p99_s) if time > 0] or [1e-3]
    axes.set_xlim(min(times) / 2, max(times) * 2)
    decades = range(math.ceil(math.log10(min(times) / 2)), math.floor(math.log10(max(times) * 2)) + 1)
    axes.set_xticks([10.0**k for k in decades][:: 1 + len(decades) // 6])
    axes.tick_params(axis="x", labelsize=SIZE - 1.5)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: seconds_text(value)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, axis="x", which="major", color=LIGHT, linewidth=0.8)
    axes.set_xlabel("computing time, one thread", fontsize=SIZE + 0.5)


def _risks(axes: Axes, risks: Sequence[RiskRow], others: Sequence[RiskRow]) -> None:
    axes.set_title("Stated risk against truth: wrong / fixes", fontsize=10, fontweight="bold", color=INK, loc="left")
    axes.set_xscale("log")
    axes.set_yscale("log")
    bottom = MIN_SHARE
    for row in (*risks, *others):
        bottom = min(bottom, row.wrong.band[1] / 3, row.wrong.value / 3 if row.wrong.hits else 1)
    left = min([row.max_risk for row in risks], default=1e-6)
    axes.set_xlim(left / 3, 4)
    axes.set_ylim(bottom, 3)
    axes.plot([bottom, 1], [bottom, 1], "--", color=GREY, linewidth=1)
    axes.fill_between([left / 3, bottom, 1, 4], [bottom, bottom, 1, 1], 3, color=WRONG, alpha=0.07, linewidth=0)
    axes.text(0.02, 0.95, "stated too small", fontsize=SIZE, color=WRONG, transform=axes.transAxes, va="top")
    axes.text(0.985, 0.04, "honest", fontsize=SIZE, color=OK, transform=axes.transAxes, ha="right")
    for row in risks:
        _risk_point(axes, row, bottom)
    for row in others:
        _risk_point(axes, row, bottom, 1.6, "D")
    axes.set_xlabel("stated risk of at most r (max_risk = 1: every fix counts)", fontsize=SIZE + 0.5)
    axes.set_ylabel("share of wrong poses", fontsize=SIZE + 0.5)
    axes.xaxis.set_major_locator(LogLocator(numticks=14))
    axes.grid(True, which="major", color=LIGHT, linewidth=0.8)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    _clean(axes)


def _risk_point(axes: Axes, row: RiskRow, bottom: float, shift: float = 1.0, marker: str = "o") -> None:
    """Marker with its interval; shift: factor of the position along the axis."""
    share: Share = row.wrong
    low, high = share.band
    colour = WRONG if low > row.max_risk else OK
    x, y = shift * row.max_risk, share.value if share.hits else bottom
    axes.plot([x, x], [max(low, bottom), high], "-", color=colour, linewidth=2.2, alpha=0.45)
    style: dict[str, Any] = {} if share.hits else {"markerfacecolor": "white"}
    axes.plot(x, y, marker, color=colour, markersize=5 if marker == "o" else 4, clip_on=False, zorder=4, **style)
    if marker == "o":
        axes.annotate(
            f"{share.hits}/{share.trials}", (x, high), (0, 3), textcoords="offset points", ha="center", va="bottom",
            fontsize=6.8, color=colour,
        )
