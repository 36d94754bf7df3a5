# SPDX-License-Identifier: Apache-2.0
import click

import libocc as occ

from ... import samples
from .. import error_context, json_option, overlay_option, print_json, report
from ..detect_options import Threshold, background_hint, threshold_of, threshold_option
from ..picture_camera import camera_dict, camera_option, camera_text, growth_by_camera, scene_of_picture
from ..prior_options import given, prior_options


@click.command(short_help="Compute the pose of the camera from one image.")
@click.argument("image")
@click.argument("scene")
@camera_option
@prior_options
@click.option("--budget-ms", type=float, help="Time limit of the call: use the most accurate rung that meets it.")
@click.option("--target-mm", type=float, help="Position error to reach: use the fastest rung that meets it.")
@click.option("--costs", metavar="FILE.yaml", help="Costs of the rungs on this machine, from libocc ladder --costs.")
@click.option(
    "--protection", metavar="RISK", type=click.FloatRange(0, 1, min_open=True, max_open=True),
    help="Add the protection level at this risk, such as 1e-7.",
)
@threshold_option
@json_option
@overlay_option
@click.pass_context
def command(
    ctx: click.Context,
    image: str,
    scene: str,
    camera_name: str | None,
    prior: occ.Prior,
    budget_ms: float | None,
    target_mm: float | None,
    costs: str | None,
    protection: float | None,
    threshold_dn: Threshold,
    as_json: bool,
    overlay: str | None,
) -> None:
    """\b
    $ libocc simulate irregular_six --position 1.7 2.1 0.5 --seed 1 --out room.png
    ...
    $ libocc locate room.png irregular_six
    status    ok
    position    1.7000   2.1000   0.5000 m
    sigma         0.05     0.05     0.02 mm
    heading       0.00 deg
    lamps     0 1 2 3 4 5
    rms       0.006 px
    risk      below 1e-9
    exact     camera and map, by the scene: the sigma is that of the image alone
    time      1.2 ms (detect 0.7, identify 0.2, refine 0.3)

    Computes the pose of the camera that took IMAGE of the lamps of SCENE, a YAML file or the name of a
    scene that comes with libocc. A picture of a camera that was not calibrated needs EXIF data
    (--camera exif). Exit code 0: one pose fits, and it is wrong with a probability of at
    most 1e-4 (the risk); 1: none, several (all are printed), or --budget-ms and --target-mm are not
    met; 2: bad input.
    """
    table = occ.bench.RungCosts()
    if costs is not None:
        with error_context(costs):
            table = occ.bench.RungCosts.load(costs)
    lamps, focal = scene_of_picture(scene, camera_name, image)
    with error_context(image):
        pixels = occ.read_image(samples.find_image(image))
        fix = occ.locate(
            pixels, lamps, given(prior), costs=table, threshold_dn=threshold_of(pixels, threshold_dn),
            budget_s=None if budget_ms is None else 1e-3 * budget_ms,
            target_sigma_m=None if target_mm is None else 1e-3 * target_mm,
        )
    if overlay is not None:
        from ..overlay import draw_fix

        with error_context(overlay):
            draw_fix(overlay, pixels, fix, lamps, title=image)
    growth = growth_by_camera(fix, lamps) if focal is not None and fix.candidates else None
    if as_json:
        found = report.fix_dict(fix) if protection is None else report.fix_dict(fix, protection)
        print_json({**found, "camera": None if focal is None else camera_dict(focal, lamps, growth)})
    else:
        explain = budget_ms is not None or target_mm is not None
        click.echo(report.fix_text(fix, explain, protection))
        if focal is not None:
            click.echo(camera_text(focal, growth))
    if not fix.ok:
        if hint := background_hint(pixels, fix.blobs, threshold_dn, len(lamps.lamps)):
            click.echo(f"warning: {image}: {hint}", err=True)
        ctx.exit(1)
