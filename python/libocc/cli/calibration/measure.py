# SPDX-License-Identifier: Apache-2.0
"""Points measured in calibrated images: table, summary and report."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Measurement, Network, Status
from ...network.files import SIGMA_PX
from ...network.tables import read_table
from . import figures
from .report import STYLE, number, picture, table
from .summary import Calibration, finite

ImageObservation = tuple[int, NDArray[np.float64], NDArray[np.float64]]


def read_observations(path: Path, network: Network) -> tuple[list[str], list[list[ImageObservation]]]:
    """Reads the names and image observations of points. Raises: OSError; ValueError naming line, column and value."""
    images = {name: i for i, name in enumerate(network.image_names)}
    points: dict[str, list[ImageObservation]] = {}
    cameras = network.cameras
    periods = [cameras[camera].period_px for camera in network.image_cameras]
    seen: dict[tuple[str, str], list[tuple[int, float]]] = {}  # lines and columns of a point in an image
    for row in read_table(path, ("point", "image", "x_px", "y_px"), ("sigma_x_px", "sigma_y_px")):
        if row.text("image") not in images:
            raise row.fail("image", f"an image of the network ({', '.join(list(images)[:8])})")
        sigma_x = row.number("sigma_x_px", SIGMA_PX)
        sigma = np.array([sigma_x, row.number("sigma_y_px", sigma_x)])
        if not (sigma > 0).all():
            raise row.fail("sigma_x_px" if not sigma[0] > 0 else "sigma_y_px", "positive")
        at = np.array([row.number("x_px"), row.number("y_px")])
        same = seen.setdefault((row.text("image"), row.text("point")), [])
        period = periods[images[row.text("image")]]
        for line, x_px in same:
            if abs(at[0] - x_px) <= period / 2:  # a panorama may show a point again after a full rotation
                raise ValueError(
                    f"{row.where}: point {row.text('point')!r} occurs twice in image {row.text('image')!r}, first in "
                    f"line {line}; keep one of the two observations"
                )
        same.append((row.line, float(at[0])))
        points.setdefault(row.text("point"), []).append((images[row.text("image")], at, sigma))
    return list(points), list(points.values())


def ends_of(distances: Sequence[tuple[str, str]], names: Sequence[str]) -> list[tuple[int, int]]:
    for pair in distances:
        for name in pair:
            if name not in names:
                raise ValueError(f"--distance: no point is named {name!r}; existing names: {', '.join(names[:8])}")
    return [(names.index(a), names.index(b)) for a, b in distances]


def summary(names: Sequence[str], measured: Measurement, pairs: Sequence[tuple[int, int]]) -> dict[str, Any]:
    points = [
        {"name": name, "status": point.status.name, "position_m": point.position_m.tolist(),
         "sigma_m": [finite(s) for s in np.sqrt(np.diag(point.covariance_m2))], "images": point.images,
         "worst_residual_px": finite(point.worst_residual_px), "angle_deg": float(np.degrees(point.angle_rad))}
        for name, point in zip(names, measured.points)
    ]
    distances = []
    for a, b in pairs:
        length, sigma = measured.distance(a, b)
        distances.append({"from": names[a], "to": names[b], "length_m": finite(length), "sigma_m": finite(sigma)})
    return {"points": points, "distances": distances}


def report_html(c: Calibration, names: Sequence[str], measured: Measurement, data: dict[str, Any]) -> bytes:
    rows = [
        (p["name"], p["status"], *(f"{v:.5f}" for v in p["position_m"]),
         *(number(1e3 * s, 3) if s is not None else "unknown" for s in p["sigma_m"]), p["images"],
         number(p["worst_residual_px"] or 0, 3), f"{p['angle_deg']:.1f}")
        for p in data["points"]
    ]
    head = ("point", "status", "x [m]", "y [m]", "z [m]", "sigma x [mm]", "sigma y [mm]", "sigma z [mm]", "images",
            "worst residual [px]", "angle of rays [deg]")
    parts = [f"<h1>{len(names)} points</h1>", table(head, rows)]
    if data["distances"]:
        parts.append("<h2>Distances</h2>" + table(("from", "to", "length [m]", "sigma [mm]"), (
            (d["from"], d["to"], number(d["length_m"] or np.inf, 8), number(1e3 * (d["sigma_m"] or np.inf), 3))
            for d in data["distances"]
        )))
    good = [p for p in measured.points if p.status is Status.ok]
    if good:
        positions = np.array([p.position_m for p in good])
        covariances = np.array([p.covariance_m2 for p in good])
        parts.append("<h2>Map</h2>" + picture(figures.positions_map(c, positions, covariances), "map"))
    return (f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape("Measured points")}</title>'
            f"<style>{STYLE}</style><body>{''.join(parts)}</body></html>").encode()
