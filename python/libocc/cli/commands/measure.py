# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from .. import Failure, blamed_on, emit_json, json_option


@click.command(short_help="Measure points that calibrated pictures show, with covariance.")
@click.argument("network", metavar="NETWORK.yaml")
@click.argument("sightings", metavar="POINTS.csv")
@click.option("--distance", type=(str, str), multiple=True, metavar="FROM TO", help="Also between these two points.")
@click.option("--out", required=True, metavar="FOLDER", help="Gets points.csv, points.ply, result.json, report.html.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, network: str, sightings: str, distance: tuple[tuple[str, str], ...], out: str, as_json: bool,
) -> None:
    """\b
    $ libocc measure panorama corners.csv --out measured
    corner 0 ...

    Measures points from where two or more pictures show them: adjusts NETWORK, whose cameras and
    stations then count with their covariance, and intersects the rays of POINTS.csv (there or beside
    the network), a table of `point`, `image`, `x_px`, `y_px` and, if not 0.5 px, `sigma_x_px`,
    `sigma_y_px`. Exit code 0: all points are measured; 1: some are not; 2: bad input.
    """
    from ...network.files import read_network
    from ...samples import find_network
    from ..calibration.export import points_csv, points_ply
    from ..calibration.measure import ends_of, read_sightings, report_html, summary
    from ..calibration.run import calibrate
    from ..result_folder import ResultFolder, json_bytes

    with blamed_on(network):
        path = find_network(network)
        start, datum = read_network(path)
    with blamed_on(sightings):
        beside = path.parent / sightings  # of a network that comes with libocc
        names, points = read_sightings(Path(sightings) if Path(sightings).exists() else beside, start)
        pairs = ends_of(distance, names)
    with blamed_on(out):
        folder = ResultFolder(out, {"kind": "measure", "network": network, "sightings": sightings})
    found, _ = calibrate(start, datum)
    if not found.ok:
        raise Failure(f"{network}: {found.adjustment.message or found.known.message}")
    measured = occ.network.measure_points(found.network, points, found.known)
    data = summary(names, measured, pairs)
    good = [i for i, point in enumerate(measured.points) if point.status is occ.Status.ok]
    positions = np.array([measured.points[i].position_m for i in good]).reshape(-1, 3)
    covariances = np.array([measured.points[i].covariance_m2 for i in good]).reshape(-1, 3, 3)
    with blamed_on(out):
        folder.write("points.csv", points_csv([names[i] for i in good], positions, covariances))
        folder.write("points.ply", points_ply(positions, covariances))
        folder.write("result.json", json_bytes(data))
        folder.write("report.html", report_html(found, names, measured, data))
    if as_json:
        emit_json(data)
    else:
        for line in lines(data):
            click.echo(line)
    if len(good) < len(names):
        ctx.exit(1)


def lines(data: dict[str, Any]) -> list[str]:
    told = []
    for point in data["points"]:
        if point["status"] != "ok":
            told.append(f"{point['name']}: {point['status']}")
            continue
        at = " ".join(f"{value:.5f}" for value in point["position_m"])
        sigma = " ".join(f"{1e3 * value:.2f}" for value in point["sigma_m"])
        told.append(f"{point['name']} {at} m, sigma {sigma} mm, {point['images']} images")
    for d in data["distances"]:
        if d["sigma_m"] is None:
            told.append(f"{d['from']} to {d['to']}: not measured")
        else:
            told.append(f"{d['from']} to {d['to']} {d['length_m']:.5f} m, sigma {1e3 * d['sigma_m']:.2f} mm")
    return told
