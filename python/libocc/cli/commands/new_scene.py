# SPDX-License-Identifier: Apache-2.0
import math
import os
from pathlib import Path

import click

import libocc as occ

from .. import Failure, error_context
from ..exif import EXPOSURE_TIME, F_NUMBER, camera_tags, focal_length, positive, stored_size, zoom
from ..files import whole_file
from ..room_file import (
    DEFAULT_RADIUS_M,
    SHAPES,
    CameraSection,
    Exposure,
    camera_of_file,
    camera_of_values,
    lamp_centres,
    room_text,
    typical_camera,
)

MAX_LAMPS = 200  # more are better listed by a program


def camera_of_picture(path: str) -> tuple[CameraSection, list[str]]:
    """Camera with the size and focal length of a picture, and warnings."""
    width, height = stored_size(path)
    tags = camera_tags(path)
    found = focal_length(tags, width, height)
    warnings = []
    if zoom(tags) > 1:
        warnings.append(f"{path}: was taken with a digital zoom of {zoom(tags):g}; take all pictures without zoom")
    if found is None:
        warnings.append(f"{path}: has no focal length in its EXIF data; camera.fx_px is a guess: calibrate the camera")
        return typical_camera(width, height), warnings
    accuracy = f"accurate to about {100 * found.sigma_px / found.px:.0f} %"
    name = Path(path).name
    origin = f"From {name} (EXIF {found.source}), {accuracy}."
    return camera_of_values(width, height, found.px, found.sigma_px, origin), warnings


def exposure_of_picture(path: str) -> Exposure:
    """Exposure settings in the EXIF data, or the defaults."""
    tags, default = camera_tags(path), Exposure()
    return Exposure(
        positive(tags.get(EXPOSURE_TIME)) or default.exposure_s, positive(tags.get(F_NUMBER)) or default.f_number
    )


def camera_section(out: str, camera_path: str | None, picture: str | None) -> tuple[CameraSection, list[str]]:
    """The camera of a file, of a picture, or a typical one; with warnings."""
    if camera_path is None:
        if picture is None:
            return typical_camera(), []
        with error_context(picture):
            return camera_of_picture(picture)
    with error_context(camera_path):
        camera = occ.read_camera(camera_path)
    if picture is not None:
        with error_context(picture):
            width, height = stored_size(picture)
        if (width, height) != (camera.width, camera.height):
            raise Failure(
                f"{picture}: its size is {width} x {height} px, that of {camera_path} is "
                f"{camera.width} x {camera.height} px"
            )
    relative = os.path.relpath(camera_path, Path(out).resolve().parent)
    return camera_of_file(Path(relative).as_posix(), camera.width, camera.height), []


@click.command(short_help="Write an annotated scene file of a room, to be filled in.")
@click.option("--out", required=True, metavar="FILE.yaml", help="The scene file.")
@click.option(
    "--size",
    "size_m",
    type=click.FloatRange(min=0, min_open=True),
    nargs=3,
    default=(4, 4, 3),
    show_default=True,
    metavar="X Y Z",
    help="Size of the room along x, y and z [m].",
)
@click.option(
    "--lamps",
    type=click.IntRange(1, MAX_LAMPS),
    default=6,
    show_default=True,
    metavar="N",
    help="Number of ceiling lamps.",
)
@click.option(
    "--lamp",
    "centres",
    type=float,
    nargs=3,
    multiple=True,
    metavar="X Y Z",
    help="Measured centre of a lamp [m], for each lamp; replaces --lamps.",
)
@click.option(
    "--radius",
    "radius_m",
    type=click.FloatRange(0, 10, min_open=True),
    default=DEFAULT_RADIUS_M,
    show_default=True,
    metavar="M",
    help="Radius of the lit discs [m].",
)
@click.option("--shape", type=click.Choice(SHAPES), default="disc", show_default=True, help="Shape of the lamps.")
@click.option(
    "--camera", "camera_path", metavar="FILE.yaml", help="Camera file, such as camera.yaml of libocc calibrate camera."
)
@click.option(
    "--picture",
    metavar="IMAGE",
    help="Picture of the camera: its size, and exposure and focal length from its EXIF data.",
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(
    out: str,
    size_m: tuple[float, float, float],
    lamps: int,
    centres: tuple[tuple[float, float, float], ...],
    radius_m: float,
    shape: str,
    camera_path: str | None,
    picture: str | None,
    force: bool,
) -> None:
    """\b
    $ libocc new-scene --out room.yaml
    room.yaml: 6 lamps, camera of 4000 x 3000 px
    $ libocc simulate room.yaml --position 2 2 0.5 --out view.png
    view.png: 4000 x 3000, uint8; truth in view.json
    ...

    Writes a scene file of a room with lamps on its ceiling. Each key has a comment: its meaning, its
    unit, how to measure it, and its effect if it is omitted. The file can be used as it is; replace the
    values by those of your room. The lamps have no symmetry, so that a picture of all of them has one
    pose. Without --camera and --picture, the camera is that of a typical phone.
    """
    if not all(map(math.isfinite, size_m)):
        raise Failure(f"--size: must be finite, got {' '.join(f'{side:g}' for side in size_m)}")
    for centre in centres:
        if not all(0 <= value <= side for value, side in zip(centre, size_m)):
            raise Failure(
                f"--lamp {' '.join(f'{value:g}' for value in centre)}: is outside the room of "
                f"{' x '.join(f'{side:g}' for side in size_m)} m; --size gives the room"
            )
    if len(set(centres)) < len(centres):
        raise Failure("--lamp: two lamps have the same centre")
    section, warnings = camera_section(out, camera_path, picture)
    exposure = Exposure()
    if picture is not None:
        with error_context(picture):
            exposure = exposure_of_picture(picture)
    if Path(out).exists() and not force:
        raise Failure(f"{out}: exists already; --force replaces it")
    places = [list(centre) for centre in centres] or lamp_centres(lamps, size_m)
    text = room_text(Path(out).name, size_m, places, shape, section, exposure, radius_m, are_measured=bool(centres))
    with error_context(out), whole_file(out) as file:
        file.write(text.encode())
    for warning in warnings:
        click.echo(f"warning: {warning}", err=True)
    count = "1 lamp" if len(places) == 1 else f"{len(places)} lamps"
    click.echo(f"{out}: {count}, camera of {section.width} x {section.height} px")
