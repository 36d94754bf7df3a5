# SPDX-License-Identifier: Apache-2.0
import click

import libocc as occ

from ... import samples
from .. import blamed_on, emit_json, json_option, overlay_option, report


@click.command(short_help="List the bright blobs of an image.")
@click.argument("image")
@click.option("--scene", metavar="SCENE", help="Take the sensor from this scene: noise, blink codes.")
@click.option("--threshold-dn", type=float, help="Absolute threshold instead of the noise-based one.")
@json_option
@overlay_option
def command(
    image: str, scene: str | None, threshold_dn: float | None, as_json: bool, overlay: str | None
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --seed 1 --out room.png
    ...
    $ libocc detect room.png
     n      x px      y px  sigma px      flux dn  area px  what
     0   279.267   279.739    0.0031       127616     1121
    ...

    Lists the bright blobs of IMAGE, brightest first.
    """
    sensor = None
    if scene is not None:
        with blamed_on(scene):
            sensor = samples.load_scene(scene).sensor
    with blamed_on(image):
        pixels = occ.read_image(image)
        blobs = occ.detect(pixels, sensor=sensor, threshold_dn=threshold_dn)
    if overlay is not None:
        from ..overlay import draw

        with blamed_on(overlay):
            draw(overlay, pixels, blobs=blobs, title=f"{image}: {len(blobs)} blobs")
    if as_json:
        emit_json([report.blob_dict(blob) for blob in blobs])
    else:
        click.echo(report.blobs_text(blobs))
