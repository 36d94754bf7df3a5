# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import click

import libocc as occ

from ...network.files import read_network_and_checks
from ...network.importing import FORMATS, format_of, import_network
from ...samples import find_network
from .. import Failure, error_context
from ..progress import progress
from .calibrate_options import adjustment_options, finish


@click.command(short_help="Adjust a photogrammetric network from a file.")
@click.argument("file", metavar="NETWORK.yaml")
@adjustment_options
@click.option("--sigma-px", type=float, metavar="PX",
              help="Sigma of all image points of another program's network, in place of those of its files.")
@click.pass_context
def command(
    ctx: click.Context, file: str, sigma_px: float | None, out: str, datum_kind: str | None, select: bool, ladder: bool,
    robust: bool, as_json: bool,
) -> None:
    """\b
    $ libocc calibrate network panorama --out calibrated
    sigma0 1.016, 1141 observations, 399 unknowns, redundancy 748, datum defect 6, 6 rejected
    ...

    Adjusts a network: cameras, their poses, points, image observations and measured distances. NETWORK is
    a file (data/calibration/README.md), the name of a network that comes with libocc, or a network of another
    program, as `libocc import-network` reads it (AICON, PhotoModeler, DBAT, COLMAP, BAL). The folder has
    report.html, result.json, camera files, points.csv, points.ply and images.csv. Exit code 0: adjusted;
    1: not determined or not converged (the folder has the last state); 2: bad input.
    """
    notes: list[str] = []
    with error_context(file), progress("reading", 1):
        if Path(file).exists() and format_of(file) in FORMATS:
            imported = import_network(file, sigma_px=sigma_px)
            network, given, checks, notes = imported.network, imported.datum, imported.check_points, imported.notes
        elif sigma_px is not None:
            raise Failure("--sigma-px: is used with networks of other programs only; this file states its sigmas")
        elif Path(file).is_dir():
            raise ValueError(f"is a folder without a network of {', '.join(FORMATS)}; give the file of the network")
        else:
            network, given, checks = read_network_and_checks(find_network(file))
        datum = given if datum_kind is None else occ.network.Datum(kind=occ.network.DatumKind[datum_kind])
    finish(ctx, network, datum, out=out, title=f"Network {file}", checks=checks, select=select, ladder=ladder,
           notes=notes, robust=robust, as_json=as_json,
           settings={"kind": "network", "file": file, "sigma_px": sigma_px})
