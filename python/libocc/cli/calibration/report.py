# SPDX-License-Identifier: Apache-2.0
"""Calibration report as a self-contained HTML file."""

import base64
from collections.abc import Iterable, Sequence
from html import escape

import numpy as np
from matplotlib.figure import Figure

from . import figures
from .summary import Calibration, components_of, reliability_of, target_name

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 62em; margin: 2em auto; padding: 0 1em }
h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin-top: 2em }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { text-align: left; padding: .15em .9em .15em 0; border-bottom: 1px solid #ddd }
td.number { text-align: right } img { max-width: 100% }
.good { color: #00704e } .bad { color: #b33000; font-weight: 600 }
"""
ROWS = 300  # max number of printed rows of a table


def number(value: float, digits: int = 4) -> str:
    return f"{value:.{digits}g}" if np.isfinite(value) else "unknown"


def _cell(text: str) -> str:
    start = '<td class="number">' if text and text[0] in "-+0123456789." else "<td>"
    return f"{start}{escape(text)}</td>"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    body = []
    listed = list(rows)
    for row in listed[:ROWS]:
        body.append(f"<tr>{''.join(map(_cell, map(str, row)))}</tr>")
    more = f"<p>and {len(listed) - ROWS} more rows, see the JSON file</p>" if len(listed) > ROWS else ""
    titles = "".join(f"<th>{escape(name)}</th>" for name in head)
    return f"<table><tr>{titles}</tr>{''.join(body)}</table>{more}"


def picture(figure: Figure, what: str) -> str:
    data = base64.b64encode(figures.png_bytes(figure)).decode()
    return f'<p><img alt="{escape(what)}" src="data:image/png;base64,{data}"></p>'


def verdict(c: Calibration) -> str:
    """Paragraph with the status, or with sigma0 and its test."""
    a = c.adjustment
    if not c.ok:
        status = a.status.name if not a.ok else c.known.status.name
        message = escape(a.message or c.known.message)
        return f'<p class="bad">{escape(status)}: {message}</p><p>The report shows the last state.</p>'
    low, high = chi_interval(a.redundancy)
    fits = low <= a.sigma0**2 <= high
    text = (
        f"sigma0 is {a.sigma0:.3f}: the residuals agree with their sigmas" if fits else
        f"sigma0 is {a.sigma0:.3f}: the residuals are {'larger' if a.sigma0 > 1 else 'smaller'} than their "
        "sigmas; all sigmas below are multiplied by sigma0"
    )
    return f'<p class="{"good" if fits else ""}">{text} (redundancy {a.redundancy}).</p>'


def chi_interval(redundancy: int) -> tuple[float, float]:
    """99 % interval of sigma0 squared, by the approximation of Wilson and Hilferty."""
    if redundancy < 1:
        return 0.0, np.inf
    a = 2 / (9 * redundancy)
    return (1 - a - 2.576 * np.sqrt(a)) ** 3, (1 - a + 2.576 * np.sqrt(a)) ** 3


def parameter_rows(c: Calibration) -> list[list[str]]:
    return [
        [p.camera, p.name, f"{p.value:.9g}", number(p.sigma), p.unit, number(p.value - p.before), number(p.t, 3)]
        for p in c.parameters
    ]


def camera_section(c: Calibration, camera: int, uncertainty: Figure | None) -> str:
    name = c.network.camera_names[camera]
    rms = c.rms_px(camera)
    parts = [f"<h2>Camera {escape(name)}</h2>",
             f"<p>{c.network.cameras[camera].kind.name}; {int(c.of_camera(camera).sum())} image points, "
             f"residuals r.m.s. {rms[0]:.3g}, {rms[1]:.3g} px.</p>"]
    rows = [row[1:] for row in parameter_rows(c) if row[0] == name]
    if rows:
        parts.append(table(("parameter", "value", "sigma", "unit", "change", "|value| / sigma"), rows))
    parts.append(picture(figures.residual_vectors(c, camera), f"residuals of {name}"))
    if rows and c.known.ok:
        strong = c.strong_correlations(camera)
        if strong:
            listed = ", ".join(f"{a} and {b} ({rho:+.3f})" for a, b, rho in strong)
            parts.append(f"<p>Strongly correlated: {escape(listed)}. Their values must be used together.</p>")
        parts.append(picture(figures.correlation_matrix(c, camera), f"correlations of {name}"))
        if uncertainty is not None:
            parts.append("<p>Uncertainty of the projection of distant points [px], after compensation by a rotation of "
                         "the camera:</p>" + picture(uncertainty, f"uncertainty of {name}"))
    return "".join(parts)


def point_rows(c: Calibration) -> list[list[str]]:
    rows = []
    for name, position, sigma in zip(c.network.point_names, np.asarray(c.network.points_m), c.point_sigmas_m):
        rows.append([name, *(f"{v:.5f}" for v in position), *(number(1e3 * s, 3) for s in sigma)])
    return rows


def statistics_sections(c: Calibration) -> list[str]:
    """Sections on reliability, variance components and check points, if available."""
    parts = []
    reliability, components = reliability_of(c), components_of(c)
    if reliability is not None:
        low, high = reliability["sigma0_interval"]
        parts.append("<h2>Reliability</h2>" + table(("of image observations", ""), (
            ("redundancy numbers, mean and min",
             f"{reliability['mean_redundancy']:.3f}, {reliability['min_redundancy']:.3f}"),
            ("smallest gross error detected with 80 % power, median and max [px]",
             f"{text_of(reliability['median_detectable_px'])}, {text_of(reliability['worst_detectable_px'])}"),
            ("its effect on the unknowns, median [sigma]", text_of(reliability["median_external"])),
            ("max |tau|, and its critical value at 1 %",
             f"{reliability['worst_tau']:.2f}, {reliability['tau_critical']:.2f}"),
            ("95 % interval of sigma0", f"{low:.3f} to {high:.3f}"),
        )))
    if components:
        head = ("camera", "axis", "factor of the sigmas", "redundancy")
        parts.append("<h2>Variance components</h2>" + table(head, (
            (k["camera"], k["axis"], f"{k['factor']:.3f}", f"{k['redundancy']:.0f}") for k in components
        )))
    if c.checked is not None and c.checked.ok:
        rows = [(axis, number(1e3 * c.checked.rmse_m[i], 3), number(1e3 * c.checked.predicted_m[i], 3))
                for i, axis in enumerate("xyz")]
        rows.append(("3D", number(1e3 * c.checked.rmse_3d_m, 3), number(1e3 * c.checked.predicted_3d_m, 3)))
        parts.append("<h2>Check points</h2>" + table(("axis", "r.m.s. error [mm]", "predicted [mm]"), rows))
    return parts


def text_of(value: float | None) -> str:
    return "unlimited" if value is None else number(value, 3)


def page(title: str, parts: Sequence[str]) -> bytes:
    """Self-contained HTML file with the style of all reports."""
    text = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
        f"<body>{''.join(parts)}</body></html>"
    )
    return text.encode()


def html(c: Calibration, title: str, extra: Sequence[str] = (), uncertainties: Sequence[Figure | None] = ()) -> bytes:
    """Complete report. extra: more sections, as HTML; uncertainties: a figure for each camera, or None."""
    a = c.adjustment
    maps = list(uncertainties) or [None] * len(c.network.cameras)
    parts = [f"<h1>{escape(title)}</h1>", verdict(c)]
    warnings = [*a.warnings, *c.notes]
    if warnings:
        parts.append("<ul>" + "".join(f"<li>{escape(text)}</li>" for text in warnings) + "</ul>")
    head = ("images", "points", "bodies", "observations", "unknowns", "datum defect", "iterations", "seconds")
    parts.append(table(head, [[
        len(c.network.image_names), len(c.network.point_names), len(c.network.body_names), a.observations,
        a.unknowns, a.defect, a.iterations, f"{c.seconds:.2f}",
    ]]))
    parts += [camera_section(c, k, maps[k]) for k in range(len(c.network.cameras))]
    parts += [*statistics_sections(c), *extra]
    if a.rejected:
        titles = ("image", "target", "residual / sigma", "reason")
        parts.append(f"<h2>Rejected: {len(a.rejected)}</h2>" + table(titles, (
            [c.network.image_names[int(c.observations[r.observation, 0])], target_name(c, r.observation),
             number(r.normalised, 3), r.reason] for r in a.rejected
        )))
    if a.rejected_distances or a.rejected_control:
        titles = ("observation", "coordinate", "difference [mm]", "residual / sigma")
        parts.append("<h2>Rejected distances and control points</h2>" + table(titles, [
            *((r.name, "", number(1e3 * r.residual_m, 3), number(r.normalised, 3)) for r in a.rejected_distances),
            *((r.name, "xyz"[r.coordinate], number(1e3 * r.residual_m, 3), number(r.normalised, 3))
              for r in a.rejected_control),
        ]))
    if a.left_out:
        parts.append(f"<h2>Left out: {len(a.left_out)}</h2>" + table(("", "reason"), (
            (one.name, one.reason) for one in a.left_out
        )))
    parts.append("<h2>Points and stations</h2>" + picture(figures.field_map(c), "map"))
    if c.network.point_names and c.known.ok:
        columns = ("point", "x [m]", "y [m]", "z [m]", "sigma x [mm]", "sigma y [mm]", "sigma z [mm]")
        parts.append(table(columns, point_rows(c)))
    return page(title, parts)
