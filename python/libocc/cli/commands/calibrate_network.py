# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import click

import libocc as occ

from ...network.files import read_network_and_checks
from ...network.importing import FORMATS, format_of, import_network
from ...samples import find_network
from .. import error_context
from ..progress import progress
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
    a file (data/calibration/README.md), the name of a network that comes with libocc, or a network of another
    program, as `libocc import-network` reads it (AICON, PhotoModeler, COLMAP, BAL). The folder has
    report.html, result.json, camera files, points.csv, points.ply and images.csv. Exit code 0: adjusted;
    1: not determined or not converged (the folder has the last state); 2: bad input.
    """
    notes: list[str] = []
    with error_context(file), progress("reading", 1):
        if Path(file).exists() and format_of(file) in FORMATS:
            imported = import_network(file)
            network, given, checks, notes = imported.network, imported.datum, imported.check_points, imported.notes
        else:
            network, given, checks = read_network_and_checks(find_network(file))
        datum = given if datum_kind is None else occ.network.Datum(kind=occ.network.DatumKind[datum_kind])
    finish(ctx, network, datum, out=out, title=f"Network {file}", checks=checks, select=select, ladder=ladder,
           notes=notes, robust=robust, as_json=as_json, settings={"kind": "network", "file": file})
