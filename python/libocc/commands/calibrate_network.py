# SPDX-License-Identifier: Apache-2.0
import click

from ..calibration.network_file import read_network
from ..cli import blamed_on, json_option
from .calibrate_options import finish, ladder_option, out_option, robust_option, select_option


@click.command(short_help="Adjust a network that a file describes.")
@click.argument("file", metavar="NETWORK.yaml")
@out_option
@select_option
@ladder_option
@robust_option
@json_option
@click.pass_context
def command(ctx: click.Context, file: str, out: str, select: bool, ladder: bool, robust: bool, as_json: bool) -> None:
    """\b
    $ libocc calibrate network data/calibration/panorama/network.yaml --out calibrated
    ...

    Adjusts a network: cameras, where they stood, points and what was seen and measured, as
    data/calibration/README.md describes it. The folder gets report.html, result.json, camera files,
    points.csv, points.ply and images.csv. Exit code 0: adjusted; 1: not determined or not converged
    (the folder has the state so far); 2: bad input.
    """
    with blamed_on(file):
        network, datum = read_network(file)
    finish(ctx, network, datum, out=out, title=f"Network {file}", select=select, ladder=ladder, robust=robust, as_json=as_json,
           settings={"kind": "network", "file": file})
