# SPDX-License-Identifier: Apache-2.0
import click

import libocc as occ

from ...network.files import read_network_and_checks
from ...samples import find_network
from .. import error_context
from .calibrate_options import adjustment_options, finish


@click.command(short_help="Adjust a photogrammetric network from a file.")
@click.argument("file", metavar="NETWORK.yaml")
@adjustment_options
@click.pass_context
def command(
    ctx: click.Context, file: str, out: str, datum_kind: str | None, select: bool, ladder: bool, robust: bool,
    as_json: bool,
) -> None:
    """\b
    $ libocc calibrate network panorama --out calibrated
    sigma0 1.016, 1141 observations, 399 unknowns, redundancy 748, datum defect 6, 6 rejected
    ...

    Adjusts a network: cameras, their poses, points, image observations and measured distances. NETWORK is
    a file (data/calibration/README.md) or the name of a network that comes with libocc. The folder has
    report.html, result.json, camera files, points.csv, points.ply and images.csv. Exit code 0: adjusted;
    1: not determined or not converged (the folder has the last state); 2: bad input.
    """
    with error_context(file):
        network, given, checks = read_network_and_checks(find_network(file))
        datum = given if datum_kind is None else occ.network.Datum(kind=occ.network.DatumKind[datum_kind])
    finish(ctx, network, datum, out=out, title=f"Network {file}", checks=checks, select=select, ladder=ladder,
           robust=robust, as_json=as_json, settings={"kind": "network", "file": file})
