# SPDX-License-Identifier: Apache-2.0
from typing import Any

import click

import libocc as occ

from ... import samples
from .. import error_context, json_option, overlay_option, print_json, report
from ..detect_options import Threshold, background_hint, stated_colours, threshold_of, threshold_option
from ..prior_options import given, prior_options


@click.command(short_help="Identify the lamps in an image.")
@click.argument("image")
@click.option("--map", "scene", required=True, metavar="SCENE", help="Scene with the lamps and the camera.")
@click.option("--sigma-px", type=float, help="Error of the camera model and the map, sigma  [default: 0.5].")
@click.option("--method", type=click.Choice([m.name for m in occ.IdentifyMethod]), default="automatic",
              show_default=True, help="Search method.")
@threshold_option
@prior_options
@json_option
@overlay_option
@click.pass_context
def command(
    ctx: click.Context,
    image: str,
    scene: str,
    sigma_px: float | None,
    method: str,
    threshold_dn: Threshold,
    prior: occ.Prior,
    as_json: bool,
    overlay: str | None,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --seed 1 --out room.png
    ...
    $ libocc identify room.png --map irregular_six
    status  ok
    risk    below 1e-9
    pose    position [m]               heading  probability   chi2  missed  lamps (blob: lamp)
    1        1.700     2.100     0.500    0.00            1    0.0       0  0:5 1:4 2:2 3:3 4:0 5:1

    Assigns the blobs of IMAGE to the lamps of the map, a YAML file or the name of a scene that comes
    with libocc, and lists every pose that explains the image, the most probable first. The risk is the
    probability that the first is wrong. The poses are computed from the blobs' centroids; libocc locate
    refines them. Exit code 0: one pose; 1: none, or several; 2: bad input.
    """
    with error_context(scene):
        lamps = samples.load_scene(scene)
    with error_context(image):
        pixels = occ.read_image(samples.find_image(image))
        camera = lamps.camera
        height, width = pixels.shape[:2]
        if (width, height) != (camera.width, camera.height):
            raise ValueError(
                f"its size is {width} x {height}, that of the camera of {scene} is {camera.width} x {camera.height}"
            )
        blobs = occ.detect(
            pixels, sensor=lamps.sensor, threshold_dn=threshold_of(pixels, threshold_dn), colours=stated_colours(lamps)
        )
    options: dict[str, Any] = {"method": occ.IdentifyMethod[method]}
    if sigma_px is not None:
        options["gate_model_sigma_px"] = sigma_px
    with error_context("--sigma-px"):
        found = occ.identify(blobs, lamps, given(prior), **options)
    if overlay is not None:
        from ..overlay import draw_identification

        with error_context(overlay):
            draw_identification(overlay, pixels, blobs, found, lamps, title=image)
    if as_json:
        print_json(report.identification_dict(found, lamps))
    else:
        click.echo(report.identification_text(found, lamps))
    if found.status is not occ.Status.ok:
        if hint := background_hint(pixels, blobs, threshold_dn, len(lamps.lamps)):
            click.echo(f"warning: {image}: {hint}", err=True)
        ctx.exit(1)
