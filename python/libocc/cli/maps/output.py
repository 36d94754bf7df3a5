# SPDX-License-Identifier: Apache-2.0
"""A power map as a table, as arrays and as a summary."""

import csv
import io
from typing import Any

import numpy as np

from ..._core import dbm
from ...maps import PowerMap


def name_of(made: PowerMap) -> str:
    """Base name of the files, such as "f1.4_roll0_pitch30_yaw0"."""
    rotation = (f"{part}{angle:g}" for part, angle in zip(("roll", "pitch", "yaw"), made.rotation_deg))
    return "_".join([f"f{made.focal_mm:.6g}", *rotation])


def csv_bytes(made: PowerMap) -> bytes:
    """Table with one line per point; -inf dBm without light, inf without a bound."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    ids = [lamp.id for lamp in made.scene.lamps]
    writer.writerow(["x_m", "y_m", "z_m", "power_dbm", "visible", "bound_m", *(f"lamp_{i}_dbm" for i in ids)])
    power_dbm, lamp_dbm = made.power_dbm, np.asarray(dbm(made.lamp_power_w))
    for row, y_m in enumerate(made.plane.y_m):
        for column, x_m in enumerate(made.plane.x_m):
            at = row, column
            writer.writerow([
                f"{x_m:.6g}", f"{y_m:.6g}", f"{made.plane.height_m:.6g}", f"{power_dbm[at]:.6g}",
                made.visible[at], f"{made.bound_m[at]:.6g}", *(f"{value:.6g}" for value in lamp_dbm[at]),
            ])
    return text.getvalue().encode()


def npz_bytes(made: PowerMap) -> bytes:
    """All arrays, for numpy.load()."""
    file = io.BytesIO()
    np.savez_compressed(
        file, x_m=made.plane.x_m, y_m=made.plane.y_m, height_m=made.plane.height_m,
        rotation_deg=made.rotation_deg, focal_mm=made.focal_mm,
        lamp_id=[lamp.id for lamp in made.scene.lamps], lamp_power_w=made.lamp_power_w, power_w=made.power_w,
        power_dbm=made.power_dbm, visible=made.visible, whole=made.whole, bound_m=made.bound_m,
        rung="" if made.rung is None else made.rung.name, scene=made.scene.format(),
    )
    return file.getvalue()


def summary(made: PowerMap) -> dict[str, Any]:
    """Summary: lit and bounded fraction of the points, min and max power, median bound; None without light or bound."""
    lit = made.power_w[made.power_w > 0]
    bounded = made.bound_m[np.isfinite(made.bound_m)]
    return {
        "focal_mm": made.focal_mm,
        "rotation_deg": list(made.rotation_deg),
        "height_m": made.plane.height_m,
        "points": made.visible.size,
        "lit": len(lit) / made.visible.size,
        "bounded": len(bounded) / made.visible.size,
        "power_dbm": [float(value) for value in dbm(np.array([lit.min(), lit.max()]))] if len(lit) else None,
        "bound_m": float(np.median(bounded)) if len(bounded) else None,
    }


def sentence(data: dict[str, Any]) -> str:
    """Result of summary() as text."""
    lens = f"f {data['focal_mm']:g} mm, rotation {' '.join(f'{angle:g}' for angle in data['rotation_deg'])}: "
    if not data["lit"]:
        return lens + "no lamp in view anywhere"
    low, high = data["power_dbm"]
    text = lens + f"lamps at {100 * data['lit']:.3g} % of the points, {low:.2f} to {high:.2f} dBm"
    if not data["bounded"]:
        return text + "; no bound"
    return text + f"; bound at {100 * data['bounded']:.3g} %, median {1e3 * data['bound_m']:.3g} mm"
