# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import click
import numpy as np

import libocc as occ

from .. import Failure, error_context, json_option, print_json


@click.command(short_help="Measure points in calibrated images, with their covariance.")
@click.argument("network", metavar="NETWORK.yaml")
@click.argument("observations", metavar="POINTS.csv")
@click.option("--distance", type=(str, str), multiple=True, metavar="FROM TO",
              help="Also compute the distance between two points.")
@click.option("--out", required=True, metavar="FOLDER",
              help="Folder for points.csv, points.ply, result.json and report.html.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, network: str, observations: str, distance: tuple[tuple[str, str], ...], out: str, as_json: bool,
) -> None:
    """\b
    $ libocc measure panorama corners.csv --out measured
    corner 0 ...

    Measures points that are visible in at least two images: adjusts NETWORK and intersects the rays of
    POINTS.csv, including the covariance of cameras and stations. POINTS.csv (the path itself, or a file
    beside the network) is a table of `point`, `image`, `x_px`, `y_px` and optionally `sigma_x_px` and
    `sigma_y_px` (default 0.5). Exit code 0: all points are measured; 1: some are not; 2: bad input.
    """
    from ...network.files import read_network
    from ...samples import find_network
    from ..calibration.export import points_csv, points_ply
    from ..calibration.measure import ends_of, read_observations, report_html, summary
    from ..calibration.run import calibrate
    from ..result_folder import ResultFolder, json_bytes

    with error_context(network):
        path = find_network(network)
        start, datum = read_network(path)
    with error_context(observations):
        beside = path.parent / observations  # of a network that comes with libocc
        names, points = read_observations(Path(observations) if Path(observations).exists() else beside, start)
        pairs = ends_of(distance, names)
    with error_context(out):
        folder = ResultFolder(out, {"kind": "measure", "network": network, "observations": observations})
    found, _ = calibrate(start, datum)
    if not found.ok:
        raise Failure(f"{network}: {found.adjustment.message or found.known.message}")
    measured = occ.network.measure_points(found.network, points, found.known)
    data = summary(names, measured, pairs)
    good = [i for i, point in enumerate(measured.points) if point.status is occ.Status.ok]
    positions = np.array([measured.points[i].position_m for i in good]).reshape(-1, 3)
    covariances = np.array([measured.points[i].covariance_m2 for i in good]).reshape(-1, 3, 3)
    with error_context(out):
        folder.write("points.csv", points_csv([names[i] for i in good], positions, covariances))
        folder.write("points.ply", points_ply(positions, covariances))
        folder.write("result.json", json_bytes(data))
        folder.write("report.html", report_html(found, names, measured, data))
    if as_json:
        print_json(data)
    else:
        for line in lines(data):
            click.echo(line)
    if len(good) < len(names):
        ctx.exit(1)


def lines(data: dict[str, Any]) -> list[str]:
    text = []
    for point in data["points"]:
        if point["status"] != "ok":
            text.append(f"{point['name']}: {point['status']}")
            continue
        at = " ".join(f"{value:.5f}" for value in point["position_m"])
        sigma = " ".join(f"{1e3 * value:.2f}" for value in point["sigma_m"])
        text.append(f"{point['name']} {at} m, sigma {sigma} mm, {point['images']} images")
    for d in data["distances"]:
        if d["sigma_m"] is None:
            text.append(f"{d['from']} to {d['to']}: not measured")
        else:
            text.append(f"{d['from']} to {d['to']} {d['length_m']:.5f} m, sigma {1e3 * d['sigma_m']:.2f} mm")
    return text
