# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import click
import numpy as np

from ... import samples
from ...network.importing import format_of, import_network
from ...network.writing import network_files
from .. import error_context, json_option, print_json
from ..progress import progress


def find_source(source: str) -> Path:
    """Path of a file or folder, or of one that comes with libocc in data/calibration."""
    bundled = samples.FOLDER / "calibration" / source
    return bundled if bundled.exists() and not Path(source).exists() else Path(source)


@click.command(short_help="Convert a network of another program.")
@click.argument("source")
@click.option("--control", metavar="FILE", help="Control points for PhotoModeler: DBAT's table of id, label, x, y, z.")
@click.option("--target", metavar="FILE", help="Target for Kalibr: a grid of AprilTags or a chessboard.")
@click.option("--sigma-px", type=float, metavar="PX", help="Sigma of all image points, in place of those of the files.")
@click.option("--out", required=True, metavar="FOLDER", help="Folder for network.yaml and its tables.")
@json_option
def command(
    source: str, control: str | None, target: str | None, sigma_px: float | None, out: str, as_json: bool
) -> None:
    """\b
    $ libocc import-network kalibr/camchain.yaml --out imported
    kalibr: 2 cameras, 0 images, 0 points, 0 observations, 0 distances, 0 control
    note: the file has cameras and their mounts; add stations, images and observations
    imported/network.yaml

    Reads SOURCE, a network of another program, and writes it in libocc's format (data/calibration/README.md).

    \b
    SOURCE               program
    NAME.phc             AICON 3D Studio: NAME.ior, .eor, .obc, .phc and .scale
    FILE.txt             PhotoModeler, text export of the bundle solution
    FILE.xml             DBAT, script with its tables
    FOLDER               COLMAP, sparse model as .bin or .txt
    problem-*.txt[.bz2]  BAL, "Bundle Adjustment in the Large"
    camchain.yaml        Kalibr, cameras and mounts

    Prints what was assumed or left out. Exit code 0: written; 2: bad input.
    """
    from ..result_folder import ResultFolder

    with error_context(source), progress("reading", 1):
        imported = import_network(find_source(source), control=control, target=target, sigma_px=sigma_px)
        files = network_files(imported.network, imported.datum)
    with error_context(out):
        settings = {"kind": "import-network", "source": source, "control": control, "target": target,
                    "sigma_px": sigma_px}
        folder = ResultFolder(out, settings)
        for name, content in files.items():
            folder.write(name, content)
    n = imported.network
    data = {
        "format": format_of(find_source(source)), "cameras": len(n.cameras), "images": len(n.image_names),
        "points": len(n.point_names), "observations": len(np.asarray(n.observations)), "distances": len(n.distances),
        "control": len(n.control), "notes": imported.notes,
    }
    if as_json:
        print_json(data)
        return
    click.echo(f"{data['format']}: {', '.join(f'{data[key]} {key}' for key in list(data)[1:-1])}")
    for note in imported.notes:
        click.echo(f"note: {note}")
    click.echo(f"{out}/network.yaml")
