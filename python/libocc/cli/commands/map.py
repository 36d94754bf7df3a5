# SPDX-License-Identifier: Apache-2.0
import itertools
import tempfile
from pathlib import Path
from typing import Any

import click

from ... import samples
from ..._core import Rung
from ...maps import PowerMap, checked_rotation, plane_of, power_map, with_focal_length
from .. import INTERRUPTED, error_context, json_option, print_json
from ..files import whole_file
from ..maps import output
from ..progress import progress


def write(made: PowerMap, folder: Path, scene_name: str) -> None:
    """Writes the picture, the table and the arrays, each completely or not at all."""
    from ..maps import picture

    stem = folder / output.name_of(made)
    for ending, content in ((".csv", output.csv_bytes), (".npz", output.npz_bytes)):
        path = f"{stem}{ending}"
        with error_context(path), whole_file(path) as file:
            file.write(content(made))
    with error_context(f"{stem}.png"), whole_file(f"{stem}.png") as file:
        picture.draw(file, made, scene_name)


def ready_folder(path: str) -> Path:
    """Creates the folder if necessary and checks that files can be written there."""
    with error_context(path):
        Path(path).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    return Path(path)


@click.command(short_help="Compute the power that a camera receives over a plane.")
@click.argument("scene")
@click.option("--height", "height_m", type=float, metavar="Z",
              help="Height of the plane [m]; default: half the height of the room.")
@click.option("--extent", "extent_m", type=float, nargs=4, metavar="X0 X1 Y0 Y1",
              help="Extent of the plane [m]; default: the floor of the room.")
@click.option("--step", "step_m", type=float, default=0.05, show_default=True, help="Step of the grid [m].")
@click.option("--rotation", "rotations", type=float, nargs=3, multiple=True, metavar="ROLL PITCH YAW",
              help="Rotation of the camera from facing up [degrees]; repeatable.")
@click.option("--focal-mm", "focals", type=float, multiple=True, metavar="F",
              help="Focal length; replaces that of the scene; repeatable.")
@click.option("--bound", type=click.Choice([*Rung.__members__, "none"]), default="centres", show_default=True,
              help="Observations of the Cramer-Rao bound of the position.")
@click.option("--out", default="map", show_default=True, metavar="FOLDER",
              help="Folder for the files; created if missing.")
@json_option
@click.pass_context
def command(
    ctx: click.Context, scene: str, height_m: float | None, extent_m: tuple[float, float, float, float] | None,
    step_m: float, rotations: tuple[tuple[float, float, float], ...], focals: tuple[float, ...], bound: str,
    out: str, as_json: bool,
) -> None:
    """\b
    $ libocc map kookmin_four_lamps --height 1.2 --step 0.25
    f 1.4 mm, rotation 0 0 0: lamps at 100 % of the points, -47.10 to -41.06 dBm; bound at 46.7 %, median 0.166 mm
      map/f1.4_roll0_pitch0_yaw0.png, .csv, .npz

    Maps the light that the camera of SCENE receives from the lamps at each point of a horizontal plane:
    the power through its lens [dBm], the number of visible lamps, and the Cramer-Rao bound of its
    position. Each rotation with each focal length gives the files f..._roll..._pitch..._yaw....png,
    .csv and .npz in FOLDER. The camera faces up, with the image's +x axis along the world's +x and the
    image's +y axis along the world's +y, and is then rotated (right-handed) about the world's x (roll),
    y (pitch) and z (yaw). Ctrl-C keeps the finished maps. SCENE is a YAML file or the name of a scene
    that comes with libocc.
    """
    with error_context(scene):
        loaded = samples.load_scene(scene)
        rows = len(plane_of(loaded, height_m, step_m, extent_m).y_m)
        lenses = [with_focal_length(loaded, focal_mm) for focal_mm in focals] or [loaded]
        all_rotations = [checked_rotation(rotation) for rotation in rotations or ((0.0, 0.0, 0.0),)]
    views = list(itertools.product(lenses, all_rotations))
    folder = ready_folder(out)
    done: list[dict[str, Any]] = []
    interrupted = False
    try:
        with progress("mapping", len(views) * rows) as advance:
            for lens, rotation in views:
                made = power_map(
                    lens, height_m=height_m, step_m=step_m, extent_m=extent_m, rotation_deg=rotation,
                    rung=None if bound == "none" else Rung[bound], advance=advance,
                )
                write(made, folder, samples.find_scene(scene).stem)
                done.append({**output.summary(made), "files": str(folder / output.name_of(made))})
    except KeyboardInterrupt:
        interrupted = True
    if as_json:
        print_json(done)
    for data in () if as_json else done:
        click.echo(output.sentence(data))
        click.echo(f"  {data['files']}.png, .csv, .npz")
    if interrupted:
        click.echo(f"interrupted: {len(done)} of {len(views)} maps are in {out}", err=True)
        ctx.exit(INTERRUPTED)
