# SPDX-License-Identifier: Apache-2.0
"""Options and output shared by all kinds of calibration."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

import libocc as occ

from .. import Failure, error_context, json_option, print_json

if TYPE_CHECKING:  # matplotlib loads slowly
    from ..calibration.summary import Calibration

F = TypeVar("F", bound=Callable[..., Any])

out_option = click.option("--out", required=True, metavar="FOLDER", help="Folder for the report and all files.")
datum_option = click.option(
    "--datum", "datum_kind", type=click.Choice(["inner", "minimal", "control", "scale_only"]),
    help="Datum: fixes the translation, rotation and scale that the observations leave free; "
         "default: inner, over all points.",
)
ladder_option = click.option("--ladder", is_flag=True,
                             help="Add groups of parameters one by one and show sigma0 of each adjustment.")
select_option = click.option("--select", is_flag=True, help="Estimate only the parameters that the images determine.")
robust_option = click.option("--robust/--no-robust", default=True, show_default=True,
                             help="Handle gross errors: robust estimation, then data snooping.")


def adjustment_options(command: F) -> F:
    """Adds the options of every network adjustment."""
    for option in reversed((out_option, datum_option, select_option, ladder_option, robust_option, json_option)):
        command = option(command)
    return command


distance_option = click.option(
    "--distance", type=(str, str, float, float), multiple=True, metavar="FROM TO M SIGMA",
    help="Scale bar between two targets: \"tag 7.0\" (corner 0) or the name of a point.",
)


def add_distances(network: occ.network.Network, distances: Sequence[tuple[str, str, float, float]]) -> None:
    for start, end, length_m, sigma_m in distances:
        if not (length_m > 0 and sigma_m > 0):
            raise Failure(f"--distance: length and sigma must be positive, got {length_m:g} and {sigma_m:g}")
        network.add_distance(target_of(network, start), target_of(network, end), length_m, sigma_m)


def target_of(network: occ.network.Network, name: str) -> occ.network.Target:
    from ...network.files import target_named

    points = {point: i for i, point in enumerate(network.point_names)}
    bodies = {body: i for i, body in enumerate(network.body_names)}
    found = target_named(name, points, bodies, [len(corners) for corners in network.body_corners_m])
    if found is not None:
        return found
    known = ", ".join([*network.point_names, *(f"{body}.0" for body in network.body_names)][:8])
    raise Failure(f"--distance: no target is named {name!r}; existing targets: {known}")


def finish(
    ctx: click.Context, network: occ.network.Network, datum: occ.network.Datum, *, out: str, title: str,
    select: bool, robust: bool, as_json: bool, settings: dict[str, Any], notes: Sequence[str] = (),
    more: Callable[["Calibration"], dict[str, bytes]] | None = None, ladder: bool = False,
    checks: dict[str, Any] | None = None, before: occ.Camera | None = None, keep: Sequence[str] = (),
    text: Callable[[dict[str, Any]], list[str]] | None = None,
) -> None:
    """Adjusts the network, writes the folder and prints the result; exit code 1 when the adjustment failed.

    keep: parameters that `select` never drops. text: further lines of the text output. more: further files by their
    names.
    """
    from ..calibration.report import table
    from ..calibration.run import calibrate, ladder_section, write
    from ..result_folder import ResultFolder

    with error_context(out):
        folder = ResultFolder(out, {**settings, "select": select, "robust": robust})
    found, chosen = calibrate(network, datum, robust=robust, select=select, notes=notes, checks=checks, before=before,
                              keep=keep)
    sections = []
    if chosen is not None:
        sections.append("<h2>Selected parameters</h2>" + table(("dropped", "reason", "sigma0", "BIC"), [
            (step.dropped or "none", step.reason, f"{step.sigma0:.4g}", f"{step.bic:.6g}") for step in chosen.steps
        ]))
    with error_context(out):
        if ladder:
            sections.append(ladder_section(network, datum, found.network))
        data = write(folder, found, title, sections)
        for name, content in (more(found) if more else {}).items():
            folder.write(name, content)
    if as_json:
        print_json(data)
    else:
        for line in [*(text(data) if text and found.ok else []), *lines(data)]:
            click.echo(line)
        click.echo(f"{out}/report.html")
    if not found.ok:
        click.echo(f"{data['status']}: {data['message']}", err=True)
        ctx.exit(1)


def lines(data: dict[str, Any]) -> list[str]:
    """Text output: sigma0, then one line per parameter."""
    text = [
        f"sigma0 {data['sigma0']:.4g}, {data['observations']} observations, {data['unknowns']} unknowns, "
        f"redundancy {data['redundancy']}, datum defect {data['datum_defect']}, {len(data['rejected'])} rejected"
    ]
    if data["status"] == "ok" and data["message"]:
        text.append(data["message"])
    for p in data["parameters"]:
        sigma = "unknown" if p["sigma"] is None else f"{p['sigma']:.2g}"
        text.append(f"{p['camera']} {p['name']} {p['value']:.9g} +- {sigma} {p['unit']}")
    for k in data["variance_components"]:
        text.append(f"{k['camera']} sigmas of {k['axis']} x {k['factor']:.2f}")
    if data["check_points"]:
        check = data["check_points"]
        rmse_mm, predicted_mm = 1e3 * check["rmse_3d_m"], 1e3 * check["predicted_3d_m"]
        text.append(f"check points {rmse_mm:.2f} mm r.m.s., {predicted_mm:.2f} predicted")
    for camera in data["cameras"]:
        projection = camera["projection"]
        if projection is not None and projection["median_sigma_px"] is not None:
            undefined = f", undefined in {100 * (1 - projection['defined']):.0f} % of the image"
            text.append(
                f"{camera['name']}: sigma of a projected point {projection['median_sigma_px']:.2g} px (median), "
                f"{projection['max_sigma_px']:.2g} px (maximum)" + (undefined if projection["defined"] < 1 else "")
            )
        for a, b, rho in camera["strong_correlations"]:
            text.append(f"{camera['name']}: {a} and {b} are correlated by {rho:+.3f}")
    return text + [f"warning: {warning}" for warning in data["warnings"]]
