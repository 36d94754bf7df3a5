# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

import libocc as occ

from .. import Failure, error_context
from .calibrate_options import add_distances, adjustment_options, distance_option, finish

# Additional parameters of Amiri Parian and Gruen (ISPRS J. 2010). ez_m is not among them: it is equivalent to a shift
# of the station. Tumbling is optional because most turntables have none.
FREE = ["angle_per_px_rad", "c_px", "cy_px", "tilt_x_rad", "tilt_y_rad", "ex_m", "ey_m", "k1", "k2"]
TUMBLING = [f"tumbling{i}_rad" for i in range(1, 7)]


@click.command(short_help="Calibrate a rotating line camera from panoramas of AprilTags.")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--tag-size", "tag_size_m", type=click.FloatRange(min=0, min_open=True), required=True, metavar="M",
              help="Side of the tags' black squares [m].")
@click.option("--free-sizes", is_flag=True, help="--tag-size is approximate; --distance gives the scale.")
@click.option("--family", default="tag36h11", show_default=True, help="Family of the tags.")
@click.option("--c-px", type=click.FloatRange(min=1), help="Initial camera constant over the pixel pitch.")
@click.option("--camera", "camera_path", metavar="CAMERA.yaml",
              help="Initial values of all parameters; replaces --c-px.")
@click.option("--tumbling", is_flag=True, help="Also estimate the tumbling of the turntable's axis.")
@distance_option
@adjustment_options
@click.pass_context
def command(
    ctx: click.Context, images: tuple[str, ...], tag_size_m: float, free_sizes: bool, family: str, c_px: float | None,
    camera_path: str | None, tumbling: bool, distance: tuple[Any, ...], out: str, datum_kind: str | None, select: bool,
    ladder: bool, robust: bool, as_json: bool,
) -> None:
    """Calibrates the rotating line camera that took the panoramas IMAGE... of a test field of AprilTags at
    unknown positions. Panoramas of any size are searched by tiles; .pgm and .npy files are read tile by
    tile. The size of the tags or distances give the scale.

    \b
    libocc calibrate panorama station*.pgm --tag-size 0.15 --c-px 4375 --out calibrated

    Exit code 0: calibrated; 1: not determined or not converged (the folder has the last state);
    2: bad input.
    """
    from ..calibration import pictures

    if (c_px is None) == (camera_path is None):
        raise Failure("give either --c-px or --camera")
    try:
        tags, sizes = pictures.find_tags(images, family)
        width, height = pictures.same_size(images, sizes)
    except (OSError, ValueError) as error:
        raise Failure(str(error)) from error
    if camera_path is not None:
        with error_context(camera_path):
            start = occ.read_camera(camera_path)
            if start.kind is not occ.CameraKind.rotating_line:
                raise ValueError(f"kind must be rotating_line, got {start.kind.name}")
            if (start.width, start.height) != (width, height):
                sizes_text = f"{start.width} x {start.height} px, the images have {width} x {height} px"
                raise ValueError(f"its size is {sizes_text}")
    else:
        assert c_px is not None
        start = occ.Camera.rotating_line(width=width, height=height, c_px=c_px)
    free = FREE + (TUMBLING if tumbling else [])
    started = pictures.network_of_tags(start, free, images, tags, family, tag_size_m, free_sizes)
    if not started.ok:
        raise Failure(f"{started.status.name}: {started.message}")
    add_distances(started.network, distance)
    finish(ctx, started.network, occ.network.Datum(kind=occ.network.DatumKind[datum_kind or "inner"]), out=out,
           title=f"Panorama camera from {len(images)} images",
           select=select, ladder=ladder, robust=robust, as_json=as_json, notes=started.warnings, before=start,
           settings={"kind": "panorama", "images": list(images), "tag_size_m": tag_size_m})
