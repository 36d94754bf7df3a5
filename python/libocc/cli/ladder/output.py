# SPDX-License-Identifier: Apache-2.0
"""Results of the ladder as a table, CSV and JSON."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from .figures import Row
from .measure import OUTLIER, Run
from .plot import seconds_text

NOTE = (
    "Error: r.m.s. of the answers that are not wrong; over: ratio of the position error to the Cramér-Rao bound of all "
    "pixels and of the rung's observations. Failed: no answer. Wrong: error above "
    f"{OUTLIER:g} times that bound, including the bias of points. Bold: no rung is faster and more accurate. "
    "Time: from identified blobs to a pose, measured in C++"
)
FROM_PYTHON = "; for PoseLib measured in Python, including the overhead of a call"


def table(rows: Sequence[Row]) -> Any:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    out = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for name in ("rung", "by"):
        out.add_column(name, no_wrap=True)
    for name in ("median", "p95", "error", "error", "over pixels", "over own", "failed", "wrong"):
        out.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        out.add_row(
            row.name, row.family, seconds_text(row.time_median_s), seconds_text(row.time_p95_s),
            _number(1e3 * row.position_rmse_m, " mm"), _number(1e3 * row.rotation_rmse_rad, " mrad"),
            _number(row.position_over_pixels), _number(row.position_over_own),
            _percent(row.failures), _percent(row.outliers),
            style="bold" if row.pareto else "",
        )
    return out


def _number(value: float, unit: str = "") -> str:
    return f"{value:.3g}{unit}" if math.isfinite(value) else "-"


def _percent(part: float) -> str:
    return "0" if part == 0 else f"{100 * part:.3g} %"


def note(rows: Sequence[Row]) -> str:
    return NOTE + (FROM_PYTHON if any(row.family == "PoseLib" for row in rows) else "") + "."


def csv_bytes(rows: Sequence[Row]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(row.plain() for row in rows)
    return text.getvalue().encode()


def plain(settings: dict[str, Any], run: Run, rows: Sequence[Row], detect_s: float) -> dict[str, Any]:
    return {
        "experiment": settings,
        "frames": run.frames,
        "interrupted": run.interrupted,
        "detect_median_s": detect_s,
        "rungs": [row.plain() for row in rows],
    }
