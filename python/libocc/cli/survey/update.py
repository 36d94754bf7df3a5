# SPDX-License-Identifier: Apache-2.0
"""Files and text of the update of a map."""

import math
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import LampFate, LampUpdate, MapUpdate, MapWay, Scene, heading_rad
from ...surveying import updated_scene
from ..calibration.figures import png_bytes
from ..calibration.report import page, table
from ..result_folder import ResultFolder, json_bytes
from .figure import FATES, update_plan
from .output import omission_lines, omissions_of, omissions_table, plan_image, trajectory
from .sources import Pictures

SHOWN_WAYS = 8  # lines of the text output; the JSON has all


def numbers(values: Any) -> list[float]:
    return [float(value) for value in values]


def sigmas_m(update: LampUpdate) -> list[float]:
    return numbers(np.sqrt(np.maximum(np.diag(update.covariance_m2), 0)))


def lamp_data(update: LampUpdate, pictures: list[str]) -> dict[str, Any]:
    is_new, is_gone = update.fate == LampFate.added, update.fate == LampFate.gone
    return {
        "id": update.lamp.id, "name": update.lamp.name, "fate": update.fate.name, "reason": update.reason,
        "old_centre_m": None if is_new else numbers(update.old_centre_m),
        "centre_m": None if is_gone else numbers(update.lamp.centre_m),
        "sigma_m": None if is_gone else sigmas_m(update),
        "displacement_m": numbers(update.displacement_m) if update.has_test else None,
        "displacement_sigma_m": update.displacement_sigma_m if update.has_test else None,
        "statistic": update.statistic if update.has_test else None,
        "changes": [
            {"quantity": c.quantity, "before": c.before, "after": c.after, "statistic": c.statistic}
            for c in update.changes
        ],
        "seen": [pictures[i] for i in update.seen], "missed": [pictures[i] for i in update.missed],
    }


def way_data(way: MapWay) -> dict[str, Any]:
    pose = np.asarray(way.cam_from_world)
    return {
        "picture": way.picture, "position_m": numbers(-pose[:3, :3].T @ pose[:3, 3]),
        "heading_deg": math.degrees(heading_rad(pose)), "matches": way.matches, "lamps": way.lamps,
        "missing": way.missing, "log10_false_alarms": way.log10_false_alarms, "prior_chi2": way.prior_chi2,
        "lamp_ids": list(way.lamp_ids),
    }


def places_of(found: MapUpdate, pictures: list[str]) -> tuple[list[str], NDArray[np.float64]]:
    """Names and positions (n, 3) of the pictures that are used."""
    poses = [(name, np.asarray(pose)) for name, pose in zip(pictures, found.cam_from_world) if pose is not None]
    places = [-pose[:3, :3].T @ pose[:3, 3] for _, pose in poses]
    return [name for name, _ in poses], np.array(places).reshape(-1, 3)


def update_data(found: MapUpdate, pictures: list[str], notes: list[str]) -> dict[str, Any]:
    """Plain data of the update for result.json."""
    names, places = places_of(found, pictures)
    return {
        "status": found.status.name, "message": found.message, "warnings": notes + list(found.warnings),
        "max_statistic": found.max_statistic, "changed_share": found.changed_share,
        "lamps": [lamp_data(update, pictures) for update in found.lamps],
        "pictures": [{"name": name, "position_m": numbers(place)} for name, place in zip(names, places)],
        "ways": [way_data(way) for way in found.ways],
        "omissions": omissions_of(found),
    }


def title_of(update: LampUpdate) -> str:
    return f"lamp {update.lamp.id}" + (f" ({update.lamp.name})" if update.lamp.name else "")


def lamp_line(update: LampUpdate) -> str:
    place = " ".join(f"{value:.4f}" for value in update.lamp.centre_m)
    sigma = " ".join(f"{1e3 * value:.2g}" for value in sigmas_m(update))
    start = f"{title_of(update)} {FATES[update.fate][2]}"
    if update.fate == LampFate.gone:
        return f"{start}: {update.reason}"
    if update.fate == LampFate.moved:
        by = 1e3 * float(np.linalg.norm(update.displacement_m))
        old = " ".join(f"{value:.4f}" for value in update.old_centre_m)
        start += f" by {by:.1f} mm, sigma {1e3 * update.displacement_sigma_m:.2g} mm, from {old}"
        return f"{start} to {place} m, sigma {sigma} mm: {update.reason}"
    return f"{start}: {place} m, sigma {sigma} mm: {update.reason}"


def way_line(way: MapWay) -> str:
    data = way_data(way)
    place = " ".join(f"{value:.2f}" for value in data["position_m"])
    return (
        f"way: {way.picture} at {place} m, heading {data['heading_deg']:.0f} deg: {way.matches} of {way.lamps} lamps "
        f"match, {way.missing} of the map are missing"
    )


def text_lines(found: MapUpdate, data: dict[str, Any]) -> list[str]:
    """One line per lamp, then the counts and what was not used."""
    lines = [lamp_line(update) for update in found.lamps]
    counts = [f"{sum(u.fate == fate for u in found.lamps)} {text}" for fate, (_, _, text) in FATES.items()]
    lines.append(f"{', '.join(counts)}; {len(data['pictures'])} of {len(found.cam_from_world)} pictures")
    return lines + omission_lines(found) + [f"warning: {text}" for text in data["warnings"]]


def failure_lines(found: MapUpdate, data: dict[str, Any]) -> list[str]:
    lines = [way_line(way) for way in found.ways[:SHOWN_WAYS]]
    if len(found.ways) > SHOWN_WAYS:
        lines.append(f"way: {len(found.ways) - SHOWN_WAYS} more, see result.json")
    lines += [
        f"not used: {o['picture']}: {o['reason']}" for o in data["omissions"]
        if o["blob"] is None and o["reason"] != found.message
    ]
    return [*lines, f"{data['status']}: {data['message']}"]


def report(found: MapUpdate, data: dict[str, Any], png: bytes, title: str) -> bytes:
    rows = [
        (title_of(u), FATES[u.fate][2], f"{1e3 * np.linalg.norm(u.displacement_m):.1f}" if u.has_test else "",
         f"{1e3 * u.displacement_sigma_m:.2g}" if u.has_test else "", f"{u.statistic:.3g}" if u.has_test else "",
         len(u.seen), len(u.missed), u.reason)
        for u in found.lamps
    ]
    head = ("lamp", "verdict", "displacement [mm]", "sigma [mm]", "chi-square", "seen", "missed", "evidence")
    warnings = "".join(f"<li>{escape(text)}</li>" for text in data["warnings"])
    return page(title, [
        f"<h1>{escape(title)}</h1>", f"<ul>{warnings}</ul>" if warnings else "",
        plan_image(png),
        "<h2>Lamps</h2>", table(head, rows),
        f"<p>A lamp moved if its chi-square (3 degrees of freedom) exceeds {found.max_statistic:.3g}. "
        "Seen, missed: pictures that show the lamp, and that should and do not.</p>",
        omissions_table(found),
    ])


def write_update(
    folder: ResultFolder, found: MapUpdate, scene: Scene, pictures: Pictures
) -> dict[str, Any]:
    """Writes all files; returns the data of result.json. scene: the map before the update."""
    names = [name for name, _ in pictures.blobs]
    data = update_data(found, names, pictures.notes)
    folder.write("result.json", json_bytes(data))
    if not found.ok:
        return data
    _, places = places_of(found, names)
    png = png_bytes(update_plan(found.lamps, places, pictures.ordered))
    folder.write("scene.yaml", updated_scene(found, scene).format().encode())
    folder.write("plan.png", png)
    folder.write("report.html", report(found, data, png, f"Update of a map of {len(scene.lamps)} lamps"))
    folder.write("trajectory.tum", trajectory(found.cam_from_world, pictures.times_s))
    return data
