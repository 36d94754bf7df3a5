# SPDX-License-Identifier: Apache-2.0
import click

import libocc as occ

from ... import samples
from .. import error_context, json_option, overlay_option, print_json, report
from ..detect_options import Threshold, background_hint, stated_colours, threshold_of, threshold_option


@click.command(short_help="List the bright blobs of an image.")
@click.argument("image")
@click.option("--scene", metavar="SCENE",
              help="Scene whose sensor model (noise, row timing) and colours of lamps are used.")
@threshold_option
@json_option
@overlay_option
def command(
    image: str, scene: str | None, threshold_dn: Threshold, as_json: bool, overlay: str | None
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
    sensor, colours = None, []
    if scene is not None:
        with error_context(scene):
            loaded = samples.load_scene(scene)
            sensor, colours = loaded.sensor, stated_colours(loaded)
    with error_context(image):
        pixels = occ.read_image(samples.find_image(image))
        blobs = occ.detect(pixels, sensor=sensor, threshold_dn=threshold_of(pixels, threshold_dn), colours=colours)
    if overlay is not None:
        from ..overlay import draw

        with error_context(overlay):
            draw(overlay, pixels, blobs=blobs, title=f"{image}: {len(blobs)} blobs")
    if as_json:
        print_json([report.blob_dict(blob) for blob in blobs])
    else:
        click.echo(report.blobs_text(blobs))
    if hint := background_hint(pixels, blobs, threshold_dn):
        click.echo(f"warning: {image}: {hint}", err=True)
